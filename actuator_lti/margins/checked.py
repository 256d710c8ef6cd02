"""Margins of a rational loop, alone or behind a delay, in double precision: checked, or doubtful."""

from __future__ import annotations

import math

import numpy as np

from actuator_lti.axis._search import FAR_LOG
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.assemble import Figures, assembled, far_note, out_of_sight, within
from actuator_lti.margins.axis_parts import axis_ends, axis_parts, distances_over, half_turns_about, merged
from actuator_lti.margins.axis_search import Factored
from actuator_lti.margins.distances import DISK, MODULUS
from actuator_lti.margins.factored import Response, factored
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.poles import SortedPoles, all_sorted, sorted_poles
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement, GainMargin, PhaseMargin
from actuator_lti.margins.trust import MOST_ERROR, Doubtful, error_bound, hardly_placed

_METHOD = "factors of the loop, bounded over whole intervals of frequency; crossings polished by Newton"
_WIDEST = 1e6  # ratio of poles and zeros up to which double precision is asked
_NEAR_ONE = 1e-6
_LEAST = math.exp(-FAR_LOG)


def checked_margins(
    loop: RationalLoop, delay_s: float = 0.0, band_rad_s: tuple[float, float] | None = None
) -> StabilityMargins:
    """All margins of a rational loop, alone or behind a delay; `Doubtful` where double precision cannot check
    them.
    """
    try:
        with np.errstate(all="ignore"):
            return _margins(loop, delay_s, band_rad_s)
    except (InputError, NumericalError):
        raise
    except (ArithmeticError, ValueError, RuntimeError) as error:  # LinAlgError, overflow, no end of a search
        raise Doubtful(f"double precision fails: {error}") from error


