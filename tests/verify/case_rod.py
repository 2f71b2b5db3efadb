# SPDX-License-Identifier: GPL-2.0-or-later
"""TM-DEMPM 5.2.1: the rod between two fixed ends, continuum and packings (square lattice of 400 disks), against
series.

Stresses are those that heating adds to the confinement. The mean stress is exact at all times; pointwise the exact
solution without damping rings for ever (exact.rod_ringing)."""
import numpy as np
from study import plt

from exact import rod_displacement, rod_mean_temperature, rod_ringing, rod_temperature

MODULUS, EXPANSION, DENSITY = 1e6 / 0.075, 1e-4, 2650.0
SPEED = np.sqrt(MODULUS / DENSITY)
POINTS = 50
PLACE = (np.arange(POINTS) + 0.5) / POINTS


def history(run, law, dt=1e-4):
    """t, and [time][point] of place, temperature, axial stress without confinement."""
    times, values = [], []
    for step, columns in run.dump(f"rod_{law}.dump"):
        order = np.argsort(columns["id"])
        times.append(step * dt)
        values.append([np.array(columns[name])[order] for name in ("x", "f_mpm[13]", "f_mpm[1]")])
    place, temperature, stress = np.array(values).transpose(1, 0, 2)
    return np.array(times[1:]), place[1:], temperature[1:], stress[1:] - np.mean(stress[0])


def exact(times, ringing):
    """Temperature at the first places, mean stress, displacement, stress; with what inertia adds."""
    mean = np.array([-MODULUS * EXPANSION * rod_mean_temperature(t) for t in times])
    displacement = np.array([EXPANSION * rod_displacement(PLACE, t) for t in times])
    stress = np.repeat(mean[:, None], POINTS, axis=1)
    if ringing:
        extra = np.array([rod_ringing(PLACE, t, SPEED, modes=POINTS) for t in times])
        stress, displacement = stress + MODULUS * EXPANSION * extra[:, 0], displacement + EXPANSION * extra[:, 1]
    return mean, displacement, stress


def root_mean_square(values):
    return np.sqrt(np.mean(np.square(values)))


def compare(study, run, label, found):
    times, place, temperature, stress = found
    late = times > 0.1499
    mean, displacement, _ = exact(times, False)
    heat = np.array([t - rod_temperature(x, time) for t, x, time in zip(temperature, place, times)])
    largest = np.max(np.abs(displacement))
    study.check(f"{label}: temperature from 0.15 s on, % of the step", np.max(np.abs(heat[late])), 0.2, run)
    early = (times > 0.0499) & (times < 0.1499)
    study.check(f"{label}: the same from 0.05 s to 0.15 s", np.max(np.abs(heat[early])), None, run)
    study.check(f"{label}: mean stress, % of its last value",
                100 * np.max(np.abs(np.mean(stress, axis=1) - mean)) / abs(mean[-1]), 1, run)
    calm = times > 0.8 * times[-1]
    study.check(f"{label}: displacement beside the series without inertia, last fifth, % of the largest",
                100 * np.max(np.abs(place - PLACE - displacement)[calm]) / largest, None, run)
    over = np.mean((place - PLACE)[calm] - displacement[calm], axis=0)
    study.check(f"{label}: the same, its mean over that time", 100 * np.max(np.abs(over)) / largest, 1, run)
    study.check(f"{label}: stress beside the series without inertia, last fifth, rms, % of its last value",
                100 * root_mean_square((stress - mean[:, None])[calm]) / abs(mean[-1]), None, run)


def check_ringing(study):
    """The waves themselves: APIC, which damps next to nothing."""
    variables = {"law": "elastic", "transfer": "apic", "steps": 2000, "dt": 5e-5, "every": 20}
    run = study.run("waves", "in.rod", variables, folders=["rod"], threads=1)
    times, place, _, stress = history(run, "elastic", 5e-5)
    _, displacement, exact_stress = exact(times, True)
    plain, _, still = exact(times, False)
    error = root_mean_square(place - PLACE - displacement)
    study.check("elastic, APIC: displacement beside the series with its waves, 0.1 s, rms, % of the largest",
                100 * error / np.max(np.abs(displacement)), None, run)
    amplitude = root_mean_square(exact_stress - still)
    study.check("elastic, APIC: stress beside the series with its waves, 0.1 s, rms, % of the waves' own rms",
                100 * root_mean_square(stress - exact_stress) / amplitude, None, run)
    return times, place, stress, exact_stress, displacement


