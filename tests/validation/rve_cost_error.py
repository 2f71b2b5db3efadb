#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Cost against error of one packing: biaxial tests of dense packings of disks, 50 to 1,600 grains against 6,400, loading rates,
damping, precision, length of calls. The tables and the picture of doc/performance.md.

   rve_cost_error.py [--quick] [--grains N] [--resume] [--out FILE.png]     from the root, after `make programs`

Sizes: every size gets as many packings (seeds) as make N grains in all (51,200), the reference twice as many. Bias is the mean of all
packings minus the reference's: it stays in a scene of many material points, which average the scatter of single packings.
Rates, damping, precision and calls: the same packings of 400 grains each time, the change against the first of the list.

The whole took 18 minutes on one core that had other work.

Strengths are sin phi = (s1 - s3)/(s1 + s3), means over strains that are the same for all: around the reference's peak, and from
10 to 15 %. A packing's own highest value is given apart: it is the largest of a fluctuating curve. Modulus: deviator over axial strain at 2e-4.
Conductivity: half its trace, at the start and from 10 to 15 %. Cost: processor time of the DEM steps of one `dempm-rve run` to 15 %.
Packings are kept in build/cost and used again. --resume uses the results of an earlier run too (of the same build, that is)."""
import argparse
import os
import pathlib
import re
import resource
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from peer_rve import BUILD, execute  # noqa: E402

RADII, RHO, PRESSURE, STIFFNESS, THICKNESS = (0.0025, 0.005), 2650.0, 1e5, 1e6, 0.075
TIME = sum(RADII) * np.sqrt(RHO / PRESSURE)  # I = rate TIME
STRAIN, SMALL, RESIDUAL, HALF_PEAK = 0.15, 2e-4, 0.10, 0.005
NUMBER, SLOW, GRAINS, LOCAL = 1e-3, 2e-5, 400, 0.3
WORK = BUILD / "cost"
LAW = ["--dimension", 2, *(word for pair in dict(
    kn=STIFFNESS, kt=STIFFNESS, mu=0.5, density=RHO, thickness=THICKNESS, expansion=0, Tref=0, alpha=1e3,
    pressure=PRESSURE, stress_tolerance=0.2).items() for word in ("--set", "%s=%s" % pair))]
QUANTITIES = {"peak": "peak strength", "residual": "residual strength", "modulus": "initial modulus",
              "start": "conductivity, start", "flow": "conductivity, residual"}
COLOURS = dict(zip(QUANTITIES, ["#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7"]))
MARKS = dict(zip(QUANTITIES, "osD^v"))


def timed(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    code, output = execute(command, env={**os.environ, "OMP_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert code == 0, output
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, output


def packing(grains, seed):
    file = WORK / "packings" / f"{grains}_{seed}.packing"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        timed([BUILD / "dempm-pack", "generate", file, "grains", grains, "seed", seed, "radius", *RADII, "pressure", PRESSURE,
               "preparation_friction", 0.01, "density", RHO, "kn", STIFFNESS, "kt", STIFFNESS, "thickness", THICKNESS])
    return file


def biaxial(file, number, strain, words):
    """(processor time, columns) of one test at this inertial number. The steps' time is known as wall time only, the processor
    time only with start and output: the smaller of the two is nearer to the steps' processor time."""
    with tempfile.TemporaryDirectory(dir=WORK) as folder:
        out = pathlib.Path(folder) / "out.csv"
        process, output = timed([BUILD / "dempm-rve", "run", file, "--path", "biaxial", *LAW, *words, "--set",
                                 f"rate={number / TIME!r}", "--set", f"strain={strain}", "--out", out])
        speed = [float(word) for word in re.search(r"speed +(\S+) particle-steps in .* s: (\S+) part", output).groups()]
        lines = out.read_text().splitlines()
    rows = np.array([line.split(",") for line in lines[1:]], float)
    return min(process, speed[0] / speed[1]), dict(zip(lines[0].split(","), rows.T))


