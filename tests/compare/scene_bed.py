# SPDX-License-Identifier: GPL-2.0-or-later
"""(a) Heat conduction through a compressed bed between held walls; heated grains press."""
import numpy as np

from comparison import BLUE, DENSITY, RED, Scene, arrays, curve_band, lagrangian, plt

LENGTH = 1.0
LINES = np.arange(0, LENGTH + 1e-9, 0.125), np.array([-9.0, 9.0])  # profiles are compared on slices
# edge of the grid's cells, of a point each, step of the points; grains of a packing
COARSE, FINE = dict(grid=0.125, step=5e-4), dict(grid=0.0625, step=2.5e-4)
LEVELS = [(COARSE, 36), (COARSE, 100), (FINE, 100), (FINE, 400)]


def compare(study):
    scene = Scene("compare/bed", (0.0034, 0.0068), 10000, 1.8e-5, answer=answer,
                  settings=dict(pressure=5e4, preparation_friction=0.01, density=DENSITY, kn=1e7, kt=1e7, thickness=1))
    spare = lambda scale: scene.area((LENGTH, LENGTH), scale)  # `total` grains are a square metre
    cut = scene.block((LENGTH, 0), 0, (-0.2, 1.2, 0.0, None), 2)
    sizes = {"full": (scene.total, 3, 3, LEVELS, 0.6),
             "quick": (1000, 2, 1, LEVELS[:1], 0.6),
             "tiny": (250, 1, 1, [(COARSE, 16)], 0.3)}
    total, seeds, replicates, levels, t_run = sizes[study.size]
    times = {"t_run": t_run, "every": max(0.01, round(t_run / 6, 2))}
    fulls, sides = study.run_both(scene, total, seeds, replicates, levels, times, spare, cut)
    if study.size != "tiny":
        draw(study, fulls[0], sides[-1])


def answer(run, side):
    table, warm = run.table, "f_Temp[0]" if side == "full_dem" else "f_mpm[13]"
    frames = [arrays(frame) for frame in run.dump(f"out/{side}.dump")]
    first = frames[0]
    profile = lambda frame, values: lagrangian(first["x"], first["y"], first["mass"], values, *LINES)[:, 0]
    pick = frames[1], frames[len(frames) // 2], frames[-1]
    rise = lambda name: (table[name][0] - np.array(table[name])) / 1e3
    return {"heat in the bed": np.array(table["energy"]), "thermal stress along": rise("stress_x"), "thermal stress across": rise("stress_y"),
            "temperature": np.array([profile(frame, frame[warm]) for frame in pick]),
            "displacement": profile(frames[-1], frames[-1]["x"] - first["x"])}


def draw(study, full, best):
    table = full.runs[0].table
    time, middle = np.array(table["Time"]) - table["Time"][0], 0.5 * (LINES[0][1:] + LINES[0][:-1])
    figure, axes = plt.subplots(1, 4, figsize=(13, 3.2), layout="constrained")
    for side, colour in ((full, RED), (best, BLUE)):
        curve_band(axes[0], time, side, "heat in the bed", colour, side.label, 1e-6)
        curve_band(axes[1], time, side, "thermal stress along", colour, "along")
        curve_band(axes[1], time, side, "thermal stress across", colour, "across", ls="--")
        for k in range(3):
            axes[2].plot(middle, side.mean("temperature")[k], color=colour, marker="o", ms=3, lw=1)
        curve_band(axes[3], middle, side, "displacement", colour, scale=1e3)
    for axis, x, y in zip(axes, ("time [s]", "time [s]", "x [m]", "x [m]"),
                          ("heat in the bed [MJ/m2]", "thermal stress [kPa]", "temperature [K above the start]", "displacement at the end [mm]")):
        axis.set(xlabel=x, ylabel=y)
    axes[0].legend(frameon=False, fontsize=7)
    axes[1].legend(frameon=False, fontsize=7)
    study.save(figure, "bed_curves")
    pictures(study, full, best)


def pictures(study, full, best):
    figure, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained", sharey=True)
    for axis, (run, name, label) in zip(axes, ((full.runs[0], "full_dem", full.label), (best.runs[0], "multiscale", best.label))):
        frames = run.dump(f"out/{name}.dump")
        frame = arrays(frames[len(frames) // 3])
        edge = 2 * frame["radius"] if name == "full_dem" else np.sqrt(frame["f_mpm[12]"])
        shown = axis.scatter(frame["x"], frame["y"], c=frame["f_Temp[0]" if name == "full_dem" else "f_mpm[13]"], s=(edge * 200) ** 2, lw=0,
                             marker="o" if name == "full_dem" else "s", cmap="inferno", vmin=0, vmax=100)
        axis.set(title=label, xlim=(0, LENGTH), ylim=(0, 1.1), aspect="equal")
    figure.colorbar(shown, ax=axes, shrink=0.8, label="temperature [K above the start]")
    study.save(figure, "bed_fields")
