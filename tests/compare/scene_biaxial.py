# SPDX-License-Identifier: GPL-2.0-or-later
"""(b) Biaxial compression between rough plates; friction heats the grains."""
import numpy as np

from comparison import BLUE, DENSITY, RED, Scene, arrays, curve_band, lagrangian, plt

WIDTH, HEIGHT, PRESSURE, SPEED = 0.75, 1.0, 5e4, 0.1
CELL = 0.125  # on which fields are compared
LINES = np.arange(0, WIDTH + 1e-9, CELL), np.arange(0, HEIGHT + 1e-9, CELL)
# edge of a point and of its cell of the grid, step of the points; grains of a packing. With four points in a cell a body that dilates as it
# shears is too strong; that of uGIMP is here to show it, and what means over cells take away of it.
COARSE, FINE = (dict(spacing=0.125, grid=0.125, step=2.5e-4), dict(spacing=0.0625, grid=0.0625, step=1.25e-4))
FOUR = dict(spacing=0.0625, grid=0.125, step=2.5e-4)
LEVELS = [(COARSE, 100), (COARSE, 400), (FINE, 36), (FINE, 100), (FOUR, 100), ({**FOUR, "shape": "gimp"}, 100),
          ({**FOUR, "shape": "gimp", "volumetric": "cell"}, 100)]
BEST = 3  # which of them the figures show


def compare(study):
    scene = Scene("compare/biaxial", (0.003, 0.006), 10000, 1.6e-5, answer=answer,
                  settings=dict(pressure=PRESSURE, preparation_friction=0.01, density=DENSITY, kn=1e7, kt=1e7, thickness=1))
    spare = lambda scale: scene.area((WIDTH, HEIGHT), scale) / (WIDTH * HEIGHT)
    cut = scene.block((WIDTH, HEIGHT), 1, (-0.5, 1.25, -0.2, 1.2), 1)
    sizes = {"full": (scene.total, 3, 2, LEVELS, 0.8),
             "quick": (1000, 2, 1, [(COARSE, 36)], 0.4),
             "tiny": (250, 1, 1, [(COARSE, 16)], 0.05)}
    total, seeds, replicates, levels, t_run = sizes[study.size]
    times = {"t_run": t_run, "every": max(0.01, round(t_run / 8, 2))}
    fulls, sides = study.run_both(scene, total, seeds, replicates, levels, times, spare, cut)
    if study.size != "tiny":
        tell_what_is_missed(study, fulls, sides)
        draw(study, fulls[0], sides[min(BEST, len(sides) - 1)])


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


def tell_what_is_missed(study, fulls, sides):
    """Size effect and localisation."""
    peak = lambda side: float(np.mean([answer["stress on the plate"].max() for answer in side.answers]))
    study.note("Peak of the stress on the plate: " + "; ".join(f"{side.label}: {peak(side):.0f} kPa" for side in [*fulls, *sides]) + ".")
    share = lambda side, name, column: float(np.mean([localisation(run, name, column) for run in side.runs]))
    study.note(f"Share of the heat in the hottest tenth of cells of {CELL:g} m: " +
               f"{fulls[0].label}: {share(fulls[0], 'full_dem', 'f_Temp[0]'):.2f}; " +
               "; ".join(f"{side.label}: {share(side, 'multiscale', 'f_mpm[13]'):.2f}" for side in sides) + ".")


def localisation(run, name, column):
    first, *_, last = [arrays(frame) for frame in run.dump(f"out/{name}.dump")]
    heat, _, _ = np.histogram2d(first["x"], first["y"], bins=LINES, weights=first["mass"] * (last[column] - first[column]))
    heat = np.sort(heat.ravel())[::-1]
    return heat[:len(heat) // 10].sum() / heat.sum()


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
    """Heating of the last moment: full DEMs of two seeds, if there are two, and the multiscale answer."""
    shown = [(full.runs[0], "full_dem", full.label), (full.runs[-1], "full_dem", "another seed")][:len(full.runs)]
    shown.append((best.runs[0], "multiscale", best.label))
    figure, axes = plt.subplots(1, len(shown), figsize=(3.5 * len(shown), 4.2), layout="constrained", sharey=True)
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
