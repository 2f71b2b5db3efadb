# SPDX-License-Identifier: GPL-2.0-or-later
"""What the cases of `make compare` share: both answers on the same curves and grids, their differences, what each cost.

A case is a module scene_NAME with compare(comparison). An answer is a dict {quantity: array} of one run; both sides give the same
quantities on the same times and grids. Every error is the same norm: root mean square of the difference over that of the reference,
which is the mean of the full DEM's answers over its seeds."""
import dataclasses
import pathlib
import sys

import numpy as np
from PIL import Image

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "verify"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "examples" / "compare"))
from cut import cut_block, read_packing, write_data, write_groups  # noqa: E402
from study import Study, plt  # noqa: E402

DENSITY = 2650  # of the grains' matter, in all cases
BLUE, RED, GREY = "C0", "C3", "0.5"


@dataclasses.dataclass
class Side:
    """Runs of one kind that differ in the seeds of their packings."""
    label: str
    runs: list
    answers: list
    grains: int  # of a full DEM; of all packings of a multiscale run

    @property
    def seconds(self):
        """Processor seconds of a run, mean."""
        return float(np.mean([sum(part.processor for part in run) if isinstance(run, tuple) else run.processor for run in self.runs]))

    def mean(self, quantity):
        return np.mean([answer[quantity] for answer in self.answers], axis=0)

    def bounds(self, quantity):
        values = [answer[quantity] for answer in self.answers]
        return np.min(values, axis=0), np.max(values, axis=0)


def norm(answer, reference):
    return float(np.sqrt(np.mean(np.square(answer - reference)) / np.mean(np.square(reference))))


def smear(x, y, edge, amount, lines_x, lines_y):
    """Amount per area in the cells between the grid lines; each particle is a square of the given edge."""
    parts = 5
    offsets = (np.arange(parts) + 0.5) / parts - 0.5
    dx, dy = (grid.ravel() for grid in np.meshgrid(offsets, offsets))
    places = [(np.asarray(c)[:, None] + np.asarray(edge)[:, None] * d).ravel() for c, d in ((x, dx), (y, dy))]
    weights = np.repeat(np.asarray(amount) / parts**2, parts**2)
    sums = np.histogram2d(*places, bins=(lines_x, lines_y), weights=weights)[0]
    return sums / np.outer(np.diff(lines_x), np.diff(lines_y))


def lagrangian(x, y, mass, values, lines_x, lines_y):
    """Mean of the values over the particles that began in each cell."""
    total, weight = (np.histogram2d(x, y, bins=(lines_x, lines_y), weights=w)[0] for w in (mass * values, mass))
    return total / weight


def exact_step(step):
    """A time step not above, a whole number of which make 10 ms."""
    return f"{0.01 / np.ceil(0.01 / step):.10g}"


def arrays(frame):
    """A frame of a dump with arrays for lists."""
    return {name: np.array(values) for name, values in frame[1].items()}


