# SPDX-License-Identifier: GPL-2.0-or-later
"""The scripts behind `make validate`, `verify`, `compare` and `bench` take too long to run here; that they find each other and write
their rows is tested."""
import json
import sys

import pytest

from conftest import BUILD, ROOT, execute

SCRIPTS = sorted(path for folder in ("validation", "verify", "compare", "bench") for path in (ROOT / "tests" / folder).glob("*.py")
                 if "yade" not in path.stem)  # those run inside YADE


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_modules_are_found(path):
    code, output = execute([sys.executable, "-c", f"import {path.stem}"], cwd=path.parent)
    assert code == 0, output


@pytest.mark.skipif(not (BUILD / "tests" / "test_grain_heat").exists(), reason="the unit tests are not built (make test-scenes)")
def test_rows_of_pair_conductances(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "validation"))
    import report
    import thermal_pairs

    monkeypatch.setattr(report, "FOLDER", tmp_path)
    (tmp_path / "report.json").write_text(json.dumps([{"case": "another", "quantity": "kept"}, {"case": "pair conductances"}]))
    with pytest.raises(SystemExit) as end:
        thermal_pairs.main()
    rows = json.loads((tmp_path / "report.json").read_text())
    assert end.value.code == 0
    assert [row["case"] for row in rows].count("another") == 1 and len(rows) > len(thermal_pairs.MODELS)
    assert all(row["pass"] and set(row) == {"case", "quantity", "error", "bound", "pass", "seconds"} for row in rows[1:])
