# SPDX-License-Identifier: GPL-2.0-or-later
"""fix heat/gran/grain: radiation between neighbours, properties over temperature."""
import math

import pytest
from scipy.integrate import quad as integrate
from test_grain_heat import (FLOWS, HEAD, INDIRECT, OUTPUT, PAIR_ROWS, alone, area_over_capacity, circle, deviation,
                             last, properties, still, two_grains)
from test_grain_heat_walls import FILES, MESH, PLANE, over

SIGMA = 5.670374419e-8


# ------------------------------------------------------------------------------------------ between neighbours
def cap(radius, height, face):
    """Between the face and the contact circle (the plane then cuts the sphere)."""
    return 2 * math.pi * radius * (min(height, radius) - radius * height / math.hypot(height, face))


def share(height, face):
    return 0.5 * (1 - height / math.hypot(height, face))


def exchange(one, two, emissivity):
    return 1 / (1 / min(one, two) + (1 - emissivity) / emissivity * (1 / one + 1 / two))


def pair_view(a, b, d, emissivity):
    face = 0.56 * 0.5 * (a + b) / 0.6 ** (1 / 3)
    heights = [0.5 * (d + (a * a - b * b) / d), 0.5 * (d - (a * a - b * b) / d)]
    area = exchange(cap(a, heights[0], face), cap(b, heights[1], face), emissivity)
    return area, [share(h, face) for h in heights]


@pytest.mark.parametrize("gap", [-1e-4, 1e-3, 0.00226])
def test_neighbours_radiate(gap, dempm, tmp_path):
    rows = [PAIR_ROWS[0], (2, 0.004, 0.019 + gap, 0.01, 0.01, 850.0)]
    area, shares = pair_view(0.005, 0.004, 0.009 + gap, 0.7)
    if gap > 0.5 * 0.0045:
        area, shares = 0.0, [0.0, 0.0]
    flow = SIGMA * area * (850.0 ** 4 - 350.0 ** 4)
    surroundings = [4 * math.pi * r * r * 0.7 * SIGMA * (400.0 ** 4 - T ** 4) * (1 - s)
                    for r, T, s in zip((0.005, 0.004), (350.0, 850.0), shares)]
    for words, expected in (("none", [flow, -flow]), ("400", [flow + surroundings[0], -flow + surroundings[1]])):
        fix = f"fix heat all heat/gran/grain initial_temperature 300 direct none radiation 0.7 {words} neighbours\n"
        script = two_grains(fix, 1, rows).replace("neighbor 0.001", "neighbor 0.0035")
        run = dempm(script.replace("thermo_style custom step atoms f_heat\n", FLOWS), cwd=tmp_path / words)
        assert last(run, "f_heatFlux[0]") == pytest.approx(expected, rel=1e-11)
        assert run.table["f_heat[2]"][-1] == pytest.approx(sum(expected), rel=1e-11, abs=1e-15)


@pytest.mark.parametrize("wall", [PLANE, MESH], ids=["plane", "mesh"])
def test_walls_radiate(wall, dempm):
    """The face lies in the wall, halfway to the mirror image; no neighbour at a quarter of a radius and more."""
    rows = [(1, 0.005, 0.02, 0.025, 0.0055, 300.0), (1, 0.005, 0.04, 0.025, 0.0063, 300.0)]
    run = dempm(over(rows, "direct none radiation 0.7 none neighbours", wall), files=FILES)
    face = 0.56 * 0.005 / 0.6 ** (1 / 3)
    flow = SIGMA * exchange(cap(0.005, 0.0055, face), math.pi * face ** 2, 0.7) * (500.0 ** 4 - 300.0 ** 4)
    assert last(run, "f_heatFlux[0]") == pytest.approx([flow, 0.0], rel=1e-11)
    assert run.table["f_heat[3]"][-1] == pytest.approx(flow, rel=1e-11)


TABLES = """
fix kt all property/global thermalConductivityTable matrix 3 200 20 90 300 10 80 450 30 10
fix ct all property/global thermalCapacityTable matrix 3 210 0.1 0.2 300 0.15 0.1 390 0.1 0.3
"""
CASES = {
    "radiation": ("", "direct none radiation 0.9 none neighbours", 200),
    "both": ("", f"direct batchelor {INDIRECT['voronoi_b']} radiation 0.9 none neighbours", 100),
    "tables": (TABLES, f"direct batchelor {INDIRECT['layer']} conductivity table capacity table", 100),
    "all": (TABLES, "direct pipe radiation 0.9 none neighbours conductivity table capacity table", 100),
}


def case_script(name, steps=None):
    extra, words, default = CASES[name]
    fix = extra + f"fix heat all heat/gran/grain initial_temperature 300 {words}\n"
    script = still(fix, steps or default).replace("neighbor 0.001", "neighbor 0.0035")
    return script.replace("timestep 2e-5", "timestep 2e-4") if name == "radiation" else script


