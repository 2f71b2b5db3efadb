# SPDX-License-Identifier: GPL-2.0-or-later
"""An elastic block driven by LIGGGHTS commands: what thermo output says is what mechanics says."""
import pytest
from scripts import BOX, HEAD, POINTS, elastic_block

MASS = 200 * 0.05 * 0.05 * 1000.0


def test_free_fall_is_exact(dempm):
    """No wall is near: every point falls as one body; kinetic + potential energy and horizontal momentum stay."""
    script = elastic_block() + """
unfix ram
unfix floor
thermo 50
thermo_style custom step f_mpm f_mpm[1] f_mpm[2] f_mpm[3] f_mpm[5] f_mpm[6] f_mpm[14] f_mpm[15] ke
thermo_modify format float %.15g
run 200
"""
    table = dempm(script).table
    steps, dt, g = table["Step"], 2e-4, 9.81
    assert table["mpm[15]"] == [200.0] * len(steps)
    for k, step in enumerate(steps):
        time = step * dt
        # 1e-12: round-off of 200 steps over 200 points
        assert table["mpm[1]"][k] == pytest.approx(MASS, rel=1e-12)
        assert table["mpm[2]"][k] == pytest.approx(0.5 * MASS, rel=1e-12)
        assert table["mpm[3]"][k] == pytest.approx(-MASS * g * time, rel=1e-12, abs=1e-12)
        kinetic = 0.5 * MASS * (0.5**2 + (g * time) ** 2)
        assert table["mpm[5]"][k] == pytest.approx(kinetic, rel=1e-12)
        assert table["KinEng"][k] == pytest.approx(kinetic, rel=1e-12)
        # The position takes v + a dt / 2 per step, which is exact for constant force
        assert table["mpm[14]"][k] == pytest.approx(0.5 * MASS * (g * time) ** 2, rel=1e-9, abs=1e-12)
    assert max(table["mpm"]) - min(table["mpm"]) <= 1e-9 * abs(table["mpm[6]"][0])


def test_settled_block_rests_on_the_wall_with_its_weight(dempm):
    """Damped to rest: the floor carries m g, stored and kinetic energy agree with statics."""
    script = BOX.format(boundary="f f") + POINTS.replace("vx 0.5", "vx 0").replace("0.1 0.6", "0.0 0.5") + """
neighbor 0.05 bin
timestep 2e-4
fix E all property/global youngsModulus peratomtype 1e6
fix nu all property/global poissonsRatio peratomtype 0
fix mpm all mpm/couple grid 0.1 shape gimp transfer flip 1 material elastic plane_strain damping/grid 40
fix g all gravity 9.81 vector 0 -1 0
fix floor all mpm/wall mpm plane y 0 slip
thermo 1000
thermo_style custom step f_mpm[5] f_mpm[7] f_floor[1] f_floor[2] f_floor[4]
thermo_modify format float %.15g
run 8000
"""
    table = dempm(script).table
    weight = MASS * 9.81
    # 1e-6: 1.6 s of damping at 40/s leave exp(-32) of the first bounce and 2e-9 of slower ringing, as measured
    assert table["floor[2]"][-1] == pytest.approx(weight, rel=1e-6)
    assert abs(table["floor[1]"][-1]) <= 1e-9 * weight and table["floor[4]"][-1] == 0.0
    # Stored energy of a bar under its own weight: (rho g)^2 L^3 A / (6 E); 20 points in 5 cells carry it to 3 %
    exact = (1000 * 9.81) ** 2 * 0.5**3 * 1.0 / (6 * 1e6)
    assert table["mpm[7]"][-1] == pytest.approx(exact, rel=0.03)


