# SPDX-License-Identifier: GPL-2.0-or-later
"""The DEM codes that `make bench` compares: how each is started, and what is read from its output.

A result is a dict: seconds (wall time of the steps alone, by the code's own clock), sxx and syy at the end (compression
positive, Pa; 2D: N/m), coordination_start, coordination_end, rebuilds (None: the code does not tell).
"""
import json
import os
import pathlib
import re
import shutil
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
DATA = {2: HERE / "data" / "disks.data", 3: HERE / "data" / "spheres.data"}
GRAINS = {2: 400, 3: 1000}
STEPS = 20000


class Failure(Exception):
    """A code did not do the job."""


def environment(**more):
    """One thread, and no complaint of Open MPI's about who starts it."""
    return {**os.environ, "OMP_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
            "OMPI_MCA_btl_base_warn_component_unused": "0", **more}


def execute(command, cores, folder, **more):
    """Output of a command pinned to `cores`."""
    pinned = ["taskset", "-c", ",".join(str(core) for core in cores)] + [str(word) for word in command]
    done = subprocess.run(pinned, cwd=folder, env=environment(**more), text=True, errors="replace",
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=900)
    if done.returncode != 0:
        raise Failure(f"{' '.join(pinned)}: exit code {done.returncode}\n{done.stdout[-2000:]}")
    return done.stdout


def last_json(output):
    """The JSON object on the last line that has one."""
    for line in reversed(output.splitlines()):
        if "{" in line:
            return json.loads(line[line.index("{"):])
    raise Failure("no result in:\n" + output[-2000:])


class Dempm:
    skins = [0.0, 0.04, 0.06, 0.08, 0.12, 0.16]  # of the largest radius; 0: found by itself

    def __init__(self, name, label, build, *settings):
        self.name, self.label, self.program, self.settings = name, label, build / "bench" / "bench_rve_shear", settings

    def present(self):
        return self.program.exists()

    def command(self, dimension, skin, steps):
        # As many repetitions as make a run of about a second, or as long as the others' where skins are tried: shorter ones would
        # be at the mercy of the timer tick.
        repeat = 10 if dimension == 2 else 2
        return [self.program, DATA[dimension], dimension, "steps", steps, "skin", skin, "repeat", repeat, *self.settings]

    def read(self, output):
        result = last_json(output)
        result["repeats"] = result["seconds"]
        result["seconds"] = sum(result["repeats"]) / len(result["repeats"])
        return result


class Lammps:
    """LAMMPS, and LIGGGHTS, which has kept its parent's input and output."""
    skins = [1e-4, 2e-4, 4e-4, 7e-4, 1e-3]  # m

    def __init__(self, name, label, program, script, folder):
        self.name, self.label, self.program, self.script, self.folder = name, label, program, script, folder

    def present(self):
        return shutil.which(self.program) is not None

    def data(self, dimension):
        if dimension == 3 or "liggghts" not in self.script:
            return DATA[dimension]
        # LIGGGHTS takes grains of a 2D run for disks of unit depth: densities that give the spheres' masses.
        copy = self.folder / "disks.liggghts.data"
        lines = DATA[2].read_text().splitlines()
        for k, words in enumerate(line.split() for line in lines):
            if len(words) == 7 and words[0].isdigit():
                words[3] = repr(float(words[3]) * 2.0 / 3.0 * float(words[2]))
                lines[k] = " ".join(words)
        copy.write_text("\n".join(lines) + "\n")
        return copy

    def command(self, dimension, skin, steps):
        words = [self.program, "-in", HERE / self.script, "-log", "none"]
        for key, value in (("dim", dimension), ("data", self.data(dimension)), ("skin", skin), ("steps", steps)):
            words += ["-var", key, value]
        return words

    def read(self, output):
        loop = re.search(r"Loop time of (\S+) on", output)
        rows = [line.split() for line in output.splitlines() if re.fullmatch(r"\s*\d+(\s+[-+.\deE]+){3}\s*", line)]
        builds = re.search(r"Neighbor list builds = (\d+)", output)
        if not loop or len(rows) < 2:
            raise Failure(f"{self.name}: no result in:\n" + output[-2000:])
        return {"seconds": float(loop[1]), "sxx": float(rows[-1][2]), "syy": float(rows[-1][3]),
                "coordination_start": float(rows[0][1]), "coordination_end": float(rows[-1][1]),
                "rebuilds": int(builds[1]) if builds else None}


class Yade:
    name, label = "yade", "YADE"
    skins = Lammps.skins

    def present(self):
        return shutil.which("yade") is not None

    def command(self, dimension, skin, steps):
        return ["yade", "-j1", "-n", "-x", HERE / "rve_yade.py", dimension, DATA[dimension], skin, steps]

    def read(self, output):
        return last_json(output[output.find("RESULT"):])


def all_codes(build, folder):
    """Those that are there. A native LAMMPS stands beside Debian's."""
    native = os.environ.get("LAMMPS_NATIVE") or str(build / "bench" / "lammps-native" / "lmp")
    codes = [Dempm("dempm", "dempm", build), Dempm("dempm_dashpots", "dempm, dashpots", build, "damping", "viscous"),
             Dempm("dempm_mixed", "dempm, mixed precision", build, "mixed", 1),
             Lammps("liggghts", "LIGGGHTS", "liggghts", "in.rve_liggghts", folder),
             Lammps("lammps", "LAMMPS", "lmp", "in.rve_lammps", folder),
             Lammps("lammps_native", "LAMMPS, native", native, "in.rve_lammps", folder), Yade()]
    return [code for code in codes if code.present()]
