# SPDX-License-Identifier: GPL-2.0-or-later
"""The tests of single packings with the kernels of every instruction set that this machine has; test_unit.py runs them with the best one."""
import pathlib
import re

import pytest

from conftest import BUILD, ROOT, execute

AVX512 = {"avx512f", "avx512dq", "avx512vl", "avx512bw", "avx2", "fma"}
NEEDS = {"plain": set(), "avx2": {"avx2", "fma"}, "avx512": AVX512, "avx512_whole": AVX512}
PROGRAMS = ["test_rve_crystal", "test_rve_energy", "test_rve_gas", "test_rve_limits", "test_rve_resting"]


def flags():
    """What the processor can do, as Linux tells."""
    info = pathlib.Path("/proc/cpuinfo")
    found = re.search(r"^flags\s*: (.*)$", info.read_text(), re.M) if info.exists() else None
    return set(found[1].split()) if found else set()


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("isa", NEEDS)
def test_packings(isa, program):
    if not NEEDS[isa] <= flags():
        pytest.skip(f"this machine lacks {isa}")
    code, output = execute([BUILD / "tests" / program, "cpu"], timeout=600, threads=2, extra={"DEMPM_ISA": isa})
    assert code == 0 and "[  PASSED  ]" in output, output[-6000:]


@pytest.mark.parametrize("isa", NEEDS)
def test_the_variable_chooses(isa, tmp_path):
    if not NEEDS[isa] <= flags():
        pytest.skip(f"this machine lacks {isa}")
    grains = {"density": 2650, "kn": 1e6, "kt": 1e6, "mu": 0.5, "thickness": 0.01, "grain": "sphere", "rate": 1, "strain": 1e-4}
    words = [BUILD / "dempm-rve", "run", ROOT / "tests" / "bench" / "data" / "disks.data", "--path", "simple-shear", "--dimension", 2,
             "--out", "answer.csv"]
    for name, value in grains.items():
        words += ["--set", f"{name}={value}"]
    code, output = execute(words, cwd=tmp_path, extra={"DEMPM_ISA": isa})
    assert code == 0 and f"cpu/{isa}," in output, output
