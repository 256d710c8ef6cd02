"""Duty cycle: closed forms of current and temperature, and the overload state of the running drive."""

from dataclasses import replace
from math import exp, inf, pi, sin

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuator_lti.design import load_design, with_overrides
from actuator_lti.errors import InputError
from analyses.duty import Asked, duty
from analyses.duty.run import heating
from nonlinear import Drive
from reports.drawing import draw_svg
from reports.sections.duty import section
from tests.changed import changed

AMBER, FIN, JOINT = (load_design(name) for name in ("ilr33-amber", "fin", "joint"))

HOT = {"thermal_resistance": "2 K/W", "thermal_time": "60 s", "winding_limit": "125 degC"}
HOT = {f"temperature.{key}": value for key, value in HOT.items()}


def test_rms_current_of_a_slow_sine_is_friction_and_inertia() -> None:
    """kM i = Tc sgn(w) + Cv w + J dw/dt of the motion itself, the drive following (rigid, no load path)."""
    design = AMBER
    A, f, M = 0.02, 1.0, 4.0
    result = duty(design, Asked.of(design, amplitude_rad=A, frequency_hz=f, load_Nm=M))
    t = np.linspace(0.0, 1.0, 20001)
    w = A * design.total_ratio * 2 * pi * f * np.cos(2 * pi * f * t)
    dw = -A * design.total_ratio * (2 * pi * f) ** 2 * np.sin(2 * pi * f * t)
    dry = design.friction.dry_torque_Nm + design.friction.load_coefficient * M
    torque = dry * np.sign(w) + design.friction.viscous_Nms_rad * w + design.inertia_kgm2 * dw
    assert result.rms_A == pytest.approx(np.sqrt(np.mean(torque**2)) / 5.9e-3, rel=0.02)
    assert result.verdict == ("met" if result.rms_A <= 4.0 else "not met")


def test_the_peak_is_that_of_the_motion_repeated_without_its_start() -> None:
    """A symmetric drive: turned about, the load asks the same; the start, against it or with it, does not."""
    design = load_design("ballscrew")
    there, back = (duty(design, Asked.of(design, load_Nm=load)) for load in (300.0, -300.0))
    assert there.peak_A == pytest.approx(back.peak_A, rel=1e-3)
    assert there.peak_A == np.abs(there.current_A).max()


def test_without_any_rating_nothing_is_proven() -> None:
    assert duty(FIN).verdict == "not proven"


def test_motion_and_rest_add_by_their_squares() -> None:
    result = duty(JOINT, Asked.of(JOINT, share=0.25, cycle_s=8.0, load_Nm=30.0))
    squares = 0.25 * result.moving_rms_A**2 + 0.75 * result.holding_A**2
    assert result.rms_A**2 == pytest.approx(squares, rel=1e-12)
    assert result.holding_A > 0.0


def test_the_overload_state_is_that_of_the_running_drive() -> None:
    """A short protection, so that a few seconds settle it: the largest state of the last period."""
    design = with_overrides(JOINT, {"limits.peak_time": "50 ms"})
    asked = Asked.of(design, amplitude_rad=0.3, frequency_hz=2.0, load_Nm=30.0)
    result = duty(design, asked)
    assert result.overload.acts_after_s is None
    drive, states = Drive(design, load_Nm=30.0), []
    Ts, ticks = design.controller.period_s, len(result.time_s)
    for k in range(8 * ticks):
        drive.step(0.3 * sin(2 * pi * k / ticks))
        states.append(drive.value("overload"))
    assert Ts * ticks == pytest.approx(0.5)
    assert result.overload.peak == pytest.approx(max(states[-ticks:]), rel=1e-3)


def test_the_protection_acts_when_the_running_drive_says() -> None:
    design = with_overrides(JOINT, {"limits.peak_time": "1 s"})
    asked = Asked.of(design, amplitude_rad=0.4, frequency_hz=2.0, load_Nm=60.0)
    result = duty(design, asked)
    assert result.verdict == "not met"
    drive, k, ticks = Drive(design, load_Nm=60.0), 0, len(result.time_s)
    while drive.value("overloaded") == 0.0 and k < 100 * ticks:
        drive.step(0.4 * sin(2 * pi * k / ticks))
        k += 1
    assert result.overload.acts_after_s == pytest.approx(k * design.controller.period_s, abs=1.01 * 0.5)


