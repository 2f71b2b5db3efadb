# SPDX-License-Identifier: GPL-2.0-or-later
"""TM-DEMPM 5.3.1: biaxial compression of a dense and a loose specimen."""
import numpy as np

from study import plt

SPEED, HEIGHT, PRESSURE, DENSITY_HEAT = 0.02, 2.0, 1e5, 670.0
GRAINS = dict(radius=(0.0025, 0.005), pressure=1e5, density=2650, kn=1e6, kt=1e6, thickness=0.075)
LAW = dict(kn=1e6, kt=1e6, mu=0.5, density=2650, thickness=0.075, damping__local=0.2)
PREPARATION = {"dense": 0.01, "loose": 0.5}


def verify(study):
    size, grains = ("paper", 400) if study.full else ("demo", 200)
    runs, curves, alone, fields = {}, {}, {}, {}
    for name, friction in PREPARATION.items():
        packing = study.pack(name, preparation_friction=friction, grains=grains, **GRAINS)
        runs[name] = study.run(name, "in.biaxial", {"size": size, "name": name, "packing": packing.name}, ["biaxial"], [packing],
                               grains=grains)
        curves[name] = curve(runs[name].table)
        alone[name] = element_curves(study, name, friction, grains)
        fields[name] = runs[name].dump(f"out/{name}.dump")
    strength(study, runs, curves, alone)
    localisation(study, runs, fields)
    inclined_band(study, runs["dense"] if study.full else fine_run(study))
    for name, run in runs.items():
        study.check(f"{name}: energy ledger, sum over work", ledger(run.table), 0.01, run)
    draw(study, curves, alone, fields)


def curve(table):
    """(axial strain, stress on the plate in kPa): the pressure acts on the plate too, its force counts what exceeds it."""
    time = np.array(table["Time"]) - table["Time"][0]
    return SPEED * time / HEIGHT, -np.array(table["top[2]"]) / 1e3 + PRESSURE / 1e3


def element_curves(study, name, friction, grains):
    """Packings by themselves, other seeds too: (axial strain, mean stress, standard deviation) in kPa."""
    answers = []
    for seed in range(5, 9):
        packing = study.pack(f"{name}_{seed}", preparation_friction=friction, grains=grains, seed=seed, **GRAINS)
        answer = study.element(f"{name}_{seed}", packing, "biaxial", pressure=PRESSURE, rate=0.2, strain=0.2, **LAW)
        answers.append(answer)
    strain = np.linspace(0, 0.18, 91)
    stress = [np.interp(strain, 1 - a["Fyy"], -a["syy"] / 1e3) for a in answers]
    return strain, np.mean(stress, axis=0), np.std(stress, axis=0)


def strength(study, runs, curves, alone):
    last, early = {}, {}
    for name, (strain, stress) in curves.items():
        last[name] = stress[strain >= 0.15].mean()
        early[name] = stress[strain <= 0.1].max()
        reference = alone[name][1].max()
        study.check(f"{name}: peak over that of packings alone, deviation", abs(stress.max() / reference - 1), None, runs[name])
    study.check("dense: residual over peak (softening)", last["dense"] / curves["dense"][1].max(), 0.9, runs["dense"])
    study.check("loose: largest stress before 10 % over residual (hardening)", early["loose"] / last["loose"], 1.0, runs["loose"])
    study.check("residual of dense over loose, deviation", abs(last["dense"] / last["loose"] - 1), 0.1, runs["loose"])
    study.note(f"Peak {curves['dense'][1].max():.0f} kPa (dense), residual {last['dense']:.0f} and {last['loose']:.0f} kPa.")


def columns(frame):
    return {name: np.array(values) for name, values in frame[1].items()}


def localisation(study, runs, fields):
    sharpness = {}
    for name, frames in fields.items():
        last = columns(frames[-1])
        strain, heat = last["f_mpm[10]"], last["f_mpm[13]"]
        sharpness[name] = strain.max() / strain.mean()
        if name == "loose":
            continue
        hottest = strain[np.argmax(heat)]
        study.check("dense: share of points that are sheared more than the hottest one", np.mean(strain > hottest), 0.1, runs[name])
        wide = lambda values: np.mean(values > 0.5 * values.max())
        study.check("dense: band of half the strain over band of half the heating, area", wide(strain) / wide(heat), None, runs[name])
        study.check("dense: largest rise of temperature, K", heat.max(), None, runs[name])
    study.check("dense: mean over largest shear strain (a band is sharp)", 1 / sharpness["dense"], 0.5, runs["dense"])
    study.check("loose: sharpness of its band over that of the dense", sharpness["loose"] / sharpness["dense"], 1.0,
                runs["loose"])


def fine_run(study):
    """The paper's 10 x 20 cells, which an inclined band needs, with smaller packings than the paper's, to 10 %."""
    packing = study.pack("fine", preparation_friction=PREPARATION["dense"], grains=100, **GRAINS)
    return study.run("fine", "in.biaxial", {"size": "paper", "name": "dense", "packing": packing.name, "seconds": 10}, ["biaxial"],
                     [packing], grains=100)


