"""Margins confirmed in time: equal to the linear ones to 0.1 % where no limit acts."""

from __future__ import annotations

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.loops import PeriodicLoop
from analyses.validation import Settings, validate
from analyses.validation.borders import Search, find_borders
from analyses.validation.confirm import (
    Confirmation,
    confirm_margins,
    instrument_delay,
    oscillation_hz,
    point_questions,
    stage_questions,
)
from analyses.validation.release import release_margins
from analyses.validation.sweep import settling_ticks_of
from analyses.validation.validate import _Work
from nonlinear.loop_setup import loop_setup, standing_setup
from tests.validation.random_drives import full_drive

SMALL = Settings(
    frequencies=12,
    point_frequencies=0,
    multisine=False,
    amplitude_margins=False,
    rest_frequencies=0,
    large_signals=False,
    friction_effects=False,
    specification=False,
)


def confirmed(name: str) -> tuple[Confirmation, ...]:
    design = load_design(name)
    loops = assemble_loops(design)
    questions, settle = [], {}
    for stage, loop in loops.present.items():
        setup = loop_setup(design, stage)
        settle[stage] = settling_ticks_of(loop.closed_loop, setup.hold_ticks, name)
        questions += stage_questions(setup, loop, stability_margins(loop.open_loop), settle[stage])
    points = {point: loop_setup(design, point) for point in loops.break_points if point != "output"}
    questions += point_questions(points, loops, settle["position"])
    return confirm_margins(questions)


@pytest.mark.parametrize(
    ("name", "count"),
    [("ilr33-amber", 16), ("ilr33-amber-multirate", 16), ("ctms-motor-position", 6), ("emps", 11)],
)
def test_every_margin_is_found_in_time(name: str, count: int) -> None:
    result = confirmed(name)
    assert len(result) == count
    for item in result:
        where = f"{item.loop} {item.kind}"
        assert item.passed, where
        if item.predicted is None:
            assert item.border.value is None, where
        else:
            assert item.difference is not None
            assert abs(item.difference) < 1e-4, where  # ten times closer than asked for
            assert item.border.frequency_hz == pytest.approx(item.predicted_hz, rel=0.02), where


def test_margins_of_the_baseline_are_the_known_ones() -> None:
    """Against an independent computation of this drive (its J is 1 % larger), not against our own loops."""
    result = {(item.loop, item.kind): item for item in confirmed("ilr33-amber")}
    known_db = {"current": 9.4, "velocity": 23.3, "position": 27.1}
    for loop, db in known_db.items():
        border = result[loop, "gain up"].border
        assert border.value is not None
        assert 20.0 * np.log10(border.value) == pytest.approx(db, abs=0.3)


def test_a_wrong_prediction_fails() -> None:
    item = next(item for item in confirmed("ctms-motor-position") if item.kind == "gain up")
    assert item.predicted is not None
    wrong = Confirmation(
        loop=item.loop,
        point=item.point,
        kind=item.kind,
        predicted=1.002 * item.predicted,
        predicted_hz=item.predicted_hz,
        instrument=None,
        border=item.border,
        period_s=item.period_s,
    )
    assert item.passed
    assert not wrong.passed


def test_a_wrong_idea_of_the_frequency_does_not_move_the_border() -> None:
    """Windows fitted to a frequency that is off by 4 % cost accuracy, not the answer."""
    setup = loop_setup(load_design("ilr33-amber"), "velocity")
    right, wrong = find_borders([Search(setup, "gain up", f, 1500) for f in (997.3, 1040.0)])
    assert right.value is not None
    assert wrong.value == pytest.approx(right.value, rel=5e-3)


def test_the_instruments_delay_is_accounted_for() -> None:
    """A pure integrator: the border with an interpolated delay against the exact one (case E1 of the set)."""
    import control

    loop = control.tf([0.5], [1, -1], 1e-3)
    margin = stability_margins(loop).delay_margin
    assert margin.samples == pytest.approx(2.60827, abs=1e-5)
    best = instrument_delay(loop, margin.samples, margin.frequency_rad_s * 1e-3)
    assert best == pytest.approx(margin.samples, rel=1e-3)
    assert best != margin.samples
    whole = instrument_delay(loop, 3.0, margin.frequency_rad_s * 1e-3)
    assert whole == pytest.approx(best, rel=1e-9)


def test_amplitude_and_friction_move_the_border() -> None:
    """From rest: without friction the inner loops keep their margins, dry friction adds to them, and the
    current limit, which bounds the acceleration, takes from that of the position loop (ilr33-amber)."""
    design = load_design("ilr33-amber")
    loops = assemble_loops(design)
    setups = {name: loop_setup(design, name) for name in loops.present}
    settle = {
        name: settling_ticks_of(loop.closed_loop, setups[name].hold_ticks, "")
        for name, loop in loops.present.items()
    }
    result = release_margins(setups, confirmed("ilr33-amber"), settle)
    assert len(result) == 36
    by = {(item.loop, item.kind, item.size, item.friction_on): item for item in result}
    for loop in ("current", "velocity"):
        for kind in ("gain up", "delay"):
            for size in ("small", "medium", "large"):
                free, rubbing = (by[loop, kind, size, on] for on in (False, True))
                assert free.border.value == pytest.approx(free.linear, rel=0.05)
                assert rubbing.border.value >= 0.99 * free.border.value
    position = by["position", "gain up", "large", False]
    assert position.border.value < 0.5 * position.linear
    assert position.limiter == "current"  # peak current bounds the acceleration
    assert (
        by["velocity", "delay", "small", True].border.value
        > 1.1 * by["velocity", "delay", "small", True].linear
    )


