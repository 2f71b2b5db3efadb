# SPDX-License-Identifier: GPL-2.0-or-later
"""Scripts and comparisons that several scene tests share."""

HEAD = """
dimension 2
units si
atom_style granular
atom_modify map array
newton off
communicate single vel yes
"""

BOX = HEAD + """
boundary {boundary} p
region box block 0 2 0 2 -0.025 0.025 units box
create_box 1 box
"""

# A block of 20 x 10 points that falls on a floor with friction and slides against a moving box; the split of the box
# among ranks cuts it.
POINTS = """
lattice sq 0.05 origin 0.5 0.5 0
region block block 0.5 1.5 0.1 0.6 -0.025 0.025 units box
create_atoms 1 region block
set group all density 1000 vx 0.5
"""

ELASTIC = """
neighbor 0.05 bin
timestep 2e-4
fix E all property/global youngsModulus peratomtype 1e6
fix nu all property/global poissonsRatio peratomtype 0.3
fix mpm all mpm/couple grid 0.1 shape gimp transfer {transfer} material elastic plane_strain &
  point/size 0.05 0.05 {extra}
fix g all gravity 9.81 vector 0 -1 0
fix floor all mpm/wall mpm plane y 0 friction 0.5 side +
fix ram all mpm/wall mpm box 1.6 1.8 -0.1 1 velocity -0.5 0 0
"""

# Properties of grains: contact law, and heat.
GRAINS = """
fix kn all property/global kn peratomtypepair 1 1e6
fix kt all property/global kt peratomtypepair 1 1e6
fix mu all property/global coefficientFriction peratomtypepair 1 0.5
"""
GRAIN_HEAT = """
fix beta all property/global thermalExpansionCoefficient peratomtype 1e-5
fix c all property/global thermalCapacity peratomtype 670
"""


def elastic_block(boundary="f f", points=POINTS, transfer="flip 1", extra=""):
    return BOX.format(boundary=boundary) + points + ELASTIC.format(transfer=transfer, extra=extra)


# Everything that a point has, to the last bit, by point number.
STATE_COLUMNS = " ".join(["f_mpm[30]", "x", "y", "vx", "vy"] + [f"f_mpm[{k}]" for k in range(1, 30)])


def state_dump(every, name="state"):
    form = " ".join(["%g"] + ["%.17g"] * 33)
    return f'dump {name} all custom {every} {name}.*.txt {STATE_COLUMNS}\ndump_modify {name} format "{form}"\n'


def state(run, step, name="state"):
    """{point number: its line}. The order of lines is LIGGGHTS' own affair."""
    lines = (run.path / f"{name}.{step}.txt").read_text().split("ITEM: ATOMS", 1)[1].splitlines()[1:]
    points = {int(line.split()[0]): line for line in lines}
    assert len(points) == len(lines) > 0
    return points
