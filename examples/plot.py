#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Pictures and an animation of dempm runs.

  plot.py post                                    one run: the folder with its points_*.vtk
  plot.py "no bonds=post_a" "bonds=post_b"        several runs, compared row by row
  plot.py "bare=out/bare_*.vtk"                   the files by name; log: out/log.bare, out/bare.log or out/log.liggghts
  plot.py post --rve post/rve_17.pvd              grains and force chains of a packing as well

Points come from `dump custom/vtk` with columns `id x y z vx vy vz f_ID[...]` of fix mpm/couple; which columns are there
decides what can be drawn. Curves come from the thermo output in log.liggghts, which is looked for beside and above the
folder. Needs Debian's python3-vtk9, python3-numpy and python3-matplotlib.
"""
import argparse
import pathlib
import re
import sys
import xml.etree.ElementTree

import matplotlib

matplotlib.use("Agg")
import matplotlib.animation as animation
import matplotlib.collections as collections
import matplotlib.colors as colors
import matplotlib.pyplot as plt
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

import thermo  # examples/thermo.py

# Columns of f_ID[...] of fix mpm/couple (doc/fix_mpm_couple.md).
PRESSURE, STRAIN, RATIO, VOLUME, TEMPERATURE, FRACTION, COORDINATION, BONDS = 7, 10, 11, 12, 13, 15, 16, 17
# name: (column, label, colour map). Perceptually uniform maps, readable with every kind of colour vision.
FIELDS = {
    "speed": (None, "speed [m/s]", "viridis"),
    "temperature": (TEMPERATURE, "temperature [{degree}]", "inferno"),
    "strain": (STRAIN, "deviatoric strain [-]", "magma"),
    "bonds": (BONDS, "intact bonds [-]", "cividis"),
    "pressure": (PRESSURE, "pressure [Pa]", "viridis"),
    "solid_fraction": (FRACTION, "solid fraction [-]", "cividis"),
    "coordination": (COORDINATION, "coordination number [-]", "cividis"),
}
LINES = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"]  # Okabe and Ito
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.titlesize": 9,
                     "figure.constrained_layout.use": True, "axes.prop_cycle": plt.cycler(color=LINES)})


# ------------------------------------------------------------------------------------------------------------- reading
def read_vtk(path):
    """A legacy or XML VTK file: (points [n, 3], {array name: values})."""
    readers = {".vtk": vtk.vtkGenericDataObjectReader, ".vtu": vtk.vtkXMLUnstructuredGridReader,
               ".vtp": vtk.vtkXMLPolyDataReader}
    reader = readers[path.suffix]()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    if data is None or data.GetNumberOfPoints() == 0:
        raise SystemExit(f"plot.py: {path} holds no points")
    arrays = data.GetPointData()
    values = {arrays.GetArrayName(k): vtk_to_numpy(arrays.GetArray(k)) for k in range(arrays.GetNumberOfArrays())}
    return vtk_to_numpy(data.GetPoints().GetData()).astype(float), values


class Frame:
    """The points of one moment."""

    def __init__(self, path, step, time, run):
        self.step, self.time = step, time
        self.position, arrays = read_vtk(path)
        self.velocity = arrays.get("v")
        self.columns = {}
        for name, values in arrays.items():
            match = re.fullmatch(r"f_(\w+)\[(\d+)(?:-(\d+))?\]", name)
            if not match or run.options.fix not in (None, match[1]):
                continue
            first, last = int(match[2]), match[3]
            if last is None:
                self.columns[first] = values
                continue
            # dump custom/vtk writes three successive columns as one vector, named after the first and the last of them.
            for column, part in zip((first, run.middle_column(match[1], first, int(last)), int(last)), values.T):
                self.columns[column] = part

    def field(self, name):
        if name == "speed":
            return None if self.velocity is None else np.linalg.norm(self.velocity, axis=1)
        return self.columns.get(FIELDS[name][0])

    def sizes(self, spacing):
        """Edge of the square that stands for a point, m. In 2D column VOLUME is an area times unit depth."""
        if VOLUME in self.columns and np.ptp(self.position[:, 2]) == 0.0:
            return np.sqrt(np.maximum(self.columns[VOLUME], 0.0))
        return np.full(len(self.position), spacing)


class Run:
    """One folder of point files with its log."""

    def __init__(self, text, options):
        label, _, folder = text.rpartition("=")
        self.path, self.pattern, self.options = pathlib.Path(folder), options.points, options
        if not self.path.is_dir():
            self.path, self.pattern = self.path.parent, self.path.name
        self.stem = re.split(r"[_.-]?\*", self.pattern)[0]
        self.label = label or (self.stem if self.pattern != options.points else self.path.resolve().name)
        self.log = self.find_log()
        self.timestep = options.timestep or self.find_timestep()
        files = [path for path in self.path.glob(self.pattern) if "boundingBox" not in path.name]
        numbered = [(int(match[1]), path) for path in files if (match := re.search(r"(\d+)\.\w+$", path.name))]
        self.files = sorted(numbered)
        if not self.files:
            raise SystemExit(f"plot.py: no files {self.pattern} in {self.path}")
        self.cache = {}

    def find_log(self):
        names = [self.path / f"log.{self.stem}", self.path / f"{self.stem}.log"]
        for path in [*names, self.path / self.options.log, self.path.parent / self.options.log]:
            if path.is_file():
                return path.read_text(errors="replace")
        return ""

    def find_timestep(self):
        found = re.findall(r"^\s*timestep\s+([0-9.eE+-]+)\s*$", self.log, re.MULTILINE)
        return float(found[-1]) if found else None

    def middle_column(self, fix, first, last):
        """The column that the dump command in the log names between two others; None if there is no such log."""
        triple = rf"f_{fix}\[{first}\]\s+f_{fix}\[(\d+)\]\s+f_{fix}\[{last}\]"
        found = re.search(rf"^\s*dump\s.*custom/vtk\s.*{triple}", self.log, re.MULTILINE)
        return int(found[1]) if found else first + 1 if last == first + 2 else None

    def frame(self, k):
        step, path = self.files[k]
        if k not in self.cache:
            time = step * self.timestep if self.timestep else None
            self.cache[k] = Frame(path, step, time, self)
        return self.cache[k]

    def spacing(self):
        """Median distance to the nearest neighbour in the first frame."""
        points = self.frame(0).position
        pick = points[np.linspace(0, len(points) - 1, min(len(points), 50)).astype(int)]
        distance = np.linalg.norm(pick[:, None] - points[None], axis=2)
        distance[distance == 0.0] = np.inf
        return float(np.median(distance.min(axis=1)))

    def moment(self, frame):
        return f"step {frame.step}" if frame.time is None else f"t = {frame.time:.3g} s"

    def choose(self, times, count):
        """Numbers of the frames nearest to `times`, or `count` spread evenly from first to last."""
        if times and self.timestep:
            steps = np.array([step for step, _ in self.files])
            return [int(np.argmin(abs(steps * self.timestep - time))) for time in times]
        return sorted(set(np.linspace(0, len(self.files) - 1, count).round().astype(int).tolist()))

    def thermo(self):
        """Columns of the thermo output of all `run` commands one after the other: {name: array}; none if they differ."""
        runs = thermo.tables(self.log)
        if len({tuple(table) for table in runs}) != 1:
            return {}
        return {name: np.concatenate([table[name] for table in runs]) for name in runs[0]}


# -------------------------------------------------------------------------------------------------------------- points
AXES = {"xy": (0, 1, 2), "xz": (0, 2, 1), "yz": (1, 2, 0)}


def draw_points(axes, run, frame, name, norm, plane):
    """Squares of the points' own size, far ones first."""
    i, j, depth = AXES[plane]
    order = np.argsort(frame.position[:, depth], kind="stable")
    x, y = frame.position[order, i], frame.position[order, j]
    half = 0.5 * frame.sizes(run.spacing())[order]
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    corners = np.stack([np.stack([x + a * half, y + b * half], axis=1) for a, b in signs], axis=1)
    squares = collections.PolyCollection(corners, array=frame.field(name)[order], norm=norm, cmap=FIELDS[name][2],
                                          edgecolors="face", linewidths=0.5)
    return axes.add_collection(squares)


