"""Laws of one's own: two controllers made outside, each with a truth of its own; who asks for the loops."""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from loop_designs import controlled, source_drive
from own_laws import as_law, linear, stepped
from scipy.linalg import solve_discrete_are
from scipy.signal import place_poles

from actuator_lti import Design, assemble_loops, load_design, plant, stability_margins
from actuator_lti.batch import Population, linear_figures
from actuator_lti.compiled.compiler import system_compiler
from actuator_lti.design.model import Encoder, PositionLoop, Requirement, VelocityLoop
from actuator_lti.drive.steady import torque_gain_Nm_rad
from actuator_lti.errors import InputError
from analyses import survey_loops, validate
from analyses.friction_effects import friction_effects
from analyses.linear.code_check import check_code
from analyses.linear.loop_figures import all_loop_figures
from analyses.margins import margins
from analyses.tuning import tune
from analyses.tuning.start import rule_gains
from analyses.validation import CHECKS, QUICK
from reports.live.keys import followed
from reports.live.model import live_model
from reports.sections.friction_effects import section as friction_section
from reports.sections.loop import section
from tests.changed import changed


def poles(design: Design) -> np.ndarray:
    """Of the whole closed drive over its period (one tick here)."""
    system = assemble_loops(design).tick_system
    assert system.ticks == 1
    return np.linalg.eigvals(system.matrices(0)[0])


def same_poles(found: np.ndarray, wanted: np.ndarray, within: float) -> None:
    """Every wanted pole is there, each once."""
    left = list(found)
    for pole in wanted:
        nearest = min(left, key=lambda one: abs(one - pole))
        assert abs(nearest - pole) < within, (pole, nearest)
        left.remove(nearest)


def test_lqg_velocity_controller() -> None:
    """Separation: the closed drive has the poles of the regulator and of the observer, by scipy's Riccati."""
    base = replace(linear(load_design("ilr33-amber")), requirements=(), encoder=Encoder())
    base = controlled(base, position=None)
    system, T = plant(base, command="i_ref"), base.controller.period_of("velocity")
    seen = [k for k, name in enumerate(system.state_labels) if name != "th"]
    A, B = system.A[np.ix_(seen, seen)], system.B[seen, :1]
    C, n = system.C[system.output_labels.index("speed")][None, seen], len(A)
    S = solve_discrete_are(A, B, 1e-3 * C.T @ C + 1e-12 * np.eye(n), [[1.0]])
    K = np.linalg.solve(1.0 + B.T @ S @ B, B.T @ S @ A)
    P = solve_discrete_are(A.T, C.T, 1e2 * B @ B.T + 1e-9 * np.eye(n), [[1.0]])
    G, closed = np.linalg.solve(1.0 + C @ P @ C.T, C @ P @ A.T).T, A - B @ K
    pre = 1.0 / (C @ np.linalg.solve(np.eye(n) - closed, B)).item()
    law = (closed - G @ C, np.hstack([G, pre * B]), -K, [[0.0, pre]], T)
    mine = base.with_law("velocity", law, ["speed", "command"], L=B)
    same_poles(poles(mine), np.concatenate([np.linalg.eigvals(closed), np.linalg.eigvals(A - G @ C)]), 1e-7)
    assert stability_margins(assemble_loops(mine).velocity.open_loop).stable
    # the observer knows what the limit left of its output: a step far into the current limit does not wind up
    limited = replace(mine, limits=replace(load_design("ilr33-amber").limits, speed_rad_s=np.inf))
    run = stepped(limited, 2500, 600.0 / base.total_ratio)
    assert run.limits["current"].fraction > 0.01
    assert abs(run.motor_speed_rad_s[-1] / 600.0 - 1.0) < 1e-6
    assert run.motor_speed_rad_s.max() < 1.05 * 600.0


