# SPDX-License-Identifier: GPL-2.0-or-later
"""Fixtures of the scene tests.

`dempm(script, np=..., variables=..., files=...)` runs build/dempm in a directory of its own and returns a Run;
`liggghts(...)` does the same with the stock program. A run that does not end in `timeout` seconds is a failure:
a hang is the worst answer a program can give on several ranks.
"""
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = pathlib.Path(os.environ.get("DEMPM_BUILD", ROOT / "build"))
MPIRUN = os.environ.get("MPIRUN", "mpirun")
STOCK = "/usr/bin/liggghts"


def environment(threads=1):
    """Open MPI refuses root and more ranks than cores unless told; ranks that wait must not burn the others' core."""
    settings = {
        "OMP_NUM_THREADS": str(threads),
        "DEMPM_TEST_DATA": str(ROOT / "tests" / "data"),
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "OMPI_MCA_mpi_yield_when_idle": "1",
        "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
        "OMPI_MCA_btl_base_warn_component_unused": "0",
        "OMPI_MCA_odls_base_sigkill_timeout": "0",  # after an error mpirun would wait a second or two for each rank
    }
    return {**os.environ, **settings}


def bound_files():
    """A program that repeats a message for ever also fills its log: it ends there, not in the memory of the test."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 28, 1 << 28))


def execute(command, cwd=None, timeout=120, threads=1, extra=None):
    """Runs a command; returns (exit code, stdout + stderr). After `timeout` seconds it is ended and the test fails."""
    process = subprocess.Popen([str(word) for word in command], cwd=cwd, text=True,
                               env={**environment(threads), **(extra or {})},
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                               errors="replace", start_new_session=True, preexec_fn=bound_files)
    try:
        output, _ = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGTERM)
        try:
            output, _ = process.communicate(timeout=5)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output, _ = process.communicate()
        words = " ".join(str(word) for word in command)
        pytest.fail(f"no end after {timeout} s: {words}\n{output[-3000:]}", pytrace=False)
    return process.returncode, output


class Run:
    """What a run left: .code, .output (screen), .path (directory), .log (text), .thermo (one dict of columns per
    `run` command; values are floats), .table (the last of them)."""

    def __init__(self, code, output, path):
        self.code, self.output, self.path = code, output, pathlib.Path(path)
        log = self.path / "log.liggghts"
        self.log = log.read_text(errors="replace") if log.exists() else ""
        self.thermo = parse_thermo(self.log)

    @property
    def table(self):
        assert self.thermo, f"no thermo output:\n{self.output[-3000:]}"
        return self.thermo[-1]

    def dump(self, name):
        """Frames of a text dump: list of (step, {column: list of floats})."""
        return parse_dump((self.path / name).read_text())


class Table(dict):
    """Thermo columns by name. LIGGGHTS heads f_ID[i], c_ID, v_ID without the first two letters: both are found."""

    def __missing__(self, name):
        if name[:2] in ("f_", "c_", "v_") and name[2:] in self:
            return self[name[2:]]
        raise KeyError(f"{name}; there are: {', '.join(self)}")


def parse_thermo(log):
    """LIGGGHTS prints a header line of column names (first word Step), rows of numbers and `Loop time` at the end."""
    tables, columns = [], None
    for line in log.splitlines():
        words = line.split()
        if words and words[0] == "Step":
            columns = words
            tables.append(Table((name, []) for name in columns))
        elif line.startswith("Loop time"):
            columns = None
        elif columns and len(words) == len(columns):
            try:
                values = [float(word) for word in words]
            except ValueError:
                continue
            for name, value in zip(columns, values):
                tables[-1][name].append(value)
    return tables


def parse_dump(text):
    frames, lines = [], iter(text.splitlines())
    step = count = 0
    for line in lines:
        if line.startswith("ITEM: TIMESTEP"):
            step = int(next(lines))
        elif line.startswith("ITEM: NUMBER OF ATOMS"):
            count = int(next(lines))
        elif line.startswith("ITEM: ATOMS"):
            names = line.split()[2:]
            rows = [[float(word) for word in next(lines).split()] for _ in range(count)]
            frames.append((step, {name: [row[k] for row in rows] for k, name in enumerate(names)}))
    return frames


@pytest.fixture
def runner(tmp_path):
    """runner(program, script, np=1, variables={}, files=[], cwd=None, timeout=120, check=True, threads=1) -> Run.
    `script` is a path or the text of one; `files` (paths, or {name: text}) are copied beside it."""

    def run(program, script, np=1, variables=None, files=(), cwd=None, timeout=120, check=True, threads=1):
        path = pathlib.Path(cwd) if cwd else tmp_path
        path.mkdir(parents=True, exist_ok=True)
        if isinstance(files, dict):
            for name, text in files.items():
                (path / name).write_text(text)
        else:
            for file in files:
                shutil.copy(file, path)
        if "\n" in str(script):
            (path / "in.script").write_text(script)
            script = "in.script"
        command = [program, "-in", script]
        for name, value in (variables or {}).items():
            values = value if isinstance(value, (list, tuple)) else [value]
            command += ["-var", name, *values]
        if np > 1:
            command = [MPIRUN, "-np", np, *command]
        code, output = execute(command, cwd=path, timeout=timeout, threads=threads)
        if check and code != 0:
            pytest.fail(f"exit code {code}: {' '.join(map(str, command))}\n{output[-3000:]}", pytrace=False)
        return Run(code, output, path)

    return run


@pytest.fixture
def dempm(runner):
    return lambda script, **options: runner(BUILD / "dempm", script, **options)


@pytest.fixture
def liggghts(runner):
    return lambda script, **options: runner(STOCK, script, **options)


def pytest_report_header(config):
    return re.sub(r"\s+", " ", f"dempm: build in {os.path.relpath(BUILD, ROOT)}")
