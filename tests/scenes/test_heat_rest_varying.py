# SPDX-License-Identifier: GPL-2.0-or-later
"""fix heat/rest with properties over temperature and radiation between neighbours: against the same grains with
mechanics, and closed forms."""
import math

import pytest
from test_grain_heat import HEAD, OUTPUT, area_over_capacity, alone, box, deviation, grains, last, properties, two_grains
from test_grain_heat_radiation import CASES, SIGMA, TABLES, case_script, pair_view
from test_grain_heat_walls import FILES, MESH, PLANE, over
from test_heat_rest import EXPLICIT, HEAT, IMPLICIT, STEADY


def at_rest(script, solver):
    return script.replace("run 0\n", solver + "run 0\n", 1)


# ------------------------------------------------------------------------------------- as with mechanics
@pytest.mark.parametrize("name", [*CASES])
def test_temperatures_are_those_of_a_run_with_mechanics(name, dempm, tmp_path):
    script = case_script(name)
    mechanics = dempm(script, cwd=tmp_path / "mechanics")
    one, two = (dempm(at_rest(script, EXPLICIT), np=np, cwd=tmp_path / str(np)) for np in (1, 2))
    for column in ("f_Temp[0]", "f_heatFlux[0]"):
        assert deviation(one, mechanics, column) < 1e-12
        assert deviation(two, one, column) < 1e-12
    assert one.table["f_heat"][-1] == pytest.approx(one.table["f_heat"][0], rel=1e-13)
    assert max(last(one, "f_Temp[0]")) - min(last(one, "f_Temp[0]")) < 190.0  # of 200: heat has moved


@pytest.mark.parametrize("wall", [PLANE, MESH], ids=["plane", "mesh"])
def test_walls_and_surroundings_are_those_of_mechanics(wall, dempm, tmp_path):
    rows = [(1, 0.005, 0.02, 0.025, 0.0055, 300.0), (1, 0.005, 0.04, 0.025, 0.0049, 300.0)]
    words = "direct batchelor radiation 0.7 900 neighbours conductivity table capacity table"
    script = over(rows, words, TABLES + wall).replace("run 1\n", "run 50\n").replace("f_heat[3]", "f_heat[2] f_heat[3]")
    mechanics = dempm(script, files=FILES, cwd=tmp_path / "mechanics")
    rest = dempm(at_rest(script, EXPLICIT), files=FILES, cwd=tmp_path / "rest")
    assert deviation(rest, mechanics) < 1e-13
    for flow in ("f_heat[2]", "f_heat[3]"):  # surroundings, walls
        assert rest.table[flow][-1] == pytest.approx(mechanics.table[flow][-1], rel=1e-11) and rest.table[flow][-1] > 0.0
    assert min(last(rest, "f_Temp[0]")) > 300.1


# ------------------------------------------------------------------------------------------- conservation
@pytest.mark.parametrize("solver", [IMPLICIT + "timestep 0.02\n", STEADY], ids=["implicit", "steady"])
@pytest.mark.parametrize("name", [*CASES])
def test_energy_is_kept_whatever_the_tolerance(name, solver, dempm, tmp_path):
    """With tables of capacities, too: f_heat is then the enthalpy."""
    script = at_rest(case_script(name, 2), "").replace("run 2\n", solver.replace("\n", " tolerance 1e-2\n", 1) + "run 2\n")
    runs = [dempm(script, np=np, cwd=tmp_path / str(np)) for np in (1, 2)]
    for run in runs:
        assert run.table["f_heat"][-1] == pytest.approx(run.table["f_heat"][0], rel=1e-13)
        assert max(last(run, "f_Temp[0]")) - min(last(run, "f_Temp[0]")) < 190.0
    assert deviation(*runs) < 1e-12


# -------------------------------------------------------------------------------------------- closed forms
def bar(count):
    """A chain of equal grains between walls, k(T) = 20 (1 + (T - 250) / 350) from 250 K to 600 K."""
    table = "fix kt all property/global thermalConductivityTable matrix 2 250 20 600 40\n"
    rows = [(1, 0.005, 0.0049 + 0.0098 * n, 0.01, 0.01, 300.0) for n in range(count)]
    make, heat = grains(rows)
    end = 0.0098 * count
    ends = "".join(f"fix end{n} all wall/gran model hertz tangential history primitive type 1 xplane {x!r} temperature {T}\n"
                   for n, (x, T) in enumerate(((0.0, 600), (end, 250))))
    output = OUTPUT.replace("f_heat\n", "f_heat f_rest[4] f_rest[5] f_rest[6]\n")
    return (box((-0.001, 0, 0), (end + 0.001, 0.02, 0.02), "f f f") + make + properties("") + table + HEAT +
            "direct batchelor conductivity table\n" + STEADY + ends + heat + output.format(every=1) + "run 1\n")