def tests(name, grains, seeds, words, number=NUMBER, small=SLOW, resume=False):
    """One row of results per seed: processor time, modulus, steps, curves of sin phi and of conductivity."""
    file = WORK / f"{name}.npz"
    done = dict(np.load(file)) if resume and file.exists() else dict(rows=np.zeros((0, 3)), sine=[], heat=[])
    rows, sine, heat = (list(done[key]) for key in ("rows", "sine", "heat"))
    words = [str(word) for word in words]
    for seed in range(len(rows) + 1, seeds + 1):
        seconds, found = biaxial(packing(grains, seed), number, STRAIN, words)
        _, first = biaxial(packing(grains, seed), small, SMALL, words) if small else (0, None)
        modulus = (first["sxx"] - first["syy"])[-1] / SMALL if small else np.nan
        rows.append([seconds, modulus, found["steps"][-1] - found["steps"][0]])
        sine.append((found["syy"] - found["sxx"]) / (found["syy"] + found["sxx"]))
        heat.append(0.5 * (found["Kxx"] + found["Kyy"]))
        if seed % 32 == 0 or seed == seeds:
            np.savez(file, rows=rows, sine=sine, heat=heat)
    rows, sine, heat = (np.array(values)[:seeds] for values in (rows, sine, heat))
    print(f"# {name}: {len(rows)} packings of {grains}, {rows[:, 2].mean():.0f} steps, {rows[:, 0].mean():.4f} s each, "
          f"{grains * rows[:, 2].sum() / rows[:, 0].sum():.3g} particle-steps/s", flush=True)
    return rows, sine, heat


def quantities(result, peak):
    """name: one value per packing"""
    rows, sine, heat = result
    strain = np.linspace(0, STRAIN, sine.shape[1])
    near, late = abs(strain - peak) <= HALF_PEAK, strain >= RESIDUAL
    return dict(peak=sine[:, near].mean(1), residual=sine[:, late].mean(1), modulus=rows[:, 1], start=heat[:, 0],
                flow=heat[:, late].mean(1))


def error_of_mean(values):
    return values.std(ddof=1) / np.sqrt(len(values))


def against_reference(result, reference, peak):
    """name: (bias, its error, scatter), all relative"""
    found = {}
    for name, values in quantities(result, peak).items():
        best = quantities(reference, peak)[name]
        found[name] = (values.mean() / best.mean() - 1, np.hypot(error_of_mean(values), error_of_mean(best)) / best.mean(),
                       values.std(ddof=1) / best.mean())
    return found


def against_same(result, base, peak):
    """name: (change of the mean, its error, root mean square change of single packings)"""
    found, mean = {}, quantities(base, peak)
    for name, values in quantities(result, peak).items():
        change = (values - mean[name]) / mean[name].mean()
        found[name] = change.mean(), error_of_mean(change), np.sqrt((change**2).mean())
    return found


def slow_base(by_number, base):
    """What rates are compared with: the slowest test, and the modulus at SLOW."""
    rows, sine, heat = by_number[min(by_number)]
    return np.column_stack([rows[:, 0], base[0][:, 1], rows[:, 2]]), sine, heat


def percent(value, error):
    return f"{100 * value:+.1f} ± {100 * error:.1f}" if np.isfinite(value) else ""


def table(title, heads, lines):
    print(f"\n{title}\n\n| " + " | ".join(heads) + " |\n|" + " --- |" * len(heads))
    for line in lines:
        print("| " + " | ".join(line) + " |")


