"""Every root of a square-free integer polynomial of high degree: simultaneous iteration, then proof.

Starting points from the Newton polygon of the coefficients (Bini 1996), the iteration of Ehrlich and Aberth
(Aberth 1973) with each Newton step p/p' from exact coefficients at the precision that it needs, and positions
in double precision; roots that are closer together than that are parted at higher precision. The proof:
a disc of radius n |p/p'| about a point holds a root, so n discs without common points hold one each.
"""

from __future__ import annotations

import math
from contextlib import suppress
from functools import lru_cache
from itertools import pairwise

import numpy as np
from flint import acb, acb_poly, arb, ctx, fmpz, fmpz_poly, nmod_poly
from numpy.typing import NDArray

from actuator_lti.margins.loop import Complex, Mask

_FIRST_BITS, _MOST_BITS = 64, 1 << 13
_ROUNDS = 120
_MOST_MISSING = 0.5  # of the roots known: beyond, those of a neighbour are no start
_SPLIT = 0.05  # about how far the roots of a multiple one are from each other in a neighbour
_REAL = 1e-9  # imaginary over modulus below which a place may be that of a real root
_PRIME = (1 << 61) - 1
_UNIT = fmpz_poly([1, 1])
_FEW = 1e-14  # relative step at which a position in double precision stands
_TOLD_BITS = 10  # of p at a point: enough for a step
_CLOSE_BITS = 512  # positions of roots closer than double precision parts

Indices = NDArray[np.intp]
Near = tuple[complex, ...] | None


class NotIsolated(ArithmeticError):
    """The iteration did not end, or the discs have points in common."""


def isolated_roots(p: fmpz_poly, near: Near = None) -> list[acb]:
    """All roots of a square-free polynomial with p(0) != 0, at the working precision; real ones marked so.

    Parameters
    ----------
    near : tuple of complex, optional
        About where they are, such as the roots of a neighbour: they only save time.

    Raises
    ------
    NotIsolated
        They could not be parted in this way.
    """
    return _Polished(p).discs(list(_positions(tuple(p.coeffs()), near)))


def square_free(p: fmpz_poly) -> list[tuple[fmpz_poly, int]]:
    """Its factors without multiple roots, and how often each occurs."""
    return [(fmpz_poly(list(factor)), times) for factor, times in _factors(tuple(p.coeffs()))]


@lru_cache(maxsize=8)  # asked again at a higher precision
def _factors(coefficients: tuple[fmpz, ...]) -> tuple[tuple[tuple[fmpz, ...], int], ...]:
    p = fmpz_poly(list(coefficients))
    p, late = _without_unit_root(p)
    result = [] if not late else [(fmpz_poly([1, 1]), late)]
    if p.degree() > 0:
        result += [(p, 1)] if _told_square_free(p) else p.factor_squarefree()[1]
    return tuple((tuple(factor.coeffs()), int(times)) for factor, times in result)


def _without_unit_root(p: fmpz_poly) -> tuple[fmpz_poly, int]:
    """Take out the root -1, as often as it occurs: poles at z = 0, whole samples of delay, lie there."""
    times = 0
    while p.degree() > 0 and p(-1) == 0:
        p, times = p // _UNIT, times + 1
    return p, times


def _told_square_free(p: fmpz_poly) -> bool:
    """Whether p is without a common factor with its derivative modulo a prime that keeps its degree.

    Then it has none over the integers either; the other way round nothing is told.
    """
    small = nmod_poly([int(c % _PRIME) for c in p.coeffs()], _PRIME)
    return small.degree() == p.degree() and small.gcd(small.derivative()).degree() == 0


@lru_cache(maxsize=8)
def _positions(coefficients: tuple[fmpz, ...], near: Near) -> tuple[acb, ...]:
    """Approximate roots, each nearer to its own than to any other."""
    steps = _NewtonSteps(fmpz_poly(list(coefficients)))
    missing = len(coefficients) - 1 - len(near or ())
    if near and 0 <= missing <= _MOST_MISSING * len(near):
        with suppress(NotIsolated):
            return _settled_positions(steps, np.concatenate([near, _about_unit(missing)]), _ROUNDS)
    return _settled_positions(steps, _starts(coefficients), _ROUNDS)


def _about_unit(count: int) -> Complex:
    """Starts of roots that a neighbour has not: mostly of a multiple one at -1 that came apart."""
    return np.asarray(_SPLIT * np.exp(2j * math.pi * (np.arange(count) + 0.3) / max(count, 1)) - 1.0)


