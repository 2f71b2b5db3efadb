#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Slices through the silo:  figure.py out/silo_3d.png          from out/points_STEP.vtk"""
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import plot  # noqa: E402  (examples/plot.py)
from plot import np, plt  # noqa: E402

OUT, DT, OUTLET = HERE / "out", 2e-4, 0.1
WALL = ([0.25, 0.25, 0.1], [0.8, 0.25, OUTLET])
SHOWN = (1000, 1750, 2500)  # steps; and the last


def draw(axes, step, path):
    points, values = plot.read_vtk(path)
    slab = np.abs(points[:, 1]) < 0.03
    shown = axes.scatter(points[slab, 0], points[slab, 2], c=np.linalg.norm(values["v"][slab], axis=1), s=9, vmin=0, vmax=2)
    for side in (1, -1):
        axes.plot([side * x for x in WALL[0]], WALL[1], color="black", linewidth=1)
    axes.axhline(-0.3, color="black", linewidth=1)
    axes.set(aspect="equal", xlim=(-0.4, 0.4), ylim=(-0.33, 0.55), title=f"{step * DT:.2f} s", xlabel="x [m]")
    print(f"{step * DT:.2f} s: {np.sum(points[:, 2] < OUTLET)} of {len(points)} points below the outlet")
    return shown


def main(target):
    files = {int(re.findall(r"\d+", path.stem)[-1]): path for path in OUT.glob("points_*.vtk") if "bounding" not in path.name}
    steps = [min(files, key=lambda step: abs(step - wanted)) for wanted in (*SHOWN, max(files))]
    figure, axes = plt.subplots(1, len(steps), figsize=(11, 3.6), sharey=True)
    for axis, step in zip(axes, steps):
        shown = draw(axis, step, files[step])
    axes[0].set_ylabel("z [m]")
    figure.colorbar(shown, ax=axes, label="speed [m/s]")
    figure.savefig(target, dpi=80)


main(sys.argv[1] if len(sys.argv) > 1 else OUT / "silo_3d.png")
