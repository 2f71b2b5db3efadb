# SPDX-License-Identifier: GPL-2.0-or-later
"""Wrong scripts. Each is BASE, which runs, with one piece of text replaced; and words that the error message must hold.

A case: name, text of BASE, what stands there instead (or tuples of both), style of the fix that complains, words of its
message. "Fix STYLE (id " is always expected too.
"""
from collections import namedtuple

BASE = """\
dimension       2
units           si
atom_style      granular
atom_modify     map array
newton          off
communicate     single vel yes
boundary        f f p
region          box block -1 3 -1 3 -0.025 0.025 units box
create_box      1 box
neighbor        0.05 bin
timestep        1e-4
fix kn   all property/global kn peratomtypepair 1 1e6
fix kt   all property/global kt peratomtypepair 1 1e6
fix mu   all property/global coefficientFriction peratomtypepair 1 0.5
fix c    all property/global thermalCapacity peratomtype 670
fix beta all property/global thermalExpansionCoefficient peratomtype 1e-5
lattice         sq 0.1 origin 0.5 0.5 0
region          column block 0 0.4 0 0.4 -0.025 0.025 units box
create_atoms    1 region column
fix rve all mpm/rve packing good.data model hooke/stiffness tangential history density 2650 grain disk &
  thickness 0.075 damping viscous 0.2 pipe_resistance 16 reference 20 &
  bonds strength 0.1 shear_ratio 0.5 melting 60 substeps 2 skin 0.2 backend cpu threads 1
fix mpm all mpm/couple grid 0.2 shape gimp transfer flip 0.99 order usf material rve rve thermal yes &
  temperature 20 damping/point 0.1 damping/grid 0.1 point/size 0.1 0.1
fix g     all gravity 9.8 vector 0 -1 0
fix floor all mpm/wall mpm plane y -0.1 friction 0.5
fix hot   all mpm/wall mpm plane x -0.1 temperature 50
fix block all mpm/wall mpm box 1 1.5 0 0.5 noslip velocity 0 0 0
fix top   all mpm/traction mpm axis y side + pressure 100
fix see   all mpm/vtk mpm every 2 prefix see rves 1 grid yes
thermo_style    custom step f_mpm[1]
run             2
"""

# Two LIGGGHTS particles that overlap, before properties and pair style.
TWO_GRAINS = """\
atom_style      granular
atom_modify     map array
units           si
newton          off
communicate     single vel yes
boundary        f f f
region          box block 0 0.04 0 0.02 0 0.02 units box
create_box      1 box
create_atoms    1 single 0.01 0.01 0.01 units box
create_atoms    1 single 0.0195 0.01 0.01 units box
set             group all diameter 0.01 density 2500
neighbor        0.003 bin
"""

# A square crystal, 4 x 4 disks of radius 0.01 m, overlapping by 1 %.
SPACING = 0.0198


