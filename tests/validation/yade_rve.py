# SPDX-License-Identifier: GPL-2.0-or-later
"""Biaxial shear of a periodic packing in YADE, for rve_against_peers.py, which hands over the case as JSON in CASE:
   CASE=case.json yade -j1 -n -x yade_rve.py"""
import json
import math
import os

from yade import *  # noqa: F403
from yade import utils

with open(os.environ["CASE"]) as file:
    case = json.load(file)
edge, flat = case["edge"], case["dimension"] == 2
O.materials.append(FrictMat(young=1e8, poisson=1, frictionAngle=math.atan(case["mu"]), density=case["density"]))
O.periodic = True
O.cell.hSize = Matrix3(edge[0], 0, 0, 0, edge[1], 0, 0, 0, edge[2])
for (x, y, z), radius in zip(case["position"], case["radius"]):
    ball = utils.sphere((x, y, 0.5 * edge[2] if flat else z), radius)
    ball.state.vel = Vector3(-case["rate"] * x, case["rate"] * y, 0)
    if flat:
        ball.state.blockedDOFs = "zXY"
    O.bodies.append(ball)
O.dt = case["dt"]
O.cell.velGrad = Matrix3(-case["rate"], 0, 0, 0, case["rate"], 0, 0, 0, 0)
stiff = dict(kn=MatchMaker(algo="val", val=case["kn"]), ks=MatchMaker(algo="val", val=case["kt"]))
O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=4e-4),
             InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys(**stiff)],
                             [Law2_ScGeom_FrictPhys_CundallStrack()]),
             NewtonIntegrator(damping=case["local"])]
depth = edge[2] if flat else 1.0  # 2D: force per length
for step in range(0, case["steps"] + 1, case["every"]):
    if step:
        O.run(case["every"], True)
    stress = utils.getStress() if step else Matrix3(0, 0, 0, 0, 0, 0, 0, 0, 0)
    print("ROW", step, -stress[0][0] * depth, -stress[1][1] * depth, -stress[2][2] * depth, flush=True)
