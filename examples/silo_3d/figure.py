#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Slices through the silo:  figure.py out/points.txt picture.png"""
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

HOPPER = [(-0.25, 0.8), (-0.25, 0.25), (-0.1, 0.1)]


def frames(path):
    """{step: rows of id x y z vx vy vz} of a dump."""
    with open(path, encoding="utf-8") as file:
        while file.readline():
            step = int(file.readline())
            file.readline()
            count = int(file.readline())
            for _ in range(5):
                file.readline()
            yield step, np.array([file.readline().split() for _ in range(count)], dtype=float)


def draw(axes, step, rows, dt=2e-4):
    slab = rows[np.abs(rows[:, 2]) < 0.03]
    speed = np.linalg.norm(slab[:, 4:7], axis=1)
    points = axes.scatter(slab[:, 1], slab[:, 3], c=speed, s=9, vmin=0, vmax=2, cmap="viridis")
    for side in (1, -1):
        axes.plot([side * x for x, _ in HOPPER], [z for _, z in HOPPER], "k", linewidth=1)
    axes.axhline(-0.3, color="k", linewidth=1)
    axes.set(aspect="equal", xlim=(-0.4, 0.4), ylim=(-0.33, 0.55), title=f"{step * dt:.2f} s", xlabel="x [m]")
    return points


def main(dump, picture):
    seen = list(frames(dump))
    last = seen[-1][0]
    wanted = [1000, 1750, 2500, last]
    figure, axes = plt.subplots(1, len(wanted), figsize=(11, 3.6), sharey=True, layout="constrained")
    for axis, want in zip(axes, wanted):
        points = draw(axis, *min(seen, key=lambda frame: abs(frame[0] - want)))
    axes[0].set_ylabel("z [m]")
    figure.colorbar(points, ax=axes, label="speed [m/s]")
    figure.savefig(picture, dpi=80)
    for step, rows in seen[:: max(1, len(seen) // 12)]:
        print(f"{step * 2e-4:.2f} s: {np.sum(rows[:, 3] < 0.1)} of {len(rows)} points below the outlet")


if __name__ == "__main__":
    main(*sys.argv[1:])
