# SPDX-License-Identifier: GPL-2.0-or-later
"""fix heat/gran/grain: heat of friction, damping and impacts of moving grains; the energy closes."""
import math
import random

import pytest
from test_grain_heat import HEAD, PROPERTIES, box, grains, last, packing
from test_surface_walls import quad, stl

SPRINGS = """
neighbor 0.001 bin
neigh_modify delay 0
fix m1 all property/global kn peratomtypepair 2 4000 3000 3000 2000
fix m2 all property/global kt peratomtypepair 2 2000 1500 1500 1000
fix m3 all property/global gamman peratomtypepair 2 0 0 0 0
fix m4 all property/global gammat peratomtypepair 2 0 0 0 0
fix m5 all property/global coefficientFriction peratomtypepair 2 0.3 0.3 0.3 0.3
fix k all property/global thermalConductivity peratomtype 20 90
fix c all property/global thermalCapacity peratomtype 0.1 0.2
pair_style gran model hooke/stiffness tangential history
pair_coeff * *
timestep {dt}
fix heat all heat/gran/grain initial_temperature 300 direct none friction yes
fix move all nve/sphere
"""
IMPACT = [(1, 0.005, 0.0150, 0.018, 0.01, 300.0), (2, 0.004, 0.0242, 0.02, 0.011, 300.0)]
MOVING = """thermo 1
thermo_style custom step atoms f_heat f_heat[4] ke
thermo_modify format float %.17g
dump end all custom {every} end.dump id type radius mass x y z vx vy vz omegax omegay omegaz f_Temp[0]
dump_modify end sort id format "%d %d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g"
"""


SOFT = """fix y all property/global youngsModulus peratomtype 5e6 9e6
fix p all property/global poissonsRatio peratomtype 0.3 0.25
fix e all property/global coefficientRestitution peratomtypepair 2 {e} {e} {e} {e}
"""


def model_of(name, damped):
    """The springs, and dashpots, of an impact by another normal model."""
    script = SPRINGS
    if damped:
        script = script.replace("gamman peratomtypepair 2 0 0 0 0", "gamman peratomtypepair 2 1200 900 900 700")
        script = script.replace("gammat peratomtypepair 2 0 0 0 0", "gammat peratomtypepair 2 90 80 80 70")
        script = script.replace("friction yes", "friction yes damping yes")
    if name == "hertz":
        script = SOFT.format(e=0.7 if damped else 0.9999999) + script
    if name == "hertz/stiffness":
        script = script.replace("4000 3000 3000 2000", "4e6 3e6 3e6 2e6")
        script = script.replace("2000 1500 1500 1000", "2e6 1.5e6 1.5e6 1e6")
        script = script.replace("1200 900 900 700", "12e5 9e5 9e5 7e5").replace("90 80 80 70", "9e4 8e4 8e4 7e4")
    return script.replace("model hooke/stiffness", f"model {name}")


def impact(dt, speed=0.4, duration=0.008):
    """Two grains of different size and stiffness hit each other off centre, without damping."""
    make, heat = grains(IMPACT)
    push = f"velocity all set 0 0 0\\ngroup one id 1\\nvelocity one set {speed} 0.3 0.4\\n".replace("\\n", "\n")
    steps = round(duration / dt)
    return (box((0, 0, 0), (0.04, 0.04, 0.04), "f f f") + make + SPRINGS.format(dt=dt) + push + heat +
            MOVING.format(every=steps) + f"run {steps}\n")


def kinetic(frame):
    """With spin."""
    total = 0.0
    for n, (m, r) in enumerate(zip(frame["mass"], frame["radius"])):
        total += 0.5 * m * sum(frame["v" + a][n] ** 2 for a in "xyz")
        total += 0.2 * m * r * r * sum(frame["omega" + a][n] ** 2 for a in "xyz")
    return total


