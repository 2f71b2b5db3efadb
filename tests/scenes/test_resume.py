# SPDX-License-Identifier: GPL-2.0-or-later
"""A run of `make verify-full` that is cut goes on from its last restart file, to the last bit."""
import json
import pathlib
import sys

import pytest
from scripts import elastic_block

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "verify"))
import resume  # noqa: E402
import study as studies  # noqa: E402

SCRIPT = """variable steps index 1400
""" + elastic_block() + """
thermo 100
thermo_style custom step time f_mpm[5] f_mpm[14] f_ram[8]
thermo_modify format float %.17g
fix mean all ave/time 1 100 100 f_mpm[5] file out/mean.txt
dump d all custom 100 out/field.dump id x y vx vy f_mpm[1] f_mpm[30]
dump_modify d sort id format "%d %.17g %.17g %.17g %.17g %.17g %.0f"
run ${steps}
"""


class Cut(Exception):
    pass


@pytest.mark.parametrize("damage", [False, True])
def test_a_run_that_is_cut_goes_on_to_the_last_bit(damage, tmp_path, monkeypatch):
    """Killed when its second restart file is there; with `damage` the newer of both is half a file."""
    script = tmp_path / "in.block"
    script.write_text(SCRIPT)
    whole = studies.Study("whole", tmp_path, True).run("block", "in.block", files=[script], threads=1)
    cut = studies.Study("cut", tmp_path, True)

    def kill(name, path, start, last, told, process):
        files = resume.restart_files(path)
        if last is None and len(files) == 2 and resume.present_step((path / "log.liggghts").read_text()) >= 500:
            process.kill()
        return told

    monkeypatch.setattr(cut, "tell_progress", kill)
    with pytest.raises(RuntimeError):
        cut.run("block", "in.block", files=[script], threads=1)
    path = tmp_path / "cut" / "block"
    part = json.loads((path / "begun.json").read_text())
    assert 0.0 < part["processor"] <= 4.0 * part["seconds"]
    newest = resume.restart_files(path)[0]
    if damage:
        newest.write_bytes(newest.read_bytes()[: newest.stat().st_size // 2])
    again = cut.run("block", "in.block", files=[script], threads=1)
    assert again.processor > part["processor"] and again.seconds > part["seconds"]
    assert (path / "in.resumed").exists() and not list(path.glob("part.*")) and not resume.restart_files(path)
    assert again.table["Step"] == list(range(0, 1401, 100))
    for column, values in whole.table.items():
        assert again.table[column] == (pytest.approx(values) if column == "Time" else values), column
    assert again.dump("out/field.dump") == whole.dump("out/field.dump")
    assert (path / "out/mean.txt").read_text() == (whole.path / "out/mean.txt").read_text()
