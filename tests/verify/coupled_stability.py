#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""How far the method can be driven: time step against PIC fraction, shear to gamma = 10, a settled column for many
steps. The section "Stability" of doc/verification.md.

   coupled_stability.py [map] [shear] [column]     from the root, after `make programs build/tools/mpm_stability`

Writes build/coupled_stability/*.json, mpm_stability.png and long_runs.png. COLUMN_STEPS=100000 shortens the column."""
import json
import os
import re
import resource
import subprocess
import sys
import time

import numpy as np
from study import BUILD, Study, plt

from conftest import environment, parse_thermo

FOLDER = BUILD / "coupled_stability"
MAPS = [("gimp", "usf"), ("gimp", "usl"), ("gimp", "musl"), ("linear", "usf"), ("bspline", "usf")]
LIMIT = {("gimp", "usl"): 0.25, ("linear", "usf"): 0.45}  # what timestep/check allows, of h / (c + v); others 0.5
GRAINS = dict(radius=(0.0025, 0.005), density=2650, kn=1e6, kt=1e6, thickness=0.075)
STEPS = int(os.environ.get("COLUMN_STEPS", 1000000))

HEAD = """dimension 2
units si
atom_style granular
atom_modify map array
newton off
communicate single vel yes
processors 1 1 1
neighbor 0.05 bin
"""
MATERIAL = """
fix kn all property/global kn peratomtypepair 1 1e6
fix kt all property/global kt peratomtypepair 1 1e6
fix mu all property/global coefficientFriction peratomtypepair 1 0.5
"""
# A layer between two rough plates, periodic along x. The plates touch the points' outermost faces and do not approach.
SHEAR = HEAD + """boundary p f p
region box block 0 0.8 -0.2 0.6 -0.025 0.025 units box
create_box 1 box
timestep 1e-3
lattice sq 0.1 origin 0.5 0.5 0
region layer block 0 0.8 0 0.4 -0.025 0.025 units box
create_atoms 1 region layer
""" + MATERIAL + """
fix rve all mpm/rve packing dense.packing model hooke/stiffness tangential history grain disk thickness 0.075 &
  density 2650 damping local 0.2 substeps 10
fix mpm all mpm/couple grid 0.2 shape gimp transfer flip 0.99 material rve rve
fix low all mpm/wall mpm plane y 0 noslip side +
fix top all mpm/wall mpm plane y 0.4 noslip velocity 0.4 0 0 side -
compute sxx all reduce ave f_mpm[1]
compute syy all reduce ave f_mpm[2]
compute sxy all reduce ave f_mpm[4]
compute gamma all reduce ave f_mpm[22]
compute most all reduce max f_mpm[22]
compute least all reduce min f_mpm[22]
compute ratio all reduce ave f_mpm[11]
compute fraction all reduce ave f_mpm[15]
thermo_style custom step time c_gamma c_least c_most c_sxx c_syy c_sxy c_ratio c_fraction f_mpm[11]
thermo_modify norm no format float %.9g
thermo 50
run 10000
"""
COLUMN = HEAD + """boundary f f p
region box block -0.2 0.6 -0.2 1.2 -0.025 0.025 units box
create_box 1 box
timestep 1e-4
lattice sq 0.1 origin 0.5 0.5 0
region column block 0 0.2 0 0.8 -0.025 0.025 units box
create_atoms 1 region column
""" + MATERIAL + """
fix rve all mpm/rve packing small.packing model hooke/stiffness tangential history grain disk thickness 0.075 &
  density 2650 damping viscous 0.2 rest {rest}
fix mpm all mpm/couple grid 0.2 shape gimp transfer flip 0.99 material rve rve damping/point 20
fix g all gravity 9.81 vector 0 -1 0
fix floor all mpm/wall mpm plane y 0 friction 0.5 side +
fix left all mpm/wall mpm plane x 0 slip side +
fix right all mpm/wall mpm plane x 0.2 slip side -
compute top all reduce max y
compute mean all reduce ave y
thermo_style custom step c_top c_mean f_mpm[5] f_mpm[7] f_mpm[9] f_mpm[10] f_mpm[12] f_floor[2]
thermo_modify norm no format float %.12g
thermo 1000
run 30000
fix_modify mpm damping/point 0
thermo {every}
run {steps}
"""


def write(name, data):
    (FOLDER / f"{name}.json").write_text(json.dumps(data, indent=1))
    return data


def script_run(name, text, packing):
    """A script in a folder of its own: (thermo tables, processor seconds, [(wall seconds, VmRSS in kB)])."""
    path = FOLDER / name
    path.mkdir(parents=True, exist_ok=True)
    (path / "in.script").write_text(text)
    (path / packing.name).write_bytes(packing.read_bytes())
    before, start, memory = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic(), []
    with open(path / "screen", "w") as screen:
        process = subprocess.Popen([str(BUILD / "dempm"), "-in", "in.script"], cwd=path, env=environment(1),
                                   stdout=screen, stdin=subprocess.DEVNULL, stderr=subprocess.STDOUT)
        while process.poll() is None:
            try:
                status = open(f"/proc/{process.pid}/status").read()
                memory.append((time.monotonic() - start, int(re.search(r"VmRSS:\s+(\d+)", status)[1])))
            except (OSError, TypeError):
                pass
            time.sleep(0.5)
    if process.returncode:
        raise RuntimeError(f"{name} ended with {process.returncode}: {(path / 'screen').read_text()[-600:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return parse_thermo((path / "log.liggghts").read_text()), seconds, memory


# ------------------------------------------------------------------------------------------------------------------ map
def make_map():
    found = {}
    for shape, order in MAPS:
        answer = subprocess.run([str(BUILD / "tools" / "mpm_stability"), shape, order], check=True, text=True,
                                capture_output=True).stdout
        rows = np.array([line.split(",") for line in answer.splitlines()[1:]], float)
        found[shape, order] = rows
        for fraction in (0.0, 0.01, 0.1, 1.0):
            some = rows[np.isclose(rows[:, 1], fraction)]
            bad = some[some[:, 2] > 1.5, 0]
            print(f"  {shape} {order}: PIC {fraction:g}: growth by less than half in 1,000 steps below Courant number "
                  f"{bad.min() if len(bad) else np.inf:.1f}", flush=True)
    write("map", [{"shape": s, "order": o, "courant_pic_largest_last": np.nan_to_num(r, posinf=1e300).tolist()}
                  for (s, o), r in found.items()])
    figure, axes = plt.subplots(1, len(MAPS), figsize=(15, 3.6), sharey=True)
    for axis, (case, rows) in zip(axes, found.items()):
        courant, pic = np.unique(rows[:, 0]), np.unique(rows[:, 1])
        largest = np.clip(rows[:, 2].reshape(len(courant), len(pic)), 1, 1e6)
        edges = np.append(courant - 0.05, courant[-1] + 0.05)
        shown = axis.pcolormesh(np.arange(len(pic) + 1) - 0.5, edges, np.log10(largest), cmap="magma_r", vmin=0,
                                vmax=6)
        axis.axhline(LIMIT.get(case, 0.5), color="C0", lw=1.2)
        axis.set_xticks(range(0, len(pic), 2), [f"{p:g}" for p in pic[::2]], fontsize=7)
        axis.set(title=f"{case[0]}, {case[1].upper()}", xlabel="PIC fraction")
    axes[0].set_ylabel("dt (c + v) / h")
    figure.colorbar(shown, ax=axes, label="growth of energy, decades", fraction=0.02, pad=0.01)
    figure.savefig(FOLDER / "mpm_stability.png", dpi=90, bbox_inches="tight")
    plt.close(figure)


# ---------------------------------------------------------------------------------------------------------------- shear
def make_shear():
    study = Study("shear", FOLDER, False)
    dense = study.pack("dense", pressure=1e5, preparation_friction=0.01, grains=200, **GRAINS)
    law = dict(kn=1e6, kt=1e6, mu=0.5, density=2650, thickness=0.075, damping__local=0.2, rate=0.8, strain=10)
    curves = {}
    for name, more in (("packing, 100 kPa held", dict(pressure=1e5)), ("packing, constant volume", {})):
        answer = study.element(name.split(", ")[1].replace(" ", "_"), dense, "simple-shear", **law, **more)
        curves[name] = [answer["Fxy"], -0.5 * (answer["sxx"] + answer["syy"]), answer["sxy"], answer["solid_fraction"]]
    tables, seconds, _ = script_run("layer", SHEAR, dense)
    table = {name: np.array(values) for name, values in tables[-1].items()}
    pressure = -0.5 * (table["sxx"] + table["syy"])
    curves["layer of 32 points"] = [table["gamma"], pressure, table["sxy"], table["fraction"]]
    result = {"layer_seconds": seconds, "layer_gamma": [table[c][-1] for c in ("least", "gamma", "most")],
              "layer_volume_ratio": table["ratio"][-1]}
    for name, (gamma, pressure, shear, fraction) in curves.items():
        late = gamma > 1
        result[name] = {"gamma": gamma[-1], "lines": int(late.sum()),
                        **{key: [v[late].mean(), v[late].min(), v[late].max(), v[gamma > 9].mean()] for key, v in
                           (("pressure", pressure), ("ratio", shear / pressure), ("fraction", fraction))}}
    print(json.dumps(write("shear", result), indent=1), flush=True)
    return curves


# --------------------------------------------------------------------------------------------------------------- column
def make_column():
    """With packings at rest left out, and with all of them run."""
    study = Study("column", FOLDER, False)
    small = study.pack("small", pressure=1e4, preparation_friction=0.5, grains=32, **GRAINS)
    found, results = {}, {}
    for rest in ("1e-3", "no"):
        name = f"column_rest_{rest}"
        script = COLUMN.format(rest=rest, steps=STEPS, every=max(STEPS // 200, 1))
        tables, seconds, memory = script_run(name, script, small)
        table = {column: np.array(values) for column, values in tables[-1].items()}
        shown = {"top": "top", "mean_height": "mean", "elastic_energy": "mpm[7]", "kinetic_energy": "mpm[5]",
                 "floor_force": "floor[2]", "friction_heat": "mpm[9]"}
        first_middle_last_least_most = lambda v: [v[0], v[len(v) // 2], v[-1], v.min(), v.max()]
        summary = {name: first_middle_last_least_most(table[key]) for name, key in shown.items()}
        late = [kilobytes for _, kilobytes in memory[len(memory) // 10:]]
        results[rest] = {"steps": STEPS, "seconds": seconds, "memory_kB": [late[0], late[-1], max(late)],
                         "particle_steps": table["mpm[12]"][-1] - table["mpm[12]"][0], "memory_readings": len(late),
                         **summary}
        found[rest] = table, memory
    print(json.dumps(write("column", results), indent=1), flush=True)
    return found


def draw(curves, column):
    figure, axes = plt.subplots(2, 3, figsize=(13, 6.5))
    for name, (gamma, pressure, shear, fraction) in curves.items():
        axes[0, 0].plot(gamma, shear / pressure, lw=0.8, label=name)
        axes[0, 1].plot(gamma, pressure / 1e3, lw=0.8)
        axes[0, 2].plot(gamma, fraction, lw=0.8)
    for axis, title in zip(axes[0], ("shear stress / pressure", "pressure, kPa", "solid fraction")):
        axis.set(title=title, xlabel="shear strain")
    axes[0, 1].set_yscale("log")
    axes[0, 0].legend(fontsize=7, frameon=False)
    for rest, (table, memory) in column.items():
        steps = (table["Step"] - table["Step"][0]) / 1e3
        axes[1, 0].plot(steps, 1e6 * (table["mean"] / table["mean"][0] - 1), lw=0.8, label=f"rest {rest}")
        axes[1, 1].plot(steps, 1e3 * (table["mpm[7]"] / table["mpm[7]"][0] - 1), lw=0.8)
        axes[1, 2].plot(np.linspace(0, steps[-1], len(memory)), [kilobytes / 1024 for _, kilobytes in memory], lw=0.8)
    for axis, title in zip(axes[1], ("settled column: change of mean height, 1e-6", "change of elastic energy, 1e-3",
                                     "resident memory, MB")):
        axis.set(title=title, xlabel="thousand steps")
    axes[1, 0].legend(fontsize=7, frameon=False)
    axes[1, 2].set_ylim(0, None)
    figure.tight_layout()
    figure.savefig(FOLDER / "long_runs.png", dpi=90)
    plt.close(figure)


def main(parts):
    parts = parts or ["map", "shear", "column"]
    unknown = set(parts) - {"map", "shear", "column"}
    if unknown:
        raise SystemExit(f"coupled_stability: no such part: {', '.join(sorted(unknown))}; there are map, shear, column")
    FOLDER.mkdir(parents=True, exist_ok=True)
    if "map" in parts:
        make_map()
    curves = make_shear() if "shear" in parts else None
    column = make_column() if "column" in parts else None
    if curves and column:
        draw(curves, column)


if __name__ == "__main__":
    main(sys.argv[1:])