def test_friction_turns_lost_energy_into_heat(dempm, tmp_path):
    """Kinetic energy lost in the impact = heat gained, but for the error of the time integration; half to each."""
    errors = []
    for dt in (4e-6, 2e-6, 1e-6):
        run = dempm(impact(dt), cwd=tmp_path / str(dt))
        (_, first), (_, end) = run.dump("end.dump")
        lost = kinetic(first) - kinetic(end)
        gained = [m * c * (T - 300.0) for m, c, T in zip(end["mass"], (0.1, 0.2), end["f_Temp[0]"])]
        assert lost > 0.01 * kinetic(first) and abs(end["omegaz"][0]) > 1.0
        assert gained[0] == pytest.approx(gained[1], rel=1e-7)
        assert dt * sum(run.table["f_heat[4]"][1:]) == pytest.approx(sum(gained), rel=1e-7)
        errors.append(abs(sum(gained) / lost - 1))
    print("energy closure", errors)
    assert errors[2] < 1e-4 and errors[2] < 0.7 * errors[1] < 0.49 * errors[0]


def sliding(springs):
    """As `impact`, with a restart file written in the middle of it."""
    script = impact(2e-6, duration=2.6e-3).replace(SPRINGS.format(dt=2e-6), springs)
    return script.replace("run 1300\n", "run 650\nwrite_restart half\nrun 650\n")


@pytest.mark.parametrize("name, damped", [("hooke/stiffness", False), ("hertz", True)])
def test_friction_is_the_same_on_two_ranks_and_after_a_restart(name, damped, dempm, tmp_path):
    springs = model_of(name, damped).format(dt=2e-6)
    one, two = (dempm(sliding(springs), np=np, cwd=tmp_path / str(np)) for np in (1, 2))
    halves = one.thermo[-2:]
    assert halves[0]["f_heat[4]"][-1] > 0.0 and halves[1]["f_heat[4]"][1] > 0.0  # it slides when the restart is written
    assert halves[1]["f_heat[4]"] == pytest.approx(two.thermo[-1]["f_heat[4]"], rel=1e-9, abs=1e-12)
    gains = [[T - 300 for T in last(run, "f_Temp[0]")] for run in (one, two)]
    assert gains[1] == pytest.approx(gains[0], rel=1e-9)
    again = dempm(HEAD.format(boundary="f f f") + f"read_restart {tmp_path}/1/half\n" + springs +
                  MOVING.format(every=650) + "run 650\n", cwd=tmp_path / "again")
    for column in ("f_Temp[0]", "vx", "vz", "omegaz"):
        assert last(again, column) == last(one, column)
    assert again.table["f_heat[4]"][1:] == halves[1]["f_heat[4]"][1:]


def gas(steps, size, rows):
    """Grains that fly about in a periodic box and collide without damping."""
    make, heat = grains(rows)
    draw = random.Random(3).uniform
    push = "".join(f"set atom {n} vx {draw(-1, 1)!r} vy {draw(-1, 1)!r} vz {draw(-1, 1)!r}\n"
                   for n in range(1, len(rows) + 1))
    output = MOVING.format(every=steps).replace("thermo 1\n", "thermo 100\n")
    return (box((0, 0, 0), size, "p p p") + make + SPRINGS.format(dt=1e-6) + push + heat + output + f"run {steps}\n")


def normal_springs(frame, size):
    stiffness = {(1, 1): 4000.0, (1, 2): 3000.0, (2, 2): 2000.0}
    grain = list(zip(*(frame[name] for name in ("x", "y", "z", "radius", "type"))))
    total = 0.0
    for n, a in enumerate(grain):
        for b in grain[:n]:
            apart = math.sqrt(sum(((p - q + 1.5 * L) % L - 0.5 * L) ** 2 for p, q, L in zip(a, b, size)))
            overlap = a[3] + b[3] - apart
            if overlap > 0.0:
                total += 0.5 * stiffness[tuple(sorted((int(a[4]), int(b[4]))))] * overlap ** 2
    return total


