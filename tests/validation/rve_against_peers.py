#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Verification A8: isochoric biaxial shear of one packing in four codes: dempm, LIGGGHTS, LAMMPS, YADE. 20,000 steps (2 %)
are asked for; 40,000 are run.

   rve_against_peers.py [folder for its files]        from the root, after `make build/tools/rve_run`

Writes doc/images/rve_against_peers.png and prints the table of doc/validation.md. Codes that are not installed are left out.
Like is compared with like: LIGGGHTS and LAMMPS have dashpots, YADE has local damping; LIGGGHTS' grains in 2D are disks, those
of LAMMPS and YADE spheres in one layer. dempm runs each of these."""
import json
import pathlib
import shutil
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from peer_rve import ROOT, Packing, execute, generate, rve_run, settle  # noqa: E402

KN = KT = 1e6
MU, DT, RATE, STEPS, EVERY, LOCAL = 0.5, 2e-6, 0.5, 40000, 200, 0.2
GAMMA_N, GAMMA_T = 2.3e4, 1.15e4  # 1/s: 0.2 of critical
RHO = 2650.0
DISK_RHO = 14.1  # a disk 1 m long weighs what a sphere of 2650 kg/m3 does, on the average over the packing
GENERATE = {2: dict(grains=400, thickness=1.0, density=DISK_RHO, pressure=1e3),
            3: dict(grains=1000, dimension=3, density=RHO, pressure=1e5)}
LAW = dict(kn=KN, kt=KT, mu=MU)

COMMON = """
atom_modify map array
units si
dimension {dimension}
newton off
boundary p p p
{communicate} vel yes
read_data start.data
neighbor 4e-4 bin
neigh_modify delay 0 every 1 check yes {extra}
"""
LIGGGHTS = """
atom_style granular
{common}
fix kn all property/global kn peratomtypepair 1 {kn}
fix kt all property/global kt peratomtypepair 1 {kt}
fix gn all property/global gamman peratomtypepair 1 {gn}
fix gt all property/global gammat peratomtypepair 1 {gt}
fix mu all property/global coefficientFriction peratomtypepair 1 {mu}
pair_style gran model hooke/stiffness tangential history
{rest}
"""
LAMMPS = """
atom_style sphere
{common}
pair_style gran/hooke/history {kn} {kt} {gn} {gt} {mu} 1
{rest}
"""
REST = """
pair_coeff * *
timestep {dt}
fix move all nve/sphere
fix shear all deform 1 x trate -{rate} y trate {rate} remap v {units}
{flat}
compute stress all pressure {temperature} {pair}
thermo_style custom step c_stress[1] c_stress[2] {third}
thermo {every}
thermo_modify norm no format float %.12g
run {steps}
"""


def md_rows(program, script, packing, folder, density, extra, common, rest):
    flat = packing.dimension == 2
    (folder / "start.data").write_text(packing.data(density, rate=(-RATE, RATE, 0.0), height=0.05))
    common = COMMON.format(dimension=packing.dimension, extra=extra, **common)
    rest = REST.format(dt=DT, rate=RATE, every=EVERY, steps=STEPS, flat="fix flat all enforce2d" if flat else "",
                       third="" if flat else "c_stress[3]", **rest)
    text = script.format(common=common, rest=rest, gn=GAMMA_N, gt=GAMMA_T, **LAW)
    (folder / "in.script").write_text(text)
    code, output = execute([program, "-in", "in.script", "-log", "none"], cwd=folder)
    assert code == 0, output[-3000:]
    rows = []
    for line in output.splitlines():
        words = line.split()
        if len(words) == (3 if flat else 4) and words[0].isdigit():
            rows.append([-float(word) for word in words[1:3]])
    assert len(rows) == STEPS // EVERY + 1, output[-3000:]
    return np.array(rows)


def liggghts(packing, folder, extra="contact_distance_factor 1.01"):
    density = DISK_RHO if packing.dimension == 2 else RHO
    return md_rows("liggghts", LIGGGHTS, packing, folder, density, extra, dict(communicate="communicate single"),
                   dict(units="units box", temperature="thermo_temp", pair="virial"))


def lammps(packing, folder):
    return md_rows("lmp", LAMMPS, packing, folder, RHO, "", dict(communicate="comm_modify"),
                   dict(units="flip no", temperature="NULL", pair="pair"))


def yade(packing, folder):
    case = dict(dimension=packing.dimension, edge=[*packing.edge[:2], 0.05 if packing.dimension == 2 else packing.edge[2]],
                position=packing.position, radius=packing.radius, density=RHO, rate=RATE, dt=DT, steps=STEPS, every=EVERY,
                local=LOCAL, **LAW)
    (folder / "case.json").write_text(json.dumps(case))
    script = pathlib.Path(__file__).with_name("yade_rve.py")
    code, output = execute(["env", f"CASE={folder}/case.json", "yade", "-j1", "-n", "-x", script], cwd=folder)
    rows = [[-float(word) for word in line.split()[2:4]] for line in output.splitlines() if line.startswith("ROW")]
    assert len(rows) == STEPS // EVERY + 1, output[-3000:]
    return np.array(rows)


def dempm(packing, folder, grain, **damping):
    density = DISK_RHO if grain == "disk" else RHO
    (folder / "start.data").write_text(packing.data(density, height=0.05))
    gradient = [-RATE, 0, 0, 0, RATE, 0, 0, 0, 0]
    found, stable, last = rve_run(folder / "start.data", packing.dimension, grain=grain, thickness=1.0, density=density, dt=DT,
                                  steps=STEPS, every=EVERY, L=gradient, **LAW, **damping)
    assert stable, last
    return np.array([found["sxx"], found["syy"]]).T


VISCOUS, CUNDALL = dict(gamman=GAMMA_N, gammat=GAMMA_T), dict(local=LOCAL)


def curves(dimension, folder):
    """{name: (rows of another code, rows of dempm with the same grains and damping)}, tension positive."""
    generate(folder / "grains", radius=(0.0025, 0.005), kn=KN, kt=KT, preparation_friction=0, **GENERATE[dimension])
    packing = Packing(folder / "grains")
    print("unbalanced, coordination after settling:", *settle(packing, folder, GENERATE[dimension]["density"], 40000, kn=KN))
    round_grain = "disk" if dimension == 2 else "sphere"
    result = {}
    if shutil.which("liggghts"):
        ours = dempm(packing, folder, round_grain, **VISCOUS)
        result["LIGGGHTS"] = liggghts(packing, folder), ours
        result["LIGGGHTS, springs kept"] = liggghts(packing, folder, extra=""), ours
        moved = liggghts(packing.shifted(0.137), folder)
        result["LIGGGHTS, packing moved"] = moved, result["LIGGGHTS"][0]
    if shutil.which("lmp"):
        result["LAMMPS"] = lammps(packing, folder), dempm(packing, folder, "sphere", **VISCOUS)
    if shutil.which("yade"):
        result["YADE"] = yade(packing, folder), dempm(packing, folder, "sphere", **CUNDALL)
    result["dempm, local damping"] = dempm(packing, folder, round_grain, **CUNDALL), dempm(packing, folder, round_grain, **VISCOUS)
    return result


def deviations(theirs, ours, steps):
    """Mean and largest |difference| over the largest stress, up to a step."""
    rows = slice(1, steps // EVERY + 1)
    apart = np.abs(theirs - ours)[rows] / np.abs(ours[rows]).max()
    return apart.mean(), apart.max()


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    figure, panels = plt.subplots(1, 2, figsize=(10, 4.2))
    for panel, dimension in zip(panels, (2, 3)):
        strain = 100 * RATE * DT * np.arange(0, STEPS + 1, EVERY)
        colours = {"LIGGGHTS": "C0", "LAMMPS": "C1", "YADE": "C2"}
        for name, (theirs, ours) in curves(dimension, folder).items():
            found = [part for steps in (10000, 20000, STEPS) for part in deviations(theirs, ours, steps)]
            print(f"{dimension}D {name:24s} mean and largest difference in 10,000, 20,000 and all steps:",
                  *(f"{part:.2%}" for part in found), flush=True)
            if name not in colours:
                continue
            for column, part in enumerate(("xx", "yy")):
                panel.plot(strain[1:], -theirs[1:, column] / 1e3, colours[name], lw=2.5, alpha=0.45,
                           label=name if column == 0 else None)
                panel.plot(strain[1:], -ours[1:, column] / 1e3, colours[name], ls="--", lw=1.0,
                           label=f"dempm, set as {name}" if column == 0 else None)
        panel.set_xlabel("strain [%]")
        panel.set_ylabel(r"$-\sigma_{xx}$ (upper), $-\sigma_{yy}$ (lower) " + ("[kN/m]" if dimension == 2 else "[kPa]"))
        panel.set_title(f"{dimension}D, {400 if dimension == 2 else 1000} grains", fontsize=10)
        panel.legend(fontsize=7)
        panel.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(ROOT / "doc" / "images" / "rve_against_peers.png", dpi=110)


if __name__ == "__main__":
    main()
