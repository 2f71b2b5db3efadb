# SPDX-License-Identifier: GPL-2.0-or-later
"""The source of the CUDA backend, run on the host (tests/cuda_host): it answers as the CPU does, and who runs first between two barriers
changes no bit."""
import re
import sys

import pytest

from conftest import BUILD, MPIRUN, ROOT, execute

sys.path.insert(0, str(ROOT / "tests" / "scenes"))
from scripts import state  # noqa: E402
from test_rve_scene import first, packing  # noqa: E402

HOST = BUILD / "cuda_host"
built = pytest.mark.skipif(not (HOST / "dempm").exists(), reason="built by make test only")
TESTS = ["the_device_answers_as_the_cpu_does", "answers_do_not_depend_on_where_states_lie", "states_move_between_device_and_cpu",
         "flights_are_those_of_the_cpu", "a_device_without_room_hands_a_new_batch_to_the_cpu",
         "a_device_that_becomes_too_small_hands_over_to_the_cpu", "a_batch_can_leave_the_device"]


@built
def test_threads_of_the_device_in_any_order():
    answers = {}
    for order in ("forward", "reverse", "shuffle"):
        code, output = execute([HOST / "test_rve_device"], timeout=300, extra={"DEMPM_CUDA_HOST_ORDER": order})
        assert code == 0, output
        assert all(re.search(rf"\[       OK \] {name}\b", output) for name in TESTS), output
        answers[order] = re.findall(r"(\dD): answers (\w+)", output)
    assert len(answers["forward"]) == 2 and answers["reverse"] == answers["shuffle"] == answers["forward"]


@built
@pytest.mark.parametrize("np", [1, 3])
def test_ranks_leave_devices_together(np):
    code, output = execute([MPIRUN, "-np", np, HOST / "test_mpi_device"], timeout=200)
    assert code == 0 and "[       OK ] all_ranks_leave" in output and "SKIPPED" not in output, output


@built
@pytest.mark.parametrize("np, memory", [(1, None), (2, None), (2, "1")])
def test_a_scene_with_a_device(np, memory, runner, tmp_path, monkeypatch):
    """Two devices for two ranks; with memory for nothing, one warning, then the CPU."""
    monkeypatch.setenv("DEMPM_CUDA_HOST_DEVICES", "2")
    if memory:
        monkeypatch.setenv("DEMPM_CUDA_HOST_MEMORY", memory)
    script, files = first(False, "run 10\n").replace("dump state all custom 100", "dump state all custom 10"), {"grains.data": packing()}
    script = script.replace("thermo 50", "thermo 5")
    there = runner(HOST / "dempm", script, np=np, files=files, cwd=tmp_path / "there", timeout=300)
    here = runner(HOST / "dempm", script.replace("damping viscous", "backend cpu damping viscous"), files=files, cwd=tmp_path / "here")
    assert there.output.count("GPU's memory is too small") == (1 if memory else 0), there.output
    for name, values in here.table.items():
        scale = max(abs(value) for value in values)
        assert all(abs(a - b) <= 1e-9 * scale for a, b in zip(there.table[name], values)), name
    assert here.table["mpm[10]"][-1] == 48.0
    assert memory or state(there, 10) != state(here, 10), "no last bit differs: was a device used at all?"