@pytest.mark.parametrize("damped, np, within", [(False, 1, 5e-3), (False, 2, 5e-3), (True, 1, 5e-3)])
def test_energy_of_many_colliding_grains_closes(damped, np, within, dempm):
    """Kinetic energy, that of normal springs and heat; the tangential springs of the last instant are left out."""
    rows, size = packing(0.0125, 0.0002)
    rows = [(*row[:5], 300.0) for row in rows]
    script = gas(20000, size, rows)
    if damped:
        script = script.replace(SPRINGS.format(dt=1e-6), model_of("hooke/stiffness", True).format(dt=1e-6))
    run = dempm(script, np=np)
    (_, first), (_, end) = run.dump("end.dump")
    capacity = [m * (0.1, 0.2)[int(t) - 1] for m, t in zip(end["mass"], end["type"])]
    heat = math.fsum(c * (T - 300.0) for c, T in zip(capacity, end["f_Temp[0]"]))
    mechanical = [kinetic(frame) + normal_springs(frame, size) for frame in (first, end)]
    print("closure", heat / (mechanical[0] - mechanical[1]) - 1, "of", heat / mechanical[0])
    assert heat > 0.1 * mechanical[0]
    assert heat == pytest.approx(mechanical[0] - mechanical[1], rel=within)


# ------------------------------------------------------------------------------------------------------- walls
PLATE = {"plate.stl": stl(*quad((-0.01, -0.01, 0), (0.05, -0.01, 0), (0.05, 0.05, 0), (-0.01, 0.05, 0)))}
FLOORS = {
    "plane": "fix floor all wall/gran model {model} tangential history primitive type 2 zplane 0.0\n",
    "mesh": "fix plate all mesh/surface file plate.stl type 2\n"
            "fix floor all wall/gran model {model} tangential history mesh n_meshes 1 meshes plate\n",
}


def thrown(name, damped, floor, dt, duration=0.008):
    """A grain is thrown at a floor; another one flies where nothing is."""
    rows = [(1, 0.005, 0.0150, 0.018, 0.0052, 300.0), (2, 0.004, 0.0342, 0.03, 0.03, 300.0)]
    make, heat = grains(rows)
    push = "velocity all set 0 0 0\ngroup one id 1\nvelocity one set 0.4 0.3 -0.4\nset atom 1 omegax 30 omegay -20\n"
    steps = round(duration / dt)
    return (box((0, 0, -0.001), (0.04, 0.04, 0.04), "f f f") + make + model_of(name, damped).format(dt=dt) +
            FLOORS[floor].format(model=name) + push + heat +
            MOVING.replace("f_heat[4] ke", "f_heat[4] f_heat[5] ke").format(every=steps) + f"run {steps}\n")


@pytest.mark.parametrize("floor", ["plane", "mesh"])
@pytest.mark.parametrize("name, damped", [("hooke/stiffness", False), ("hooke/stiffness", True), ("hertz", False),
                                          ("hertz", True), ("hertz/stiffness", True)])
def test_half_of_the_energy_lost_at_a_wall_heats_the_grain(name, damped, floor, dempm, tmp_path):
    errors = []
    for dt in (4e-6, 2e-6):
        run = dempm(thrown(name, damped, floor, dt), files=PLATE, cwd=tmp_path / str(dt))
        (_, first), (_, end) = run.dump("end.dump")
        lost = kinetic(first) - kinetic(end)
        gained = 0.1 * end["mass"][0] * (end["f_Temp[0]"][0] - 300.0)
        flows = [dt * math.fsum(run.table[f"f_heat[{k}]"]) for k in (4, 5)]
        assert lost > (0.1 if damped else 0.01) * kinetic(first) and end["vz"][0] > 0.0
        assert flows[0] + flows[1] == pytest.approx(gained, rel=1e-7) and (flows[1] > 0.0) == damped
        assert end["f_Temp[0]"][1] == 300.0
        errors.append(abs(2 * gained / lost - 1))
    print("energy closure at a wall", name, damped, floor, errors)
    assert errors[1] < 1e-3 and errors[1] < errors[0]


