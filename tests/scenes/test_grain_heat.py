# SPDX-License-Identifier: GPL-2.0-or-later
"""fix heat/gran/grain: the stock fix heat/gran/conduction, the conductances of doc/fix_heat_gran_grain.md, energy,
ranks, restart. The conductances themselves are tested in tests/unit/test_grain_heat.c."""
import math
import random

import pytest
from test_with_grains import GRAINS, PAIR, POINTS

HEAD = """
atom_style granular
atom_modify map array
units si
newton off
communicate single vel yes
boundary {boundary}
"""
PROPERTIES = """
neighbor {skin} bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 5e6 5e6
fix m2 all property/global poissonsRatio peratomtype 0.3 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.5 0.5 0.5 0.5
fix m4 all property/global coefficientFriction peratomtypepair 2 0.5 0.5 0.5 0.5
fix k all property/global thermalConductivity peratomtype 20 90
fix c all property/global thermalCapacity peratomtype 0.1 0.2
pair_style gran model hertz tangential history
pair_coeff * *
timestep 2e-5
"""
OUTPUT = """
thermo 1000
thermo_style custom step atoms f_heat
thermo_modify format float %.17g
dump end all custom {every} end.dump id type radius mass x y z f_Temp[0] f_heatFlux[0]
dump_modify end sort id format "%d %d %.17g %.17g %.17g %.17g %.17g %.17g %.17g"
"""


def properties(fix, skin=None):
    """Indirect conduction needs a skin above its reach, here at most half a radius of 0.006 m."""
    return PROPERTIES.format(skin=skin or (0.0035 if "indirect" in fix else 0.001))


STOCK = "fix heat all heat/gran/conduction initial_temperature 300\n"
OURS = "fix heat all heat/gran/grain initial_temperature 300 direct liggghts\n"
INDIRECT = {
    "voronoi_a": "indirect voronoi_a fluid 0.5 porosity 0.4",
    "voronoi_b": "indirect voronoi_b fluid 0.5 porosity 0.4 core 0.5",
    "layer": "indirect layer fluid 0.5 layer 0.4 minimum_gap 1e-6",
}


def box(low, high, boundary="p p f"):
    bounds = " ".join(f"{a} {b}" for a, b in zip(low, high))
    return HEAD.format(boundary=boundary) + f"region box block {bounds} units box\ncreate_box 2 box\n"


def grains(rows):
    """rows: (type, radius, x, y, z, temperature). LIGGGHTS wants a run before it sets a property."""
    make = "".join(f"create_atoms {t} single {x!r} {y!r} {z!r} units box\n" for t, _, x, y, z, _ in rows)
    size = "".join(f"set atom {n} diameter {2 * row[1]!r} density 2500\n" for n, row in enumerate(rows, 1))
    heat = "run 0\n" + "".join(f"set atom {n} property/atom Temp {row[5]!r}\n" for n, row in enumerate(rows, 1))
    return make + size, heat


