"""Zeros of real functions of the axis and turns of a curve, by intervals in certified arithmetic."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

from flint import acb, arb, fmpq, fmpq_poly

from actuator_lti.errors import NumericalError
from actuator_lti.margins.delays.exact import HIGHEST_ORDER, ExactDelayLoop, Quasi, at

_MOST_INTERVALS = 60_000
_NARROWEST = 1e-13
_NEWTON_STEPS = 60
_PER_DECADE = 5
_ODD = 0.9137236158
J = acb(0, 1)
_MIRROR = fmpq_poly([0, -1])

Taylor = tuple[acb, acb, acb]  # value and slope in the middle, second derivative over the interval, by x


class Undetermined(NumericalError):
    """The loop comes so near to a line, or to -1, that its side cannot be told."""


@dataclass(frozen=True)
class Enclosure:
    """An interval of x, with N and D of the loop there."""

    low: float
    high: float
    N: Taylor
    D: Taylor

    @property
    def half(self) -> arb:
        """Ball of radius half the width about zero."""
        return arb(0, 0.5 * (self.high - self.low) * (1 + 1e-15))


class Axis:
    """A loop with delays on s = j x: enclosures of N and D on intervals."""

    def __init__(self, loop: ExactDelayLoop) -> None:
        self.loop = loop
        self._N, self._D = ([f.balls() for f in _derivatives(Q)] for Q in (loop.N, loop.D))

    def enclosure(self, low: float, high: float) -> Enclosure:
        """Enclosures on [low, high]."""
        middle = 0.5 * (arb(low) + arb(high))
        wide = middle.union(arb(low)).union(arb(high))
        point, ball = acb(0, middle), acb(0, wide)

        def taylor(f: list) -> Taylor:
            return at(f[0], point), J * at(f[1], point), -at(f[2], ball)

        return Enclosure(low, high, taylor(self._N), taylor(self._D))

    def values(self, x: arb) -> tuple[acb, acb]:
        """N and D at one x."""
        s = acb(0, x)
        return at(self._N[0], s), at(self._D[0], s)

    def slopes(self, x: arb) -> tuple[acb, acb]:
        """dN/dx and dD/dx at one x."""
        s = acb(0, x)
        return J * at(self._N[1], s), J * at(self._D[1], s)

    def edges(self, low: float, high: float) -> list[float]:
        """Where to start: zero, then so many to the decade, at places where nothing happens by design."""
        low *= _ODD
        count = max(int(_PER_DECADE * math.log10(high / low)), 1)
        return [0.0, *(low * (high / low) ** (k / count) for k in range(count)), high]


def _derivatives(f: Quasi) -> tuple[Quasi, Quasi, Quasi]:
    first = f.derivative()
    return f, first, first.derivative()


@dataclass(frozen=True)
class Form:
    """A real function q = u |N|^2 + v Re(N conj D) + w |D|^2 of the loop, or with Im where it is turned.

    (1, 0, -1) is |L| - 1; (0, 1, 0) the real part of L; (1, 2, 1 - m^2) is |1 + L| - m.
    """

    exact_u: fmpq
    exact_v: fmpq
    exact_w: fmpq
    turned: bool = False

    @cached_property
    def u(self) -> arb:
        """The weight of |N|^2."""
        return arb(self.exact_u)

    @cached_property
    def v(self) -> acb:
        """The weight of N conj D."""
        return acb(arb(self.exact_v)) * (-J if self.turned else 1)

    @cached_property
    def w(self) -> arb:
        """The weight of |D|^2."""
        return arb(self.exact_w)

    def order(self, loop: ExactDelayLoop) -> int:
        """Multiplicity of its zero at x = 0; 0: it is none."""
        N, D = loop.at_rest
        cross = self.exact_v * N * D(_MIRROR)
        if self.turned:
            return _order(cross, 1)
        return _order(self.exact_u * N * N(_MIRROR) + cross + self.exact_w * D * D(_MIRROR), 0)

    def at(self, N: acb, D: acb) -> arb:
        """The value."""
        both = N * D.conjugate()
        return self.u * (N * N.conjugate()).real + (self.v * both).real + self.w * (D * D.conjugate()).real

    def slope(self, N: acb, D: acb, N1: acb, D1: acb) -> arb:
        """The derivative by x."""
        both = N1 * D.conjugate() + N * D1.conjugate()
        return (
            2 * (self.u * (N1 * N.conjugate()).real + self.w * (D1 * D.conjugate()).real)
            + (self.v * both).real
        )

    def curvature(self, N: Taylor, D: Taylor) -> arb:
        """The second derivative, from Taylor coefficients that hold over a whole interval."""
        both = N[2] * D[0].conjugate() + 2 * N[1] * D[1].conjugate() + N[0] * D[2].conjugate()
        own = [2 * ((f[2] * f[0].conjugate()).real + (f[1] * f[1].conjugate()).real) for f in (N, D)]
        return self.u * own[0] + (self.v * both).real + self.w * own[1]


GAIN = Form(fmpq(1), fmpq(0), fmpq(-1))
REAL, IMAGINARY = (Form(fmpq(0), fmpq(1), fmpq(0), turned) for turned in (False, True))


def _over(f: Taylor, half: arb) -> Taylor:
    """Taylor coefficients in the middle made one over the interval."""
    slope = f[1] + f[2] * half
    return f[0] + f[1] * half + f[2] * (half * half) / 2, slope, f[2]


def zeros(axis: Axis, q: Form, edges: list[float]) -> list[arb]:
    """Every zero of q between the edges, each alone in its interval; one at x = 0 is not listed.

    Raises
    ------
    NumericalError
        Some zero could not be determined: a touch, or too many turns.
    """
    result: list[arb] = []
    stack = [(a, b) for a, b in pairwise(edges)][::-1]
    count, order_at_zero = 0, 0 if edges[0] else q.order(axis.loop)
    while stack:
        low, high = stack.pop()
        count += 1
        if low == 0.0 and order_at_zero:
            if high < _NARROWEST * edges[1]:
                raise NumericalError("a crossing next to zero frequency could not be determined")
            if not _order_holds(axis, q, high, order_at_zero):
                stack += [(0.5 * high, high), (0.0, 0.5 * high)]
            continue
        enclosure = axis.enclosure(low, high)
        value, slope = _enclosed(q, enclosure)
        if value > 0 or value < 0:
            continue
        if slope > 0 or slope < 0:
            result += _root(axis, q, low, high)
            continue
        stack += _halves(low, high, count, edges[-1], "what the loop does", ": a touch")
    return result


def _halves(
    low: float, high: float, count: int, end: float, what: str, why: str
) -> list[tuple[float, float]]:
    """Both halves of an interval, the second first, unless there are too many or it is too narrow."""
    if count > _MOST_INTERVALS:
        raise Undetermined(f"{count} certified intervals reach no farther than {low:.6g} rad/s of {end:.6g}")
    if high - low < _NARROWEST * high:
        raise Undetermined(f"{what} near {low:.10g} rad/s could not be determined{why}")
    middle = 0.5 * (low + high)
    return [(middle, high), (low, middle)]


def _enclosed(q: Form, enclosure: Enclosure) -> tuple[arb, arb]:
    """The value and the slope over an interval."""
    half = enclosure.half
    N, D = _over(enclosure.N, half), _over(enclosure.D, half)
    curvature = q.curvature(N, D)
    slope = q.slope(enclosure.N[0], enclosure.D[0], enclosure.N[1], enclosure.D[1])
    value = q.at(enclosure.N[0], enclosure.D[0]) + slope * half + curvature * (half * half) / 2
    return value, slope + curvature * half


def _root(axis: Axis, q: Form, low: float, high: float) -> list[arb]:
    """The only zero of a monotone q on [low, high), if there is one; Newton, held by bisection."""
    a, b = (q.at(*axis.values(arb(x))) for x in (low, high))
    if not (a > 0 or a < 0) or not (b > 0 or b < 0):
        raise NumericalError(f"a crossing at {low:.10g} rad/s itself could not be determined")
    if (a > 0) == (b > 0):
        return []
    rising = b > 0
    x = 0.5 * (low + high)
    for _ in range(_NEWTON_STEPS):
        N, D = axis.values(arb(x))
        value = q.at(N, D)
        if (value > 0) == rising:
            high = x
        else:
            low = x
        ahead = x - float((value / q.slope(N, D, *axis.slopes(arb(x)))).mid())
        if not low < ahead < high:
            ahead = 0.5 * (low + high)
        if abs(ahead - x) <= 2e-16 * x:
            return [arb(ahead)]
        x = ahead
    raise NumericalError(f"a crossing near {x:.10g} rad/s did not settle")


def _order(series: fmpq_poly, first: int) -> int:
    """The first power, counted in twos, whose coefficient is not zero."""
    for k in range(first, HIGHEST_ORDER, 2):
        if series[k] != 0:
            return k
    raise NumericalError("the loop does not leave the line at zero frequency")


def _order_holds(axis: Axis, q: Form, high: float, order: int) -> bool:
    """Whether the derivative of that order keeps its sign on [0, high]: no further zero there."""
    ball = acb(0, arb(0).union(arb(high)))
    derivatives = []
    for f in (axis.loop.N, axis.loop.D):
        part, row = f, []
        for k in range(order + 1):
            row.append(J**k * at(part.balls(), ball))
            part = part.derivative()
        derivatives.append(row)
    N, D = derivatives
    total = arb(0)
    for k in range(order + 1):
        both = (q.u * N[k] * N[order - k].conjugate()).real + (q.v * N[k] * D[order - k].conjugate()).real
        total += math.comb(order, k) * (both + (q.w * D[k] * D[order - k].conjugate()).real)
    return bool(total > 0 or total < 0)


def turn(axis: Axis, edges: list[float]) -> arb:
    """Change of the angle of N + D along the intervals, rad.

    Raises
    ------
    NumericalError
        It goes through zero, as far as can be told.
    """
    total = arb(0)
    stack = [(a, b) for a, b in pairwise(edges)][::-1]
    count = 0
    last = sum(axis.values(arb(0)), acb(0))
    while stack:
        low, high = stack.pop()
        count += 1
        enclosure = axis.enclosure(low, high)
        F: Taylor = (
            enclosure.N[0] + enclosure.D[0],
            enclosure.N[1] + enclosure.D[1],
            enclosure.N[2] + enclosure.D[2],
        )
        ball = _over(F, enclosure.half)[0] / F[0] if not F[0].contains(0) else acb(0)
        if ball.real > 0:
            here = sum(axis.values(arb(high)), acb(0))
            total += (
                (here / last).log().imag
                if (here / last).real > 0
                else (F[0] / last).arg() + (here / F[0]).arg()
            )
            last = here
            continue
        stack += _halves(low, high, count, edges[-1], "the turn of 1 + L", " from one through zero")
    return total
