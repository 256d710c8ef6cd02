"""What tuning may set: gains as the motion controller's objects hold them, and elements that it may add.

A notch, a low-pass, feed-forward of a velocity loop are neutral until they are needed: a notch of depth 1, a
low-pass at the end of the band, no feed-forward. The distance from there is what they cost, in the same
measure as a gain (`change`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, floor, inf, pi, sqrt
from typing import Literal, get_args

import numpy as np

from actuator_lti.design.model import Design, Filter
from actuator_lti.design.object_dictionary import OBJECTS, KnownObject, step_of
from actuator_lti.drive.facts import resonance_rad_s
from actuator_lti.errors import InputError


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