def packing(spacing, jitter, count=(5, 5, 4)):
    """A box of grains of two sizes and types around the points of a lattice, temperatures from 200 to 400."""
    draw = random.Random(7).uniform
    rows = []
    for n in range(math.prod(count)):
        cell = (n % count[0], n // count[0] % count[1], n // (count[0] * count[1]))
        x, y, z = ((k + 0.5) * spacing + draw(-jitter, jitter) for k in cell)
        rows.append((1 + n % 2, draw(0.004, 0.006), x, y, z, draw(200.0, 400.0)))
    return rows, [k * spacing for k in count]


def still(fix, steps, every=None):
    """Grains that overlap and do not move: there is no integrator."""
    rows, size = packing(0.0099, 0.0005)
    make, heat = grains(rows)
    return (box((0, 0, 0), size) + make + properties(fix) + fix + heat + OUTPUT.format(every=every or steps) +
            f"run {steps}\n")


def falling(fix, steps, skin=None):
    """Loose grains that fall on a hot floor."""
    rows, size = packing(0.013, 0.0005)
    make, heat = grains(rows)
    floor = """
fix g all gravity 9.81 vector 0 0 -1
fix floor all wall/gran model hertz tangential history primitive type 1 zplane 0.0 temperature 500
fix move all nve/sphere
"""
    return (box((0, 0, -0.001), (size[0], size[1], 0.1)) + make + properties(fix, skin) + fix + floor + heat +
            OUTPUT.format(every=steps) + f"run {steps}\n")


def last(run, name):
    step, columns = run.dump("end.dump")[-1]
    return columns[name]


def deviation(run, other, name="f_Temp[0]"):
    mine, theirs = last(run, name), last(other, name)
    assert len(mine) == len(theirs) > 1
    return max(abs(a - b) for a, b in zip(mine, theirs)) / max(abs(b) for b in theirs)


def heat_of(run):
    """Sum of m c T of the first and the last frame of the dump."""
    frames = run.dump("end.dump")
    return [math.fsum(m * (0.1, 0.2)[int(t) - 1] * T
                      for m, t, T in zip(frame["mass"], frame["type"], frame["f_Temp[0]"]))
            for _, frame in (frames[0], frames[-1])]


# ------------------------------------------------------------------------------------- against stock LIGGGHTS
PAIR_ROWS = [(1, 0.005, 0.01, 0.01, 0.01, 350.0), (2, 0.004, 0.0189, 0.01, 0.01, 250.0)]


def two_grains(fix, steps, rows=PAIR_ROWS):
    make, heat = grains(rows)
    return (box((0, 0, 0), (0.04, 0.02, 0.02), "f f f") + make + properties(fix) + fix + heat +
            OUTPUT.format(every=steps) + f"run {steps}\n")


@pytest.mark.parametrize("scene", [two_grains, still, falling])
def test_liggghts_variant_is_the_stock_fix(scene, dempm, liggghts, tmp_path):
    ours = dempm(scene(OURS, 10000), cwd=tmp_path / "ours")
    stock = liggghts(scene(STOCK, 10000), cwd=tmp_path / "stock")
    before = [row[5] for row in (PAIR_ROWS if scene is two_grains else packing(1, 0)[0])]
    changed = max(abs(a - b) for a, b in zip(last(stock, "f_Temp[0]"), before))
    assert changed > 10.0
    assert deviation(ours, stock) < 1e-10
    if scene is falling:
        assert last(ours, "z") == last(stock, "z")


@pytest.mark.parametrize("model", ["hertz", "hooke"])
def test_area_correction_is_that_of_the_stock_fix(model, dempm, liggghts, tmp_path):
    """Grains and floor of other real stiffnesses than those simulated."""
    real = "fix m0 all property/global youngsModulusOriginal peratomtype 6e8 5e7\n"
    if model == "hooke":
        real += "fix m5 all property/global characteristicVelocity scalar 1\n"

    def script(fix):
        return falling(real + fix, 5000).replace("model hertz", f"model {model}")

    ours, plain = (dempm(script(OURS.replace("liggghts", f"liggghts area_correction {word}")), cwd=tmp_path / word)
                   for word in ("yes", "no"))
    stock = liggghts(script(STOCK.replace("300", "300 area_correction yes")), cwd=tmp_path / "stock")
    assert deviation(plain, stock) > 0.01
    assert last(ours, "z") == last(stock, "z")
    assert deviation(ours, stock) < 1e-10


# ------------------------------------------------------------------------------------------------ two grains
def circle(a, b, d):
    return math.sqrt(a * a - ((a * a - b * b + d * d) / (2 * d)) ** 2)


@pytest.mark.parametrize("words, conductance", [
    ("direct batchelor", lambda a, b, d: 4 * 20 * 90 / 110 * circle(a, b, d)),
    ("direct batchelor area hertz", lambda a, b, d: 4 * 20 * 90 / 110 * math.sqrt(a * b / (a + b) * (a + b - d))),
    ("direct liggghts", lambda a, b, d: 4 * 20 * 90 / 110 * math.sqrt(math.pi) * circle(a, b, d)),
    ("direct pipe", lambda a, b, d: math.pi * circle(a, b, d) ** 2 * (a + b) / (a / 20 + b / 90) / d),
], ids=["batchelor", "hertz", "liggghts", "pipe"])
def test_flow_between_two_grains(words, conductance, dempm):
    run = dempm(two_grains(f"fix heat all heat/gran/grain initial_temperature 300 {words}\n", 1))
    flow = conductance(0.005, 0.004, 0.0089) * (250.0 - 350.0)
    assert last(run, "f_heatFlux[0]") == pytest.approx([flow, -flow], rel=1e-10)


@pytest.mark.parametrize("area, radius", [("geometric", circle), ("hertz", lambda a, b, d: math.sqrt(
    a * b / (a + b) * (a + b - d)))])
def test_overlaps_are_corrected_for_a_softened_modulus(area, radius, dempm):
    """At the same force Hertz' overlap goes as E*^(-2/3)."""
    real = "fix m0 all property/global youngsModulusOriginal peratomtype 25e6 1e9\n"
    fix = f"fix heat all heat/gran/grain initial_temperature 300 direct batchelor area {area} area_correction yes\n"
    ratio = ((1 / 25e6 + 1 / 1e9) / (2 / 5e6)) ** (2 / 3)
    run = dempm(two_grains(real + fix, 1))
    flow = 4 * 20 * 90 / 110 * radius(0.005, 0.004, 0.009 - 0.0001 * ratio) * (250.0 - 350.0)
    assert last(run, "f_heatFlux[0]") == pytest.approx([flow, -flow], rel=1e-10)


def test_temperatures_decay_exponentially(dempm):
    """The difference of two grains' temperatures is multiplied by 1 - h dt (1/C1 + 1/C2) in each step."""
    steps = 200
    run = dempm(two_grains("fix heat all heat/gran/grain initial_temperature 300 direct batchelor\n", steps))
    h = 4 * 20 * 90 / 110 * circle(0.005, 0.004, 0.0089)
    capacity = [c * m for c, m in zip((0.1, 0.2), last(run, "mass"))]
    factor = 1 - h * 2e-5 * (1 / capacity[0] + 1 / capacity[1])
    one, two = last(run, "f_Temp[0]")
    assert 0.01 < factor ** steps < 0.9
    assert one - two == pytest.approx(100.0 * factor ** steps, rel=1e-9)


def flow_over_gap(dempm, words, gap):
    rows = [PAIR_ROWS[0], (2, 0.004, 0.019 + gap, 0.01, 0.01, 250.0)]
    run = dempm(two_grains(f"fix heat all heat/gran/grain initial_temperature 300 direct batchelor {words}\n", 1, rows))
    one, two = last(run, "f_heatFlux[0]")
    assert one == -two
    return one


@pytest.mark.parametrize("name, reach", [("voronoi_a", 0.5 * 0.0045), ("voronoi_b", 0.5 * 0.0045),
                                         ("layer", 0.4 * 0.005)])
def test_heat_crosses_gaps_up_to_the_reach_of_the_model(name, reach, dempm):
    assert flow_over_gap(dempm, "", 1e-5) == 0.0
    near, far = (flow_over_gap(dempm, INDIRECT[name], gap) for gap in (1e-5, 0.99 * reach))
    assert near < far < 0.0
    assert flow_over_gap(dempm, INDIRECT[name], 1.01 * reach) == 0.0


def test_grains_outside_the_group_exchange_no_heat(dempm):
    rows = PAIR_ROWS + [(2, 0.004, 0.0101, 0.0185, 0.01, 100.0)]  # touches the first two
    words = "direct batchelor indirect voronoi_b fluid 0.5"
    fix = f"group pair id 1 2\nfix heat pair heat/gran/grain initial_temperature 300 {words}\n"
    script = two_grains(fix, 100, rows)
    run = dempm(script.replace("0.04 0 0.02 0 0.02", "0.04 0 0.03 0 0.02"))
    one, two, outside = last(run, "f_Temp[0]")
    masses = last(run, "mass")
    assert outside == 100.0 and 250.0 < two < one < two + 50.0
    assert 0.1 * masses[0] * (one - 350.0) == pytest.approx(-0.2 * masses[1] * (two - 250.0), rel=1e-12)


@pytest.mark.parametrize("np", [1, 2])
def test_material_points_do_not_disturb_the_heat_of_grains(np, dempm, tmp_path):
    """Points lie among the grains; theirs are other temperatures, and radii above the skin."""
    heat = """
fix k all property/global thermalConductivity peratomtype 20 90
fix c all property/global thermalCapacity peratomtype 0.002 0.002
fix heat grains heat/gran/grain initial_temperature 300 direct pipe indirect voronoi_b fluid 1 reach 0.5
run 0
region left block INF 0.9 INF INF INF INF units box
group left region left
group hot intersect left grains
set group hot property/atom Temp 400
dump end grains custom 300 end.dump x y f_Temp[0]
dump_modify end format "%.17g %.17g %.17g"
run 300
"""
    temperatures = []
    for name, points in (("both", POINTS), ("grains", "")):
        run = dempm(PAIR + GRAINS + points + heat, np=np, cwd=tmp_path / name)
        columns = run.dump("end.dump")[-1][1]
        temperatures.append([T for _, _, T in sorted(zip(columns["x"], columns["y"], columns["f_Temp[0]"]))])
    assert len(temperatures[0]) > 100 and sum(301.0 < T < 399.0 for T in temperatures[0]) >= 10
    assert temperatures[0] == pytest.approx(temperatures[1], rel=1e-9)


# ------------------------------------------------------------------------------------ energy, ranks, restart
@pytest.mark.parametrize("name", ["none", *INDIRECT])
def test_energy_is_kept_and_ranks_agree(name, dempm, tmp_path):
    fix = f"fix heat all heat/gran/grain initial_temperature 300 direct pipe {INDIRECT.get(name, '')}\n"
    one, two = (dempm(still(fix, 2000), np=np, cwd=tmp_path / str(np)) for np in (1, 2))
    for run in (one, two):
        start, end = heat_of(run)
        assert end == pytest.approx(start, rel=1e-13)
        assert run.table["f_heat"][-1] == pytest.approx(end, rel=1e-13)
        temperatures = last(run, "f_Temp[0]")
        assert max(temperatures) - min(temperatures) < 180.0  # of 200: heat has moved
    assert deviation(two, one) < 1e-13


def test_two_ranks_agree_on_falling_grains(dempm, tmp_path):
    fix = f"fix heat all heat/gran/grain initial_temperature 300 direct batchelor {INDIRECT['layer']}\n"
    one, two = (dempm(falling(fix, 2000), np=np, cwd=tmp_path / str(np)) for np in (1, 2))
    assert deviation(two, one) < 1e-10


def test_no_pair_is_missed_while_grains_move(dempm, tmp_path):
    """Lists are built when they must be: a skin just above the reach gives what a large one gives."""
    fix = f"fix heat all heat/gran/grain initial_temperature 300 direct batchelor {INDIRECT['layer']}\n"
    runs = [dempm(falling(fix, 1000, skin), cwd=tmp_path / str(skin)) for skin in (0.00245, 0.006)]
    assert deviation(*runs) < 1e-10


@pytest.mark.parametrize("before, after", [(1, 1), (1, 2), (2, 1)])
def test_restart_continues(before, after, dempm, tmp_path):
    fix = f"fix heat all heat/gran/grain initial_temperature 300 direct batchelor {INDIRECT['voronoi_b']}\n"
    script = still(fix, 200).replace("run 200\n", "run 200\nwrite_restart half\nrun 200\n")
    through = dempm(script, np=before, cwd=tmp_path / "through")
    again = dempm(HEAD.format(boundary="p p f") + f"read_restart {tmp_path}/through/half\n" + properties(fix) + fix +
                  OUTPUT.format(every=200) + "run 200\n", np=after, cwd=tmp_path / "again")
    assert deviation(again, through) < (1e-15 if before == after else 1e-13)


# ------------------------------------------------------------------------------------------------ surroundings
APART = [(1, 0.005, 0.01, 0.01, 0.01, 350.0), (2, 0.004, 0.03, 0.01, 0.01, 250.0)]
FLOWS = "thermo_style custom step atoms f_heat f_heat[1] f_heat[2]\nthermo_modify format float %.17g\n"


def alone(words, steps, dt=2e-5, np=1, shift=0.0):
    """Two grains that never touch; temperatures minus `shift`."""
    rows = [(*row[:5], row[5] - shift) for row in APART]
    fix = f"fix heat all heat/gran/grain initial_temperature {300 - shift} direct none {words}\n"
    script = two_grains(fix, steps, rows).replace("timestep 2e-5", f"timestep {dt}")
    return script.replace("thermo 1000\n", "thermo 1\n").replace("thermo_style custom step atoms f_heat\n", FLOWS)


def area_over_capacity(run):
    return [4 * math.pi * r * r / (c * m) for c, r, m in zip((0.1, 0.2), last(run, "radius"), last(run, "mass"))]


def test_convection_is_exponential_cooling(dempm, tmp_path):
    """Explicit Euler's own decay to round-off; half the time step halves the distance to the exponential."""
    rate, errors = None, []
    for steps in (100, 200):
        dt = 0.02 / steps
        run = dempm(alone("convection 60 300", steps, dt), cwd=tmp_path / str(steps))
        rate = [60 * a for a in area_over_capacity(run)]
        expected = [300 + (row[5] - 300) * (1 - k * dt) ** steps for row, k in zip(APART, rate)]
        assert last(run, "f_Temp[0]") == pytest.approx(expected, rel=1e-12)
        exact = [300 + (row[5] - 300) * math.exp(-k * 0.02) for row, k in zip(APART, rate)]
        errors.append(max(abs(a - b) for a, b in zip(last(run, "f_Temp[0]"), exact)))
    assert 0.1 < min(rate) * 0.02 and 1.9 < errors[0] / errors[1] < 2.1 and errors[1] < 0.1


def test_radiation_into_the_cold(dempm, tmp_path):
    """Surroundings at 0 K: T = (T0^-3 + 3 k t)^(-1/3)."""
    errors = []
    for steps in (100, 200):
        run = dempm(alone("radiation 0.9 0", steps, 0.05 / steps), cwd=tmp_path / str(steps))
        rate = [0.9 * 5.670374419e-8 * a for a in area_over_capacity(run)]
        exact = [(row[5] ** -3 + 3 * k * 0.05) ** (-1 / 3) for row, k in zip(APART, rate)]
        errors.append(max(abs(a / b - 1) for a, b in zip(last(run, "f_Temp[0]"), exact)))
    assert exact[0] < 0.98 * 350 and 1.9 < errors[0] / errors[1] < 2.1 and errors[1] < 1e-3


def test_radiation_knows_the_scale_of_celsius(dempm, tmp_path):
    kelvin = dempm(alone("radiation 0.9 400", 100, 1e-3), cwd=tmp_path / "kelvin")
    words = "radiation 0.9 126.85 absolute_zero -273.15"
    celsius = dempm(alone(words, 100, 1e-3, shift=273.15), cwd=tmp_path / "celsius")
    assert last(kelvin, "f_Temp[0]")[1] > 251.0
    assert [T + 273.15 for T in last(celsius, "f_Temp[0]")] == pytest.approx(last(kelvin, "f_Temp[0]"), rel=1e-13)


@pytest.mark.parametrize("np", [1, 2])
def test_flows_from_the_surroundings_add_up_to_the_energy(np, dempm):
    run = dempm(alone("convection 60 320 radiation 0.9 400", 50, 1e-3), np=np)
    energy, flows = run.table["f_heat"], [run.table[f"f_heat[{k}]"] for k in (1, 2)]
    assert len(energy) == 51 and min(abs(f) for flow in flows for f in flow[1:]) > 0.0
    for n in range(1, 51):
        assert energy[n] - energy[n - 1] == pytest.approx(1e-3 * (flows[0][n] + flows[1][n]), abs=1e-12 * energy[0])
