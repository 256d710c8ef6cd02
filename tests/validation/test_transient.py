"""A loop that is slow against its tick is measured by one long step; closed forms and random drives."""

from __future__ import annotations

import numpy as np
import pytest

from actuator_lti import assemble_loops
from actuator_lti.design.model import (
    Controller,
    CurrentLoop,
    Design,
    Encoder,
    Friction,
    Limits,
    Load,
    Motor,
    PositionLoop,
    Validation,
    VelocityLoop,
)
from analyses.loop_figures import loop_figures
from analyses.validation.commanded import command_step, command_sweep
from analyses.validation.figures import measure_figures
from analyses.validation.from_rest import rest_entries, steps_from_rest
from analyses.validation.response import linear_response
from analyses.validation.sweep import SETTLE_TIME_CONSTANTS, settling_ticks_of, stepped_sine
from analyses.validation.tolerance import allowed
from analyses.validation.transient import fourier_sum, is_slow, long_enough, transient_of
from analyses.validation.validate import _Work
from nonlinear.loop_setup import loop_setup
from tests.validation.random_drives import TRIAL, full_drive

TICK_S, GAIN, SOURCE, INERTIA = 1e-4, 0.02, 0.5, 0.05
SLOW = GAIN * SOURCE * TICK_S / INERTIA  # of the way to its target in one tick


def turntable(position: float | None = None, stiffness: float = 0.0, gain: float = GAIN) -> Design:
    """An inertia on an ideal torque source: a speed drive, or with a position loop over it."""
    return Design(
        name="turntable",
        title="Turntable",
        motor=Motor(rotor_inertia_kgm2=INERTIA, source_gain_Nm_V=SOURCE),
        load=Load(path="back-drivable", moment_slope_Nm_rad=-stiffness),
        controller=Controller(
            period_s=TICK_S,
            computing_delay_s=0.0,
            position=None if position is None else PositionLoop(gain=position),
            velocity=VelocityLoop(gain=gain, integral_time_s=None),
            current=None,
        ),
        limits=Limits(voltage_V=100.0),
        friction=Friction(),
        validation=Validation(full_deflection_rad=0.1),
    )


def wheel() -> Design:
    """A heavy wheel on a slow speed loop that differences its encoder."""
    return Design(
        name="wheel",
        title="Reaction wheel",
        motor=Motor(
            rotor_inertia_kgm2=9.0,
            resistance_ohm=1.1,
            inductance_H=0.45e-3,
            torque_constant_Nm_A=0.024,
            back_emf_constant_Vs_rad=0.024,
        ),
        encoder=Encoder(speed="difference", difference_samples=8, filter_time_s=5e-3),
        controller=Controller(
            period_s=25e-6,
            computing_delay_s=25e-6,
            velocity=VelocityLoop(gain=60.0, integral_time_s=20.0, every=10, anti_windup="clamped"),
            current=CurrentLoop(gain_V_A=0.9, integral_time_s=0.5e-3),
        ),
        limits=Limits(voltage_V=28.0, speed_rad_s=628.0, peak_current_A=3.0, continuous_current_A=2.0),
        friction=Friction(dry_torque_Nm=1.5e-3, viscous_Nms_rad=6e-6),
        validation=Validation(full_deflection_rad=6.0),
    )


def test_the_fourier_sum_of_a_decaying_step_is_its_closed_form() -> None:
    """y_k = 1 - r^k: T(z) = (1 - r)/(z - r)."""
    r, period_s, hertz = 1.0 - 3e-4, 1e-3, np.array([1e-3, 0.05, 3.0, 170.0, 499.0])
    y = 1.0 - r ** np.arange(70_001)
    z = np.exp(2j * np.pi * hertz * period_s)
    np.testing.assert_allclose(fourier_sum(y, hertz, period_s), (1.0 - r) / (z - r), rtol=1e-8)


