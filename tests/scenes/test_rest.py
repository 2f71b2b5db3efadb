# SPDX-License-Identifier: GPL-2.0-or-later
"""Packings of points at rest are not run: a settled column costs a tenth, its answer stays, a moving one notices nothing."""
import shutil

import numpy as np
import pytest
from conftest import ROOT
from scripts import BOX, GRAINS, HEAD, state, state_dump

SPACING, HEIGHT, GRAVITY = 0.2, 1.2, 9.8
MATERIAL = """
neighbor 0.05 bin
timestep 1e-4
""" + GRAINS + """
fix rve all mpm/rve packing grains.packing model hooke/stiffness tangential history grain disk thickness 0.075 &
  density 2650 damping viscous 0.2 rest {rest}
fix mpm all mpm/couple grid 0.4 shape gimp transfer flip 0.99 material rve rve point/size 0.2 0.2 damping/point {damping}
fix g all gravity 9.8 vector 0 -1 0
fix floor all mpm/wall mpm plane y 0 friction 0.5 side +
fix left all mpm/wall mpm plane x 0.4 slip side +
fix right all mpm/wall mpm plane x 1.6 slip side -
thermo 100
thermo_style custom step f_mpm[5] f_mpm[7] f_mpm[9] f_mpm[10] f_floor[2]
thermo_modify format float %.15g
"""
POINTS = """
lattice sq 0.2 origin 0.5 0.5 0
region column block 0.4 1.6 0 1.2 -0.025 0.025 units box
create_atoms 1 region column
"""


@pytest.fixture(scope="module")
def grains(tmp_path_factory):
    """Kept, so that the figures below are those of one draw. Made by dempm-pack generate FILE radius 0.0025 0.005 pressure 1e4
    preparation_friction 0.5 density 2650 kn 1e6 kt 1e6 thickness 0.075 grains 64, which draws another one today."""
    path = tmp_path_factory.mktemp("rest") / "grains.packing"
    shutil.copy(ROOT / "tests" / "data" / "rest.packing", path)
    return path


def scene(rest, run, damping=20, continued=False):
    head = HEAD + "read_restart half\n" if continued else BOX.format(boundary="f f") + POINTS
    return head + MATERIAL.format(rest=rest, damping=damping) + run


def computed_steps(run):
    """(computed, asked) of the closing line."""
    line = [line for line in run.log.splitlines() if "RVE steps so far" in line][-1].replace(",", "").split()
    return int(line[line.index("computed") - 1]), int(line[2])


def test_a_settled_column_costs_a_tenth_and_stands_as_before(dempm, grains, tmp_path):
    """Settled for 0.8 s with damping; then 0.3 s more with all packings run, and with resting ones left out."""
    files = [grains]
    dempm(scene("no", "run 8000\nwrite_restart half\n"), files=files, cwd=tmp_path, timeout=300)
    stress, energy, counts = {}, {}, {}
    for rest in ("no", "1e-3"):
        run = dempm(scene(rest, state_dump(1000) + "run 3000\n", continued=True), files=files, cwd=tmp_path, timeout=300)
        points = state(run, 11000)
        stress[rest] = np.array([[float(word) for word in points[k].split()[5:11]] for k in sorted(points)])
        energy[rest], counts[rest] = run.table["mpm[7]"][-1], computed_steps(run)
    computed, asked = counts["1e-3"]
    assert counts["no"] == (asked, asked) or counts["no"][0] > 0.99 * asked
    assert asked == 36 * 3000 and computed <= 0.1 * asked
    pressure = -0.5 * (stress["no"][:, 0] + stress["no"][:, 1])
    # Each answer is off by at most 1e-3 of its packing's pressure: so is the balance that they come to.
    assert np.max(np.abs(stress["1e-3"] - stress["no"])) < 2e-3 * pressure.max()
    assert energy["1e-3"] == pytest.approx(energy["no"], rel=2e-3)


def test_a_collapse_is_the_same_with_rest(dempm, grains, tmp_path):
    """Once the column flows its packings are run again. The first 0.05 s agree; later any two collapses drift apart, as grains take
    other turns: the last digits of gravity move the frictional heat by 4 % (standard deviation). So it is the means of eight collapses
    that must agree; 5 % are 2.8 standard errors of their difference. Free flights, whose round-off does the same, are off."""
    stepped = lambda text: text.replace(" rest ", " flight no rest ", 1)
    files, collapse = [grains], "unfix right\nrun 2000\n"
    dempm(stepped(scene("no", "run 3000\nwrite_restart half\n")), files=files, cwd=tmp_path, timeout=300)
    kinetic, heat = {}, {}
    for rest in ("no", "1e-3"):
        text = stepped(scene(rest, "run 200\n" + collapse, damping=0, continued=True))
        tables = [dempm(text.replace("gravity 9.8", f"gravity {GRAVITY + 1e-4 * k:.4f}"), files=files, cwd=tmp_path, timeout=300).table
                  for k in range(8)]
        kinetic[rest] = np.array([table["mpm[5]"] for table in tables])
        heat[rest] = np.array([table["mpm[9]"][-1] - table["mpm[9]"][0] for table in tables])
    largest = kinetic["no"].max()
    assert largest > 10.0
    assert np.abs(kinetic["1e-3"] - kinetic["no"])[:, :6].max() < 0.005 * largest
    assert np.abs(kinetic["1e-3"].mean(axis=0) - kinetic["no"].mean(axis=0)).max() < 0.1 * largest  # 0.03 to 0.06 with four kernels
    assert heat["1e-3"].mean() == pytest.approx(heat["no"].mean(), rel=0.05)


def test_rest_is_reproduced_by_ranks_and_restart(dempm, grains, tmp_path):
    files, run = [grains], state_dump(400) + "run 1600\nwrite_restart half\nrun 400\n"
    one = dempm(scene("1e-2", run), files=files, cwd=tmp_path / "1", timeout=300)
    computed, asked = computed_steps(one)
    assert computed < asked  # some did rest
    two = dempm(scene("1e-2", run), files=files, cwd=tmp_path / "2", np=2, timeout=300)
    expected = state(one, 2000)
    assert state(two, 2000) == expected
    again = dempm(scene("1e-2", state_dump(400) + "run 400\n", continued=True), files=files, cwd=tmp_path / "1", timeout=300)
    assert state(again, 2000) == expected