def sliding_on(floor, speed, steps=10000):
    """A grain at rest on a floor, by its weight, is set in motion."""
    overlap = 2500 * 4 / 3 * math.pi * 0.005 ** 3 * 9.81 / 3000
    make, heat = grains([(1, 0.005, 0.02, 0.02, 0.005 - overlap, 300.0), (2, 0.004, 0.0342, 0.03, 0.03, 300.0)])
    springs = model_of("hooke/stiffness", True).format(dt=2e-6)
    push = ("fix g all gravity 9.81 vector 0 0 -1\nvelocity all set 0 0 0\ngroup one id 1\n"
            f"velocity one set {speed} 0 0\n")
    output = MOVING.replace("thermo 1\n", "thermo 1000\n").format(every=steps)
    return (box((0, 0, -0.001), (0.04, 0.04, 0.04), "f f f") + make + springs + floor + push + heat + output +
            f"run {steps}\n")


def test_sliding_on_floors_and_belts(dempm, tmp_path):
    """What counts is the speed relative to the wall."""
    plane, mesh = (FLOORS[name].format(model="hooke/stiffness") for name in ("plane", "mesh"))
    move = "fix move_plate all move/mesh mesh plate linear -0.4 0 0\n"
    small = quad((0.013, 0.01, 0), (0.035, 0.01, 0), (0.035, 0.03, 0), (0.013, 0.03, 0))  # stays in the box
    belt = plane.replace("\n", " shear x -0.4\n")
    scripts = {"plane": (plane, 0.4), "belt": (belt, 0.0), "moving": (mesh + move, 0.0)}
    gains = {}
    for name, (floor, speed) in scripts.items():
        run = dempm(sliding_on(floor, speed), files={"plate.stl": stl(*small)}, cwd=tmp_path / name)
        (_, first), (_, end) = run.dump("end.dump")
        gains[name] = 0.1 * end["mass"][0] * (end["f_Temp[0]"][0] - 300.0)
        if name == "plane":
            lost = kinetic({key: value[:1] for key, value in first.items()})
            lost -= kinetic({key: value[:1] for key, value in end.items()})
    print("energy closure, sliding", 2 * gains["plane"] / lost - 1, gains)
    assert 2 * gains["plane"] == pytest.approx(lost, rel=1e-3)
    assert gains["belt"] == pytest.approx(gains["plane"], rel=1e-6)
    assert gains["moving"] == pytest.approx(gains["plane"], rel=1e-3)


# -------------------------------------------------------------------------------------------------- collisions
def bounce(dt, duration=6e-3):
    """Two grains of different size and type hit each other head on; LIGGGHTS' Hertz without damping, E = 5e6."""
    rows = [(1, 0.005, 0.0148, 0.01, 0.01, 350.0), (2, 0.004, 0.0240, 0.01, 0.01, 250.0)]
    make, heat = grains(rows)
    steps = round(duration / dt)
    return (box((0, 0, 0), (0.04, 0.02, 0.02), "f f f") + make +
            PROPERTIES.format(skin=0.001).replace("2e-5", repr(dt))
            .replace("0.5 0.5 0.5 0.5", "0.999999 0.999999 0.999999 0.999999").replace("0.1 0.2", "100 200") +
            "fix heat all heat/gran/grain initial_temperature 300 direct collisional\nfix move all nve/sphere\n"
            "velocity all set 0 0 0\ngroup one id 1\nvelocity one set 0.2 0 0\n" + heat +
            MOVING.replace("f_heat[4] ", "").format(every=steps) + f"run {steps}\n")


def collisional(masses, speed):
    """Table 1, corrected, in the order of heat capacities per volume that the formula wants."""
    radii, k, density = (0.005, 0.004), (20.0, 90.0), 2500.0
    per_volume = [density * c for c in (100.0, 200.0)]
    m, r = (a * b / (a + b) for a, b in (masses, radii))
    stiffness = 5e6 / (2 * (1 - 0.09))
    widest = (15 * m * r * r * speed ** 2 / (16 * stiffness)) ** 0.2
    duration = 2.8683 * (m * m / (r * stiffness ** 2 * speed)) ** 0.2
    ratio, fourier = per_volume[0] / per_volume[1], k[0] * duration / (per_volume[0] * widest ** 2)
    c1, c2, c3 = (-2.3 * ratio ** 2 + 8.909 * ratio - 4.235, 8.169 * ratio ** 2 - 33.77 * ratio + 24.885,
                  -5.758 * ratio ** 2 + 24.464 * ratio - 20.511)
    factor = 0.435 / c1 * (math.sqrt(c2 * c2 - 4 * c1 * (c3 - fourier)) - c2)
    resistance = sum((c * conductivity) ** -0.5 for c, conductivity in zip(per_volume, k))
    return factor * math.pi * widest ** 2 / math.sqrt(duration) / resistance, duration