def test_state_feedback_from_motor_and_load_of_a_joint() -> None:
    """All poles where they were placed: current, motor, coupling and load measured, the delay remembered."""
    base = replace(linear(load_design("joint")), requirements=(), encoder=Encoder())
    base = controlled(base, current=None, velocity=None, position=PositionLoop(gain=1.0),
                      computing_delay_s=base.controller.period_s)  # fmt: skip
    system, T = plant(base, command="u"), base.controller.period_s
    names = list(system.state_labels)
    assert names == ["i", "w", "th", "W", "twist", "u1"]
    A, B = system.A, system.B[:, :1]
    wanted = np.exp(
        T * np.array([-4000.0, -900.0, -60.0 + 60.0j, -60.0 - 60.0j, -250.0 + 150.0j, -250.0 - 150.0j])
    )
    K = place_poles(A, B, wanted).gain_matrix[0]
    N_c, N_r = base.ratio_to_coupling, base.ratio_behind_coupling
    gains = dict(zip(names, K, strict=True))
    inputs = ["current", "speed", "angle", "output_speed", "output_angle", "command"]
    D = -np.array([gains["i"], gains["w"], gains["th"] + gains["twist"] / N_c, gains["W"] * N_r,
                   -gains["twist"] * N_r, 0.0])  # fmt: skip
    D[5] = gains["th"]  # the command is the motor's angle at rest
    law = ([[-gains["u1"]]], [D], [[-gains["u1"]]], [D], T)  # x is the voltage of the last tick
    mine = base.with_law("position", law, inputs, L=[1.0])
    same_poles(poles(mine), wanted, 1e-7)
    run = stepped(mine, int(0.3 / T), 0.1, limits_on=False)
    assert abs(run.output_angle_rad[-1] - 0.1) < 1e-7
    loop, z = assemble_loops(mine).position, np.exp(1j * np.geomspace(1e-3, 3.0, 50))
    bare = np.where(np.arange(6) == 5, 0.0, K)  # its own output it remembers: no loop is cut
    theirs = np.array([(bare @ np.linalg.solve(one * np.eye(6) - A, B)).item() for one in z])
    np.testing.assert_allclose(loop.open_loop(z), theirs / (1.0 + gains["u1"] / z), rtol=1e-7)
    # the same with the twist by its name
    inputs = ["current", "speed", "angle", "output_speed", "twist", "command"]
    D = -np.array([gains["i"], gains["w"], gains["th"], gains["W"] * N_r, gains["twist"], -gains["th"]])
    law = ([[-gains["u1"]]], [D], [[-gains["u1"]]], [D], T)
    same_poles(poles(base.with_law("position", law, inputs)), wanted, 1e-7)
    other = stepped(base.with_law("position", law, inputs, L=[1.0]), int(0.3 / T), 0.1, limits_on=False)
    np.testing.assert_allclose(other.output_angle_rad, run.output_angle_rad, atol=1e-12, rtol=0)


STAGES = ("current", "velocity", "position")


def lead(stage: str) -> Design:
    """The shipped drive with a law of one state and an anti-windup on the error of a stage."""
    design = load_design("ilr33-amber")
    if stage != "position":
        return as_law(design, stage, L=[0.5])
    gain, T = design.controller.position.gain, design.controller.period_of(stage)
    return design.with_law(stage, ([[0.5]], [[1.0]], [[-0.25 * gain]], [[1.5 * gain]], T), ["error"])


@pytest.mark.parametrize("stage", STAGES)
def test_every_prediction_is_met(stage: str) -> None:
    """By the simulator's own derivative, in time, and beyond the limits."""
    result = validate(lead(stage), QUICK)
    assert result.passed, [row for row in result.rows if row.verdict != "met"]
    assert len(result.rows) > 60


def test_a_law_on_a_counted_output_meets_its_predictions() -> None:
    """With the twist among its signals; what a law does with counts is tested with its limits."""
    base = load_design("joint")
    gain, T = base.controller.position.gain, base.controller.period_of("position")
    law = ([[0.5]], [[0.1 * gain, 0.2]], [[0.5]], [[0.9 * gain, -3.0]], T)
    rows = validate(base.with_law("position", law, ["error", "twist"]), CHECKS).rows
    assert not [row for row in rows if row.verdict != "met"]


