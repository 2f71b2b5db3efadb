#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Verification A10: the quasi-static limit. Dense packings under isochoric biaxial shear of 3 %, at inertial numbers from 4e-3
down, and with local damping from 0.1 to 0.7: how far the stress moves when the rate is halved, or the damping changed.

   rve_quasi_static.py [number of seeds]        from the root, after `make build/tools/rve_run`

I = rate d sqrt(rho / p), with the pressure p at the start, which is the lowest. Stress: the deviator and the pressure, each
the mean over the path beyond the first 0.5 %, in one packing and in the mean of all."""
import pathlib
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from peer_rve import generate, rve_run  # noqa: E402

RADII, RHO, PRESSURE, STRAIN, POINTS = (0.0025, 0.005), 2650.0, 1e5, 0.03, 60
LAW = dict(density=RHO, kn=1e6, kt=1e6, thickness=0.075)
SIZE = {2: dict(grains=400), 3: dict(grains=512)}
NUMBERS = [4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4]
DAMPINGS = [0.1, 0.2, 0.3, 0.5, 0.7]
DT = {2: 1e-5, 3: 2e-6}  # s: 0.34 and 0.40 of the critical one


def path_mean(packing, dimension, number, damping):
    """(deviator, pressure) in Pa"""
    rate = number / (sum(RADII) * np.sqrt(RHO / PRESSURE))
    law = {key: value for key, value in LAW.items() if dimension == 2 or key != "thickness"}
    dt = DT[dimension]
    steps = int(STRAIN / rate / dt)
    every = steps // POINTS
    gradient = [-rate, 0, 0, 0, rate, 0, 0, 0, 0]
    found, stable, last = rve_run(packing, dimension, mu=0.5, local=damping, dt=dt, steps=every * POINTS, every=every,
                                  L=gradient, **law)
    assert stable, last
    xx, yy = (np.array(found[name])[POINTS // 6:] for name in ("sxx", "syy"))
    return np.array([(yy - xx).mean() / 2, -(xx + yy).mean() / 2])


def main():
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 8
    folder = pathlib.Path(tempfile.mkdtemp())
    for dimension in (2, 3):
        law = {key: value for key, value in LAW.items() if dimension == 2 or key != "thickness"}
        packings = [generate(folder / f"{dimension}_{seed}", dimension=dimension, radius=RADII, pressure=PRESSURE,
                             preparation_friction=0.01, seed=seed, **SIZE[dimension], **law) for seed in range(1, seeds + 1)]
        rates = np.array([[path_mean(p, dimension, number, 0.3) for p in packings] for number in NUMBERS])
        report(f"{dimension}D I", NUMBERS, rates)
        for number in (1e-3, 2.5e-4):
            dampings = np.array([[path_mean(p, dimension, number, damping) for p in packings] for damping in DAMPINGS])
            report(f"{dimension}D I = {number:g} damping", DAMPINGS, dampings, reference=0)


def report(name, values, stress, reference=None):
    """Change against the line before (or a reference): of the mean of all packings, and root mean square of single ones."""
    for k, value in enumerate(values):
        other = stress[reference] if reference is not None else stress[max(k - 1, 0)]
        change = stress[k].mean(0) / other.mean(0) - 1
        single = np.sqrt(((stress[k] / other - 1) ** 2).mean(0))
        error = (stress[k] / other - 1).std(0) / np.sqrt(max(len(stress[k]) - 1, 1))
        print(f"{name} {value:8.2g}: deviator {stress[k].mean(0)[0] / 1e3:8.2f} kPa, pressure {stress[k].mean(0)[1] / 1e3:8.2f} kPa; "
              f"change {change[0]:+.2%} +- {error[0]:.2%}, {change[1]:+.2%} +- {error[1]:.2%}; single packings {single[0]:.2%}, "
              f"{single[1]:.2%}", flush=True)


if __name__ == "__main__":
    main()
