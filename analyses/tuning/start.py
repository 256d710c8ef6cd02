"""Where tuning begins, and what it may set.

Closed-form gains, as the motion controller's objects hold them; elements that may be added, neutral at first:
a notch of depth 1, a low-pass at the end of the band, no feed-forward. `change` says what they cost.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, floor, inf, pi, sqrt
from typing import Literal, get_args

import numpy as np

from actuator_lti.design.fields import part_at, with_part
from actuator_lti.design.model import Design, Filter
from actuator_lti.design.objects import OBJECTS, KnownObject, step_of
from actuator_lti.design.plant import torque_per_command
from actuator_lti.drive.facts import resonance_rad_s
from actuator_lti.drive.steady import own_drag_Nms_rad
from actuator_lti.errors import InputError
from actuator_lti.loops import assemble_loops
from actuator_lti.margins import stability_margins
from actuator_lti.types import Floats

WIDE = 2.0 + 3.0**0.5  # a of the symmetric optimum for a phase margin of 60 deg
SEPARATION = 4.0  # crossover of the velocity loop over the gain of the position loop


def magnitude_optimum(gain: float, time_constant_s: float, small_time_s: float) -> tuple[float, float]:
    """PI (gain, integral time) for ``gain/(1 + s T1)`` behind T_sigma: damping 0.707. Kessler 1958."""
    return time_constant_s / (2.0 * gain * small_time_s), time_constant_s


def symmetric_optimum(integrator_gain: float, small_time_s: float, a: float = 2.0) -> tuple[float, float]:
    """PI (gain, integral time) for ``k/s`` behind a small time constant T_sigma. Kessler 1958.

    Crossover at 1/(a T_sigma), Tn = a^2 T_sigma; phase margin ``arctan(a) - arctan(1/a)``.
    """
    return 1.0 / (a * integrator_gain * small_time_s), a * a * small_time_s


@dataclass(frozen=True)
class RuleGains:
    """Gains by rules, and how they were found."""

    values: Mapping[str, float]  # SI by dotted key
    steps: tuple[str, ...]  # one line a loop


def rule_gains(design: Design) -> RuleGains:
    """Start gains of every loop that a design has; a law of one's own stays, the others are tuned around it.

    Current: magnitude optimum with T_sigma = d + T/2. Velocity: symmetric optimum for 60 deg. Position: the
    velocity loop's crossover over `SEPARATION`. Where a stage is missing, the next one takes its place.
    """
    values, steps, own = dict[str, float](), list[str](), design.controller.own_law
    for loop, gain, time, words in _by_rule(design):
        if own is None or own[0] != loop:
            values[f"control.{loop}.gain"] = gain
            if time is not None:
                values[f"control.{loop}.integral_time"] = time
            steps.append(f"{loop}: {words}")
    if own is not None:
        steps.append(f"{own[0]}: a law of one's own, left as it is")
    return RuleGains(values, tuple(steps))


def _by_rule(design: Design) -> Iterator[tuple[str, float, float | None, str]]:
    """Loop, gain, integral time where it has one, and the rule in words, from the inner loop out."""
    control, motor, encoder = design.controller, design.effective_motor, design.encoder
    T, inner_s, torque, J = control.period_s, 0.0, torque_per_command(design), design.inertia_kgm2
    small = control.computing_delay_s + 0.5 * T  # T_sigma: delays of all that lies inside
    if control.current is not None:
        assert motor.resistance_ohm is not None
        assert motor.inductance_H is not None
        R, L = motor.resistance_ohm, motor.inductance_H
        gain, time = magnitude_optimum(1.0 / R, L / R, small)
        words = f"magnitude optimum, T_sigma {small * 1e6:.4g} us"
        yield "current", gain, None if control.current.integral_time_s is None else time, words
        small, inner_s = 2.0 * small, T
    if control.velocity is not None:
        own_s = control.velocity.every * T
        small = small + max(0.5 * (own_s - inner_s), 0.0) + encoder.filter_time_s
        if encoder.speed == "difference":
            small += 0.5 * encoder.difference_samples * own_s
        gain, time = symmetric_optimum(torque / J, small, WIDE)
        words = f"symmetric optimum for 60 deg, T_sigma {small * 1e6:.4g} us"
        yield "velocity", gain, None if control.velocity.integral_time_s is None else time, words
        if control.position is not None:
            crossover = _crossover_of_law(design) or 1.0 / (WIDE * small)
            words = f"velocity crossover {crossover:.4g} rad/s over {SEPARATION:g}"
            yield "position", crossover / SEPARATION, None, words
    elif control.position is not None:  # |controller * drive| = 1 at a tenth of 1/T_sigma or below
        corner, lead_s = own_drag_Nms_rad(design) / J, control.position.derivative_time_s or 0.0
        below = 2.0 / lead_s if lead_s else corner or inf  # 63 deg of lead, or the own corner
        omega = min(0.1 / small, below)
        response = torque * abs(complex(1.0, omega * lead_s)) / (J * abs(complex(corner, omega)) * omega)
        words = f"no velocity loop; crossover of the drive at {omega:.4g} rad/s"
        yield "position", 1.0 / response, None, words


def _crossover_of_law(design: Design) -> float | None:
    """Where the velocity loop of a law of one's own first passes a gain of 1, rad/s; None of any other."""
    own = design.controller.own_law
    if own is None or own[0] != "velocity":
        return None
    found = stability_margins(assemble_loops(design).present["velocity"].plain_open).phase_margins
    return min((one.frequency_rad_s for one in found), default=None)


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
    """Smallest and largest SI value of a gain that its object can hold and a truncated tolerance allows."""
    known, step, own = object_of(design, path), step_of_gain(design, path), design.parameters.get(path)
    held = (0.0, inf) if known is None or step is None else (max(known.low, 1) * step, known.high * step)
    if own is None or own.tolerance is None:
        return held
    return max(held[0], own.tolerance.lower), min(held[1], own.tolerance.upper)


