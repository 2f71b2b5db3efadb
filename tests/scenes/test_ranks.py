# SPDX-License-Identifier: GPL-2.0-or-later
"""The number of ranks changes nothing, to the last bit."""
import re

import pytest
from scripts import BOX, ELASTIC, POINTS, state, state_dump

RUN = state_dump(250) + """
thermo 250
thermo_style custom step f_mpm[1] f_mpm[5] f_mpm[7] f_floor[2] f_ram[1]
thermo_modify format float %.17g
run 500
"""


def scene(boundary, transfer, extra=""):
    return BOX.format(boundary=boundary) + POINTS + ELASTIC.format(transfer=transfer, extra=extra) + RUN


@pytest.mark.parametrize("transfer, extra", [("flip 0.99", ""), ("apic", ""), ("xpic 3", ""), ("flip 0.99", "volumetric cell")])
def test_points_are_equal_on_1_2_3_4_ranks(transfer, extra, dempm, tmp_path):
    """The floor, a moving box and 3 or 4 parts of the domain, which cut cells; points migrate."""
    one = dempm(scene("f f", transfer, extra), cwd=tmp_path / "1")
    for np in (2, 3, 4):
        many = dempm(scene("f f", transfer, extra), np=np, cwd=tmp_path / str(np))
        for step in (0, 250, 500):
            assert state(many, step) == state(one, step)
        for name, values in one.table.items():
            if name.startswith(("mpm", "f_mpm")):
                assert many.table[name] == values, name
            else:  # forces of walls are sums over the ranks' nodes, in another order: 1e-12 of the largest
                assert many.table[name] == pytest.approx(values, rel=1e-12, abs=1e-12 * max(map(abs, values))), name


@pytest.mark.parametrize("extra", ["", "volumetric cell"])
def test_periodic_box_is_equal_on_1_2_4_ranks(extra, dempm, tmp_path):
    """The block moves through a periodic boundary; images of points come from this rank itself or from another."""
    script = scene("p f", "flip 0.99", extra).replace("vx 0.5", "vx 8")
    script = re.sub(r"fix ram.*\n|unfix ram|f_ram.1.", "", script)
    one = dempm(script, cwd=tmp_path / "1")
    x = [float(line.split()[1]) for line in state(one, 500).values()]
    assert 0.0 <= min(x) < 0.4 and 1.6 < max(x) < 2.0  # started from 0.525 to 1.475 to the right: some went round
    for np in (2, 4):
        many = dempm(script, np=np, cwd=tmp_path / str(np))
        for step in (250, 500):
            assert state(many, step) == state(one, step)


def test_two_threads_equal_one(dempm, tmp_path):
    one = dempm(scene("f f", "flip 0.99", "threads 1"), cwd=tmp_path / "1")
    two = dempm(scene("f f", "flip 0.99", "threads 2"), cwd=tmp_path / "2", threads=2)
    assert state(two, 500) == state(one, 500)
