"""Where tuning begins, and what it may set.

Closed-form gains that drive engineers start from, from the inner loop out; gains as the motion controller's
objects hold them; and elements that may be added. A notch, a low-pass, feed-forward of a velocity loop are
neutral until they are needed: a notch of depth 1, a low-pass at the end of the band, no feed-forward. The
distance from there is what they cost, in the same measure as a gain (`change`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, floor, inf, pi, sqrt
from typing import Literal, get_args

import numpy as np

from actuator_lti.design.model import Design, Filter
from actuator_lti.design.object_dictionary import OBJECTS, KnownObject, step_of
from actuator_lti.drive.facts import resonance_rad_s
from actuator_lti.drive.steady import own_drag_Nms_rad, standing_gain
from actuator_lti.errors import InputError

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


def object_of(design: Design, path: str) -> KnownObject | None:
    """The object that holds a gain; None where the drive is not that motion controller."""
    if not design.objects.named:
        return None
    return next((known for known in OBJECTS.values() if path in known.paths), None)


def step_of_gain(design: Design, path: str) -> float | None:
    """SI value of one step of the object that holds a gain."""
    known = object_of(design, path)
    return None if known is None else step_of(known, design.objects.velocity_gain_factor)


def allowed_range(design: Design, path: str) -> tuple[float, float]:
    """Smallest and largest SI value of a gain that its object can hold."""
    known, step = object_of(design, path), step_of_gain(design, path)
    return (0.0, inf) if known is None or step is None else (max(known.low, 1) * step, known.high * step)


def neighbours(design: Design, paths: tuple[str, ...], gains: np.ndarray) -> np.ndarray:
    """All roundings of gains to the steps of their objects, up and down, shape (roundings, gains).

    A gain without an object stays as it is.
    """
    choices = []
    for path, value in zip(paths, gains, strict=True):
        step = step_of_gain(design, path)
        if step is None:
            choices.append((float(value),))
            continue
        low, high = allowed_range(design, path)
        around = {floor(value / step), ceil(value / step)}
        inside = sorted(n * step for n in around if low * (1 - 1e-12) <= n * step <= high * (1 + 1e-12))
        choices.append(tuple(inside) or (float(np.clip(round(value / step) * step, low, high)),))
    return np.array(list(product(*choices)))


Element = Literal["notch", "lowpass", "feedforward"]
ELEMENTS: tuple[Element, ...] = get_args(Element)
DEEPEST = 0.01  # of a notch, -40 dB
END_OF_BAND = 0.9  # of the Nyquist frequency of the velocity loop


@dataclass(frozen=True)
class Variable:
    """One number that tuning may choose, its values in SI."""

    path: str
    start: float
    low: float
    high: float
    home: float | None  # value that costs nothing; None where every value does
    linear: bool = False  # whether it counts by itself (a share that may be 0), and not by its logarithm
    # Path of a variable that it is measured against (the width of a notch against its frequency)
    per: str = ""


@dataclass(frozen=True)
class Placed:
    """A design with neutral elements, and their variables."""

    design: Design
    variables: tuple[Variable, ...]
    elements: tuple[Element, ...]


def checked(design: Design, wanted: Sequence[str]) -> tuple[Element, ...]:
    """What may be placed in a design; an unknown word, or what the drive has no place for, is refused."""
    control, name = design.controller, design.name
    for word in wanted:
        if word not in ELEMENTS:
            raise InputError(f"place = {word!r}: allowed: {', '.join(ELEMENTS)}")
        if control.velocity is None:
            raise InputError(f"place = {word}: the design {name} has no control.velocity to hold it")
        if word == "feedforward" and control.position is None:
            raise InputError(
                f"place = {word}: the design {name} has no control.position, whose command it needs"
            )
    return tuple(item for item in ELEMENTS if item in wanted)


def place(design: Design, elements: tuple[Element, ...]) -> Placed:
    """A design with neutral elements in its velocity loop."""
    variables: list[Variable] = []
    for element in elements:
        if element == "feedforward":
            variables += _feedforward(design)
            continue
        velocity = design.controller.velocity
        assert velocity is not None
        item, own = _filter(design, element)
        filters = (*velocity.filters, item)
        control = replace(design.controller, velocity=replace(velocity, filters=filters))
        design, path = replace(design, controller=control), f"control.velocity.filter.{len(filters)}."
        variables += [replace(v, path=path + v.path, per=path + v.per if v.per else "") for v in own]
    return Placed(design, tuple(variables), elements)


def _filter(design: Design, element: Element) -> tuple[Filter, list[Variable]]:
    """A neutral filter, from Nyquist of the velocity loop (90 % of it) three decades down.

    A notch begins at the resonance of motor and load on the coupling, without damping; without one in the
    middle of the band.
    """
    velocity = design.controller.velocity
    assert velocity is not None
    high = END_OF_BAND * pi / (velocity.every * design.controller.period_s)
    low = high / 1000.0
    if element == "lowpass":
        lowpass = Filter(kind="lowpass", frequency_rad_s=high)
        return lowpass, [Variable("frequency", high, low, high, high)]
    free = sqrt(low * high) if design.coupling is None else resonance_rad_s(design)
    centre = float(np.clip(free, low, high))
    item = Filter(kind="notch", frequency_rad_s=centre, width_rad_s=0.5 * centre, depth=1.0)
    return item, [
        Variable("frequency", centre, low, high, None),
        Variable("width", 0.5 * centre, 0.02 * low, 4.0 * high, None, per="frequency"),
        Variable("depth", 1.0, DEEPEST, 1.0, 1.0),
    ]


def _feedforward(design: Design) -> list[Variable]:
    position = design.controller.position_loop
    return [
        Variable(f"control.position.{key}", value, 0.0, max(1.2, value), value, linear=True)
        for key in ("feedforward", "acceleration_feedforward")
        for value in [getattr(position, key)]
    ]


def change(variables: tuple[Variable, ...], values: np.ndarray) -> np.ndarray:
    """How far values are from home: squares of ln ratios, of shares, and of widths over their frequency.

    Of rows in SI, shape (candidates, variables); shape (candidates,).
    """
    places = {v.path: k for k, v in enumerate(variables)}
    total = np.zeros(len(values))
    for k, item in enumerate(variables):
        if item.per:
            total += (values[:, k] / values[:, places[item.per]]) ** 2
        elif item.home is not None and item.linear:
            total += (values[:, k] - item.home) ** 2
        elif item.home is not None and item.home < inf:
            total += np.log(values[:, k] / item.home) ** 2
    return total
