# SPDX-License-Identifier: GPL-2.0-or-later
"""Wrong scripts for fix heat/gran/grain; see cases.py."""
from cases import TWO_GRAINS, Case

HEAT_BASE = TWO_GRAINS + """\
fix m1 all property/global youngsModulus peratomtype 5e6
fix m2 all property/global poissonsRatio peratomtype 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.5
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
fix k  all property/global thermalConductivity peratomtype 20
fix c  all property/global thermalCapacity peratomtype 100
pair_style      gran model hertz tangential history
pair_coeff      * *
timestep        1e-5
fix heat all heat/gran/grain initial_temperature 300 direct pipe area hertz &
  indirect voronoi_b fluid 0.026 porosity 0.4 core 0.5 reach 0.5
run             2
"""
LAYER = "indirect layer fluid 0.026 layer 0.4 minimum_gap 1e-6"
WALL = "fix floor all wall/gran model hertz tangential history primitive type 1 zplane 0.005 temperature 400\nrun 2"
VORONOI = "indirect voronoi_b fluid 0.026 porosity 0.4 core 0.5 reach 0.5"
STIFFNESS = """
fix s1 all property/global kn peratomtypepair 1 1000
fix s2 all property/global kt peratomtypepair 1 500
fix s3 all property/global gamman peratomtypepair 1 1
fix s4 all property/global gammat peratomtypepair 1 1
fix s5 all property/global coefficientRollingFriction peratomtypepair 1 0.1
pair_style      gran model hooke/stiffness tangential history"""
SPRINGS = (("reach 0.5", "fix m4", "pair_style      gran model hertz tangential history"),
           ("reach 0.5 friction yes", "fix m4", STIFFNESS))


class HeatCase(Case):
    BASE = HEAT_BASE


def heat(name, old, new, *words):
    return HeatCase("heat_" + name, old, new, "heat/gran/grain", words)


