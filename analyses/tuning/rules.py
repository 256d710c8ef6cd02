"""Closed-form gains that drive engineers start from, from the inner loop out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from actuator_lti.design.model import Design
from actuator_lti.drive.steady import own_drag_Nms_rad, standing_gain

WIDE = 2.0 + 3.0**0.5  # a of the symmetric optimum for a phase margin of 60 deg
SEPARATION = 4.0  # crossover of the velocity loop over the gain of the position loop


def magnitude_optimum(gain: float, time_constant_s: float, small_time_s: float) -> tuple[float, float]:
    """PI (gain, integral time) for ``gain/(1 + s T1)`` behind small delays of T_sigma in sum.

    The zero cancels T1 and the loop becomes ``1/(2 T_sigma s (1 + s T_sigma))``: damping 0.707, overshoot
    4.3 %. Kessler 1958 (Betragsoptimum).

    Examples
    --------
    A winding of 0.055 ohm, 6 uH; one and a half ticks of 100 us:

    >>> kp, tn = magnitude_optimum(1 / 0.055, 6e-6 / 0.055, 1.5e-4)
    >>> round(1e3 * kp, 6), round(1e6 * tn, 2)
    (20.0, 109.09)
    """
    return time_constant_s / (2.0 * gain * small_time_s), time_constant_s


def symmetric_optimum(integrator_gain: float, small_time_s: float, a: float = 2.0) -> tuple[float, float]:
    """PI (gain, integral time) for ``k/s`` behind a small time constant T_sigma.

    Crossover at 1/(a T_sigma) where the phase is highest, Tn = a^2 T_sigma; a = 2 is the usual choice.
    Phase margin ``arctan(a) - arctan(1/a)``: 36.9 deg for a = 2, 60 deg for 2 + sqrt(3). Kessler 1958.

    Examples
    --------
    >>> symmetric_optimum(10.0, 0.001)
    (50.0, 0.004)
    """
    return 1.0 / (a * integrator_gain * small_time_s), a * a * small_time_s


@dataclass(frozen=True)
class RuleGains:
    """Gains by rules, and how they were found."""

    values: Mapping[str, float]  # SI by dotted key
    steps: tuple[str, ...]  # one line a loop


def rule_gains(design: Design) -> RuleGains:
    """Start gains of every loop that a design has.

    Current: magnitude optimum with T_sigma = d + T/2. Velocity: symmetric optimum for 60 deg, with the
    current loop as a lag 2 T_sigma, its own hold, and what the speed measurement costs. Position: the
    velocity loop's crossover over `SEPARATION`. Where a stage is missing, the next one takes its place.
    """
    values: dict[str, float] = {}
    steps: list[str] = []
    small = design.controller.computing_delay_s + 0.5 * design.controller.period_s
    torque = standing_gain(design)
    if design.controller.current is not None:
        small = _current(design, small, values, steps)
    if design.controller.velocity is not None:
        crossover = _velocity(design, small, torque, values, steps)
        if design.controller.position is not None:
            values["control.position.gain"] = crossover / SEPARATION
            steps.append(f"position: velocity crossover {crossover:.4g} rad/s over {SEPARATION:g}")
    elif design.controller.position is not None:
        values["control.position.gain"] = _direct(design, small, torque)
        steps.append("position: no velocity loop; crossover of the drive at a tenth of 1/T_sigma or below")
    own = design.controller.own_law
    if own is not None:  # a law of one's own stays as it is; the others are tuned around it
        values = {path: value for path, value in values.items() if not path.startswith(f"control.{own[0]}.")}
        steps = [step for step in steps if not step.startswith(own[0])]
        steps.append(f"{own[0]}: a law of one's own, left as it is")
    return RuleGains(values, tuple(steps))


def _current(design: Design, small: float, values: dict[str, float], steps: list[str]) -> float:
    """Magnitude optimum; returns the lag that the closed loop is to the next one."""
    motor, loop = design.effective_motor, design.controller.current
    assert loop is not None
    assert motor.resistance_ohm is not None
    assert motor.inductance_H is not None
    gain, time = magnitude_optimum(
        1.0 / motor.resistance_ohm, motor.inductance_H / motor.resistance_ohm, small
    )
    values["control.current.gain"] = gain
    if loop.integral_time_s is not None:
        values["control.current.integral_time"] = time
    steps.append(f"current: magnitude optimum, T_sigma {small * 1e6:.4g} us")
    return 2.0 * small


def _velocity(design: Design, lag: float, torque: float, values: dict[str, float], steps: list[str]) -> float:
    """Symmetric optimum; returns the crossover."""
    loop, encoder = design.controller.velocity, design.encoder
    assert loop is not None
    period = loop.every * design.controller.period_s
    inner = design.controller.period_s if design.controller.current is not None else 0.0
    small = lag + max(0.5 * (period - inner), 0.0) + encoder.filter_time_s
    if encoder.speed == "difference":
        small += 0.5 * encoder.difference_samples * period
    gain, time = symmetric_optimum(torque / design.inertia_kgm2, small, WIDE)
    values["control.velocity.gain"] = gain
    if loop.integral_time_s is not None:
        values["control.velocity.integral_time"] = time
    steps.append(f"velocity: symmetric optimum for 60 deg, T_sigma {small * 1e6:.4g} us")
    return 1.0 / (WIDE * small)


def _direct(design: Design, small: float, torque: float) -> float:
    """Position gain where nothing lies between: |drive| = 1 at a tenth of 1/T_sigma or at its corner."""
    corner = own_drag_Nms_rad(design) / design.inertia_kgm2
    omega = min(0.1 / small, corner) if corner > 0.0 else 0.1 / small
    response = torque / (design.inertia_kgm2 * abs(complex(corner, omega)) * omega)
    return 1.0 / response
