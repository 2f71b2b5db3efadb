# SPDX-License-Identifier: GPL-2.0-or-later
"""The job of bench_rve_shear.c in YADE: yade -j1 -n -x rve_yade.py 2|3 DATA SKIN STEPS. Prints one line of JSON."""
import json
import math
import sys
import time

from yade import *
from yade import utils

dimension, data, skin, steps = int(sys.argv[1]), sys.argv[2], float(sys.argv[3]), int(sys.argv[4])
rows = [line.split() for line in open(data)]
edge = [float(row[1]) - float(row[0]) for row in rows if row[2:] in (["xlo", "xhi"], ["ylo", "yhi"], ["zlo", "zhi"])]

O.materials.append(FrictMat(young=1e8, poisson=1, frictionAngle=math.atan(0.5), density=2650))
O.periodic = True
O.cell.hSize = Matrix3(edge[0], 0, 0, 0, edge[1], 0, 0, 0, edge[2])
for row in rows[rows.index(["Atoms"]) + 1:]:
    if len(row) != 7:
        continue
    diameter, x, y, z = float(row[2]), *(float(word) for word in row[4:])
    body = utils.sphere((x, y, z if dimension == 3 else 0.5 * edge[2]), 0.5 * diameter)
    body.state.vel = Vector3(-0.5 * x, 0.5 * y, 0)
    if dimension == 2:
        body.state.blockedDOFs = "zXY"
    O.bodies.append(body)

stiffness = MatchMaker(algo="val", val=1e6)
O.dt = 2e-6
O.cell.velGrad = Matrix3(-0.5, 0, 0, 0, 0.5, 0, 0, 0, 0)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=skin),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys(kn=stiffness, ks=stiffness)],
                    [Law2_ScGeom_FrictPhys_CundallStrack()]),
    NewtonIntegrator(damping=0.2),
]
O.run(1, True)
coordination = utils.avgNumInteractions()
start = time.time()
O.run(steps, True)
seconds = time.time() - start
stress = utils.getStress()
depth = edge[2] if dimension == 2 else 1.0  # 2D: force per length
print("RESULT " + json.dumps({
    "seconds": seconds, "sxx": -stress[0][0] * depth, "syy": -stress[1][1] * depth,
    "coordination_start": coordination, "coordination_end": utils.avgNumInteractions(), "rebuilds": None}), flush=True)
