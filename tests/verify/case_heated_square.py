# SPDX-License-Identifier: GPL-2.0-or-later
"""TM-DEMPM 5.2.2: the square heated on all sides, continuum and packings of 400 disks of many sizes, against series.

The continuum has the 2D moduli K and G that the packing shows under small uniaxial compression (dempm-rve). Stresses
are those that heating adds to the confinement. Quick: the packings on a quarter of the 40 x 40 points and until 0.5
s; full: on all, 1 s."""
import subprocess

import numpy as np
from study import BUILD, plt

from conftest import environment
from exact import square_centre_stress, square_mean_temperature, square_temperature

PACKING = dict(grains=400, radius=(0.0025, 0.005), pressure=1e5, preparation_friction=0.01, density=2650, kn=1e6, kt=1e6, thickness=0.075)
EXPANSION, PIPE, HOT = 1e-4, 2.05e4, 75.0
GRAINS = ["density=2650", "kn=1e6", "kt=1e6", "mu=0.5", "thickness=0.075", "damping/local=0.7",
          f"expansion={EXPANSION}", "Tref=0", f"alpha={PIPE}"]
STRAIN = 1e-3


def program(study, name, *words):
    done = subprocess.run([str(BUILD / name), *map(str, words)], cwd=study.folder, env=environment(1), text=True,
                          capture_output=True)
    if done.returncode:
        raise RuntimeError(f"{name}: {done.stdout}{done.stderr}")


def element(study, name, rows):
    """One packing through a path of (time, Lxx, Lyy, T); the columns of the answer."""
    lines = ["time, Lxx, Lyy, T"] + [", ".join(map(str, row)) for row in rows]
    (study.folder / f"{name}.path").write_text("\n".join(lines) + "\n")
    program(study, "dempm-rve", "run", "dense.packing", "--path", f"{name}.path", "--dimension", 2,
            "--out", f"{name}.csv", *(word for setting in GRAINS for word in ("--set", setting)))
    return np.genfromtxt(study.folder / f"{name}.csv", delimiter=",", names=True)


def probe(study, axis, heat):
    """K and G by compression along one axis, after heating in a fixed cell."""
    warm, rest, rate = 0.05, 0.06, STRAIN / 0.002
    still = (0, 0)
    push = (-rate, 0) if axis == "x" else (0, -rate)
    answer = element(study, f"probe_{axis}_{heat:g}", [(0, *still, 0), (warm, *still, heat), (rest, *push, heat),
                                                       (rest + 0.002, *still, heat)])
    start = np.argmin(np.abs(answer["time"] - rest))
    along, across = ("sxx", "syy") if axis == "x" else ("syy", "sxx")
    stiff, side = (-(answer[c][-1] - answer[c][start]) / (STRAIN * (answer["time"][-1] - answer["time"][start]) / 0.002)
                   for c in (along, across))
    return 0.5 * (stiff + side), 0.5 * (stiff - side)


def history(run, law, cells, dt):
    """t and x, y, T, sxx, syy, sxy of the cells x cells points; stresses without confinement."""
    frames, start = [], None
    for step, columns in run.dump(f"square_{law}.dump"):
        number = np.array(columns["f_mpm[30]"]).astype(int) - 1
        field = np.empty((6, cells * cells))
        field[:, number] = [columns[c] for c in ("x", "y", "f_mpm[13]", "f_mpm[1]", "f_mpm[2]", "f_mpm[4]")]
        start = field[3:].mean(axis=1)[:, None] if start is None else start
        field[3:] -= start
        frames.append((step * dt, field.reshape(6, cells, cells)))
    return frames[1:]


