"""Margins under exact delays by certified intervals: crossings, unstable poles, distances to -1."""

from __future__ import annotations

import math
from itertools import pairwise

from flint import acb, arb, ctx, fmpq_poly
from scipy.optimize import minimize_scalar

from actuator_lti.errors import NumericalError
from actuator_lti.margins.assemble import Figures, assembled, far_note, hidden_notes, out_of_sight
from actuator_lti.margins.delay_setting import FLOOR
from actuator_lti.margins.determined import difference
from actuator_lti.margins.exact_axis import Axis, Form, gain_order, phase_order, turn, zeros
from actuator_lti.margins.exact_delay import ExactDelayLoop
from actuator_lti.margins.exact_findings import Crossing
from actuator_lti.margins.given import ULP
from actuator_lti.margins.results import Agreement, GainMargin, PhaseMargin, StabilityMargins
from actuator_lti.margins.trust import TOUCH

_BITS = 128
_GAIN = Form(arb(1), acb(0), arb(-1))
_PHASE = Form(arb(0), acb(0, -1), arb(0))
_UNDER_ONE = 0.9
_SLACK = 1e-8  # relative: how much lower a smallest distance may be without being found
_AT_END = (0.9, 0.99, 0.999, 0.9999)  # parts of the distance at infinity at which a smaller one is looked for
_ROUNDS = 8
_AT_REST = 1e-3  # how far L has moved from its value at rest where a crossover is one of its own
_METHOD = "zeros of real functions of the axis, parted by intervals in certified arithmetic"
_REASON = f"certified intervals on the exact delays; {ULP} ulp of the entries change nothing"


def certified_delayed_margins(
    loops: tuple[ExactDelayLoop, ...],
    delay_s: float,
    band: tuple[float, float] | None,
    start: StabilityMargins | None = None,
) -> StabilityMargins:
    """All margins of a loop with exact delays, by certified intervals.

    Parameters
    ----------
    loops : tuple of ExactDelayLoop
        The loop, and its neighbours 8 ulp away.
    delay_s : float
        The delay in series, for the result.
    start : StabilityMargins, optional
        The answer in double precision: its distances are where the search for smaller ones begins.

    Raises
    ------
    NumericalError
        Something could not be told.
    """
    with ctx.workprec(_BITS):
        answer, problem = _compared(loops, band, merge=False)
        if problem is not None:
            answer, problem = _compared(loops, band, merge=True)
        near = _at_rest_or_infinity(loops[0])
        if start is not None and start.modulus_margin is not None:
            assert start.modulus_frequency_rad_s is not None
            assert start.disk_margin is not None
            near[0] = (start.modulus_margin, start.modulus_frequency_rad_s)
            near[1] = (start.disk_margin.alpha, start.disk_margin.frequency_rad_s)
        if problem is None:
            axis = Axis(loops[0])
            near = [_distance(axis, near[0], 1.0), _distance(axis, near[1], 2.0)]
    gains, reals, unstable, listed_to = answer
    low, high = (0.0, listed_to) if band is None else band
    figures = Figures(
        tuple(GainMargin(1.0 / abs(c.L), c.w) for c in reals if low <= c.w <= high and not out_of_sight(c.L)),
        tuple(
            PhaseMargin(math.degrees(math.atan2(-c.L.imag, -c.L.real)), c.w)
            for c in gains
            if low <= c.w <= high
        ),
        near[0],
        near[1],
    )
    hidden = loops[0].hidden
    notes = (
        *hidden_notes(hidden.at_zero, hidden.pairs, hidden.right),
        *far_note(sum(out_of_sight(c.L) for c in reals)),
    )
    if band is None:
        notes = (*notes, f"gain margins above 40 dB beyond {listed_to:.4g} rad/s are not listed")
    return assembled(
        None,
        Agreement(None, None) if problem else _agreement(unstable + hidden.right, start),
        figures if problem is None else None,
        method=_METHOD,
        notes=notes,
        evidence="certified" if problem is None else "withheld",
        reason=problem or _REASON,
        delay_s=delay_s,
        band_rad_s=(low, high),
        hidden_border=hidden.on_border,
    )