def view_limits(runs, chosen, plane):
    """Bounds of all chosen frames with a margin."""
    i, j, _ = AXES[plane]
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for run, frames in zip(runs, chosen):
        for k in frames:
            points = run.frame(k).position[:, [i, j]]
            low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    margin = 0.04 * max(high - low) + runs[0].spacing()
    return low - margin, high + margin


def colour_range(runs, chosen, name):
    """Common scale; speed and strain end at their 99th percentile, so that one fast point does not blank the rest."""
    values = [run.frame(k).field(name) for run, frames in zip(runs, chosen) for k in frames]
    values = np.concatenate([value for value in values if value is not None])
    if name == "bonds":
        return colors.Normalize(0.0, 1.0)
    if name in ("speed", "strain"):
        return colors.Normalize(0.0, max(np.percentile(values, 99), 1e-12))
    low, high = values.min(), values.max()
    return colors.Normalize(low, high if high > low else low + 1.0)


def dress(axes, limits, plane, left, bottom):
    axes.set_aspect("equal")
    axes.set_xlim(limits[0][0], limits[1][0])
    axes.set_ylim(limits[0][1], limits[1][1])
    axes.set_xlabel(f"{plane[0]} [m]" if bottom else "")
    axes.set_ylabel(f"{plane[1]} [m]" if left else "")
    axes.tick_params(labelleft=left, labelbottom=bottom)


