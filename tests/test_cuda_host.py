# SPDX-License-Identifier: GPL-2.0-or-later
"""The source of the CUDA backend, run on the host (tests/cuda_host): it answers as the CPU does, and who runs first between two barriers
changes no bit."""
import re

import pytest

from conftest import BUILD, execute

PROGRAM = BUILD / "cuda_host" / "test_rve_device"
TESTS = ["the_device_answers_as_the_cpu_does", "answers_do_not_depend_on_where_states_lie", "states_move_between_device_and_cpu"]


@pytest.mark.skipif(not PROGRAM.exists(), reason="built by make test only")
def test_threads_of_the_device_in_any_order():
    answers = {}
    for order in ("forward", "reverse", "shuffle"):
        code, output = execute([PROGRAM], timeout=300, extra={"DEMPM_CUDA_HOST_ORDER": order})
        assert code == 0, output
        assert all(re.search(rf"\[       OK \] {name}\b", output) for name in TESTS), output
        answers[order] = re.findall(r"(\dD): answers (\w+)", output)
    assert len(answers["forward"]) == 2 and answers["reverse"] == answers["shuffle"] == answers["forward"]
