"""The positive roots of a square-free integer polynomial of high degree, without its other roots.

Descartes' rule on intervals (Vincent; Collins and Akritas 1976): the roots of p in (a, b) are the positive
ones of (1 + x)^n p((a + b x)/(1 + x)). No change of sign among the coefficients: no root; one change: one
root; more: the interval is split. The coefficients are certified intervals, and their precision is doubled
until each sign is told.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

from flint import arb, arb_poly, ctx, fmpz, fmpz_poly

from actuator_lti.margins.root_isolation import NotIsolated, log2_of

_FIRST_BITS, _MOST_BITS = 256, 1 << 14
_OCTAVES = 8.0  # of an interval to begin with
_ODD = 0.9137236158  # so that no end of an interval is a root by design
_MOST_INTERVALS = 4000
_ROUNDS = 200
_SPARE_BITS = 10


def positive_axis_roots(p: fmpz_poly) -> list[arb]:
    """Every positive root, in order, each in an interval at the working precision.

    Raises
    ------
    NotIsolated
        They could not be parted in this way, as where two are nearly one.
    """
    axis = _Axis(p)
    return [axis.root(a, b) for a, b in _intervals(tuple(p.coeffs()))]


@lru_cache(maxsize=8)  # asked again at a higher precision
def _intervals(coefficients: tuple[fmpz, ...]) -> tuple[tuple[float, float], ...]:
    """Intervals that hold one positive root each, in order, and no other is left."""
    p = fmpz_poly(list(coefficients))
    axis = _Axis(p)
    result: list[tuple[float, float]] = []
    low, high = _bounds(p)
    count = max(math.ceil((high - low) / _OCTAVES), 1)
    edges = [2.0 ** (low + (high - low) * k / count) * (1.0 if k else _ODD) for k in range(count + 1)]
    stack = list(pairwise(edges))[::-1]
    for _ in range(_MOST_INTERVALS):
        if not stack:
            return tuple(result)
        a, b = stack.pop()
        changes = axis.changes(a, b)
        if changes == 1:
            result.append((a, b))
        elif changes:
            middle = math.sqrt(a) * math.sqrt(b)
            if not a < middle < b:
                break
            stack += [(middle, b), (a, middle)]
    raise NotIsolated("two roots too close together")


def _bounds(p: fmpz_poly) -> tuple[float, float]:
    """Base-2 logarithms of two sizes between which every root lies (Fujiwara 1916)."""
    size = [log2_of(c) if c != 0 else -math.inf for c in p.coeffs()]
    n = len(size) - 1
    high = 1.0 + max((size[n - k] - size[n]) / k for k in range(1, n + 1))
    low = -1.0 - max((size[k] - size[0]) / k for k in range(1, n + 1))
    if not -500.0 < low < high < 500.0:
        raise NotIsolated("roots beyond the range of double precision")
    return low, high


class _Axis:
    """A polynomial at rising precision."""

    def __init__(self, p: fmpz_poly) -> None:
        self._p, self._slope = p, p.derivative()
        self._rounded: dict[int, tuple[arb_poly, arb_poly]] = {}

    def _at(self, bits: int) -> tuple[arb_poly, arb_poly]:
        if bits not in self._rounded:
            self._rounded[bits] = arb_poly(self._p), arb_poly(self._slope)
        return self._rounded[bits]

    def changes(self, a: float, b: float) -> int:
        """Changes of sign of the coefficients that belong to (a, b)."""
        bits = _FIRST_BITS
        while bits <= _MOST_BITS:
            with ctx.workprec(bits):
                inside = self._at(bits)[0](arb_poly([arb(a), arb(b) - arb(a)])).coeffs()
                inside += [arb(0)] * (self._p.degree() + 1 - len(inside))
                mapped = arb_poly(inside[::-1])(arb_poly([1, 1])).coeffs()
                signs = [(c > 0) - (c < 0) for c in mapped]
            if 0 not in signs:
                return sum(s != t for s, t in pairwise(signs))
            bits *= 2
        raise NotIsolated("a coefficient could not be told from zero")

    def root(self, low: float, high: float) -> arb:
        """The only root between two points: Newton held by bisection, proved by a change of sign."""
        wanted = ctx.prec
        bits = max(2 * wanted, _FIRST_BITS)
        a, b = arb(low), arb(high)
        rising = self._sign(b) > 0
        x = arb(math.sqrt(low) * math.sqrt(high))
        for _ in range(_ROUNDS):
            with ctx.workprec(bits):
                p, slope = self._at(bits)
                value = p(x)
                if not (value > 0 or value < 0):
                    bits *= 2  # lost in rounding
                    if bits > _MOST_BITS:
                        break
                    continue
                if (value > 0) == rising:
                    b = x
                else:
                    a = x
                ahead = (x - value / slope(x)).mid()
                if not (ahead.is_finite() and ahead > a and ahead < b):
                    ahead = ((a + b) / 2).mid()
                near = (arb(2) ** (-wanted - _SPARE_BITS) * abs(ahead)).mid()
                settled = bool(abs(ahead - x) < near)
                if settled and self._sign(ahead - near) * self._sign(ahead + near) < 0:
                    return ahead + arb(0, 1) * near
                x = ahead
        raise NotIsolated("a root did not settle")

    def _sign(self, x: arb) -> int:
        """The sign of p at an exact point; 0 where it could not be told."""
        place, bits = x.mid(), max(ctx.prec, _FIRST_BITS)
        while bits <= _MOST_BITS:
            with ctx.workprec(bits):
                value = self._at(bits)[0](place)
                if value > 0 or value < 0:
                    return 1 if value > 0 else -1
            bits *= 2
        return 0
