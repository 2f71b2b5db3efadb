# SPDX-License-Identifier: GPL-2.0-or-later
"""fix heat/rest: steps of temperature only, against the same grains with mechanics, closed forms, and itself."""
import math

import pytest
from test_grain_heat import (HEAD, OURS, OUTPUT, PAIR_ROWS, box, circle, deviation, falling, grains, heat_of, last,
                             properties, still, two_grains)
from test_grain_heat_walls import FILES, MESH, PLANE, lying

EXPLICIT = "fix rest all heat/rest\n"
IMPLICIT = "fix rest all heat/rest solver implicit\n"
STEADY = "fix rest all heat/rest solver steady\n"
HEAT = "fix heat all heat/gran/grain initial_temperature 300 "
ALL = HEAT + "direct batchelor indirect layer fluid 0.5 convection 20 350 radiation 0.8 900\n"
LIMIT = "thermo_style custom step atoms f_heat f_rest[1] f_rest[2] f_rest[3] f_rest[4]\nthermo_modify format float %.17g\n"
H = 4 * 20 * 90 / 110 * circle(0.005, 0.004, 0.0089)


def capacities(run):
    return [c * m for c, m in zip((0.1, 0.2), last(run, "mass"))]


# ------------------------------------------------------------------------------------------------- explicit
@pytest.mark.parametrize("fix", [OURS, ALL], ids=["direct", "all"])
def test_temperatures_are_those_of_a_run_with_mechanics(fix, dempm, tmp_path):
    """To round-off: the same terms, summed in another order."""
    mechanics = dempm(still(fix, 100), cwd=tmp_path / "mechanics")
    one, two = (dempm(still(fix + EXPLICIT, 100), np=np, cwd=tmp_path / str(np)) for np in (1, 2))
    for name in ("f_Temp[0]", "f_heatFlux[0]"):
        assert deviation(one, mechanics, name) < 1e-12
        assert deviation(two, one, name) < 1e-12
    assert max(last(one, "f_Temp[0]")) - min(last(one, "f_Temp[0]")) < 190.0  # of 200: heat has moved


@pytest.mark.parametrize("wall", [PLANE, MESH], ids=["plane", "mesh"])
def test_walls_conduct_and_the_energy_adds_up(wall, dempm, tmp_path):
    mechanics = dempm(lying("direct batchelor", wall, 20), files=FILES, cwd=tmp_path / "mechanics")
    rest = dempm(lying("direct batchelor", wall + EXPLICIT, 20), files=FILES, cwd=tmp_path / "rest")
    assert deviation(rest, mechanics) == 0.0
    energy, flow = rest.table["f_heat"], rest.table["f_heat[3]"]
    assert len(energy) == 21 and min(flow[1:]) > 0.0
    for n in range(1, 21):
        assert energy[n] - energy[n - 1] == pytest.approx(2e-5 * flow[n], abs=1e-12 * energy[0])


def test_directional_flux_and_averages_are_those_of_mechanics(dempm, tmp_path):
    output = ("dump more all custom 50 more.dump id f_directionalHeatFlux[1] f_directionalHeatFlux[3]\n"
              "dump_modify more sort id format \"%d %.17g %.17g\"\nfix mean all ave/time 1 50 50 f_heat[1] file mean.txt\n")
    found = []
    for name, rest in (("mechanics", ""), ("rest", EXPLICIT)):
        script = still(ALL + rest, 50).replace("thermo 1000", output + "thermo 1000")
        run = dempm(script, cwd=tmp_path / name)
        frame = run.dump("more.dump")[-1][1]
        found.append(frame["f_directionalHeatFlux[1]"] + frame["f_directionalHeatFlux[3]"] +
                     [float((run.path / "mean.txt").read_text().split()[-1])])
    assert max(abs(value) for value in found[0]) > 0.0
    assert found[1] == pytest.approx(found[0], rel=1e-11, abs=1e-14)


def test_limit_of_the_time_step(dempm):
    """C / h of the smaller capacity; the run with it reaches the neighbour's temperature and no further."""
    run = dempm(two_grains(HEAT + "direct batchelor\n" + EXPLICIT, 1).replace("thermo_style custom step atoms f_heat\n", LIMIT))
    limit = min(capacities(run)) / H
    assert run.table["f_rest[1]"][-1] == pytest.approx(limit, rel=1e-12)
    assert run.table["f_rest[2]"][-1] == 1.0 and run.table["f_rest[3]"][-1] == 0.0


@pytest.mark.parametrize("solver", [EXPLICIT, IMPLICIT], ids=["explicit", "implicit"])
@pytest.mark.parametrize("before, after", [(1, 1), (1, 2), (2, 1)])
def test_restart_continues(before, after, solver, dempm, tmp_path):
    fix = ALL + solver
    script = still(fix, 20).replace("run 20\n", "run 20\nwrite_restart half\nrun 20\n")
    through = dempm(script, np=before, cwd=tmp_path / "through")
    again = dempm(HEAD.format(boundary="p p f") + f"read_restart {tmp_path}/through/half\n" + properties(fix) + fix +
                  OUTPUT.format(every=20) + "run 20\n", np=after, cwd=tmp_path / "again")
    assert deviation(again, through) < (1e-15 if before == after else 1e-13)


