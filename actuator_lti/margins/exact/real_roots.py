"""The positive roots of a polynomial with integer coefficients, without the complex ones beside them.

A polynomial has as many roots in an interval as its coefficients over that interval change their sign, or
two, four ... fewer (Descartes). Intervals are halved until each has one root or none (Collins and Akritas,
Polynomial real root isolation using Descartes' rule of signs, SYMSAC 1976). Of a hundred states that takes a
thirtieth of the time in which all roots are found.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any

import numpy as np
from flint import arb, arb_poly, ctx, fmpz, fmpz_poly

from actuator_lti.errors import NumericalError
from actuator_lti.margins.exact.roots import FEW, all_roots, is_crowded
from actuator_lti.systems.precision import precision
from actuator_lti.types import Real

_MOST_BITS = 1 << 15
_PLACE = 40503  # over 2^16: intervals end at no number that a root is likely to be
_SHIFT = fmpz_poly([1, 1])
_STEPS = 20  # of Newton's method
_TOO_CLOSE = "a root could not be separated from what lies beside it"
Places = tuple[tuple[fmpz_poly, int, tuple[tuple[arb, arb], ...]], ...]
"""A factor, its multiplicity, intervals with one root each; no two factors have a root in common."""

Spans = tuple[tuple[float, float], ...]
EVERYWHERE: Spans = ((-math.inf, math.inf),)


def positive_roots(p: fmpz_poly, spans: Spans = EVERYWHERE) -> list[tuple[arb, int]]:
    """The positive real roots in order, to the working precision, with their multiplicity.

    All that lie in some spans of the logarithm to base 2, and maybe some beside them.
    """
    isolated = None if p.degree() <= FEW and not is_crowded(p) else _places(tuple(p.coeffs()), spans)
    if isolated is None:
        real = [(root.real, times) for root, times in all_roots(p) if root.imag.is_zero() and root.real > 0]
        return sorted(real, key=lambda root: float(root[0].mid()))
    roots, least = [], arb((1, -ctx.prec))
    for factor, times, places in isolated:
        with precision(ctx.prec + factor.degree() + 32):
            q = _Evaluated(factor)
            roots += [(q.root_in(low, high, least), times) for low, high in places]
    return sorted(roots, key=lambda root: float(root[0].mid().log()))


@lru_cache(maxsize=64)
def _places(coefficients: tuple[Any, ...], spans: Spans) -> Places | None:
    """Where the positive roots are; only where one is not told from its neighbour, factors are looked for.

    None where that does not help: a root lies at an end of an interval.
    """
    p = fmpz_poly(list(coefficients))
    with precision(_MOST_BITS):
        with suppress(NumericalError):
            return ((p, 1, tuple(_separated(p, spans, 4 * (p.degree() + 64)))),)
        factors = p.factor_squarefree()[1]
        with suppress(NumericalError):
            return tuple((q, times, tuple(_separated(q, spans, _MOST_BITS))) for q, times in factors)
    return None


def _separated(p: fmpz_poly, spans: Spans, most_bits: int) -> Iterator[tuple[arb, arb]]:
    """Intervals with one root each, octave by octave."""
    while p.degree() > 0 and p[0] == 0:
        p = p.right_shift(1)
    if p.degree() < 1:
        return
    scaled = [int(c) for c in p(fmpz_poly([0, _PLACE])).coeffs()]  # of x = v 2^16 / _PLACE, times 2^(16 k)
    sizes = np.array([c.bit_length() - 16.0 * k if c else -math.inf for k, c in enumerate(scaled)])
    bits, n = p.degree() + 64, p.degree()
    first, last = octaves(p)
    for octave in range(first, last + 1):
        start = octave - 16 + math.log2(_PLACE)
        here = tuple((a - start, b - start) for a, b in spans if a <= start + 1.0 and b >= start)
        found: list[tuple[int, int]] | None = []
        while here and (found := _in_octave(_rounded(scaled, sizes, octave, bits), n, here)) is None:
            if (bits := 2 * bits) > most_bits:
                raise NumericalError(_TOO_CLOSE)
        for level, k in found or ():
            low, high = (arb((_PLACE * ((1 << level) + end), octave - 16 - level)) for end in (k, k + 1))
            yield low, high


def octaves(p: fmpz_poly) -> tuple[int, int]:
    """Between which powers of two the sizes of the roots are, zero left out, by the bound of Fujiwara."""
    sizes = {k: int(c).bit_length() for k, c in enumerate(p.coeffs()) if c != 0}
    first, last = min(sizes), max(sizes)
    low = max((sizes[k] - sizes[first] + 1) / (k - first) for k in sizes if k > first)
    high = max((sizes[k] - sizes[last] + 1) / (last - k) for k in sizes if k < last)
    return math.floor(-low) - 1, math.ceil(high) + 1


def _rounded(scaled: Sequence[int], sizes: Real, octave: int, bits: int) -> fmpz_poly:
    """The coefficients where x lies between 1 and 2 times 2^octave, each wrong by less than one."""
    cut = int((sizes + octave * np.arange(sizes.size)).max()) - bits
    moves = ((c, cut + (16 - octave) * k) for k, c in enumerate(scaled))
    return fmpz_poly([c >> move if move > 0 else c << -move for c, move in moves])


def _in_octave(p: fmpz_poly, n: int, spans: Spans) -> list[tuple[int, int]] | None:
    """(level, k): one root between 1 + k/2^level and 1 + (k + 1)/2^level; ``None``: more bits are needed."""
    found, left = [], [(p(_SHIFT), 0, 0)]
    while left:
        q, level, k = left.pop()
        low, high = (math.log2(1.0 + end / (1 << level)) for end in (k, k + 1))
        if not any(a <= high and b >= low for a, b in spans):
            continue
        c = q.coeffs()
        c += [fmpz(0)] * (n + 1 - len(c))
        changes = _sign_changes(fmpz_poly(c[::-1])(_SHIFT), _errors(n, level))
        if changes is None:
            return None
        if changes == 1:
            found.append((level, k))
        elif changes:
            half = fmpz_poly([x << (n - m) for m, x in enumerate(c)])
            left += [(half(_SHIFT), level + 1, 2 * k + 1), (half, level + 1, 2 * k)]
    return found


@lru_cache(maxsize=64)
def _errors(n: int, level: int) -> list[tuple[fmpz, fmpz]]:
    """Between what coefficients over an interval may be zero, where those of powers are wrong by one."""
    above = (_SHIFT**n * (1 << (n * (level + 1) + 2))).coeffs()
    return [(-x, x) for x in above]


def _sign_changes(over: fmpz_poly, errors: list[tuple[fmpz, fmpz]]) -> int | None:
    """Of coefficients, up to two; ``None`` where a sign is not known."""
    changes, before = 0, None
    c = over.coeffs()
    if len(c) < len(errors):  # the last ones are zero
        return None
    for x, (low, high) in zip(c, errors, strict=True):
        if low <= x <= high:
            return None
        changes += before is not None and before is not (x > high)
        if changes == 2:
            break
        before = x > high
    return changes


class _Evaluated:
    """A polynomial at the working precision."""

    def __init__(self, p: fmpz_poly) -> None:
        self.p, self.value, self.slope = p, arb_poly(p), arb_poly(p.derivative())

    def root_in(self, low: arb, high: arb, least: arb) -> arb:
        """The one root in an interval, to a relative error: Newton, and halving where that leaves it."""
        side = self.sign(low)
        while high - low > least * low:
            middle = ((low + high) / 2).mid()
            if (found := self._by_newton(low, high, middle, least)) is not None:
                return found
            low, high = (middle, high) if self.sign(middle) == side else (low, middle)
        return low.union(high)

    def _by_newton(self, low: arb, high: arb, x: arb, least: arb) -> arb | None:
        """The root with signs that differ on its two sides; ``None`` where Newton does not come to it."""
        for _ in range(_STEPS):
            step = (self.value(x) / self.slope(x)).mid()
            x = (x - step).mid()
            if not low <= x <= high:
                return None
            if step * step <= least * x * x / 256:  # the next step is far smaller than asked
                ends = max(low, (x * (1 - least)).mid()), min(high, (x * (1 + least)).mid())
                return ends[0].union(ends[1]) if self.sign(ends[0]) != self.sign(ends[1]) else None
        return None

    def sign(self, v: arb) -> int:
        value, bits = self.value(v), ctx.prec
        while not (value > 0 or value < 0):
            if (bits := 2 * bits) > 2 * _MOST_BITS:
                raise NumericalError(_TOO_CLOSE)
            with precision(bits):
                value = arb_poly(self.p)(v)
        return 1 if value > 0 else -1
