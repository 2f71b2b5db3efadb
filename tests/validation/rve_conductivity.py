#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Conductivity of packings by an RVE (affine and network) against full DEM in its steady state, and against published
correlations of packed beds.

   rve_conductivity.py [folder for its files]        from the root

Full DEM: copies of the same periodic packing in a row, LIGGGHTS particles, fix heat/gran/grain with the same model, fix heat/rest for the
steady state. The particles at both ends have the temperatures of a uniform gradient for ever; the others find theirs. The conductivity follows from the
heat that enters and leaves through the ends and from the rise of temperature from one copy to the next in the middle.

Writes doc/images/rve_conductivity.png and rows of build/validate/report.json, prints the tables of doc/validation.md; ends with 1 if a
bound is missed."""
import csv
import math
import pathlib
import sys
import tempfile
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from peer_rve import BUILD, ROOT, Packing, execute, generate, settle  # noqa: E402
from report import Report  # noqa: E402

GRAINS, RADII, DENSITY, KN, SOLID = 400, (0.004, 0.005), 2650.0, 1e5, 1.4  # SOLID: conductivity, W/(m K)
COPIES, ENDS = 4, 3.0  # in a row; thickness of either end in the largest radii
STEADY = 1e-6
GAS = 0.026
# Pressure, preparation friction
PACKINGS = [(3e3, 0.01), (3e4, 0.01), (3e5, 0.01), (3e4, 0.5), (1e5, 0.5), (3e5, 0.5)]
MODELS = {
    "batchelor": dict(direct="batchelor"),
    "batchelor, hertz": dict(direct="batchelor", area="hertz"),
    "liggghts": dict(direct="liggghts"),
    "pipe": dict(direct="pipe"),
    "voronoi_b": dict(direct="none", indirect="voronoi_b", fluid=GAS),
    "layer": dict(direct="none", indirect="layer", fluid=GAS, layer=0.2, minimum_gap=1e-6),
    "batchelor + voronoi_a": dict(direct="batchelor", indirect="voronoi_a", fluid=GAS),
}

SCRIPT = """
atom_style granular
atom_modify map array
units si
dimension {dimension}
newton off
communicate single vel yes
boundary f p p
read_data row.data
neighbor {skin} bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 5e6 5e6
fix m2 all property/global poissonsRatio peratomtype 0.3 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.5 0.5 0.5 0.5
fix m4 all property/global coefficientFriction peratomtypepair 2 0.5 0.5 0.5 0.5
fix k all property/global thermalConductivity peratomtype {solid} {solid}
fix c all property/global thermalCapacity peratomtype 1 0
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-6
fix heat all heat/gran/grain initial_temperature 300 {words}
run 0
{temperatures}
fix rest all heat/rest solver steady
dump end all custom 1 end.dump id type x f_Temp[0] f_heatFlux[0]
dump_modify end sort id format "%d %d %.17g %.17g %.17g"
run 1
"""


def words_of(model):
    return " ".join(f"{key} {value}" for key, value in model.items())


# ---------------------------------------------------------------------------------------------------------- the RVE
def rve(data, dimension, folder, model, **settings):
    """The first line of dempm-rve's answer: the packing as it is."""
    path = folder / "still.csv"
    path.write_text("time,Lxx\n0,0\n1e-12,0\n")
    sets = dict(kn=KN, kt=0, density=DENSITY, expansion=0, Tref=300, grain_conductivity=SOLID, conductivity="network", **model,
                **settings)
    if dimension == 2:
        sets["thickness"] = 1.0
    words = [word for key, value in sets.items() for word in ("--set", f"{key}={value}")]
    code, output = execute([BUILD / "dempm-rve", "run", data, "--path", path, "--dimension", dimension, "--out", folder / "rve.csv",
                            *words])
    assert code == 0, output
    with open(folder / "rve.csv") as file:
        return {name: float(value) for name, value in next(csv.DictReader(file)).items()}


# ---------------------------------------------------------------------------------------------------------- full DEM
def row_of_copies(packing, dimension):
    """(text of a data file, x of the particles, which of them are ends)"""
    edge, largest = packing.edge, max(packing.radius)
    length = COPIES * edge[0]
    places = [[place[0] + copy * edge[0], place[1], place[2]] for copy in range(COPIES) for place in packing.position]
    radii = packing.radius * COPIES
    ends = [not ENDS * largest < place[0] < length - ENDS * largest for place in places]
    bounds = [(-largest, length + largest), (0.0, edge[1]), (0.0, edge[2]) if dimension == 3 else (-largest, largest)]
    text = ["copies of a periodic packing", "", f"{len(places)} atoms", "2 atom types", ""]
    text += [f"{low!r} {high!r} {axis}lo {axis}hi" for axis, (low, high) in zip("xyz", bounds)]
    text += ["", "Atoms", ""]
    for i, (place, radius, end) in enumerate(zip(places, radii, ends)):
        # All of the same mass, so that the small ones do not shorten the time step; LIGGGHTS has disks 1 m long in 2D.
        volume = 4 / 3 * math.pi * radius ** 3 if dimension == 3 else math.pi * radius ** 2
        text.append(f"{i + 1} {2 if end else 1} {2 * radius!r} {1.0 / volume!r} " + " ".join(repr(x) for x in place))
    return "\n".join(text) + "\n", np.array([place[0] for place in places]), np.array(ends)


