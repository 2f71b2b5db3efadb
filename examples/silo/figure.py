#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""One picture of the silo: temperature of free and forced discharge, each in its own scale, and packings A and B.

  figure.py out/silo.png          from out/CASE_STEP.vtk and out/CASE_rve_N.pvd
"""
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import plot  # noqa: E402  (examples/plot.py)
from plot import np, plt  # noqa: E402

OUT, DT = HERE / "out", 1e-4
WALLS = ([0, 0, 0.4], [2.0, 1.4, 1.0])


def number(path):
    return int(re.findall(r"\d+", path.stem)[-1])


def read_points(path):
    """Positions and temperatures. dump custom/vtk writes columns 7, 10 and 13 of fix mpm as one vector."""
    points, values = plot.read_vtk(path)
    return points, values["f_mpm[7-13]"][:, 2]


def draw_points(axes, path, largest):
    points, temperature = read_points(path)
    is_half = points[:, 0].max() < 0.6
    x = np.concatenate([points[:, 0], 1.0 - points[:, 0]]) if is_half else points[:, 0]
    repeat = 2 if is_half else 1
    shown = axes.scatter(x, np.tile(points[:, 1], repeat), c=np.tile(temperature, repeat), s=4.0, marker="s",
                         linewidths=0, cmap="inferno", vmin=0.0, vmax=largest)
    for mirror in (0, 1):
        axes.plot([abs(mirror - x) for x in WALLS[0]], WALLS[1], color="black", linewidth=1.2)
    axes.axhline(0.0, color="black", linewidth=1.2)
    axes.set(aspect="equal", xlim=(-0.3, 1.3), ylim=(-0.05, 2.0), xticks=[0, 1], yticks=[0, 1, 2])
    return shown


def main(target):
    figure, grid = plt.subplots(2, 5, figsize=(11, 5.6), width_ratios=[1, 1, 1, 0.9, 0.9])
    for row, case in zip(grid, ("free", "forced")):
        files = sorted((path for path in OUT.glob(f"{case}_*.vtk") if "bounding" not in path.name), key=number)
        largest = np.percentile(read_points(files[-1])[1], 99.5)  # a point or two on the ground are hotter
        for axes, k in zip(row, (len(files) // 3, 2 * len(files) // 3, len(files) - 1)):
            shown = draw_points(axes, files[k], largest)
            axes.set_title(f"{case}, {DT * (number(files[k]) - number(files[0])):.1f} s", loc="left")
        figure.colorbar(shown, ax=row[2], label="temperature rise [K]", shrink=0.8)
        series = sorted(OUT.glob(f"{case}_rve_*.pvd"), key=number)
        for axes, path, name in zip(row[3:], series[::-1], "AB"):
            force = plot.draw_rve(axes, plot.read_series(path)[-1][1])
            axes.set_title(f"packing {name}, thickest {force:.0f} N", loc="left")
    figure.savefig(target, dpi=82)


main(sys.argv[1] if len(sys.argv) > 1 else OUT / "silo.png")
