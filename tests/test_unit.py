# SPDX-License-Identifier: GPL-2.0-or-later
"""One test per executable of tests/unit (its cmocka report is shown when it fails); test_mpi_* on 1, 2, 3, 4 ranks."""
import os
import pathlib
import re

import pytest

from conftest import BUILD, MPIRUN, ROOT, execute

SOURCES = sorted(path for path in (ROOT / "tests" / "unit").glob("test_*") if path.suffix in (".c", ".cpp"))
BACKEND = os.environ.get("DEMPM_BACKEND")  # cpu or cuda: handed to the tests of the RVE engine


def cases():
    for source in SOURCES:
        ranks = (1, 2, 3, 4) if source.name.startswith("test_mpi_") else (0,)
        for np in ranks:
            yield pytest.param(source, np, id=source.stem + (f"-np{np}" if np else ""))


@pytest.mark.parametrize("source, np", cases())
def test_unit(source, np, tmp_path):
    program = pathlib.Path(BUILD) / "tests" / source.stem
    assert program.exists(), f"{program} was not built"
    command = ([MPIRUN, "-np", np] if np else []) + [program]
    if BACKEND and source.name.startswith("test_rve"):
        command.append(BACKEND)
    code, output = execute(command, cwd=tmp_path, timeout=900, threads=1 if np > 1 else 2)
    assert code == 0, f"exit code {code}\n{output[-6000:]}"
    assert re.search(r"\[  PASSED  \] \d+ test", output), f"no cmocka summary\n{output[-3000:]}"