def centre(frames, cells, whole=True):
    middle = slice(cells // 2 - 1, cells // 2 + 1) if whole else slice(cells - 2, cells)
    values = np.array([field[2:, middle, middle].mean(axis=(1, 2)) for _, field in frames])
    return np.array([t for t, _ in frames]), values


def temperature_error(frames, warm=lambda t: t):
    """Largest error next to the centre; warm(t) is the time that a conductivity of 0.1 needs for the same heat."""
    worst = 0.0
    for t, field in frames:
        near = np.max(np.abs(field[:2] - 0.5), axis=0) < 0.02
        x, y, heat = field[:3, near]
        exact = np.array([square_temperature(x[k:k + 1], y[k:k + 1], warm(t))[0] for k in range(len(x))])
        worst = max(worst, np.max(np.abs(heat - exact)))
    return worst


def warming(study):
    """Time at a conductivity of 0.1 that warms as much as the packing's own conductivity, which grows with its
    pressure: from heating in a fixed cell, at the square's mean temperature."""
    answer = element(study, "heating", [(0, 0, 0, 0), (0.1, 0, 0, 100)])
    conductivity = 0.5 * (answer["Kxx"] + answer["Kyy"])
    times = np.linspace(0, 1, 401)
    scaled = np.zeros_like(times)
    for k in range(1, len(times)):
        mean = square_mean_temperature(scaled[k - 1] + 0.5 * (times[k] - times[k - 1]))
        scaled[k] = scaled[k - 1] + (times[k] - times[k - 1]) * np.interp(mean, answer["T"], conductivity) / 0.1
    return answer, lambda t: np.interp(t, times, scaled)


def run_square(study, name, law, cells, dt, time, part="whole", **variables):
    """The frames of one run of `cells` cells along the whole edge."""
    rve = {"files": [study.folder / "dense.packing"], "grains": 400} if law == "rve" else {"threads": 1}
    variables = {"law": law, "cells": cells, "dt": dt, "time": time, "part": part, **variables}
    run = study.run(name, "in.heated_square", variables, folders=["heated_square"], **rve)
    return run, history(run, law, cells if part == "whole" else cells // 2, dt)


def compare_continuum(study, moduli):
    bulk, shear = moduli
    ratio = (bulk - shear) / (bulk + shear)
    run, frames = run_square(study, "continuum", "elastic", 40, 1e-4, 1.0, poisson=ratio, young=2 * bulk * (1 - ratio))
    times, values = centre(frames, 40)
    study.check("continuum: temperature at the centre, % of the step", temperature_error(frames), 0.5, run)
    still = np.array([square_centre_stress(t, bulk, shear, EXPANSION) for t in times])
    mean = np.array([-2 * bulk * EXPANSION * square_mean_temperature(t) for t in times])
    area = np.array([field[3:5].mean(axis=(1, 2)) for _, field in frames])
    off = np.max(np.abs(area - mean[:, None])) / abs(mean[-1])
    study.check("continuum: mean stress, % of its last value", 100 * off, 1, run)
    calm = times > 0.5 * times[-1]
    study.check("continuum: stress at the centre beside the series without inertia, mean over the second half, %",
                100 * abs(np.mean((values[:, 1] - still)[calm])) / abs(still[-1]), 2, run)
    return times, values


def friction_heat(study):
    """Table 1's heat capacity lets the heat of friction between the grains be seen."""
    warm = []
    for name, capacity in (("quartz", 670.0), ("table_1", 1 / 2650.0)):
        run, frames = run_square(study, name, "rve", 16, 2.5e-4, 0.5, "quarter", capacity=capacity)
        warm.append(centre(frames, 8, False)[1][-1, 0])
    study.check("400 disks, 16 x 16: warmer at the centre after 0.5 s by friction, rho c = 1 J/(m3 K), % of the step",
                warm[1] - warm[0], None, run)


def verify(study):
    study.pack("dense", **PACKING)
    probes = {(axis, heat): probe(study, axis, heat) for axis in "xy" for heat in (0.0, HOT)}
    for (axis, heat), (bulk, shear) in probes.items():
        study.note(f"probed along {axis} at {heat:g} C: K {bulk / 1e6:.2f} MPa, G {shear / 1e6:.2f} MPa "
                   "(paper: 7.29 and 5.11)")
    heating, warm = warming(study)
    study.note(f"conductivity in a fixed cell, k = 0.1 meant: {heating['Kxx'][0]:.4f} and {heating['Kyy'][0]:.4f} along x "
               f"and y at 0 C, {heating['Kxx'][-1]:.4f} and {heating['Kyy'][-1]:.4f} at 100 C: the pressure closes contacts")
    continuum = compare_continuum(study, np.mean([probes[axis, 0.0] for axis in "xy"], axis=0))
    run, frames = run_square(study, "packings", "rve", 40, 1e-4, *((1.0, "whole") if study.full else (0.5, "quarter")))
    times, values = centre(frames, len(frames[0][1][0]), study.full)
    study.check("400 disks: temperature at the centre beside k = 0.1, % of the step", temperature_error(frames), None, run)
    study.check("400 disks: temperature at the centre beside the packing's own conductivity, % of the step",
                temperature_error(frames, warm), 0.5, run)
    judge_stress(study, run, probes, frames, times, values, warm)
    friction_heat(study)
    draw(study, probes, warm, continuum, (times, values))


def judge_stress(study, run, probes, frames, times, values, warm):
    """Normal stresses lie between the series with the smallest and the largest probed moduli: the mean over the area,
    which holds at all times, at the end, and at the centre, the mean over the second half, with what the continuum is allowed there:
    waves swing by more than 10 %, and the mean leaves some of that. All with the heat that the packing's own conductivity lets in;
    that of a single packing is some per cent off the one that is meant."""
    calm = times > 0.5 * times[-1]
    still = np.array([[square_centre_stress(warm(t), *moduli, EXPANSION) for moduli in probes.values()] for t in times])
    area = frames[-1][1][3:5].mean(axis=(1, 2))
    whole = [-2 * bulk * EXPANSION * square_mean_temperature(warm(times[-1])) for bulk, _ in probes.values()]
    middle = still[calm].mean(axis=0), values[calm, 1:3].mean(axis=0)
    for place, allowed, bounds, stress in (("at the centre, mean over the second half", 2, *middle),
                                           ("mean over the area, at the end", 0, np.array(whole), area)):
        low, high = bounds.min(), bounds.max()
        outside = max(np.max(low - stress), np.max(stress - high), 0.0)
        study.check(f"400 disks: stress {place}, outside of the probed moduli's bounds by, %", 100 * outside / abs(low), allowed, run)
        study.check(f"400 disks: stress {place}, anisotropy (sxx - syy) / mean, %",
                    100 * abs(stress[0] - stress[1]) / abs(stress.mean()), None, run)
        study.note("stress {}: xx {:.2f}, yy {:.2f} kPa; bounds {:.2f} to {:.2f} kPa".format(
            place, *stress / 1e3, low / 1e3, high / 1e3))


def draw(study, probes, warm, continuum, packings):
    figure, axes = plt.subplots(1, 2, figsize=(14, 5))
    centre_point = np.array([0.5])
    moments = np.linspace(0.01, 1.0, 200)
    series = lambda t: square_temperature(centre_point, centre_point, t)[0]
    axes[0].plot(moments, [series(t) for t in moments], "k", label="series, k = 0.1")
    axes[0].plot(moments, [series(warm(t)) for t in moments], "k--", lw=0.8, label="series, the packing's k")
    bounds = np.array([[square_centre_stress(t, *m, EXPANSION) for m in probes.values()] for t in moments]) / 1e3
    axes[1].fill_between(moments, bounds.min(axis=1), bounds.max(axis=1), color="0.85", label="series, probed moduli")
    for (times, values), color, label in ((continuum, "C0", "continuum"), (packings, "C1", "400 disks per point")):
        axes[0].plot(times, values[:, 0], color + "o", ms=3, label=label)
        axes[1].plot(times, values[:, 1] / 1e3, color, lw=1, label=f"{label}, xx")
        if color == "C1":
            axes[1].plot(times, values[:, 2] / 1e3, "C3", lw=1, label=f"{label}, yy")
    axes[0].set(xlabel="t, s", title="T at the centre, C")
    axes[1].set(xlabel="t, s", title="stress by heating at the centre, kPa")
    for axis in axes:
        axis.legend()
        axis.grid(alpha=0.3)
    study.save(figure, "heated_square")
