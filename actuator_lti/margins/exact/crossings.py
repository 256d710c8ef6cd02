"""Crossings and smallest distances of an exact loop: each from a certified root."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from itertools import pairwise

import numpy as np
from flint import acb, arb, fmpz, fmpz_poly

from actuator_lti.errors import NumericalError
from actuator_lti.margins.assemble import Crossing
from actuator_lti.margins.distances import Distance
from actuator_lti.margins.exact.loop import ExactLoop
from actuator_lti.margins.exact.real_roots import EVERYWHERE, Spans, octaves, positive_roots
from actuator_lti.margins.exact.roots import FEW, Split, all_roots, at_enough_bits, free_of, split
from actuator_lti.margins.trust import TOUCH
from actuator_lti.systems.precision import precision

_FIRST_BITS = 96
_TURN_BITS = 48
_LARGE = 60  # of the degree of a slope: its roots are looked for where the distance is small alone
_SAMPLES = 200
_SAME = 40  # bits: values this close are one
_ACCURATE = 56  # bits of a figure
_NEAR = 1e-3  # relative: a pair this close may be a touch
_ZERO = 1e-18  # of a distance


@dataclass(frozen=True)
class _Line:
    """Where a loop meets the unit circle, or the real axis: at the positive roots of a polynomial in w^2."""

    N: Split
    D: Split
    p: fmpz_poly
    off: Callable[[Split, Split, arb], arb]  # the distance to the line

    @cached_property
    def turns(self) -> list[arb]:
        """Where the loop may just miss the line; not looked for where few roots are found all at once.

        A miss is a pair of complex roots, with a turn of p between, or of its slope where a root lies beside.
        """
        slope = self.p.derivative()
        both = () if self.p.degree() <= FEW else (slope, slope.derivative())
        with precision(_TURN_BITS):
            return [v.mid() for q in both for v, _ in positive_roots(q)]

    def met(self, turns: Sequence[arb], touched_ends: Sequence[bool] = (False, False)) -> list[Crossing]:
        """The roots, touches merged."""
        few, bits = self.p.degree() <= FEW, _FIRST_BITS + self.p.degree()
        with precision(bits):
            missed = few or any(abs(self.off(self.N, self.D, v).mid()) <= 10.0 * TOUCH for v in turns)

        def accurate() -> list[Crossing] | None:
            roots = all_roots(self.p) if missed or any(touched_ends) else []
            met = [(v, times % 2 == 0) for v, times in positive_roots(self.p)]
            met = _merged(met, roots, partial(self.off, self.N, self.D), touched_ends)
            values = [(v, self.N.at(v) / self.D.at(v), touch) for v, touch in met]
            if not all(L.rel_accuracy_bits() >= _ACCURATE for _, L, _ in values):
                return None
            return [Crossing(float(v.sqrt().mid()), complex(L), touch) for v, L, touch in values]

        return at_enough_bits(accurate, bits, "a crossing of the loop")


def _off_circle(N: Split, D: Split, v: arb) -> arb:
    return (N.at(v).abs_upper() / D.at(v).abs_lower()).log()


def _off_axis(N: Split, D: Split, v: arb) -> arb:
    L = N.at(v) / D.at(v)
    return L.imag / L.abs_lower()


@lru_cache(maxsize=8)
def _lines(loop: ExactLoop) -> tuple[_Line, _Line]:
    N, D = split(loop.N), split(loop.D)
    gain = N.square - D.square
    if gain.degree() < 0:
        raise NumericalError("the gain of the loop is one at every frequency: it has no phase margin")
    phase = free_of(N.odd * D.even - N.even * D.odd, N.square, D.square)
    return _Line(N, D, gain, _off_circle), _Line(N, D, phase, _off_axis)


def crossings(
    loop: ExactLoop, near: ExactLoop, merge: bool = False
) -> tuple[tuple[Crossing, ...], tuple[Crossing, ...]]:
    """Every crossing of the unit circle, and of the negative real axis.

    The turns of a loop ``near`` it, or its own, tell whether a line is just missed: what moves a turn moves
    the distance there by its square. With ``merge`` a gain within `TOUCH` of one at an end of the axis is
    one, which is no crossing; between two crossings L that stays so close to the line only touches it in any
    case.
    """
    (circle, axis), (circle_near, axis_near) = _lines(loop), _lines(near)
    both = (loop.N[0], loop.D[0]), loop.at_end
    touched = [
        merge and circle.p[k] != 0 and _near_one(*end) for k, end in zip((0, loop.degree), both, strict=True)
    ]
    gains = circle.met(circle_near.turns, touched)
    reals = [c for c in axis.met(axis_near.turns) if c.L.real < 0.0]
    first, last = (
        [Crossing(w, complex(float(arb(n) / arb(d))))] if n * d < 0 else []
        for w, (n, d) in zip((0.0, math.inf), both, strict=True)
    )
    return tuple(gains), (*first, *reals, *(last if loop.degree else []))


def _near_one(N: fmpz, D: fmpz) -> bool:
    """Whether the gain at an end of the axis is one within `TOUCH`."""
    return N != 0 and D != 0 and abs(float(abs(arb(N) / arb(D)).log())) <= TOUCH


def _merged(
    places: list[tuple[arb, bool]],
    roots: list[tuple[acb, int]],
    off: Callable[[arb], arb],
    touched_ends: Sequence[bool],
) -> list[tuple[arb, bool]]:
    """Pairs of crossings, real or just missed, that count as one touch; and none at a touched end."""
    sizes = [float(abs(root).mid()) for root, _ in roots]
    out: list[tuple[arb, bool]] = []
    for v, touch in places:
        at = float(v.mid())
        if (touched_ends[0] and at <= min(sizes)) or (touched_ends[1] and at >= max(sizes)):
            continue
        close = out and float(((v - out[-1][0]) / v).mid()) < _NEAR
        if close and not touch and not out[-1][1]:
            between = (0.5 * (out[-1][0] + v)).mid()
            if abs(float(off(between).mid())) <= TOUCH:
                out[-1] = (between, True)
                continue
        out.append((v, touch))
    for root, _ in roots:
        missed = root.imag > 0 and root.real > 0 and float((root.imag / root.real).mid()) < _NEAR
        if missed and abs(float(off(root.real.mid()).mid())) <= TOUCH:
            out.append((root.real.mid(), True))
    return sorted(out, key=lambda place: float(place[0].mid()))


def smallest(N: fmpz_poly, D: fmpz_poly, distance: Distance) -> tuple[float, float]:
    """Smallest value of a distance of N/D over w >= 0, infinity included, and its w."""
    above, below = (split(part).square for part in distance.over(N, D))
    if below.degree() < 0:
        return math.inf, 0.0
    candidates = [(_ratio(above, below, lowest=True), 0.0), (_ratio(above, below, lowest=False), math.inf)]
    slope = above.derivative() * below - above * below.derivative()

    spans = _deepest(above, below) if slope.degree() > _LARGE else EVERYWHERE

    def stationary() -> list[tuple[float, float]] | None:
        values = [(above(v) / below(v), v) for v, _ in positive_roots(slope, spans)]
        values = [(value, v) for value, v in values if value.is_finite()]
        if any(x.rel_accuracy_bits() < 53 and float(x.abs_upper()) >= _ZERO**2 for x, _ in values):
            return None
        return [(math.sqrt(max(float(x.mid()), 0.0)), float(v.sqrt().mid())) for x, v in values]

    found = at_enough_bits(stationary, _FIRST_BITS + slope.degree(), "the smallest distance to -1")
    value, w = min([*candidates, *found])
    return (value, w) if value > _ZERO else (0.0, w)


def _deepest(above: fmpz_poly, below: fmpz_poly) -> Spans:
    """Where the square of a distance is below the lowest of some samples, and of one in each such span."""
    spans, level = EVERYWHERE, arb("inf")
    with precision(_FIRST_BITS + 2 * above.degree()):
        places = [arb(2) ** x for x in np.linspace(*octaves(above * below), _SAMPLES).tolist()]
        for _ in range(2):
            level = min([level, *((above(v) / below(v)).upper() for v in places if below(v) > 0)])
            man, exp = (level * (1 + arb((1, -_SAME)))).upper().man_exp()
            over = above * (1 << max(-int(exp), 0)) - below * (man << max(int(exp), 0))
            with precision(_FIRST_BITS):
                edges = [v for v, _ in positive_roots(over)]
            if not edges:
                return EVERYWHERE
            ends = pairwise([edges[0] / 2, *edges, 2 * edges[-1]])
            inside = [(a, b) for a, b in ends if not over((a + b) / 2) > 0]
            places = [((a + b) / 2).mid() for a, b in inside]
            spans = tuple(
                (
                    -math.inf if a < edges[0] else float(a.log().mid()) / math.log(2.0) - _NEAR,
                    math.inf if b > edges[-1] else float(b.log().mid()) / math.log(2.0) + _NEAR,
                )
                for a, b in inside
            )
    return spans


def _ratio(above: fmpz_poly, below: fmpz_poly, lowest: bool) -> float:
    if above.degree() < 0:
        return 0.0
    k, m = (_lowest(above), _lowest(below)) if lowest else (-above.degree(), -below.degree())
    if k != m:
        return 0.0 if k > m else math.inf
    return float((arb(above[abs(k)]) / arb(below[abs(m)])).sqrt())


def _lowest(p: fmpz_poly) -> int:
    return next(k for k in range(p.degree() + 1) if p[k] != 0)
