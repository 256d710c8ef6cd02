"""Tuning: the least change against a dense grid, a requirement only a notch meets, what may be placed."""

from dataclasses import replace

import numpy as np
import pytest
from toleranced import QUICK, need

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.bandwidth import closed_loop_bandwidth
from actuator_lti.design import model
from actuator_lti.design.model import Coupling, Gear, PositionLoop
from actuator_lti.errors import InputError
from analyses.tuning import tune
from analyses.tuning.problem import loop_requirements, problem_of
from analyses.tuning.start import allowed_range, place, step_of_gain
from tests.changed import changed
from tests.loops.loop_designs import source_drive


def servo(*requirements, stiffness=None, gain=0.02, integral_time=None, position=None):
    """A torque source and a velocity loop; with a stiffness the load hangs on a spring of 1 % damping."""
    inertia, coupling = 1e-4, None
    if stiffness is not None:
        damping = 0.02 * (stiffness * inertia / 2) ** 0.5
        coupling = Coupling(stiffness_Nm_rad=stiffness, damping_Nms_rad=damping)
    loop = model.VelocityLoop(gain=gain, integral_time_s=integral_time)
    control = {"computing_delay_s": 2.5e-4, "position": position, "velocity": loop}
    return source_drive(
        inertia, 1.0, 2.5e-4, 10.0, gears=(Gear(name="none", ratio=1.0),), coupling=coupling,
        load={"inertia_kgm2": inertia, "path": "back-drivable"}, friction={"viscous_Nms_rad": 1e-4},
        controller=control, requirements=requirements,
    )  # fmt: skip


RESONANT = 0.5e-4 * (2 * np.pi * 700.0) ** 2  # 700 Hz, where the delay turns by more than 90 deg
DIRECT = changed(servo(), controller={"velocity": None, "position": PositionLoop(gain=1.0)})
WIDE = (need("gain_margin", 6.0, unit="dB"), need("phase_margin", 30.0), need("bandwidth", 60.0, unit="Hz"))


def seen(design):
    """What certified margins and the bandwidth say of the velocity loop."""
    loop = assemble_loops(design).velocity
    found = stability_margins(loop.open_loop, certify=True)
    assert found.stable is True
    width = closed_loop_bandwidth(loop.closed_loop).minus3db_hz
    return found.gain_margin_db, found.phase_margin_deg, width


def test_a_requirement_that_only_a_notch_meets():
    """No gain does, and with the notch certified margins say that every limit is kept."""
    design = servo(*WIDE, stiffness=RESONANT)
    problem = problem_of(design, loop_requirements(design), {})
    grid = np.geomspace(1e-4, 1.0, 400)[:, None]
    assert problem.distances(grid, problem.all_corners).min(axis=(1, 2)).max() < 0.0
    refused = tune(design, QUICK)
    assert not refused.feasible
    assert "Cannot be met together" in refused.notes[0]
    tuned = tune(design, replace(QUICK, place=("notch",)))
    assert (tuned.feasible, tuned.placed) == (True, ("notch",))
    gain, phase, width = seen(tuned.design)
    assert (gain >= 6.0, phase >= 30.0, width >= 60.0) == (True, True, True)
    notch = tuned.design.controller.velocity.filters[-1]
    assert notch.kind == "notch"
    assert notch.frequency_rad_s / (2 * np.pi) == pytest.approx(700.0, rel=0.3)
    assert all(v.verdict == "met" for v in tuned.confirmed)
    assert nearest_drawn(design, 1.3 * distance_of(tuned)) >= 0.999 * distance_of(tuned)


def distance_of(tuned):
    """Squares of the ln ratios of gain and depth, and of the width of the notch over its frequency."""
    velocity, notch = tuned.design.controller.velocity, tuned.design.controller.velocity.filters[-1]
    ratios = np.log([velocity.gain / 0.02, notch.depth])
    return ratios @ ratios + (notch.width_rad_s / notch.frequency_rad_s) ** 2


def nearest_drawn(design, most):
    """Of many notches about the resonance, with any gain and depth: the nearest that does, below a change."""
    problem = problem_of(design, loop_requirements(design), {}, ("notch",))
    rng, size = np.random.default_rng(5), 60_000
    frequency = 2 * np.pi * 700.0 * np.exp(rng.uniform(-0.3, 0.3, size))
    gain, depth = 0.02 * np.exp(rng.uniform(0.0, 1.5, size)), np.exp(rng.uniform(-1.5, 0.0, size))
    rows = np.column_stack([gain, frequency, frequency * rng.uniform(0.0, 1.5, size), depth])
    rows = rows[problem.change(rows) < most]
    met = problem.distances(rows, problem.all_corners).min(axis=(1, 2)) >= 0.0
    assert met.any()
    return problem.change(rows)[met].min()


