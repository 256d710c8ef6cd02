"""Drives that are slow, or fed softly: what the validator measures there is still what it says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Supply
from analyses.large_signal.border import check_border
from analyses.validation.bench import on_the_bench
from analyses.validation.figures import point_errors
from analyses.validation.response import linear_response
from analyses.validation.rig import rig
from analyses.validation.sweep import settling_ticks_of, stepped_sine
from analyses.validation.tolerance import allowed
from tests.validation.random_drives import full_drive


def test_a_slow_transient_is_waited_for() -> None:
    """Modes of 2400 and 6300 ticks against each other: after 20 000 ticks two windows hide them."""
    design = on_the_bench(full_drive(412))
    loop = assemble_loops(design).present["velocity"]
    setup = rig(design, "velocity")
    settle = settling_ticks_of(loop.closed_loop, setup.hold_ticks, design.name)
    assert settle > 80_000
    sweep = stepped_sine(setup, np.array([20.0, 83.0, 300.0]), settle)
    off = np.abs(sweep.open_loop / linear_response(loop.open_loop, sweep.frequency_hz) - 1.0)
    assert (off < allowed(point_errors(setup, sweep, settle, settle / 14.0), 1.0)).all()
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
