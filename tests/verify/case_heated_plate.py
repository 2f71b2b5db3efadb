# SPDX-License-Identifier: GPL-2.0-or-later
"""TM-DEMPM 5.1.2: the square plate heated along two edges, against finite elements (plate_fem.py).

A = (0.5, 0.5), B = (0.6, 0.5), C = (0.6, 0.6) are grid nodes; the material points compared are the next ones, half a
cell further along both axes. Stresses in E beta T1, errors over the largest stress at the same point in the 0.5 s.
Before the front: until 0.85 of the time at which the heated edges' wave arrives, when it is three cells of the 40 x
40 grid away."""
import numpy as np
from study import plt

from plate_fem import Plate

PLACES = {"A": (0.5, 0.5), "B": (0.6, 0.5), "C": (0.6, 0.6)}


def history(run, cells, offset=None):
    """times, {place: [time][T, sxx, syy, sxy]} of the points half a cell beyond A, B, C."""
    times, found = [], {name: [] for name in PLACES}
    for step, columns in run.dump("plate.dump")[1:]:
        fields = np.array([columns[name] for name in ("f_mpm[13]", "f_mpm[1]", "f_mpm[2]", "f_mpm[4]")])
        numbers = np.array(columns["f_mpm[30]"]).astype(int) - 1
        grid = np.empty((4, cells * cells))
        grid[:, numbers] = fields
        times.append(step)
        for name, (x, y) in PLACES.items():
            value = grid.reshape(4, cells, cells)[:, round(y * cells), round(x * cells)]
            found[name].append(value / [1, 1e-6, 1e-6, 1e-6])
    times = np.array(times) * 0.5 / times[-1]
    return times, {name: np.array(values) for name, values in found.items()}


def answers(plate, times, cells):
    half = 0.5 / cells
    return {name: np.array([plate.at(x + half, y + half, t) for t in times]) for name, (x, y) in PLACES.items()}


def errors(times, found, exact, plate, cells, share=0.85):
    """T, and stress over the largest at the point, before the front and at all times."""
    heat = max(np.max(np.abs(found[n][:, 0] - exact[n][:, 0])) for n in PLACES)
    before, always = 0.0, 0.0
    for name, (x, y) in PLACES.items():
        early = times < share * (y + 0.5 / cells) / plate.speed
        error = np.max(np.abs(found[name][:, 1:] - exact[name][:, 1:]), axis=1) / np.max(np.abs(exact[name][:, 1:]))
        before, always = max(before, error[early].max()), max(always, error.max())
    return heat, before, always


def draw(study, mode, times, fine, coarse, runs):
    figure, axes = plt.subplots(1, 4, figsize=(17, 4))
    for k, name in enumerate(PLACES):
        color = f"C{k}"
        axes[0].plot(times, fine[name][:, 0], color, label=name)
        axes[0].plot(times[::3], runs["apic"][name][::3, 0], color + "o", ms=4)
        axes[1 + k].plot(times, fine[name][:, 1], "k", label="converged")
        axes[1 + k].plot(times, coarse[name][:, 1], "k--", lw=0.8, label="FEM 40 x 40")
        for transfer, found in runs.items():
            axes[1 + k].plot(times, found[name][:, 1], label="MPM, " + transfer)
        axes[1 + k].set(xlabel="t, s", title=f"{name}: $\\sigma_{{xx}}/(E \\beta T_1)$")
    axes[0].set(xlabel="t, s", title="T, C (points: MPM)")
    axes[0].legend()
    axes[1].legend(fontsize=8)
    study.save(figure, f"heated_plate_{mode}")


def verify(study):
    for mode in ("plane_strain", "plane_stress"):
        fine, coarse, runs = Plate(mode, 160), Plate(mode, 40, subtract=False), {}
        for transfer in ("apic", "flip 0.9999"):
            run = study.run(f"{mode}_{transfer.split()[0]}", "in.heated_plate", {"mode": mode, "transfer": transfer},
                            folders=["heated_plate"], threads=1)
            times, runs[transfer] = history(run, 40)
            exact = answers(fine, times, 40)
            heat, before, always = errors(times, runs[transfer], exact, fine, 40)
            label = f"{mode}, {transfer}: "
            bounds = (0.5, 2, 5) if transfer == "apic" else (0.5, None, None)
            study.check(label + "T at A, B, C, % of T1", 100 * heat, bounds[0], run)
            study.check(label + "stress at A, B, C before the front, %", 100 * before, bounds[1], run)
            study.check(label + "the same until 0.95 of the arrival, %",
                        100 * errors(times, runs[transfer], exact, fine, 40, 0.95)[1], None, run)
            near = answers(coarse, times, 40)
            _, _, beside = errors(times, runs[transfer], near, fine, 40)
            study.check(label + "stress beside that of 40 x 40 finite elements, 0.5 s, %", 100 * beside, bounds[2], run)
            study.check(label + "stress beside the converged one, front included, %", 100 * always, None, run)
        elements = errors(times, near, exact, fine, 40)
        study.note(f"{mode}: 40 x 40 finite elements themselves are off by {100 * elements[1]:.2g} % before the front and "
                   f"{100 * elements[2]:.2g} % at it.")
        draw(study, mode, times, exact, near, runs)
    converge(study)


def converge(study):
    plate = Plate("plane_strain", 160)
    found = []
    for cells in (20, 40, 80):
        variables = {"cells": cells, "dt": 0.04 / cells}
        run = study.run(f"cells_{cells}", "in.heated_plate", variables, folders=["heated_plate"], threads=1)
        times, values = history(run, cells)
        heat, before, _ = errors(times, values, answers(plate, times, cells), plate, cells)
        found.append((heat, before))
        study.check(f"convergence, {cells} x {cells}: stress before the front, %", 100 * before, None, run)
    orders = np.log2(np.array(found[:-1]) / np.array(found[1:]))
    study.check("convergence 40 to 80: 1.5 - order of T", 1.5 - orders[1, 0], 0, run)
    study.check("convergence 40 to 80: 1 - order of the stress before the front", 1 - orders[1, 1], 0, run)
    study.note("orders over 20, 40, 80 cells: T {:.2f}, {:.2f}; stress {:.2f}, {:.2f}.".format(*orders.T.ravel()))