def test_steady_bar_with_varying_conductivity(dempm, tmp_path):
    """Kirchhoff: the integral of k over T is linear along a bar; second order in the spacing. Between the end grains,
    as the walls' contacts conduct otherwise."""
    def potential(T):
        return 20 * (1 - 250 / 350) * T + 20 / 350 * T * T / 2  # of k

    contact, errors = math.sqrt(0.005 ** 2 - 0.0049 ** 2), []
    for count in (20, 40):
        run = dempm(bar(count), cwd=tmp_path / str(count))
        assert run.table["f_rest[5]"][-1] < 1e-10 and 2 <= run.table["f_rest[6]"][-1] <= 40
        T = last(run, "f_Temp[0]")
        K = [potential(t) for t in T]
        errors.append(max(abs((k - K[0]) / (K[-1] - K[0]) - n / (count - 1)) for n, k in enumerate(K)))
        assert T[0] - T[-1] > 150.0
        own = 20 * (1 + (T[0] - 250) / 350)
        flow = 4 * contact * own * 40 / (own + 40) * (600.0 - T[0])
        assert flow == pytest.approx(2 * contact * (K[0] - K[-1]) / (count - 1), rel=2.0 / count ** 2)
    assert errors[1] < 5e-5 and 3.0 < errors[0] / errors[1] < 5.0


TWIN_ROWS = [(1, 0.005, 0.01, 0.01, 0.01, 900.0), (1, 0.005, 0.0205, 0.01, 0.01, 300.0)]


def test_radiating_pair(dempm, tmp_path):
    """Two equal grains: with the mean temperature M and difference u, du/dt = -2 G sigma M u (4 M^2 + u^2) / C."""
    area, _ = pair_view(0.005, 0.005, 0.0105, 0.8)
    M, u, time = 600.0, 600.0, 0.3
    for solver in (EXPLICIT, IMPLICIT):
        errors = []
        for steps in (40, 80):
            script = two_grains(HEAT + "direct none radiation 0.8 none neighbours\n" + solver, steps, TWIN_ROWS)
            script = script.replace("neighbor 0.001", "neighbor 0.0035").replace("timestep 2e-5", f"timestep {time / steps!r}")
            run = dempm(script.replace("peratomtype 0.1 0.2", "peratomtype 1 1"), cwd=tmp_path / f"{solver.split()[-1]}{steps}")
            capacity = last(run, "mass")[0]
            fall = u * u / (4 * M * M + u * u) * math.exp(-16 * M ** 3 * area * SIGMA / capacity * time)
            expected = math.sqrt(4 * M * M * fall / (1 - fall))
            T = last(run, "f_Temp[0]")
            assert sum(T) == pytest.approx(2 * M, rel=1e-14)
            errors.append(abs((T[0] - T[1]) / expected - 1))
            assert expected < 0.7 * u
        assert errors[1] < 0.02 and 1.8 < errors[0] / errors[1] < 2.2
    run = dempm(two_grains(HEAT + "direct none radiation 0.8 none neighbours\n" + STEADY, 1, TWIN_ROWS)
                .replace("neighbor 0.001", "neighbor 0.0035"), cwd=tmp_path / "steady")
    assert last(run, "f_Temp[0]") == pytest.approx([M, M], rel=1e-9)


def test_heated_grain_that_radiates_into_the_cold(dempm):
    """One step to sigma e A T^4 = source, from far below: the conductance of the start says nothing of the end's."""
    fix = HEAT + "direct none radiation 0.8 0\n" + STEADY
    rows = [(1, 0.005, 0.01, 0.01, 0.01, 30.0), (1, 0.004, 0.03, 0.01, 0.01, 3000.0)]
    script = two_grains(fix, 1, rows).replace("run 1\n", "set group all property/atom heatSource 2.0\nrun 1\n")
    expected = [(2.0 / (SIGMA * 0.8 * 4 * math.pi * r * r)) ** 0.25 for r in (0.005, 0.004)]
    assert last(dempm(script), "f_Temp[0]") == pytest.approx(expected, rel=1e-9)