@dataclasses.dataclass
class Scene:
    """A folder of examples/compare, and how its grains are made. A full DEM of fewer grains has larger ones: lengths and time step grow alike."""
    folder: str
    radius: tuple    # smallest and largest
    total: int       # grains of that radius in the full DEM
    step: float      # of their time, at most
    settings: dict   # of their packings
    answer: object   # function of a run and "full_dem" or "multiscale"

    def scale(self, total):
        return np.sqrt(self.total / total)

    def slab(self, scale):
        """Thickness of a rough wall of grains."""
        return 4 * scale * np.mean(self.radius)

    def scaled(self, scale):
        """What goes with the size of the grains: their time step, the dashpots that keep the fraction of critical damping, conductivity."""
        return {"dt": exact_step(scale * self.step), "gamman": f"{4000 / scale:.6g}", "scale": f"{scale:.10g}"}

    def pack(self, study, name, grains, seed, scale):
        return study.pack(f"{name}_{grains}_{seed}", threads=1, radius=tuple(scale * r for r in self.radius), grains=grains, seed=seed,
                          **self.settings)

    def area(self, size, scale):
        """Of a packing, which is square, with room for a block and two slabs; the fewer its grains, the more its size scatters."""
        return ((1 + 0.02 * scale) * max(size) + 2 * self.slab(scale)) ** 2

    def block(self, size, axis, box, types):
        """How a block between rough slabs is cut, for full_dem(): see cut_block. None in `box`: the packing's own period along y."""
        def cut(packing, stem, scale):
            files = {kind: stem.with_suffix(f".{kind}") for kind in ("data", "groups")}
            grains = cut_block(packing, size, self.slab(scale), axis)
            period = read_packing(packing)[2][1]
            write_data(files["data"], grains, [period if edge is None else edge for edge in box], DENSITY, types)
            write_groups(files["groups"], grains[3])
            return files
        return cut

    def full_dem(self, study, total, seeds, variables, spare, cut):
        """`spare`(scale) times `total` grains are packed; cut(packing, stem, scale) makes ({variable: file})."""
        scale, runs = self.scale(total), []
        for seed in range(1, seeds + 1):
            large = self.pack(study, "full", round(spare(scale) * total), seed, scale)
            files = cut(large, study.folder / f"cut_{total}_{seed}", scale)
            words = {**variables, **{name: path.name for name, path in files.items()}, **self.scaled(scale)}
            runs.append(study.run(f"full_{total}_{seed}", "in.full_dem", words, [self.folder], list(files.values()), threads=1))
        grains = len(runs[0].dump("out/full_dem.dump")[0][1]["id"])
        return Side(f"full DEM, {grains} grains", runs, [self.answer(run, "full_dem") for run in runs], grains)

    def multiscale(self, study, size, grains, scale, replicates, variables):
        """`size`: variables that set points and grid. Each run has four packings of its own, which the points take in turn."""
        runs = []
        for k in range(replicates):
            packings = [self.pack(study, "rve", grains, 4 * k + seed, scale) for seed in range(1, 5)]
            words = {**variables, **size, "packing": " ".join(p.name for p in packings), **self.scaled(scale)}
            name = "_".join(["multiscale", *(v if isinstance(v, str) else f"{v:g}" for v in size.values()), str(grains), str(k)])
            runs.append(study.run(name, "in.multiscale", words, [self.folder], packings, grains=grains, threads=1))
        points, per_cell = runs[0].points, round(size["grid"] / size.get("spacing", size["grid"])) ** 2
        label = f"multiscale, {points} x {grains}" + (f", {per_cell} per cell" if per_cell > 1 else "")
        label += f", {size['shape']}" if "shape" in size else ""
        label += ", means over cells" if size.get("volumetric") == "cell" else ""
        return Side(label, runs, [self.answer(run, "multiscale") for run in runs], points * grains)