def panel_size(limits, columns):
    width = min(4.2, 12.0 / columns)
    ratio = (limits[1][1] - limits[0][1]) / (limits[1][0] - limits[0][0])
    return width, min(max(width * ratio, 0.9), 5.0) + 0.35


def available(runs, wanted):
    present = [name for name in FIELDS if all(run.frame(0).field(name) is not None for run in runs)]
    if wanted is None:
        return [name for name in ("temperature", "strain", "speed", "bonds") if name in present]
    for name in wanted:
        if name not in present:
            raise SystemExit(f"plot.py: field '{name}' is not in the point files; there are: {', '.join(present)}")
    return wanted


def label_of(name, options):
    return FIELDS[name][1].format(degree=options.degree)


def picture_of_moments(runs, name, options):
    """One field: chosen moments side by side, a row per run."""
    chosen = [run.choose(options.times, options.moments) for run in runs]
    rows, columns = len(runs), max(map(len, chosen))
    limits, norm = view_limits(runs, chosen, options.plane), colour_range(runs, chosen, name)
    width, height = panel_size(limits, columns)
    figure, grid = plt.subplots(rows, columns, squeeze=False, figsize=(width * columns + 0.9, height * rows + 0.5))
    for row, run in enumerate(runs):
        for column in range(columns):
            axes = grid[row][column]
            if column >= len(chosen[row]):
                axes.set_axis_off()
                continue
            frame = run.frame(chosen[row][column])
            shown = draw_points(axes, run, frame, name, norm, options.plane)
            dress(axes, limits, options.plane, column == 0, row == rows - 1)
            axes.set_title((f"{run.label}: " if rows > 1 and column == 0 else "") + run.moment(frame), loc="left")
    figure.colorbar(shown, ax=grid, label=label_of(name, options), shrink=0.9, pad=0.01)
    return save(figure, options, f"{name}.png")


def picture_of_end(run, names, options):
    """The last moment, every field."""
    last = [len(run.files) - 1]
    limits = view_limits([run], [last], options.plane)
    columns = 2 if len(names) > 1 else 1
    rows = -(-len(names) // columns)
    width, height = panel_size(limits, columns)
    figure, grid = plt.subplots(rows, columns, squeeze=False, figsize=((width + 1.0) * columns, height * rows + 0.4))
    frame = run.frame(last[0])
    for k, axes in enumerate(grid.flat):
        if k >= len(names):
            axes.set_axis_off()
            continue
        norm = colour_range([run], [last], names[k])
        shown = draw_points(axes, run, frame, names[k], norm, options.plane)
        dress(axes, limits, options.plane, k % columns == 0, k // columns == rows - 1)
        figure.colorbar(shown, ax=axes, label=label_of(names[k], options), shrink=0.9, pad=0.01)
    figure.suptitle(f"{run.label}, {run.moment(frame)}", x=0.01, ha="left", fontsize=10)
    return save(figure, options, f"final_{slug(run.label)}.png")


def movie(run, name, options):
    """A short animation of one field."""
    frames = run.choose(None, min(options.frames, len(run.files)))
    limits = view_limits([run], [frames], options.plane)
    norm = colour_range([run], [frames], name)
    width, height = panel_size(limits, 1)
    figure, axes = plt.subplots(figsize=(1.4 * width + 0.9, 1.4 * height + 0.3))
    dress(axes, limits, options.plane, True, True)
    scale = matplotlib.cm.ScalarMappable(norm=norm, cmap=FIELDS[name][2])
    figure.colorbar(scale, ax=axes, label=label_of(name, options), shrink=0.9, pad=0.01)
    figure.canvas.draw()
    figure.set_layout_engine("none")
    path = options.out / f"{name}_{slug(run.label)}.gif"
    writer = animation.PillowWriter(fps=options.fps)
    with writer.saving(figure, str(path), dpi=80):
        for k in frames:
            frame = run.frame(k)
            shown = draw_points(axes, run, frame, name, norm, options.plane)
            axes.set_title(run.moment(frame), loc="left")
            writer.grab_frame()
            shown.remove()
    plt.close(figure)
    return path


# -------------------------------------------------------------------------------------------------------------- curves
def picture_of_front(runs, options):
    """Runout (largest x) and height (largest coordinate across) of the body over time."""
    i, j, _ = AXES[options.plane]
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.0))
    for run in runs:
        frames = [run.frame(k) for k in range(len(run.files))]
        time = [frame.time if frame.time is not None else frame.step for frame in frames]
        left.plot(time, [frame.position[:, i].max() for frame in frames], label=run.label)
        right.plot(time, [frame.position[:, j].max() for frame in frames], label=run.label)
    unit = "time [s]" if all(run.timestep for run in runs) else "step"
    left.set(xlabel=unit, ylabel=f"front, largest {options.plane[0]} [m]")
    right.set(xlabel=unit, ylabel=f"top, largest {options.plane[1]} [m]")
    if len(runs) > 1:
        left.legend(frameon=False)
    return save(figure, options, "runout.png")


