# SPDX-License-Identifier: GPL-2.0-or-later
"""Every cmocka test function of tests/unit is one test here; those of test_mpi_* run on 1, 2, 3 and 4 ranks."""
import functools
import os
import pathlib
import re
import tempfile

import pytest

from conftest import BUILD, MPIRUN, ROOT, execute

SOURCES = sorted(path for path in (ROOT / "tests" / "unit").glob("test_*") if path.suffix in (".c", ".cpp"))
FUNCTION = re.compile(r"\bcmocka_unit_test(?:_\w+)?\(\s*(\w+)")
BACKEND = os.environ.get("DEMPM_BACKEND")  # cpu or cuda: handed to the tests of the RVE engine


def cases():
    for source in SOURCES:
        names = list(dict.fromkeys(FUNCTION.findall(source.read_text())))
        for np in (1, 2, 3, 4) if source.name.startswith("test_mpi_") else (0,):
            for name in names or ["main"]:
                yield pytest.param(source.name, np, name, id=f"{source.stem}{f'-np{np}' if np else ''}-{name}")


@functools.lru_cache(maxsize=None)
def report(source, np):
    """Runs a test executable once; returns (exit code, output)."""
    program = pathlib.Path(BUILD) / "tests" / pathlib.Path(source).stem
    assert program.exists(), f"{program} was not built"
    command = ([MPIRUN, "-np", np] if np else []) + [program]
    if BACKEND and source.startswith("test_rve"):
        command.append(BACKEND)
    with tempfile.TemporaryDirectory() as directory:
        # Open MPI's own leaks come from plug-ins that it has unloaded: nothing is left to suppress them by.
        extra = {"ASAN_OPTIONS": "detect_leaks=0"} if np else None
        return execute(command, cwd=directory, timeout=900, threads=1 if np > 1 else 2, extra=extra)


@pytest.mark.parametrize("source, np, name", cases())
def test_unit(source, np, name):
    code, output = report(source, np)
    if code == 0 and re.search(rf"\[  SKIPPED \] {name}\b", output):
        pytest.skip("needs a device")
    if code == 0:
        # Ranks write at once and may cut each other's lines: there the exit code has to do.
        assert np or name == "main" or re.search(rf"\[       OK \] {name}\b", output), f"{name} did not run\n{output}"
        return
    failed = set(re.findall(r"\[  FAILED  \] (\w+)", output))
    passed = set(re.findall(r"\[       OK \] (\w+)", output)) - failed
    assert failed and name in passed, f"exit code {code}\n{output[-6000:]}"
