# SPDX-License-Identifier: GPL-2.0-or-later
"""A body whose points carry DEM packings: restart and number of ranks change nothing, to the last bit."""
import math
import struct

import pytest
from scripts import BOX, GRAIN_HEAT, GRAINS, HEAD, state, state_dump

GRAIN_RADIUS, COLUMNS, ROWS, OVERLAP = 0.005, 6, 6, 1e-3


def packing(shrink=0.02):
    """LIGGGHTS data file: a hexagonal crystal whose grains differ in size by up to `shrink`, so that contacts do."""
    width = 2 * GRAIN_RADIUS * (1 - OVERLAP)
    height = width * math.sqrt(3) / 2
    lines = ["LIGGGHTS data file", "", f"{COLUMNS * ROWS} atoms", "1 atom types", "",
             f"0 {COLUMNS * width!r} xlo xhi", f"0 {ROWS * height!r} ylo yhi", "-0.0375 0.0375 zlo zhi", "",
             "Atoms", ""]
    for row in range(ROWS):
        for column in range(COLUMNS):
            number = row * COLUMNS + column + 1
            radius = GRAIN_RADIUS * (1 - shrink * ((7 * number) % 11) / 11 * OVERLAP)
            x, y = (column + 0.5 * (row % 2) + 0.25) * width, (row + 0.5) * height
            lines.append(f"{number} 1 {2 * radius!r} 2650 {x!r} {y!r} 0")
    return "\n".join(lines) + "\n"


# 8 x 6 points fall 1 cm on a floor with friction; the left wall is hot.
POINTS = """
lattice sq 0.05 origin 0.5 0.5 0
region block block 0.8 1.2 0.01 0.31 -0.025 0.025 units box
create_atoms 1 region block
set group all vx 0.2
"""
MATERIAL = """
neighbor 0.05 bin
timestep 1e-4
""" + GRAINS + GRAIN_HEAT + """
fix rve all mpm/rve packing grains.data model hooke/stiffness tangential history grain disk thickness 0.075 &
  density 2650 damping viscous 0.2 {thermal_rve} bonds strength 0.01 shear_ratio 1 melting {melting}
fix mpm all mpm/couple grid 0.1 shape gimp transfer flip 0.99 material rve rve point/size 0.05 0.05 {thermal}
fix g all gravity 9.81 vector 0 -1 0
fix floor all mpm/wall mpm plane y 0 friction 0.5 side +
thermo 50
thermo_style custom step f_mpm f_mpm[1] f_mpm[5] f_mpm[7] f_mpm[8] f_mpm[9] f_mpm[10] f_mpm[11] f_mpm[13] &
  f_mpm[15] f_floor[2]
thermo_modify format float %.15g
"""


def material(thermal):
    if not thermal:
        return MATERIAL.format(thermal_rve="", thermal="", melting="none")
    text = MATERIAL.format(thermal_rve="pipe_resistance 1e3 reference 0", melting="80",
                           thermal="thermal yes temperature 10")
    return text + "fix hot all mpm/wall mpm plane x 0.8 nocontact temperature 100 side +\n"


def first(thermal, run):
    bonds = "fix_modify rve bonds install\n"
    return BOX.format(boundary="f f") + POINTS + material(thermal) + bonds + state_dump(100) + run


@pytest.mark.parametrize("thermal", [False, True])
def test_rves_answer_alike_on_1_2_3_4_ranks(thermal, dempm, tmp_path):
    files = {"grains.data": packing()}
    one = dempm(first(thermal, "run 200\n"), files=files, cwd=tmp_path / "1")
    table = one.table
    assert table["mpm[10]"][-1] == 48.0 and table["mpm[5]"][-1] > 0.0
    for np in (2, 3, 4):
        many = dempm(first(thermal, "run 200\n"), np=np, files=files, cwd=tmp_path / str(np))
        for step in (0, 100, 200):
            assert state(many, step) == state(one, step)
        for name in ("mpm[5]", "mpm[7]", "mpm[8]", "mpm[9]", "mpm[11]", "mpm[13]"):
            assert many.table[name] == table[name], name


@pytest.mark.parametrize("np", [1, 2])
def test_without_a_gpu_one_warning_then_the_cpu(np, dempm, tmp_path, monkeypatch):
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "")
    files = {"grains.data": packing()}
    script = first(False, "run 20\nrun 20\n")
    cpu = dempm(script.replace("damping viscous", "backend cpu damping viscous"), np=np, files=files, cwd=tmp_path / "cpu")
    cuda = dempm(script.replace("damping viscous", "backend cuda damping viscous"), np=np, files=files, cwd=tmp_path / "cuda")
    assert cpu.output.count("'cuda' is given") == 0
    assert cuda.output.count("'cuda' is given, but not every rank has a GPU that answers") == 1
    assert cuda.table == cpu.table


