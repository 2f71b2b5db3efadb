# SPDX-License-Identifier: GPL-2.0-or-later
"""fix heat/gran/grain at walls with a temperature: primitive walls and meshes, in contact and over gaps."""
import math

import pytest
from scipy.integrate import quad as integrate
from test_grain_heat import (INDIRECT, OURS, OUTPUT, STOCK, box, deviation, falling, grains, last, properties)
from test_surface_walls import quad, stl

PLANE = "fix floor all wall/gran model hertz tangential history primitive type 2 zplane 0.0 temperature 500\n"
MESH = """fix plate all mesh/surface file plate.stl type 2 temperature 500
fix floor all wall/gran model hertz tangential history mesh n_meshes 1 meshes plate
"""
FILES = {"plate.stl": stl(*quad((0, 0, 0), (0.06, 0, 0), (0.06, 0.06, 0), (0, 0.06, 0)))}
BIG = {"plate.stl": stl(*quad((-0.01, -0.01, 0), (0.08, -0.01, 0), (0.08, 0.08, 0), (-0.01, 0.08, 0)))}
LYING = [(1, 0.005, 0.03, 0.03, 0.0049, 300.0), (1, 0.004, 0.02, 0.04, 0.0039, 300.0)]  # the second off the diagonal


def lying(words, wall, steps=1):
    """Two grains that overlap with a floor and do not move."""
    make, heat = grains(LYING)
    fix = f"fix heat all heat/gran/grain initial_temperature 300 {words}\n"
    output = OUTPUT.replace("thermo 1000", "thermo 1").replace("f_heat\n", "f_heat f_heat[3]\n")
    return (box((0, 0, -0.001), (0.06, 0.06, 0.06), "f f f") + make + properties(fix) + fix + wall + heat +
            output.format(every=1) + f"run {steps}\n")


@pytest.mark.parametrize("wall", [PLANE, MESH], ids=["plane", "mesh"])
@pytest.mark.parametrize("words, conductance", [
    ("direct batchelor", lambda r, d: 4 * 20 * 90 / 110 * math.sqrt(r * r - d * d)),
    ("direct batchelor area hertz", lambda r, d: 4 * 20 * 90 / 110 * math.sqrt(r * (r - d))),
    ("direct liggghts", lambda r, d: 4 * 20 * 90 / 110 * math.sqrt(math.pi * (r * r - d * d))),
    ("direct pipe", lambda r, d: math.pi * (r * r - d * d) * 20 / d),
], ids=["batchelor", "hertz", "liggghts", "pipe"])
def test_walls_conduct_by_the_model(words, conductance, wall, dempm):
    """One grain lies on the edge between both triangles: they count once."""
    run = dempm(lying(words, wall), files=FILES)
    flows = [conductance(row[1], row[4]) * 200.0 for row in LYING]
    assert last(run, "f_heatFlux[0]") == pytest.approx(flows, rel=1e-10)
    assert run.table["f_heat[3]"][-1] == pytest.approx(sum(flows), rel=1e-10)


def falling_on(wall, fix, skin=None, steps=5000):
    floor = "fix floor all wall/gran model hertz tangential history primitive type 1 zplane 0.0 temperature 500\n"
    return falling(fix, steps, skin).replace(floor, wall)


def test_meshes_conduct_as_in_the_stock_fix(dempm, liggghts, tmp_path):
    ours, two = (dempm(falling_on(MESH, OURS), np=np, files=BIG, cwd=tmp_path / str(np)) for np in (1, 2))
    stock = liggghts(falling_on(MESH, STOCK), files=BIG, cwd=tmp_path / "stock")
    unheated = dempm(falling_on(MESH.replace(" temperature 500", ""), OURS), files=BIG, cwd=tmp_path / "unheated")
    assert deviation(unheated, stock) > 0.01
    assert last(ours, "z") == last(stock, "z")
    assert deviation(ours, stock) < 1e-10 and deviation(two, ours) < 1e-10


