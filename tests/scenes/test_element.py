# SPDX-License-Identifier: GPL-2.0-or-later
"""dempm-rve: element tests against closed forms on crystals, wrong calls, failures and their replays."""
import csv
import itertools
import math
import re

import pytest

from conftest import BUILD, ROOT, execute
from scripts import HEAD

RADIUS, KN, THICKNESS = 0.005, 1e6, 0.075
SMOOTH = f"--set kn={KN} --set kt=0 --set density=2650"
DISKS = f"--dimension 2 --set thickness={THICKNESS} {SMOOTH}"
SPHERES = f"--dimension 3 {SMOOTH}"
ROUGH = f"--dimension 2 --set kn=1e6 --set kt=1e6 --set mu=0.5 --set density=2650 --set thickness={THICKNESS}"


def data_file(edges, points, radius=RADIUS, velocity=None):
    """A LIGGGHTS data file of a rectangular box."""
    lines = ["packing", "", f"{len(points)} atoms", "1 atom types", ""]
    for name, edge in zip("xyz", (*edges, 0.02)[:3]):
        lines.append(f"0 {edge!r} {name}lo {name}hi")
    lines += ["", "Atoms", ""]
    for k, point in enumerate(points):
        x, y, z = (*point, 0.0)[:3]
        lines.append(f"{k + 1} 1 {2 * radius!r} 2650 {x!r} {y!r} {z!r}")
    if velocity:
        lines += ["", "Velocities", ""]
        lines += [f"{k + 1} {velocity if k == 5 else 0} 0 0 0 0 0" for k in range(len(points))]
    return "\n".join(lines) + "\n"


def hexagonal(overlap=0.02, **options):
    """12 disks; branches of one crystal cell."""
    a = 2 * RADIUS * (1 - overlap)
    height = a * math.sqrt(3)
    points = [((i + 0.25) * a + s * a / 2, (j + 0.25 + s / 2) * height) for j in range(2) for i in range(3) for s in (0, 1)]
    return data_file((3 * a, 2 * height), points, **options)


def cubic(overlap=0.02):
    a = 2 * RADIUS * (1 - overlap)
    return data_file((2 * a, 2 * a, 2 * a), [[(k + 0.5) * a for k in at] for at in itertools.product((0, 1), repeat=3)])


@pytest.fixture
def rve(tmp_path):
    """rve(words) -> rows of out.csv as dicts of floats; with check=False (exit code, output)."""
    (tmp_path / "hex.data").write_text(hexagonal())
    (tmp_path / "cubic.data").write_text(cubic())

    def run(words, check=True, extra=None):
        code, output = execute([BUILD / "dempm-rve", *words.split()], cwd=tmp_path, timeout=60, extra=extra)
        if not check:
            return code, output
        assert code == 0, output
        return table(tmp_path / "out.csv")

    run.path = tmp_path
    return run


def table(path):
    with open(path) as file:
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]


def hexagonal_answer(row, radius=RADIUS, overlap=0.02):
    """Stress and conductivity (alpha = 16) of the crystal deformed by the row's F."""
    a = 2 * RADIUS * (1 - overlap)
    area = a * a * math.sqrt(3) / 2 * (row["Fxx"] * row["Fyy"] - row["Fxy"] * row["Fyx"]) * THICKNESS
    stress, conductivity = dict.fromkeys(("xx", "yy", "xy"), 0.0), dict.fromkeys(("xx", "yy", "xy"), 0.0)
    for angle in (0, math.pi / 3, 2 * math.pi / 3):
        b0 = (a * math.cos(angle), a * math.sin(angle))
        b = {"x": row["Fxx"] * b0[0] + row["Fxy"] * b0[1], "y": row["Fyx"] * b0[0] + row["Fyy"] * b0[1]}
        length = math.hypot(*b.values())
        force = max(0.0, KN * (2 * radius - length))
        for ij in stress:
            stress[ij] -= force * b[ij[0]] * b[ij[1]] / length / area
            conductivity[ij] += b[ij[0]] * b[ij[1]] / (16 * length) / area
    return stress, conductivity


def assert_crystal(rows, **options):
    for row in rows:
        stress, _ = hexagonal_answer(row, **options)
        largest = max(abs(value) for value in stress.values())
        for ij, value in stress.items():
            assert row[f"s{ij}"] == pytest.approx(value, abs=1e-9 * largest)


