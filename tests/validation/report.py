# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs, rows and figures of `make validate`: build/validate/report.json, a list of rows {"case", "quantity", "error",
"bound", "pass", "seconds"} as those of `make verify`."""
import hashlib
import json
import os
import pathlib
import resource
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")  # before any module draws
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from conftest import BUILD, STOCK, environment, parse_dump, parse_thermo  # noqa: E402

FOLDER = BUILD / "validate"


class Report:
    """Collects the rows of one case."""

    def __init__(self, case):
        self.case, self.rows = case, []

    def check(self, quantity, error, bound, seconds=None):
        """error <= bound passes; bound None: for information."""
        error = float(error)
        passes = None if bound is None else bool(error <= bound)
        self.rows.append({"case": self.case, "quantity": quantity, "error": error, "bound": bound, "pass": passes,
                          "seconds": None if seconds is None else round(seconds, 2)})
        verdict = "" if bound is None else f" <= {bound:g} {'ok' if passes else 'FAILS'}"
        print(f"{self.case}: {quantity}: {error:.4g}{verdict}", flush=True)

    def write(self):
        """Into the file, in the place of the rows of an earlier run; those of other cases stay. Returns an exit code: 1 if a bound is
        missed."""
        file = FOLDER / "report.json"
        others = [row for row in (json.loads(file.read_text()) if file.exists() else []) if row["case"] != self.case]
        FOLDER.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(others + self.rows, indent=1) + "\n")
        return int(any(row["pass"] is False for row in self.rows))

    def save(self, figure, name):
        FOLDER.mkdir(parents=True, exist_ok=True)
        figure.savefig(FOLDER / f"{name}.png", dpi=100, bbox_inches="tight")


class Run:
    """A script in a folder of its own; .thermo, .dump(name) and .seconds of processor time. A run that has ended with the
    same script, files and program is not repeated."""

    def __init__(self, name, script, files=None, program=None, again=False):
        program = pathlib.Path(program or BUILD / "dempm")
        self.path = FOLDER / name
        text = json.dumps([script, files or {}, program.stat().st_mtime])
        wanted, mark = hashlib.sha256(text.encode()).hexdigest(), self.path / "finished.json"
        done = json.loads(mark.read_text()) if mark.exists() else {}
        if again or done.get("wanted") != wanted:
            self.path.mkdir(parents=True, exist_ok=True)
            mark.unlink(missing_ok=True)
            for file, content in {**(files or {}), "in.script": script}.items():
                (self.path / file).write_text(content)
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            with open(self.path / "screen", "w") as screen:
                code = subprocess.run([str(program), "-in", "in.script"], cwd=self.path, env=environment(1), stdin=subprocess.DEVNULL,
                                      stdout=screen, stderr=subprocess.STDOUT).returncode
            if code != 0:
                sys.exit(f"{name} ended with {code}\n{(self.path / 'screen').read_text(errors='replace')[-2000:]}")
            done = {"wanted": wanted, "seconds": resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before}
            mark.write_text(json.dumps(done))
        self.seconds = done["seconds"]
        self.thermo = parse_thermo((self.path / "log.liggghts").read_text(errors="replace"))

    def dump(self, name):
        return parse_dump((self.path / name).read_text())


def stock():
    return STOCK if os.path.exists(STOCK) else None
