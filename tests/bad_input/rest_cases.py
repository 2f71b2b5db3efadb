# SPDX-License-Identifier: GPL-2.0-or-later
"""Wrong scripts for fix heat/rest; see cases.py."""
from cases import Case
from heat_cases import HEAT_BASE, HeatCase

HEAT = HEAT_BASE[HEAT_BASE.index("fix heat all"):HEAT_BASE.index("run ")]
SOURCE = "set atom 1 property/atom heatSource 1.0\n"


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
    rest("radiation_between", "", "'radiation ... neighbours'", "once and for all", old="reach 0.5\n",
         new="reach 0.5 radiation 0.8 300 neighbours\n"),
    Case("rest_material_points", "run             2", "fix rest all heat/rest\nrun             2", "heat/rest",
         ("fix mpm/couple (id mpm)", "material points", "unfix")),
]