def _margins(loop: RationalLoop, delay_s: float, band: tuple[float, float] | None) -> StabilityMargins:
    _refuse(loop, delay_s)
    response = Response(loop, delay_s / (loop.period_s or 1.0))
    poles, *more = all_sorted((loop.A,) if delay_s else (loop.A, _closed(loop)), loop.in_z)
    closed = more[0] if more else None
    _trust_poles(loop, poles, closed)
    factors = factored(response, poles)
    _trust_factors(loop, poles, factors)
    parts, listed_to, floor = axis_parts(factors, band)
    ends = axis_ends(factors, response)
    gain_w, real_w, rising, far = merged(parts)
    gain_x, gain_L = response.polished(gain_w, gain=True)
    real_x, real_L = response.polished(real_w, gain=False)
    _trust_crossings(loop, gain_x, real_x, ends)
    count = poles.unstable - half_turns_about(factors, response, parts, ends, real_L, rising)
    second = _poles_behind_delay(response, gain_x) if closed is None else closed.unstable
    if second is not None and count != second:
        raise Doubtful("poles and Nyquist count disagree")
    listed = np.abs(np.log(np.abs(real_L))) <= FAR_LOG
    far += int(np.count_nonzero(~listed))
    far += sum(-math.inf < value.real < 0.0 and out_of_sight(value) for value in ends)
    if math.isfinite(listed_to) and band is None and factors.at_infinity:
        listed &= np.abs(real_L) >= floor
    figures = Figures(
        _gain_margins(response, real_x[listed], real_L[listed], ends),
        tuple(
            PhaseMargin(float(deg) if deg > -180.0 else 180.0, loop.frequency(x))
            for deg, x in zip(np.degrees(np.angle(-gain_L)), gain_x, strict=True)
        ),
        *distances_over(factors, response, parts, ends, (MODULUS, DISK)),
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


def _closed(loop: RationalLoop) -> Real:
    return np.asarray(loop.A - np.outer(loop.b / (1.0 + loop.d), loop.c))


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
        raise Doubtful("the loop has no dynamics, or 1 + L(infinity) is next to zero")


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


def _poles_behind_delay(response: Response, gain_x: Real) -> int | None:
    """Unstable closed-loop poles of a continuous loop behind a delay, from those without and the crossovers.

    As the delay grows, poles pass over the axis only where |L| = 1: by pairs into the right half plane where
    it falls, and back where it rises, at the delay that uses up the phase margin and after each further turn
    (Walton and Marshall, Direct method for TDS stability analysis, IEE Proc. D 134, 1987).
    """
    loop = response.loop
    if loop.period_s is not None:
        return None  # part of a sample: no function of z
    free = sorted_poles(_closed(loop), False)
    if free.doubtful or free.border:
        return None
    L, slope = loop.response_and_slope(gain_x)
    lead = np.angle(-L) % (2.0 * np.pi)
    passed = np.floor((response.delay * gain_x - lead) / (2.0 * np.pi)) + 1.0
    into = np.where((slope / L).real < 0.0, 2.0, -2.0)
    return free.unstable + int((into * np.maximum(passed, 0.0)).sum())


def _reason(real_L: Complex, twice: bool, sure: bool) -> str:
    residual = max(float(np.abs(real_L.imag / np.abs(real_L)).max(initial=0.0)), 1e-16)
    stability = "poles and Nyquist count agree" if twice else "stability by the Nyquist count alone"
    return (
        f"{stability}, intervals leave no crossing out, every gain margin puts a closed-loop "
        f"pole on the stability boundary (residual {residual:.0e})"
        + (", no pole lies within its own error of it" if sure else "")
    )


def _trust_poles(loop: RationalLoop, poles: SortedPoles, closed: SortedPoles | None) -> None:
    """Poles that are clear of the border, but for exact ones at zero frequency."""
    if poles.doubtful or (closed is not None and (closed.border or closed.doubtful)):
        raise Doubtful("a pole may lie on either side of the stability boundary")
    if poles.border != poles.at_dc:
        raise Doubtful("open-loop poles lie on the stability boundary")
    if hardly_placed(loop, poles.values, False):
        raise Doubtful("rounding of the coefficients moves a pole across the stability boundary")
    if closed is not None and hardly_placed(loop, closed.values, True):
        raise Doubtful("rounding of the coefficients moves a closed-loop pole across the stability boundary")


def _trust_factors(loop: RationalLoop, poles: SortedPoles, factors: Factored) -> None:
    at_zero = factors.weights[factors.roots == 0.0]
    if at_zero.size and at_zero.min() != at_zero.max():
        raise Doubtful("poles and zeros at zero frequency may cancel")
    roots = factors.roots
    if loop.coefficients is None:  # zeros at infinity come out far away
        roots = poles.values - 1.0 if loop.in_z else poles.values
    size = np.abs(roots[roots != 0.0])
    if size.size and float(size.max()) > _WIDEST * float(size.min()):
        raise Doubtful(f"poles and zeros are more than {_WIDEST:g} apart")


def _trust_crossings(loop: RationalLoop, gain_x: Real, real_x: Real, ends: tuple[complex, complex]) -> None:
    """The error bound of every crossing, and of the gain at both ends."""
    at_ends = [x for x, L in zip((0.0, loop.end), ends, strict=True) if _LEAST <= abs(L) < math.inf]
    if loop.coefficients is None and not loop.in_z:
        at_ends = [x for x in at_ends if x < math.inf]  # the direct feed-through is an entry: exact
    if not (error_bound(loop, np.concatenate((gain_x, real_x, at_ends))) <= MOST_ERROR).all():
        raise Doubtful(f"rounding of the entries moves L at a crossing by more than {MOST_ERROR:g} of it")


def _gain_margins(
    response: Response, x: Real, L: Complex, ends: tuple[complex, complex]
) -> tuple[GainMargin, ...]:
    def at_end(value: complex, place: float) -> list[GainMargin]:
        if not value.real < 0.0 or out_of_sight(value):
            return []
        return [GainMargin(-1.0 / value.real, place)]

    loop = response.loop
    crossed = [GainMargin(float(1.0 / abs(v)), loop.frequency(at)) for at, v in zip(x, L, strict=True)]
    last = 0j if loop.period_s is None and response.delay else response.onto_axis(ends[1])
    return (*at_end(ends[0], 0.0), *crossed, *at_end(last, loop.frequency(loop.end)))
