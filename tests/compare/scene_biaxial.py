# SPDX-License-Identifier: GPL-2.0-or-later
"""(b) Biaxial compression between rough plates; friction heats the grains."""
import numpy as np

from comparison import BLUE, RED, Side, arrays, curve_band, exact_step, lagrangian, plt
from cut import cut_block, write_data, write_groups

WIDTH, HEIGHT, PRESSURE, SPEED, DENSITY, RADIUS, FULL = 0.75, 1.0, 5e4, 0.1, 2650, (0.003, 0.006), 10000
GRAINS = dict(pressure=PRESSURE, preparation_friction=0.01, density=DENSITY, kn=1e7, kt=1e7, thickness=1)
BOX = (-0.5, 1.25, -0.2, 1.2)
CELL = 0.125  # on which fields are compared
LINES = np.arange(0, WIDTH + 1e-9, CELL), np.arange(0, HEIGHT + 1e-9, CELL)
# edge of a point, edge of the grid's cells, grains of a packing
LEVELS = [(0.125, 0.25, 100), (0.0625, 0.125, 36), (0.0625, 0.125, 100), (0.0625, 0.125, 400)]


def compare(study):
    total, seeds = (1000, 2) if study.quick else (FULL, 3)
    times = {"t_run": 0.4 if study.quick else 0.8}
    scale = np.sqrt(FULL / total)
    sizes = [total] if study.quick else [total, total // 4, total // 10, total // 30]
    fulls = [full_dem(study, n, seeds, times) for n in sizes]
    levels = [(0.125, 0.25, 36)] if study.quick else LEVELS
    sides = [multiscale(study, level, scale, 1 if study.quick else 2, times) for level in levels]
    study.compare(fulls[0], sides, fulls[1:])
    draw(study, fulls[0], sides[-1])


def full_dem(study, total, seeds, times):
    scale, runs = np.sqrt(FULL / total), []
    slab = 8 * np.mean(RADIUS) * scale / 2
    spare = (1.02 * HEIGHT + 2 * slab) ** 2 / (WIDTH * HEIGHT)  # the packing is square
    for seed in range(1, seeds + 1):
        large = study.grains(f"full_{total}_{seed}", radius=tuple(scale * r for r in RADIUS), grains=round(spare * total), seed=seed, **GRAINS)
        data, groups = (study.folder / f"block_{total}_{seed}.{kind}" for kind in ("data", "groups"))
        grains = cut_block(large, (WIDTH, HEIGHT), slab, 1)
        write_data(data, grains, BOX, DENSITY, 1)
        write_groups(groups, grains[3])
        variables = {"data": data.name, "groups": groups.name, "dt": exact_step(1.6e-5 * scale), **times}
        runs.append(study.run(f"full_{total}_{seed}", "in.full_dem", variables, ["compare/biaxial"], [data, groups], threads=1))
    grains = len(runs[0].dump("out/full_dem.dump")[0][1]["id"])
    return Side(f"full DEM, {grains} grains", runs, [answer(run, "full_dem") for run in runs], grains)


def multiscale(study, level, scale, replicates, times):
    edge, grid, grains = level
    runs = []
    for replicate in range(replicates):
        packings = [study.grains(f"rve_{grains}_{seed}", radius=tuple(scale * r for r in RADIUS), grains=grains, seed=seed, **GRAINS)
                    for seed in range(4 * replicate + 1, 4 * replicate + 5)]
        variables = {"packing": [p.name for p in packings], "spacing": edge, "grid": grid, "step": 5e-4 * grid / 0.25,
                     "dt": exact_step(1.6e-5 * scale), **times}
        runs.append(study.run(f"multiscale_{edge:g}_{grains}_{replicate}", "in.multiscale", variables, ["compare/biaxial"], packings,
                              grains=grains, threads=1))
    points = runs[0].points
    return Side(f"multiscale, {points} x {grains}", runs, [answer(run, "multiscale") for run in runs], points * grains)


def answer(run, side):
    table = run.table
    time = np.array(table["Time"]) - table["Time"][0]
    frames = [arrays(frame) for frame in run.dump(f"out/{side}.dump")]
    first, last = frames[0], frames[-1]
    if side == "full_dem":
        wide, heat, warm = np.array(table["wide"]), np.array(table["heat"]), "f_Temp[0]"
    else:
        wide, heat, warm = np.array(table["volume"]) / (HEIGHT - SPEED * time), np.array(table["mpm[9]"]), "f_mpm[13]"
    field = lambda values: lagrangian(first["x"], first["y"], first["mass"], values, *LINES)
    return {"stress on the plate": np.array(table["stress"]) / 1e3, "widening": wide - wide[0], "frictional heat": heat - heat[0],
            "displacement": np.array([field(last[k] - first[k]) for k in "xy"]), "temperature": field(last[warm] - first[warm])}


def draw(study, full, best):
    table = full.runs[0].table
    strain = 100 * SPEED * (np.array(table["Time"]) - table["Time"][0]) / HEIGHT
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
    for side, colour in ((full, RED), (best, BLUE)):
        for axis, quantity, scale in zip(axes, ("stress on the plate", "widening", "frictional heat"), (1, 1e3, 1e-3)):
            curve_band(axis, strain, side, quantity, colour, side.label, scale)
    for axis, label in zip(axes, ("stress on the plate [kPa]", "mean widening [mm]", "frictional heat [kJ/m]")):
        axis.set(xlabel="axial strain [%]", ylabel=label)
    axes[0].legend(frameon=False, fontsize=7)
    study.save(figure, "biaxial_curves")
    pictures(study, full, best)


def pictures(study, full, best):
    """Heating of the last moment: two full DEMs of other seeds, and the multiscale answer."""
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 4.2), layout="constrained", sharey=True)
    shown = [(full.runs[0], "full_dem", full.label), (full.runs[-1], "full_dem", "another seed"), (best.runs[0], "multiscale", best.label)]
    top = None
    for axis, (run, name, title) in zip(axes, shown):
        last = arrays(run.dump(f"out/{name}.dump")[-1])
        heat = 1e3 * last["f_Temp[0]" if name == "full_dem" else "f_mpm[13]"]
        edge = 2 * last["radius"] if name == "full_dem" else np.sqrt(last["f_mpm[12]"])
        top = top or np.percentile(heat, 98)
        picture = axis.scatter(last["x"], last["y"], c=heat, s=(edge * 190) ** 2, marker="o" if name == "full_dem" else "s", lw=0,
                               cmap="inferno", vmin=0, vmax=top)
        axis.set(title=title, xlim=(-0.15, 0.9), ylim=(0, 0.95), aspect="equal")
    figure.colorbar(picture, ax=axes, shrink=0.8, label="heating by friction [mK]")
    study.save(figure, "biaxial_fields")