@pytest.mark.parametrize("wall", [PLANE, MESH], ids=["plane", "mesh"])
def test_heat_of_walls_adds_up_over_several_runs(wall, dempm):
    """LIGGGHTS takes up its own conduction to walls again whenever a run begins."""
    run = dempm(lying("direct batchelor", wall, 20) + "run 0\nrun 20\n", files=FILES)
    for table in (run.thermo[-3], run.thermo[-1]):
        energy, flow = table["f_heat"], table["f_heat[3]"]
        assert len(energy) == 21
        for n in range(1, 21):
            assert energy[n] - energy[n - 1] == pytest.approx(2e-5 * flow[n], abs=1e-12 * energy[0])
            assert flow[n] > 0.0


# ------------------------------------------------------------------------------------------- through the fluid
def through_fluid(model, R, d, k=20.0, fluid=0.5):
    """Quadratures over the paths to the plane; `indirect` keywords as in INDIRECT."""
    contact, face = math.sqrt(max(R * R - d * d, 0.0)), 0.56 * R / 0.6 ** (1 / 3)

    def height(r):
        return math.sqrt(max(R * R - r * r, 0.0))

    def voronoi_a(r):
        return 2 * math.pi * r / ((height(r) - r * d / face) / k + (d - height(r)) / fluid)

    def voronoi_b(angle):
        return 2 * math.pi * math.sin(angle) / (1 / R / k + (1 / R - math.cos(angle) / d) / fluid)

    def layer(r):
        return fluid * 2 * math.pi * r / max(1e-6, d - height(r))

    path, low, high = {"voronoi_a": (voronoi_a, contact, R * face / math.hypot(face, d)),
                       "voronoi_b": (voronoi_b, math.atan(contact / d), math.atan(face / d)),
                       "layer": (layer, contact, min(R, math.sqrt((1.4 * R) ** 2 - d * d)))}[model]
    cuts = [low + (high - low) * 0.1 ** n for n in range(8, -1, -1)]
    if model == "layer" and d - 1e-6 < R:
        cuts = sorted(cuts + [math.sqrt(R * R - (d - 1e-6) ** 2)])
    return sum(integrate(path, a, b, epsabs=0.0, epsrel=1e-11)[0] for a, b in zip([low] + cuts, cuts) if b > a)


def batchelor(R, d):
    return 4 * 20 * 90 / 110 * math.sqrt(max(R * R - d * d, 0.0))


def over(rows, words, wall, steps=1, skin=0.0045):
    """Grains that do not move over a wall."""
    make, heat = grains(rows)
    fix = f"fix heat all heat/gran/grain initial_temperature 300 {words}\n"
    output = OUTPUT.replace("thermo 1000", "thermo 1").replace("f_heat\n", "f_heat f_heat[3]\n")
    return (box((0, 0, -0.001), (0.06, 0.06, 0.06), "f f f") + make + properties(fix, skin) + fix + wall + heat +
            output.format(every=1) + f"run {steps}\n")


NEAR = [*LYING, (1, 0.005, 0.015, 0.015, 0.0059, 300.0)]  # the third over the diagonal, apart by 0.0009


@pytest.mark.parametrize("wall", [PLANE, MESH], ids=["plane", "mesh"])
@pytest.mark.parametrize("name", [*INDIRECT])
def test_the_fluid_conducts_to_walls(name, wall, dempm, tmp_path):
    for direct in ("none", "batchelor"):
        run = dempm(over(NEAR, f"direct {direct} {INDIRECT[name]}", wall), files=FILES, cwd=tmp_path / direct)
        flows = [200.0 * (through_fluid(name, row[1], row[4]) + (direct != "none") * batchelor(row[1], row[4]))
                 for row in NEAR]
        assert last(run, "f_heatFlux[0]") == pytest.approx(flows, rel=1e-9)
        assert run.table["f_heat[3]"][-1] == pytest.approx(sum(flows), rel=1e-9)