def _settled_positions(steps: _NewtonSteps, z: Complex, rounds: int) -> tuple[acb, ...]:
    """Iterate from starting points."""
    active = np.ones(z.size, dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(rounds):
            k = np.flatnonzero(active)
            move = _aberth(steps.at(z[k], k), _repulsion(z, k))
            if not np.isfinite(move).all():
                raise NotIsolated("a step without bound")
            z[k] -= move
            active[k] = np.abs(move) > _FEW * np.abs(z[k])
            if not active.any():
                break
    with ctx.workprec(_CLOSE_BITS):
        return tuple(_parted(steps, z, active))


def _repulsion(z: Complex, k: Indices) -> Complex:
    """The sum of 1/(z_k - z_j) over all other j."""
    apart = z[k][:, None] - z[None, :]
    apart[np.arange(k.size), k] = np.inf
    return np.asarray((1.0 / apart).sum(axis=1))


def _aberth(newton: Complex, repulsion: Complex) -> Complex:
    return newton / (1.0 - newton * repulsion)


def _parted(steps: _NewtonSteps, z: Complex, close: Mask) -> list[acb]:
    """Positions at higher precision: those that are too close for double precision go on among themselves."""
    places = [acb(value) for value in z]
    group = np.flatnonzero(close)
    if not group.size:
        return places
    clear = z[~close]
    far = {k: acb(complex((1.0 / (z[k] - clear)).sum())) for k in group}
    for place, k in enumerate(group):  # two of them may stand in one double
        places[k] *= 1 + acb(0.6, 0.8) * arb(2.0) ** (-50) * (place + 1)
    for _ in range(_ROUNDS):
        moved = False
        for k in group:
            newton = steps.exactly(places[k])
            others = sum((1 / (places[k] - places[j]) for j in group if j != k), far[k])
            move = (newton / (1 - newton * others)).mid()
            if not move.is_finite():
                raise NotIsolated("a step without bound")
            places[k] = (places[k] - move).mid()
            nearest = min((abs(places[k] - places[j]) for j in group if j != k), default=abs(places[k]))
            moved |= not bool(abs(move) < arb(1e-9) * nearest)
        if not moved:
            return places
    raise NotIsolated("roots too close together")


def _starts(coefficients: tuple[fmpz, ...]) -> Complex:
    """Points on the circles of the Newton polygon: as many as roots are of about that size."""
    points = [(k, log2_of(c)) for k, c in enumerate(coefficients) if c != 0]
    hull: list[tuple[int, float]] = []
    for k, size in points:
        while len(hull) > 1 and _above(hull[-2], (k, size), hull[-1]):
            hull.pop()
        hull.append((k, size))
    circles = []
    for turn, ((a, below), (b, above)) in enumerate(pairwise(hull)):
        exponent = (below - above) / (b - a)
        if not -500.0 < exponent < 500.0:
            raise NotIsolated("roots beyond the range of double precision")
        angle = 2.0 * math.pi * np.arange(b - a) / (b - a) + 0.7 + turn
        circles.append(2.0**exponent * np.exp(1j * angle))
    return np.concatenate(circles)


def _above(left: tuple[int, float], right: tuple[int, float], middle: tuple[int, float]) -> bool:
    """Whether the line from left to right passes above the point in the middle, or through it."""
    rise = (middle[1] - left[1]) * (right[0] - left[0])
    return rise <= (right[1] - left[1]) * (middle[0] - left[0])


def log2_of(c: fmpz) -> float:
    """Base-2 logarithm of the size of an integer that is not 0."""
    size = abs(int(c))
    shift = max(size.bit_length() - 60, 0)
    return math.log2(size >> shift) + shift


class _NewtonSteps:
    """p/p' from exact coefficients, at the precision that each point needs."""

    def __init__(self, p: fmpz_poly) -> None:
        self._p, self._slope = p, p.derivative()
        self._rounded: dict[int, tuple[acb_poly, acb_poly]] = {}
        self._bits = np.full(p.degree(), _FIRST_BITS)

    def at(self, z: Complex, which: Indices) -> Complex:
        """The steps of some of the roots."""
        return np.array([complex(self._step(acb(x), k)) for x, k in zip(z, which, strict=True)])

    def exactly(self, x: acb) -> acb:
        """The step at a point of high precision."""
        step = self._step(x, None)
        return step.mid()

    def _step(self, x: acb, k: int | None) -> acb:
        bits = int(self._bits[k]) if k is not None else max(ctx.prec, _FIRST_BITS)
        while True:
            with ctx.workprec(bits):
                p, slope = self.at_precision(bits)
                value = p(x)
                if value.rel_accuracy_bits() >= _TOLD_BITS or bits >= _MOST_BITS:
                    break
            bits *= 2
        if k is not None:
            self._bits[k] = bits
        with ctx.workprec(bits):
            return value / slope(x)

    def at_precision(self, bits: int) -> tuple[acb_poly, acb_poly]:
        """p and p' with coefficients of so many bits."""
        if bits not in self._rounded:
            self._rounded[bits] = acb_poly(self._p), acb_poly(self._slope)
        return self._rounded[bits]


class _Polished:
    """Newton's method at rising precision, and the discs that prove the roots."""

    def __init__(self, p: fmpz_poly) -> None:
        self._steps = _NewtonSteps(p)
        self._degree = p.degree()

    def discs(self, places: list[acb]) -> list[acb]:
        """One disc around each place, no two with a common point."""
        wanted = ctx.prec
        polished = self._mirrored(places, wanted)
        if len(polished) != len(places):
            polished = [self._polish(place, wanted) for place in places]
        with ctx.workprec(2 * wanted + _CLOSE_BITS):
            _refuse_common_points(polished)
            return [_disc(x, radius) for x, radius in polished]

    def _mirrored(self, places: list[acb], wanted: int) -> list[tuple[acb, arb]]:
        """Discs about the places that are not below the real axis, and about their mirror images."""
        result = []
        for place in places:
            z = complex(place)
            if z.imag < -_REAL * abs(z):
                continue
            x, radius = self._polish(place, wanted)
            result.append((x, radius))
            if z.imag > _REAL * abs(z) and x.imag != 0:
                result.append((x.conjugate(), radius))
        return result

    def _polish(self, x: acb, wanted: int) -> tuple[acb, arb]:
        bits = 2 * wanted + _FIRST_BITS
        small = arb(2) ** (-wanted - 10)
        for _ in range(_ROUNDS):
            with ctx.workprec(bits):
                value, slope, radius = self._bounded(x)
                if bool(radius <= small * abs(x)):
                    break
                if value.rel_accuracy_bits() >= _TOLD_BITS:
                    x = (x - value / slope).mid()
                    continue
            bits *= 2  # what p is there is lost in rounding, and the disc too wide
            if bits > 4 * _MOST_BITS:
                raise NotIsolated("Newton's method did not converge")
        else:
            raise NotIsolated("Newton's method did not converge")
        if not bool(abs(x.imag) > radius):
            x = acb(x.real)
            with ctx.workprec(bits):
                radius = self._bounded(x)[2]
        return x, radius

    def _bounded(self, x: acb) -> tuple[acb, acb, arb]:
        """p and p' at a point, and n |p/p'|, rounded up: a root is no farther away than this."""
        bits = ctx.prec
        while bits <= 4 * _MOST_BITS:
            with ctx.workprec(bits):
                p, slope = self._steps.at_precision(bits)
                below = slope(x)
                if below.rel_accuracy_bits() >= _TOLD_BITS:
                    value = p(x)
                    return value, below, arb((self._degree * abs(value) / abs(below)).abs_upper())
            bits *= 2
        raise NotIsolated("the slope at a root could not be told from zero")


def _refuse_common_points(result: list[tuple[acb, arb]]) -> None:
    """Compare all centres in double precision; only pairs that it cannot part are compared exactly."""
    z = np.array([complex(x) for x, _ in result])
    size = np.abs(z)
    apart = np.abs(z[:, None] - z[None, :])
    unclear = np.argwhere(apart <= 1e-9 * (size[:, None] + size[None, :]))
    for i, j in unclear[unclear[:, 0] < unclear[:, 1]]:
        (a, r), (b, s) = result[i], result[j]
        if not bool(abs(a - b) > r + s):
            raise NotIsolated("two discs with a common point")
    if any(not bool(radius <= 1e-12 * abs(x)) for x, radius in result):
        raise NotIsolated("a disc too wide")


def _disc(x: acb, radius: arb) -> acb:
    """The square around a disc; a disc about a real centre that holds one root holds a real one."""
    width = arb(0, radius)
    return acb(x.real + width, 0) if x.imag == 0 else acb(x.real + width, x.imag + width)
