"""Drives that are slow, or fed softly: what the validator measures there is still what it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.design.model import (
    Controller,
    CurrentLoop,
    Design,
    Friction,
    Gear,
    Gravity,
    Limits,
    Load,
    Motor,
    PositionLoop,
    Supply,
    Validation,
    VelocityLoop,
)
from analyses.large_signal.border import check_border
from analyses.loop_figures import loop_figures
from analyses.validation.confirm import confirm_margins, stage_questions
from analyses.validation.figures import point_errors
from analyses.validation.response import linear_response
from analyses.validation.sweep import settling_ticks_of, stepped_sine
from analyses.validation.tolerance import allowed
from nonlinear.loop_setup import loop_setup, standing_setup
from nonlinear.on_the_bench import on_the_bench
from reports.sections.margins import margin_row
from tests.validation.random_drives import full_drive


def test_a_slow_transient_is_waited_for() -> None:
    """Modes of 2400 and 6300 ticks against each other: after 20 000 ticks two windows hide them."""
    design = on_the_bench(full_drive(412))
    loop = assemble_loops(design).present["velocity"]
    setup = loop_setup(design, "velocity")
    settle = settling_ticks_of(loop.closed_loop, setup.hold_ticks, design.name)
    assert settle > 80_000
    sweep = stepped_sine(setup, np.array([20.0, 83.0, 300.0]), settle)
    off = np.abs(sweep.open_loop / linear_response(loop.open_loop, sweep.frequency_hz) - 1.0)
    assert (off < allowed(point_errors(setup, sweep, settle / 14.0), 1.0)).all()
    assert off.max() < 1e-6


def test_the_border_is_that_of_a_stiff_supply() -> None:
    """A supply of a tenth of the winding's resistance sags: the voltage limit is not the linear loop's."""
    design = load_design("ilr33-amber")
    loose = replace(design.limits, voltage_V=3.0, speed_rad_s=1e5, acceleration_rad_s2=1e9)
    design = replace(design, limits=replace(loose, peak_current_A=1e3))
    soft = Supply(resistance_ohm=0.1 * (design.motor.resistance_ohm or 0.0))
    found = [
        check_border(one, assemble_loops(one), count=4) for one in (design, replace(design, supply=soft))
    ]
    assert all(one is not None and one.passed for one in found)
    np.testing.assert_array_equal(found[0].simulated_rad, found[1].simulated_rad)


def test_the_border_is_that_of_limits_that_act_at_once() -> None:
    """I2t acts where the mean square passes the continuous current, after many of its time constants."""
    design = load_design("ilr33-amber")
    limits = replace(design.limits, speed_rad_s=1e5, acceleration_rad_s2=1e9, voltage_V=200.0)
    plain = replace(design, limits=replace(limits, peak_current_A=12.0, continuous_current_A=4.0))
    guarded = replace(plain, limits=replace(plain.limits, peak_time_s=1.0))
    assert "overload" in assemble_loops(guarded).limiters
    found = [check_border(one, assemble_loops(one), count=4) for one in (plain, guarded)]
    assert all(one is not None and one.passed for one in found)
    np.testing.assert_array_equal(found[0].predicted_rad, found[1].predicted_rad)
    np.testing.assert_array_equal(found[0].simulated_rad, found[1].simulated_rad)


def test_a_protection_that_only_the_fast_tones_outrun_is_left_out_too() -> None:
    """I2t of 5 s, tones from 0.01 to 4 Hz: fast against the lowest, slow against the highest."""
    design = full_drive(2003)
    found = check_border(design, assemble_loops(design), count=5)
    assert found is not None
    assert found.left_out == "overload protection"
    assert found.passed


def test_an_integral_that_is_clamped_before_its_controller_s_output() -> None:
    """Proportional part against the integral: the clamp acts before the limit, and the border is its own."""
    design = full_drive(2026)
    velocity = design.controller.velocity
    assert velocity is not None
    assert velocity.anti_windup == "clamped"
    found = check_border(design, assemble_loops(design))
    assert found is not None
    assert found.passed
    assert "clamp" not in found.left_out


def arm() -> Design:
    """A motor of 28 mN m/A behind 100:1 lifts 2 kg on 0.25 m, upright: gravity pushes it away."""
    return Design(
        name="arm",
        title="An arm held upright",
        motor=Motor(
            resistance_ohm=0.386,
            inductance_H=65.3e-6,
            torque_constant_Nm_A=27.6e-3,
            back_emf_constant_Vs_rad=27.6e-3,
            rotor_inertia_kgm2=36.3e-7,
        ),
        gears=(Gear(name="strain-wave", ratio=100.0),),
        load=Load(
            inertia_kgm2=0.25, path="back-drivable", gravity=Gravity(mass_kg=2.0, arm_m=0.25, offset_rad=0.0)
        ),
        axis="rotary",
        controller=Controller(
            period_s=1e-4,
            computing_delay_s=1e-4,
            position=PositionLoop(gain=25.0, every=10),
            velocity=VelocityLoop(gain=0.09, integral_time_s=0.02, every=5),
            current=CurrentLoop(gain_V_A=0.15, integral_time_s=170e-6),
        ),
        limits=Limits(voltage_V=36.0, peak_current_A=15.0),
        friction=Friction(viscous_Nms_rad=4e-5),
        validation=Validation(full_deflection_rad=1.0),
    )


def test_an_arm_that_swings_slowly_on_its_way_to_the_border() -> None:
    """It drifts away below g = c Tn/(N^2 Kp kM), c = m g l, and swings slower than any loop above that."""
    design = arm()
    setup = standing_setup(design, "velocity")
    loop = assemble_loops(design).present["velocity"]
    settle = settling_ticks_of(loop.closed_loop, setup.hold_ticks, design.name)
    questions = stage_questions(setup, loop, stability_margins(loop.open_loop), settle)
    (down,) = confirm_margins([one for one in questions if one.kind == "gain down"])
    by_hand = 2.0 * 9.80665 * 0.25 * 0.02 / (100.0**2 * 0.09 * 27.6e-3)
    assert down.predicted == pytest.approx(by_hand, rel=1e-6)
    assert down.border.value == pytest.approx(by_hand, rel=5e-4)
    assert down.passed


def test_an_unstable_loop_shows_no_margins() -> None:
    """A gain at which the loop would be stable is a crossing, no margin."""
    design = arm()
    control = design.controller
    loud = replace(control, velocity=replace(control.velocity, gain=9.0))
    loops = assemble_loops(replace(design, controller=loud))
    row = margin_row(loop_figures(loops.present["velocity"]))
    assert row["stable"]["text"] == "unstable"
    shown = {name: value for name, value in row.items() if name not in ("stable", "evidence")}
    assert all(value is None for value in shown.values())
    quiet = assemble_loops(design).present["velocity"]
    assert margin_row(loop_figures(quiet))["gain_margin_db"] is not None
