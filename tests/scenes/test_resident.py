# SPDX-License-Identifier: GPL-2.0-or-later
"""Points stay in the core between steps: whoever looks or interferes meanwhile notices nothing of it."""
import pytest
from scripts import elastic_block, state, state_dump


def end(dempm, script, step, **how):
    """The state at `step`, read at once: the next run writes the same file."""
    return state(dempm(script, **how), step)


PRESSURE = "compute sum all reduce sum f_mpm[7]\ncompute most all reduce max f_mpm[10]\n"


def test_fixes_that_average_between_outputs_read_present_values(dempm, tmp_path):
    """fix ave/time looks every third step, where nothing else is due; the other run prints each step."""
    script = elastic_block(transfer="flip 0.99") + PRESSURE
    dempm(script + """
fix average all ave/time 3 1 3 c_sum c_most file average.txt
thermo 1000
run 310
""", cwd=tmp_path)
    table = dempm(script + """
thermo 1
thermo_style custom step c_sum c_most
thermo_modify format float %.15g
run 310
""").table
    lines = [line.split() for line in (tmp_path / "average.txt").read_text().splitlines() if not line.startswith("#")]
    assert len(lines) == 104
    for step, pressure, strain in lines:
        row = table["Step"].index(int(step))
        # The file has six digits; a step moves both by more, see the last line
        assert float(pressure) == pytest.approx(table["sum"][row], rel=1e-5)
        assert float(strain) == pytest.approx(table["most"][row], rel=1e-5)
    steps = table["most"][3:]
    assert sum(abs(a - b) > 1e-4 * b for a, b in zip(steps, steps[1:])) > 0.9 * len(steps)


@pytest.mark.parametrize("np", [1, 2])
def test_a_force_may_follow_what_the_law_answered(np, dempm):
    """A force from the pressure of each point: the same whether or not something is printed at each step."""
    script = elastic_block(transfer="flip 0.99") + """
fix pressure all ave/atom 1 1 1 f_mpm[7]
variable push atom 1e-4*f_pressure
fix push all addforce v_push 0 0
"""
    script += state_dump(300)
    seldom = end(dempm, script + "run 300\n", 300, np=np)
    often = end(dempm, script + "dump each all custom 1 each.txt id f_mpm[7]\nrun 300\n", 300, np=np)
    without = end(dempm, script + "unfix push\nrun 300\n", 300, np=np)
    assert seldom == often
    assert seldom != without


def test_sorted_and_reneighboured_particles_go_the_same_way(dempm):
    """Rows of LIGGGHTS' arrays change places (sorting) and lists are built anew as often as they can be: same bits."""
    script = elastic_block(boundary="p f", transfer="flip 0.99").replace("vx 0.5", "vx 8") + state_dump(300)
    plain = end(dempm, script + "run 300\n", 300)
    busy = script.replace("map array", "map array sort 1 0") + "neigh_modify every 1 delay 0 check no\nrun 300\n"
    assert end(dempm, busy, 300) == plain


def test_velocities_set_between_runs_count(dempm):
    """`set` between two runs, with and without a restart of LIGGGHTS' preparations in between."""
    script = elastic_block(transfer="flip 0.99") + state_dump(200)
    change = "set group all vx 0.25"
    first, second, third, unchanged = [
        end(dempm, script + text, 200)
        for text in (f"run 100\n{change}\nrun 100\n", f"run 100\n{change}\nrun 100 pre no post no\n",
                     f'run 100\nrun 0\n{change}\nrun 100 every 50 "print half"\n', "run 200\n")]
    assert first == second == third
    assert first != unchanged


def test_a_point_that_becomes_too_fast_is_told_in_its_step(dempm):
    """The limit is not found anew in each step, but a growing bound tells when it must be."""
    script = elastic_block(transfer="flip 0.99") + "timestep 5e-4\n"
    run = dempm(script + """
variable push atom (step>20)*(id<2)*2e5
fix push all addforce v_push 0 0
thermo 1
thermo_style custom step f_mpm[5]
run 60
""", check=False)
    # The step in which a look at each point in every step tells it, too
    assert "at step 26 timestep 0.0005 s is larger than the critical mechanical time step 0.000498953 s" in run.output