def test_a_slow_loop_is_its_closed_form() -> None:
    """w' = w + a (r - w) in every tick: T = a/(z - 1 + a), crossover and -3 dB at about a/T."""
    setup = loop_setup(turntable(), "velocity")
    tau = 1.0 / SLOW
    assert is_slow(np.array([1.0]), TICK_S, 1, int(14.0 * tau))
    transient = transient_of(setup, tau)
    assert transient is not None
    assert transient.settled
    hertz = np.geomspace(1e-3, 4900.0, 30)
    sweep = transient.sweep(hertz)
    z = np.exp(2j * np.pi * hertz * TICK_S)
    T = SLOW / (z - 1.0 + SLOW)
    own = transient.errors(sweep)
    for name, closed_form in (("closed_loop", T), ("sensitivity", 1.0 - T), ("open_loop", T / (1.0 - T))):
        off = np.abs(getattr(sweep, name) / closed_form - 1.0)
        assert (off <= allowed(own[name], 1.0)).all(), name
        assert off[hertz < 10.0].max() < 1e-6, name
        assert off.max() < 1e-4, name  # T is 7e-6 there: what is left is rounding
    measured = measure_figures(setup, sweep, 1, 1, tau, transient)
    falls = SLOW / np.sqrt(1.0 - SLOW) / (2.0 * np.pi * TICK_S)  # |T|^2 = 1/2, to the order of a^2
    assert measured.bandwidth.value == pytest.approx(falls, rel=1e-6)
    assert measured.bandwidth.error < 1e-5 * falls
    assert measured.step.rise_time_s == pytest.approx(np.log(9.0) / -np.log1p(-SLOW) * TICK_S, rel=1e-4)


def test_a_wrong_slow_loop_is_seen() -> None:
    """A pole off by a thousandth lies far outside the error that the measurement states."""
    transient = transient_of(loop_setup(turntable(), "velocity"), 1.0 / SLOW)
    assert transient is not None
    sweep = transient.sweep(np.geomspace(0.01, 1000.0, 20))
    z = np.exp(2j * np.pi * sweep.frequency_hz * TICK_S)
    wrong = 1.001 * SLOW / (z - 1.0 + 1.001 * SLOW)
    off = np.abs(sweep.open_loop / (wrong / (1.0 - wrong)) - 1.0)
    assert (off > 5.0 * allowed(transient.errors(sweep)["open_loop"], 1.0)).all()


def test_a_step_that_would_take_too_long_is_not_run() -> None:
    assert long_enough(1e6, 1) is None
    assert long_enough(1e4, 1) == 200_040
    assert long_enough(2.5e5, 1) == 4_000_000  # 16 time constants


@pytest.mark.parametrize("seed", [3018, 3099])
def test_a_swinging_transient_does_not_spoil_the_response_to_the_command(seed: int) -> None:
    """3018: a mode of 24 000 ticks that swings at 0.05 Hz hid from two windows of 2000 ticks."""
    work = _Work(full_drive(seed), TRIAL, None, full_drive(seed))
    work.loops = work._assemble()
    sweep = work._answer()
    assert sweep is not None
    assert sweep.error is not None
    linear = linear_response(work.answer_loops.reference_to_output, sweep.frequency_hz)
    off = np.abs(sweep.closed_loop / linear - 1.0)
    assert off[np.abs(linear) > 1e-3].max() < 1e-7
    assert (off <= allowed(sweep.error, 1.0)).all()  # 3099: 1e-11 at 1.4 kHz is all rounding, and says so


def test_sines_and_a_step_give_the_closed_form_of_the_response_to_the_command() -> None:
    """In a tick w' = w + a (r - w), th' = th + T (w + w')/2; r = Kv (ref - th)."""
    Kv, fast = 0.4, 10.0 * GAIN
    design, a = turntable(position=Kv, gain=fast), 10.0 * SLOW
    sines = command_sweep(design, np.array([0.01, 0.05, 0.4]), 300_000)
    step = command_step(design, sines.frequency_hz, 2e4)
    assert step is not None
    z = np.exp(2j * np.pi * sines.frequency_hz * TICK_S)
    L = Kv * TICK_S * a * (z + 1.0) / (2.0 * (z - 1.0 + a) * (z - 1.0))
    np.testing.assert_allclose(sines.closed_loop, L / (1.0 + L), rtol=1e-6)
    np.testing.assert_allclose(step.closed_loop, L / (1.0 + L), rtol=1e-6)