@pytest.mark.parametrize("name, reach", [("voronoi_a", 0.25), ("voronoi_b", 0.25), ("layer", 0.4)])
def test_heat_crosses_gaps_to_walls_up_to_the_reach(name, reach, dempm, tmp_path):
    """Also if LIGGGHTS' list of the mesh is old: the skin is just above what is asked for."""
    for wall in (PLANE, MESH):
        rows = [(1, 0.005, 0.02, 0.025, 0.005 * (1 + reach * f), 300.0) for f in (0.999, 1.001)]
        rows = [rows[0], (*rows[1][:2], 0.04, *rows[1][3:])]
        run = dempm(over(rows, f"direct batchelor {INDIRECT[name]}", wall, skin=0.0041), files=FILES,
                    cwd=tmp_path / str(len(wall)))
        near, far = last(run, "f_heatFlux[0]")
        assert near == pytest.approx(200.0 * through_fluid(name, 0.005, rows[0][4]), rel=1e-9) and far == 0.0


def plates(*panels):
    return {"plate.stl": stl(*(triangle for panel in panels for triangle in quad(*panel)))}


FLOOR = ((0, 0, 0), (0.06, 0, 0), (0.06, 0.06, 0), (0, 0.06, 0))
SIDE = ((0, 0, 0), (0, 0.06, 0), (0, 0.06, 0.06), (0, 0, 0.06))
ROOF = (((0, 0, 0), (0.03, 0, 0.02), (0.03, 0.06, 0.02), (0, 0.06, 0)),
        ((0.03, 0, 0.02), (0.06, 0, 0), (0.06, 0.06, 0), (0.03, 0.06, 0.02)))
BACK = ((0, 0, -0.0005), (0.06, 0, -0.0005), (0.06, 0.06, -0.0005), (0, 0.06, -0.0005))


@pytest.mark.parametrize("panels, x, z, distances", [
    ((FLOOR, SIDE), 0.0052, 0.0054, (0.0052, 0.0054)),
    (ROOF, 0.03, 0.0255, (0.0055,)),
    ((FLOOR, BACK), 0.03, 0.0052, (0.0052,)),
], ids=["corner", "ridge", "plate"])
def test_a_wall_counts_where_it_is_in_sight(panels, x, z, distances, dempm):
    """In a corner two walls, over a ridge one, of a thin plate the near side alone."""
    rows = [(1, 0.005, x, 0.031, z, 300.0), (1, 0.001, 0.05, 0.05, 0.05, 300.0)]
    run = dempm(over(rows, f"direct none {INDIRECT['voronoi_b']}", MESH), files=plates(*panels))
    flow = 200.0 * sum(through_fluid("voronoi_b", 0.005, d) for d in distances)
    assert last(run, "f_heatFlux[0]") == pytest.approx([flow, 0.0], rel=1e-9)


@pytest.mark.parametrize("name", ["voronoi_b", "layer"])
def test_ranks_and_skins_agree_while_grains_fall_on_a_mesh(name, dempm, tmp_path):
    """Until the first impacts, whose outcome depends on when LIGGGHTS builds its lists."""
    fix = f"fix heat all heat/gran/grain initial_temperature 300 direct batchelor {INDIRECT[name]}\n"
    cases = {"one": (MESH, 1, 0.005), "two": (MESH, 2, 0.005), "skin": (MESH, 1, 0.009), "cold": ("", 1, 0.005)}
    runs = {case: dempm(falling_on(wall, fix, skin, 1000), np=np, files=BIG, cwd=tmp_path / case)
            for case, (wall, np, skin) in cases.items()}
    assert deviation(runs["cold"], runs["one"]) > 0.01
    assert deviation(runs["two"], runs["one"]) < 1e-10 and deviation(runs["skin"], runs["one"]) < 1e-10
