"""Zeros of real functions of the axis, turns of a curve, smallest distances: by certified intervals."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

from flint import acb, acb_poly, arb, arb_poly, fmpq, fmpq_poly

from actuator_lti.errors import NumericalError
from actuator_lti.margins.delays.exact import HIGHEST_ORDER, ExactDelayLoop
from actuator_lti.margins.distances import Distance, Place
from actuator_lti.systems.root import root

_MOST_INTERVALS = 60_000
_NARROWEST = 1e-13
_PER_DECADE = 5
_ODD = 0.9137236158
J = acb(0, 1)
_MIRROR = fmpq_poly([0, -1])
_SLACK = 1e-8  # relative: how much lower a smallest distance may be without being found
_AT_END = (0.9, 0.99, 0.999, 0.9999, 1.0 - _SLACK)  # of that at infinity: below which a smaller one is sought
_ROUNDS = 8
NOWHERE = (math.inf, math.inf)


class Axis:
    """A loop with delays on s = j x: expansions of N and D about x."""

    def __init__(self, loop: ExactDelayLoop) -> None:
        self.loop = loop
        self._derivatives = [[(f, acb(1))] for f in (loop.N, loop.D)]  # with j^k/k!

    def series(self, places: Sequence[arb]) -> tuple[acb_poly, acb_poly]:
        """N and D by powers of the way from x, coefficient k from the k-th place, a point or an interval."""
        coefficients = []
        for known in self._derivatives:
            while len(known) < len(places):
                f, factor = known[-1]
                known.append((f.derivative(), factor * J / len(known)))
            terms = zip(places, known[: len(places)], strict=True)
            coefficients.append(acb_poly([factor * f(acb(0, x)) for x, (f, factor) in terms]))
        N, D = coefficients
        return N, D

    def over(self, low: float, high: float) -> tuple[acb_poly, acb_poly]:
        """N and D over an interval by powers of the way from its middle, of no more than `_half` of it."""
        middle = 0.5 * (arb(low) + arb(high))
        return self.series((middle, middle, middle.union(arb(low)).union(arb(high))))

    def values(self, x: arb) -> tuple[acb, acb]:
        """N and D at one x."""
        N, D = self.series((x,))
        return N[0], D[0]

    def edges(self, low: float, high: float) -> list[float]:
        """Where to start: zero, then so many to the decade, at places where nothing happens by design."""
        low *= _ODD
        count = max(int(_PER_DECADE * math.log10(high / low)), 1)
        return [0.0, *(low * (high / low) ** (k / count) for k in range(count)), high]


def _half(low: float, high: float) -> arb:
    """Ball of radius half the width about zero."""
    return arb(0, 0.5 * (high - low) * (1 + 1e-15))


@dataclass(frozen=True)
class Form:
    """A real function q = u |N|^2 + v Re(N conj D) + w |D|^2 of the loop, or with Im where it is turned.

    (1, 0, -g^2) is |L| - g; (0, 1, 0) the real part of L; (1, 2, 1 - m^2) is |1 + L| - m.
    """

    u: fmpq
    v: fmpq
    w: fmpq
    turned: bool = False

    def order(self, loop: ExactDelayLoop) -> int:
        """Multiplicity of its zero at x = 0; 0: it is none."""
        N, D = loop.at_rest
        cross = self.v * N * D(_MIRROR)
        if self.turned:
            return _order(cross, 1)
        return _order(self.u * N * N(_MIRROR) + cross + self.w * D * D(_MIRROR), 0)

    def along(self, N: acb_poly, D: acb_poly) -> arb_poly:
        """Its expansion by x, from those of N and D."""
        other_N, other_D = (acb_poly([c.conjugate() for c in f.coeffs()]) for f in (N, D))
        total = N * other_D * (self.v * -J if self.turned else acb(self.v))
        if self.u or self.w:
            total += N * other_N * self.u + D * other_D * self.w
        return arb_poly([c.real for c in total.coeffs()])


REAL, IMAGINARY = (Form(fmpq(0), fmpq(1), fmpq(0), turned) for turned in (False, True))


def zeros(axis: Axis, q: Form, edges: list[float]) -> list[arb]:
    """Every zero of q between the edges, each alone in its interval; one at x = 0 is not listed."""
    result: list[arb] = []
    order_at_zero = 0 if edges[0] else q.order(axis.loop)

    def known(low: float, high: float) -> bool:
        if low == 0.0 and order_at_zero:
            if high < _NARROWEST * edges[1]:
                raise NumericalError("a crossing next to zero frequency could not be determined")
            inside = axis.series([arb(0).union(arb(high))] * (order_at_zero + 1))
            derivative = q.along(*inside)[order_at_zero]  # keeps its sign: no further zero there
            return bool(derivative > 0 or derivative < 0)
        along, half = q.along(*axis.over(low, high)), _half(low, high)
        value, slope = along(half), along.derivative()(half)
        if value > 0 or value < 0:
            return True
        if slope > 0 or slope < 0:
            result.extend(_root(axis, q, low, high))
            return True
        return False

    _halved_until(known, edges, "what the loop does near {:.10g} rad/s could not be determined: a touch")
    return result


def _halved_until(known: Callable[[float, float], bool], edges: list[float], why: str) -> None:
    """Go through the intervals between the edges in order; those of which nothing is told are halved."""
    stack, count = [*pairwise(edges)][::-1], 0
    while stack:
        low, high = stack.pop()
        count += 1
        if known(low, high):
            continue
        if count > _MOST_INTERVALS:
            raise NumericalError(
                f"{count} certified intervals reach no farther than {low:.6g} rad/s of {edges[-1]:.6g}"
            )
        if high - low < _NARROWEST * high:
            raise NumericalError(why.format(low))
        middle = 0.5 * (low + high)
        stack += [(middle, high), (low, middle)]


def _root(axis: Axis, q: Form, low: float, high: float) -> list[arb]:
    """The only zero of a monotone q on [low, high), if there is one."""

    def value(x: float) -> arb:
        return q.along(*axis.series((arb(x),)))[0]

    a, b = value(low), value(high)
    if not (a > 0 or a < 0) or not (b > 0 or b < 0):
        raise NumericalError(f"a crossing at {low:.10g} rad/s itself could not be determined")
    if (a > 0) == (b > 0):
        return []
    return [arb(root(lambda x: float((value(x) / (b - a)).mid()), low, high))]


def _order(series: fmpq_poly, first: int) -> int:
    """The first power, counted in twos, whose coefficient is not zero."""
    for k in range(first, HIGHEST_ORDER, 2):
        if series[k] != 0:
            return k
    raise NumericalError("the loop does not leave the line at zero frequency")


def turn(axis: Axis, edges: list[float]) -> arb:
    """Change of the angle of N + D along the intervals, rad."""
    total, last = arb(0), sum(axis.values(arb(0)), acb(0))

    def known(low: float, high: float) -> bool:
        nonlocal total, last
        N, D = axis.over(low, high)
        F = N + D
        if F[0].contains(0) or not (F(acb(_half(low, high))) / F[0]).real > 0:
            return False
        here = sum(axis.values(arb(high)), acb(0))
        total += (here / F[0]).arg() - (last / F[0]).arg()
        last = here
        return True

    _halved_until(
        known, edges, "the turn of 1 + L near {:.10g} rad/s could not be determined from one through zero"
    )
    return total


def smallest(axis: Axis, distance: Distance, start: Place = NOWHERE, top: float | None = None) -> Place:
    """The smallest value up to ``top``, or everywhere, and its place.

    There is no zero of the distance less that value, or a smaller one is found.

    Under a delay 1 + L comes nearer than at infinity somewhere, however far; the last of `_AT_END` is how
    small a difference is looked for.
    """
    from scipy.optimize import minimize_scalar  # takes a tenth of a short command to load

    loop, at_end, somewhere = axis.loop, distance.at_no_gain, 10.0 * axis.loop.lowest
    value, w = min(
        start, (at_end, math.inf), _at_rest(axis, distance), (_value(axis, distance, somewhere), somewhere)
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
            for a, b in pairwise(float(x.mid()) for x in inside):
                near, accuracy = partial(_value, axis, distance), {"xatol": 1e-9 * b}
                best = minimize_scalar(near, bounds=(a, b), method="bounded", options=accuracy)
                value, w = min((value, w), (float(best.fun), float(best.x)))
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
