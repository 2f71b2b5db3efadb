# SPDX-License-Identifier: GPL-2.0-or-later
"""`thermal/every`: thermal steps of several time steps."""
import numpy as np
import pytest
from scripts import BOX, HEAD, state, state_dump
from test_rve_scene import first, packing

# A thermo-elastic block between a hot wall and a cold one, falling a little.
ELASTIC = """
neighbor 0.05 bin
timestep 2e-4
fix E all property/global youngsModulus peratomtype 1e6
fix nu all property/global poissonsRatio peratomtype 0.3
fix beta all property/global thermalExpansionCoefficient peratomtype 1e-5
fix c all property/global thermalCapacity peratomtype 1
fix k all property/global thermalConductivity peratomtype 100
fix mpm all mpm/couple grid 0.1 shape gimp transfer flip 0.99 material elastic plane_strain point/size 0.05 0.05 &
  thermal yes temperature 20 {extra}
fix g all gravity 9.81 vector 0 -1 0
fix hot all mpm/wall mpm plane x 0.5 nocontact temperature 120 side +
fix floor all mpm/wall mpm plane y 0 friction 0.5 temperature 20 side +
thermo 100
thermo_style custom step f_mpm[8] f_hot[6] f_hot[7] f_floor[7]
thermo_modify format float %.15g
"""
POINTS = """
lattice sq 0.05 origin 0.5 0.5 0
region block block 0.5 1.5 0.1 0.6 -0.025 0.025 units box
create_atoms 1 region block
set group all density 1000
"""


def block(extra, run="run 1000\n", every=1000):
    return BOX.format(boundary="f f") + POINTS + ELASTIC.format(extra=extra) + state_dump(every) + run


def temperatures(run, step):
    lines = state(run, step).values()
    return np.array([float(line.split()[4 + 13]) for line in sorted(lines, key=lambda line: int(line.split()[0]))])


def thermal_steps(run):
    """(done, left out) of the last run."""
    line = [line for line in run.output.splitlines() if "thermal steps, left out in" in line][-1].split()
    return int(line[2]), int(line[-3])


def test_error_is_first_order_and_auto_keeps_its_bound(dempm, tmp_path):
    """Beside a thermal step in each time step: error in % of the step of temperature."""
    exact = temperatures(dempm(block(""), cwd=tmp_path / "1"), 1000)
    errors = {}
    for name, extra in {"10": "thermal/every 10", "20": "thermal/every 20", "auto": "thermal/every auto 0.01"}.items():
        run = dempm(block(extra), cwd=tmp_path / name)
        errors[name] = np.max(np.abs(temperatures(run, 1000) - exact))
        table = run.table
        supplied = table["hot[7]"][-1] + table["floor[7]"][-1]
        assert table["mpm[8]"][-1] - table["mpm[8]"][0] == pytest.approx(supplied, rel=1e-11)
        done, left_out = thermal_steps(run)
        assert done + left_out == 1000 and done <= {"10": 100, "20": 50, "auto": 150}[name]
    print(errors)
    assert errors["10"] < 0.25 and 1.5 < errors["20"] / errors["10"] < 2.5 and errors["auto"] < 1.0


@pytest.mark.parametrize("extra", ["thermal/every 7", "thermal/every auto 0.01"])
@pytest.mark.parametrize("before, after", [(1, 1), (2, 1)])
def test_restart_inside_a_thermal_step_continues_to_the_last_bit(before, after, extra, dempm, tmp_path):
    through = dempm(block(extra, "restart 50 half.*\nrun 100\n", 100), np=before, cwd=tmp_path)
    expected, table = state(through, 100), through.table
    assert thermal_steps(through)[1] > 50
    (tmp_path / "state.100.txt").unlink()
    tail = ELASTIC.format(extra=extra) + state_dump(100)
    again = dempm(HEAD + "read_restart half.50\n" + tail + "run 50\n", np=after, cwd=tmp_path)
    assert state(again, 100) == expected
    for name in ("mpm[8]", "hot[6]", "hot[7]", "floor[7]"):
        assert again.table[name][-1] == pytest.approx(table[name][-1], rel=1e-13), name


def test_frictional_heat_is_given_whole_and_alike_on_any_number_of_ranks(dempm, tmp_path):
    """48 packings that are sheared: what their grains slipped is what the points got or what waits for them. No other heat:
    the wall is left out, and heat is counted from 0."""
    script = first(True, "run 200\n").replace("thermal yes temperature 10", "thermal yes temperature 0 thermal/every 8")
    script = script.replace("fix_modify rve bonds install\n", "velocity all ramp vx 0 20 y 0.01 0.31 units box\n")
    script = script.replace("fix hot all mpm/wall mpm plane x 0.8 nocontact temperature 100 side +\n", "")
    one = dempm(script, files={"grains.data": packing()}, cwd=tmp_path / "1")
    slipped, heat = (np.array(one.table[f"mpm[{k}]"]) for k in (9, 8))
    assert slipped[-1] > 0
    assert heat[-1] == pytest.approx(slipped[-1], rel=1e-10)
    two = dempm(script, np=2, files={"grains.data": packing()}, cwd=tmp_path / "2")
    assert state(two, 200) == state(one, 200)


def test_every_step_is_the_default(dempm, tmp_path):
    run = [dempm(block(extra, "run 50\n", 50), cwd=tmp_path / str(k)) for k, extra in enumerate(["", "thermal/every 1"])]
    assert state(run[0], 50) == state(run[1], 50) and "thermal steps" not in run[1].output
