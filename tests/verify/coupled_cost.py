#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Processor time against error of the coupled method: rod, heated_square and biaxial over grid, points per cell,
grains per packing, DEM steps per call, time step and transfer, one at a time about a base. The section "Cost against
error" of doc/verification.md.

   coupled_cost.py [rod] [heated_square] [biaxial]     from the root, after `make programs`; 12 minutes on one core

Writes build/coupled_cost/report.json, table.md and coupled_cost.png. Runs that have ended are not repeated. Cost is
user and system time of the run, on one thread. Errors: rod against closed forms; the others against a run that is finer
than the base in grid, packings or both, which has an error of its own."""
import json
import resource
import sys

import numpy as np
from study import BUILD, Study, plt

from exact import rod_mean_temperature, rod_temperature, square_temperature

GRAINS = dict(radius=(0.0025, 0.005), pressure=1e5, density=2650, kn=1e6, kt=1e6, thickness=0.075,
              preparation_friction=0.01)
FOLDER = BUILD / "coupled_cost"


def spent(study, name, *words, **settings):
    """A run and its processor seconds, which are kept beside it."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run = study.run(name, *words, threads=1, **settings)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    mark = run.path / "processor_seconds"
    if not mark.exists():
        mark.write_text(str(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime))
    return run, float(mark.read_text())


def packings(study, count, grains, first=1):
    """`count` packings: points that all carry one would share its deviation."""
    return [study.pack(f"g{grains}_{seed}", grains=grains, seed=seed, **GRAINS) for seed in range(first, first + count)]


# ------------------------------------------------------------------------------------------------------------------ rod
class Rod:
    """0.3 s of examples/rod. A lattice has no statistics. Points per cell stay: two rows of points could bend, and the
    heat would make them buckle."""
    name = "rod"
    base = dict(cells=50, grains=400, substeps=0, dt=1e-4, transfer="flip 0.99")
    changes = [("grid", dict(cells=25)), ("grid", dict(cells=100, dt=5e-5)),
               ("grains", dict(grains=49)), ("grains", dict(grains=100)), ("grains", dict(grains=196)),
               ("sub-steps", dict(substeps=1)), ("sub-steps", dict(substeps=2)), ("sub-steps", dict(substeps=8)),
               ("time step", dict(dt=5e-5)), ("time step", dict(dt=2.5e-5)),
               ("transfer", dict(transfer="apic", dt=5e-5)),
               ("transfer", dict(transfer="apic", dt=5e-5, load="surface")),
               ("transfer", dict(transfer="xpic 2")), ("transfer", dict(transfer="flip 0.9")),
               ("transfer", dict(transfer="flip 0.999"))]
    errors = {"temperature": "temperature from 0.15 s on, largest error, % of the step",
              "mean stress": "mean stress from 0.01 s on, largest error, % of its last value"}
    MODULUS, EXPANSION, END = 1e6 / 0.075, 1e-4, 0.3

    def run(self, study, name, grains, dt, **variables):
        lattice = study.run(f"lattice_{grains}", "in.lattice", {"side": round(grains ** 0.5)}, ["rod"], threads=1)
        variables.update(dt=dt, steps=round(self.END / dt), every=round(0.01 / dt))
        run, seconds = spent(study, name, "in.rod", variables, ["rod"], [lattice.path / "lattice.data"], grains=grains)
        frames = run.dump("rod_rve.dump")
        still = np.mean(frames[0][1]["f_mpm[1]"])
        heat, stress = [], []
        for step, columns in frames[1:]:
            t, x = step * dt, np.array(columns["x"])
            middle = np.array(columns["f_mpm[13]"]) - rod_temperature(x, t)
            heat.append((t, np.max(np.abs(middle))))
            expected = -self.MODULUS * self.EXPANSION * rod_mean_temperature(t)
            stress.append((np.mean(columns["f_mpm[1]"]) - still, expected))
        found, exact = np.array(stress).T
        return seconds, {"temperature": max(error for t, error in heat if t > 0.1499),
                         "mean stress": 100 * np.max(np.abs(found - exact)) / abs(exact[-1])}

    def measure(self, study):
        return {name: self.run(study, name, **settings) for name, settings in each(self)}


