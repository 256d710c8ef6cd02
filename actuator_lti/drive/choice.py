"""Choices between numbers, arrays of many designs and followed values (`nonlinear.export.trace`) alike."""

import math
from typing import Any

import numpy as np


def where(condition: Any, yes: Any, no: Any) -> Any:
    """``yes`` where the condition holds, else ``no``; both are worked out before.

    >>> where(2.0 > 1.0, 5.0, 7.0), where(np.array([True, False]), 5.0, 7.0).tolist()
    (5.0, [5.0, 7.0])
    """
    if hasattr(condition, "either"):
        return condition.either(yes, no)
    if np.ndim(condition):
        return np.where(condition, yes, no)
    return yes if condition else no


def smaller(a: Any, b: Any) -> Any:
    return where(b < a, b, a)


def larger(a: Any, b: Any) -> Any:
    return where(b > a, b, a)


def finite(value: Any) -> Any:
    return abs(value) < math.inf
