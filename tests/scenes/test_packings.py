# SPDX-License-Identifier: GPL-2.0-or-later
"""Packings from the stock LIGGGHTS script of the examples and from dempm-pack."""
import re

import pytest

from conftest import BUILD, ROOT, execute

PAPER = "radius 0.0025 0.005 density 2650 kn 1e6 kt 1e6 thickness 0.075"


@pytest.fixture
def pack(tmp_path):
    def run(words, check=True):
        code, output = execute([BUILD / "dempm-pack", *words.split()], cwd=tmp_path, timeout=120)
        assert code == 0 or not check, output
        return (code, output) if not check else dict(re.findall(r"^(\w[\w ]*\w) {2,}(.*)$", output, re.MULTILINE))

    return run


def test_stock_script_makes_a_packing_that_is_read_from_all_its_files(liggghts, pack):
    run = liggghts(ROOT / "examples" / "packings" / "in.packing", timeout=180)
    table = run.table
    # LIGGGHTS shortens its column names. The servo stops within 0.2 % of 10 kPa x 0.075 m; coming to rest moves the stress a little.
    assert table["stress[1"][-1] == pytest.approx(750, rel=5e-3)
    assert table["stress[2"][-1] == pytest.approx(750, rel=5e-3)
    for kind in ("", ".restart", ".dump"):
        found = pack(f"info packing.data{kind} dimension 2")
        assert found["grains"] == "200"
        # TM-DEMPM: 0.243 to 0.251 for 400 grains; one packing of 200 scatters by 0.01.
        assert float(found["void ratio"]) == pytest.approx(0.247, abs=0.03)
        assert 2.5 < float(found["coordination"]) < 3.4
    pack("convert packing.data.restart loose.packing dimension 2 kt 1e6")
    found = pack("info loose.packing dimension 2")
    assert found["history"] == f"{found['contacts']} tangential forces"
    assert (run.path / "packing.data.vtk").exists()


def test_generated_packing_is_described_alike_when_it_is_read_again(pack):
    made = pack(f"generate a.packing pressure 1e5 preparation_friction 0.5 {PAPER}")
    read = pack("info a.packing dimension 2")
    del made["made in"]
    assert made == read and made["grains"] == "400" and made["motion"] == "at rest"


@pytest.mark.parametrize("words, message", [
    ("generate x", "keyword density is missing"),
    ("generate x radius 1 2 density 1 kn 1 kt 1 pressure 1 preparation_friction 0", "keyword thickness is missing"),
    (f"generate x pressure 1e5 {PAPER}", "keyword preparation_friction is missing"),
    (f"generate x pressure -1 preparation_friction 0.5 {PAPER}", "pressure = -1 (allowed: > 0)"),
    ("generate x radius 1", "radius: 2 value(s) must follow"),
    ("generate x grains many", "grains: found 'many'; a number is needed"),
    ("generate x grains 40.5", "grains: found '40.5'; an integer from 0 to 2e+09 is needed"),
    ("generate x grain cube", "grain: found 'cube'; disk or sphere is allowed"),
    ("generate x seed 1 seed 2", "keyword seed is given twice"),
    ("generate x colour red", "unknown keyword 'colour'"),
    ("info x", "keyword dimension is missing"),
    ("info x dimension 2", "cannot open packing file x: No such file or directory"),
    ("info x dimension 4", "dimension 4; 2 or 3 is allowed"),
    ("convert x y dimension 2 kt -1", "kt = -1 (allowed: >= 0)"),
])
def test_wrong_requests_are_refused(pack, words, message):
    code, output = pack(words, check=False)
    assert code == 1 and "dempm-pack: ERROR: " in output and message in output


def test_command_line_that_is_not_understood_shows_the_usage(pack):
    code, output = pack("bake x", check=False)
    assert code == 2 and "dempm-pack generate FILE" in output
