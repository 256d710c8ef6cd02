"""Margins of a rational loop, alone or behind a delay, in double precision: checked, or doubtful."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from actuator_lti.axis._search import FAR_LOG
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.along import Along
from actuator_lti.margins.axis_search import Factored
from actuator_lti.margins.factored import Response, factored
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.poles import SortedPoles, all_sorted, sorted_poles
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.margins.trust import MOST_ERROR, Doubtful, error_bound, hardly_placed

_WIDEST = 1e6  # ratio of poles and zeros up to which double precision is asked
_NEAR_ONE = 1e-6
_LEAST = math.exp(-FAR_LOG)


def checked_margins(
    loop: RationalLoop, delay_s: float = 0.0, band_rad_s: tuple[float, float] | None = None
) -> StabilityMargins:
    """All margins of a rational loop, alone or behind a delay; `Doubtful` where double precision cannot check
    them.
    """
    return in_double_precision(lambda: _margins(loop, delay_s, band_rad_s))


def in_double_precision(find: Callable[[], StabilityMargins]) -> StabilityMargins:
    """What is found, or `Doubtful` where double precision fails on the way."""
    try:
        with np.errstate(all="ignore"):
            return find()
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
    found = Along.of(factors, response, band)
    _trust_crossings(loop, found.gain_x, found.real_x, found.ends)
    count = poles.unstable - found.half_turns
    second = _poles_behind_delay(response, found.gain_x) if closed is None else closed.unstable
    if second is not None and count != second:
        raise Doubtful("poles and Nyquist count disagree")
    reason = _reason(found.real_L[found.listed], second is not None, closed is not None)
    return found.margins(Agreement(second, count, 0), reason, delay_s)


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


def _poles_behind_delay(response: Response, gain_x: Real) -> int | None:
    """Unstable closed-loop poles of a continuous loop behind a delay, from those without it."""
    if response.loop.period_s is not None:
        return None  # part of a sample: no function of z
    free = sorted_poles(_closed(response.loop), False)
    return None if free.doubtful or free.border else free.unstable + passed_into(response, gain_x)


def passed_into(response: Response, gain_x: Real) -> int:
    """How many closed-loop poles a delay brings into the right half plane.

    As the delay grows, poles pass over the axis only where |L| = 1: by pairs into the right half plane where
    it falls, and back where it rises, at the delay that uses up the phase margin and after each further turn
    (Walton and Marshall, Direct method for TDS stability analysis, IEE Proc. D 134, 1987).
    """
    L, slope = response.loop.response_and_slope(gain_x)
    lead = np.angle(-L) % (2.0 * np.pi)
    passed = np.floor((response.delay * gain_x - lead) / (2.0 * np.pi)) + 1.0
    into = np.where((slope / L).real < 0.0, 2.0, -2.0)
    return int((into * np.maximum(passed, 0.0)).sum())


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