def inclination(frame):
    """Degrees between the horizontal and the stronger of the two bands through the middle, by its second moments: points with
    more than twice the mean shear strain."""
    x, y, strain = frame["x"] - 0.5, frame["y"], frame["f_mpm[10]"]
    weight = np.where(strain > 2 * strain.mean(), strain, 0.0)
    y = y - np.average(y, weights=weight)
    arms = [np.where(sign * x * y > 0, weight, 0.0) for sign in (-1, 1)]
    arm = max(arms, key=np.sum)
    axis = np.linalg.eigh(np.stack([x * arm, y * arm]) @ np.stack([x, y]).T)[1][:, 1]
    return np.degrees(np.arctan2(abs(axis[1]), abs(axis[0])))


def inclined_band(study, run):
    """Born between the directions of Roscoe (45 degrees + half the angle of dilatancy, which is positive in a dense packing) and
    Coulomb (45 degrees + half the angle of friction); later it turns with the body."""
    strain, stress = curve(run.table)
    frames = {step: columns((step, values)) for step, values in run.dump("out/dense.dump")}
    steps = {percent: int(round(percent / 100 * HEIGHT / SPEED / 1e-3)) for percent in (2.5, 5, 10)}
    angle = inclination(frames[steps[5]])
    peak = stress.max() * 1e3
    friction = np.degrees(np.arcsin((peak - PRESSURE) / (peak + PRESSURE)))
    shear, heat = frames[steps[10]]["f_mpm[10]"], frames[steps[10]]["f_mpm[13]"]
    study.check("dense, 10 x 20 cells: inclination of the band at 5 %, outside of 45 degrees to Coulomb's by, degrees",
                max(45 - angle, angle - 45 - friction / 2, 0.0), 0.0, run)
    study.check("dense, 10 x 20 cells: mean over largest shear strain at 10 %", shear.mean() / shear.max(), 0.3, run)
    study.check("dense, 10 x 20 cells: share of points that are sheared more than the hottest one",
                np.mean(shear > shear[np.argmax(heat)]), 0.1, run)
    wide = lambda values: np.mean(values > 0.5 * values.max())
    study.check("dense, 10 x 20 cells: band of half the strain over band of half the heating, area", wide(shear) / wide(heat), None, run)
    study.note(f"10 x 20 cells: band at {angle:.0f} degrees at 5 % (Coulomb {45 + friction / 2:.0f}), "
               f"{inclination(frames[steps[10]]):.0f} at 10 %; peak {peak / 1e3:.0f} kPa; largest rise of temperature "
               f"{heat.max():.4f} K at 10 %.")
    draw_band(study, frames, steps)


def draw_band(study, frames, steps):
    figure, axes = plt.subplots(1, 4, figsize=(11, 4), layout="constrained")
    for axis, (percent, column, title) in zip(axes, [(2.5, "f_mpm[10]", "shear strain"), (5, "f_mpm[10]", "shear strain"),
                                                     (10, "f_mpm[10]", "shear strain"), (10, "f_mpm[13]", "heating [K]")]):
        draw_field(figure, axis, frames[steps[percent]], column, f"{percent:g} %: {title}")
    study.save(figure, "biaxial_band")


def draw_field(figure, axis, frame, column, title):
    shown = axis.scatter(frame["x"], frame["y"], c=frame[column], s=1600 / np.sqrt(len(frame["x"])) / 5, marker="s",
                         cmap="viridis" if "10" in column else "inferno")
    axis.set(title=title, aspect="equal", xlim=(-0.15, 1.15), ylim=(0, None))
    figure.colorbar(shown, ax=axis, shrink=0.7)


def ledger(table):
    """Work of plate and pressure against what is stored, slipped and damped; over the work."""
    change = lambda name: table[name][-1] - table[name][0]
    work = change("top[8]") - PRESSURE * change("volume")
    return abs(work - sum(change(f"mpm[{k}]") for k in (5, 7, 9, 13))) / work


def draw(study, curves, alone, fields):
    figure, axes = plt.subplots(1, 5, figsize=(15, 4), layout="constrained", gridspec_kw={"width_ratios": [2.2, 1, 1, 1, 1]})
    for name, colour in (("dense", "C3"), ("loose", "C0")):
        strain, stress = curves[name]
        axes[0].plot(100 * strain, stress, color=colour, label=f"{name}, specimen")
        strain, stress, spread = alone[name]
        axes[0].plot(100 * strain, stress, "--", color=colour, lw=1, label=f"{name}, packings alone")
        axes[0].fill_between(100 * strain, stress - spread, stress + spread, color=colour, alpha=0.15, lw=0)
    axes[0].set(xlabel="axial strain [%]", ylabel="stress on the plate [kPa]", xlim=(0, 20), ylim=(0, None))
    axes[0].legend(frameon=False, fontsize=8)
    for k, (name, column, title) in enumerate([("dense", "f_mpm[10]", "shear strain"), ("dense", "f_mpm[13]", "heating [K]"),
                                               ("loose", "f_mpm[10]", "shear strain"), ("loose", "f_mpm[13]", "heating [K]")]):
        draw_field(figure, axes[1 + k], columns(fields[name][-1]), column, f"{name}: {title}")
    study.save(figure, "biaxial")