def draw(study, found, waves):
    figure, axes = plt.subplots(2, 3, figsize=(12.5, 6.5))
    for row, law in enumerate(("elastic", "rve")):
        times, place, temperature, stress = found[law]
        for share, color in ((0.05, "C0"), (0.1, "C1"), (0.2, "C2"), (0.5, "C3"), (1.0, "C4")):
            k = int(np.argmin(np.abs(times - share)))
            t = times[k]
            mean, displacement, _ = exact(times[k:k + 1], False)
            axes[row, 0].plot(PLACE, rod_temperature(PLACE, t), color, label=f"{t:.2f} s")
            axes[row, 0].plot(place[k], temperature[k], color + "o", ms=3)
            axes[row, 2].plot(PLACE, 1e3 * displacement[0], color)
            axes[row, 2].plot(PLACE, 1e3 * (place[k] - PLACE), color + "o", ms=3)
        axes[row, 1].plot(times, 1e-3 * stress[:, POINTS // 2], "C7", lw=0.6, label="in the middle")
        axes[row, 1].plot(times, 1e-3 * np.mean(stress, axis=1), "C0", label="mean")
        axes[row, 1].plot(times, 1e-3 * exact(times, False)[0], "k--", label="series")
        axes[row, 0].set(title=f"{'continuum' if law == 'elastic' else '400 disks per point'}: T, C")
        axes[row, 1].set(title="stress by heating, kPa", xlabel="t, s" if row else "")
        axes[row, 2].set(title="displacement, mm (lines: series without inertia)", xlabel="x, m" if row else "")
        axes[row, 0].legend()
        axes[row, 1].legend()
    study.save(figure, "rod")
    times, place, stress, exact_stress, displacement = waves
    figure, axes = plt.subplots(1, 2, figsize=(13, 4))
    axes[0].plot(times, 1e-3 * exact_stress[:, POINTS // 4], "k", lw=0.8, label="series with waves")
    axes[0].plot(times, 1e-3 * stress[:, POINTS // 4], "C1", lw=0.8, label="MPM, APIC")
    axes[0].set(title="stress at x = 0.25, kPa", xlabel="t, s")
    axes[1].plot(times, 1e3 * displacement[:, POINTS // 2], "k", lw=0.8)
    axes[1].plot(times, 1e3 * (place - PLACE)[:, POINTS // 2], "C1", lw=0.8)
    axes[1].set(title="displacement at x = 0.5, mm", xlabel="t, s")
    axes[0].legend()
    study.save(figure, "rod_waves")


def verify(study):
    lattice = study.run("lattice", "in.lattice", folders=["rod"], threads=1).path / "lattice.data"
    found, runs = {}, {}
    for law in ("elastic", "rve"):
        cost = {"grains": 400} if law == "rve" else {"threads": 1}
        runs[law] = study.run(law, "in.rod", {"law": law}, folders=["rod"], files=[lattice], **cost)
        found[law] = history(runs[law], law)
        compare(study, runs[law], "400 disks" if law == "rve" else "elastic", found[law])
    (_, x1, t1, s1), (_, x2, t2, s2) = found["elastic"], found["rve"]
    last = abs(np.mean(s1[-1]))
    study.check("400 disks beside the continuum: temperature, % of the step", np.max(np.abs(t2 - t1)), 1, runs["rve"])
    study.check("400 disks beside the continuum: mean stress, % of its last value",
                100 * np.max(np.abs(np.mean(s2 - s1, axis=1))) / last, 1, runs["rve"])
    study.check("400 disks beside the continuum: displacement, rms, % of the largest",
                100 * root_mean_square(x2 - x1) / np.max(np.abs(x1 - PLACE)), 1, runs["rve"])
    study.check("400 disks beside the continuum: stress at single points, rms, % of the last mean",
                100 * root_mean_square(s2 - s1) / last, None, runs["rve"])
    draw(study, found, check_ringing(study))
