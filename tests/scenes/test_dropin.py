# SPDX-License-Identifier: GPL-2.0-or-later
"""dempm runs scripts of stock LIGGGHTS with the same thermo output and the same dumps."""
import re

import pytest

HEAD = """
units si
atom_style granular
atom_modify map array
newton off
communicate single vel yes
boundary f f f
region box block 0 0.1 0 0.1 0 0.2 units box
create_box 1 box
neighbor 0.002 bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 5.e6
fix m2 all property/global poissonsRatio peratomtype 0.45
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.3
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
timestep 1e-5
"""

# Random insertion, walls, a restart file written and read again after `clear`, dumps as text and through VTK.
INSERTION = HEAD + """
pair_style gran model hertz tangential history
pair_coeff * *
fix grav all gravity 9.81 vector 0 0 -1
fix floor all wall/gran model hertz tangential history primitive type 1 zplane 0.0
fix pts all particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant 0.004
fix pdd all particledistribution/discrete 32452843 1 pts 1.0
fix ins all insert/pack seed 32452867 distributiontemplate pdd maxattempt 100 insert_every once &
  overlapcheck yes all_in yes vel constant 0 0 -1 region box volumefraction_region 0.1
fix move all nve/sphere
compute rot all erotate/sphere
thermo 20
thermo_style custom step atoms ke c_rot
dump d all custom 50 points.* id type x y z vx vy vz fx fy fz omegax omegay omegaz radius
dump v all custom/vtk 50 points_*.vtk id x y z vx vy vz radius
run 150
write_restart state
clear
atom_style granular
atom_modify map array
communicate single vel yes
newton off
read_restart state
neighbor 0.002 bin
fix m1 all property/global youngsModulus peratomtype 5.e6
fix m2 all property/global poissonsRatio peratomtype 0.45
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.3
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
fix grav all gravity 9.81 vector 0 0 -1
fix move all nve/sphere
thermo 20
thermo_style custom step atoms ke
dump d all custom 50 again.* id x y z
run 100
"""

# Heat conduction, a loop over `jump`, variables, groups, `if`.
LOOP = HEAD + """
lattice sc 0.0079
region block block 0.01 0.06 0.01 0.06 0.01 0.06 units box
create_atoms 1 region block
set group all diameter 0.008 density 2500
fix c1 all property/global thermalConductivity peratomtype 100
fix c2 all property/global thermalCapacity peratomtype 10
pair_style gran model hooke/stiffness tangential history
pair_coeff * *
fix k1 all property/global kn peratomtypepair 1 1e5
fix k2 all property/global kt peratomtypepair 1 5e4
fix k3 all property/global gamman peratomtypepair 1 10
fix k4 all property/global gammat peratomtypepair 1 5
fix heat all heat/gran initial_temperature 300
region half block INF INF INF INF INF 0.03 units box
fix move all nve/sphere
run 0
set region half property/atom Temp 400
compute t all reduce sum f_Temp[0]
thermo 10
thermo_style custom step atoms ke c_t
label again
variable n loop 3
if "$n == 2" then "velocity all set 0.1 0 0"
run 40
next n
jump SELF again
print "loops done"
dump d all custom 10 heat.* id x y z f_Temp[0]
run 20
"""

PLANE = """
dimension 2
units si
atom_style granular
atom_modify map array
boundary p p p
newton off
communicate single vel yes
lattice hex 1.154700538
region box block 0 12 0 7 -0.5 0.5
create_box 1 box
create_atoms 1 box
set group all diameter 1.02 density 1
set group all vx 0.01
set atom 20*30 vy -0.02
neighbor 0.1 bin
fix k1 all property/global kn peratomtypepair 1 1e3
fix k2 all property/global kt peratomtypepair 1 5e2
fix k3 all property/global gamman peratomtypepair 1 0
fix k4 all property/global gammat peratomtypepair 1 0
fix k5 all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model hooke/stiffness tangential history
pair_coeff * *
timestep 1e-3
fix move all nve/sphere
fix flat all enforce2d
thermo 10
thermo_style custom step atoms ke
dump d all custom 50 plane.* id x y vx vy
run 200
"""


def comparable(log):
    """The log without lines that hold times of day, durations or what depends on them."""
    changing = r"Loop time|Setting up run|time \(%\)|CPU use|time/particle|created|Memory|wall"
    return [line for line in log.splitlines() if not re.search(changing, line)]


@pytest.mark.parametrize("np", [1, 2])
@pytest.mark.parametrize("name", ["INSERTION", "LOOP", "PLANE"])
def test_stock_script_gives_the_same_log_and_dumps(name, np, liggghts, dempm, tmp_path):
    script = globals()[name]
    stock = liggghts(script, np=np, cwd=tmp_path / "stock")
    ours = dempm(script, np=np, cwd=tmp_path / "ours")
    assert stock.thermo and comparable(ours.log) == comparable(stock.log)
    files = sorted(p.name for p in stock.path.iterdir() if p.name != "log.liggghts")
    assert files == sorted(p.name for p in ours.path.iterdir() if p.name != "log.liggghts")
    assert len(files) > 2
    for file in files:
        assert (ours.path / file).read_bytes() == (stock.path / file).read_bytes(), f"{file} differs"


@pytest.mark.parametrize("arguments", [["-h"], ["-in", "missing"]])
def test_command_line_answers_as_stock(arguments, tmp_path):
    from conftest import BUILD, STOCK, execute
    ours, stock = (execute([program, *arguments], cwd=tmp_path) for program in (BUILD / "dempm", STOCK))
    assert ours[0] == stock[0]
    said = [[line for line in comparable(text) if line.strip() and "vm:" not in line and "ORTE" not in line]
            for text in (ours[1], stock[1])]
    if ours[0] == 0:
        assert said[0] == said[1]
    else:  # what Open MPI adds about the abort varies
        assert [line for line in said[0] if "ERROR:" in line] == [line for line in said[1] if "ERROR:" in line]


def test_styles_are_known_after_clear(dempm):
    run = dempm("clear\ndimension 2\natom_style granular\nboundary f f p\nregion b block 0 1 0 1 -1 1 units box\n"
                "create_box 1 b\nfix r all mpm/rve\n", check=False)
    assert run.code != 0 and "Fix mpm/rve (id r): keyword 'packing' is missing" in run.output
