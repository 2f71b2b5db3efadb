# SPDX-License-Identifier: GPL-2.0-or-later
"""2 N steps equal N steps, restart and N steps, to the last bit, also on another number of ranks."""
import pytest
from scripts import BOX, ELASTIC, HEAD, POINTS, state, state_dump

THERMO = """
thermo 100
thermo_style custom step f_mpm[1] f_mpm[2] f_mpm[3] f_mpm[5] f_mpm[6] f_mpm[7] f_mpm[14] f_mpm[15] &
  f_floor[2] f_floor[6] f_ram[1] f_ram[8] f_ram[9]
thermo_modify format float %.15g
"""


def scripts(boundary, way, extra=""):
    """(first part, continuation). way: how the restart file comes about."""
    tail = ELASTIC.format(transfer="flip 0.99", extra=extra) + THERMO + state_dump(200)
    first = BOX.format(boundary=boundary) + POINTS + tail
    if way == "command":
        first += "run 200\nwrite_restart half\nrun 200\n"
    else:
        first += "restart 200 half.*\nrun 400\n"
    return first, HEAD + f"read_restart half{'' if way == 'command' else '.200'}\n" + tail + "run 200\n"


@pytest.mark.parametrize("boundary", ["f f", "p f", "s s"])
@pytest.mark.parametrize("way", ["command", "during"])
def test_restart_continues_to_the_last_bit(way, boundary, dempm, tmp_path):
    if boundary == "s s" and way == "command":
        pytest.skip("one way is enough for shrink-wrapped boxes")
    first, second = scripts(boundary, way)
    if boundary != "f f":
        first, second = (text.replace("vx 0.5", "vx 8") for text in (first, second))
    through = dempm(first, cwd=tmp_path)
    expected = state(through, 400), through.table
    (tmp_path / "state.400.txt").unlink()
    again = dempm(second, cwd=tmp_path)
    assert state(again, 400) == expected[0]
    for name, values in expected[1].items():
        assert again.table[name][-1] == values[-1], name
    # The first line of the continuation repeats what the run before said at this step
    assert again.table["Step"][0] == 200
    for name in ("mpm[5]", "mpm[7]", "mpm[14]", "floor[2]", "floor[6]", "ram[8]", "ram[9]"):
        before = expected[1][name][expected[1]["Step"].index(200)]
        assert again.table[name][0] == pytest.approx(before, rel=1e-13)


@pytest.mark.parametrize("before, after, extra", [(1, 2, ""), (2, 1, "volumetric cell"), (2, 3, "")])
def test_restart_on_another_number_of_ranks(before, after, extra, dempm, tmp_path):
    first, second = scripts("f f", "during", extra)
    through = dempm(first, np=before, cwd=tmp_path)
    expected = state(through, 400)
    (tmp_path / "state.400.txt").unlink()
    again = dempm(second, np=after, cwd=tmp_path)
    assert state(again, 400) == expected


def test_setup_does_not_disturb_the_way(dempm, tmp_path):
    """`run 400` equals 40 times `run 10`."""
    first, _ = scripts("f f", "during")
    through = dempm(first, cwd=tmp_path / "through")
    parts = dempm(first.replace("run 400", "label more\nvariable n loop 40\nrun 10\nnext n\njump SELF more"),
                  cwd=tmp_path / "parts")
    assert state(parts, 400) == state(through, 400)


def test_restart_before_any_run_is_the_start(dempm, tmp_path):
    tail = ELASTIC.format(transfer="flip 0.99", extra="") + THERMO + state_dump(200)
    first = BOX.format(boundary="f f") + POINTS + tail + "write_restart begin\nrun 200\n"
    through = dempm(first, cwd=tmp_path)
    expected = state(through, 200)
    (tmp_path / "state.200.txt").unlink()
    again = dempm(HEAD + "read_restart begin\n" + tail + "run 200\n", cwd=tmp_path)
    assert state(again, 200) == expected