@pytest.mark.skipif(system_compiler() is None or not sys.platform.startswith("linux"), reason="no C compiler")
def test_the_compiled_code_meets_the_loops() -> None:
    assert not check_code(lead("position")).failed


def test_a_survey_has_the_sampled_form_alone() -> None:
    result = survey_loops(lead("velocity"))
    assert set(result.forms) == {"sampled"}
    assert not result.budgets


@pytest.mark.parametrize("stage", STAGES)
def test_it_stays_as_it_is_while_the_rest_moves(stage: str) -> None:
    design = lead(stage)
    page: Any = live_model(design)
    free, fixed = ({key["path"] for key in page[part]} for part in ("keys", "fixed"))
    others = {f"control.{other}.gain" for other in STAGES if other != stage}
    assert others | {f"control.{stage}.law.gain"} <= free
    assert "control.period" in fixed
    assert f"control.{stage}.gain" not in free | fixed
    gains = rule_gains(design).values
    assert others <= set(gains)
    assert not any(path.startswith(f"control.{stage}.") for path in gains)


def test_the_answer_to_the_command_of_a_law_that_takes_more_than_the_error() -> None:
    """An integral of the error less a gain on the speed, on a free mass: L/(1 + L) has a zero, this none.

    The loop's figures, those of many designs, of the continuous form and of its requirements are of that one.
    """
    gain, integral = 0.3, 0.06  # of the speed that is gained in a period
    base = source_drive(1.0, 1.0, 1e-3, 1e6, controller={"velocity": VelocityLoop(gain=1.0)})
    law = ([[1.0]], [[integral, 0.0]], [[1e3]], [[0.0, -1e3 * gain]], 1e-3)
    limit = Requirement(id="over", quantity="overshoot", unit="%", loop="velocity", maximum=20.0)
    slow = ([[0.0]], [[1e3 * integral, 0.0]], [[1e3]], [[0.0, -1e3 * gain]])
    mine = base.with_law("velocity", law, ["error", "speed"], continuous=slow)
    mine = replace(mine, requirements=(limit,))
    speed, x = [0.0], 0.0
    for _ in range(400):
        speed, x = [*speed, speed[-1] + x - gain * speed[-1]], x + integral * (1.0 - speed[-1])
    over = 100.0 * (max(speed) / speed[-1] - 1.0)
    (figures,), (verdict,) = all_loop_figures(assemble_loops(mine)).values(), margins(mine).requirements
    many = linear_figures(Population(mine, {}, 1)).quantity("overshoot", "velocity")[0]
    assert [figures.step.overshoot_percent, verdict.value, many] == pytest.approx([over] * 3, rel=1e-6)
    assert (verdict.reason, verdict.passes) == ("of the response to its command", True)
    (ideal,) = all_loop_figures(assemble_loops(mine, form="ideal"), step=False).values()
    s = 1j * ideal.bandwidth.minus3db_rad_s * 1e-3
    assert abs(integral / (s * s + gain * s + integral)) == pytest.approx(0.5**0.5)
    back = base.with_law("velocity", ([], [], [], [[-1e3 * gain] * 2], 1e-3), ["command", "speed"])
    (one,), many = all_loop_figures(assemble_loops(back)).values(), linear_figures(Population(back, {}, 1))
    quarter = np.arccos(1.0 - gain) / (2e-3 * np.pi)  # of -g/(z - 1 + g), by the phase from that at zero
    found = one.bandwidth.minus90deg_hz, many.quantity("bandwidth_90deg", "velocity")[0]
    assert found == pytest.approx([quarter] * 2, rel=1e-9)


def test_the_page_says_where_the_loop_of_a_law_is_cut_and_whose_step_it_shows() -> None:
    """At the amperes that it gives: an error of amperes, a step "of its command" are of no velocity loop."""
    design = lead("velocity")
    figures = all_loop_figures(assemble_loops(design))
    pages = {name: section(name, design, one) for name, one in figures.items()}
    assert pages["velocity"]["intro"].startswith("Cut at what its law gives (A), every")
    assert pages["position"]["intro"].startswith("Cut at its error (rad), every")
    assert all("a unit step of its command" in f"{page}" for page in pages.values())