@pytest.mark.parametrize("thermal", [False, True])
@pytest.mark.parametrize("before, after", [(1, 1), (1, 2), (2, 1), (2, 3)])
def test_restart_with_contact_history_continues_to_the_last_bit(before, after, thermal, dempm, tmp_path):
    files = {"grains.data": packing()}
    through = dempm(first(thermal, "restart 100 half.*\nrun 200\n"), np=before, files=files, cwd=tmp_path)
    expected, table = state(through, 200), through.table
    (tmp_path / "state.200.txt").unlink()
    second = HEAD + "read_restart half.100\n" + material(thermal) + state_dump(100) + "run 100\n"
    again = dempm(second, np=after, cwd=tmp_path)
    assert state(again, 200) == expected
    # Energies, frictional heat and damping work go on from where they were
    for name in ("mpm[7]", "mpm[9]", "mpm[11]", "mpm[13]"):
        assert again.table[name][-1] == pytest.approx(table[name][-1], rel=1e-13)


def test_bonds_are_installed_when_the_script_says_so(dempm, tmp_path):
    """Not before: the first state has none; then every contact of the crystal has one."""
    script = first(False, "run 0\nfix_modify rve bonds install\nrun 100\n")
    script = script.replace("fix_modify rve bonds install\n", "", 1)
    run = dempm(script, files={"grains.data": packing()}, cwd=tmp_path)
    fractions = [{float(line.split()[4 + 17]) for line in state(run, step).values()} for step in (0, 100)]
    assert fractions[0] == {0.0} and min(fractions[1]) > 0.5


def test_restart_before_any_run_is_the_start(dempm, tmp_path):
    script = first(False, "write_restart begin\nrun 100\n")
    expected = state(dempm(script, files={"grains.data": packing()}, cwd=tmp_path), 100)
    (tmp_path / "state.100.txt").unlink()
    again = dempm(HEAD + "read_restart begin\n" + material(False) + state_dump(100) + "run 100\n", cwd=tmp_path)
    assert state(again, 100) == expected


@pytest.mark.parametrize("new, message", [("fix rve2 all mpm/rve", "has no RVEs of theirs"),
                                          ("fix mpm2 all mpm/couple", "has RVEs of other points")])
def test_restart_with_another_id_is_refused(new, message, dempm, tmp_path):
    """Points and RVEs belong together: neither may silently start anew."""
    dempm(first(False, "run 10\nwrite_restart half\n"), files={"grains.data": packing()}, cwd=tmp_path)
    script = HEAD + "read_restart half\n" + material(False) + "run 1\n"
    old, name = new.replace("2 ", " "), new.split()[1]
    script = script.replace(old, new)
    if name == "rve2":
        script = script.replace("material rve rve", "material rve rve2")
    if name == "mpm2":
        script = script.replace("mpm/wall mpm ", "mpm/wall mpm2 ").replace("f_mpm", "f_mpm2")
    run = dempm(script, cwd=tmp_path, check=False)
    assert run.code != 0 and message in run.output


def seal(data):
    """What restart_seal() writes behind a file: magic, length, FNV-1a."""
    value = 14695981039346656037
    for byte in data:
        value = (value ^ byte) * 1099511628211 % 2**64
    return b"DEMPMEND" + struct.pack("<QQ", len(data), value)


def test_altered_record_under_a_right_seal_is_refused(dempm, tmp_path):
    """The packings' record has a checksum of its own, for files that lost their seal on the way through other programs."""
    files = {"grains.data": packing()}
    dempm(first(False, "run 10\nwrite_restart half\n"), files=files, cwd=tmp_path)
    data = bytearray((tmp_path / "half").read_bytes())
    assert data[-24:] == seal(data[:-24])
    data = data[:-24]
    data[data.index(b"mpm/rve1") + 5000] ^= 1
    (tmp_path / "half").write_bytes(data + seal(data))
    run = dempm(HEAD + "read_restart half\n" + material(False) + "run 10\n", cwd=tmp_path, check=False)
    assert run.code != 0 and "Fix mpm/rve (id rve)" in run.output


def test_record_of_rves_and_grid_for_paraview(dempm, tmp_path):
    files = {"grains.data": packing()}
    view = "fix view all mpm/vtk mpm every 10 prefix see rves 1 48 grid yes\nrun 20\n"
    run = dempm(first(False, view), np=2, files=files, cwd=tmp_path)
    names = {p.name for p in run.path.iterdir()}
    assert {"see_1.pvd", "see_48.pvd", "see_grid.pvd", "see_1_0.vtm", "see_48_20.vtm", "see_grid_20.vtu"} <= names