# -------------------------------------------------------------------------------------------------------- heated square
class Square:
    """0.3 s of a quarter of examples/heated_square."""
    name = "heated_square"
    base = dict(cells=16, points=1, grains=200, substeps=0, dt=2.5e-4, transfer="flip 0.99")
    changes = [("grid", dict(cells=8)), ("grid", dict(cells=24)), ("points per cell", dict(points=2)),
               ("grains", dict(grains=50)), ("grains", dict(grains=100)), ("grains", dict(grains=400)),
               ("sub-steps", dict(substeps=2)), ("sub-steps", dict(substeps=5)), ("sub-steps", dict(substeps=40)),
               ("time step", dict(dt=1.25e-4)), ("time step", dict(dt=6.25e-5)), ("transfer", dict(transfer="apic")),
               ("transfer", dict(transfer="xpic 2")), ("transfer", dict(transfer="flip 0.999")),
               ("other packings", dict(first=101))]
    finest = dict(cells=24, grains=400, dt=1.25e-4)
    errors = {"temperature": "temperature at the centre, largest deviation, % of the step",
              "mean stress": "mean stress from 0.05 s on, largest deviation, % of its last value"}
    FILES = 31  # no divisor of the number of points in a row: neighbours differ

    def run(self, study, name, grains, dt, first=1, **variables):
        files = packings(study, self.FILES, grains, first)
        variables.update(dt=dt, time=0.3, part="quarter", packing=" ".join(file.name for file in files))
        run, seconds = spent(study, name, "in.heated_square", variables, ["heated_square"], files, grains=grains)
        frames = run.dump("square_rve.dump")
        place = {c: np.array(frames[0][1][c]) for c in "xy"}
        centre = np.argmin((place["x"] - 0.5) ** 2 + (place["y"] - 0.5) ** 2)
        still = self.stress(frames[0])
        curve = []
        for step, columns in frames[1:]:
            t = step * dt
            near, middle = (square_temperature(*at, t)[0] for at in
                            ([np.array(columns[c])[[centre]] for c in "xy"], [np.array([0.5])] * 2))
            curve.append((t, columns["f_mpm[13]"][centre] + middle - near, self.stress((step, columns)) - still))
        return seconds, np.array(curve)

    @staticmethod
    def stress(frame):
        return 0.5 * np.mean(np.array(frame[1]["f_mpm[1]"]) + np.array(frame[1]["f_mpm[2]"]))

    def measure(self, study):
        found = {name: self.run(study, name, **settings) for name, settings in each(self)}
        _, reference = self.run(study, "reference", **{**self.base, **self.finest})
        late = reference[:, 0] > 0.0499
        return {name: (seconds, {"temperature": np.max(np.abs(curve[:, 1] - reference[:, 1])),
                                 "mean stress": 100 * np.max(np.abs(curve[late, 2] / reference[-1, 2]
                                                                    - reference[late, 2] / reference[-1, 2]))})
                for name, (seconds, curve) in found.items()}


# -------------------------------------------------------------------------------------------------------------- biaxial
class Biaxial:
    """3.2 % of strain of examples/biaxial, dense: to the peak, or just past it."""
    name = "biaxial"
    base = dict(grid=0.2, spacing=0.1, grains=100, substeps=10, dt=1e-3, transfer="flip 0.999")
    changes = [("grid", dict(grid=0.4, spacing=0.2)), ("grid", dict(grid=0.1, spacing=0.05)),
               ("points per cell", dict(spacing=0.2, grid=0.25)), ("points per cell", dict(grid=0.4)),
               ("grains", dict(grains=50)), ("grains", dict(grains=200)), ("grains", dict(grains=400)),
               ("sub-steps", dict(substeps=5)), ("sub-steps", dict(substeps=20)),
               ("time step", dict(dt=2e-3)), ("time step", dict(dt=5e-4)), ("transfer", dict(transfer="apic")),
               ("transfer", dict(transfer="xpic 2")), ("transfer", dict(transfer="flip 0.99")),
               ("other packings", dict(first=101))]
    finest = dict(grid=0.1, spacing=0.05, grains=200)
    errors = {"peak": "largest stress until 3 % of strain, deviation, %",
              "curve": "stress from 0.2 % of strain on, rms of the deviation, % of the peak"}
    FILES, END, SPEED, PRESSURE = 47, 3.2, 0.01, 100.0

    def run(self, study, name, grains, dt, first=1, **variables):
        files = packings(study, self.FILES, grains, first)
        variables.update(dt=dt, seconds=self.END, every=round(0.02 / dt), packing=" ".join(file.name for file in files))
        run, seconds = spent(study, name, "in.biaxial", variables, ["biaxial"], files, grains=grains)
        strain = self.SPEED * np.array(run.table["Time"])
        stress = -np.array(run.table["top[2]"]) / 1e3 + self.PRESSURE
        at = np.arange(0.002, 0.0301, 0.001)  # means over 0.2 %: single avalanches are no difference of methods
        return seconds, np.array([stress[np.abs(strain - e) < 0.00101].mean() for e in at])

    def measure(self, study):
        found = {name: self.run(study, name, **settings) for name, settings in each(self)}
        _, reference = self.run(study, "reference", **{**self.base, **self.finest})
        peak = reference.max()
        return {name: (seconds, {"peak": 100 * abs(curve.max() / peak - 1),
                                 "curve": 100 * np.sqrt(np.mean((curve - reference) ** 2)) / peak})
                for name, (seconds, curve) in found.items()}


# ------------------------------------------------------------------------------------------------------------- the rest
CASES = {case.name: case for case in (Rod, Square, Biaxial)}
COLOURS = dict(zip(["grid", "points per cell", "grains", "sub-steps", "time step", "transfer", "other packings"],
                   ["#0072B2", "#56B4E9", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "0.5"]))


