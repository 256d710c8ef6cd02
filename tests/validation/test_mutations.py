"""A linear model that is wrong by a little is caught: the validator does not sleep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from small_settings import SMALL

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Design, Limits
from analyses.large_signal.border import check_border
from analyses.validation import validate

AMBER = load_design("ilr33-amber")


def motor(design: Design, **factors: float) -> Design:
    """A motor with some constants multiplied."""
    return replace(
        design,
        motor=replace(design.motor, **{name: getattr(design.motor, name) * x for name, x in factors.items()}),
    )


def electrical_pole(design: Design) -> Design:
    return motor(design, inductance_H=1.01)


def mechanical_pole(design: Design) -> Design:
    return motor(design, torque_constant_Nm_A=1.01)


def sample_more(design: Design) -> Design:
    control = design.controller
    return replace(
        design, controller=replace(control, computing_delay_s=control.computing_delay_s + control.period_s)
    )


def friction_doubled(design: Design) -> Design:
    friction = design.friction
    return replace(design, friction=replace(friction, viscous_Nms_rad=2.0 * friction.viscous_Nms_rad))


def dry_friction_doubled(design: Design) -> Design:
    friction = design.friction
    return replace(design, friction=replace(friction, dry_torque_Nm=2.0 * friction.dry_torque_Nm))


def breakaway_ratio(design: Design) -> Design:
    friction = design.friction
    return replace(design, friction=replace(friction, breakaway_ratio=1.01 * friction.breakaway_ratio))


def command_filter(design: Design) -> Design:
    return replace(design, command=replace(design.command, filter_time_s=1e-4))


def feedforward(design: Design) -> Design:
    control = design.controller
    position = replace(control.position_loop, feedforward=0.01)
    return replace(design, controller=replace(control, position=position))


def sign_of_back_emf(design: Design) -> Design:
    return motor(design, back_emf_constant_Vs_rad=-1.0)


def integral_time(design: Design) -> Design:
    control = design.controller
    velocity = control.velocity
    assert velocity is not None
    slower = replace(velocity, integral_time_s=1.01 * (velocity.integral_time_s or 0.0))
    return replace(design, controller=replace(control, velocity=slower))


CAUGHT_BY: tuple[tuple[Callable[[Design], Design], set[str]], ...] = (
    (electrical_pole, {"bandwidth", "phase_margin", "gain_margin_up", "sensitivity_peak"}),
    (mechanical_pole, {"bandwidth", "phase_margin", "gain_margin_up", "gain_margin_down", "delay_margin"}),
    (sample_more, {"delay_margin", "gain_margin_up", "resonance_peak", "rise_time", "overshoot"}),
    (friction_doubled, {"bandwidth_90deg", "resonance_peak", "complementary_peak", "settling_time"}),
    (sign_of_back_emf, {"bandwidth", "computing_delay_margin", "resonance"}),
    (integral_time, {"overshoot", "delay_margin"}),
    (dry_friction_doubled, {"steady_current"}),
    (breakaway_ratio, {"breakaway_torque"}),
    (command_filter, {"response_command"}),
    (feedforward, {"response_command"}),
)


@pytest.mark.parametrize(("wrong", "quantities"), CAUGHT_BY, ids=[item[0].__name__ for item in CAUGHT_BY])
def test_a_wrong_model_is_caught(wrong: Callable[[Design], Design], quantities: set[str]) -> None:
    validation = validate(AMBER, SMALL, model=wrong(AMBER))
    assert not validation.passed
    assert {row.quantity for row in validation.failed} >= quantities


def test_the_right_model_is_not() -> None:
    validation = validate(AMBER, SMALL)
    assert validation.failed == ()
    assert len([row for row in validation.ledger if row.passed]) >= 36


@pytest.mark.parametrize("limit", ["speed_rad_s", "peak_current_A", "voltage_V", "acceleration_rad_s2"])
def test_a_limit_halved_is_caught(limit: str) -> None:
    """Each limit acts first somewhere: the border of linear validity is found elsewhere than predicted."""
    value = {"speed_rad_s": 60.0, "peak_current_A": 1.0, "voltage_V": 3.0, "acceleration_rad_s2": 2e3}[limit]
    wide = Limits(voltage_V=1e3, speed_rad_s=1e5, acceleration_rad_s2=1e9, peak_current_A=1e3)
    design = replace(AMBER, limits=replace(wide, **{limit: value}))
    halved = replace(design, limits=replace(wide, **{limit: 0.5 * value}))
    right = check_border(design, assemble_loops(design), count=4)
    wrong = check_border(design, assemble_loops(halved), count=4)
    assert right is not None
    assert wrong is not None
    assert right.passed is True
    assert np.isfinite(right.ratio).any()
    assert wrong.passed is False
