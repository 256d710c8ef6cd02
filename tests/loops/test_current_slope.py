"""The slope limit of the current command: closed forms of the linear and of the running drive."""

from dataclasses import replace
from math import inf, pi, sin

import numpy as np
import pytest
from loop_designs import amber

from actuator_lti import InputError, assemble_loops, load_design
from actuator_lti.design.model import Design, Friction, Limits
from nonlinear import Drive, commands, simulate


def heavy(n_v: int, rate_A_s: float) -> Design:
    """A speed drive with P control whose load hardly moves: i_ref is Kp times the speed command."""
    design = amber(n_v)
    control = design.controller
    velocity = replace(control.velocity, integral_time_s=None, every=n_v)
    return replace(
        design,
        motor=replace(design.motor, rotor_inertia_kgm2=1e9),
        friction=Friction(),
        limits=Limits(voltage_V=1e9, current_rate_A_s=rate_A_s),
        controller=replace(control, position=None, velocity=velocity),
    )


@pytest.mark.parametrize("n_v", [1, 3])
def test_onset_is_that_of_the_difference_of_a_sine(n_v: int) -> None:
    """Of A sin(w t) sampled every T the change is at most 2 A sin(w T/2): A = r T/(2 Kp N sin(w T/2))."""
    design = heavy(n_v, 150.0)
    velocity, T = design.controller.velocity, n_v * design.controller.period_s
    path = assemble_loops(design).limiters["current-rate"]
    assert (path.limit, path.unit) == (150.0, "A/s")
    for w in (20.0, 700.0, 0.9 * pi / T):
        expected = 150.0 * T / (2.0 * velocity.gain * sin(w * T / 2.0))
        assert path.onset_amplitude_rad(w)[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("hertz", [7.3, 61.7])
def test_multirate_onset_divides_the_runs(hertz: float) -> None:
    """Three velocity updates in a position update: 1 % below the border nothing acts, 1 % above it does."""
    design = amber(2, 6)
    design = replace(
        design, friction=Friction(viscous_Nms_rad=5e-6), limits=Limits(voltage_V=1e9, current_rate_A_s=1e3)
    )
    border = float(assemble_loops(design).limiters["current-rate"].onset_amplitude_rad(2 * pi * hertz)[0])
    for factor, acts in ((0.99, False), (1.01, True)):
        run = simulate(design, commands.sine(factor * border, hertz), 1.2)
        assert run.limit_active("current-rate")[run.time_s > 0.8].any() == acts


def test_a_torque_drive_ramps() -> None:
    """A step of 5 A at 2 A/ms and Ts = 0.1 ms: 0.2 A a tick, 25 ticks, of which the last needs no limit."""
    base = load_design("ilr33-amber")
    control = replace(base.controller, position=None, velocity=None)
    design = replace(base, controller=control, limits=Limits(voltage_V=1e6, current_rate_A_s=2000.0))
    run = simulate(design, commands.step(5.0), 40 * control.period_s)
    step = 2000.0 * control.period_s
    expected = np.minimum(5.0, step * np.arange(1, run.time_s.size + 1))
    assert np.allclose(run.current_command_A, expected, rtol=0, atol=1e-12)
    acting = run.limit_active("current-rate")
    assert acting[:24].all()
    assert not acting[26:].any()
    assert run.limits["current-rate"].limit == 2000.0
    assert run.limits["current-rate"].unit == "A/s"
    assert (
        "current-rate"
        not in simulate(replace(design, limits=Limits(voltage_V=1e6)), commands.step(1.0), 0.01).limits
    )


def test_the_integral_of_a_position_controller_waits() -> None:
    """PI of position straight on the current: behind the slope limit out is not v, so I is kept."""
    base = load_design("ilr33-amber")
    loop = replace(base.controller.position_loop, gain=0.1, every=1, integral_time_s=1e-3)
    design = replace(
        base,
        controller=replace(base.controller, velocity=None, position=loop),
        limits=Limits(voltage_V=1e6, current_rate_A_s=1.0),
    )
    drive = Drive(design)
    for k in range(1, 4):
        drive.control(1.0, 0.0, 0.0, 0.0)
        assert drive.value("position_integrator") == 0.0
        assert drive.value("current_reference") == pytest.approx(1e-4 * k, rel=1e-12)


def test_key() -> None:
    design = load_design("ilr33-amber").with_values({"limits.current_rate": "2 A/ms"})
    assert design.limits.current_rate_A_s == pytest.approx(2000.0)
    assert "current-rate" not in assemble_loops(load_design("ilr33-amber")).limiters
    assert Limits(voltage_V=1.0).current_rate_A_s == inf
    with pytest.raises(InputError, match=r"limits\.current_rate"):
        design.with_values({"limits.current_rate": "0 A/s"})
