# SPDX-License-Identifier: GPL-2.0-or-later
"""Conductivity of packings: by conduction models, by the network; ranks and restart of fix mpm/rve, columns of dempm-rve."""
import math

import numpy as np
import pytest
from scripts import HEAD, state, state_dump
from test_element import DISKS, RADIUS, THICKNESS, hexagonal_answer, rve  # noqa: F401
from test_rve_scene import first, material, packing

WORDS = "direct batchelor area hertz indirect voronoi_b fluid 0.026 conductivity network change 0.002 every 2"
PROPERTY = "fix k all property/global thermalConductivity peratomtype 1.4\n"


def by_model(script):
    """A scene of test_rve_scene with the model in place of pipes; conducting a thousand times better, so that heat arrives."""
    assert "pipe_resistance 1e3" in script
    return script.replace("pipe_resistance 1e3", WORDS).replace("fix rve all", PROPERTY.replace("1.4", "1e5") + "fix rve all")


def test_networks_answer_alike_on_1_and_2_ranks_and_after_a_restart(dempm, tmp_path):
    files = {"grains.data": packing(shrink=20)}
    one, two = (dempm(by_model(first(True, "restart 51 half.*\nrun 100\n")), np=np, files=files, cwd=tmp_path / str(np))
                for np in (1, 2))
    assert state(one, 100) == state(two, 100)
    assert "solved" in one.output and "carried along" in one.output
    solved = next(line for line in one.output.splitlines() if "conductivity of networks" in line)
    assert solved in two.output
    (tmp_path / "1" / "state.100.txt").unlink()
    again = dempm(HEAD + "read_restart half.51\n" + by_model(material(True)) + state_dump(100) + "run 49\n", np=2, cwd=tmp_path / "1")
    assert state(again, 100) == state(two, 100)


# ------------------------------------------------------------------------------------------------------- dempm-rve
HEAT = "--set expansion=0 --set Tref=0"
STILL = "time,Lxx\n0,0\n1e-9,0\n"


def answer(run, words, file="hex.data", grains=DISKS):
    (run.path / "still.csv").write_text(STILL)
    return run(f"run {file} --path still.csv {grains} {HEAT} {words} --out out.csv")[0]


def test_crystal_is_affine(rve):  # noqa: F811
    row = answer(rve, "--set alpha=16 --set conductivity=network")
    _, expected = hexagonal_answer(row)
    for ij, value in expected.items():
        assert row[f"K{ij}"] == pytest.approx(value, rel=1e-11, abs=1e-11 * expected["xx"])
        assert row[f"Kaffine_{ij}"] == pytest.approx(value, rel=1e-11, abs=1e-11 * expected["xx"])


def grains_at_random(count, edge, seed=4):
    """Random disks that overlap by up to 20 %: positions, radii."""
    draw = np.random.default_rng(seed)
    places, radii = [], []
    while len(places) < count:
        place, radius = draw.uniform(0, edge, 2), draw.uniform(0.6, 1.0) * RADIUS
        if all(np.hypot(*((place - other + edge / 2) % edge - edge / 2)) > 0.85 * (radius + r) for other, r in zip(places, radii)):
            places.append(place)
            radii.append(radius)
    return np.array(places), np.array(radii)


def dense_network(places, radii, edge, conductance):
    """(network, affine) conductivity, xx yy xy: numpy's pseudo-inverse of the Laplacian."""
    count = len(places)
    laplacian, supply, affine = np.zeros((count, count)), np.zeros((count, 2)), np.zeros((2, 2))
    for i in range(count):
        for j in range(i):
            branch = (places[j] - places[i] + edge / 2) % edge - edge / 2
            h = conductance(radii[i], radii[j], np.hypot(*branch))
            laplacian[i, i] += h
            laplacian[j, j] += h
            laplacian[i, j] -= h
            laplacian[j, i] -= h
            supply[i] += h * branch
            supply[j] -= h * branch
            affine += h * np.outer(branch, branch)
    network = affine - supply.T @ np.linalg.pinv(laplacian, rcond=1e-10) @ supply
    return [k / (edge * edge * THICKNESS) for tensor in (network, affine) for k in (tensor[0, 0], tensor[1, 1], tensor[0, 1])]