# ------------------------------------------------------------------------------------------------------ built-in paths
def test_oedometer(rve):
    rows = rve(f"run hex.data --path oedometer {DISKS} --set rate=0.5 --set strain=0.02 --out out.csv")
    assert len(rows) == 201 and rows[-1]["time"] == pytest.approx(0.04)
    assert rows[-1]["Fyy"] == pytest.approx(math.exp(-0.02), rel=1e-12) and rows[-1]["Fxx"] == 1.0
    assert_crystal(rows)
    assert rows[-1]["volume"] / rows[0]["volume"] == pytest.approx(math.exp(-0.02), rel=1e-11)
    assert rows[0]["coordination"] == 6.0 and rows[-1]["heat"] == 0.0 and rows[-1]["status"] == 0


def test_simple_shear_keeps_the_volume(rve):
    rows = rve(f"run hex.data --path simple-shear {DISKS} --set rate=1 --set strain=0.03 --out out.csv")
    assert rows[-1]["Fxy"] == pytest.approx(0.03, rel=1e-12)
    assert_crystal(rows)
    for row in rows:
        assert row["void_ratio"] == pytest.approx(rows[0]["void_ratio"], rel=1e-10)


def test_simple_shear_under_constant_normal_stress(rve):
    rows = rve(f"run hex.data --path simple-shear {DISKS} --set rate=0.2 --set strain=0.02 --set pressure=2e5 --out out.csv")
    assert [row for row in rows if abs(row["syy"] / -2e5 - 1) > 0.03] == []
    assert rows[-1]["Fyx"] == 0.0 and rows[-1]["Fyy"] != 1.0


def test_isotropic_compression_of_a_crystal(rve):
    rows = rve(f"run hex.data --path isotropic {DISKS} --set pressure=1e6 --set duration=0.2 --out out.csv")
    # sigma = -sqrt(3) kn (2R - l) / (l z), with l the spacing of the disks.
    spacing = 2 * RADIUS * KN / (KN + 1e6 * THICKNESS / math.sqrt(3))
    before = 2 * RADIUS * 0.98
    assert rows[-1]["volume"] / rows[0]["volume"] == pytest.approx((spacing / before) ** 2, rel=1e-3)
    assert rows[-1]["sxx"] == pytest.approx(-1e6, rel=0.01) and rows[-1]["syy"] == pytest.approx(-1e6, rel=0.01)
    assert all(after["sxx"] < row["sxx"] for row, after in zip(rows, rows[1:]))


def test_biaxial_compression_of_a_crystal(rve):
    rows = rve(f"run hex.data --path biaxial {DISKS} --set pressure=2e5 --set rate=0.2 --set strain=0.01 --out out.csv")
    assert [row for row in rows if abs(row["sxx"] / -2e5 - 1) > 0.03] == []
    # F counts from the isotropic state: the crystal's own spacing there follows from the pressure.
    spacing = 2 * RADIUS * KN / (KN + 2e5 * THICKNESS / math.sqrt(3))
    end = rows[-1]
    assert end["Fyy"] == pytest.approx(math.exp(-0.01), rel=1e-12)
    stress, _ = hexagonal_answer(end, overlap=1 - spacing / (2 * RADIUS))
    assert end["syy"] == pytest.approx(stress["yy"], rel=5e-3)


def test_triaxial_compression_of_a_cubic_crystal(rve):
    rows = rve(f"run cubic.data --path triaxial {SPHERES} --set pressure=5e5 --set rate=0.5 --set strain=0.01 --out out.csv")
    for row in rows:
        assert row["sxx"] == pytest.approx(-5e5, rel=0.03) and row["syy"] == pytest.approx(-5e5, rel=0.03)
    # sigma_zz = -kn (2R - l_z) / (l_x l_y); isotropic at first: p l^2 = kn (2R - l)
    spacing = (-KN + math.sqrt(KN * KN + 8 * 5e5 * KN * RADIUS)) / (2 * 5e5)
    end = rows[-1]
    lz, area = spacing * end["Fzz"], spacing * end["Fxx"] * spacing * end["Fyy"]
    assert end["szz"] == pytest.approx(-KN * (2 * RADIUS - lz) / area, rel=1e-2)


