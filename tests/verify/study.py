# SPDX-License-Identifier: GPL-2.0-or-later
"""What the cases of `make verify` share: runs of build/dempm, the report, figures.

A case is a module case_NAME with verify(study), which runs scripts from examples/ by study.run(...) and states errors by
study.check(...)."""
import dataclasses
import hashlib
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent.parent), str(pathlib.Path(__file__).resolve().parent)]
import resume  # noqa: E402
from conftest import BUILD, ROOT, environment, parse_dump, parse_thermo  # noqa: E402

EXAMPLES = ROOT / "examples"
PACKINGS = pathlib.Path(__file__).resolve().parent / "packings"
THREADS = len(os.sched_getaffinity(0))


@dataclasses.dataclass
class Run:
    """One finished run: its folder, wall seconds, processor seconds (user time of all its threads), and what it cost."""
    path: pathlib.Path
    seconds: float
    processor: float
    points: int
    grains: int      # per point; 0 = continuum law
    dem_steps: int   # per packing, mean over the packings
    thermo: list

    @property
    def table(self):
        return self.thermo[-1]

    def dump(self, name):
        return parse_dump((self.path / name).read_text())


class Study:
    """Collects rows {"case", "quantity", "error", "bound", "pass", "seconds", "points", "grains", "dem_steps"}."""

    def __init__(self, case, folder, full):
        self.case, self.full, self.folder = case, full, folder / case
        self.folder.mkdir(parents=True, exist_ok=True)
        self.rows, self.notes, self.figures = [], [], []

    def run(self, name, script, variables=None, folders=(), files=(), grains=0, timeout=None, ranks=1, threads=THREADS):
        """Runs a script of examples/ in a folder of its own, with the files of `folders` (of examples/) beside it. A run
        that has ended with the same variables, files and program is not repeated: its results are read again. A variable's
        value is one word of the command line, spaces and all; a list gives several."""
        path = self.folder / name
        variables = {key: [str(v) for v in value] if isinstance(value, (list, tuple)) else [str(value)]
                     for key, value in (variables or {}).items()}
        program = BUILD / "dempm"
        mark = path / "finished.json"
        sources = [f for folder in folders for f in (EXAMPLES / folder).iterdir() if f.is_file() and f.suffix != ".md"] + list(files)
        digest = hashlib.sha256()
        for source in sorted(sources, key=lambda f: f.name):
            digest.update(source.name.encode() + source.read_bytes())
        wanted = {"script": str(script), "variables": variables, "program": program.stat().st_mtime, "files": digest.hexdigest()}
        if mark.exists() and json.loads(mark.read_text())["wanted"] == wanted:
            return self.read(path, json.loads(mark.read_text()), grains)
        begun = path / "begun.json"  # what was cut goes on only with the same program and files
        cut = begun.exists() and json.loads(begun.read_text())["wanted"] == wanted
        if not cut:
            shutil.rmtree(path, ignore_errors=True)
            path.mkdir(parents=True)
            for source in sources:
                shutil.copy(source, path)
            (path / "out").mkdir(exist_ok=True)
            begun.write_text(json.dumps({"wanted": wanted, "seconds": 0.0, "processor": 0.0}))
        launch = [os.environ.get("MPIRUN", "mpirun"), "-np", str(ranks)] if ranks > 1 else []
        words = [w for key, value in variables.items() for w in ("-var", key, *value)]
        code = self.go_on(name, path, script, lambda file: [*launch, program, "-in", file, *words],
                          environment(max(threads // ranks, 1)), timeout)
        if code != 0:
            tail = "\n".join((path / "screen").read_text(errors="replace").splitlines()[-8:])
            raise RuntimeError(f"{self.case}: {name} ended with {code}\n{tail}")
        resume.merge(path)
        for file in resume.restart_files(path):
            file.unlink()
        spent = json.loads(begun.read_text())
        done = {"wanted": wanted, "seconds": round(spent["seconds"], 2), "processor": round(spent.get("processor", 0.0), 2)}
        mark.write_text(json.dumps(done))
        return self.read(path, done, grains)

    def go_on(self, name, path, script, command, env, timeout):
        """Runs a script from its start, or, if it was cut, from its newest restart file that is whole. Returns the exit code."""
        text = (path / script).read_text()
        if not (self.full and resume.RUN.search(text)):
            return self.launch(name, path, command(script), env, timeout, None)
        (path / "in.saving").write_text(resume.with_restarts(text))
        resume.set_aside(path)
        first = path / "part.0" / "log.liggghts"
        last = resume.last_step(first.read_text(errors="replace")) if first.exists() else None
        for saved in resume.restart_files(path) if last is not None else []:
            (path / "in.resumed").write_text(resume.continuation(text, saved.name, last))
            code = self.launch(name, path, command("in.resumed"), env, timeout, last)
            if code == 0 or resume.first_step((path / "log.liggghts").read_text(errors="replace")) is not None:
                return code
        for part in path.glob("part.*"):
            shutil.rmtree(part)
        return self.launch(name, path, command("in.saving"), env, timeout, None)

    def launch(self, name, path, command, env, timeout, last):
        """Runs a command and tells its progress; the seconds that it took, also if it is cut, join those of earlier parts."""
        begun, start = path / "begun.json", time.monotonic()
        before, used = json.loads(begun.read_text()), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime

        def note(processor):
            begun.write_text(json.dumps({**before, "seconds": before["seconds"] + time.monotonic() - start,
                                         "processor": before.get("processor", 0.0) + processor}))

        with open(path / "screen", "w") as screen:
            process = subprocess.Popen([str(word) for word in command], cwd=path, env=env, stdin=subprocess.DEVNULL, stdout=screen,
                                       stderr=subprocess.STDOUT)
            told = (start, 0.0)
            while process.poll() is None:
                passed = time.monotonic() - start
                note(resume.user_time(process.pid))
                if timeout and passed > timeout:
                    process.kill()
                    process.wait()
                    raise subprocess.TimeoutExpired(command, timeout)
                told = self.tell_progress(name, path, start, last, told, process)
                time.sleep(min(1.0, 0.01 + 0.05 * passed))
        note(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - used)
        return process.returncode

    def tell_progress(self, name, path, start, last, told, process):
        """Every minute, or 10 %: part of the run that is done, and time that the rest will take. told: (when, part) last time."""
        if not self.full or time.monotonic() - told[0] < 5.0 or not (path / "log.liggghts").exists():
            return told
        log = (path / "log.liggghts").read_text(errors="replace")
        end = last if last is not None else resume.last_step(log)
        first, step = resume.first_step(log), resume.present_step(log)
        if end is None or step is None or step == first:
            return told
        part, now = (step - first) / (end - first), time.monotonic()
        if part - told[1] < 0.1 and now - told[0] < 60.0:
            return told
        left = (now - start) * (1.0 - part) / part
        print(f"  {self.case}: {name}: step {step} of {end}, {100 * part:.0f} %, {left / 60:.0f} min left", flush=True)
        return now, part

    def read(self, path, done, grains):
        log = (path / "log.liggghts").read_text(errors="replace")
        thermo = parse_thermo(log)
        told = thermo[-1]["Atoms"][:1] if thermo and "Atoms" in thermo[-1] else re.findall(r"^Fix \S+: (\d+) RVEs of", log, re.M)[-1:]
        points = int(told[0]) if told else 0
        particle_steps = thermo[-1].get("mpm[12]", [0])[-1] if thermo else 0
        dem_steps = round(particle_steps / (points * grains)) if points and grains else 0
        return Run(path, done["seconds"], done.get("processor", 0.0), points, grains, dem_steps, thermo)

    def check(self, quantity, error, bound, run, seconds=None):
        """error <= bound passes; both in the unit that the quantity's name tells. bound None: for information."""
        error = float(error)
        self.rows.append({"case": self.case, "quantity": quantity, "error": error, "bound": bound,
                          "pass": None if bound is None else bool(error <= bound),
                          "seconds": run.seconds if seconds is None else seconds, "points": run.points, "grains": run.grains,
                          "dem_steps": run.dem_steps})
        verdict = "" if bound is None else f" <= {bound:g} {'ok' if error <= bound else 'FAILS'}"
        print(f"  {self.case}: {quantity}: {error:.3g}{verdict}  ({run.seconds:.0f} s)", flush=True)

    def note(self, text):
        """A sentence for the report."""
        self.notes.append(text)
        print(f"  {self.case}: {text}", flush=True)

    def save(self, figure, name):
        """A figure of the report."""
        path = self.folder.parent / f"{name}.png"
        figure.savefig(path, dpi=100, bbox_inches="tight")
        plt.close(figure)
        self.figures.append(path.name)

    def pack(self, name, threads=THREADS, **settings):
        """A packing by dempm-pack, made once; its path. Those of the folder packings/ are inputs that stay the same."""
        path = self.folder / f"{name}.packing"
        words = [str(w) for key, value in settings.items() for w in (key, *(value if isinstance(value, tuple) else (value,)))]
        kept = json.loads((PACKINGS / "made.json").read_text()).get(f"{self.case}_{name}.packing")
        if kept == words:
            return pathlib.Path(shutil.copyfile(PACKINGS / f"{self.case}_{name}.packing", path))
        mark = path.with_suffix(".made")
        if not (path.exists() and mark.exists() and mark.read_text() == str(words)):
            subprocess.run([str(BUILD / "dempm-pack"), "generate", str(path), *words], check=True, stdout=subprocess.PIPE,
                           env=environment(threads))
            mark.write_text(str(words))
        return path

    def element(self, name, packing, path, **settings):
        """An element test by dempm-rve; its columns as arrays. `__` in a name stands for `/`."""
        out = self.folder / f"{name}.csv"
        sets = [word for key, value in settings.items() for word in ("--set", f"{key.replace('__', '/')}={value}")]
        subprocess.run([str(w) for w in (BUILD / "dempm-rve", "run", packing, "--path", path, "--dimension", 2, "--out", out, *sets)],
                       check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment(THREADS))
        return np.genfromtxt(out, delimiter=",", names=True)
