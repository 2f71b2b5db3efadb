# SPDX-License-Identifier: GPL-2.0-or-later
"""Wrong scripts for fix expansion/gran and fix bond/gran/thermal; see cases.py."""
from cases import TWO_GRAINS, Case

BOND_BASE = TWO_GRAINS + """\
fix kn all property/global kn peratomtypepair 1 1e5
fix kt all property/global kt peratomtypepair 1 8e4
fix gn all property/global gamman peratomtypepair 1 100
fix gt all property/global gammat peratomtypepair 1 50
fix mu all property/global coefficientFriction peratomtypepair 1 0.5
fix be all property/global thermalExpansionCoefficient peratomtype 1e-4
pair_style      gran model hooke/stiffness tangential history
pair_coeff      * *
timestep        1e-6
fix temp all property/atom Temp scalar yes yes no 320
fix grow all expansion/gran reference 300 growth 0.01
fix bond all bond/gran/thermal strength 0.1 shear_ratio 0.5 melting 400 reference 300 gap 1e-5
fix_modify bond bonds install
fix move all nve/sphere
run             2
"""
TEMPERATURE = "fix temp all property/atom Temp scalar yes yes no 320\n"
MODEL = "hooke/stiffness tangential history"


class BondCase(Case):
    BASE = BOND_BASE


def grow(name, old, new, *words):
    return BondCase("grow_" + name, old, new, "expansion/gran", words)


def bond(name, old, new, *words):
    return BondCase("bond_" + name, old, new, "bond/gran/thermal", words)


BOND_CASES = [
    grow("unknown_keyword", "growth 0.01", "skin 0.01", "'skin'", "allowed are", "growth"),
    grow("no_reference", "reference 300 growth", "growth", "'reference'", "missing"),
    grow("reference_nan", "reference 300 growth", "reference nan growth", "'reference'", "'nan'", "finite"),
    grow("growth_zero", "growth 0.01", "growth 0", "'growth'", "'0'", "> 0 and < 1"),
    grow("no_temperature", (TEMPERATURE, "melting 400"), ("", "melting none"), "no temperature", "property/atom Temp"),
    grow("no_coefficient", "fix be all property/global thermalExpansionCoefficient peratomtype 1e-4\n", "",
         "'thermalExpansionCoefficient'", "missing", "property/global"),
    grow("negative_coefficient", "peratomtype 1e-4", "peratomtype -1e-4", "'thermalExpansionCoefficient'", "-0.0001", ">= 0"),
    grow("outgrown", "no 320", "no 420", "grain", "temperature 420", "'growth'"),
    grow("below_nothing", "no 320", "no -9800", "grain", "temperature -9800", "> 0"),
    grow("twice", "fix move", "fix too all expansion/gran reference 300\nfix move", "sets radii too"),
    bond("unknown_keyword", "gap 1e-5", "distance 1e-5", "'distance'", "allowed are", "shear_ratio"),
    bond("no_strength", "strength 0.1 ", "", "'strength'", "missing"),
    bond("strength_zero", "strength 0.1", "strength 0", "'strength'", "'0'", "> 0"),
    bond("no_melting", "melting 400 reference 300 ", "", "'melting'", "missing", "none"),
    bond("melting_word", "melting 400", "melting never", "'melting'", "'never'"),
    bond("no_reference", "melting 400 reference 300", "melting 400", "'reference'", "missing"),
    bond("melts_below_reference", "melting 400", "melting 300", "'melting'", "300", "> 300"),
    bond("gap_negative", "gap 1e-5", "gap -1e-5", "'gap'", "'-1e-5'", ">= 0"),
    bond("gap_beyond_skin", "gap 1e-5", "gap 0.003", "'gap'", "0.003", "neighbor"),
    bond("install_what", "bonds install", "bonds remove", "'bonds'", "'remove'", "install"),
    bond("no_temperature", (TEMPERATURE, "fix grow all expansion/gran reference 300 growth 0.01\n"), ("", ""), "melt",
         "no temperature", "melting none"),
    bond("temperature_of_one_rank", "yes yes no 320", "yes no no 320", "melt", "other ranks"),
    bond("no_stiffness", ("fix kt all property/global kt peratomtypepair 1 8e4\n", MODEL),
         ("fix y all property/global youngsModulus peratomtype 5e6\nfix p all property/global poissonsRatio peratomtype 0.3\n"
          "fix e all property/global coefficientRestitution peratomtypepair 1 0.5\n", "hertz tangential history"),
         "'kt'", "missing", "property/global"),
    bond("rolling", ("fix be", MODEL), ("fix rf all property/global coefficientRollingFriction peratomtypepair 1 0.1\nfix be",
                                        MODEL + " rolling_friction epsd2"), "'tangential history'", "rolling_friction"),
    bond("other_tangential", MODEL, "hooke/stiffness tangential no_history", "'tangential history'", "off"),
    bond("twice", "fix move", "fix too all bond/gran/thermal strength 1 shear_ratio 1 melting none\nfix move", "another one"),
    bond("two_places", ("boundary        f f f", "block 0 0.04", "gap 1e-5"),
         ("boundary        p f f", "block 0.005 0.0245", "gap 1e-3"), "two places", "periodic"),
]