def test_mechanics_goes_on_after_unfix(dempm, tmp_path):
    """Grains in flight stand still meanwhile, and fall on as if nothing had been."""
    runs = []
    for name, between in (("rest", EXPLICIT + "run 300\nunfix rest\nrun 0\nreset_timestep 2000\n"), ("mechanics", "run 0\nrun 0\n")):
        script = falling(OURS, 2000) + between + "run 2000\n"
        runs.append(dempm(script, cwd=tmp_path / name))
    assert last(runs[0], "z") == last(runs[1], "z")
    assert deviation(*runs) > 1e-6


# ------------------------------------------------------------------------------------------------- implicit
def test_implicit_steps_are_backward_euler(dempm):
    """The difference of two grains' temperatures is divided by 1 + h dt (1/C1 + 1/C2) in each step, 50 times the
    explicit limit here."""
    script = two_grains(HEAT + "direct batchelor\n" + IMPLICIT + "timestep 0.01\n", 2)
    run = dempm(script)
    one, two = capacities(run)
    factor = 1 / (1 + H * 0.01 * (1 / one + 1 / two))
    assert H * 0.01 / one > 1.0 > factor > 0.0
    temperatures = last(run, "f_Temp[0]")
    assert temperatures[0] - temperatures[1] == pytest.approx(100.0 * factor ** 2, rel=1e-8)


@pytest.mark.parametrize("solver", [IMPLICIT, STEADY], ids=["implicit", "steady"])
def test_energy_is_kept_whatever_the_tolerance(solver, dempm, tmp_path):
    fix = HEAT + "direct batchelor\n" + solver.replace("\n", " tolerance 1e-2\n")
    one, two = (dempm(still(fix, 2), np=np, cwd=tmp_path / str(np)) for np in (1, 2))
    for run in (one, two):
        start, end = heat_of(run)
        assert end == pytest.approx(start, rel=1e-14)
    assert deviation(two, one) < 1e-13


# --------------------------------------------------------------------------------------------------- steady
CHAIN = [(1 + n % 2, 0.005, 0.0049 + 0.0098 * n, 0.01, 0.01, 300.0) for n in range(6)]
ENDS = """fix left all wall/gran model hertz tangential history primitive type 1 xplane 0.0 temperature 500
fix right all wall/gran model hertz tangential history primitive type 1 xplane 0.0588 temperature 200
"""


def chain(words, solver, steps=1, after=""):
    make, heat = grains(CHAIN)
    output = OUTPUT.replace("f_heat\n", "f_heat f_heat[3] f_rest[4] f_rest[5]\n").replace("thermo 1000", "thermo 1")
    return (box((-0.001, 0, 0), (0.06, 0.02, 0.02), "f f f") + make + properties("") + HEAT + words + "\n" + solver + ENDS +
            heat + after + output.format(every=steps) + f"run {steps}\n")


@pytest.mark.parametrize("np", [1, 2])
def test_steady_state_of_a_chain_between_walls(np, dempm):
    """Resistances in series; the same heat flows through each."""
    run = dempm(chain("direct batchelor", STEADY), np=np)
    contact = math.sqrt(0.005 ** 2 - 0.0049 ** 2)
    pair, left, right = (4 * k * contact for k in (20 * 90 / 110, 10, 20 * 90 / 110))  # walls of type 1
    resistances = [1 / left] + 5 * [1 / pair] + [1 / right]
    flow = 300.0 / sum(resistances)
    expected = [500.0 - flow * sum(resistances[:n]) for n in range(1, 7)]
    assert last(run, "f_Temp[0]") == pytest.approx(expected, rel=1e-9)
    assert abs(run.table["f_heat[3]"][-1]) < 1e-8 * flow
    assert 1 <= run.table["f_rest[4]"][-1] <= 8


def test_steady_state_with_sources_and_with_radiation(dempm, tmp_path):
    source = "set atom 3 property/atom heatSource 0.05\n"
    run = dempm(chain("direct batchelor", STEADY, after=source), cwd=tmp_path / "source")
    assert run.table["f_heat[3]"][-1] == pytest.approx(-0.05, rel=1e-8)
    run = dempm(chain("direct batchelor radiation 0.9 1200", STEADY), cwd=tmp_path / "radiation")
    assert run.table["f_rest[5]"][-1] < 1e-10
    assert last(run, "f_heatFlux[0]") == pytest.approx([0.0] * 6, abs=1e-8)
    assert run.table["f_heat[3]"][-1] < -0.1


def test_grains_without_contact_and_without_capacity_keep_their_temperature(dempm):
    rows = PAIR_ROWS + [(2, 0.004, 0.035, 0.01, 0.01, 111.0)]
    script = two_grains(HEAT + "direct batchelor\n" + STEADY, 1, rows).replace("peratomtype 0.1 0.2", "peratomtype 0 0.2")
    one, two, alone = last(dempm(script), "f_Temp[0]")
    assert one == 350.0 and two == pytest.approx(350.0, rel=1e-9) and alone == 111.0
