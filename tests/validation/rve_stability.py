#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Stability maps of one RVE, stress tests of verification A3, A7 and A9: time step x shear rate x damping; elongated cells.

   rve_stability.py        from the root, after `make build/tools/rve_run`; writes doc/images/rve_stability.png

Top row: simple shear to gamma = 0.5; kinetic over elastic energy in the mean over the second half. A cross: the RVE reported that
it is unstable. Bottom row: the same in 3D; cells of one tile of 64 grains, repeated along x, must answer
as the tile alone; isochoric stretching makes a square cell a strip, until it is too narrow or 20 times as long as wide."""
import pathlib
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from peer_rve import BUILD, ROOT, execute, generate, rve_run  # noqa: E402

RADII, RHO, PRESSURE, GAMMA, POINTS = (0.0025, 0.005), 2650.0, 1e5, 0.5, 100
LAW = dict(density=RHO, kn=1e6, kt=1e6)
FRACTIONS = np.array([0.1, 0.25, 0.5, 0.75, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5])
NUMBERS = [1e-3, 1e-2, 1e-1, 1.0]
DAMPING = {"undamped": {}, "local 0.3": dict(local=0.3), "local 0.7": dict(local=0.7), "viscous 0.2": dict(viscous=0.2)}


def law(dimension):
    return {**LAW, **(dict(thickness=0.075) if dimension == 2 else {})}


def critical_step(packing, dimension, damping):
    words = [str(word) for item in {**law(dimension), **damping, "mu": 0.5, "steps": 0}.items() for word in item]
    return float(execute([BUILD / "tools" / "rve_run", packing, dimension, *words])[1].splitlines()[0].split()[6])


def kinetic_map(packing, dimension, damping, numbers):
    """log10 of kinetic over elastic energy [number][fraction]; NaN: reported as unstable"""
    critical, rows = critical_step(packing, dimension, damping), []
    for number in numbers:
        rate = number / (sum(RADII) * np.sqrt(RHO / PRESSURE))
        row = []
        for fraction in FRACTIONS:
            steps = max(POINTS, int(GAMMA / rate / (fraction * critical)))
            found, stable, _ = rve_run(packing, dimension, mu=0.5, dt=fraction * critical, steps=steps, every=steps // POINTS,
                                       L=[0, rate, 0, 0, 0, 0, 0, 0, 0], **law(dimension), **damping)
            half = len(found["kinetic"]) // 2
            row.append(np.mean(found["kinetic"][half:]) / np.mean(found["elastic"][half:]) if stable else np.nan)
        rows.append(np.log10(row))
    return np.array(rows)


def show_map(panel, values, numbers, title):
    colours = plt.get_cmap("viridis").copy()
    colours.set_bad("lightgrey")
    image = panel.imshow(values, origin="lower", aspect="auto", cmap=colours, vmin=-5, vmax=1)
    for row, column in zip(*np.nonzero(np.isnan(values))):
        panel.plot(column, row, "rx", ms=6)
    panel.axvline(FRACTIONS.tolist().index(1.0) + 0.5, color="w", lw=1.2, ls=":")
    panel.set_xticks(range(0, len(FRACTIONS), 2), [f"{x:g}" for x in FRACTIONS[::2]], fontsize=8)
    panel.set_yticks(range(len(numbers)), [f"{number:g}" for number in numbers])
    panel.set_xlabel("time step / critical one")
    panel.set_title(title, fontsize=9)
    print(f"{title}, steps {FRACTIONS}", *("%-6g" % number + " ".join("   x " if np.isnan(v) else "%5.2f" % v for v in row)
                                           for number, row in zip(numbers, values)), sep="\n   ", flush=True)
    return image


def show_strips(panel, folder):
    """Stress of 1 to 20 tiles in a row against that of one tile, under shear along the strip."""
    tile = generate(folder / "tile", radius=RADII, pressure=PRESSURE, preparation_friction=0.1, grains=64, **law(2))
    for copies in (2, 5, 10, 20):
        both = []
        for many in (1, copies):
            found, stable, last = rve_run(tile, 2, mu=0.5, local=0.3, steps=40000, every=200, copies=[many, 1, 1],
                                          dt=1e-5, L=[0, 1.0, 0, 0, 0, 0, 0, 0, 0], **law(2))
            assert stable, last
            both.append(np.array([found[name] for name in ("sxx", "syy", "sxy")]))
        apart = np.abs(both[1] - both[0]).max(0) / np.abs(both[0]).max()
        gamma = np.arange(len(apart)) * 200 * 1e-5
        panel.semilogy(gamma, np.maximum(apart, 1e-17), lw=1, label=f"{copies} : 1")
        print(f"{copies} tiles: {apart[1]:.1e} after 200 steps, {apart[:11].max():.1e} to gamma 0.02, {apart.max():.1e} to 0.4")
    panel.set_xlabel(r"$\gamma$")
    panel.set_title("2D strips against one tile: stress", fontsize=9)
    panel.legend(fontsize=7)


def show_stretch(panel, folder):
    for dimension, grains in ((2, 100), (2, 400), (3, 216)):
        packing = generate(folder / f"square{dimension}{grains}", dimension=dimension, radius=RADII, pressure=PRESSURE,
                           preparation_friction=0.1, grains=grains, **law(dimension))
        steps, points = 0.5 * np.log(20.0) / 2.0, 200
        dt = 0.3 * critical_step(packing, dimension, {})
        every = int(steps / dt / points) + 1
        found, stable, last = rve_run(packing, dimension, mu=0.5, local=0.3, dt=dt, steps=every * points, every=every,
                                      L=[2, 0, 0, 0, -2, 0, 0, 0, 0], **law(dimension))
        xx, yy = np.array(found["sxx"]), np.array(found["syy"])
        aspect = np.exp(4.0 * dt * np.array(found["step"]))
        panel.semilogx(aspect, (xx - yy) / -(xx + yy), lw=1, label=f"{dimension}D, {grains}" + ("" if stable else " (ends)"))
        print(f"{dimension}D {grains} grains stretched to {aspect[-1]:.1f} : 1,", "stable" if stable else last)
    panel.set_xticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
    panel.set_xlabel("length / width of the cell")
    panel.set_title(r"stretched cells: $(\sigma_{xx}-\sigma_{yy})/2p$", fontsize=9)
    panel.legend(fontsize=7)


def main():
    folder = pathlib.Path(tempfile.mkdtemp())
    figure, panels = plt.subplots(2, 4, figsize=(13, 5.6))
    flat = generate(folder / "flat", radius=RADII, pressure=PRESSURE, preparation_friction=0.1, grains=100, **law(2))
    solid = generate(folder / "solid", dimension=3, radius=RADII, pressure=PRESSURE, preparation_friction=0.1, grains=125,
                     **law(3))
    for panel, (name, damping) in zip(panels[0], DAMPING.items()):
        image = show_map(panel, kinetic_map(flat, 2, damping, NUMBERS), NUMBERS, f"2D, {name}")
    for panel, name in zip(panels[1], ("undamped", "local 0.3")):
        show_map(panel, kinetic_map(solid, 3, DAMPING[name], NUMBERS[1:]), NUMBERS[1:], f"3D, {name}")
    for row in panels:
        row[0].set_ylabel("inertial number")
    bar = figure.add_axes((0.935, 0.58, 0.01, 0.36))
    figure.colorbar(image, cax=bar, label="log10 of kinetic / elastic energy")
    figure.subplots_adjust(left=0.06, right=0.92, bottom=0.09, top=0.94, hspace=0.42, wspace=0.28)
    show_strips(panels[1][2], folder)
    show_stretch(panels[1][3], folder)
    figure.savefig(ROOT / "doc" / "images" / "rve_stability.png", dpi=110)


if __name__ == "__main__":
    main()
