"""The positive roots of a polynomial with integer coefficients, without the complex ones beside them.

A polynomial has as many roots in an interval as its coefficients over that interval change their sign, or
two, four ... fewer (Descartes). Intervals are halved until each has one root or none (Collins and Akritas,
Polynomial real root isolation using Descartes' rule of signs, SYMSAC 1976). Of fifty states that takes a
tenth of the time in which all roots are found.
"""

import math
from contextlib import suppress
from functools import lru_cache
from typing import Any

from flint import arb, arb_poly, ctx, fmpz, fmpz_poly

from actuator_lti.errors import NumericalError
from actuator_lti.margins.exact.roots import all_roots

FEW = 16  # degree up to which all roots at once take less time
_PLACE = 40503  # over 2^16: intervals end at no number that a root is likely to be
_SHIFT = fmpz_poly([1, 1])
_STEPS = 1000  # of Newton's method, or halves
Interval = tuple[arb, arb]


def positive_roots(p: fmpz_poly) -> list[tuple[arb, int]]:
    """The positive real roots in order, to the working precision, with their multiplicity."""
    places = None if p.degree() <= FEW else _places(tuple(p.coeffs()))
    if places is not None:
        least = arb((1, -ctx.prec))
        with ctx.workprec(ctx.prec + p.degree() + 32), suppress(NumericalError):
            value, slope = arb_poly(p), arb_poly(p.derivative())
            return [(_root_in(value, slope, low, high, least), 1) for low, high in places]
    real = [(root.real, times) for root, times in all_roots(p) if root.imag.is_zero() and root.real > 0]
    return sorted(real, key=lambda root: float(root[0].mid()))


@lru_cache(maxsize=64)
def _places(coefficients: tuple[Any, ...]) -> list[Interval] | None:
    """Intervals with one root each, octave by octave; ``None``: one is not told from what lies beside it."""
    first = next(k for k, c in enumerate(coefficients) if c != 0)
    p = fmpz_poly(list(coefficients[first:]))
    scaled = [int(c) for c in p(fmpz_poly([0, _PLACE])).coeffs()]  # of x = v 2^16 / _PLACE, times 2^(16 k)
    for more in (1, 2, 4) if p.degree() else ():
        every = [_in_octave(scaled, octave, more * (p.degree() + 64)) for octave in _octaves(p)]
        told = [places for places in every if places is not None]
        if len(told) == len(every):
            return [place for places in told for place in places]
    return None if p.degree() else []


def _octaves(p: fmpz_poly) -> range:
    """Between which powers of two the sizes of the roots are, by the bound of Fujiwara."""
    sizes = {k: int(c).bit_length() for k, c in enumerate(p.coeffs()) if c != 0}
    last = max(sizes)
    low = max((sizes[k] - sizes[0] + 1) / k for k in sizes if k)
    high = max((sizes[k] - sizes[last] + 1) / (last - k) for k in sizes if k < last)
    return range(math.floor(-low) - 1, math.ceil(high) + 2)


def _in_octave(scaled: list[int], octave: int, bits: int) -> list[Interval] | None:
    """Where x lies between 1 and 2 times 2^octave, places with one root; ``None``: more bits are needed."""
    n, found = len(scaled) - 1, []
    cut = max(c.bit_length() + (octave - 16) * k for k, c in enumerate(scaled) if c) - bits
    moves = ((c, cut + (16 - octave) * k) for k, c in enumerate(scaled))
    rounded = fmpz_poly([c >> move if move > 0 else c << -move for c, move in moves])  # by less than one
    left = [(rounded(_SHIFT), 0, 0)]
    while left:
        q, level, k = left.pop()  # from 1 + k/2^level to 1 + (k + 1)/2^level
        c = q.coeffs()
        c += [fmpz(0)] * (n + 1 - len(c))
        changes = _sign_changes(fmpz_poly(c[::-1])(_SHIFT), _errors(n, level))
        if changes is None:
            return None
        if changes == 1:
            low, high = (arb((_PLACE * ((1 << level) + end), octave - 16 - level)) for end in (k, k + 1))
            found.append((low, high))
        elif changes:
            half = fmpz_poly([x << (n - m) for m, x in enumerate(c)])
            left += [(half(_SHIFT), level + 1, 2 * k + 1), (half, level + 1, 2 * k)]
    return found


@lru_cache(maxsize=64)
def _errors(n: int, level: int) -> list[fmpz]:
    """Up to which size coefficients over an interval may be zero, where those of powers are wrong by one."""
    return list((_SHIFT**n * (1 << (n * (level + 1) + 2))).coeffs())


def _sign_changes(over: fmpz_poly, errors: list[fmpz]) -> int | None:
    """Of coefficients, up to two; ``None`` where a sign is not known."""
    changes, before = 0, None
    c = over.coeffs()
    if len(c) < len(errors):  # the last ones are zero
        return None
    for x, error in zip(c, errors, strict=True):
        if -error <= x <= error:
            return None
        changes += before is not None and before is not (x > 0)
        if changes == 2:
            break
        before = x > 0
    return changes


def _root_in(p: arb_poly, slope: arb_poly, low: arb, high: arb, least: arb) -> arb:
    """The one root in an interval, to a relative error: Newton, and halving where that leaves it."""
    rising, x = p(high) > 0, ((low + high) / 2).mid()
    for _ in range(_STEPS):
        value = p(x)
        if value > 0 or value < 0:
            low, high = (x, high) if (value < 0) == rising else (low, x)
        step = (value / slope(x)).mid()
        x = (x - step).mid()
        if not low <= x <= high:
            x = ((low + high) / 2).mid()
        elif step * step <= least * x * x / 256:  # the next step is far smaller than asked
            ends = (x * (1 - least)).mid(), (x * (1 + least)).mid()
            if all(p(end) < 0 if (end > x) != rising else p(end) > 0 for end in ends):
                return ends[0].union(ends[1])
    raise NumericalError("a root could not be separated from what lies beside it")
