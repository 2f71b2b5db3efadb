#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Figures of the silo from its logs and point files: discharge, temperatures and where they are, energies, leaks."""
import argparse
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from thermo import last_table  # noqa: E402  (examples/thermo.py)

OUT = pathlib.Path(__file__).resolve().parent / "out"
OUTLET, SHOULDER, EDGE = 1.0, 1.4, 0.4  # m: heights of outlet and hopper's top; end of its left wall


def frames(path):
    """[(step, array of id, number, x, y, deviatoric strain, temperature)] of a text dump."""
    result = []
    for text in path.read_text().split("ITEM: TIMESTEP")[1:]:
        lines = text.strip().splitlines()
        result.append((int(lines[0]), np.array([[float(word) for word in line.split()] for line in lines[8:]])))
    return result


def place(x, y):
    """Where in the silo, in words. The silo's right half mirrors its left one."""
    x = min(x, 1.0 - x)
    if y < OUTLET:
        return "under the outlet" if y > 0.2 else "on the ground"
    if y < OUTLET + 0.15 and x > EDGE - 0.15:
        return "at the outlet"
    if x < 0.1 or (x + y - SHOULDER) / np.sqrt(2.0) < 0.1:
        return "at the hopper wall" if y < SHOULDER else "at the silo wall"
    return "in the core"


def leaks(points):
    """Points above the outlet's edge that are on the wrong side of a wall."""
    x, y = np.minimum(points[:, 2], 1.0 - points[:, 2]), points[:, 3]
    return int(np.sum((y > OUTLET) & ((x < 0.0) | ((x < EDGE) & (x + y < SHOULDER)))))


def report(case):
    table, series = last_table(OUT / f"log.{case}"), frames(OUT / f"{case}_points.txt")
    time, left, mass = table["Time"] - table["Time"][0], table["above"], table["mpm[1]"][0]
    change = lambda name: table[name][-1] - table[name][0]
    seconds, steps = table["CPU"][-1], change("mpm[12]")
    print(f"{case}: {time[-1]:.2f} s, {len(series[0][1])} points of {mass:.1f} kg/m in all, {steps / 1e9:.2f} thousand "
          f"million particle-steps, {seconds:.0f} s wall, {steps / max(seconds, 1e-9) / 1e6:.1f} million per second")
    for moment in np.linspace(0.0, time[-1], 7)[1:]:
        k = int(np.argmin(abs(time - moment)))
        print(f"  t = {time[k]:.2f} s: {100 * left[k]:5.1f} % of the mass above the outlet "
              f"({mass * left[k]:.1f} kg/m), hottest point {table['hottest'][k]:.5f} K")
    last = series[-1][1]
    hottest = last[np.argsort(-last[:, 5])]
    print("  hottest points: " + ", ".join(f"({x:.2f}, {y:.2f}) {t:.5f} K {place(x, y)}"
                                           for x, y, t in hottest[:5, [2, 3, 5]]))
    inside = last[last[:, 3] > OUTLET]
    for name in ("at the outlet", "at the hopper wall", "at the silo wall", "in the core"):
        pick = [row[5] for row in inside if place(row[2], row[3]) == name]
        if pick:
            print(f"  mean temperature {name}: {np.mean(pick):.5f} K ({len(pick)} points)")
    print(f"  grain friction {change('mpm[9]'):.1f} J/m, grain damping {change('mpm[13]'):.1f} J/m, wall friction "
          f"{change('left[6]') + change('right[6]') + change('floor[6]'):.1f} J/m (without the plate's), "
          f"potential energy {change('mpm[6]'):.1f} J/m")
    print(f"  points that went through a wall: {max(leaks(points) for _, points in series)}")

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--size", default="demo")
parser.add_argument("cases", nargs="+")
arguments = parser.parse_args()
print(f"silo, {arguments.size} size")
for name in arguments.cases:
    report(name)
