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

OUT, OUTLET = HERE / "out", 0.1
WALL = ([0.25, 0.25, 0.1], [0.8, 0.25, OUTLET])
SHOWN = (0.2, 0.35, 0.5)  # s; and the last


def time_step():
    """The last one that the log names with its value."""
    return float(re.findall(r"^timestep\s+([-+.\deE]+)$", (OUT / "log.silo_3d").read_text(), re.M)[-1])


def draw(axes, time, path):
    points, values = plot.read_vtk(path)
    slab = np.abs(points[:, 1]) < 0.03
    shown = axes.scatter(points[slab, 0], points[slab, 2], c=np.linalg.norm(values["v"][slab], axis=1), s=9, vmin=0, vmax=2)
    for side in (1, -1):
        axes.plot([side * x for x in WALL[0]], WALL[1], color="black", linewidth=1)
    axes.axhline(-0.3, color="black", linewidth=1)
    axes.set(aspect="equal", xlim=(-0.4, 0.4), ylim=(-0.33, 0.55), title=f"{time:.2f} s", xlabel="x [m]")
    print(f"{time:.2f} s: {np.sum(points[:, 2] < OUTLET)} of {len(points)} points below the outlet")
    return shown


def main(target):
    dt = time_step()
    files = {int(re.findall(r"\d+", path.stem)[-1]) * dt: path for path in OUT.glob("points_*.vtk") if "bounding" not in path.name}
    times = [min(files, key=lambda time: abs(time - wanted)) for wanted in (*SHOWN, max(files))]
    figure, axes = plt.subplots(1, len(times), figsize=(11, 3.6), sharey=True)
    for axis, time in zip(axes, times):
        shown = draw(axis, time, files[time])
    axes[0].set_ylabel("z [m]")
    figure.colorbar(shown, ax=axes, label="speed [m/s]")
    figure.savefig(target, dpi=80)


main(sys.argv[1] if len(sys.argv) > 1 else OUT / "silo_3d.png")