class Comparison(Study):
    """Rows {"case", "quantity", "error", "seconds_multiscale", "seconds_full_dem", "grains_full_dem", "seeds"}, and further "multiscale":
    which size, "spread": the same error of one full DEM against the mean of the others."""

    def __init__(self, case, folder, size):
        """size: full, quick (few grains, to try it) or tiny (for tests: no figures)."""
        super().__init__(case, folder, full=size == "full")
        self.size, self.coarse_rows, self.tables = size, [], []

    def save(self, figure, name):
        """Ten thousand grains make large pictures: few colours keep them small."""
        super().save(figure, name)
        path = self.folder.parent / f"{name}.png"
        Image.open(path).convert("RGB").quantize(96, dither=Image.Dither.NONE).save(path, optimize=True)

    def sizes(self, total):
        """Grains of the full DEMs: the reference, and such with fewer, larger grains."""
        return [total, total // 4, total // 10, total // 30] if self.full else [total]

    def run_both(self, scene, total, seeds, replicates, levels, variables, spare, cut):
        """(full DEMs, that of all grains first; multiscale sizes in the order of `levels`), compared."""
        fulls = [scene.full_dem(self, n, seeds, variables, spare, cut) for n in self.sizes(total)]
        sides = [scene.multiscale(self, size, grains, scene.scale(total), replicates, variables) for size, grains in levels]
        self.compare(fulls[0], sides, fulls[1:])
        return fulls, sides

    def compare(self, reference, levels, coarse):
        """Errors of every multiscale size and of full DEMs of fewer, larger grains."""
        quantities = list(reference.answers[0])
        spread = {q: self.spread(reference, q) for q in quantities}
        for side in levels:
            for q in quantities:
                self.rows.append({"case": self.case, "quantity": q, "error": self.error(side, reference, q),
                                  "seconds_multiscale": round(side.seconds, 2), "seconds_full_dem": round(reference.seconds, 2),
                                  "grains_full_dem": reference.grains, "seeds": len(reference.runs), "multiscale": side.label,
                                  "spread": spread[q]})
        for side in coarse:
            for q in quantities:
                self.coarse_rows.append({"case": self.case, "quantity": q, "error": self.error(side, reference, q),
                                         "seconds": round(side.seconds, 2), "grains": side.grains, "seeds": len(side.runs)})
        if self.size == "tiny":
            return
        self.tables.append(self.table(reference, levels, coarse, quantities, spread))
        for side in [*levels, *coarse]:
            print(f"  {self.case}: {side.label}: {side.seconds:.1f} s, " +
                  ", ".join(f"{q} {self.error(side, reference, q):.3g}" for q in quantities), flush=True)
        print(f"  {self.case}: {reference.label}: {reference.seconds:.1f} s, spread " +
              ", ".join(f"{q} {spread[q]:.3g}" for q in quantities if spread[q] is not None))
        self.cost_figure(reference, levels, coarse, quantities)

    @staticmethod
    def error(side, reference, quantity):
        return float(np.mean([norm(answer[quantity], reference.mean(quantity)) for answer in side.answers]))

    @staticmethod
    def spread(side, quantity):
        """Of one run against the mean of the others, mean."""
        values = [answer[quantity] for answer in side.answers]
        if len(values) < 2:
            return None
        others = [np.mean(values[:k] + values[k + 1:], axis=0) for k in range(len(values))]
        return float(np.mean([norm(value, other) for value, other in zip(values, others)]))

    def table(self, reference, levels, coarse, quantities, spread):
        lines = ["| | grains | processor seconds | of the full DEM's | " + " | ".join(quantities) + " |", "| --- " * (4 + len(quantities)) + "|"]
        cell = lambda value: "" if value is None else f"{100 * value:.2g} %" if value < 0.995 else f"{100 * value:.0f} %"
        lines.append(f"| {reference.label}, spread | {reference.grains} | {reference.seconds:.3g} | 1 | " +
                     " | ".join(cell(spread[q]) for q in quantities) + " |")
        for side in [*levels, *coarse]:
            lines.append(f"| {side.label} | {side.grains} | {side.seconds:.3g} | {side.seconds / reference.seconds:.2g} | " +
                         " | ".join(cell(self.error(side, reference, q)) for q in quantities) + " |")
        return lines

    def cost_figure(self, reference, levels, coarse, quantities):
        """Mean error of all quantities beside processor seconds; the speed-up at equal error as a note."""
        score = lambda side: float(np.mean([self.error(side, reference, q) for q in quantities]))
        figure, axis = plt.subplots(figsize=(4.6, 3.4), layout="constrained")
        for sides, colour, label in ((levels, BLUE, "multiscale"), (coarse, RED, "full DEM, larger grains")):
            if sides:
                axis.plot([s.seconds for s in sides], [100 * score(s) for s in sides], "o", color=colour, label=label)
            for side in sides:
                axis.annotate(side.label.split(", ", 1)[-1], (side.seconds, 100 * score(side)), fontsize=6, xytext=(3, 3), textcoords="offset points")
        if len(reference.answers) > 1:
            noise = float(np.mean([self.spread(reference, q) for q in quantities]))
            axis.plot(reference.seconds, 100 * noise, "s", color=RED, mfc="none", label="full DEM, seed against seed")
        axis.set(xscale="log", yscale="log", xlabel="processor seconds of a run", ylabel="error, mean of the quantities [%]")
        axis.legend(frameon=False, fontsize=7)
        self.save(figure, f"{self.case}_cost")
        self.equal_error(reference, levels, coarse, score)

    def equal_error(self, reference, levels, coarse, score):
        """What a full DEM of so many grains takes that it has the error of a multiscale run: between the sizes that were run."""
        if not (levels and coarse):
            return
        known = sorted((score(side), side.seconds) for side in coarse)
        for side in levels:
            error = score(side)
            text = f"{side.label}: {reference.seconds / side.seconds:.2g} times as fast as the full DEM, mean error {100 * error:.2g} %; "
            if error < known[0][0]:
                text += f"smaller than that of every full DEM of larger grains: speed-up at equal error above {known[0][1] / side.seconds:.2g}."
            elif error > known[-1][0]:
                text += f"larger than that of every full DEM of larger grains: speed-up at equal error below {known[-1][1] / side.seconds:.2g}."
            else:
                seconds = np.exp(np.interp(np.log(error), np.log([e for e, _ in known]), np.log([s for _, s in known])))
                text += f"a full DEM of larger grains has it after {seconds:.3g} s: speed-up at equal error {seconds / side.seconds:.2g}."
            self.note(text)


def curve_band(axis, x, side, quantity, colour, label=None, scale=1.0, **style):
    """The mean over the seeds as a line, their range as a band."""
    low, high = side.bounds(quantity)
    axis.fill_between(x, scale * low, scale * high, color=colour, alpha=0.25, lw=0)
    axis.plot(x, scale * side.mean(quantity), color=colour, label=label, **style)