def _at_rest_or_infinity(loop: ExactDelayLoop) -> list[tuple[float, float]]:
    """Both distances at the nearer end of the axis, each with its frequency."""
    ends = [(1.0, math.inf), (2.0, math.inf)]
    N0, D0 = loop.N.series(1)[0], loop.D.series(1)[0]
    if D0 == 0:
        return ends
    at_rest = float((N0 / D0).p) / float((N0 / D0).q)
    alpha = math.inf if at_rest == 1.0 else abs(2.0 * (1.0 + at_rest) / (1.0 - at_rest))
    return [min(ends[0], (abs(1.0 + at_rest), 0.0)), min(ends[1], (alpha, 0.0))]


def _agreement(unstable: int, start: StabilityMargins | None) -> Agreement:
    """The turn of N + D is proven; the count in double precision stands beside it where it is the same."""
    second = None if start is None else start.agreement.unstable_nyquist
    return Agreement(unstable, second if second == unstable else None)


_Answer = tuple[tuple[Crossing, ...], tuple[Crossing, ...], int, float]


def _compared(
    loops: tuple[ExactDelayLoop, ...], band: tuple[float, float] | None, merge: bool
) -> tuple[_Answer, str | None]:
    """The answer, and what neighbours 8 ulp away say against it.

    With ``merge`` a gain of one at zero frequency, within `TOUCH`, is no crossover; that of the given doubles
    may lie at any frequency below the loop's own.
    """
    answer, *others = (_answer(loop, band, merge) for loop in loops)
    problem = None
    for gains, reals, unstable, _ in others:
        if unstable != answer[2]:
            problem = f"{ULP} ulp of the entries move a closed-loop pole over the border of stability"
        problem = problem or difference(answer[0], gains, "|L| = 1")
        problem = problem or difference(answer[1], reals, "the real axis")
    return answer, problem


def _answer(loop: ExactDelayLoop, band: tuple[float, float] | None, merge: bool) -> _Answer:
    """Gain crossovers, crossings of the negative real axis, unstable closed-loop poles; how far they go."""
    axis = Axis(loop)
    start = _lowest(loop)
    top = _beyond(loop, _UNDER_ONE, start)
    far = _beyond(loop, FLOOR, start) if band is None else max(band[1], top)
    gains = [_crossing(axis, x) for x in zeros(axis, _GAIN, axis.edges(start, top), gain_order(loop))]
    reals = [_crossing(axis, x) for x in zeros(axis, _PHASE, axis.edges(start, far), phase_order(loop))]
    reals = [c for c in reals if c.L.real < 0.0 and (band is not None or abs(c.L) >= FLOOR)]
    N0, D0 = loop.N.series(1)[0], loop.D.series(1)[0]
    at_rest = None if D0 == 0 else float((N0 / D0).p) / float((N0 / D0).q)
    if at_rest is not None and at_rest < 0.0:
        reals = [Crossing(0.0, complex(at_rest)), *reals]
    if merge and at_rest is not None and abs(at_rest - 1.0) <= TOUCH:
        gains = [c for c in gains if abs(c.L - at_rest) > _AT_REST]
    return tuple(gains), tuple(reals), _unstable(axis, axis.edges(start, top)), far


def _crossing(axis: Axis, x: arb) -> Crossing:
    N, D = axis.values(x)
    L = N / D
    if L.rel_accuracy_bits() < 56:
        raise NumericalError(f"a crossing near {float(x.mid()):.10g} rad/s could not be told from a pole")
    return Crossing(float(x.mid()), complex(L))


def _unstable(axis: Axis, edges: list[float]) -> int:
    """Zeros of N + D in the right half plane, from the turn of N + D along the axis (Mikhailov, retarded)."""
    n = axis.loop.degree
    end = sum(axis.values(arb(edges[-1])), acb(0)) / (acb(0, edges[-1]) ** n * _lead(axis.loop))
    count = arb(n) / 2 - (turn(axis, edges) - end.log().imag) / arb.pi()
    whole = count.unique_fmpz()
    if whole is None:
        raise NumericalError("the number of unstable poles could not be told")
    return int(whole)