@pytest.mark.parametrize("rms", [1.0, 6.0, 11.0, 13.0])
def test_temperature_against_its_equation(rms: float) -> None:
    """tau dT/dt = Ta - T + Rth R I^2 (1 + alpha (T - Tref)), by an integrator; at 13 A it runs away."""
    result, P = heating(with_overrides(FIN, HOT), rms), 2.0 * 1.0 * rms**2
    course = solve_ivp(
        lambda _, T: (25.0 - T + P * (1 + 0.00393 * (T - 25.0))) / 60.0, (0.0, result.time_s[-1]), [25.0],
        t_eval=result.time_s, rtol=1e-10, atol=1e-9,
    )  # fmt: skip
    assert result.temperature_degC == pytest.approx(course.y[0], rel=1e-7)
    if P * 0.00393 >= 1.0:
        assert result.final_degC == inf
    else:
        assert result.final_degC == pytest.approx(25.0 + P / (1.0 - 0.00393 * P), rel=1e-12)
    if result.limit_after_s is not None:
        reached = np.interp(result.limit_after_s, result.time_s, result.temperature_degC)
        assert reached == pytest.approx(125.0, rel=5e-3)
    assert (result.limit_after_s is None) == (result.final_degC <= 125.0)


def test_without_heat_of_its_own_the_rise_is_an_exponential() -> None:
    design = with_overrides(FIN, {**HOT, "temperature.resistance_coefficient": "0 1/K"})
    result, k = heating(design, 5.0), 100
    assert result.temperature_degC[k] == pytest.approx(25.0 + 50.0 * (1.0 - exp(-result.time_s[k] / 60.0)))


def test_section_figure_and_command(cli) -> None:
    made = section(duty(with_overrides(FIN, HOT)))
    (figure,) = [block for block in made["blocks"] if block["kind"] == "figure"]
    assert "Winding" in draw_svg(figure, page=False)
    told = cli.data("duty", "joint", "--amplitude", "10 deg", "--load", "20")
    assert told["rms_A"] < told["continuous_A"] == 6.0
    assert "--share 0: allowed: above 0, at most 1" in cli.refused("duty", "joint", "--share", "0")
    assert "Hz: at least" in cli.refused("duty", "joint", "--frequency", "1e-320")
    with pytest.raises(InputError, match="no current"):
        duty(load_design("emps"))
    with pytest.raises(InputError, match="position loop"):
        duty(changed(JOINT, controller={"position": None}))


def test_a_duty_that_the_drive_cannot_follow_is_said_with_its_rating() -> None:
    """1 rad at 20 Hz is far beyond 22.7 deg/s: the current may do, the motion is not the one asked for."""
    asked = Asked.of(AMBER, amplitude_rad=0.02, frequency_hz=1.0, load_Nm=0.0)
    assert "not followed" not in section(duty(AMBER, asked))["result"]
    made = section(duty(AMBER, replace(asked, amplitude_rad=1.0, frequency_hz=20.0)))
    assert "it is not followed as asked, limited by" in made["result"]
    assert made["status"] == "warn"
    slow = with_overrides(AMBER, {"command.rate": "7 deg/s"})  # 0.02 rad at 1 Hz are 7.2 deg/s
    assert duty(slow, asked).limited == ("profile",)
    assert duty(with_overrides(AMBER, {"command.rate": "8 deg/s"}), asked).limited == ()


def test_the_current_of_an_ac_motor_is_told_in_the_model_s_amperes(cli) -> None:
    first, *rest = cli.text("duty", "ballscrew").splitlines()
    assert " A dc, rms over time, limit " in first
    assert any("current, rms over time" in line and " A dc " in line for line in rest)
    assert f"1 A rms is {1.5**0.5:.4g} A dc." in " ".join(rest)
    assert " A dc" not in cli.text("duty", "joint")