def picture_of_curves(runs, options):
    """Thermo columns over time: --curves NAME=COLUMN ..., by default the kinetic energy."""
    # LIGGGHTS heads f_ID[i], c_ID and v_ID without the first two letters.
    split = [text.rpartition("=") for text in options.curves]
    wanted = [(name or column, re.sub("^[fcv]_", "", column)) for name, _, column in split]
    tables = [{re.sub("^[fcv]_", "", name): values for name, values in run.thermo().items()} for run in runs]
    if not any(column in table for table in tables for _, column in wanted):
        return None
    figure, grid = plt.subplots(1, len(runs), squeeze=False, sharey=True, figsize=(4.4 * len(runs) + 0.6, 3.0))
    for axes, run, table in zip(grid[0], runs, tables):
        scale = run.timestep or 1.0
        for name, column in wanted:
            if column in table:
                axes.plot(table["Step"] * scale, table[column], label=name)
        axes.set(xlabel="time [s]" if run.timestep else "step", title=run.label if len(runs) > 1 else "")
    grid[0][0].set_ylabel(options.curve_unit)
    grid[0][0].legend(frameon=False)
    return save(figure, options, "energy.png")


# ---------------------------------------------------------------------------------------------------------------- RVEs
def read_series(path):
    """Entries of a .pvd file: [(time, file)]."""
    root = xml.etree.ElementTree.parse(path).getroot()
    return [(float(entry.get("timestep")), path.parent / entry.get("file")) for entry in root.iter("DataSet")]


def read_rve(path):
    """Blocks grains, contacts, cell of one .vtm file as vtkPolyData."""
    reader = vtk.vtkXMLMultiBlockDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    blocks = reader.GetOutput()
    return [blocks.GetBlock(k) for k in range(3)]


def draw_rve(axes, path):
    """Returns the force of the thickest line, N."""
    largest = 0.0
    grains, contacts, cell = read_rve(path)
    x = vtk_to_numpy(grains.GetPoints().GetData())[:, :2]
    radius = vtk_to_numpy(grains.GetPointData().GetArray("radius"))
    corners = vtk_to_numpy(cell.GetPoints().GetData())[:4, :2]
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    for shift in [i * a + j * b for i in (-1, 0, 1) for j in (-1, 0, 1)]:  # periodic images, paler
        colour = ("#E8E4DC", "#B0A898") if not shift.any() else ("#F7F5F1", "#E4DFD6")
        axes.add_collection(collections.EllipseCollection(
            2 * radius, 2 * radius, np.zeros(len(x)), offsets=x + shift, units="xy", offset_transform=axes.transData,
            facecolors=colour[0], edgecolors=colour[1], linewidths=0.4, zorder=1 if not shift.any() else 0))
    if contacts is not None and contacts.GetNumberOfLines() > 0:  # a packing without contacts has no such block
        ends = vtk_to_numpy(contacts.GetPoints().GetData())[:, :2].reshape(-1, 2, 2)
        force = vtk_to_numpy(contacts.GetCellData().GetArray("force_normal"))
        bond = vtk_to_numpy(contacts.GetCellData().GetArray("bond")) != 0
        largest = max(np.percentile(abs(force), 99), 1e-300)
        widths = 0.2 + 3.0 * np.minimum(abs(force) / largest, 1.0)
        for pick, colour in (((force >= 0) & ~bond, LINES[0]), (bond, LINES[4]), ((force < 0), LINES[1])):
            if pick.any():
                axes.add_collection(collections.LineCollection(ends[pick], linewidths=widths[pick], colors=colour,
                                                               capstyle="round"))
    outline = corners[[0, 1, 3, 2, 0]]
    axes.plot(outline[:, 0], outline[:, 1], color="black", linewidth=0.8)
    axes.set_aspect("equal")
    axes.set_axis_off()
    edge = abs(corners).max(axis=0) + radius.max()
    axes.set_xlim(-edge[0], edge[0])
    axes.set_ylim(-edge[1], edge[1])
    return largest


