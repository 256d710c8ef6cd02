"""Gains as the motion controller holds them: ranges and resolutions of its objects."""

from __future__ import annotations

from itertools import product
from math import ceil, floor, inf
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.design.object_dictionary import OBJECTS, step_of

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from actuator_lti.design.object_dictionary import KnownObject


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
    if known is None or step is None:
        return 0.0, inf
    return max(known.low, 1) * step, known.high * step


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