def test_a_drive_that_drifts_away_has_a_lower_margin_at_no_frequency() -> None:
    """A moment that pushes the surface away: below some gain the drive no longer holds it.

    There the constant torques balance: ``g K_V K_X N x`` volts through ``N kM / R`` against the slope.
    """
    slope = 300.0
    design = load_design("fin")
    design = replace(design, load=replace(design.load, moment_slope_Nm_rad=slope))
    control, motor, N = design.controller, design.motor, design.total_ratio
    border = (
        slope * motor.resistance_ohm
        / (N**2 * motor.torque_constant_Nm_A * control.velocity.gain * control.position.gain)
    )  # fmt: skip
    result = validate(design, SMALL).loops["position"].confirmed
    item = next(one for one in result if one.kind == "gain down")
    assert item.predicted == pytest.approx(border, rel=1e-9)
    assert item.predicted_hz == 0.0
    assert item.border.value == pytest.approx(border, rel=1e-6)
    assert item.error < 1e-4
    assert item.passed


def test_a_loop_that_alternates_at_its_border() -> None:
    """A current loop without computing delay: at its border every sample has the other sign.

    ``i+ = a i + b u`` with ``a = exp(-R Ts/L)``, ``b = (1 - a)/R``; the controller at z = -1.
    """
    design = load_design("ilr33-amber")
    design = replace(
        design, controller=replace(design.controller, computing_delay_s=0.0, position=None, velocity=None)
    )
    motor, control, Ts = design.motor, design.controller.current, design.controller.period_s
    a = exp(-motor.resistance_ohm * Ts / motor.inductance_H)
    b = (1.0 - a) / motor.resistance_ohm
    at_minus_one = control.gain_V_A * (1.0 + 0.5 * Ts / control.integral_time_s)
    result = validate(design, SMALL).loops["current"].confirmed
    item = next(one for one in result if one.kind == "gain up")
    assert item.predicted_hz == pytest.approx(0.5 / Ts)
    assert item.border.value == pytest.approx((1.0 + a) / (b * at_minus_one), rel=1e-6)
    assert item.border.frequency_hz == pytest.approx(0.5 / Ts)
    assert item.passed


def test_the_frequency_of_a_border_below_any_grid() -> None:
    """Three integrators and two zeros at a, ``L = K (z - a)^2/(z - 1)^3``: it oscillates below a gain.

    With ``z = exp(j theta)`` on the circle ``z - 1 = 2j sin(theta/2) exp(j theta/2)``, so that
    ``z - a = r exp(j (pi/4 + 3 theta/4))``, ``r^2 K = 8 sin(theta/2)^3``: imaginary and real part give r, a.
    """
    theta, T = 4e-5, 1e-3
    turn = 0.25 * np.pi + 0.75 * theta
    r = np.sin(theta) / np.sin(turn)
    c = (2.0 * np.sin(0.5 * theta) ** 2 + r * np.cos(turn)) / theta  # (1 - a)/theta
    K = 8.0 * np.sin(0.5 * theta) ** 3 / r**2
    A = np.eye(3) + theta * np.eye(3, k=-1)  # in s = (z - 1)/theta, where its poles lie apart
    B, C = np.array([[theta], [0.0], [0.0]]), np.array([[1.0, 2.0 * c, c**2]])
    loop = PeriodicLoop([(A, B, C)], T)
    assert oscillation_hz(loop, gain=K / theta) == pytest.approx(theta / (2.0 * np.pi * T), rel=1e-6)


@pytest.mark.parametrize(
    ("seed", "kind", "hertz"), [(30005, "gain up", 0.00572), (30011, "gain down", 0.0822)]
)
def test_an_oscillation_that_is_slow_against_its_tick_is_followed(seed: int, kind: str, hertz: float) -> None:
    """Periods of 189 000 and 52 000 ticks, taken for another mode and for a drift: 22.6 dB for 1.9."""
    design = full_drive(seed)
    work = _Work(design, SMALL, None, design)
    work.loops = work._assemble()
    asked = point_questions({"u": standing_setup(work.linear, "u")}, work.loops, 1000)
    (item,) = confirm_margins([one for one in asked if one.kind == kind])
    assert item.predicted_hz == pytest.approx(hertz, rel=1e-2)
    assert item.border.value == pytest.approx(item.predicted, rel=1e-4)
    assert item.passed


def test_an_oscillation_too_slow_to_be_followed_is_said() -> None:
    setup = loop_setup(load_design("ilr33-amber"), "velocity")
    (border,) = find_borders([Search(setup, "gain up", 1e-3, 1000)])
    assert border.value is None
    assert "too many ticks" in border.unknown


def test_a_slow_filter_of_the_command_makes_no_border() -> None:
    """Seed 70093: two equal poles 1.4e-6 from 1 are known to 1e-6; 1.2 was called exact, 2.98 was found."""
    design = full_drive(70093)
    work = _Work(design, SMALL, None, design)
    work.loops = work._assemble()
    asked = point_questions({"u": standing_setup(work.linear, "u")}, work.loops, 1000)
    up = next(item for item in confirm_margins(asked) if item.kind == "gain up")
    assert up.border.value == pytest.approx(2.9846, rel=1e-3)  # what runs in time show
    assert up.predicted == pytest.approx(up.border.value, rel=3e-4)