def full_dem(packing, dimension, folder, model):
    """(conductivity W/(m K), mean heat that a particle still takes over the mean that flows through one)"""
    text, x, _ = row_of_copies(packing, dimension)
    (folder / "row.data").write_text(text)
    edge, largest, grains = packing.edge, max(packing.radius), len(packing.radius)
    section = edge[1] * (edge[2] if dimension == 3 else 1.0)
    branch = 2 * sum(packing.radius) / grains
    slope = 10.0 / edge[0]
    temperatures = "\n".join(f"set atom {i + 1} property/atom Temp {300 + slope * at!r}" for i, at in enumerate(x))
    script = SCRIPT.format(dimension=dimension, skin=0.9 * largest, solid=SOLID, words=words_of(model), temperatures=temperatures)
    (folder / "in.script").write_text(script)
    code, output = execute([BUILD / "dempm", "-in", "in.script", "-log", "none"], cwd=folder)
    assert code == 0, output[-3000:]
    lines = (folder / "end.dump").read_text().splitlines()
    last = len(lines) - 1 - lines[::-1].index(next(line for line in reversed(lines) if line.startswith("ITEM: ATOMS")))
    rows = np.array([[float(word) for word in line.split()] for line in lines[last + 1:]])
    kind, at, temperature, flux = rows[:, 1], rows[:, 2], rows[:, 3], rows[:, 4]
    hot = -flux[(kind == 2) & (at > COPIES * edge[0] / 2)].sum()
    cold = flux[(kind == 2) & (at < COPIES * edge[0] / 2)].sum()
    by_copy = temperature.reshape(COPIES, grains)
    rise = (by_copy[COPIES // 2] - by_copy[COPIES // 2 - 1]).mean()
    through = 0.5 * (hot + cold)
    unsteady = np.abs(flux[kind == 1]).mean() * grains * branch / (through * edge[0])
    return through * edge[0] / (section * rise), unsteady


# ------------------------------------------------------------------------------------------------------ correlations
def mean_field(solid_fraction, coordination, contact_radius, radius):
    """Isotropic packing of equal spheres, affine temperatures, h = 2 k a: k phi Z a / (pi R) (after Batchelor and O'Brien 1977)."""
    return SOLID * solid_fraction * coordination * contact_radius / (math.pi * radius)


def zehner_schluender(ratio, porosity):
    """k / k_fluid of a bed of spheres in point contact; ratio k_solid / k_fluid (Zehner and Schluender 1970)."""
    b = 1.25 * ((1 - porosity) / porosity) ** (10 / 9)
    n = 1 - b / ratio
    core = 2 / n * (b * (1 - 1 / ratio) / n ** 2 * np.log(ratio / b) - (b + 1) / 2 - (b - 1) / n)
    return 1 - np.sqrt(1 - porosity) + np.sqrt(1 - porosity) * core


def batchelor_obrien(ratio):
    """k / k_fluid of a random close packing in point contact, ratio >> 1 (Batchelor and O'Brien 1977)."""
    return 4.0 * np.log(ratio) - 11.0


# -------------------------------------------------------------------------------------------------------------- main
def make(folder, dimension, pressure, friction):
    """A packing in an orthogonal cell, and its data file. Dense ones come to rest in it; loose ones, which would give way without the
    tangential forces of their making, stay as they are: both sides see the same grains, in equilibrium or not."""
    name = folder / f"grains_{dimension}_{pressure:g}_{100 * friction:g}"
    flat = dict(thickness=1.0) if dimension == 2 else {}
    if not name.exists():
        generate(name, grains=GRAINS, dimension=dimension, radius=RADII, density=DENSITY, kn=KN, kt=KN, pressure=pressure,
                 preparation_friction=friction, **flat)
    packing = Packing(name)
    if friction < 0.1:
        settle(packing, folder, DENSITY, 20000, kn=KN, kt=KN, mu=friction)
    data = folder / f"{name.name}.data"
    data.write_text(packing.data(DENSITY, height=0.02))
    return packing, data


def compare(folder, dimension, packing, data, model):
    """Both answers for one packing and model."""
    found = rve(data, dimension, folder, model)
    exact, unsteady = full_dem(packing, dimension, folder, model)
    row = {**found, "dem": exact, "unsteady": unsteady, "network": found["Kxx"] / exact - 1, "affine": found["Kaffine_xx"] / exact - 1}
    print(f"  full DEM {exact:.5g} W/(m K) (unsteady {unsteady:.1e}), network {row['network']:+.3%}, affine {row['affine']:+.1%}; "
          f"solid fraction {found['solid_fraction']:.4f}, coordination {found['coordination']:.3f}", flush=True)
    return row


def compare_packings(folder, report):
    """Direct conduction over pressure and preparation."""
    rows = []
    for pressure, friction in PACKINGS:
        start = time.monotonic()
        packing, data = make(folder, 3, pressure, friction)
        print(f"pressure {pressure:g}, preparation friction {friction:g}", flush=True)
        row = compare(folder, 3, packing, data, MODELS["batchelor"])
        rows.append({**row, "pressure": pressure, "friction": friction})
        report.check(f"network against full DEM, batchelor, {pressure:g} Pa, friction {friction:g}", abs(row["network"]), 1e-3,
                     seconds=time.monotonic() - start)
        report.check(f"unsteadiness of full DEM, {pressure:g} Pa, friction {friction:g}", row["unsteady"], STEADY)
        assert row["affine"] > row["network"], "the affine sum is an upper bound"
    return rows


def compare_models(folder, report, dimension, pressure):
    packing, data = make(folder, dimension, pressure, 0.5)
    for model, words in MODELS.items():
        start, name = time.monotonic(), f"{model}, {dimension}D"
        print(name, flush=True)
        row = compare(folder, dimension, packing, data, words)
        report.check(f"network against full DEM, {name}", abs(row["network"]), 1e-3, seconds=time.monotonic() - start)
        report.check(f"unsteadiness of full DEM, {name}", row["unsteady"], STEADY)
        report.check(f"affine sum above full DEM, {name}", row["affine"], None)
        assert row["affine"] > row["network"], "the affine sum is an upper bound"


# ------------------------------------------------------------------------------------------------------------ figure
def draw_packings(panel, rows):
    for friction, colour in ((0.01, "C0"), (0.5, "C1")):
        mine = [row for row in rows if row["friction"] == friction]
        pressure = [row["pressure"] for row in mine]
        preparation = f"friction {friction:g}"
        panel.plot(pressure, [row["dem"] / SOLID for row in mine], "o", color=colour, label=f"full DEM, {preparation}")
        panel.plot(pressure, [row["Kxx"] / SOLID for row in mine], "-", color=colour, label="RVE, network")
        panel.plot(pressure, [row["Kaffine_xx"] / SOLID for row in mine], "--", color=colour, label="RVE, affine")
        radius = sum(RADII) / 2
        # The mean contact radius belongs to the mean overlap of equal spheres under this pressure.
        field = [mean_field(row["solid_fraction"], row["coordination"], math.sqrt(radius * mean_overlap(row)), radius) / SOLID
                 for row in mine]
        panel.plot(pressure, field, ":", color=colour, label="mean field (Batchelor, O'Brien)")
    panel.set(xscale="log", yscale="log", xlabel="pressure [Pa]", ylabel="conductivity / that of the grains",
              title="contacts alone (batchelor)")


def mean_overlap(row):
    """p = phi Z kn overlap / (4 pi R^2) for equal spheres and central forces (Rumpf), with b = 2R."""
    radius = sum(RADII) / 2
    pressure = -(row["sxx"] + row["syy"] + row["szz"]) / 3
    return pressure * 4 * math.pi * radius ** 2 / (row["solid_fraction"] * row["coordination"] * KN)


def draw_beds(panel, folder):
    packing, data = make(folder, 3, 3e3, 0.01)
    ratios = np.logspace(1, 5, 9)
    porosity = 0.0
    for indirect, line in (("voronoi_a", "s-"), ("voronoi_b", "o-")):
        found = []
        for ratio in ratios:
            row = rve(data, 3, folder, dict(direct="batchelor", indirect=indirect, fluid=SOLID / ratio))
            porosity = 1 - row["solid_fraction"]
            found.append(row["Kxx"] * ratio / SOLID)
        print(f"{indirect}: k / k_fluid", *(f"{ratio:.3g}: {k:.4g}" for ratio, k in zip(ratios, found)))
        panel.plot(ratios, found, line, ms=4, label=f"RVE, batchelor + {indirect}")
    fine = np.logspace(1, 5, 100)
    zehner = zehner_schluender(fine, porosity)
    print("Zehner, Schluender:", *(f"{ratio:.3g}: {zehner_schluender(ratio, porosity):.4g}" for ratio in ratios))
    print("Batchelor, O'Brien:", *(f"{ratio:.3g}: {batchelor_obrien(ratio):.4g}" for ratio in ratios[ratios > 300]))
    panel.plot(fine, zehner, "k--", label=f"Zehner, Schluender 1970, porosity {porosity:.2f}")
    panel.plot(fine[fine > 300], batchelor_obrien(fine[fine > 300]), "k:", label="Batchelor, O'Brien 1977")
    panel.set(xscale="log", yscale="log", xlabel="conductivity of the grains / of the fluid",
              ylabel="conductivity / that of the fluid", title="bed of spheres that just touch, in a fluid")


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    report = Report("rve_conductivity")
    figure, panels = plt.subplots(1, 2, figsize=(10, 4.2))
    draw_packings(panels[0], compare_packings(folder, report))
    draw_beds(panels[1], folder)
    for panel in panels:
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(ROOT / "doc" / "images" / "rve_conductivity.png", dpi=100)
    compare_models(folder, report, 3, 1e5)
    compare_models(folder, report, 2, 1e3)
    return report.write()


if __name__ == "__main__":
    sys.exit(main())