def data_file(radius=0.01, spacing=SPACING, atoms=16, header=None, edit=None):
    lines = [header or "packing", "", f"{atoms} atoms", "1 atom types", "", f"0 {4 * spacing} xlo xhi",
             f"0 {4 * spacing} ylo yhi", "-0.01 0.01 zlo zhi", "", "Atoms", ""]
    for k in range(16):
        x, y = (k % 4 + 0.5) * spacing, (k // 4 + 0.5) * spacing
        lines.append(f"{k + 1} 1 {2 * radius} 2650 {x:.6f} {y:.6f} 0")
    text = "\n".join(lines) + "\n"
    return edit(text) if edit else text


DUMP = ("ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS {bounds}\n0 1\n0 1\n0 1\n"
        "ITEM: ATOMS id x y z radius\n1 0.5 0.5 0.5 0.5\n")

FILES = {
    "good.data": data_file(),
    "empty.data": "",
    "prose.data": "Once upon a time\nthere was a packing.\n",
    "cut.data": data_file(edit=lambda text: text[:-200]),
    "toomany.data": data_file(atoms=17),
    "hugecount.data": data_file(atoms=99999999999999),
    "nan.data": data_file(edit=lambda text: text.replace("1 1 0.02 2650 0.009900", "1 1 0.02 2650 nan")),
    "negative.data": data_file(edit=lambda text: text.replace("1 1 0.02 2650", "1 1 -0.02 2650")),
    "zero_radius.data": data_file(edit=lambda text: text.replace("1 1 0.02 2650", "1 1 0.0 2650")),
    "overlap.data": data_file(radius=0.02),
    "twice.data": data_file(edit=lambda text: text.replace("\n2 1 0.02", "\n1 1 0.02")),
    "flat.data": data_file(edit=lambda text: text.replace(f"0 {4 * SPACING} ylo yhi", "0 0 ylo yhi")),
    "walls.dump": DUMP.format(bounds="ff ff pp"),
    "noradius.dump": DUMP.format(bounds="pp pp pp").replace(" radius", "").replace(" 0.5\n1", "\n1"),
}

class Case(namedtuple("Case", "name old new style words")):
    BASE = BASE

    def script(self):
        text = self.BASE
        for old, new in zip(*((part,) if isinstance(part, str) else part for part in (self.old, self.new))):
            assert text.count(old) == 1, f"{self.name}: '{old}' must stand once in BASE"
            text = text.replace(old, new)
        return text


def packing(name, file, *words):
    return Case(name, "packing good.data", f"packing {file}", "mpm/rve", ("'packing'", *words))


def rve(name, old, new, *words):
    return Case(name, old, new, "mpm/rve", words)


def couple(name, old, new, *words):
    return Case(name, old, new, "mpm/couple", words)


def wall(name, old, new, *words):
    return Case(name, old, new, "mpm/wall", words)


def traction(name, new, *words):
    return Case(name, "axis y side + pressure 100", new, "mpm/traction", words)


def vtk(name, new, *words):
    return Case(name, "every 2 prefix see rves 1 grid yes", new, "mpm/vtk", words)


def prop(name, old, new, style, *words):
    return Case(name, old, new, style, words)


CASES = [
    # ------------------------------------------------------------------------------------------- fix mpm/rve, keywords
    rve("rve_unknown_keyword", "skin 0.2", "skinn 0.2", "'skinn'", "allowed are", "skin"),
    rve("rve_twice", "skin 0.2", "skin 0.2 skin 0.3", "'skin'", "twice"),
    rve("rve_no_packing", "packing good.data ", "", "'packing'", "missing", "packing FILE"),
    rve("rve_no_model", "model hooke/stiffness ", "", "'model'", "missing", "hooke/stiffness"),
    rve("rve_wrong_model", "model hooke/stiffness", "model hertz", "'model'", "'hertz'", "hooke/stiffness"),
    rve("rve_no_tangential", "tangential history ", "", "'tangential'", "missing", "history|off"),
    rve("rve_wrong_tangential", "tangential history", "tangential no_history", "'no_history'", "off or history"),
    rve("rve_no_density", "density 2650 ", "", "'density'", "missing"),
    rve("rve_zero_density", "density 2650", "density 0", "'density'", "'0'", "> 0"),
    rve("rve_no_grain", "grain disk ", "", "'grain'", "missing", "disk|sphere"),
    rve("rve_wrong_grain", "grain disk", "grain cube", "'grain'", "'cube'", "disk or sphere"),
    rve("rve_no_thickness", "thickness 0.075 ", "", "'thickness'", "missing"),
    rve("rve_negative_thickness", "thickness 0.075", "thickness -1", "'thickness'", "'-1'", "> 0"),
    rve("rve_unknown_damping", "damping viscous 0.2", "damping strong 0.2", "'damping'", "'strong'", "local"),
    rve("rve_local_damping_one", "damping viscous 0.2", "damping local 1", "'damping'", "'1'", ">= 0 and < 1"),
    rve("rve_damping_without_value", "damping viscous 0.2 pipe_resistance 16", "pipe_resistance 16 damping viscous",
        "'damping'", "allowed is", ">= 0"),
    rve("rve_rest_zero", "pipe_resistance 16", "pipe_resistance 16 rest 0", "'rest'", "'0'", "> 0"),
    rve("rve_rest_large", "pipe_resistance 16", "pipe_resistance 16 rest 0.2", "'rest'", "'0.2'", "< 0.1"),
    rve("rve_rest_word", "pipe_resistance 16", "pipe_resistance 16 rest yes", "'rest'", "'yes'"),
    rve("rve_pipe_zero", "pipe_resistance 16", "pipe_resistance 0", "'pipe_resistance'", "'0'", "> 0"),
    rve("rve_no_pipe", "pipe_resistance 16 ", "", "'pipe_resistance'", "missing", "thermal yes"),
    rve("rve_conductivity_word", "pipe_resistance 16", "pipe_resistance 16 conductivity exact", "'conductivity'", "'exact'",
        "affine or network"),
    rve("rve_conductivity_change", "pipe_resistance 16", "pipe_resistance 16 conductivity network change 0.5",
        "'conductivity'", "'0.5'", "<= 0.1"),
    rve("rve_conductivity_affine_change", "pipe_resistance 16", "pipe_resistance 16 conductivity affine change 0.01",
        "'conductivity'", "'change'", "every N"),
    rve("rve_conductivity_every", "pipe_resistance 16", "pipe_resistance 16 conductivity network every 0",
        "'conductivity'", "'0'", "whole number"),
    rve("rve_model_and_pipes", "pipe_resistance 16", "pipe_resistance 16 direct batchelor", "'pipe_resistance'", "'direct'",
        "together"),
    rve("rve_model_collisional", "pipe_resistance 16", "direct collisional", "'direct'", "'collisional'",
        "none, batchelor, liggghts or pipe"),
    rve("rve_model_without_fluid", "pipe_resistance 16", "indirect layer", "'fluid'", "missing"),
    rve("rve_model_unused_keyword", "pipe_resistance 16", "direct pipe porosity 0.4", "'porosity'", "voronoi_a"),
    rve("rve_model_without_conductivity", "pipe_resistance 16", "direct batchelor", "thermalConductivity"),
    rve("rve_no_reference", "reference 20 ", "", "'reference'", "missing", "thermal yes"),
    rve("rve_reference_nan", "reference 20", "reference nan", "'reference'", "'nan'", "finite"),
    rve("rve_reference_word", "reference 20", "reference room", "'reference'", "'room'", "finite"),
    rve("rve_bonds_incomplete", "bonds strength 0.1 shear_ratio 0.5 melting 60", "bonds 0.1", "'bonds'", "strength"),
    rve("rve_bonds_negative", "bonds strength 0.1", "bonds strength -0.1", "'bonds'", "'-0.1'", "> 0"),
    rve("rve_bonds_melting", "melting 60", "melting soon", "'bonds'", "'soon'"),
    rve("rve_bonds_below_reference", "melting 60", "melting 10", "10", "20"),
    rve("rve_melting_without_thermal", "thermal yes &\n  temperature 20", "thermal no &\n ", "'bonds'", "thermal yes"),
    rve("rve_substeps_negative", "substeps 2", "substeps -1", "'substeps'", "'-1'", "whole number"),
    rve("rve_substeps_fraction", "substeps 2", "substeps 2.5", "'substeps'", "'2.5'", "whole number"),
    rve("rve_substeps_huge", "substeps 2", "substeps 99999999999", "'substeps'", "whole number"),
    rve("rve_skin_negative", "skin 0.2", "skin -0.2", "'skin'", "'-0.2'", "> 0"),
    rve("rve_dem_step_zero", "skin 0.2", "timestep/dem 0", "'timestep/dem'", "'0'", "> 0"),
    rve("rve_dem_step_huge", "skin 0.2", "timestep/dem 10", "'timestep/dem'", "'10'", "> 0 and <=", "critical"),
    rve("rve_backend", "backend cpu", "backend opencl", "'backend'", "'opencl'", "auto, cpu or cuda"),
    rve("rve_threads", "threads 1", "threads -3", "'threads'", "'-3'", "whole number"),
    rve("rve_rotation", "skin 0.2", "rotation maybe", "'rotation'", "'maybe'", "no or yes"),
    rve("rve_modify_bonds", "thermo_style", "fix_modify rve bonds glue\nthermo_style", "'bonds'", "'glue'",
           "install"),
    rve("rve_modify_unknown", "thermo_style", "fix_modify rve glue yes\nthermo_style", "'glue'", "allowed are"),
    rve("rve_modify_no_bonds",
        "bonds strength 0.1 shear_ratio 0.5 melting 60 substeps 2 skin 0.2 backend cpu threads 1",
           "substeps 2\nfix_modify rve bonds install", "'bonds'", "without bonds"),
    # ------------------------------------------------------------------------------------------------------- packings
    packing("packing_missing", "nowhere.data", "nowhere.data"),
    packing("packing_directory", ".", "file ."),
    packing("packing_empty", "empty.data", "empty.data"),
    packing("packing_prose", "prose.data", "prose.data"),
    packing("packing_cut", "cut.data", "cut.data"),
    packing("packing_too_many", "toomany.data", "toomany.data"),
    packing("packing_huge_count", "hugecount.data", "hugecount.data"),
    packing("packing_nan", "nan.data", "nan.data"),
    packing("packing_negative_radius", "negative.data", "negative.data"),
    packing("packing_zero_radius", "zero_radius.data", "zero_radius.data"),
    packing("packing_overlap", "overlap.data", "overlap.data", "overlap"),
    packing("packing_flat_cell", "flat.data", "flat.data"),
    packing("packing_with_walls", "walls.dump", "walls.dump"),
    packing("packing_without_radius", "noradius.dump", "noradius.dump", "radius"),
    packing("packing_second_missing", "good.data nowhere.data", "nowhere.data"),
    # ----------------------------------------------------------------------------------------------------- properties
    prop("kn_missing", "fix kn   all property/global kn peratomtypepair 1 1e6\n", "", "mpm/rve", "'kn'", "missing",
         "property/global kn peratomtypepair"),
    prop("kn_negative", "kn peratomtypepair 1 1e6", "kn peratomtypepair 1 -1e6", "mpm/rve", "'kn'", "-1e+06", "> 0"),
    prop("kn_scalar", "kn peratomtypepair 1 1e6", "kn scalar 1e6", "mpm/rve", "'kn'", "peratomtypepair"),
    prop("kt_negative", "kt peratomtypepair 1 1e6", "kt peratomtypepair 1 -1", "mpm/rve", "'kt'", "-1", ">= 0"),
    prop("kt_missing", "fix kt   all property/global kt peratomtypepair 1 1e6\n", "", "mpm/rve", "'kt'", "missing"),
    prop("friction_missing", "fix mu   all property/global coefficientFriction peratomtypepair 1 0.5\n", "",
           "mpm/rve",
         "'coefficientFriction'", "missing"),
    prop("friction_negative", "coefficientFriction peratomtypepair 1 0.5",
           "coefficientFriction peratomtypepair 1 -0.5",
         "mpm/rve", "'coefficientFriction'", "-0.5", ">= 0"),
    prop("expansion_missing", "fix beta all property/global thermalExpansionCoefficient peratomtype 1e-5\n", "",
         "mpm/rve", "'thermalExpansionCoefficient'", "missing"),
    prop("capacity_missing", "fix c    all property/global thermalCapacity peratomtype 670\n", "", "mpm/couple",
         "'thermalCapacity'", "missing", "property/global thermalCapacity peratomtype"),
    prop("capacity_zero", "thermalCapacity peratomtype 670", "thermalCapacity peratomtype 0", "mpm/couple",
         "'thermalCapacity'", "0", "> 0"),
    # ------------------------------------------------------------------------------------------------- fix mpm/couple
    couple("couple_unknown_keyword", "order usf", "ordre usf", "'ordre'", "allowed are", "order"),
    couple("couple_twice", "order usf", "order usf order usl", "'order'", "twice"),
    couple("couple_follow_nobody", "order usf", "follow nobody order usf", "'follow'", "'nobody'", "plane fix mpm/wall"),
    couple("couple_follow_box", "order usf", "follow block order usf", "'follow'", "'block'", "plane fix mpm/wall"),
    couple("couple_follow_between_nodes", "order usf", "follow floor order usf", "'follow'", "'floor'", "whole number"),
    couple("couple_no_grid", "grid 0.2 shape", "shape", "'grid'", "missing"),
    couple("couple_grid_negative", "grid 0.2", "grid -0.2", "'grid'", "'-0.2'", "> 0"),
    couple("couple_grid_nan", "grid 0.2", "grid nan", "'grid'", "'nan'", "> 0"),
    couple("couple_grid_word", "grid 0.2", "grid 0.2m", "'grid'", "'0.2m'", "> 0"),
    couple("couple_grid_infinite", "grid 0.2", "grid 1e999", "'grid'", "'1e999'", "> 0"),
    couple("couple_no_shape", "shape gimp ", "", "'shape'", "missing"),
    couple("couple_shape", "shape gimp", "shape cubic", "'shape'", "'cubic'", "linear, gimp or bspline"),
    couple("couple_no_transfer", "transfer flip 0.99 ", "", "'transfer'", "missing"),
    couple("couple_transfer", "transfer flip 0.99", "transfer flap 0.99", "'transfer'", "'flap'",
           "flip, pic, apic or xpic"),
    couple("couple_flip_large", "transfer flip 0.99", "transfer flip 1.5", "'transfer'", "'1.5'", ">= 0 and <= 1"),
    couple("couple_flip_missing", "transfer flip 0.99", "transfer flip", "'transfer'", ">= 0 and <= 1"),
    couple("couple_xpic_order", "transfer flip 0.99", "transfer xpic 0", "'transfer'", "'0'", "from 1 to 10"),
    couple("couple_order", "order usf", "order usx", "'order'", "'usx'", "usf, usl or musl"),
    couple("couple_volumetric", "order usf", "volumetric mean", "'volumetric'", "'mean'", "point or cell"),
    couple("couple_volumetric_missing", "order usf", "volumetric", "'volumetric'", "point or cell"),
    couple("couple_volumetric_bar", "order usf material rve rve", "material elastic bar volumetric cell", "'volumetric'", "'cell'", "bar"),
    couple("couple_no_material", "material rve rve ", "", "'material'", "missing"),
    couple("couple_material", "material rve rve", "material steel", "'material'", "'steel'", "rve or elastic"),
    couple("couple_material_id", "material rve rve", "material rve nobody", "'material'", "'nobody'", "mpm/rve"),
    couple("couple_material_wrong_fix", "material rve rve", "material rve kn", "'material'", "'kn'", "mpm/rve"),
    couple("couple_elastic_mode", "material rve rve", "material elastic 3d", "'material'", "3d", "in 2D"),
    couple("couple_elastic_no_young", "material rve rve", "material elastic plane_strain", "'youngsModulus'",
           "missing"),
    couple("couple_thermal", "thermal yes", "thermal perhaps", "'thermal'", "'perhaps'", "no or yes"),
    couple("couple_no_temperature", "temperature 20 damping", "damping", "'temperature'", "missing"),
    couple("couple_temperature_word", "temperature 20", "temperature warm", "'temperature'", "'warm'", "finite"),
    couple("couple_damping_negative", "damping/point 0.1", "damping/point -1", "'damping/point'", "'-1'", ">= 0"),
    couple("couple_grid_damping_negative", "damping/grid 0.1", "damping/grid -1", "'damping/grid'", "'-1'", ">= 0"),
    couple("couple_size_zero", "point/size 0.1 0.1", "point/size 0.1 0", "'point/size'", "'0'", "> 0"),
    couple("couple_size_short", "point/size 0.1 0.1", "point/size 0.1", "'point/size'", "missing", "> 0"),
    couple("couple_nothing_to_do", "thermal yes &\n  temperature 20", "mechanics no &\n ", "'mechanics'",
           "thermal yes"),
    couple("couple_thermal_every", "order usf", "thermal/every 0", "'thermal/every'", "'0'", "auto E, or a whole number from 1"),
    couple("couple_thermal_every_auto", "order usf", "thermal/every auto 0.5", "'thermal/every'", "'0.5'", "> 0 and < 0.1"),
    couple("couple_thermal_every_still", "order usf", "thermal/every 5 mechanics no", "'thermal/every'", "mechanics yes"),
    couple("couple_thermal_every_long", ("order usf", "pipe_resistance 16"), ("thermal/every 1000000", "pipe_resistance 1e-3"),
           "1000000 times ('thermal/every') timestep 0.0001 s", "critical thermal time step", "timestep/check"),
    rve("rve_flight", "skin 0.2", "flight perhaps", "'flight'", "'perhaps'", "no or yes"),
    couple("couple_threads", "order usf", "threads 0", "'threads'", "'0'", "from 1 to"),
    couple("couple_time_step", "timestep        1e-4", "timestep        1", "timestep 1 s", "critical",
           "timestep/check"),
    couple("couple_grid_coarser_than_body", "grid 0.2 shape", "grid 1 shape", "'grid'", "1 m", "0.4 m", "coarser"),
    couple("couple_point_outside", "create_atoms    1 region column\n",
           "create_atoms    1 region column\nset atom 3 x 50\n", "outside of the box", "(50,", "(3, 3,"),
    couple("couple_no_points", "create_atoms    1 region column\n", "", "all", "no particles"),
    couple("couple_other_integrator", "thermo_style", "fix move all nve/sphere\nthermo_style", "fix move",
           "nve/sphere"),
    couple("couple_period", ("boundary        f f p", "block -1 3 -1 3"),
           ("boundary        p f p", "block -1 3.1 -1 3"), "period", "20.5", "whole multiple"),
    couple("couple_triclinic", "region          box block -1 3 -1 3 -0.025 0.025 units box",
           "region          box prism -1 3 -1 3 -0.025 0.025 0.1 0 0 units box", "triclinic"),
    couple("couple_minimize", "run             2", "minimize 0 0 10 10", "minimize"),
    couple("couple_not_granular", "atom_style      granular", "atom_style      atomic", "granular"),
    couple("couple_leaves_box", "gravity 9.8 vector 0 -1 0", "gravity 1e9 vector 0 1 0", "left the box",
           "leaving delete"),
    couple("couple_force_not_finite", "thermo_style", "variable bad equal exp(1000)-exp(1000)\n"
           "fix push all addforce v_bad 0 0\nthermo_style", "finite", "point 1"),
    couple("couple_modify", "thermo_style", "fix_modify mpm damping/point -2\nthermo_style", "'damping/point'",
           "'-2'", ">= 0"),
    # --------------------------------------------------------------------------------------------------- fix mpm/wall
    wall("wall_no_id", "fix hot   all mpm/wall mpm plane x -0.1 temperature 50", "fix hot   all mpm/wall",
           "id", "missing"),
    wall("wall_unknown_id", "fix hot   all mpm/wall mpm", "fix hot   all mpm/wall nobody", "nobody", "mpm/couple"),
    wall("wall_unknown_keyword", "friction 0.5", "frictoin 0.5", "'frictoin'", "allowed are", "friction"),
    wall("wall_no_shape", "plane y -0.1 friction 0.5", "friction 0.5", "'plane'", "missing", "box"),
    wall("wall_axis", "plane y -0.1", "plane w -0.1", "'plane'", "'w'", "x, y or z"),
    wall("wall_axis_z", "plane y -0.1", "plane z -0.1", "'plane'", "'z'", "in 2D"),
    wall("wall_position", "plane y -0.1", "plane y low", "'plane'", "'low'", "finite"),
    wall("wall_friction_negative", "friction 0.5", "friction -0.5", "'friction'", "'-0.5'", ">= 0"),
    wall("wall_friction_nan", "friction 0.5", "friction nan", "'friction'", "'nan'", ">= 0"),
    wall("wall_two_contacts", "friction 0.5", "friction 0.5 noslip", "'friction'", "'noslip'", "together"),
    wall("wall_two_heats", "temperature 50", "temperature 50 flux 3", "'temperature'", "'flux'", "together"),
    wall("wall_temperature", "temperature 50", "temperature hot", "'temperature'", "'hot'", "finite"),
    wall("wall_box_inverted", "box 1 1.5 0 0.5", "box 1.5 1 0 0.5", "'box'", "x0 < x1"),
    wall("wall_box_short", "box 1 1.5 0 0.5", "box 1 1.5 0", "'box'"),
    wall("wall_velocity_short", "velocity 0 0 0", "velocity 0 0", "'velocity'", "missing", "finite"),
    wall("wall_velocity_z", "velocity 0 0 0", "velocity 0 0 1", "'velocity'", "vz", "2D"),
    wall("wall_side", "plane y -0.1 friction 0.5", "plane y -0.1 friction 0.5 side up", "'side'", "'up'", "- or +"),
    wall("wall_segment_no_length", "plane y -0.1 friction", "segment 1 -0.1 1 -0.1 friction", "'segment'", "1 -0.1 1 -0.1",
         "differ"),
    wall("wall_segment_second_no_length", "plane y -0.1 friction", "segment 0 -0.1 1 -0.1 1 -0.1 friction", "'segment'",
         "differ"),
    wall("wall_segment_short", "plane y -0.1 friction", "segment 0 -0.1 1 friction", "'segment'", "'friction'", "finite"),
    wall("wall_segment_odd", "plane y -0.1 friction", "segment 0 -0.1 1 -0.1 2 friction", "'segment'", "'friction'"),
    wall("wall_segment_and_plane", "plane y -0.1 friction", "plane y -0.1 segment 0 -0.1 1 -0.1 friction", "'plane'",
         "'segment'", "together"),
    wall("wall_mesh_2d", "plane y -0.1 friction", "mesh floor friction", "'mesh'", "3D", "'segment'"),
    wall("wall_inside_body", "plane y -0.1 friction 0.5", "plane y 0.21 friction 0.5", "'side'", "both sides"),
    wall("wall_heat_without_thermal", ("thermal yes &\n  temperature 20", "melting 60"),
         ("thermal no &\n ", "melting none"), "'temperature'", "thermal yes"),
    wall("wall_flux_without_thermal", ("thermal yes &\n  temperature 20", "melting 60", "temperature 50"),
         ("thermal no &\n ", "melting none", "flux 50"), "'flux'", "thermal yes"),
    # ------------------------------------------------------------------------------------ fix mpm/traction, fix mpm/vtk
    Case("traction_unknown_id", "mpm/traction mpm", "mpm/traction nobody", "mpm/traction", ("nobody", "mpm/couple")),
    traction("traction_no_axis", "side + pressure 100", "'axis'", "missing"),
    traction("traction_axis", "axis z side + pressure 100", "'axis'", "'z'", "in 2D"),
    traction("traction_side", "axis y side top pressure 100", "'side'", "'top'", "- or +"),
    traction("traction_no_value", "axis y side +", "'pressure'", "missing", "traction"),
    traction("traction_two_values", "axis y side + pressure 1 traction 0 1 0", "'pressure'", "'traction'",
           "together"),
    traction("traction_surface_and_axis", "axis y side + surface pressure 100", "'surface'", "'axis'", "together"),
    traction("traction_surface_alone", "surface", "'pressure'", "missing"),
    traction("traction_nan", "axis y side + pressure nan", "'pressure'", "'nan'", "finite"),
    vtk("vtk_every_zero", "every 0 prefix see rves 1", "'every'", "'0'", "from 1"),
    vtk("vtk_no_prefix", "every 2 rves 1", "'prefix'", "missing"),
    vtk("vtk_nothing", "every 2 prefix see", "rves", "grid yes"),
    vtk("vtk_no_such_point", "every 2 prefix see rves 999", "999"),
    vtk("vtk_negative_point", "every 2 prefix see rves -1", "'rves'", "'-1'", "from 1"),
    vtk("vtk_no_such_directory", "every 2 prefix nowhere/see rves 1 grid yes", "nowhere/see"),
    Case("vtk_unknown_id", "mpm/vtk mpm", "mpm/vtk nobody", "mpm/vtk", ("nobody", "mpm/couple")),
]
