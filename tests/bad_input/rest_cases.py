# SPDX-License-Identifier: GPL-2.0-or-later
"""Wrong scripts for fix heat/rest; see cases.py."""
from cases import Case
from heat_cases import HEAT_BASE, HeatCase

HEAT = HEAT_BASE[HEAT_BASE.index("fix heat all"):HEAT_BASE.index("run ")]
HEAT_WORDS = HEAT[HEAT.index("pipe"):]
SOURCE = "set atom 1 property/atom heatSource 1.0\n"
# A wall at 400 K that conducts nothing below 500 K, then so well that the grain could not have 500 K.
JUMP = """fix kt all property/global thermalConductivityTable matrix 2 500 0.001 500.0000001 1000
fix floor all wall/gran model hertz tangential history primitive type 1 zplane 0.0051 temperature 400
run 0
set group all property/atom heatSource 1.0
"""


def rest(name, words, *message, old="", new=""):
    """A line `fix rest` before the run of a script that runs; and another piece of text replaced."""
    lines = words if words.startswith("fix") or "\nfix" in words else f"fix rest all heat/rest {words}"
    if old == "":
        return HeatCase("rest_" + name, "run             2", f"{lines}\nrun             2", "heat/rest", message)
    return HeatCase("rest_" + name, ("run             2", old), (f"{lines}\nrun             2", new), "heat/rest", message)


REST_CASES = [
    rest("unknown_keyword", "sover steady", "'sover'", "allowed are", "solver"),
    rest("wrong_solver", "solver newton", "'solver'", "'newton'", "explicit, implicit or steady"),
    rest("tolerance_zero", "solver implicit tolerance 0", "'tolerance'", "'0'", "> 0 and < 1"),
    rest("tolerance_nan", "solver steady tolerance nan", "'tolerance'", "'nan'", "> 0 and < 1"),
    rest("tolerance_of_explicit", "tolerance 1e-8", "'tolerance'", "'solver implicit'"),
    rest("twice", "solver steady solver steady", "'solver'", "twice"),
    rest("group", "group one id 1\nfix rest one heat/rest", "group is one", "allowed is all"),
    rest("no_heat", "", "no fix heat/gran/grain", old=HEAT, new=""),
    rest("stock_heat", "", "no fix heat/gran/grain", old=HEAT,
         new="fix heat all heat/gran/conduction initial_temperature 300\n"),
    rest("two", "fix first all heat/rest\nfix rest all heat/rest", "another fix heat/rest"),
    rest("time_step", "timestep 100\nfix rest all heat/rest", "time step", "100", "<= ", "'solver implicit'"),
    rest("not_integrated", "fix_modify ste_heattransfer integrate stop\nfix rest all heat/rest", "ste_heattransfer",
         "integrate start"),
    rest("respa", "run_style respa 2 2 pair 2\nfix rest all heat/rest", "respa", "verlet"),
    rest("no_steady_state", f"run 0\n{SOURCE}fix rest all heat/rest solver steady", "no balance", "source", "allowed is"),
    rest("jump", JUMP + "fix rest all heat/rest solver steady", "tables", "do not agree after", "allowed is", "smoother tables",
         old=HEAT_WORDS, new="pipe conductivity table\n"),
    Case("rest_material_points", "run             2", "fix rest all heat/rest\nrun             2", "heat/rest",
         ("fix mpm/couple (id mpm)", "material points", "unfix")),
]
