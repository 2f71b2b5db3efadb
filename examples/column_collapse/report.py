#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Figures of the column collapse from its logs: run length, grains, particle-steps per second, runout, balances."""
import argparse
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from thermo import last_table  # noqa: E402  (examples/thermo.py)

OUT = pathlib.Path(__file__).resolve().parent / "out"


def energies(table):
    """Terms of the energy ledger, J per metre of depth, changes since the start."""
    change = lambda name: table[name] - table[name][0]
    return {
        "potential": change("mpm[6]"),
        "kinetic": change("mpm[5]"),
        "stored in the grains": change("mpm[7]"),
        "grain friction (heat)": change("mpm[9]"),
        "grain damping": change("mpm[13]"),
        "wall friction": change("floor[6]"),
    }


def momentum_error(case, table):
    """Largest |change of momentum - impulse of gravity and walls| over the largest momentum."""
    impulses = np.loadtxt(OUT / f"{case}_reactions.txt", ndmin=2)
    if len(impulses) == 0:
        return np.nan
    count = min(len(impulses), len(table["Step"]) - 1)
    duration = np.diff(table["Time"])[:count]
    weight = np.array([0.0, -9.8 * table["mpm[1]"][0]])
    momentum = np.stack([table["mpm[2]"], table["mpm[3]"]], axis=1)
    walls = impulses[:count, 1:3] + impulses[:count, 3:5]
    expected = momentum[0] + np.cumsum((walls + weight) * duration[:, None], axis=0)
    return np.max(np.abs(momentum[1:count + 1] - expected)) / np.max(np.abs(momentum))


def report(case, grains):
    table = last_table(OUT / f"log.{case}")
    points = None
    for line in (OUT / f"log.{case}").read_text(errors="replace").splitlines():
        if line.strip().endswith("atoms") and line.split()[0].isdigit():
            points = int(line.split()[0])
    seconds, steps = table["CPU"][-1], table["mpm[12]"][-1] - table["mpm[12]"][0]
    ledger = energies(table)
    released = max(-ledger["potential"].min(), 1e-30)
    balance = sum(values[-1] for values in ledger.values())
    width = table["front"][0]
    print(f"{case}: {table['Time'][-1] - table['Time'][0]:.2f} s of collapse, {points} points x {grains} grains = "
          f"{points * grains} grains, {seconds:.0f} s wall, {steps / max(seconds, 1e-9) / 1e6:.0f} million particle-steps/s")
    print(f"  front {width:.2f} -> {table['front'].max():.2f} m, runout (L - L0)/L0 = "
          f"{(table['front'].max() - width) / width:.2f}, largest kinetic energy {table['mpm[5]'].max():.0f} J/m")
    for name, values in ledger.items():
        print(f"  {name:24s} {values[-1]:10.1f} J/m  {100 * values[-1] / released:7.2f} % of the released potential energy")
    print(f"  {'sum':24s} {balance:10.1f} J/m  {100 * balance / released:7.2f} % (what the FLIP/PIC blend dissipates; 0 with pure FLIP)")
    print(f"  heat through the hot wall {table['left[7]'][-1]:.1f} J/m, momentum against impulses "
          f"{momentum_error(case, table):.1e}")


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--size", default="demo")
parser.add_argument("--grains", type=int, default=200)
parser.add_argument("cases", nargs="+")
arguments = parser.parse_args()
print(f"column collapse, {arguments.size} size")
for name in arguments.cases:
    report(name, arguments.grains)
