#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Pictures of answers of dempm-rve.

  plot.py answer.csv --out answer.png                              one test
  plot.py "dense=dense.csv" "loose=loose.csv" --out both.png       several, compared

Stress, volume, fabric and energies over the largest strain of the test (logarithmic compression or extension, or shear);
over the pressure if no strain stands out (isotropic compression). Needs Debian's python3-numpy and python3-matplotlib.
"""
import argparse
import pathlib
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np
except ImportError as missing:
    sys.exit(f"plot.py: {missing} (Debian: apt-get install python3-numpy python3-matplotlib)")

LINES = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"]  # Okabe and Ito
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9,
                     "figure.constrained_layout.use": True, "axes.prop_cycle": plt.cycler(color=LINES)})


class Answer:
    """One CSV file of dempm-rve."""

    def __init__(self, text):
        label, _, name = text.rpartition("=")
        self.label = label or pathlib.Path(name).stem
        try:
            self.table = np.genfromtxt(name, delimiter=",", names=True)
        except (OSError, ValueError) as error:
            sys.exit(f"plot.py: {name}: {error}")
        names = self.table.dtype.names or ()
        if "Fxx" not in names or self.table.ndim != 1 or len(self.table) < 2:
            sys.exit(f"plot.py: {name} is no answer of dempm-rve, or has fewer than two lines")
        self.axes = [axis for axis in "xyz" if f"F{axis}{axis}" in names]

    def __getitem__(self, name):
        return self.table[name]

    def strains(self):
        """{name: values} of compressions -ln F_ii and shears F_ij."""
        pairs = [(a, b) for a in self.axes for b in self.axes if a != b]
        found = {f"compression $-\\ln F_{{{a}{a}}}$": -np.log(self[f"F{a}{a}"]) for a in self.axes}
        found.update({f"shear $F_{{{a}{b}}}$": self[f"F{a}{b}"] for a, b in pairs})
        return found

    def main_strain(self):
        """Name of the strain over which the test is drawn: what is compressed or sheared most; None if isotropic."""
        strains = self.strains()
        ends = [values[-1] for name, values in strains.items() if name.startswith("compression")]
        reach = {name: np.ptp(values) if name.startswith("shear") else max(values.max(), 0.3 * np.ptp(values))
                 for name, values in strains.items()}
        name = max(reach, key=reach.get)
        return None if name.startswith("compression") and np.ptp(ends) < 0.2 * abs(strains[name][-1]) else name

    def mean_pressure(self):
        return -sum(self[f"s{a}{a}"] for a in self.axes) / len(self.axes)

    def strength(self):
        """Largest difference of principal stresses over their sum (2D), deviatoric stress over pressure (3D)."""
        stress = np.zeros((len(self.table), len(self.axes), len(self.axes)))
        for i, a in enumerate(self.axes):
            for j, b in enumerate(self.axes):
                stress[:, i, j] = self[f"s{min(a, b)}{max(a, b)}"]
        principal = np.linalg.eigvalsh(stress)
        with np.errstate(divide="ignore", invalid="ignore"):
            if len(self.axes) == 2:
                return (principal[:, 1] - principal[:, 0]) / abs(principal.sum(axis=1))
            mean = principal.mean(axis=1)
            return np.sqrt(1.5 * ((principal - mean[:, None]) ** 2).sum(axis=1)) / abs(mean)


def draw(answers, path):
    figure, grid = plt.subplots(2, 2, figsize=(8.0, 5.4))
    name = answers[0].main_strain()
    isotropic = name is None
    for answer in answers:
        x = answer.mean_pressure() / 1e3 if isotropic else answer.strains()[name] * 100.0
        first = answer["time"] * 1e3 if isotropic else x
        y = answer.mean_pressure() / 1e3 if isotropic else answer.strength()
        grid[0][0].plot(first, y, label=answer.label)
        grid[0][1].plot(x, answer["void_ratio"])
        grid[1][0].plot(x, answer["coordination"])
        work = answer["friction_work"] + answer["damping_work"]
        grid[1][1].plot(x, work / answer["volume"][0] / 1e3)
        grid[1][1].plot(x, answer["elastic_energy"] / answer["volume"][0] / 1e3, ls=":",
                        color=grid[1][1].lines[-1].get_color())
    across = "mean pressure [kPa]" if isotropic else f"{name} [%]"
    for axes in grid.flat:
        axes.set_xlabel(across)
        axes.set_xscale("log" if isotropic else "linear")
    if isotropic:
        grid[0][0].set(xlabel="time [ms]", xscale="linear", ylabel="mean pressure [kPa]")
    else:
        two = len(answers[0].axes) == 2
        label = "$(\\sigma_1-\\sigma_2)/(\\sigma_1+\\sigma_2)$ [-]" if two else "deviatoric stress / pressure [-]"
        grid[0][0].set_ylabel(label)
    grid[0][1].set_ylabel("void ratio [-]")
    grid[1][0].set_ylabel("coordination number [-]")
    grid[1][1].set_ylabel("energy [kJ/m$^3$]")
    grid[1][1].set_title("lost (solid), elastic (dotted)", loc="left")
    grid[0][0].legend(frameon=False)
    figure.savefig(path, dpi=130)


def main():
    parser = argparse.ArgumentParser(description="Pictures of answers of dempm-rve.")
    parser.add_argument("answers", nargs="+", metavar="[LABEL=]FILE.csv")
    parser.add_argument("--out", required=True, help="PNG, PDF or SVG")
    options = parser.parse_args()
    try:
        draw([Answer(text) for text in options.answers], options.out)
    except (OSError, ValueError) as error:
        sys.exit(f"plot.py: {options.out}: {error}")
    print(f"picture          {options.out}")


if __name__ == "__main__":
    main()
