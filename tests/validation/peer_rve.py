# SPDX-License-Identifier: GPL-2.0-or-later
"""One periodic packing for several codes: reads dempm's packings, writes LIGGGHTS and LAMMPS data files, runs rve_run."""
import copy
import math
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("DEMPM_BUILD", ROOT / "build"))
COLUMNS = ["step", "sxx", "syy", "szz", "sxy", "sxz", "syz", "kinetic", "elastic", "friction", "damping",
           "coordination", "unbalanced", "volume", "solid", "bonds"]


class Packing:
    """.dimension, .edge [3] (an orthogonal cell), .position (from its lower corner), .radius"""

    def __init__(self, file):
        lines = pathlib.Path(file).read_text().splitlines()
        words = {line.split()[0]: line.split()[1:] for line in lines[:5]}
        start = next(k for k, line in enumerate(lines) if line.startswith("grains")) + 1
        cell = [float(word) for word in words["cell"]]
        rows = [[float(word) for word in line.split()] for line in lines[start:start + int(words["grains"][0])]]
        self.dimension = int(words["dimension"][0])
        self.edge = cell[0], cell[4], cell[8]
        # The generator's servo leaves a shear of about 1e-4 in the cell: dropped, for codes with orthogonal boxes.
        self.position = [[(row[k] + 0.5) * self.edge[k] if k < self.dimension else 0.0 for k in range(3)] for row in rows]
        self.radius = [row[3] for row in rows]

    def shifted(self, part):
        """The same packing, moved by a part of the cell's edges."""
        other = copy.copy(self)
        other.position = [[(x + part * edge) % edge if k < self.dimension else x
                           for k, (x, edge) in enumerate(zip(place, self.edge))] for place in self.position]
        return other

    def data(self, density, velocity=None, spin=None, rate=None, height=None):
        """Text of a data file for atom_style granular (LIGGGHTS) or sphere (LAMMPS). rate: affine velocities of this
        velocity gradient's diagonal about the centre. height: of the box in 2D, m."""
        n = len(self.radius)
        text = ["periodic packing", "", f"{n} atoms", "1 atom types", ""]
        for k, axis in enumerate("xyz"):
            low, high = (0.0, self.edge[k]) if k < self.dimension else (-0.5 * height, 0.5 * height)
            text.append(f"{low!r} {high!r} {axis}lo {axis}hi")
        text += ["", "Atoms", ""]
        text += [f"{i + 1} 1 {2 * self.radius[i]!r} {density!r} " + " ".join(repr(x) for x in self.position[i])
                 for i in range(n)]
        text += ["", "Velocities", ""]
        for i in range(n):
            v = list(velocity[i]) if velocity else [0.0] * 3
            if rate:
                v = [v[k] + rate[k] * (self.position[i][k] - 0.5 * self.edge[k]) for k in range(3)]
            w = spin[i] if spin else [0.0] * 3
            text.append(f"{i + 1} " + " ".join(repr(float(x)) for x in [*v, *w]))
        return "\n".join(text) + "\n"


# Packings are made by the kernels without special instructions: the same ones on any x86 processor.
PLAIN = {**os.environ, "DEMPM_ISA": "plain"}


def execute(command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    return done.returncode, done.stdout + done.stderr


def generate(file, **keywords):
    """dempm-pack generate; keywords as there, a pair for radius."""
    words = [str(word) for key, value in keywords.items()
             for word in [key, *(value if isinstance(value, (tuple, list)) else [value])]]
    code, output = execute([BUILD / "dempm-pack", "generate", file, *words], env=PLAIN)
    assert code == 0, output
    return file


def rve_run(packing, dimension, env=None, **keywords):
    """(columns by name, stable, last line) of build/tools/rve_run."""
    words = [str(word) for key, value in keywords.items()
             for word in [key, *(value if isinstance(value, (tuple, list)) else [value])]]
    code, output = execute([BUILD / "tools" / "rve_run", packing, dimension, *words], env=env)
    assert code in (0, 3), output
    lines = output.splitlines()
    rows = [[float(word) for word in line.split()] for line in lines if line[0] not in "#u"]
    return {name: [row[k] for row in rows] for k, name in enumerate(COLUMNS)}, code == 0, lines[-1]


def settle(packing, folder, density, steps, kt=0, **law):
    """Brings a packing to rest in its orthogonal cell, without friction if kt = 0. Returns the unbalanced force and the coordination."""
    data, grains = pathlib.Path(folder) / "settle.data", pathlib.Path(folder) / "settled.txt"
    data.write_text(packing.data(density, height=0.05))
    found, stable, _ = rve_run(data, packing.dimension, density=density, thickness=1.0, kt=kt, local=0.5, steps=steps,
                               grains=grains, env=PLAIN, **law)
    assert stable
    for i, line in enumerate(grains.read_text().splitlines()):
        place = [float(word) for word in line.split()[1:4]]
        packing.position[i] = [place[k] + 0.5 * packing.edge[k] if k < packing.dimension else 0.0 for k in range(3)]
    return found["unbalanced"][-1], found["coordination"][-1]


def zero_mean(vectors, weights):
    """Reading a packing takes the mean velocity away, weighted by R^dimension: it should be none."""
    total = math.fsum(weights)
    mean = [math.fsum(w * v[k] for w, v in zip(weights, vectors)) / total for k in range(3)]
    return [[v[k] - mean[k] for k in range(3)] for v in vectors]