def label(change):
    return ", ".join(f"{key} {value}" for key, value in change.items())


def each(case):
    """(name, settings) of base and variants."""
    yield "base", case.base
    for _, change in case.changes:
        yield label(change).replace(" ", "_").replace(",", ""), {**case.base, **change}


def front(rows, error):
    """Those whose error no cheaper one comes within 2 % of."""
    beats = lambda a, b: a["seconds"] < b["seconds"] and a["errors"][error] < 1.02 * b["errors"][error]
    return [row for row in rows if not any(beats(other, row) for other in rows)]


def study_case(case):
    study = Study(case.name, FOLDER, False)
    found = case.measure(study)
    axes = [("base", label(case.base))] + [(axis, label(change)) for axis, change in case.changes]
    rows = [{"case": case.name, "axis": axis, "value": value, "seconds": seconds, "errors": errors}
            for (axis, value), (seconds, errors) in zip(axes, found.values())]
    for row in rows:
        row["front"] = [name for name in case.errors if row in front(rows, name)]
        print(f"  {case.name}: {row['axis']}: {row['value']}: {row['seconds']:.1f} s, "
              + ", ".join(f"{name} {value:.3g} %" for name, value in row["errors"].items()), flush=True)
    return rows


def write_table(rows):
    lines = []
    for name, case in CASES.items():
        here = [row for row in rows if row["case"] == name]
        if not here:
            continue
        lines += [f"| {name} | | processor s | " + " | ".join(f"{e}, %" for e in case.errors) + " |",
                  "| --- | --- | --- |" + " --- |" * len(case.errors)]
        for row in here:
            values = " | ".join(f"**{v:.2g}**" if e in row["front"] else f"{v:.2g}" for e, v in row["errors"].items())
            lines.append(f"| {row['axis']} | {row['value']} | {row['seconds']:.1f} | {values} |")
        lines.append("")
    (FOLDER / "table.md").write_text("\n".join(lines))


def draw_panel(axis, rows, error, title):
    """Errors above 50 % are left to the table."""
    base = rows[0]
    shown = [row for row in rows if row["errors"][error] < 50]
    for name, colour in COLOURS.items():
        some = [row for row in shown if row["axis"] == name]
        for row in some:
            at = row["seconds"], row["errors"][error]
            axis.plot([base["seconds"], at[0]], [base["errors"][error], at[1]], color=colour, lw=0.5, alpha=0.5)
            name_of = row["value"].split(", ")[0].removeprefix("transfer ").replace("first 101", "other packings")
            axis.annotate(name_of, at, fontsize=6, color=colour, xytext=(3, 3), textcoords="offset points", rotation=25)
        axis.plot([row["seconds"] for row in some], [row["errors"][error] for row in some], "o", color=colour, ms=5,
                  label=name)
    best = sorted(front(shown, error), key=lambda row: row["seconds"])
    axis.plot([row["seconds"] for row in best], [row["errors"][error] for row in best], "k--", lw=0.8,
              drawstyle="steps-post", label="Pareto front")
    axis.plot(base["seconds"], base["errors"][error], "k*", ms=11, label="base")
    axis.set(xscale="log", yscale="log")
    axis.set_title(title, fontsize=8)
    for ticks in (axis.xaxis, axis.yaxis):
        ticks.set_major_formatter("{x:g}")
        ticks.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "2346" else "")
        ticks.set_tick_params(which="both", labelsize=7)
    axis.grid(alpha=0.2, which="both")


def draw(rows):
    names = [name for name in CASES if any(row["case"] == name for row in rows)]
    figure, axes = plt.subplots(len(names), 2, figsize=(12, 4.2 * len(names)), squeeze=False)
    for line, name in zip(axes, names):
        for axis, (error, title) in zip(line, CASES[name].errors.items()):
            draw_panel(axis, [row for row in rows if row["case"] == name], error, f"{name}: {title}")
    for axis in axes[-1]:
        axis.set_xlabel("processor seconds")
    axes[-1, 0].legend(fontsize=7, frameon=False)
    figure.tight_layout()
    figure.savefig(FOLDER / "coupled_cost.png", dpi=90)
    plt.close(figure)


def main(names):
    unknown = set(names) - set(CASES)
    if unknown:
        raise SystemExit(f"coupled_cost: no such case: {', '.join(sorted(unknown))}; there are {', '.join(CASES)}")
    FOLDER.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in names or CASES:
        rows += study_case(CASES[name]())
        (FOLDER / "report.json").write_text(json.dumps(rows, indent=1))
        write_table(rows)
        draw(rows)
    print(f"{FOLDER / 'report.json'}: {len(rows)} runs, {sum(row['seconds'] for row in rows):.0f} processor seconds")


if __name__ == "__main__":
    main(sys.argv[1:])
