# SPDX-License-Identifier: GPL-2.0-or-later
"""From a run's files to pictures: dump custom/vtk and fix mpm/vtk are read by examples/plot.py, numbers unchanged."""
import pathlib
import sys

import pytest

from conftest import ROOT

sys.path.insert(0, str(pathlib.Path(__file__).parent / "bad_input"))
sys.path.insert(0, str(ROOT / "examples"))
from cases import BASE, FILES  # noqa: E402

SCRIPT = BASE.replace("thermo_style    custom step f_mpm[1]\nrun             2\n", """\
thermo_style    custom step f_mpm[5] f_mpm[6] cpu
thermo          5
dump  vtk all custom/vtk 10 points_*.vtk id type x y z vx vy vz f_mpm[10] f_mpm[13] f_mpm[17]
dump  text all custom 10 points.dump id x y z vx vy vz f_mpm[10] f_mpm[13] f_mpm[17]
dump_modify text sort id format "%d %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g %.9g"
run   20
""")


@pytest.fixture
def run(dempm):
    return dempm(SCRIPT, files=FILES)


def test_columns_and_times_are_those_of_the_run(run):
    import numpy as np
    import plot

    options = plot.arguments([str(run.path), "--out", str(run.path / "out")])
    frames = plot.Run(str(run.path), options)
    assert [step for step, _ in frames.files] == [0, 10, 20]
    step, table = run.dump("points.dump")[-1]
    frame = frames.frame(2)
    assert frame.step == step == 20
    assert frame.time == pytest.approx(20 * 1e-4)  # the timestep of the log
    order = np.argsort(table["id"])
    # dump custom/vtk writes 6 digits
    assert np.allclose(np.sort(frame.field("temperature")), np.sort(np.array(table["f_mpm[13]"])[order]), rtol=2e-6)
    speed = np.sqrt(sum(np.array(table[name]) ** 2 for name in ("vx", "vy", "vz")))
    assert np.allclose(np.sort(frame.field("speed")), np.sort(speed), rtol=1e-5, atol=1e-12)
    assert len(frames.thermo()["Step"]) == 5


def test_pictures_curves_packing_and_animation_are_written(run, capsys):
    import plot

    out = run.path / "out"
    plot.main([str(run.path), "--out", str(out), "--rve", str(run.path / "see_1.pvd"), "--curves", "kinetic=f_mpm[5]"])
    for name in ("temperature", "strain", "speed", "bonds", "runout", "energy", "rve_see_1"):
        assert (out / f"{name}.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n", name
    animations = list(out.glob("*.gif"))
    assert len(animations) == 1 and animations[0].read_bytes()[:6] == b"GIF89a"
    for line in capsys.readouterr().out.split():
        assert pathlib.Path(line).is_file()


def test_a_field_that_was_not_dumped_is_named(run):
    import plot

    with pytest.raises(SystemExit, match="'pressure' is not in the point files; there are: speed, temperature"):
        plot.main([str(run.path), "--out", str(run.path / "out"), "--fields", "pressure"])