def test_servo_holds_the_pressure_of_a_random_packing(rve):
    made = f"generate a.packing grains 100 radius 0.0025 0.005 pressure 1e5 preparation_friction 0.1 density 2650 kn 1e6 " \
           f"kt 1e6 thickness {THICKNESS}"
    code, output = execute([BUILD / "dempm-pack", *made.split()], cwd=rve.path)
    assert code == 0, output
    words = f"run a.packing --path biaxial {ROUGH} --set damping/local=0.5 --set pressure=1e5 --set rate=0.5 --set strain=0.05"
    rows = rve(f"{words} --out out.csv")
    mean = sum(row["sxx"] for row in rows) / len(rows)
    assert mean == pytest.approx(-1e5, rel=0.01)
    assert max(-row["syy"] for row in rows) > 1.5e5
    work = [row["friction_work"] for row in rows]
    assert work[0] == 0.0 and work == sorted(work)
    # The heat of the lines is the friction work between them.
    released = sum(row["heat"] * row["volume"] * (row["time"] - last["time"]) for last, row in zip(rows, rows[1:]))
    assert released == pytest.approx(work[-1], rel=1e-6)
    one = (rve.path / "out.csv").read_text()
    code, output = rve(f"{words} --copies 3 --out out.csv", check=False)
    assert code == 0 and (rve.path / "out.csv").read_text() == one
    assert "3 copies" in output and re.search(r"speed +\S+ particle-steps in \S+ s: \S+ particle-steps/s", output)


@pytest.mark.parametrize("kind", ["data", "dump", "restart"])
def test_files_of_liggghts(rve, kind):
    packing = ROOT / "tests" / "data" / f"layer.{kind}"
    rows = rve(f"run {packing} --path oedometer {ROUGH} --set damping/local=0.3 --set rate=0.1 --set strain=1e-4 --every 10 "
               "--out out.csv")
    assert rows[-1]["status"] == 0 and rows[-1]["steps"] > rows[0]["steps"]


# --------------------------------------------------------------------------------------------------------- path files
def test_path_file_of_velocity_gradients(rve):
    (rve.path / "path.csv").write_text("# a comment\ntime, Lxx, Lxy\n0, -0.5, 0\n0.01, 0, 1\r\n0.02, 5, 5\n")
    rows = rve(f"run hex.data --path path.csv {DISKS} --out out.csv")
    assert rows[-1]["Fxx"] == pytest.approx(math.exp(-0.005), rel=1e-12)
    assert rows[-1]["Fxy"] == pytest.approx(0.01, rel=1e-9) and rows[-1]["time"] == 0.02
    assert_crystal(rows)


def test_path_file_that_heats_a_clamped_crystal(rve):
    (rve.path / "path.csv").write_text("time,T\n0,20\n0.01,120\n")
    heat = "--set expansion=1e-5 --set Tref=20 --set alpha=16"
    rows = rve(f"run hex.data --path path.csv {DISKS} {heat} --out out.csv")
    assert rows[-1]["T"] == 120.0 and rows[100]["T"] == pytest.approx(70)
    for row in rows:
        stress, conductivity = hexagonal_answer(row, radius=RADIUS * (1 + 1e-5 * (row["T"] - 20)))
        assert row["sxx"] == pytest.approx(stress["xx"], rel=1e-9) and row["syy"] == pytest.approx(stress["yy"], rel=1e-9)
        assert row["Kxx"] == pytest.approx(conductivity["xx"], rel=1e-9)


def test_path_file_that_passes_from_stress_to_strain(rve):
    (rve.path / "path.csv").write_text("time,sxx,syy,Lyy\n0,-1e5,-1e5,\n0.05,-3e5,-3e5,\n0.1,-3e5,,-0.1\n0.15,-3e5,,\n")
    rows = rve(f"run hex.data --path path.csv {DISKS} --out out.csv")
    middle = min(rows, key=lambda row: abs(row["time"] - 0.1))
    assert middle["sxx"] == pytest.approx(-3e5, rel=0.02) and middle["syy"] == pytest.approx(-3e5, rel=0.02)
    assert rows[-1]["sxx"] == pytest.approx(-3e5, rel=0.02)
    assert rows[-1]["Fyy"] / middle["Fyy"] == pytest.approx(math.exp(-0.005), rel=1e-9)


def test_stress_that_grains_cannot_bear_is_an_error(rve):
    (rve.path / "pull.csv").write_text("time,sxx\n0,-1e5\n0.1,1e5\n")
    code, output = rve(f"run hex.data --path pull.csv {DISKS} --out out.csv", check=False)
    assert code == 1 and "the stress sxx cannot be followed along the path: at time" in output
    assert "stress_tolerance=0.03" in output and table(rve.path / "out.csv")  # what was reached until then


