# SPDX-License-Identifier: GPL-2.0-or-later
"""(a) Heat conduction through a compressed bed between held walls; heated grains press."""
import numpy as np

from comparison import BLUE, RED, Side, arrays, curve_band, exact_step, lagrangian, plt
from cut import cut_block, read_packing, write_data, write_groups

LENGTH, DENSITY, RADIUS, FULL = 1.0, 2650, (0.0034, 0.0068), 10000
GRAINS = dict(pressure=5e4, preparation_friction=0.01, density=DENSITY, kn=1e7, kt=1e7, thickness=1)
LINES = np.arange(0, LENGTH + 1e-9, 0.125), np.array([-9.0, 9.0])  # profiles are compared on slices
# edge of the grid's cells, of a point each; grains of a packing
LEVELS = [(0.125, 36), (0.125, 100), (0.0625, 100), (0.0625, 400)]


def compare(study):
    total, seeds = (1000, 2) if study.quick else (FULL, 3)
    times = {"t_run": 0.2 if study.quick else 0.6}
    scale = np.sqrt(FULL / total)
    sizes = [total] if study.quick else [total, total // 4, total // 10, total // 30]
    fulls = [full_dem(study, n, seeds, times) for n in sizes]
    sides = [multiscale(study, level, scale, 1 if study.quick else 3, times) for level in (LEVELS[:1] if study.quick else LEVELS)]
    study.compare(fulls[0], sides, fulls[1:])
    draw(study, fulls[0], sides[-1])


def full_dem(study, total, seeds, times):
    """`total` grains on a square metre."""
    scale, runs = np.sqrt(FULL / total), []
    slab = 4 * np.mean(RADIUS) * scale
    spare = (1.02 * LENGTH + 2 * slab) ** 2  # the packing is square
    for seed in range(1, seeds + 1):
        large = study.grains(f"full_{total}_{seed}", radius=tuple(scale * r for r in RADIUS), grains=round(spare * total), seed=seed, **GRAINS)
        data, groups = (study.folder / f"block_{total}_{seed}.{kind}" for kind in ("data", "groups"))
        grains = cut_block(large, (LENGTH, 0), slab, 0)
        write_data(data, grains, (-0.2, 1.2, 0.0, read_packing(large)[2][1]), DENSITY, 2)
        write_groups(groups, grains[3])
        variables = {"data": data.name, "groups": groups.name, "dt": exact_step(1.8e-5 * scale), **times}
        runs.append(study.run(f"full_{total}_{seed}", "in.full_dem", variables, ["compare/bed"], [data, groups], threads=1))
    grains = len(runs[0].dump("out/full_dem.dump")[0][1]["id"])
    return Side(f"full DEM, {grains} grains", runs, [answer(run, "full_dem") for run in runs], grains)


def multiscale(study, level, scale, replicates, times):
    grid, grains = level
    runs = []
    for replicate in range(replicates):
        packings = [study.grains(f"rve_{grains}_{seed}", radius=tuple(scale * r for r in RADIUS), grains=grains, seed=seed, **GRAINS)
                    for seed in range(5 * replicate + 1, 5 * replicate + 6)]
        variables = {"packing": [p.name for p in packings], "grid": grid, "step": 5e-4 * grid / 0.125, "dt": exact_step(1.8e-5 * scale), **times}
        runs.append(study.run(f"multiscale_{grid:g}_{grains}_{replicate}", "in.multiscale", variables, ["compare/bed"], packings,
                              grains=grains, threads=1))
    points = runs[0].points
    return Side(f"multiscale, {points} x {grains}", runs, [answer(run, "multiscale") for run in runs], points * grains)


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
