"""The smallest distance of a loop with delays to -1, or of a response to what its peaks are one over."""

from __future__ import annotations

import math
from functools import partial
from itertools import pairwise

from flint import arb, fmpq
from scipy.optimize import minimize_scalar

from actuator_lti.margins.delays.axis import Axis, Form, zeros
from actuator_lti.margins.delays.exact import HIGHEST_ORDER
from actuator_lti.margins.distances import Distance

_SLACK = 1e-8  # relative: how much lower a smallest distance may be without being found
_AT_END = (0.9, 0.99, 0.999, 0.9999, 1.0 - _SLACK)  # of that at infinity: below which a smaller one is sought
_ROUNDS = 8
Place = tuple[float, float]
NOWHERE = (math.inf, math.inf)


def smallest(axis: Axis, distance: Distance, start: Place = NOWHERE, top: float | None = None) -> Place:
    """The smallest value up to ``top``, or everywhere, and its place.

    There is no zero of the distance less that value, or a smaller one is found.

    Under a delay 1 + L comes nearer than at infinity somewhere, however far; the last of `_AT_END` is how
    small a difference is looked for.
    """
    loop, at_end, somewhere = axis.loop, distance.at_no_gain, 10.0 * axis.loop.lowest
    value, w = min(
        start,
        (at_end, math.inf),
        _at_rest(axis, distance),
        (_value(axis, distance, somewhere), somewhere),
    )
    for level in _AT_END:
        for _ in range(_ROUNDS):
            below = min(value * (1.0 - _SLACK), level * at_end)
            if below < _SLACK or (level == _AT_END[-1] and value == at_end):
                return value, w
            nearer = Form(*distance.below(fmpq(*below.as_integer_ratio())))
            end = loop.beyond(distance.gain_above(below)) if top is None else top
            inside = zeros(axis, nearer, axis.edges(loop.lowest, end))
            if not inside:
                break
            found = [_least(axis, distance, float(a.mid()), float(b.mid())) for a, b in pairwise(inside)]
            value, w = min((value, w), *found)
        if value < level * at_end:
            return value, w
    return value, w


def _at_rest(axis: Axis, distance: Distance) -> Place:
    N, D = axis.loop.at_rest
    k = next(k for k in range(HIGHEST_ORDER) if N[k] != 0 or D[k] != 0)
    above, below = (float(abs(arb(part))) for part in distance.over(N[k], D[k]))
    return (above / below if below else math.inf), 0.0


def _value(axis: Axis, distance: Distance, x: float) -> float:
    above, below = distance.over(*(complex(part) for part in axis.values(arb(x))))
    return abs(above) / abs(below) if below else math.inf


def _least(axis: Axis, distance: Distance, low: float, high: float) -> Place:
    """Smallest value between two places, and where."""
    best = minimize_scalar(
        partial(_value, axis, distance), bounds=(low, high), method="bounded", options={"xatol": 1e-9 * high}
    )
    return float(best.fun), float(best.x)
