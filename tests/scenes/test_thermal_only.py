# SPDX-License-Identifier: GPL-2.0-or-later
"""`mechanics no`: heat flows through packings that are never run."""
import math

import numpy as np
from scripts import BOX, GRAIN_HEAT, GRAINS
from test_rve_scene import GRAIN_RADIUS, OVERLAP, packing

SCRIPT = BOX.format(boundary="f f") + """
lattice sq 0.05 origin 0.5 0.5 0
region bar block 0.5 1.5 0.5 0.55 -0.025 0.025 units box
create_atoms 1 region bar
neighbor 0.05 bin
timestep {dt}
""" + GRAINS + GRAIN_HEAT + """
fix rve all mpm/rve packing grains.data model hooke/stiffness tangential history grain disk thickness 0.075 &
  density 2650 pipe_resistance 1e3 reference 0
fix mpm all mpm/couple grid 0.05 shape gimp transfer flip 1 material rve rve thermal yes temperature 0 mechanics no
fix hot all mpm/wall mpm plane x 0.5 nocontact temperature 100 side +
fix cold all mpm/wall mpm plane x 1.5 nocontact temperature 0 side -
dump field all custom 1000 field.dump id x f_mpm[13]
thermo 1000
thermo_style custom step f_mpm[8] f_mpm[10] f_mpm[12] f_hot[7] f_mpm[5]
thermo_modify format float %.12g
run {steps}
"""


def test_heat_crosses_packings_that_are_not_run(dempm):
    """Against the series of a slab, at a time step 10^5 times that of mechanics. k of the hexagonal
    crystal: sqrt(3) / (alpha l z_p)."""
    length = 2 * GRAIN_RADIUS * (1 - OVERLAP)
    diffusivity = math.sqrt(3) / (1e3 * length * 0.075) / (2650 * math.pi / (2 * math.sqrt(3)) / (1 - 1e-3) ** 2 * 670)
    dt, steps = 20.0, 1000
    run = dempm(SCRIPT.format(dt=dt, steps=steps), files={"grains.data": packing(shrink=0.0)}, timeout=60)
    assert set(run.table["mpm[10]"]) == {0.0} and set(run.table["mpm[12]"]) == {0.0} and set(run.table["mpm[5]"]) == {0.0}
    columns = run.dump("field.dump")[-1][1]
    x = np.array(columns["x"]) - 0.5
    n = np.arange(1, 200)[:, None]
    time = dt * steps
    series = 100 * (1 - x) - 200 / math.pi * np.sum(np.sin(n * math.pi * x) / n * np.exp(-((n * math.pi) ** 2) * diffusivity * time), axis=0)
    assert np.max(np.abs(np.array(columns["f_mpm[13]"]) - series)) < 1.0  # 1 % of the step: 20 cells
    assert run.table["hot[7]"][-1] > 0