def study(quick, in_all, resume):
    sizes, top = ([50, 100, 200, 400], 1600) if quick else ([50, 100, 200, 400, 800, 1600], 6400)
    tag = "quick_" if quick else ""
    local = ["--set", f"damping/local={LOCAL}"]

    def run(name, grains=GRAINS, words=local, share=1, **options):
        return tests(f"{tag}{name}", grains, max(4, share * in_all // grains), words, resume=resume, **options)

    by_size = {grains: run(f"size_{grains}", grains) for grains in sizes}
    reference = run(f"size_{top}", top, share=2, small=SLOW / 5)  # waves take longer to cross: 1 % too stiff at SLOW
    by_number = {number: run(f"rate_{number:g}", number=number, small=number)
                 for number in ([1e-2, 4e-3, NUMBER] if quick else [1e-2, 4e-3, 2e-3, NUMBER, 5e-4, 2.5e-4])}
    names = {"none": [], "viscous 0.2": ["--set", "damping/viscous=0.2"],
             **{f"local {a}": ["--set", f"damping/local={a}"] for a in ((0.1, 0.7) if quick else (0.1, 0.2, 0.5, 0.7))}}
    by_damping = {name: {NUMBER: run(f"{name.replace(' ', '_')}", words=words)} for name, words in names.items()}
    mixed = run("mixed", words=[*local, "--set", "precision=mixed"])
    for name, words in {} if quick else names.items():
        by_damping[name][4e-3] = run(f"{name.replace(' ', '_')}_4e-3", words=words, number=4e-3)
    by_damping[f"local {LOCAL}"] = {NUMBER: by_size[GRAINS]}
    if not quick:
        by_damping[f"local {LOCAL}"][4e-3] = slow_base({4e-3: by_number[4e-3]}, by_size[GRAINS])
    steps = by_size[GRAINS][0][:, 2].mean() / 200
    by_calls = {n: run(f"calls_{n}", words=[*local, "--set", f"substeps={n}", "--every", round(steps / n)], small=None)
                for n in ([7] if quick else [1, 3, 7, 22])}
    step = run("step_0.8", words=[*local, "--set", "timestep_fraction=0.8"])
    slower = None if quick else run(f"rate_{top}", top, number=5e-4, small=None)
    return by_size, reference, top, by_number, by_damping, mixed, by_calls, step, slower


def tables(by_size, reference, top, by_number, by_damping, mixed, by_calls, step, slower, peak):
    base, heads = by_size[GRAINS], list(QUANTITIES.values())
    best = quantities(reference, peak)
    print(f"\nReference: {len(reference[0])} packings of {top} grains, {reference[0][:, 0].mean():.2f} s each; peak at {peak:.2%}")
    for name, title in QUANTITIES.items():
        values = best[name]
        print(f"{title}: {values.mean():.5g}, error of the mean {error_of_mean(values) / values.mean():.2%}, "
              f"scatter of one packing {values.std(ddof=1) / values.mean():.2%}")

    def size_lines(pick):
        return [[f"{grains}", f"{len(result[0])}", f"{result[0][:, 0].mean():.3f}",
                 *(pick(value) for value in against_reference(result, reference, peak).values())]
                for grains, result in by_size.items()]
    table("Bias, %", ["grains", "packings", "CPU s", *heads], size_lines(lambda v: percent(v[0], v[1])))
    table("Scatter of one packing, %", ["grains", "packings", "CPU s", *heads], size_lines(lambda v: f"{100 * v[2]:.1f}"))
    own = {grains: result[1].max(1) for grains, result in {**by_size, top: reference}.items()}
    print("\nOwn highest sin phi against the mean curve's at the reference's peak: "
          + ", ".join(f"{grains}: {values.mean() / best['peak'].mean() - 1:+.1%}" for grains, values in own.items()))

    def paired(results, base):
        return [[name, f"{result[0][:, 0].mean():.3f}",
                 *(percent(*v[:2]) for key, v in against_same(result, base, peak).items() if key != "start")]
                for name, result in results.items()]
    heads = [title for key, title in QUANTITIES.items() if key != "start"]  # all start from the same packings
    slowest = slow_base(by_number, base)
    table(f"Loading rate, {GRAINS} grains: change against the slowest (modulus: against I = {SLOW:g}), %", ["I", "CPU s", *heads],
          paired({f"{number:g}": result for number, result in by_number.items()}, slowest))
    if slower:
        table(f"I = 1e-3 against 5e-4, {top} grains, %", ["I", "CPU s", *heads],
              paired({f"{NUMBER:g}": tuple(part[:len(slower[0])] for part in reference)}, slower))
    for number in (NUMBER, 4e-3):
        rows = {name: results[number] for name, results in sorted(by_damping.items()) if number in results}
        if rows:
            table(f"Damping, {GRAINS} grains, I = {number:g}: change against local 0.1, %", ["damping", "CPU s", *heads],
                  paired(rows, rows["local 0.1"]))
    for name, result in {"precision mixed": mixed, "time step 0.8 of the critical one": step}.items():
        table(f"{name} against the same packings with the base, %", ["", "CPU s", *heads], paired({name: result}, base))
        single = against_same(result, base, peak)
        print("root mean square change of single packings, %: "
              + ", ".join(f"{QUANTITIES[key]} {100 * value[2]:.2f}" for key, value in single.items() if key != "start"))
    table("DEM steps per call at the same strain per DEM step, %", ["substeps", "CPU s", *heads],
          paired({str(n): result for n, result in by_calls.items()}, base))


def seconds_axis(axis):
    ticks = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5]
    axis.set(xscale="log", xlabel="CPU seconds of one packing to 15 %")
    low, high = axis.get_xlim()
    shown = [tick for tick in ticks if low <= tick <= high]
    axis.set_xticks(shown, [f"{tick:g}" for tick in shown])
    axis.minorticks_off()
    axis.set_xlim(low / 1.15, high * 1.1)


def head(axis, place, text):
    axis.annotate(text, (place, 1.0), xycoords=("data", "axes fraction"), ha="center", va="top", color="0.4")


def picture(file, by_size, reference, top, by_number, by_damping, mixed, peak):
    plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9})
    figure, axes = plt.subplots(2, 2, figsize=(9.5, 7.2), constrained_layout=True)
    seconds = [result[0][:, 0].mean() for result in by_size.values()]
    sizes = [against_reference(result, reference, peak) for result in by_size.values()]
    for axis, title in zip(axes.flat, ["Scatter of one packing, by size", f"Bias, by size (against {top:,} grains)",
                                       f"Change by loading rate, {GRAINS} grains", f"Change by damping, {GRAINS} grains"]):
        axis.set_title(title, loc="left")
        axis.grid(alpha=0.3, lw=0.5)
    for name, label in QUANTITIES.items():
        style = dict(color=COLOURS[name], marker=MARKS[name], ms=4, lw=1)
        axes[0, 0].plot(seconds, [100 * found[name][2] for found in sizes], label=label, **style)
        axes[0, 1].errorbar(seconds, [100 * found[name][0] for found in sizes], [100 * found[name][1] for found in sizes],
                            capsize=2, **style)
    for axis in axes[0]:
        seconds_axis(axis)
        for (grains, x) in zip(by_size, seconds):
            head(axis, x, f"N = {grains}" if grains == min(by_size) else f"{grains}")
    guide = np.array([seconds[0], seconds[-1]])
    axes[0, 0].plot(guide, 30 * np.sqrt(50 / np.array([min(by_size), max(by_size)])), "--", color="0.5", lw=1,
                    label=r"$\propto$ grains$^{-1/2}$")
    axes[0, 0].set(yscale="log", ylabel="standard deviation, %")
    axes[0, 0].legend(frameon=False, fontsize=8, loc="lower left")
    axes[0, 0].set_yticks([0.5, 1, 2, 5, 10, 20], ["0.5", "1", "2", "5", "10", "20"])
    axes[0, 0].minorticks_off()
    axes[0, 1].axhline(0, color="0.3", lw=0.8)
    axes[0, 1].set(ylabel="mean of all packings less reference, %")
    slowest = slow_base(by_number, by_size[GRAINS])
    changes = {number: against_same(result, slowest, peak) for number, result in by_number.items()}
    x = [by_number[number][0][:, 0].mean() for number in changes]
    for name in QUANTITIES:
        if name != "start":
            axes[1, 0].errorbar(x, [100 * found[name][0] for found in changes.values()],
                                [100 * found[name][1] for found in changes.values()], color=COLOURS[name], marker=MARKS[name],
                                ms=4, lw=1, capsize=2)
    for number, place in zip(changes, x):
        head(axes[1, 0], place, f"I = {number:g}" if number == max(by_number) else f"{number:g}")
    axes[1, 0].axhline(0, color="0.3", lw=0.8)
    seconds_axis(axes[1, 0])
    axes[1, 0].set(ylabel=f"change against I = {min(by_number):g} (modulus {SLOW:g}), %")
    axes[1, 0].set_yscale("symlog", linthresh=2)
    marks = [-10, -5, -2, -1, 0, 1, 2, 5, 10, 20, 50]
    axes[1, 0].set_yticks(marks, [str(mark) for mark in marks])
    axes[1, 0].set_ylim(-15, 120)
    order = ["none", *sorted(name for name in by_damping if name.startswith("local")), "viscous 0.2"]
    for number, fill in ((NUMBER, "full"), (4e-3, "none")):
        rows = [(k, by_damping[name][number]) for k, name in enumerate(order) if number in by_damping[name]]
        for shift, name in zip((-0.12, 0, 0.12), ("peak", "residual", "flow")):
            changes = [against_same(result, by_damping["local 0.1"][number], peak)[name] for _, result in rows]
            if changes:
                axes[1, 1].errorbar([k + shift for k, _ in rows], [100 * c[0] for c in changes], [100 * c[1] for c in changes],
                                    color=COLOURS[name], marker=MARKS[name], fillstyle=fill, ms=5, ls="none", capsize=2)
    for shift, name in zip((-0.12, 0, 0.12), ("peak", "residual", "flow")):
        change = against_same(mixed, by_damping[f"local {LOCAL}"][NUMBER], peak)[name]
        axes[1, 1].errorbar([len(order) + shift], [100 * change[0]], [100 * change[1]], color=COLOURS[name], marker=MARKS[name],
                            ms=5, ls="none", capsize=2)
    axes[1, 1].axvline(len(order) - 0.5, color="0.6", lw=0.8, ls=":")
    axes[1, 1].axhline(0, color="0.3", lw=0.8)
    axes[1, 1].set_xticks(range(len(order) + 1), [*(name.replace(" ", "\n") for name in order), "mixed\nprecision"])
    axes[1, 1].set(ylabel="change against local 0.1; double, %")
    axes[1, 1].annotate("full: I = 0.001, open: I = 0.004", (0.02, 0.93), xycoords="axes fraction", color="0.4")
    figure.savefig(file, dpi=130)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="up to 400 grains against 1,600, few packings: half a minute")
    parser.add_argument("--grains", type=int, help="grains of all packings of one size (51200; quick: 3200)")
    parser.add_argument("--resume", action="store_true", help="use results of an earlier run that are in build/cost")
    parser.add_argument("--out", type=pathlib.Path, default=WORK / "rve_cost_error.png", help="the picture")
    given = parser.parse_args()
    WORK.mkdir(parents=True, exist_ok=True)
    by_size, reference, top, by_number, by_damping, mixed, by_calls, step, slower = study(
        given.quick, given.grains or (3200 if given.quick else 51200), given.resume)
    mean = reference[1].mean(0)
    peak = np.linspace(0, STRAIN, len(mean))[np.convolve(mean, np.ones(7) / 7, "same").argmax()]
    tables(by_size, reference, top, by_number, by_damping, mixed, by_calls, step, slower, peak)
    picture(given.out, by_size, reference, top, by_number, by_damping, mixed, peak)
    print(f"\npicture: {given.out}")


if __name__ == "__main__":
    main()
