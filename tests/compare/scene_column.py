# SPDX-License-Identifier: GPL-2.0-or-later
"""(c) A dry column collapses; (d) so does one whose bonds melt (scene_melting_column)."""
import numpy as np

from comparison import BLUE, DENSITY, RED, Scene, arrays, curve_band, plt, smear
from cut import cut_column, write_data

WIDTH, BOX = 1.0, (-0.2, 4.0, -0.2, 1.6)
CELL = 0.125  # of the grid on which fields are compared
LINES = np.arange(0, 4.0 + 1e-9, CELL), np.arange(0, 1.25 + 1e-9, CELL)
# edge of a point and of its cell of the grid, step of the points; grains of a packing
SIZES = [dict(spacing=1 / n, grid=1 / n, step=2e-3 / n) for n in (8, 12, 16, 24)]
LEVELS = [(SIZES[0], 100), (SIZES[1], 36), (SIZES[2], 36), (SIZES[2], 100), (SIZES[3], 36)]
# Four points in a cell, to see what that changes.
FOUR = {"dry": [(dict(spacing=1 / 8, grid=1 / 4, step=5e-4), 100),
                (dict(spacing=1 / 8, grid=1 / 4, step=5e-4, volumetric="cell"), 100), (dict(spacing=1 / 16, grid=1 / 8, step=2.5e-4), 36),
                (dict(spacing=1 / 16, grid=1 / 8, step=2.5e-4), 100), (dict(spacing=1 / 24, grid=1 / 12, step=1 / 6000), 100)],
        "melting": [(dict(spacing=1 / 16, grid=1 / 8, step=2.5e-4), 36)]}
BEST = 4  # which of the levels the figures show


def compare(study, case="dry"):
    scene = Scene("compare/column", (0.0032, 0.0064), 10800, 1.7e-5, answer=answer,
                  settings=dict(pressure=1e4, preparation_friction=0.5, density=DENSITY, kn=1e7, kt=1e7, thickness=1))
    sizes = {"full": (scene.total, 3, 2, LEVELS + FOUR[case], 0.8),
             "quick": (1000, 2, 1, [(SIZES[0], 36)], 0.8),
             "tiny": (250, 1, 1, [(SIZES[0], 16)], 0.1)}
    total, seeds, replicates, levels, t_run = sizes[study.size]
    like = scene.pack(study, "rve", 100, 1, scene.scale(total))
    spare = lambda scale: (1 + 12 * scale * np.mean(scene.radius)) ** 2  # gaps at the plates, the floor

    def cut(packing, stem, scale):
        write_data(stem.with_suffix(".data"), cut_column(packing, (WIDTH, WIDTH), like, BOX[1]), BOX, DENSITY, 3)
        return {"data": stem.with_suffix(".data")}

    times = {"case": case, "t_run": t_run, "every": max(0.01, round(t_run / 16, 2))}
    fulls, sides = study.run_both(scene, total, seeds, replicates, levels, times, spare, cut)
    if study.size != "tiny":
        tell_of_segregation(study, fulls[0])
        best = sides[min(BEST, len(sides) - 1)]
        draw(study, fulls[0], best, case)
        pictures(study, fulls[0], best, case)