HEAT_CASES = [
    heat("unknown_keyword", "core 0.5", "kernel 0.5", "'kernel'", "allowed are", "core"),
    heat("twice", "core 0.5", "core 0.5 core 0.4", "'core'", "twice"),
    heat("no_temperature", "initial_temperature 300 ", "", "'initial_temperature'", "missing"),
    heat("temperature_nan", "temperature 300", "temperature nan", "'initial_temperature'", "'nan'", "finite"),
    heat("no_direct", "direct pipe area hertz ", "", "'direct'", "missing", "batchelor"),
    heat("wrong_direct", "direct pipe", "direct conductive", "'direct'", "'conductive'",
         "batchelor, liggghts, pipe or collisional"),
    heat("wrong_indirect", "indirect voronoi_b", "indirect voronoi", "'indirect'", "'voronoi'", "voronoi_a"),
    heat("wrong_area", "area hertz", "area 0.001", "'area'", "'0.001'", "geometric or hertz"),
    heat("area_without_direct", "direct pipe", "direct none", "'area'", "'direct batchelor'"),
    heat("nothing", ("direct pipe area hertz", VORONOI), ("direct none", ""), "nothing conducts"),
    heat("no_fluid", "fluid 0.026 ", "", "'fluid'", "missing"),
    heat("fluid_zero", "fluid 0.026", "fluid 0", "'fluid'", "'0'", "> 0"),
    heat("fluid_without_indirect", VORONOI, "fluid 0.026", "'fluid'", "'indirect voronoi_a'"),
    heat("porosity_one", "porosity 0.4", "porosity 1", "'porosity'", "'1'", "> 0 and < 1"),
    heat("core_zero", "core 0.5", "core 0", "'core'", "'0'", "> 0 and < 1"),
    heat("core_for_voronoi_a", "voronoi_b", "voronoi_a", "'core'", "'indirect voronoi_b'"),
    heat("minimum_gap_zero", VORONOI, LAYER.replace("1e-6", "0"), "'minimum_gap'", "'0'", "> 0"),
    heat("layer_for_voronoi", "core 0.5", "layer 0.5", "'layer'", "'indirect layer'"),
    heat("skin", "neighbor        0.003", "neighbor        0.0025", "skin", "0.0025", "neighbor"),
    heat("skin_layer", ("neighbor        0.003", VORONOI), ("neighbor        0.002", LAYER), "skin", "0.002",
         "> 0.002"),
    heat("no_conductivity", "fix k  all property/global thermalConductivity peratomtype 20\n", "",
         "'thermalConductivity'", "missing", "property/global"),
    heat("negative_conductivity", "thermalConductivity peratomtype 20", "thermalConductivity peratomtype -20",
         "'thermalConductivity'", "-20", ">= 0"),
    heat("no_capacity", "fix c  all property/global thermalCapacity peratomtype 100\n", "", "'thermalCapacity'",
         "missing"),
    heat("another", "run             2", "fix too all heat/gran/conduction initial_temperature 300\nrun 2",
         "another fix"),
    heat("twice_the_fix", "run             2", "fix too all heat/gran/grain initial_temperature 300 direct pipe\nrun 2",
         "another fix"),
    heat("correction_without_modulus", "reach 0.5", "reach 0.5 area_correction yes", "'youngsModulusOriginal'",
         "missing", "property/global"),
    heat("correction_zero_modulus", ("reach 0.5", "fix m4"),
         ("reach 0.5 area_correction yes", "fix m0 all property/global youngsModulusOriginal peratomtype 0\nfix m4"),
         "'youngsModulusOriginal'", "> 0"),
    heat("correction_of_nothing", ("direct pipe area hertz", VORONOI),
         ("direct none", "convection 1 300 area_correction yes"), "'area_correction'", "direct or an indirect model"),
    heat("friction_with_hooke", ("reach 0.5", "fix m4", "model hertz"),
         ("reach 0.5 friction yes", "fix m5 all property/global characteristicVelocity scalar 1\nfix m4",
          "model hooke"),
         "'friction'", "hooke/stiffness, hertz or hertz/stiffness"),
    heat("friction_other_wall", (*SPRINGS[0], "run             2"),
         (*SPRINGS[1], "fix floor all wall/gran model hertz tangential history primitive type 1 zplane 0.0\nrun 2"),
         "'friction'", "fix floor", "hooke/stiffness"),
    heat("friction_wall_without_history", (*SPRINGS[0], "run             2"),
         (*SPRINGS[1],
          "fix floor all wall/gran model hooke/stiffness tangential no_history primitive type 1 zplane 0.0\nrun 2"),
         "'friction'", "fix floor", "tangential history"),
    heat("damping_without_friction", "reach 0.5", "reach 0.5 damping yes", "'damping'", "'friction yes'"),
    heat("damping_maybe", "reach 0.5", "reach 0.5 friction yes damping 0.5", "'damping'", "'0.5'", "no, yes or normal"),
    heat("neighbours_skin", ("direct pipe area hertz", VORONOI, "neighbor        0.003"),
         ("direct none", "radiation 0.8 300 neighbours reach 0.7", "neighbor        0.0034"), "skin", "0.0034",
         "> 0.0035"),
    heat("radiation_nowhere", "reach 0.5", "reach 0.5 radiation 0.8 none", "'radiation'", "'none'", "neighbours"),
    heat("radiation_far", "reach 0.5", "reach 0.5 radiation 0.8 far", "'radiation'", "'far'", "number"),
    heat("neighbours_without_radiation", "reach 0.5", "reach 0.5 neighbours", "'neighbours'"),
    heat("table_missing", "reach 0.5", "reach 0.5 conductivity table", "'thermalConductivityTable'", "missing",
         "matrix"),
    heat("table_word", "reach 0.5", "reach 0.5 conductivity linear", "'conductivity'", "'linear'", "constant or table"),
    heat("table_kind", ("reach 0.5", "fix m4"),
         ("reach 0.5 conductivity table", "fix kt all property/global thermalConductivityTable peratomtype 1\nfix m4"),
         "'thermalConductivityTable'", "kind matrix"),
    heat("table_columns", ("reach 0.5", "fix m4"),
         ("reach 0.5 conductivity table",
          "fix kt all property/global thermalConductivityTable matrix 3 300 1 2 400 1 2\nfix m4"),
         "'thermalConductivityTable'", "3 columns", "allowed are 2"),
    heat("table_falls", ("reach 0.5", "fix m4"),
         ("reach 0.5 conductivity table",
          "fix kt all property/global thermalConductivityTable matrix 2 400 1 300 2\nfix m4"),
         "'thermalConductivityTable'", "300", "must rise"),
    heat("capacity_zero", ("reach 0.5", "fix m4"),
         ("reach 0.5 capacity table", "fix kt all property/global thermalCapacityTable matrix 2 300 1 400 0\nfix m4"),
         "'thermalCapacityTable'", "row 2", "> 0"),
    heat("friction_with_rolling", SPRINGS[0], (*SPRINGS[1][:2], SPRINGS[1][2] + " rolling_friction epsd2"),
         "'friction'", "rolling_friction"),
    heat("friction_after_run", (*SPRINGS[0][:2], "fix heat", SPRINGS[0][2]),
         (*SPRINGS[1][:2], "run 1\nfix heat", SPRINGS[1][2]), "'friction'", "before it"),
    heat("friction_unfix", (*SPRINGS[0], "run             2"), (*SPRINGS[1], "run 2\nunfix heat\nrun 2"),
         "'friction yes'", "removed"),
    heat("friction_given_up", (*SPRINGS[0], "run             2"),
         (*SPRINGS[1], "run 2\nfix heat all heat/gran/grain initial_temperature 300 direct pipe\nrun 2"),
         "'friction yes'", "first run"),
    heat("friction_maybe", "reach 0.5", "reach 0.5 friction maybe", "'friction'", "'maybe'", "no or yes"),
    heat("collisional_after_run", ("fix heat", "direct pipe"), ("run 1\nfix heat", "direct collisional"),
         "'direct collisional'", "before it"),
    heat("collisional_no_capacity", ("direct pipe", "thermalCapacity peratomtype 100"),
         ("direct collisional", "thermalCapacity peratomtype 0"), "'thermalCapacity'", "> 0"),
    heat("wall_without_model", ("direct pipe area hertz", VORONOI, "run             2"),
         ("direct none", "convection 10 300", WALL), "'direct none'",
         "fix wall/gran", "batchelor"),
    heat("wall_below_zero", "run             2", WALL.replace("temperature 400", "temperature -20"), "fix floor", "-20",
         ">= 0"),
    heat("wall_contact_area", "run             2", WALL.replace("400", "400 contact_area projection"), "fix floor",
         "'contact_area'", "overlap"),
    heat("convection_without_temperature", "reach 0.5", "reach 0.5 convection 10", "'convection'", "number"),
    heat("convection_negative", "reach 0.5", "reach 0.5 convection -1 300", "'convection'", "'-1'", ">= 0"),
    heat("convection_infinite", "reach 0.5", "reach 0.5 convection 10 inf", "'convection'", "'inf'", "finite"),
    heat("emissivity_above_one", "reach 0.5", "reach 0.5 radiation 1.1 300", "'radiation'", "'1.1'", "1"),
    heat("radiation_below_zero", "reach 0.5", "reach 0.5 radiation 0.8 -20", "'radiation'", "-20", ">= 0",
         "'absolute_zero'"),
    heat("grains_below_zero", ("temperature 300", "reach 0.5"),
         ("temperature -300", "reach 0.5 radiation 0.8 20 absolute_zero -273.15"), "'initial_temperature'", "-300",
         ">= -273.15"),
    heat("zero_without_radiation", "reach 0.5", "reach 0.5 absolute_zero 0", "'absolute_zero'", "'radiation'"),
    heat("radiation_other_units", ("units           si", "reach 0.5"),
         ("units           cgs", "reach 0.5 radiation 0.8 300"), "'radiation'", "'units si'", "cgs"),
]