def geometric(r1, r2, d):
    return math.sqrt(max(r1 * r1 - ((r1 * r1 - r2 * r2 + d * d) / (2 * d)) ** 2, 0.0)) if d < r1 + r2 else 0.0


@pytest.mark.parametrize("words, conductance", [
    ("--set alpha=16", lambda r1, r2, d: 1 / (16 * d) if d < r1 + r2 else 0.0),
    ("--set direct=batchelor --set grain_conductivity=3", lambda r1, r2, d: 6 * geometric(r1, r2, d)),
    ("--set direct=pipe --set grain_conductivity=3", lambda r1, r2, d: 3 * math.pi * geometric(r1, r2, d) ** 2 / d),
], ids=["pipes", "batchelor", "pipe"])
def test_random_grains_meet_numpy(words, conductance, rve):  # noqa: F811
    edge, count = 0.1, 60
    places, radii = grains_at_random(count, edge)
    lines = ["grains", "", f"{count} atoms", "1 atom types", "", f"0 {edge} xlo xhi", f"0 {edge} ylo yhi", "-0.01 0.01 zlo zhi", "",
             "Atoms", ""]
    lines += [f"{k + 1} 1 {float(2 * radius)!r} 2650 {float(x)!r} {float(y)!r} 0" for k, ((x, y), radius) in enumerate(zip(places, radii))]
    (rve.path / "random.data").write_text("\n".join(lines) + "\n")
    row = answer(rve, f"{words} --set conductivity=network", "random.data")
    found = [row[f"{name}{ij}"] for name in ("K", "Kaffine_") for ij in ("xx", "yy", "xy")]
    expected = dense_network(places, radii, edge, conductance)
    assert found == pytest.approx(expected, rel=1e-10, abs=1e-10 * expected[3])
    assert row["Kxx"] < 0.98 * row["Kaffine_xx"]


def test_networks_are_counted(rve):  # noqa: F811
    words = f"run hex.data --path oedometer {DISKS} {HEAT} --set alpha=16 --set rate=0.5 --set strain=0.02 --out out.csv"
    code, output = rve(f"{words} --set conductivity=network", check=False)
    assert code == 0 and "networks: 2 solved, 199 carried along" in output, output  # each 1 % of strain
    code, output = rve(words, check=False)
    assert code == 0 and "networks" not in output


@pytest.mark.parametrize("words, message", [
    ("--set alpha=16 --set direct=batchelor --set grain_conductivity=1", "exclude each other"),
    ("--set direct=batchelor", "--set grain_conductivity=... is missing"),
    ("--set alpha=16 --set grain_conductivity=1", "--set grain_conductivity needs direct or indirect"),
    ("--set direct=collisional", "allowed: none, batchelor, liggghts, pipe"),
    ("--set indirect=layer --set grain_conductivity=1", "--set fluid=... is missing"),
    ("--set direct=pipe --set grain_conductivity=1 --set porosity=0.4", "--set porosity needs indirect=voronoi_a or voronoi_b"),
    ("--set indirect=voronoi_b --set fluid=1 --set grain_conductivity=1 --set porosity=1", "--set porosity: found '1'"),
    ("--set alpha=16 --set network_change=0.1", "--set network_change needs conductivity=network"),
    ("--set alpha=16 --set conductivity=exact", "allowed: affine, network"),
    ("--set alpha=16 --set conductivity_every=0", "--set conductivity_every: found '0'"),
])
def test_wrong_settings_are_refused(words, message, rve):  # noqa: F811
    (rve.path / "still.csv").write_text(STILL)
    code, output = rve(f"run hex.data --path still.csv {DISKS} {HEAT} {words} --out out.csv", check=False)
    assert code == 1 and message in output, output


def test_the_network_needs_heat(rve):  # noqa: F811
    (rve.path / "still.csv").write_text(STILL)
    code, output = rve(f"run hex.data --path still.csv {DISKS} --set conductivity=network --out out.csv", check=False)
    assert code == 1 and "--set conductivity needs heat" in output, output