def test_why_a_drive_has_no_threshold_is_said_of_its_law_and_of_its_friction() -> None:
    """Not "the smoothed law of friction creeps" of dry friction behind a law that integrates."""
    smooth = load_design("ilr33-amber-tanh")
    integral = ([[1.0]], [[0.01]], [[1.0]], [[0.1]], 1e-4)
    own = load_design("ilr33-amber").with_law("velocity", integral, ["error"])
    for design, words in ((smooth, "The smoothed law of friction creeps"), (own, "A law of one's own that")):
        told = friction_section(friction_effects(changed(design, validation={"loads_Nm": (0.0,)})))
        assert words in f"{told}"
        assert ("creeps" in f"{told}") is (design is smooth)


def test_the_rule_of_the_position_takes_the_crossover_of_the_law_inside() -> None:
    """Not that of the symmetric optimum, which is not run: |L| of the law is 1 at four times the gain."""
    design = lead("velocity")
    gain = rule_gains(design).values["control.position.gain"]
    loop, period = (
        assemble_loops(design).present["velocity"].open_loop,
        design.controller.period_of("velocity"),
    )
    assert abs(loop(np.exp(4j * gain * period))) == pytest.approx(1.0, rel=1e-9)


def test_a_law_alone_leaves_nothing_to_tune() -> None:
    asked = Requirement(id="phase", quantity="phase_margin", unit="deg", loop="every", minimum=30.0)
    alone = controlled(lead("current"), velocity=None, position=None)
    with pytest.raises(InputError, match=r"nothing to tune: control.current.law stays"):
        tune(replace(alone, requirements=(asked,)))


def test_a_key_that_a_drive_may_not_have_has_no_slider() -> None:
    """Without a velocity loop nothing takes the command's rate; with one both can be moved from 0."""
    base = load_design("ilr33-amber")
    rates = {"control.position.feedforward", "control.position.acceleration_feedforward"}
    pid = controlled(base, velocity=None, position=PositionLoop(gain=20.0))
    for design, part in ((base, "free"), (pid, "fixed")):
        assert rates <= {key["path"] for key in getattr(followed(design), part)}
    why = {key["path"]: key["why"] for key in followed(pid).fixed}
    assert {why[path] for path in rates} == {"allowed: 0 without a velocity loop"}


def test_many_designs_have_the_gain_of_the_law() -> None:
    design, factors = lead("velocity"), np.array([0.5, 1.0, 2.0])
    many = linear_figures(Population(design, {"control.velocity.law.gain": factors}, 3))
    for k, factor in enumerate(factors):
        one = design.with_values({"control.velocity.law.gain": float(factor)})
        alone = linear_figures(Population(one, {}, 1))
        for loop in ("current", "velocity", "position"):
            wanted = alone.quantity("gain_margin", loop)[0]
            assert many.quantity("gain_margin", loop)[k] == pytest.approx(wanted, rel=1e-12)


def test_a_law_without_its_command_leaves_no_loop_around_it() -> None:
    """Fed with the speed alone: the loops outside have no state, and their figures are withheld."""
    design = load_design("ilr33-amber")
    damped = design.with_law("current", ([], [], [], [[0.02]], design.controller.period_s), ["speed"])
    many = linear_figures(Population(damped, {}, 2))
    assert [bool(many.withheld(loop).all()) for loop in STAGES] == [False, True, True]


def test_torque_at_rest() -> None:
    """Of a static law the product of the gains; a law that integrates has no end of it."""
    base = controlled(load_design("ilr33-amber"), velocity={"integral_time_s": None})
    gain, T = base.controller.velocity.gain, base.controller.period_of("velocity")
    static = base.with_law("velocity", ([[0.5]], [[0.5]], [[0.4 * gain]], [[0.6 * gain]], T), ["error"])
    assert torque_gain_Nm_rad(static) == pytest.approx(torque_gain_Nm_rad(base), rel=1e-12)
    assert torque_gain_Nm_rad(lead("velocity")) == np.inf