def test_a_narrow_peak_is_measured_on_a_finer_grid() -> None:
    """Seed 3027: S peaks between two frequencies that 400 samples hold; 7.3e-4 dB were missing."""
    design = full_drive(3027)
    work = _Work(design, TRIAL, None, design)
    work.loops = work._assemble()
    loop = work._loop("velocity", work.loops.present["velocity"], 1.0)
    assert loop.measured is not None
    assert loop.figures.peaks is not None
    off = (loop.measured.sensitivity_peak.value or 0.0) - loop.figures.peaks.sensitivity_db
    assert abs(off) < 1e-5
    hertz = loop.measured.sweep.frequency_hz
    assert len(set(hertz.tolist())) > 0.9 * hertz.size  # no frequency is measured again and again


@pytest.mark.parametrize("stiffness", [0.0, 20.0])
def test_a_step_from_rest_is_measured_by_its_final_value(stiffness: float) -> None:
    """Seed 3012: against a load spring a P loop ends below its target, at K Kp k/(K Kp k + c)."""
    design = turntable(position=8.0, stiffness=stiffness, gain=20.0)
    gain = 8.0 * 20.0 * SOURCE
    loops = assemble_loops(design)
    figures = loop_figures(loops.present["position"], loops.reference_to_output)
    settle = settling_ticks_of(loops.present["position"].closed_loop, 1, "turntable")
    steps = steps_from_rest(design, settle, settle / SETTLE_TIME_CONSTANTS)
    np.testing.assert_allclose(steps.final_ratio, gain / (gain + stiffness), rtol=1e-4)
    rows = rest_entries(design, figures, steps, None)
    assert {row.passed for row in rows} == {True}
    assert rows[0].measured == pytest.approx(figures.step.rise_time_s, abs=TICK_S)


def test_the_transient_is_that_of_the_running_drive() -> None:
    """Sines at the same rig give the same points, within the error that both state."""
    setup = loop_setup(turntable(), "velocity")
    transient = transient_of(setup, 1.0 / SLOW)
    sines = stepped_sine(setup, np.array([0.3, 3.0]), int(14.0 / SLOW))
    assert transient is not None
    again = transient.sweep(sines.frequency_hz)
    np.testing.assert_allclose(again.closed_loop, sines.closed_loop, rtol=2e-5)


def test_a_coupling_that_comes_free_between_two_ticks_is_seen() -> None:
    """Seed 40004 at 598 Hz: pressed at every tick, and free in between; the response was off by 0.5 %."""
    design = full_drive(40004)
    work = _Work(design, TRIAL, None, design)
    work.loops = work._assemble()
    sweep = work._answer()
    assert sweep is not None
    k = int(np.argmin(np.abs(sweep.frequency_hz - 598.0)))
    assert sweep.amplitude[k] < 0.1 * sweep.amplitude[0]  # a smaller one, that leaves the coupling pressed
    linear = linear_response(work.answer_loops.reference_to_output, sweep.frequency_hz)
    np.testing.assert_allclose(sweep.closed_loop, linear, rtol=1e-5)


def test_a_slow_loop_with_a_speed_of_angles_is_measured_at_rest() -> None:
    """A wheel of 9 kg m2: on a constant speed the last bit of the angle made the response 460 % off."""
    design = wheel()
    work = _Work(design, TRIAL, None, design)
    work.loops = work._assemble()
    loop = work._loop("velocity", work.loops.present["velocity"], 1.0)
    assert loop.measured is not None
    assert work.rigs["velocity"].bias.speed_rad_s == 0.0
    measured, linear = loop.measured.sweep.closed_loop, loop.closed_loop
    assert np.abs(measured / linear - 1.0)[np.abs(linear) > 1e-3].max() < 1e-5
    assert loop.measured.minus90deg.value == pytest.approx(loop.figures.bandwidth.minus90deg_hz, rel=1e-5)