# ------------------------------------------------------------------------------------------------- failures, replays
def test_failure_is_named_and_replayed(rve):
    (rve.path / "fast.data").write_text(hexagonal(velocity=1e5))
    code, output = rve(f"run fast.data --path oedometer {DISKS} --set rate=1 --set strain=0.1 --out out.csv", check=False)
    assert code == 1 and re.search(r"RVE 0 is unstable at DEM step 1 \(1 of \d+ of its call\): grain 6 moves \S+ m in one",
                                   output)
    assert "dempm-rve replay out.csv.replay" in output and table(rve.path / "out.csv")[-1]["status"] != 0
    code, output = rve("replay out.csv.replay", check=False)
    assert code == 0 and "the failure is repeated at the same step" in output and output.count("grain 6 moves") == 2


@pytest.mark.parametrize("precision", ["double", "mixed"])
def test_replay_shows_what_grew(precision, rve):
    """Crushed so fast that it fails in the middle of a call."""
    (rve.path / "crush.csv").write_text("time,Lyy\n0,-3000\n0.01,0\n")
    words = f"run hex.data --path crush.csv {DISKS} --set damping/local=0.1 --set precision={precision} --every 1000000 --out out.csv"
    code, output = rve(words, check=False)
    step = int(re.search(r"unstable at DEM step (\d+)", output)[1])
    assert code == 1 and step > 1
    code, first = rve("replay out.csv.replay", check=False)
    assert re.search(r"backend +(\S+), the failing run had \1$", first, re.MULTILINE), first
    code, second = rve("replay out.csv.replay --out slow.csv --every 1", check=False)
    assert code == 0 and "repeated at the same step" in first and "repeated at the same step" in second
    rows = table(rve.path / "slow.csv")
    assert len(rows) == step and rows[0]["syy"] > rows[-2]["syy"] and rows[-1]["status"] != 0