def test_moving_wall_pushes_and_its_work_is_counted(dempm):
    """No gravity: the ram hits the block. Momentum = impulse of the wall, energy gained = its work less losses."""
    script = elastic_block(points=POINTS.replace("vx 0.5", "vx 0")) + """
unfix g
unfix floor
thermo 1
thermo_style custom step f_mpm[2] f_ram[1] f_ram[8] f_ram[9] f_mpm[5] f_mpm[7]
thermo_modify format float %.15g
run 1500
"""
    table = dempm(script).table
    impulse = sum(table["ram[1]"][1:]) * 2e-4
    assert table["mpm[2]"][-1] < -0.1 * MASS * 0.5
    # 1e-10: round-off of 1500 steps
    assert table["mpm[2]"][-1] == pytest.approx(impulse, rel=1e-10)
    assert table["ram[9]"][-1] == pytest.approx(-0.5 * 1500 * 2e-4, rel=1e-12)
    assert table["ram[8]"][-1] == pytest.approx(-0.5 * impulse, rel=1e-10)
    gained = table["mpm[5]"][-1] + table["mpm[7]"][-1]
    # Inelastic contact of nodes takes part of the work away, never adds
    assert 0.5 * table["ram[8]"][-1] <= gained <= 1.001 * table["ram[8]"][-1]


def test_wall_can_be_removed_between_runs(dempm):
    points = POINTS.replace("0.1 0.6", "0.5 1.0").replace("vx 0.5", "vx 0")
    script = elastic_block(points=points, transfer="flip 0.99") + """
unfix ram
fix shelf all mpm/wall mpm plane y 0.5 noslip
thermo_style custom step f_mpm[3]
thermo_modify format float %.15g
thermo 100
run 200
unfix shelf
run 200
"""
    held, falling = dempm(script).thermo
    assert abs(held["mpm[3]"][-1]) < 0.2 * MASS * 9.81 * 0.04
    # The body may have bounced slowly on the shelf; from then on only gravity acts. 1e-12: round-off
    assert falling["mpm[3]"][-1] - falling["mpm[3]"][0] == pytest.approx(-MASS * 9.81 * 0.04, rel=1e-12)


def test_too_large_time_step_is_refused_with_the_limit(dempm):
    script = elastic_block() + "timestep 0.01\nrun 1\n"
    run = dempm(script, check=False)
    assert run.code != 0
    assert "Fix mpm/couple (id mpm): timestep 0.01 s is larger than the critical mechanical time step" in run.output


@pytest.mark.parametrize("np", [1, 2])
def test_point_that_leaves_a_fixed_box_is_named(np, dempm):
    script = elastic_block() + "unfix floor\nrun 3000\n"
    run = dempm(script, np=np, check=False)
    assert run.code != 0
    assert "left the box" in run.output and "add a fix mpm/wall" in run.output


def test_three_dimensions(dempm):
    """The same commands in 3D: a cube falls and lands on a plane; momentum balance with the wall's force."""
    script = HEAD.replace("dimension 2", "dimension 3") + """
boundary f f f
region box block 0 1 0 1 0 1 units box
create_box 1 box
neighbor 0.05 bin
lattice sc 0.05 origin 0.5 0.5 0.5
region cube block 0.3 0.7 0.3 0.7 0.05 0.45 units box
create_atoms 1 region cube
set group all density 1000 vx 0.1
fix E all property/global youngsModulus peratomtype 1e6
fix nu all property/global poissonsRatio peratomtype 0.3
fix mpm all mpm/couple grid 0.1 shape linear transfer flip 0.99 material elastic 3d
fix g all gravity 9.81 vector 0 0 -1
fix floor all mpm/wall mpm plane z 0 friction 0.3
timestep 2e-4
thermo 1
thermo_style custom step f_mpm[1] f_mpm[2] f_mpm[4] f_floor[1] f_floor[3]
thermo_modify format float %.15g
run 600
"""
    table = dempm(script).table
    mass = 512 * 0.05**3 * 1000
    assert table["mpm[1]"][0] == pytest.approx(mass, rel=1e-12)
    assert max(table["floor[3]"]) > mass * 9.81
    # 1e-10: round-off of 600 steps
    impulse = [sum(table[f"floor[{k}]"][1:]) * 2e-4 for k in (1, 3)]
    assert table["mpm[4]"][-1] == pytest.approx(-mass * 9.81 * 600 * 2e-4 + impulse[1], rel=1e-10)
    assert table["mpm[2]"][-1] == pytest.approx(0.1 * mass + impulse[0], rel=1e-10)
