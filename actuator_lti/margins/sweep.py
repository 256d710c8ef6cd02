"""Intervals over a band, split until a bound shows that nothing hides inside any of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from actuator_lti.errors import NumericalError
from actuator_lti.margins.crossings import TOUCH
from actuator_lti.margins.delay_form import Cells, DelayForm, cells
from actuator_lti.margins.loop import Mask, Real

RESOLVED = 0.05  # change inside an interval, relative to the value, below which it is not split further
_MOST = 400_000
_NARROWEST = 1e-12


def reach(form: DelayForm, found: Cells) -> Real:
    """Bound of |L - L(x)| inside each interval, the series delay included."""
    return found.spread + np.abs(found.L) * np.minimum(found.half * form.series, 2.0)


def subdivided(form: DelayForm, edges: Real, resolved: Callable[[Cells], Mask]) -> Cells:
    """Split the intervals between ``edges`` in two until ``resolved`` holds in each; in order of x.

    Raises
    ------
    NumericalError
        An interval would have to be split without end: a pole on the border of stability, or a band that
        holds too many turns of the delay.
    """
    low, high = edges[:-1], edges[1:]
    done: list[Cells] = []
    count = 0
    while low.size:
        found = cells(form, low, high)
        count += low.size
        good = resolved(found)
        done.append(_taken(found, good))
        low, high = low[~good], high[~good]
        if count > _MOST:
            raise NumericalError(
                f"more than {_MOST} intervals up to {edges[-1]:.4g}: ask for a narrower band_rad_s"
            )
        if low.size and float(((high - low) / high).min()) < _NARROWEST:
            raise NumericalError(
                f"the loop is not bounded near {low[0]:.10g}: a pole on the border of stability"
            )
        middle = 0.5 * (low + high)
        low, high = np.concatenate((low, middle)), np.concatenate((middle, high))
    return joined(done)


def _taken(found: Cells, mask: Mask) -> Cells:
    return Cells(*(getattr(found, name)[mask] for name in Cells.__dataclass_fields__))


def joined(parts: list[Cells]) -> Cells:
    """Several sets of intervals as one, in order of x."""
    order = np.concatenate([p.x for p in parts]).argsort()
    return Cells(
        *(np.concatenate([getattr(p, name) for p in parts])[order] for name in Cells.__dataclass_fields__)
    )


@dataclass(frozen=True)
class Level:
    """A real function of L whose zeros are wanted: its value, its rate by x, and whether a zero counts."""

    value: Callable[[complex], float]
    rate: Callable[[complex, complex], float]
    counts: Callable[[complex], bool]


def _phase(L: complex) -> float:
    return float(np.angle(-L))


GAIN = Level(lambda L: float(np.log(abs(L))), lambda L, d: (d / L).real, lambda L: True)
PHASE = Level(_phase, lambda L, d: (d / L).imag, lambda L: L.real < 0.0)


def crossings(form: DelayForm, found: Cells, level: Level, skip: Mask) -> tuple[Real, Mask]:
    """Zeros of a level between neighbouring middles; ``skip`` marks intervals that cannot hold one.

    Returns
    -------
    x : array
        Where, in order.
    touch : array of bool
        Whether the level is only touched there.
    """
    value = np.array([level.value(L) for L in found.L])
    rate = np.array([level.rate(L, d) for L, d in zip(found.L, found.slope, strict=True)])
    out: list[tuple[float, bool]] = []

    def at(x: float) -> float:
        return level.value(complex(cells(form, np.array([x]), np.array([x])).L[0]))

    def rate_at(x: float) -> float:
        one = cells(form, np.array([x]), np.array([x]))
        return level.rate(complex(one.L[0]), complex(one.slope[0]))

    def root(function: Callable[[float], float], low: float, high: float) -> float:
        return float(brentq(function, low, high, xtol=1e-300, rtol=1e-15, maxiter=300))

    candidates = np.flatnonzero(~(skip[1:] & skip[:-1]) & (np.abs(value[1:] - value[:-1]) < 3.0))
    for i in candidates:
        low, high = float(found.x[i]), float(found.x[i + 1])
        if value[i] * value[i + 1] < 0.0:
            x = root(at, low, high)
            if level.counts(complex(cells(form, np.array([x]), np.array([x])).L[0])):
                out.append((x, False))
        elif value[i] == 0.0:
            out.append((low, False))
        elif value[i] * rate[i] < 0.0 < value[i + 1] * rate[i + 1]:
            top = root(rate_at, low, high)
            peak = at(top)
            if abs(peak) <= TOUCH:
                out.append((top, True))
            elif peak * value[i] < 0.0:
                out += [(root(at, low, top), False), (root(at, top, high), False)]
    return np.array([x for x, _ in out]), np.array([touch for _, touch in out], dtype=bool)
