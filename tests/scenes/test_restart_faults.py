# SPDX-License-Identifier: GPL-2.0-or-later
"""Restart files that are cut, altered or left by a killed run: refused in words, on several ranks too, and nothing else is lost."""
import os
import random
import signal
import subprocess
import time

import pytest
from conftest import BUILD, environment
from scripts import BOX, ELASTIC, HEAD, POINTS, state, state_dump

TAIL = ELASTIC.format(transfer="flip 0.99", extra="") + "thermo 50\n"
FIRST = BOX.format(boundary="f f") + POINTS + TAIL + state_dump(400)
SECOND = HEAD + "read_restart {file}\n" + TAIL + state_dump(400) + "run {steps}\n"


@pytest.fixture
def whole(dempm, tmp_path):
    dempm(FIRST + "restart 100 whole.*\nrun 200\n", cwd=tmp_path)
    return (tmp_path / "whole.200").read_bytes()


@pytest.mark.parametrize("np", [1, 2])
@pytest.mark.parametrize("fault", ["cut to 0 %", "cut to 0.1 %", "cut to 0.5 %", "cut to 3 %", "cut to 50 %", "last byte cut", "one bit altered"])
def test_a_broken_restart_file_is_refused(fault, np, whole, dempm, tmp_path):
    broken = bytearray(whole)
    if fault == "one bit altered":
        broken[len(broken) // 2] ^= 4
    elif fault == "last byte cut":
        broken = broken[:-1]
    else:
        broken = broken[:int(len(whole) * float(fault.split()[2]) / 100)]
    (tmp_path / "broken.200").write_bytes(broken)
    run = dempm(SECOND.format(file="broken.200", steps=10), np=np, cwd=tmp_path, check=False, timeout=30)
    assert run.code != 0
    assert "Read_restart: restart file broken.200 is " in run.output
    assert ("altered" if fault == "one bit altered" else "not whole") in run.output


def test_the_latest_file_is_found_by_star(whole, dempm, tmp_path):
    run = dempm(SECOND.format(file="whole.*", steps=0), cwd=tmp_path)
    assert run.table["Step"][0] == 200


def test_a_killed_run_goes_on_from_its_last_whole_file(dempm, tmp_path):
    """Killed at random, also while it writes: the last file that is not refused continues to the bits of an undisturbed run."""
    through = dempm(FIRST + "run 400\n", cwd=tmp_path / "through")
    path = tmp_path / "killed"
    path.mkdir()
    (path / "in.script").write_text(FIRST + "restart 2 part.*\nrun 100000\n")
    process = subprocess.Popen([BUILD / "dempm", "-in", "in.script"], cwd=path, env=environment(), stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL)
    enough = time.monotonic() + 60
    while len(list(path.glob("part.*"))) < 20 and time.monotonic() < enough:
        time.sleep(0.01)
    time.sleep(random.Random(os.getpid()).uniform(0, 0.1))
    process.send_signal(signal.SIGKILL)
    process.wait()
    steps = sorted((int(file.suffix[1:]) for file in path.glob("part.*")), reverse=True)
    for step in [step for step in steps if step < 400][:3]:
        again = dempm(SECOND.format(file=f"part.{step}", steps=400 - step), cwd=path, check=False)
        if again.code == 0:
            assert state(again, 400) == state(through, 400)
            return
        assert "is not whole" in again.output
    pytest.fail("no restart file of the killed run is whole")
