# SPDX-License-Identifier: GPL-2.0-or-later
"""TM-DEMPM 5.3.2: free and forced discharge of a silo."""
import numpy as np

from study import plt

GRAINS = dict(radius=(0.0025, 0.005), pressure=1e4, preparation_friction=0.5, density=2650, kn=1e6, kt=1e6, thickness=0.075)
OUTLET, SHOULDER, EDGE = 1.0, 1.4, 0.4  # m: heights of outlet and hopper's top; end of its left wall


def verify(study):
    size, grains = ("paper", 400) if study.full else ("demo", 100)
    times = {} if study.full else {"t_free": 1.2, "t_forced": 0.7}
    packing = study.pack("silo", grains=grains, **GRAINS)
    common = {"size": size, "packing": packing.name, **times}
    settled = study.run("settle", "in.settle", common, ["silo"], [packing], grains=grains)
    runs = {case: study.run(case, "in.discharge", {**common, "case": case, "settled": "settled.restart"}, ["silo"],
                            [packing, settled.path / "out" / "settled.restart"], grains=grains) for case in ("free", "forced")}
    frames = {case: [read(frame) for frame in run.dump(f"out/{case}_points.txt")] for case, run in runs.items()}
    judge(study, runs, frames)
    draw(study, runs, frames)


def read(frame):
    columns = {name: np.array(values) for name, values in frame[1].items()}
    x, y = columns["x"], columns["y"]
    return np.minimum(x, 1.0 - x), y, columns["f_mpm[13]"]  # mirrored to the left half


def parts(x, y):
    """Masks of the silo's inside: at the outlet, at the walls, in the core."""
    inside = y > OUTLET
    outlet = inside & (y < OUTLET + 0.15) & (x > EDGE - 0.15)
    wall = inside & ~outlet & ((x < 0.1) | ((x + y - SHOULDER) / np.sqrt(2) < 0.1))
    return outlet, wall, inside & ~outlet & ~wall


def judge(study, runs, frames):
    left = {case: (np.array(run.table["Time"]) - run.table["Time"][0], np.array(run.table["above"])) for case, run in runs.items()}
    end = min(time[-1] for time, _ in left.values())
    gone = {case: 1 - np.interp(end, *curve) for case, curve in left.items()}
    study.check(f"mass discharged by {end:.2f} s, free over forced", gone["free"] / gone["forced"], 0.5, runs["forced"])
    x, y, heat = frames["free"][-1]
    outlet, wall, core = parts(x, y)
    study.check("free: hottest of the core and the walls over the hottest at the outlet", heat[core | wall].max() / heat[outlet].max(),
                1.0, runs["free"])
    forced_x, forced_y, forced_heat = frames["forced"][-1]
    _, forced_wall, forced_core = parts(forced_x, forced_y)
    study.check("core: mean heating, free over forced", heat[core].mean() / forced_heat[forced_core].mean(), 0.1, runs["forced"])
    study.check("forced: mean heating of the core over that at the walls (the paper: above 1)",
                forced_heat[forced_core].mean() / forced_heat[forced_wall].mean(), None, runs["forced"])
    leaks = max(int(np.sum((y > OUTLET) & ((x < 0) | ((x < EDGE) & (x + y < SHOULDER))))) for case in frames
                for x, y, _ in frames[case])
    study.check("points that went through a wall", leaks, 0, runs["free"])
    study.note(f"Discharged by {end:.2f} s: {100 * gone['free']:.1f} % (free), {100 * gone['forced']:.1f} % (forced). "
               f"Largest rise in the silo {heat[y > OUTLET].max():.4f} K and {forced_heat[forced_y > OUTLET].max():.3f} K.")


def draw(study, runs, frames):
    figure, axes = plt.subplots(1, 3, figsize=(11, 4), layout="constrained", gridspec_kw={"width_ratios": [1.5, 1, 1]})
    for k, (case, run) in enumerate(runs.items()):
        time = np.array(run.table["Time"]) - run.table["Time"][0]
        axes[0].plot(time, 100 * np.array(run.table["above"]), label=case)
        x, y, heat = frames[case][-1]
        shown = axes[1 + k].scatter(np.r_[x, 1 - x], np.r_[y, y], c=np.r_[heat, heat], s=3, marker="s", cmap="inferno")
        axes[1 + k].plot([0, 0, EDGE], [2, SHOULDER, OUTLET], "k", [1, 1, 1 - EDGE], [2, SHOULDER, OUTLET], "k", lw=1)
        axes[1 + k].set(title=f"{case}, {time[-1]:.1f} s", aspect="equal", xlim=(-0.1, 1.1), ylim=(0, 2))
        figure.colorbar(shown, ax=axes[1 + k], shrink=0.7, label="heating [K]")
    axes[0].set(xlabel="time [s]", ylabel="mass above the outlet [%]")
    axes[0].legend(frameon=False)
    study.save(figure, "silo")
