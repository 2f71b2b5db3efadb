# SPDX-License-Identifier: GPL-2.0-or-later
"""Grains (pair_style gran) and material points share a box without touching each other."""
import pytest
from scripts import BOX, state, state_dump

PAIR = BOX.replace("create_box 1 box", "create_box 2 box").format(boundary="f f") + """
neighbor 0.02 bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 1e7 1e7
fix m2 all property/global poissonsRatio peratomtype 0.3 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.5 0.5 0.5 0.5
fix m4 all property/global coefficientFriction peratomtypepair 2 0.5 0.5 0.5 0.5
pair_style gran model hertz tangential history
pair_coeff * *
timestep 5e-5
thermo 100
thermo_style custom step atoms ke
fix g all gravity 9.81 vector 0 -1 0
"""
# A pile of overlapping disks right inside the block of points.
GRAINS = """
lattice sq 0.049 origin 0.5 0.5 0
region pile block 0.6 1.2 0.02 0.5 -0.025 0.025 units box
create_atoms 2 region pile
group grains type 2
set group grains diameter 0.05 density 2500
fix move grains nve/sphere
fix flat grains enforce2d
fix ground grains wall/gran model hertz tangential history primitive type 1 yplane 0.0
dump grains grains custom 300 grains.* x y vx vy fx fy
dump_modify grains format "%.17g %.17g %.17g %.17g %.17g %.17g"
"""
POINTS = """
lattice sq 0.05 origin 0.5 0.5 0
region block block 0.5 1.5 0.1 0.6 -0.025 0.025 units box
create_atoms 1 region block
group points type 1
set group points density 1000 vx 0.5
fix mpm points mpm/couple grid 0.1 shape gimp transfer flip 0.99 material elastic plane_strain
fix floor all mpm/wall mpm plane y 0 friction 0.5 side +
""" + state_dump(300).replace("state all", "state points")


def grains(run, step):
    lines = (run.path / f"grains.{step}").read_text().split("ITEM: ATOMS", 1)[1].splitlines()[1:]
    return sorted(tuple(float(word) for word in line.split()) for line in lines)


@pytest.mark.parametrize("np", [1, 2])
def test_grains_and_points_do_not_feel_each_other(np, dempm, tmp_path):
    both = dempm(PAIR + GRAINS + POINTS + "run 300\n", np=np, cwd=tmp_path / "both")
    only_grains = dempm(PAIR + GRAINS + "run 300\n", np=np, cwd=tmp_path / "grains")
    only_points = dempm(PAIR + POINTS + "run 300\n", np=np, cwd=tmp_path / "points")
    assert state(both, 300) == state(only_points, 300)
    mine, other = grains(both, 300), grains(only_grains, 300)
    assert len(mine) == len(other) > 100 and any(abs(row[2]) > 1e-3 for row in mine)
    # 1e-9 of the largest value: contacts are summed in another order when points are among LIGGGHTS' particles
    for column in range(6):
        largest = max(abs(row[column]) for row in other)
        assert [row[column] for row in mine] == pytest.approx([row[column] for row in other], rel=0, abs=1e-9 * largest)


@pytest.mark.parametrize("name, rest", [("nve/sphere", ""),
                                        ("wall/gran", "model hertz tangential history primitive type 1 xplane 0.0")])
@pytest.mark.parametrize("np", [1, 2])
def test_fix_for_grains_on_points_is_refused(np, name, rest, dempm):
    run = dempm(PAIR + GRAINS + POINTS + f"fix bad all {name} {rest}\nrun 1\n", np=np, check=False)
    assert run.code != 0
    assert f"fix bad (style {name}) acts on particles of group points, which are material points" in run.output