def picture_of_rve(path, options):
    """One packing at the first, middle and last moment of its series: grains, force chains, cell."""
    entries = read_series(path)
    pick = sorted({0, len(entries) // 2, len(entries) - 1})
    figure, grid = plt.subplots(1, len(pick), squeeze=False, figsize=(3.6 * len(pick), 3.9))
    for axes, k in zip(grid[0], pick):
        largest = draw_rve(axes, entries[k][1])
        axes.set_title(f"t = {entries[k][0]:.3g} s, thickest line {largest:.3g} N", loc="left")
    handles = [plt.Line2D([], [], color=colour, linewidth=2) for colour in (LINES[0], LINES[4], LINES[1])]
    words = ["contact", "bond", "tension"]
    grid[0][0].legend(handles, words, loc="upper left", bbox_to_anchor=(0.0, 0.02), ncol=3, frameon=False,
                      fontsize=8, handlelength=1.0, columnspacing=1.0)
    return save(figure, options, f"rve_{slug(path.stem)}.png")


# ---------------------------------------------------------------------------------------------------------------- main
def slug(text):
    return re.sub(r"\W+", "_", text).strip("_") or "run"


def save(figure, options, name):
    path = options.out / name
    figure.savefig(path, dpi=options.dpi)
    plt.close(figure)
    return path


def arguments(words):
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0], epilog=__doc__.split("\n\n", 1)[1],
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", metavar="[LABEL=]FOLDER", help="folder with the point files of a run")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out"), help="where pictures go: %(default)s")
    parser.add_argument("--points", default="points_*.vt[kup]", help="pattern of the point files: %(default)s")
    parser.add_argument("--log", default="log.liggghts", help="name of the log file (default: %(default)s)")
    parser.add_argument("--fix", help="id of the fix mpm/couple, when columns of other fixes were dumped too")
    parser.add_argument("--fields", type=lambda text: text.split(","), help=f"comma list of: {', '.join(FIELDS)}")
    parser.add_argument("--times", type=lambda text: [float(word) for word in text.split(",")],
                        help="comma list of moments, s")
    parser.add_argument("--moments", type=int, default=4, help="number of moments, if --times is not given")
    parser.add_argument("--timestep", type=float, help="s; default: that of the log")
    parser.add_argument("--curves", nargs="+", default=["kinetic=KinEng"], metavar="NAME=COLUMN",
                        help="thermo columns for energy.png (default: kinetic=KinEng)")
    parser.add_argument("--curve-unit", default="energy [J]", help="label of their axis")
    parser.add_argument("--plane", choices=sorted(AXES), default="xy", help="axes of the picture (default: xy)")
    parser.add_argument("--rve", type=pathlib.Path, nargs="+", default=[], metavar="FILE.pvd",
                        help="series of fix mpm/vtk")
    parser.add_argument("--movie", choices=sorted(FIELDS), help="field of the animation (default: the first field)")
    parser.add_argument("--no-movie", action="store_true")
    parser.add_argument("--frames", type=int, default=60, help="most frames of the animation (default: 60)")
    parser.add_argument("--fps", type=int, default=15)
    parser.add_argument("--degree", default="°C", help="unit of temperature on labels (default: °C)")
    parser.add_argument("--dpi", type=int, default=130)
    return parser.parse_args(words)


def main(words=None):
    options = arguments(words)
    options.out.mkdir(parents=True, exist_ok=True)
    runs = [Run(text, options) for text in options.runs]
    names = available(runs, options.fields)
    written = [picture_of_moments(runs, name, options) for name in names]
    written += [picture_of_end(run, names, options) for run in runs]
    written += [picture_of_front(runs, options), picture_of_curves(runs, options)]
    written += [picture_of_rve(path, options) for path in options.rve]
    if not options.no_movie:
        written += [movie(run, options.movie or names[0], options) for run in runs]
    for path in filter(None, written):
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