def test_an_impact_exchanges_the_collisional_heat(dempm, tmp_path):
    runs = [dempm(bounce(2e-6), np=np, cwd=tmp_path / str(np)) for np in (1, 2)]
    masses, (one, two) = last(runs[0], "mass"), last(runs[0], "f_Temp[0]")
    assert last(runs[0], "vx")[0] < last(runs[0], "vx")[1]  # they have parted
    h, duration = collisional(masses, 0.2)
    rate = h * sum(1 / (c * m) for c, m in zip((100.0, 200.0), masses))
    print("collisional heat", (100.0 - (one - two)) / (-100.0 * math.expm1(-rate * duration)) - 1)
    assert 100.0 - (one - two) == pytest.approx(-100.0 * math.expm1(-rate * duration), rel=5e-3)
    heat_of_one, heat_of_two = 100.0 * masses[0] * (one - 350.0), 200.0 * masses[1] * (two - 250.0)
    assert heat_of_one == pytest.approx(-heat_of_two, rel=1e-9)
    assert last(runs[1], "f_Temp[0]") == pytest.approx([one, two], rel=1e-12)


def test_friction_and_collisions_keep_separate_records(dempm, tmp_path):
    both = impact(2e-6).replace("fix heat all", "fix y all property/global youngsModulus peratomtype 5e6 5e6\n"
                                "fix p all property/global poissonsRatio peratomtype 0.3 0.3\nfix heat all")
    runs = [dempm(script, cwd=tmp_path / str(n))
            for n, script in enumerate((impact(2e-6), both.replace("direct none", "direct collisional")))]
    work = [sum(run.table["f_heat[4]"]) for run in runs]
    assert work[0] > 0.0 and work[1] == work[0]
    assert last(runs[0], "omegaz") == last(runs[1], "omegaz")


# ----------------------------------------------------------------------------------------------------- damping
@pytest.mark.parametrize("damped", [False, True, "normal"], ids=["friction", "damping", "normal"])
@pytest.mark.parametrize("name", ["hooke/stiffness", "hertz", "hertz/stiffness"])
def test_all_lost_energy_becomes_heat(name, damped, dempm, tmp_path):
    """`normal`: there are no dashpots across, tangential_damping off."""
    errors = []
    for dt in (4e-6, 2e-6):
        script = impact(dt).replace(SPRINGS.format(dt=dt), model_of(name, damped).format(dt=dt))
        script = script.replace("f_heat[4] ke", "f_heat[4] f_heat[5] ke")
        if damped == "normal":
            script = script.replace("damping yes", "damping normal").replace("l history", "l history tangential_damping off")
        run = dempm(script, cwd=tmp_path / str(dt))
        (_, first), (_, end) = run.dump("end.dump")
        lost = kinetic(first) - kinetic(end)
        gained = [m * c * (T - 300.0) for m, c, T in zip(end["mass"], (0.1, 0.2), end["f_Temp[0]"])]
        flows = [dt * math.fsum(run.table[f"f_heat[{k}]"]) for k in (4, 5)]
        assert lost > (0.1 if damped else 0.01) * kinetic(first) and end["vx"][0] < end["vx"][1]
        assert gained[0] == pytest.approx(gained[1], rel=1e-7) and sum(flows) == pytest.approx(sum(gained), rel=1e-7)
        assert flows[0] > 0.0 and (flows[1] > 0.1 * lost if damped else abs(flows[1]) < 1e-4 * lost)
        errors.append(abs(sum(gained) / lost - 1))
    print("energy closure", name, damped, errors)
    assert errors[1] < 2e-4 and errors[1] < errors[0]