@pytest.mark.parametrize("name", [*CASES])
def test_energy_is_kept_and_ranks_agree(name, dempm, tmp_path):
    runs = [dempm(case_script(name), np=np, cwd=tmp_path / str(np)) for np in (1, 2)]
    for run in runs:
        energy = run.table["f_heat"]
        assert energy[-1] == pytest.approx(energy[0], rel=1e-13)
        temperatures = last(run, "f_Temp[0]")
        assert max(temperatures) - min(temperatures) < 190.0  # of 200: heat has moved
    assert deviation(*runs) < 1e-13


def test_restart_continues(dempm, tmp_path):
    script = case_script("all", 100).replace("run 100\n", "run 100\nwrite_restart half\nrun 100\n")
    through = dempm(script, cwd=tmp_path / "through")
    extra, words, _ = CASES["all"]
    fix = extra + f"fix heat all heat/gran/grain initial_temperature 300 {words}\n"
    again = dempm(HEAD.format(boundary="p p f") + f"read_restart {tmp_path}/through/half\n" +
                  properties(fix, 0.0035) + fix + OUTPUT.format(every=100) + "run 100\n", cwd=tmp_path / "again")
    assert last(again, "f_Temp[0]") == last(through, "f_Temp[0]")


# --------------------------------------------------------------------------------- properties over temperature
def test_conductivity_is_that_of_the_temperature(dempm):
    """350 K: 10 + 20 / 3; 250 K: 85."""
    fix = TABLES + "fix heat all heat/gran/grain initial_temperature 300 direct batchelor conductivity table\n"
    run = dempm(two_grains(fix, 1))
    one, two = 10 + 20 / 3, 85.0
    flow = 4 * one * two / (one + two) * circle(0.005, 0.004, 0.0089) * -100.0
    assert last(run, "f_heatFlux[0]") == pytest.approx([flow, -flow], rel=1e-10)


def test_a_wall_has_the_conductivity_of_its_temperature(dempm):
    """The wall at 500 K lies beyond the table: 10, the last entry; grains at 300 K: 10."""
    rows = [(1, 0.005, 0.03, 0.03, 0.0049, 300.0), (1, 0.004, 0.02, 0.04, 0.0039, 300.0)]
    run = dempm(over(rows, "direct batchelor conductivity table", TABLES + PLANE))
    flows = [4 * 5 * math.sqrt(row[1] ** 2 - row[4] ** 2) * 200.0 for row in rows]
    assert last(run, "f_heatFlux[0]") == pytest.approx(flows, rel=1e-10)


def capacity(T, column):
    rows = [(210, 0.1, 0.2), (300, 0.15, 0.1), (390, 0.1, 0.3)]
    if T <= rows[0][0]:
        return rows[0][column]
    for low, high in zip(rows, rows[1:]):
        if T <= high[0]:
            return low[column] + (high[column] - low[column]) * (T - low[0]) / (high[0] - low[0])
    return rows[-1][column]


def test_cooling_with_a_varying_capacity(dempm, tmp_path):
    """Convection: m c(T) dT/dt = H A (T_f - T); the time to reach the temperature found, by quadrature."""
    errors = []
    for steps in (100, 200):
        script = alone("convection 60 300 capacity table", steps, 0.02 / steps).replace("fix heat", TABLES + "fix heat")
        run = dempm(script, cwd=tmp_path / str(steps))
        energy, flow = run.table["f_heat"], run.table["f_heat[1]"]
        for n in range(1, steps + 1):
            assert energy[n] - energy[n - 1] == pytest.approx(0.02 / steps * flow[n], abs=1e-12 * energy[0])
        times = []
        for n, (start, end) in enumerate(zip((350.0, 250.0), last(run, "f_Temp[0]"))):
            rate = 60 * area_over_capacity(run)[n] * (0.1, 0.2)[n]  # H A / m
            times.append(integrate(lambda T, n=n: capacity(T, n + 1) / (300.0 - T), start, end, epsrel=1e-11)[0] / rate)
            assert abs(end - start) > 5.0
        errors.append(max(abs(t / 0.02 - 1) for t in times))
    assert 1.8 < errors[0] / errors[1] < 2.2 and errors[1] < 0.01


def test_liggghts_integrates_again_without_the_fix(dempm):
    """A table stops LIGGGHTS' own integration of Temp until the fix is removed."""
    after = "unfix heat\nfix heat all heat/gran/grain initial_temperature 300 direct batchelor\nrun 1\n"
    script = TABLES + "fix heat all heat/gran/grain initial_temperature 300 direct batchelor capacity table\n"
    run = dempm(two_grains(script, 1).replace("run 1\n", "run 1\n" + after))
    frames = [columns for _, columns in run.dump("end.dump")]
    for first, end, heat in ((frames[-2], frames[-1], (0.1, 0.2)),):
        for n in range(2):
            gain = heat[n] * end["mass"][n] * (end["f_Temp[0]"][n] - first["f_Temp[0]"][n])
            assert gain == pytest.approx(2e-5 * end["f_heatFlux[0]"][n], rel=1e-9) and gain != 0.0