def test_wrong_replay_files_are_refused(rve):
    (rve.path / "fast.data").write_text(hexagonal(velocity=1e5))
    rve(f"run fast.data --path oedometer {DISKS} --set rate=1 --set strain=0.1 --out out.csv", check=False)
    good = (rve.path / "out.csv.replay").read_bytes()
    altered = bytearray(good)
    altered[len(good) // 2] ^= 1
    for name, content, message in (("cut", good[:-1], "truncated"), ("short", good[:100], "truncated"),
                                   ("altered", bytes(altered), "altered, the checksum differs"),
                                   ("other", b"once upon a time", "no replay file of dempm"),
                                   ("empty", b"", "no replay file of dempm")):
        (rve.path / name).write_bytes(content)
        code, output = rve(f"replay {name}", check=False)
        assert code == 1 and message in output, output
    code, output = rve("replay nowhere", check=False)
    assert code == 1 and "cannot open replay file nowhere" in output


def test_fix_names_the_failure_and_writes_a_replay(dempm, tmp_path):
    script = HEAD + """\
boundary        f f p
region          box block -1 3 -1 3 -0.025 0.025 units box
create_box      1 box
neighbor        0.05 bin
timestep        1e-4
fix kn   all property/global kn peratomtypepair 1 1e6
lattice         sq 0.1 origin 0.5 0.5 0
region          column block 0 0.2 0 0.2 -0.025 0.025 units box
create_atoms    1 region column
fix rve all mpm/rve packing fast.data model hooke/stiffness tangential off density 2650 grain disk thickness 0.075 REPLAY
fix mpm all mpm/couple grid 0.2 shape gimp transfer flip 0.99 material rve rve
run             2
"""
    files = {"fast.data": hexagonal(velocity=1e5)}
    run = dempm(script.replace("REPLAY", ""), files=files, check=False)
    assert run.code != 0 and re.search(r"material point 1 is unstable at DEM step 1 .*: grain 6 moves", run.output)
    assert "dempm-rve replay ./rve_1.replay" in run.output
    code, output = execute([BUILD / "dempm-rve", "replay", "rve_1.replay"], cwd=tmp_path)
    assert code == 0 and "of material point 1" in output and "repeated at the same step" in output
    (tmp_path / "rve_1.replay").unlink()
    run = dempm(script.replace("REPLAY", "replay none"), files=files, check=False)
    assert run.code != 0 and "replay rve" not in run.output and not list(tmp_path.glob("*.replay"))
    run = dempm(script.replace("REPLAY", "replay nowhere/at/all"), files=files, check=False)
    assert run.code != 0 and "keyword 'replay'" in run.output and "a directory that exists" in run.output


# -------------------------------------------------------------------------------------------------------- wrong calls
OK = f"--path oedometer {DISKS} --set rate=1 --set strain=0.01 --out out.csv"
WRONG = [
    ("run hex.data --dimension 2 --out out.csv", "--path is missing (allowed: FILE.csv, isotropic, oedometer"),
    ("run --path oedometer --dimension 2 --out x", "the name of a packing file is missing"),
    ("run hex.data --path oedometer --out out.csv", "--dimension is missing (allowed: 2 or 3)"),
    ("run hex.data --path oedometer --dimension 4 --out out.csv", "--dimension: found '4'; an integer from 2 to 3"),
    ("run hex.data --path oedometer --dimension 2", "--out is missing"),
    ("run a b --path oedometer --dimension 2", "'a' and 'b': one file is allowed"),
    (f"run hex.data {OK} --out again", "--out is given twice"),
    (f"run hex.data {OK} --colour red", "unknown option '--colour'; there are --path"),
    (f"run hex.data {OK} --copies 0", "--copies: found '0'; an integer from 1 to 1000000"),
    (f"run hex.data {OK} --every 1.5", "--every: found '1.5'; an integer from 1"),
    (f"run hex.data {OK} --every", "--every: a value must follow"),
    (f"run hex.data {OK} --set kn=2", "--set kn is given twice"),
    (f"run hex.data {OK} --set colour=red", "--set colour: unknown; there are: density kn kt mu"),
    (f"run hex.data {OK} --set mu", "--set mu: no value; write --set mu=VALUE"),
    (f"run hex.data {OK} --set mu=nan", "--set mu: found 'nan'; allowed: a number >= 0"),
    (f"run hex.data {OK} --set gamman=-1", "--set gamman: found '-1'; allowed: a number >= 0"),
    (f"run hex.data {OK} --set damping/local=1", "--set damping/local: found '1'; allowed: 0 <= number < 1"),
    (f"run hex.data {OK} --set threads=1.5", "--set threads: found '1.5'; allowed: an integer"),
    (f"run hex.data {OK} --set grain=cube", "--set grain: found 'cube'; allowed: disk, sphere"),
    (f"run hex.data {OK} --set backend=fast", "--set backend: found 'fast'; allowed: auto, cpu, cuda"),
    (f"run hex.data {OK} --set timestep=1", "--set timestep: found '1'; allowed: at most the critical one"),
    (f"run hex.data {OK} --set pressure=1", "--set pressure is for the paths isotropic biaxial triaxial simple-shear, not for oe"),
    (f"run hex.data {OK} --set expansion=1e-5", "--set Tref=... is missing"),
    (f"run hex.data {OK} --set bond_melting=1", "--set bond_strength=... is missing"),
    (f"run hex.data {OK.replace('--set kt=0', '')}", "--set kt=... is missing: tangential stiffness"),
    (f"run hex.data {OK.replace('kt=0', 'kt=1e6')}", "--set mu=... is missing: Coulomb's friction (kt > 0)"),
    (f"run hex.data {OK.replace('--set rate=1', '')}", "--set rate=... is missing"),
    (f"run hex.data {OK.replace(f'--set thickness={THICKNESS}', '')}", "--set thickness=... is missing: depth"),
    (f"run hex.data --path triaxial {DISKS} --set pressure=1 --set rate=1 --set strain=1 --out x",
     "--path triaxial needs dimension 3"),
    (f"run hex.data --path isotropic {DISKS} --set pressure=1 --out x", "--set duration=... is missing"),
    (f"run cubic.data --path oedometer {SPHERES} --set thickness=1 --set rate=1 --set strain=1 --out x",
     "--set thickness is for dimension 2 only"),
    (f"run nowhere.data {OK}", "cannot open packing file nowhere.data"),
    (f"run hex.data {OK.replace('out.csv', 'no/such/place.csv')}", "cannot open no/such/place.csv for writing"),
    (f"run hex.data {OK.replace('--path oedometer', '--path nowhere.csv').replace('--set rate=1 --set strain=0.01', '')}",
     "cannot open path file nowhere.csv"),
    (f"run hex.data {OK.replace('--path oedometer', '--path nowhere.csv')}", "the path file says it itself"),
    ("replay x --copies 2", "unknown option '--copies'; replay has --out and --every"),
]


@pytest.mark.parametrize("words, message", WRONG, ids=[f"{k}" for k in range(len(WRONG))])
def test_wrong_calls_are_refused(rve, words, message):
    code, output = rve(words, check=False)
    assert code == 1 and "dempm-rve: ERROR: " in output and message in output, f"{words}\n{output}"


@pytest.mark.parametrize("text, message", [
    ("", "0 rows of numbers; a header and at least 2 are needed"),
    ("time,Lxx\n0,1\n", "1 rows of numbers"),
    ("Lxx,time\n0,0\n1,0\n", "the first column is 'Lxx'; it must be time"),
    ("time,Lxz\n0,0\n1,0\n", "column Lxz; dimension 2 allows Lxx Lxy Lyx Lyy"),
    ("time,szz\n0,0\n1,0\n", "column szz; dimension 2 allows sxx syy sxy"),
    ("time,Lqq\n0,0\n1,0\n", "unknown column 'Lqq'; allowed: time, Lxx"),
    ("time,T\n0,0\n1,0\n", "column T needs heat"),
    ("time,Lxx,Lxx\n0,0,0\n1,0,0\n", "column Lxx is there twice"),
    ("time,Lxx\n0,0\n1,0,0\n", "line 3: 3 fields, the header has 2"),
    ("time,Lxx\n0,0\n0,0\n", "line 3: time 0; allowed: > 0"),
    ("time,Lxx\n1,0\n2,0\n", "line 2: time 1; allowed: the first row is at 0"),
    ("time,Lxx\n0,nan\n1,0\n", "line 2, column Lxx: found 'nan'; a finite number is needed"),
    ("time,Lxx\n0,fast\n1,0\n", "line 2, column Lxx: found 'fast'"),
    ("time,Lxx,sxx\n0,0,-1e5\n1,0,\n", "line 2: sxx and Lxx are both given"),
    ("time,Lyx,sxy\n0,,0\n1,0,0\n", "line 3: sxy and Lyx are both given"),
], ids=["empty", "one_row", "time_second", "z", "stress_z", "unknown", "cold", "twice", "fields", "time_stands", "late", "nan",
        "word", "both", "both_shear"])
def test_wrong_path_files_are_refused(rve, text, message):
    (rve.path / "path.csv").write_text(text)
    code, output = rve(f"run hex.data --path path.csv {DISKS} --out out.csv", check=False)
    assert code == 1 and "path file path.csv" in output and message in output, output


GRID = [(0.0198 * (k % 5), 0.0198 * (k // 5)) for k in range(25)]


@pytest.mark.parametrize("content, message", [
    (hexagonal(overlap=0.2), "overlap by"),
    (hexagonal().replace(" 2650 ", " 2650 nan", 1), "nan"),
    (data_file((0.099, 0.03), GRID[:20], radius=0.004), "overlap"),
    (data_file((0.1, 0.1), [(0.02 * k, 0.01) for k in range(5)] + [(0.005 * k, 0.06) for k in range(12)], radius=0.03), "wide"),
    ("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff pp pp\n0 1\n0 1\n0 1\n"
     "ITEM: ATOMS id x y z radius\n1 0.5 0.5 0.5 0.1\n", "periodic"),
    ("Once upon a time\nthere was a packing.\n", "packing file bad"),
    ("", "packing file bad"),
], ids=["deep", "nan", "flat", "wide", "walls", "prose", "empty"])
def test_bad_packings_are_refused(rve, content, message):
    (rve.path / "bad").write_text(content)
    code, output = rve(f"run bad {OK}", check=False)
    assert code == 1 and "packing file bad" in output and message in output, output
    assert not (rve.path / "out.csv").exists()


def test_usage(rve):
    code, output = rve("bake x", check=False)
    assert code == 2 and "dempm-rve run PACKING" in output
    code, output = rve("help", check=False)
    assert code == 0 and "dempm-rve replay FILE" in output


def test_plot(rve):
    words = f"run hex.data {OK} --plot answer.png"
    rve(words)
    assert (rve.path / "answer.png").read_bytes()[:4] == b"\x89PNG"
    code, output = rve(words, check=False, extra={"PYTHON": "no-such-python"})
    assert code == 1 and "--plot: cannot start no-such-python" in output
    code, output = rve(words, check=False, extra={"PYTHON": "false"})
    assert code == 1 and "the answer is in out.csv" in output
