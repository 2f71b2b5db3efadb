#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""`fix heat/gran/grain direct liggghts` against the fix heat/gran/conduction of the installed liggghts, 10,000 steps each: two
grains, a chain, a packing of 1,000 grains that falls on a hot floor, and the scenes of LIGGGHTS' tutorials heatTransfer_1 (one
half of a bed in a cylinder is hot) and heatTransfer_2 (sources and sinks in it).

   thermal_liggghts.py        from the root, after `make`"""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.insert(1, str(pathlib.Path(__file__).resolve().parents[1] / "scenes"))
from report import Report, Run, stock  # noqa: E402  first: it knows the way to the next one's modules
from test_grain_heat import OUTPUT, PAIR_ROWS, box, grains, packing, properties  # noqa: E402

STEPS = 10000
FIXES = {"ours": "heat/gran/grain initial_temperature 300 direct liggghts",
         "stock": "heat/gran/conduction initial_temperature 300"}
CHAIN = [(1 + n % 2, 0.005, 0.005 + 0.0098 * n, 0.01, 0.01, 500.0 if n == 0 else 300.0) for n in range(20)]
FALL = """
fix g all gravity 9.81 vector 0 0 -1
fix floor all wall/gran model hertz tangential history primitive type 1 zplane 0.0 temperature 500
fix move all nve/sphere
"""


def scene(rows, low, high, boundary, fix, more=""):
    make, heat = grains(rows)
    return (box(low, high, boundary) + make + properties("") + f"fix heat all {fix}\n" + more + heat +
            OUTPUT.format(every=STEPS // 10) + f"run {STEPS}\n")


def two(fix):
    return scene(PAIR_ROWS, (0, 0, 0), (0.04, 0.02, 0.02), "f f f", fix)


def chain(fix):
    return scene(CHAIN, (0, 0, 0), (0.21, 0.02, 0.02), "f f f", fix)


def fall(fix):
    rows, size = packing(0.0125, 0.0003, (10, 10, 10))
    return scene(rows, (0, 0, -0.001), (size[0], size[1], 0.2), "p p f", fix, FALL)


def bed(fix, conductivity, restitution, event):
    """Steel spheres in a cylinder between two planes, poured loose and settled; then `event`, then the steps."""
    wall = "fix {0} all wall/gran model hertz tangential history primitive type 1 {1}\n"
    planes = {"floor": "zplane 0.0", "roof": "zplane 0.15", "shell": "zcylinder 0.05 0. 0."}
    return f"""
atom_style granular
atom_modify map array
units si
newton off
communicate single vel yes
boundary m m m
region all block -0.05 0.05 -0.05 0.05 0. 0.15 units box
create_box 1 all
neighbor 0.002 bin
neigh_modify delay 0
fix m1 all property/global youngsModulus peratomtype 5.e6
fix m2 all property/global poissonsRatio peratomtype 0.45
fix m3 all property/global coefficientRestitution peratomtypepair 1 {restitution}
fix m4 all property/global coefficientFriction peratomtypepair 1 0.05
fix k all property/global thermalConductivity peratomtype {conductivity}
fix c all property/global thermalCapacity peratomtype 10.
pair_style gran model hertz tangential history
pair_coeff * *
timestep 2.5e-5
fix g all gravity 9.81 vector 0 0 -1
{"".join(wall.format(*item) for item in planes.items())}
fix heat all {fix}
region pour cylinder z 0. 0. 0.045 0. 0.15 units box
fix t1 all particletemplate/sphere 15485863 atom_type 1 density constant 8000 radius constant 0.004
fix d1 all particledistribution/discrete 15485867 1 t1 1.0
fix pack all insert/pack seed 32452843 distributiontemplate d1 vel constant 0. 0. -0.3 &
  insert_every once overlapcheck yes all_in yes volumefraction_region 0.25 region pour
fix move all nve/sphere
run 1
unfix pack
run 10000 upto
{event}
{OUTPUT.format(every=STEPS // 10)}
run {STEPS}
"""


def half(fix):
    return bed(fix, 100, 0.7, "region half block 0 INF INF INF INF INF units box\nset region half property/atom Temp 800.")


def sources(fix):
    return bed(fix, 5, 0.95, "region in block 0.03 INF INF INF INF INF units box\nregion out block INF -0.03 INF INF INF INF units box\n"
               "set region in property/atom heatSource 1.5\nset region out property/atom heatSource -1.5")


def main():
    if not stock():
        sys.exit("liggghts is not installed: nothing to compare with")
    report = Report("LIGGGHTS")
    for name, script in (("two grains", two), ("chain of 20", chain), ("1,000 grains fall on a hot floor", fall),
                         ("tutorial heatTransfer_1", half), ("tutorial heatTransfer_2", sources)):
        folder = "liggghts_" + script.__name__
        ours = Run(folder + "_ours", script(FIXES["ours"]))
        theirs = Run(folder + "_stock", script(FIXES["stock"]), program=stock())
        mine, other = ([frame for _, frame in run.dump("end.dump")] for run in (ours, theirs))
        T, reference = ([value for frame in frames for value in frame["f_Temp[0]"]] for frames in (mine, other))
        moved = max(abs(a - b) for a, b in zip(other[0]["f_Temp[0]"], other[-1]["f_Temp[0]"]))
        assert len(T) == len(reference) > 1 and mine[-1]["z"] == other[-1]["z"] and moved > 1.0, (len(T), moved)
        last = other[-1]["f_Temp[0]"]
        print(f"{name}: {len(last)} grains, {len(other)} times, temperatures at the end {min(last):.1f} to {max(last):.1f}, changed by up to "
              f"{moved:.1f}")
        report.check(f"{name}, {len(last)} grains: temperatures over {STEPS} steps, relative",
                     max(abs(a - b) for a, b in zip(T, reference)) / max(map(abs, reference)), 1e-10, ours.seconds + theirs.seconds)
    sys.exit(report.write())


if __name__ == "__main__":
    main()
