# SPDX-License-Identifier: GPL-2.0-or-later
"""Every wrong script ends with an exit code, names the fix, what was given and what is allowed; it hangs on no rank."""
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parent / "bad_input"))
from bond_cases import BOND_BASE, BOND_CASES  # noqa: E402
from cases import BASE, CASES, FILES  # noqa: E402
from heat_cases import HEAT_BASE, HEAT_CASES  # noqa: E402
from rest_cases import REST_CASES  # noqa: E402

ALL = CASES + HEAT_CASES + BOND_CASES + REST_CASES

TIMEOUT = 20  # s; a wrong script ends in well under one


@pytest.mark.parametrize("np", [1, 2])
@pytest.mark.parametrize("script", [BASE, HEAT_BASE, BOND_BASE], ids=["mpm", "heat", "bond"])
def test_script_without_mistake_runs(dempm, script, np):
    run = dempm(script, np=np, files=FILES, timeout=TIMEOUT)
    assert "Loop time" in run.output


def test_there_are_at_least_60_distinct_wrong_scripts():
    cases = ALL
    scripts = {case.script() for case in cases}
    assert len(scripts) == len(cases) == len({case.name for case in cases}) >= 60
    assert not scripts & {BASE, HEAT_BASE, BOND_BASE}


@pytest.mark.parametrize("np", [1, 2])
@pytest.mark.parametrize("case", ALL, ids=lambda case: case.name)
def test_refused(dempm, case, np):
    run = dempm(case.script(), np=np, files=FILES, timeout=TIMEOUT, check=False)
    assert run.code > 0, f"exit code {run.code}\n{run.output[-2000:]}"
    errors = " ".join(" ".join(line for line in run.output.splitlines() if "ERROR" in line).split())
    lacking = [word for word in (f"Fix {case.style} (id ", *case.words) if word not in errors]
    assert not lacking, f"the message lacks {lacking}\n{errors or run.output[-2000:]}"
    for signal in ("Segmentation fault", "signal: Aborted", "signal 6", "signal 11"):
        assert signal not in run.output
