"""Margins of a rational loop, alone or behind a delay, in double precision: checked, or doubtful."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.assemble import Figures, assembled, far_note, out_of_sight, within
from actuator_lti.margins.axis_search import FAR_LOG, Found, passages, search
from actuator_lti.margins.collocation import closed_loop_matrix, points_for
from actuator_lti.margins.delay_form import in_series
from actuator_lti.margins.distances import DISK, MODULUS, Distance
from actuator_lti.margins.factored import Response, factored
from actuator_lti.margins.factors_on_axis import Factored, half_turn
from actuator_lti.margins.loop import Complex, Mask, RationalLoop, Real
from actuator_lti.margins.nearest import nearest
from actuator_lti.margins.poles import SortedPoles, polynomial_roots, sorted_poles
from actuator_lti.margins.results import Agreement, GainMargin, PhaseMargin, StabilityMargins
from actuator_lti.margins.trust import MOST_ERROR, Doubtful, error_bound, hardly_placed

_METHOD = "factors of the loop, bounded over whole intervals of frequency; crossings polished by Newton"
_WIDEST = 1e6  # ratio of poles and zeros up to which double precision is asked
_NEAR_ONE = 1e-6
_LEAST = math.exp(-FAR_LOG)
_HARDLY = 1e-12  # rad
_FLOORS = (0.01, 0.1, 0.5, 0.9)  # gain below which, behind a delay, no crossing of the real axis is listed
_LEAST_GAIN = 1e-8
_MOST_TURNS = 100_000  # of the delay that are listed, about a second's work
_AT_NYQUIST = 1e8  # of the largest root: next to nothing is left of the half circle
_NEAR = 1e-4  # relative: a crossing of the factors and one of the loop
_LOW, _HIGH = 1e-3, 1e3  # of the smallest and largest root: where the ends of the axis begin


def checked_margins(
    loop: RationalLoop, delay_s: float = 0.0, band_rad_s: tuple[float, float] | None = None
) -> StabilityMargins:
    """All margins of a rational loop, alone or behind a delay, in double precision, see `stability_margins`.

    Raises
    ------
    Doubtful
        They could not be checked.
    InputError
        A direct feed-through of one or more behind a delay.
    """
    try:
        with np.errstate(all="ignore"):
            return _margins(loop, delay_s, band_rad_s)
    except (Doubtful, InputError, NumericalError):
        raise
    except (
        ArithmeticError,
        ValueError,
        RuntimeError,
    ) as error:  # LinAlgError, overflow, a search without end
        raise Doubtful(str(error)) from error


def _margins(loop: RationalLoop, delay_s: float, band: tuple[float, float] | None) -> StabilityMargins:
    _refuse(loop, delay_s)
    response = Response(loop, delay_s / (loop.period_s or 1.0))
    poles = sorted_poles(loop.A, loop.in_z)
    closed = None
    if not delay_s:
        closed = sorted_poles(loop.A - np.outer(loop.b / (1.0 + loop.d), loop.c), loop.in_z)
    _trust_poles(loop, poles, closed)
    factors = factored(response, poles)
    if np.unique(factors.weights[factors.roots == 0.0]).size > 1:
        raise Doubtful("poles and zeros at zero frequency")
    parts, listed_to, floor = _parts(factors, band)
    ends = _ends(factors, response)
    gain_w, real_w, rising, far = _merged(parts)
    gain_x, gain_L = response.polished(gain_w, gain=True)
    real_x, real_L = response.polished(real_w, gain=False)
    _trust_crossings(loop, gain_x, real_x, ends)
    count = poles.unstable - _half_turns_about(factors, response, parts, ends, real_L, rising)
    second = _poles_behind_delay(loop, delay_s, gain_x) if closed is None else closed.unstable
    if second is not None and count != second:
        raise Doubtful("poles and Nyquist count disagree")
    listed = np.log(np.abs(real_L)) >= -FAR_LOG
    far += int(np.count_nonzero(~listed)) + sum(value.real < 0.0 and out_of_sight(value) for value in ends)
    if math.isfinite(listed_to) and band is None and factors.at_infinity:
        listed &= np.abs(real_L) >= floor
    figures = Figures(
        _gain_margins(response, real_x[listed], real_L[listed], ends),
        tuple(
            PhaseMargin(float(deg) if deg > -180.0 else 180.0, loop.frequency(x))
            for deg, x in zip(np.degrees(np.angle(-gain_L)), gain_x, strict=True)
        ),
        *_distances(factors, response, parts, ends, (MODULUS, DISK)),
    )
    top = listed_to if math.isfinite(listed_to) else None
    result = assembled(
        loop.period_s,
        Agreement(second, count, 0),
        figures,
        method=_METHOD,
        notes=(*far_note(far), *_tail_note(factors, top, band, floor)),
        evidence="checked",
        reason=_reason(real_L[listed], second is not None, closed is not None),
        delay_s=delay_s,
        band_rad_s=None if top is None else (0.0, top),
    )
    return within(result, band)


def nearest_behind_delay(
    loop: RationalLoop, delay_s: float, distances: tuple[Distance, ...]
) -> list[tuple[float, float]]:
    """Smallest values of distances, each with its frequency.

    Raises
    ------
    Doubtful
        They could not be checked.
    """
    with np.errstate(all="ignore"):
        response = Response(loop, delay_s / (loop.period_s or 1.0))
        factors = factored(response, sorted_poles(loop.A, loop.in_z))
        parts, _, _ = _parts(factors, None)
        return _distances(factors, response, parts, _ends(factors, response), distances)


def first_turn(loop: RationalLoop, delay_s: float, floor: float) -> float | None:
    """Where the phase first falls to 90 deg below that at zero frequency; ``None``: not above the floor.

    Raises
    ------
    Doubtful
        It could not be checked.
    """
    with np.errstate(all="ignore"):
        response = Response(loop, delay_s / (loop.period_s or 1.0))
        factors = factored(response, sorted_poles(loop.A, loop.in_z))
        level = half_turn(factors.log_at(0.0)[1]) - 0.5 * math.pi
        if factors.delay:  # no factor turns by more than half a turn
            top = (factors.roots.size + 1.0) * math.pi / factors.delay
        else:
            top = _AT_NYQUIST * max(float(np.abs(factors.roots).max(initial=0.0)), 1.0)
        top = float(passages(factors, 0.0, top, math.log(floor)).min(initial=top))
        turns = passages(factors, 0.0, top, level, 1)
        if not turns.size:
            return None
        sign = cmath.exp(-1j * level)

        def beyond(w: float) -> float:
            return float(np.angle(response.at(np.array([w]))[0] * sign))

        near = float(turns[0])
        w = brentq(beyond, near * (1.0 - _NEAR), near * (1.0 + _NEAR), xtol=1e-300, rtol=1e-14)
        return response.frequency(float(w))


def _refuse(loop: RationalLoop, delay_s: float) -> None:
    if delay_s:
        if loop.period_s is None and abs(loop.d) >= 1.0:
            raise InputError(
                f"a direct feed-through of {loop.d:.6g} behind a delay: the gain never falls below one, and "
                "the closed loop of neutral type has no margins"
            )
        if not loop.order and not loop.d:
            raise Doubtful("no loop")
        return
    if not loop.order or not loop.b.any() or not loop.c.any() or abs(1.0 + loop.d) <= _NEAR_ONE:
        raise Doubtful("no dynamics, or hardly well posed")


def _tail_note(
    factors: Factored, top: float | None, band: tuple[float, float] | None, floor: float
) -> tuple[str, ...]:
    if top is None or band is not None:
        return ()
    if not factors.at_infinity:
        every = 2.0 * math.pi / factors.delay
        return (
            f"gain margins beyond {top:.4g} rad/s, every {every:.4g} rad/s without end, are not listed: "
            f"their ratio is {math.exp(-factors.log_gain):.6g}",
        )
    return (f"gain margins above {-20.0 * math.log10(floor):.4g} dB beyond {top:.4g} rad/s are not listed",)


def _poles_behind_delay(loop: RationalLoop, delay_s: float, gain_x: Real) -> int | None:
    """Unstable closed-loop poles by collocation; ``None``: part of a sample, or too many turns."""
    if loop.period_s is not None:
        return None
    form = in_series(loop, delay_s)
    points = points_for(form, 2.0 * float(gain_x.max(initial=0.0)))
    return None if points is None else sorted_poles(closed_loop_matrix(form, points), False).unstable


def _reason(real_L: Complex, twice: bool, sure: bool) -> str:
    residual = max(float(np.abs(real_L.imag / np.abs(real_L)).max(initial=0.0)), 1e-16)
    stability = "poles and Nyquist count agree" if twice else "stability by the Nyquist count alone"
    return (
        f"{stability}, intervals leave no crossing out, every gain margin puts a closed-loop "
        f"pole on the border (residual {residual:.0e})"
        + (", no pole lies within its own error of it" if sure else "")
    )


def _trust_poles(loop: RationalLoop, poles: SortedPoles, closed: SortedPoles | None) -> None:
    """Poles that are clear of the border, but for exact ones at zero frequency."""
    if poles.doubtful or (closed is not None and (closed.border or closed.doubtful)):
        raise Doubtful("a pole may lie on either side of the border")
    if poles.border != poles.at_dc:
        raise Doubtful("poles on the border")
    if hardly_placed(loop, poles.values, False):
        raise Doubtful("rounding of the coefficients moves a pole over the border")
    if closed is not None and hardly_placed(loop, closed.values, True):
        raise Doubtful("rounding of the coefficients moves a closed-loop pole over the border")
    size = np.abs(poles.values - 1.0) if loop.in_z else np.abs(poles.values)
    if loop.numerator is not None:
        size = np.concatenate((size, np.abs(polynomial_roots(loop.numerator))))
    size = size[size > 0.0]
    if size.size and float(size.max()) > _WIDEST * float(size.min()):
        raise Doubtful("poles and zeros over too many decades")


@dataclass(frozen=True)
class _Part:
    """A part of the axis: up to the middle, or from there on as 1/w."""

    factors: Factored
    found: Found
    beyond: bool


def _parts(factors: Factored, band: tuple[float, float] | None) -> tuple[list[_Part], float, float]:
    """The axis in one part where the gain falls off or turns for ever, else in two: infinity is zero of 1/w.

    With them, up to where crossings of the real axis are listed, and above which gain.
    """
    size = np.abs(factors.roots[factors.roots != 0.0])
    scale = 1.0 / factors.delay if factors.delay else 1.0
    least, most = (float(size.min()), float(size.max())) if size.size else (scale, scale)
    low = _start(factors, _LOW * min(least, scale if factors.delay else least))
    if factors.delay:
        most_turned = 2.0 * math.pi * _MOST_TURNS / factors.delay
        high, listed_to, floor = _turning_stop(factors, low, most, most_turned)
        if band is not None:
            listed_to, high = float(band[1]), max(high, 2.0 * float(band[1]))
        if listed_to > most_turned:
            turns = factors.delay * listed_to / (2.0 * math.pi)
            raise NumericalError(
                f"the delay turns the loop {turns:.1e} times where margins are listed; "
                "shorten the delay, or ask for a narrower band_rad_s"
            )
        return [_Part(factors, search(factors, low, high, listed_to), False)], listed_to, floor
    if factors.at_infinity:
        return [_Part(factors, search(factors, low, _stop(factors, _HIGH * most)), False)], math.inf, 0.0
    middle, mirrored = 2.0 * most, factors.reciprocal()
    return (
        [
            _Part(factors, search(factors, low, middle), False),
            _Part(mirrored, search(mirrored, _start(mirrored, _LOW / most), 1.0 / middle), True),
        ],
        math.inf,
        0.0,
    )


def _turning_stop(
    factors: Factored, low: float, most: float, most_turned: float
) -> tuple[float, float, float]:
    """Under a delay: a frequency above which |L| is next to nothing, and up to where crossings are listed.

    With them the gain above which they are: the lowest of `_FLOORS` that does not list too many turns.
    """
    slope, high = factors.at_infinity, _HIGH * most
    if not slope:
        listed_to = 10.0 * most + 8.0 * math.pi / factors.delay
        return 10.0 * max(high, listed_to), listed_to, 0.0
    top = max(high, high * math.exp((math.log(_LEAST_GAIN) - factors.log_at(high)[0]) / slope))
    for floor in _FLOORS:
        listed_to = float(passages(factors, low, top, math.log(floor)).max(initial=low))
        if listed_to <= most_turned:
            break
    return top, listed_to, floor


def _stop(factors: Factored, high: float) -> float:
    """A frequency above which gain and phase follow the slope at infinity."""
    slope = factors.at_infinity
    high = max(high, 10.0 * high * math.exp(-factors.log_at(high)[0] / slope))
    if not high < 1e150:
        raise Doubtful("too wide a range")
    if slope % 2 == 0 and abs(math.sin(factors.log_at(high)[1])) < _HARDLY:
        raise Doubtful("the phase hardly leaves the real axis at an end of the axis")
    return high


def _start(factors: Factored, low: float) -> float:
    """Zero, or a frequency below which gain and phase follow the roots at zero."""
    order = factors.at_zero
    if not order:
        if abs(factors.log_at(0.0)[0]) < _NEAR_ONE:
            raise Doubtful("the gain is one at an end of the axis")
        return 0.0
    low = min(low, 0.1 * low * math.exp(-factors.log_at(low)[0] / order))
    if not 1e-150 < low < 1e150:
        raise Doubtful("too wide a range")
    if order % 2 == 0 and abs(math.sin(factors.log_at(low)[1])) < _HARDLY:
        raise Doubtful("the phase hardly leaves the real axis at an end of the axis")
    return low


def _ends(factors: Factored, response: Response) -> tuple[complex, complex]:
    """L at both ends of the axis: infinity where it has a pole, exactly 0 where it has a zero."""
    first = response.at_rest() if not factors.at_zero else complex(math.inf if factors.at_zero < 0.0 else 0.0)
    return first, response.at_end()


def _merged(parts: list[_Part]) -> tuple[Real, Real, Mask, int]:
    """All crossings in order of w."""

    def whole(name: str) -> Any:
        return np.concatenate([getattr(part.found, name)[:: -1 if part.beyond else 1] for part in parts])

    beyond = [part.beyond for part in parts]

    def in_w(name: str) -> Real:
        late = np.repeat(beyond, [getattr(part.found, name).size for part in parts])
        values = whole(name)
        return np.asarray(np.where(late, 1.0 / values, values))

    return in_w("gain_w"), in_w("real_w"), whole("rising"), sum(part.found.far for part in parts)


def _half_turns_about(
    factors: Factored,
    response: Response,
    parts: list[_Part],
    ends: tuple[complex, complex],
    real_L: Complex,
    rising: Mask,
) -> int:
    """Turns of 1 + L about the origin from zero frequency to the end of the axis, in half turns."""
    around = np.abs(real_L) > 1.0
    cut = int(np.count_nonzero(rising & around)) - int(np.count_nonzero(~rising & around))
    cut += sum(part.found.turns for part in parts)
    angle, first = _from_zero(factors, response, parts[0].found, ends[0])
    more, last = _to_end(response, parts[-1], ends[1])
    return round((angle + last - first + more) / math.pi) + 2 * cut


def _from_zero(factors: Factored, response: Response, found: Found, dc: complex) -> tuple[float, float]:
    """The turn of 1 + L up to just above zero frequency, and its angle there."""
    if not factors.at_zero < 0.0:
        return 0.0, _leaving(1.0 + dc.real, found)
    low = float(found.known.low[0])
    on_real, on_axis = response.real_point(low), complex(response.at(np.array([low]))[0])
    turn, about = _angle_between(1.0 + on_real, 1.0 + on_axis), 0.5 * math.pi * factors.at_zero
    turn += 2.0 * math.pi * round((about - turn) / (2.0 * math.pi))
    return turn, cmath.phase(1.0 + on_axis)


def _angle_between(start: complex, stop: complex) -> float:
    """Angle from one point to another of the same closed half plane."""
    return cmath.phase(stop * start.conjugate())


def _leaving(F: float, found: Found) -> float:
    """The angle of 1 + L beside an end of the axis, where it is F."""
    if F >= 0.0:
        return 0.0
    return -math.pi if found.known.first[3, 0] > 0.0 else math.pi


def _to_end(response: Response, part: _Part, end: complex) -> tuple[float, float]:
    """The turn of 1 + L onto the real axis at the end, and its angle before."""
    F = 1.0 + end
    if response.delay:
        return _angle_between(F, complex(F.real)), cmath.phase(F)
    return 0.0, -_leaving(F.real, part.found)


def _trust_crossings(loop: RationalLoop, gain_x: Real, real_x: Real, ends: tuple[complex, complex]) -> None:
    """The error bound of every crossing, and of the gain at both ends."""
    at_ends = [x for x, L in zip((0.0, loop.end), ends, strict=True) if _LEAST <= abs(L) < math.inf]
    if loop.numerator is None and not loop.in_z:
        at_ends = [x for x in at_ends if x < math.inf]  # the direct feed-through is an entry: exact
    if not (error_bound(loop, np.concatenate((gain_x, real_x, at_ends))) <= MOST_ERROR).all():
        raise Doubtful("the loop is too badly conditioned")


def _gain_margins(
    response: Response, x: Real, L: Complex, ends: tuple[complex, complex]
) -> tuple[GainMargin, ...]:
    def at_end(value: complex, place: float) -> list[GainMargin]:
        if not value.real < 0.0 or out_of_sight(value) or not math.isfinite(abs(value)):
            return []
        return [GainMargin(-1.0 / value.real, place)]

    loop = response.loop
    crossed = [GainMargin(float(1.0 / abs(v)), loop.frequency(at)) for at, v in zip(x, L, strict=True)]
    last = (
        ()
        if loop.period_s is None and response.delay
        else at_end(response.onto_axis(ends[1]), loop.frequency(loop.end))
    )
    return (*at_end(ends[0], 0.0), *crossed, *last)


def _distances(
    factors: Factored,
    response: Response,
    parts: list[_Part],
    ends: tuple[complex, complex],
    distances: tuple[Distance, ...],
) -> list[tuple[float, float]]:
    """Smallest values of distances, each with its frequency."""
    nearest_ends = (ends[0], complex(-abs(ends[1])) if factors.delay else ends[1])
    best = [
        min((d.at(value), w) for value, w in zip(nearest_ends, (0.0, math.inf), strict=True))
        for d in distances
    ]
    for part in parts:
        found = nearest(part.factors, part.found.known, distances, best)
        best = [
            (new[0], 1.0 / new[1] if part.beyond else new[1]) if new[0] < old[0] else old
            for new, old in zip(found, best, strict=True)
        ]
    out = []
    for d, (value, w) in zip(distances, best, strict=True):
        inside = 0.0 < w < math.inf
        out.append((d.at(complex(response.at(np.array([w]))[0])) if inside else value, response.frequency(w)))
    return out
