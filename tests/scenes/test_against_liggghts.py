# SPDX-License-Identifier: GPL-2.0-or-later
"""Verification A8: the stock LIGGGHTS and the RVE engine move the same packing alike, grain by grain.

Same packing, same velocities and spins, same law (`model hooke/stiffness tangential history`), same integrator: velocity
Verlet is the engine's leapfrog once whole-step velocities are taken to half steps, which rve_run's `verlet 1` does (see the
head of tests/tools/rve_run.c). Dashpots see the half-step velocity in both codes."""
import math
import pathlib
import random
import sys

import pytest

from conftest import BUILD, ROOT, execute

sys.path.insert(0, str(ROOT / "tests" / "validation"))
from peer_rve import Packing, generate, zero_mean  # noqa: E402

KN, KT, MU, DT, STEPS = 1e6, 8e5, 0.5, 2e-6, 1000
# 2D: LIGGGHTS' disks are 1 m long; 35.3 kg/m3 make them as heavy as those of 2650 kg/m3 and 13 mm.
DENSITY = {2: 35.3, 3: 2650.0}
PACKINGS = {2: dict(grains=100, thickness=1.0), 3: dict(grains=216, dimension=3)}

SCRIPT = """
atom_style granular
atom_modify map array
units si
dimension {dimension}
newton off
boundary p p p
communicate single vel yes
read_data start.data
neighbor 5e-4 bin
neigh_modify delay 0 every 1 check yes
fix kn all property/global kn peratomtypepair 1 {kn}
fix kt all property/global kt peratomtypepair 1 {kt}
fix gn all property/global gamman peratomtypepair 1 {gamman}
fix gt all property/global gammat peratomtypepair 1 {gammat}
fix mu all property/global coefficientFriction peratomtypepair 1 {mu}
pair_style gran model hooke/stiffness tangential history
pair_coeff * *
timestep {dt}
fix move all nve/sphere
{flat}
group first id <= {first}
thermo_style custom step ke
run {steps}
{kick}
dump end all custom 1 end.dump id x y z vx vy vz omegax omegay omegaz
dump_modify end sort id format "%d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g"
run 0
"""
# `sum yes` adds; a grain here and there gets it, so that forces jump at once.
KICK = "velocity first set {0} {1} {2} sum yes units box\nrun {steps}"


@pytest.fixture(scope="module", params=[2, 3])
def packing(request, tmp_path_factory):
    file = tmp_path_factory.mktemp("packing") / "grains"
    generate(file, radius=(0.0025, 0.005), density=DENSITY[request.param], kn=KN, kt=KT, pressure=1e3 if request.param == 2 else 1e5,
             preparation_friction=0.1, **PACKINGS[request.param])
    return Packing(file)


def motion(packing, speed):
    chance = random.Random(7)
    n, flat = len(packing.radius), packing.dimension == 2
    uniform = lambda size, axes: [[chance.uniform(-size, size) if k in axes else 0.0 for k in range(3)] for _ in range(n)]
    velocity = uniform(speed, (0, 1) if flat else (0, 1, 2))
    spin = uniform(speed / 0.004, (2,) if flat else (0, 1, 2))
    return zero_mean(velocity, [r ** packing.dimension for r in packing.radius]), spin


def compare(packing, liggghts, tmp_path, speed, gamman=0.0, gammat=0.0, kick=None):
    dimension, first = packing.dimension, len(packing.radius) // 5
    velocity, spin = motion(packing, speed)
    data = packing.data(DENSITY[dimension], velocity, spin, height=0.05)
    words = dict(kn=KN, kt=KT, mu=MU, gamman=gamman, gammat=gammat, dt=DT, steps=STEPS)
    text = KICK.format(*kick, steps=STEPS) if kick else ""
    run = liggghts(SCRIPT.format(dimension=dimension, flat="fix flat all enforce2d" if dimension == 2 else "", first=first,
                                 kick=text, **words), files={"start.data": data})
    theirs = run.dump("end.dump")[-1][1]
    words = [word for key, value in words.items() for word in (key, value)]
    words += ["density", DENSITY[dimension], "thickness", 1.0, "verlet", 1, "grains", "end.txt"]
    if kick:
        words += ["kick", first, *kick]
    code, output = execute([BUILD / "tools" / "rve_run", "start.data", dimension, *words], cwd=tmp_path)
    assert code == 0, output
    ours = [[float(word) for word in line.split()] for line in (tmp_path / "end.txt").read_text().splitlines()]
    return deviations(packing, theirs, ours, velocity)


def deviations(packing, theirs, ours, velocity):
    """Largest deviations: places over the mean radius and over the longest way; velocities and spins over their largest."""
    place = way = 0.0
    for i, row in enumerate(ours):
        for k in range(packing.dimension):
            edge = packing.edge[k]
            apart = lambda a, b: abs((a - b) - edge * round((a - b) / edge))
            place = max(place, apart(theirs["xyz"[k]][i], row[1 + k] + 0.5 * edge))
            way = max(way, apart(packing.position[i][k], row[1 + k] + 0.5 * edge))
    names = ["vx", "vy", "vz"], ["omegax", "omegay", "omegaz"]
    parts = []
    for m, columns in enumerate(names):
        size = max(abs(x) for name in columns for x in theirs[name])
        parts.append(max(abs(theirs[name][i] - row[4 + 3 * m + k]) for i, row in enumerate(ours)
                         for k, name in enumerate(columns)) / size)
    return place / (math.fsum(packing.radius) / len(packing.radius)), place / way, *parts


@pytest.mark.parametrize("damping", ["none", "viscous"])
@pytest.mark.parametrize("kick", [None, (0.03, -0.02, 0.0)], ids=["", "kick"])
def test_trajectories(packing, liggghts, tmp_path, damping, kick, record_property):
    gamma = dict(gamman=2.3e4, gammat=1.15e4) if damping == "viscous" else {}
    found = compare(packing, liggghts, tmp_path, 0.05, kick=kick, **gamma)
    print(packing.dimension, damping, kick, found)
    assert max(found) <= 1e-9
