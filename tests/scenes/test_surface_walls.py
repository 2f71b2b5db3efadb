# SPDX-License-Identifier: GPL-2.0-or-later
"""Walls of segments and of meshes: fix mpm/wall ... segment, fix mpm/wall ... mesh with LIGGGHTS' fix mesh/surface."""
import shutil

import pytest
from conftest import BUILD, ROOT, execute
from scripts import BOX, HEAD, POINTS, state, state_dump


def stl(*triangles):
    lines = ["solid mesh"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex {:.9g} {:.9g} {:.9g}".format(*corner) for corner in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join(lines + ["endsolid mesh", ""])


def quad(a, b, c, d):
    return [(a, b, c), (a, c, d)]


def state_dump_3d(every):
    return state_dump(every).replace(" y ", " y z ").replace('"%g', '"%g %.17g', 1)


CUBE = HEAD.replace("dimension 2", "dimension 3") + """
boundary f f f
region box block -0.5 1.5 -0.5 1.5 -0.5 1 units box
create_box 1 box
neighbor 0.05 bin
lattice sc 0.05 origin 0.5 0.5 0.5
region cube block 0.3 0.7 0.3 0.7 0.05 0.35 units box
create_atoms 1 region cube
set group all density 1000 vx 0.3
fix E all property/global youngsModulus peratomtype 1e6
fix nu all property/global poissonsRatio peratomtype 0.3
fix mpm all mpm/couple grid 0.1 shape {shape} transfer flip 0.99 material elastic 3d
fix g all gravity 9.81 vector 0 0 -1
timestep 2e-4
"""
THERMO = """
thermo 100
thermo_style custom step f_mpm[1] f_mpm[2] f_mpm[4] f_mpm[5] f_floor[1] f_floor[3] f_floor[6] f_floor[8]
thermo_modify format float %.15g
"""
FLOOR = stl(*quad((-0.4, -0.4, 0), (1.4, -0.4, 0), (1.4, 1.4, 0), (-0.4, 1.4, 0)))
MESH = "fix mesh all mesh/surface file floor.stl type 1\n"


@pytest.mark.parametrize("shape", ["linear", "gimp", "bspline"])
def test_a_mesh_of_two_triangles_is_a_plane(shape, dempm):
    tables = []
    for wall in ["plane z 0", "mesh mesh", "mesh mesh side +"]:
        script = CUBE.format(shape=shape) + MESH + f"fix floor all mpm/wall mpm {wall} friction 0.3\n" + THERMO
        script += "run 1500\n"
        tables.append(dempm(script, files={"floor.stl": FLOOR}).table)
    assert max(tables[0]["floor[3]"]) > 0.0
    for table in tables[1:]:
        for name, values in tables[0].items():
            assert table[name] == values, name


def test_a_moving_mesh_pushes_as_a_moving_plane(dempm):
    """To half a cell: from there on a surface holds the next layer of nodes, a plane only when it has passed it."""
    tables = []
    for wall in ["plane z 0 velocity 0.1 0 0.15", "mesh mesh"]:
        script = CUBE.format(shape="gimp") + MESH
        if wall.startswith("mesh"):
            script += "fix move all move/mesh mesh mesh linear 0.1 0. 0.15\n"
        script += f"fix floor all mpm/wall mpm {wall} friction 0.3\n" + THERMO + "run 1500\n"
        tables.append(dempm(script, files={"floor.stl": FLOOR}).table)
    plane, mesh = tables
    assert plane["floor[8]"][-1] > 0.0 and plane["floor[6]"][-1] > 0.0
    for name in ["mpm[2]", "mpm[4]", "mpm[5]", "floor[6]", "floor[8]"]:
        scale = max(map(abs, plane[name]))
        # the mesh's place is a sum of other roundings than the plane's: 1e-8 of a cell decides about a node
        assert mesh[name] == pytest.approx(plane[name], abs=1e-6 * scale), name


def test_a_rotating_mesh_does_not_depend_on_ranks(dempm, tmp_path):
    """A plate that turns about its edge throws the cube; its work is counted: energy of the body = work less losses."""
    script = CUBE.format(shape="gimp") + MESH + """
fix move all move/mesh mesh mesh rotate origin -0.4 0. 0. axis 0. -1. 0. period 6.
fix floor all mpm/wall mpm mesh mesh friction 0.3
""" + THERMO + state_dump_3d(600) + "run 600\n"
    runs = [dempm(script, np=np, files={"floor.stl": FLOOR}, cwd=tmp_path / str(np)) for np in (1, 3)]
    assert state(runs[0], 600) == state(runs[1], 600)
    assert runs[0].table["floor[8]"][-1] > 0.0


HOPPER = HEAD.replace("dimension 2", "dimension 3") + """
boundary f f f
region box block -0.4 0.4 -0.4 0.4 -0.5 0.9 units box
create_box 1 box
neighbor 0.05 bin
timestep 2e-4
fix kn   all property/global kn peratomtypepair 1 1e6
fix kt   all property/global kt peratomtypepair 1 1e6
fix mu   all property/global coefficientFriction peratomtypepair 1 0.5
fix rve all mpm/rve packing spheres.data model hooke/stiffness tangential history density 2650 grain sphere &
  damping viscous 0.2
lattice sc 0.05 origin 0.5 0.5 0.5
region fill block -0.2 0.2 -0.2 0.2 0.15 0.25 units box
create_atoms 1 region fill
fix mpm all mpm/couple grid 0.1 shape gimp transfer flip 0.99 material rve rve
fix g all gravity 9.81 vector 0 0 -1
fix silo all mesh/surface file silo.stl type 1
fix wall all mpm/wall mpm mesh silo friction 0.1
thermo 1
thermo_style custom step f_mpm[1] f_mpm[4] f_wall[3] f_wall[4]
thermo_modify format float %.15g
dump d all custom 100 points.*.txt id x y z
""" + state_dump_3d(200)


def silo(half, outlet, low, shoulder, top):
    """A square silo with a hopper in the shape of a cut pyramid, normals inside."""
    ring = lambda r, z: [(-r, -r, z), (r, -r, z), (r, r, z), (-r, r, z)]
    rings = [ring(outlet, low), ring(half, shoulder), ring(half, top)]
    faces = []
    for below, above in zip(rings, rings[1:]):
        for k in range(4):
            faces += quad(below[(k + 1) % 4], below[k], above[k], above[(k + 1) % 4])
    return stl(*faces)


def make_spheres(path):
    """16 spheres of 0.05 to 0.1 m: large grains, so that one DEM step per MPM step will do."""
    words = f"{BUILD}/dempm-pack generate {path} dimension 3 radius 0.05 0.1 pressure 1e3 preparation_friction 0.5"
    code, output = execute(words.split() + "density 2650 kn 1e6 kt 1e6 grains 16".split())
    assert code == 0, output


def test_grains_leave_a_silo_of_triangles_through_its_outlet_only(dempm, tmp_path):
    """A silo of 0.5 m x 0.5 m with a hopper at 45 degrees and an outlet of 0.3 m x 0.3 m at z = 0.1."""
    make_spheres(tmp_path / "spheres.data")
    mesh = {"silo.stl": silo(0.25, 0.15, 0.1, 0.2, 0.8)}
    run = dempm(HOPPER + "run 1800\n", files=mesh, cwd=tmp_path)
    steps = sorted(int(path.name.split(".")[1]) for path in tmp_path.glob("points.*.txt"))
    assert steps[-1] == 1800
    for step in steps:
        points = run.dump(f"points.{step}.txt")[0][1]
        for x, y, z in zip(points["x"], points["y"], points["z"]):
            if z > 0.1:
                assert max(abs(x), abs(y)) < min(0.25, 0.05 + z), f"step {step}: a point went through a wall"
    below = sum(z < 0.1 for z in points["z"])
    print(f"{below} of {len(points['z'])} points have left after 0.36 s")
    assert 16 <= below < len(points["z"])  # how fast they flow is a matter of the 16 grains
    # momentum = impulse of weight and wall; 1e-9: round-off of 1800 steps
    table, dt = run.table, 2e-4
    expected = sum(table["wall[3]"][1:]) * dt - table["mpm[1]"][0] * 9.81 * 1800 * dt
    assert table["mpm[4]"][-1] == pytest.approx(expected, rel=1e-9)
    assert min(table["wall[4]"][1:]) >= -1e-9 * max(table["wall[4]"])
    one = state(run, 200)
    make_spheres((tmp_path / "two").mkdir() or tmp_path / "two" / "spheres.data")
    assert state(dempm(HOPPER + "run 200\n", np=2, files=mesh, cwd=tmp_path / "two"), 200) == one


WRONG = [
    ("no mesh", "mesh mesh", "mesh nobody", ["'mesh'", "nobody", "fix mesh/surface"]),
    ("not a mesh", "mesh mesh", "mesh g", ["'mesh'", "fix g", "gravity", "mesh/surface"]),
    ("no id", "mesh mesh friction 0.3", "mesh", ["'mesh'", "missing", "ID"]),
    ("velocity", "mesh mesh", "mesh mesh velocity 0 0 1", ["'mesh'", "'velocity'", "move/mesh"]),
    ("segment in 3D", "mesh mesh", "segment 0 0 1 0", ["'segment'", "2D", "'mesh'"]),
    ("side", "mesh mesh", "mesh mesh side up", ["'side'", "'up'"]),
    ("heat", "mesh mesh", "mesh mesh temperature 5", ["'temperature'", "thermal yes"]),
]


@pytest.mark.parametrize("np", [1, 2])
@pytest.mark.parametrize("old, new, words", [case[1:] for case in WRONG], ids=[case[0] for case in WRONG])
def test_wrong_meshes_are_refused(old, new, words, np, dempm):
    line = "fix floor all mpm/wall mpm mesh mesh friction 0.3\n"
    script = CUBE.format(shape="gimp") + MESH + line.replace(old, new) + "run 2\n"
    run = dempm(script, np=np, files={"floor.stl": FLOOR}, check=False, timeout=20)
    assert run.code > 0
    errors = " ".join(" ".join(text for text in run.output.splitlines() if "ERROR" in text).split())
    assert all(word in errors for word in ["Fix mpm/wall (id floor)", *words]), errors


def test_a_moving_mesh_continues_from_a_restart(dempm, tmp_path):
    """LIGGGHTS writes mesh and motion into the restart file; 2 N steps equal N steps, restart and N steps."""
    tail = MESH + "fix move all move/mesh mesh mesh rotate origin -0.4 0. 0. axis 0. -1. 0. period 6.\n"
    tail += "fix floor all mpm/wall mpm mesh mesh friction 0.3\n" + THERMO
    tail += state_dump_3d(200)
    script = CUBE.format(shape="gimp").replace("elastic 3d", "elastic 3d point/size 0.05 0.05 0.05")
    head, body = script.split("fix E all", 1)
    body = "neighbor 0.05 bin\nfix E all" + body
    through = dempm(head + body + tail + "restart 600 half.*\nrun 1000\n", files={"floor.stl": FLOOR}, cwd=tmp_path)
    expected, table = state(through, 1000), through.table
    assert table["floor[8]"][-1] > 0.0
    (tmp_path / "state.1000.txt").unlink()
    start = HEAD.replace("dimension 2", "dimension 3") + "read_restart half.600\n"
    again = dempm(start + body + tail + "run 400\n", cwd=tmp_path)
    assert state(again, 1000) == expected
    assert again.table["floor[8]"][-1] == table["floor[8]"][-1]


def test_segments_continue_from_a_restart(dempm, tmp_path):
    """A moving, inclined, warm segment; 2 N steps equal N, restart and N, on other ranks, too."""
    tail = """
neighbor 0.05 bin
timestep 2e-4
fix E all property/global youngsModulus peratomtype 1e6
fix nu all property/global poissonsRatio peratomtype 0.3
fix c all property/global thermalCapacity peratomtype 10
fix k all property/global thermalConductivity peratomtype 100
fix beta all property/global thermalExpansionCoefficient peratomtype 1e-5
fix mpm all mpm/couple grid 0.1 shape gimp transfer flip 0.99 material elastic plane_strain point/size 0.05 0.05 &
  thermal yes temperature 0
fix g all gravity 9.81 vector 0 -1 0
fix wall all mpm/wall mpm segment 0.2 0.3 0.9 -0.05 1.8 0.1 friction 0.5 velocity 0 0.1 0 temperature 10
thermo 100
thermo_style custom step f_mpm[2] f_mpm[3] f_mpm[5] f_mpm[8] f_wall[1] f_wall[2] f_wall[6] f_wall[7] f_wall[8] &
  f_wall[10]
thermo_modify format float %.15g
""" + state_dump(600)
    first = BOX.format(boundary="f f").replace("box block 0 2 0 2", "box block 0 2 -0.5 2") + POINTS + tail
    through = dempm(first + "restart 600 half.*\nrun 1200\n", cwd=tmp_path)
    expected, table = state(through, 1200), through.table
    assert table["wall[7]"][-1] > 0.0 and table["wall[2]"][-1] > 0.0 and table["wall[10]"][-1] == pytest.approx(0.024)
    for np in (1, 3):
        (tmp_path / "state.1200.txt").unlink()
        again = dempm(HEAD + "read_restart half.600\n" + tail + "run 600\n", np=np, cwd=tmp_path)
        assert state(again, 1200) == expected
        for name in table:
            # sums over ranks come in another order
            assert again.table[name][-1] == pytest.approx(table[name][-1], rel=1e-12, abs=1e-12), name


@pytest.mark.parametrize("boundary", ["f f", "p f"])
def test_a_level_segment_is_a_plane_on_any_number_of_ranks(boundary, dempm, tmp_path):
    """Also across a periodic boundary, where the segment repeats with the box: the block slides through it."""
    script = BOX.format(boundary=boundary) + POINTS.replace("vx 0.5", "vx 4" if boundary == "p f" else "vx 0.5") + """
neighbor 0.05 bin
timestep 2e-4
fix E all property/global youngsModulus peratomtype 1e6
fix nu all property/global poissonsRatio peratomtype 0.3
fix mpm all mpm/couple grid 0.1 shape gimp transfer flip 0.99 material elastic plane_strain
fix g all gravity 9.81 vector 0 -1 0
fix floor all mpm/wall mpm {wall} friction 0.2
thermo 100
thermo_style custom step f_mpm[2] f_mpm[3] f_floor[2] f_floor[6]
thermo_modify format float %.15g
""" + state_dump(1500).replace("{", "{{").replace("}", "}}") + "run 1500\n"
    states = []
    for k, (wall, np) in enumerate([("plane y 0", 1), ("segment 0 0 0.73 0 2 0", 1), ("segment 0 0 0.73 0 2 0", 2)]):
        run = dempm(script.format(wall=wall), np=np, cwd=tmp_path / str(k))
        assert run.table["floor[6]"][-1] > 0.0
        states.append(state(run, 1500))
    assert states[0] == states[1] == states[2]


@pytest.mark.parametrize("size, points", [("demo", 544), ("paper", 1088)])
def test_the_silo_example_runs(size, points, dempm, tmp_path):
    """examples/silo with 16 grains and a few steps: both sizes, both cases; the plate does work, nothing leaks."""
    for file in (ROOT / "examples" / "silo").glob("*.inc"):
        shutil.copy(file, tmp_path)
    (tmp_path / "out").mkdir()
    words = f"{BUILD}/dempm-pack generate {tmp_path}/out/packing.data radius 0.0025 0.005 pressure 1e4"
    words += " preparation_friction 0.5 density 2650 kn 1e6 kt 1e6 thickness 0.075 grains 16"
    code, output = execute(words.split())
    assert code == 0, output
    example = ROOT / "examples" / "silo"
    dempm(example / "in.settle", cwd=tmp_path, variables={"size": size, "t_settle": 0.002})
    heat = {}
    for case in ("free", "forced"):
        variables = {"size": size, "case": case, f"t_{case}": 0.02}
        table = dempm(example / "in.discharge", cwd=tmp_path, variables=variables).table
        assert table["mpm[1]"][0] == pytest.approx(points * 0.025**2 * 2650 * 0.8, rel=0.1)  # 20 % of voids
        assert table["above"][-1] == 1.0
        heat[case] = table["mpm[9]"][-1]
    assert heat["forced"] > 2 * heat["free"] > 0.0


def test_the_silo_in_3d_opens_its_gate(dempm, tmp_path):
    """examples/silo_3d, few points: all stay above the gate until LIGGGHTS moves it, then they leave through the outlet alone."""
    example = ROOT / "examples" / "silo_3d"
    for mesh in example.glob("*.stl"):
        shutil.copy(mesh, tmp_path)
    (tmp_path / "out").mkdir()
    make_spheres(tmp_path / "spheres.data")
    variables = {"packing": "spheres.data", "spacing": 0.05, "settle": 600, "flow": 1000, "frame": 100}
    run = dempm(example / "in.silo_3d", cwd=tmp_path, variables=variables)
    frames = run.dump("out/points.txt")
    below = []
    for step, points in frames:
        below.append(sum(z < 0.1 for z in points["z"]))
        for x, y, z in zip(points["x"], points["y"], points["z"]):
            assert z < 0.1 or max(abs(x), abs(y)) < min(0.25, z), f"step {step}: a point went through a wall"
        assert step > 600 or below[-1] == 0
    print(f"{below[-1]} of {len(points['z'])} points have left at the end")
    assert 0 < below[-1] < len(points["z"])