def neighbours(design: Design, paths: tuple[str, ...], gains: Floats) -> Floats:
    """Roundings of gains to steps of their objects, where they have one, shape (roundings, gains)."""
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
    per: str = ""  # path of what it is measured against (of the width of a notch its frequency)


def checked(design: Design, wanted: Sequence[str]) -> tuple[Element, ...]:
    """What may be placed in a design; an unknown word, or what the drive has no place for, is refused."""
    control, name = design.controller, design.name
    for word in wanted:
        if word not in ELEMENTS:
            raise InputError(f"place = {word!r}: allowed: {', '.join(ELEMENTS)}")
        if control.velocity is None:
            raise InputError(f"place = {word}: the design {name} has no control.velocity to hold it")
        if word == "feedforward" and control.position is None:
            reason = f"the design {name} has no control.position, whose command it needs"
            raise InputError(f"place = {word}: {reason}")
        stage = "position" if word == "feedforward" else "velocity"
        if getattr(control, stage).law is not None:
            raise InputError(f"place = {word}: not beside control.{stage}.law, which may have it")
    return tuple(item for item in ELEMENTS if item in wanted)


def place(design: Design, elements: tuple[Element, ...]) -> tuple[Design, list[Variable]]:
    """A design with neutral elements in its velocity loop, and their variables."""
    variables: list[Variable] = []
    for element in elements:
        if element == "feedforward":
            position = design.controller.position_loop
            for key in ("feedforward", "acceleration_feedforward"):
                v = getattr(position, key)
                variables.append(Variable(f"control.position.{key}", v, 0.0, max(1.2, v), v, linear=True))
            continue
        (item, own), velocity = _filter(design, element), part_at(design, "control.velocity")
        filters = (*velocity.filters, item)
        design = with_part(design, "control.velocity", replace(velocity, filters=filters))
        path = f"control.velocity.filter.{len(filters)}."
        variables += [replace(v, path=path + v.path, per=path + v.per if v.per else "") for v in own]
    return design, variables


def _filter(design: Design, element: Element) -> tuple[Filter, list[Variable]]:
    """A neutral filter in the three decades below 90 % of Nyquist; a notch begins at a resonance."""
    high = END_OF_BAND * pi / design.controller.period_of("velocity")
    low = high / 1000.0
    if element == "lowpass":
        item = Filter(kind="lowpass", frequency_rad_s=high)
        return item, [Variable("frequency", high, low, high, high)]
    free = sqrt(low * high) if design.coupling is None else resonance_rad_s(design)
    centre = float(np.clip(free, low, high))
    item = Filter(kind="notch", frequency_rad_s=centre, width_rad_s=0.5 * centre, depth=1.0)
    return item, [
        Variable("frequency", centre, low, high, None),
        Variable("width", 0.5 * centre, 0.02 * low, 4.0 * high, None, per="frequency"),
        Variable("depth", 1.0, DEEPEST, 1.0, 1.0),
    ]


def change(variables: tuple[Variable, ...], values: Floats) -> Floats:
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