def answer(run, side):
    table = run.table
    frames = [arrays(frame) for frame in run.dump(f"out/{side}.dump")]
    for frame in frames:
        frame["edge"] = 1.77 * frame["radius"] if side == "full_dem" else np.sqrt(frame["f_mpm[12]"])
    early, last = frames[len(frames) // 2], frames[-1]
    bonded = {}
    if max(table["intact"]) > 0:  # from the second row on: at the first the bonds are not yet made
        bonded = {"heat in the column": np.array(table["energy" if side == "full_dem" else "mpm[8]"])[1:],
                  "intact bonds": np.array(table["intact"])[1:]}
    return {**bonded, "way of the centre": np.array(table["centre_x"]) - table["centre_x"][0],
            "fall of the centre": table["centre_y"][0] - np.array(table["centre_y"]),
            "front": np.array([front(frame) for frame in frames]),
            "profile at the end": smear(*(last[k] for k in ("x", "y", "edge", "mass")), LINES[0], np.array([-1, 9]))[:, 0] * 10,
            "mass, half-time": smear(*(early[k] for k in ("x", "y", "edge", "mass")), *LINES),
            "momentum, half-time": smear(early["x"], early["y"], early["edge"], early["mass"] * early["vx"], *LINES)}


def front(frame):
    """Where 99 % of the mass is passed; every particle a square."""
    fine = np.arange(0, 6, 0.005)
    columns = smear(frame["x"], frame["y"], frame["edge"], frame["mass"], fine, np.array([-1, 9]))[:, 0]
    return np.interp(0.99, np.cumsum(columns) / columns.sum(), fine[1:])


def tell_of_segregation(study, full):
    """Mean radius of the grains in the foremost and the uppermost tenth of the mass at the end, over the mean of all."""
    ratios = {"x": [], "y": []}
    for run in full.runs:
        last = arrays(run.dump("out/full_dem.dump")[-1])
        for axis, values in ratios.items():
            order = np.argsort(last[axis])[::-1]
            outer = order[np.cumsum(last["mass"][order]) < 0.1 * last["mass"].sum()]
            values.append(last["radius"][outer].mean() / last["radius"].mean())
    text = ", ".join(f"{name} {np.mean(ratios[axis]):.3f} ({min(ratios[axis]):.3f} to {max(ratios[axis]):.3f})"
                     for axis, name in (("x", "foremost"), ("y", "uppermost")))
    study.note(f"{full.label}: mean radius of the outer tenth of the mass at the end over that of all: {text}.")


def draw(study, full, best, case):
    table, frames = full.runs[0].table, len(full.answers[0]["front"])
    time = np.array(table["Time"]) - table["Time"][0]
    figure, axes = plt.subplots(1, 4 if case == "melting" else 3, figsize=(14 if case == "melting" else 11, 3.2), layout="constrained")
    for side, colour in ((full, RED), (best, BLUE)):
        curve_band(axes[0], time, side, "way of the centre", colour, f"{side.label}: along")
        curve_band(axes[0], time, side, "fall of the centre", colour, "down", ls="--")
        curve_band(axes[1], np.linspace(0, time[-1], frames), side, "front", colour)
        curve_band(axes[2], LINES[0][1:] - CELL / 2, side, "profile at the end", colour)
        if case == "melting":
            curve_band(axes[3], time[1:], side, "intact bonds", colour)
            axes[3].set(xlabel="time [s]", ylabel="intact over installed bonds")
    axes[0].set(xlabel="time [s]", ylabel="way of the centre of mass [m]")
    axes[0].legend(frameon=False, fontsize=7)
    axes[1].set(xlabel="time [s]", ylabel="front (99 % of the mass) [m]")
    axes[2].set(xlabel="x [m]", ylabel="mass per length at the end [kg/m2]")
    study.save(figure, f"{study.case}_curves")


def pictures(study, full, best, case):
    figure, axes = plt.subplots(3, 2, figsize=(11, 5.2), layout="constrained", sharex=True, sharey=True)
    for column, (side, name) in enumerate(((full, "full_dem"), (best, "multiscale"))):
        frames = side.runs[0].dump(f"out/{name}.dump")
        for axis, k in zip(axes[:, column], (len(frames) // 4, len(frames) // 2, -1)):
            frame = arrays(frames[k])
            edge = 2 * frame["radius"] if column == 0 else np.sqrt(frame["f_mpm[12]"])
            warm = frame.get("f_Temp[0]", frame.get("f_mpm[13]")) if case == "melting" else np.hypot(frame["vx"], frame["vy"])
            shown = axis.scatter(frame["x"], frame["y"], c=warm, marker="o" if column == 0 else "s", s=(edge * 95) ** 2, lw=0, vmin=0,
                                 vmax=20 if case == "melting" else 2.5, cmap="inferno" if case == "melting" else "viridis")
            axis.set(xlim=(0, 2.6), ylim=(0, 1.05), aspect="equal")
        axes[0, column].set_title(side.label)
    figure.colorbar(shown, ax=axes, shrink=0.6, label="temperature [K above the start; bonds are gone at 10]" if case == "melting" else "speed [m/s]")
    study.save(figure, f"{study.case}_fields")
