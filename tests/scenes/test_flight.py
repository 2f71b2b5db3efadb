# SPDX-License-Identifier: GPL-2.0-or-later
"""Packings that are torn apart fly in closed form: the same answers, counted in the closing line."""
import pytest
from test_rve_scene import first, packing


def test_packings_of_a_body_that_bursts_fly(dempm, tmp_path):
    """48 points that move apart by 100 % per second and more; the first crystal contacts open within some steps."""
    script = first(False, "run 300\n").replace("fix_modify rve bonds install\n", "velocity all ramp vx -8 8 x 0.8 1.2 units box\n")
    script = script.replace("damping viscous 0.2", "damping viscous 0.2 flight {flight}")
    runs = {flight: dempm(script.replace("{flight}", flight),
                          files={"grains.data": packing()}, cwd=tmp_path / flight) for flight in ("yes", "no")}
    counts = {}
    for flight, run in runs.items():
        line = [line for line in run.output.splitlines() if "in free flight" in line][-1]
        counts[flight] = int(line.split(" in free flight")[0].split()[-1])
    assert counts["no"] == 0 and counts["yes"] > 5000  # of 48 x 300
    for name in ("mpm[5]", "mpm[7]", "mpm[11]", "mpm[13]"):
        assert runs["yes"].table[name][-1] == pytest.approx(runs["no"].table[name][-1], rel=1e-6, abs=1e-12), name