def _lead(loop: ExactDelayLoop) -> arb:
    return arb(loop.D.terms[0][0][loop.degree])


def _lowest(loop: ExactDelayLoop) -> float:
    """A frequency below the smallest root that any of the polynomials can have, or the turn of any delay."""
    sizes = [1.0]
    for p, tau in (*loop.D.terms, *loop.N.terms):
        c = [abs(float(arb(x).mid())) for x in p.coeffs()]
        first = next(k for k, x in enumerate(c) if x)
        if len(c) > first + 1:
            sizes.append(
                min((c[first] / x) ** (1.0 / (k - first)) for k, x in enumerate(c) if k > first and x)
            )
        if tau != 0:
            sizes.append(1.0 / float(arb(tau).mid()))
    return 0.1 * min(sizes[1:] or sizes)


def _beyond(loop: ExactDelayLoop, gain: float, start: float) -> float:
    """A frequency above which |L| < gain: the leading power against all other coefficients together."""

    def holds(x: float) -> bool:
        above = sum((_size(p, x) for p, _ in loop.N.terms), arb(0))
        rest = sum((_size(p, x) for p, _ in loop.D.terms), arb(0))
        lead = abs(_lead(loop)) * arb(x) ** loop.degree
        return bool(above < gain * (2 * lead - rest))

    x = max(start, 1e-300)
    while not holds(x):
        x *= 2.0
        if x > 1e300:
            raise NumericalError("the gain of the loop does not fall off")
    return x


def _size(p: fmpq_poly, x: float) -> arb:
    total, power = arb(0), arb(1)
    for c in p.coeffs():
        total += abs(arb(c)) * power
        power = power * x
    return total


def _distance(axis: Axis, result: tuple[float, float], at_end: float) -> tuple[float, float]:
    """The smallest distance and its place: no zero of the distance less that value, or a smaller one.

    Under a delay 1 + L comes nearer than at infinity somewhere, however far; the last of `_AT_END` is how
    small a difference is looked for.
    """
    start, (value, w) = _lowest(axis.loop), result
    for level in (*_AT_END, 1.0 - _SLACK):
        for _ in range(_ROUNDS):
            below = min(value * (1.0 - _SLACK), level * at_end)
            if below < _SLACK or (level == 1.0 - _SLACK and value == at_end):
                return value, w
            ratio = (
                below / at_end
            )  # |L| < (1 - r)/(1 + r) keeps both distances above r times that at infinity
            top = _beyond(axis.loop, (1.0 - ratio) / (1.0 + ratio), start)
            inside = zeros(axis, _nearer(below, at_end), axis.edges(start, top))
            if not inside:
                break
            value, w = min(_least(axis, float(a.mid()), float(b.mid()), at_end) for a, b in pairwise(inside))
        if value < level * at_end:
            return value, w
    return value, w


def _nearer(distance: float, at_end: float) -> Form:
    """Positive where L is farther than that: |N + D|^2 - m^2 |D|^2, or 4 |N + D|^2 - alpha^2 |D - N|^2."""
    k = arb(distance) ** 2
    return Form(arb(1), acb(2), 1 - k) if at_end == 1.0 else Form(4 - k, 8 + 2 * acb(k), 4 - k)


def _least(axis: Axis, low: float, high: float, at_end: float) -> tuple[float, float]:
    """Smallest distance between two places, and where."""

    def distance(x: float) -> float:
        N, D = (complex(value) for value in axis.values(arb(x)))
        return abs(N + D) / abs(D) if at_end == 1.0 else 2.0 * abs(N + D) / abs(D - N)

    best = minimize_scalar(distance, bounds=(low, high), method="bounded", options={"xatol": 1e-9 * high})
    return float(best.fun), float(best.x)