def test_no_smaller_change_of_two_gains_meets_the_requirements():
    """Every point of a dense grid over both gains that meets all limits is at least as far away."""
    asked = (need("bandwidth", 50.0, unit="Hz"), need("phase_margin", 62.0))
    design = servo(*asked, gain=0.03, integral_time=0.01)
    tuned = tune(design, QUICK)
    assert tuned.feasible
    gain, time = tuned.design.controller.velocity.gain, tuned.design.controller.velocity.integral_time_s
    change = np.log(gain / 0.03) ** 2 + np.log(time / 0.01) ** 2
    assert change > 0.01
    reach = 1.2 * np.sqrt(change)
    line = np.linspace(-reach, reach, 61)
    grid = np.exp(np.array(np.meshgrid(line, line)).reshape(2, -1).T) * [0.03, 0.01]
    problem = problem_of(design, loop_requirements(design), {})
    met = problem.distances(grid, problem.all_corners).min(axis=(1, 2)) >= 0.0
    assert met.any()
    away = (np.log(grid / [0.03, 0.01]) ** 2).sum(axis=1)
    assert change <= away[met].min() * (1 + 1e-9)
    _, phase, width = seen(tuned.design)
    assert (phase >= 62.0, width >= 50.0) == (True, True)


def test_what_meets_all_is_left_neutral_elements_are_neutral_and_ranges_are_of_the_drive():
    design = servo(need("phase_margin", 30.0))
    tuned = tune(design, replace(QUICK, place=("notch", "lowpass")))
    assert (tuned.feasible, tuned.placed, tuned.design.controller) == (True, (), design.controller)
    # a notch of depth 1 is a factor 1; feed-forward starts at what the design has
    design = servo(stiffness=RESONANT, position=PositionLoop(gain=20.0, feedforward=0.4))
    placed, variables = place(design, ("notch", "feedforward"))
    starts = {v.path: v.start for v in variables}
    assert starts["control.position.feedforward"] == 0.4
    for name in ("velocity", "position"):
        loops = (getattr(assemble_loops(one), name).open_loop for one in (design, placed))
        before, after = ((m.gain_margin_db, m.phase_margin_deg) for m in map(stability_margins, loops))
        assert after == pytest.approx(before, rel=1e-9)
    # 0x2348.01 holds 1 to 250 1/s in whole steps; another drive may have any gain
    baseline = load_design("ilr33-amber")
    assert baseline.objects.named
    assert allowed_range(baseline, "control.position.gain") == (1.0, 250.0)
    other = replace(baseline, objects=model.ControllerObjects())
    assert allowed_range(other, "control.position.gain") == (0.0, np.inf)
    assert step_of_gain(load_design("joint"), "control.position.gain") is None


def test_feed_forward_carries_the_bandwidth_where_the_gain_may_not_rise():
    """A P loop of 80 deg falls by 3 dB far below the velocity loop; feed-forward reaches that one."""
    band = need("bandwidth", 60.0, loop="position", unit="Hz")
    asked = (band, need("phase_margin", 80.0, loop="position"), need("gain_margin", 15.0, unit="dB"))
    design = servo(*asked, gain=0.1, position=PositionLoop(gain=20.0))
    assert not tune(design, QUICK).feasible
    tuned = tune(design, replace(QUICK, place=("feedforward",)))
    assert (tuned.feasible, tuned.placed) == (True, ("feedforward",))
    position = tuned.design.controller.position
    assert position.feedforward > 0.0 or position.acceleration_feedforward > 0.0


@pytest.mark.parametrize(("words", "design", "message"), [
    (("filter",), servo(), "notch, lowpass, feedforward"),
    (("feedforward",), servo(), "no control.position"),
    (("notch",), DIRECT, "no control.velocity"),
])  # fmt: skip
def test_what_has_no_place_is_refused(words, design, message):
    asked = replace(design, requirements=(need("gain_margin", 6.0, loop="every", unit="dB"),))
    with pytest.raises(InputError, match=message):
        tune(asked, replace(QUICK, place=words))


def test_the_command_places_and_says_so(cli, tmp_path):
    words = ("--place", "notch,lowpass", "--aim", "least-change", "--no-curve", "--quiet", "--out", tmp_path)
    assert "least change" in cli.text("tune", "fin", *words)
    assert load_design(tmp_path / "tuned.toml").controller.velocity.filters == ()
    assert "spring" in cli.refused("tune", "fin", "--place", "spring", "--quiet")
