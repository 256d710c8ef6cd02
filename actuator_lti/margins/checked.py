"""Margins of a rational loop, alone or behind a delay, in double precision: checked, or doubtful."""

import math

import numpy as np

from actuator_lti.axis._search import FAR_LOG
from actuator_lti.errors import InputError
from actuator_lti.margins.along import Along
from actuator_lti.margins.axis_search import Factored
from actuator_lti.margins.factored import factored
from actuator_lti.margins.loop import RationalLoop
from actuator_lti.margins.poles import SortedPoles, all_sorted, sorted_poles
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.margins.trust import MOST_ERROR, Doubtful, error_bound, hardly_placed, in_double_precision
from actuator_lti.types import Real

_WIDEST = 1e6  # ratio of poles and zeros up to which double precision is asked
_NEAR_ONE = 1e-6
_LEAST = math.exp(-FAR_LOG)


@in_double_precision()
def checked_margins(
    loop: RationalLoop, delay_s: float = 0.0, band_rad_s: tuple[float, float] | None = None
) -> StabilityMargins:
    """All margins of a rational loop, alone or behind a delay; `Doubtful` where double precision cannot check
    them.
    """
    _refuse(loop, delay_s)
    poles, *more = all_sorted((loop.A,) if delay_s else (loop.A, _closed(loop)), loop.in_z)
    closed = more[0] if more else None
    _trust_poles(loop, poles, closed)
    late = loop.behind(delay_s)
    factors = factored(late, poles)
    _trust_factors(loop, poles, factors)
    found = Along(factors, late, band_rad_s).polish()
    at_ends = [w for w, L in zip((0.0, math.inf), found.ends, strict=True) if _LEAST <= abs(L) < math.inf]
    if loop.coefficients is None and not loop.in_z:
        at_ends = [w for w in at_ends if w < math.inf]  # the direct feed-through is an entry: exact
    w = np.concatenate((found.gain_w, found.real_w, at_ends))
    if not (error_bound(loop, loop.x(w)) <= MOST_ERROR).all():
        raise Doubtful(f"rounding of the entries moves L at a crossing by more than {MOST_ERROR:g} of it")
    count = poles.unstable - found.half_turns
    second = _poles_behind_delay(late, found.gain_w) if closed is None else closed.unstable
    if second is not None and count != second:
        raise Doubtful("poles and Nyquist count disagree")
    residual = float(np.abs(found.real_L.imag / np.abs(found.real_L)).max(initial=1e-16))
    stability = "stability by the Nyquist count alone" if second is None else "poles and Nyquist count agree"
    reason = (
        f"{stability}, intervals leave no crossing out, every gain margin puts a closed-loop "
        f"pole on the stability boundary (residual {residual:.0e})"
        + ("" if closed is None else ", no pole lies within its own error of it")
    )
    return found.margins(Agreement(second, count), reason, delay_s)


def _closed(loop: RationalLoop) -> Real:
    return np.asarray(loop.A - np.outer(loop.b / (1.0 + loop.d), loop.c))


def _refuse(loop: RationalLoop, delay_s: float) -> None:
    if delay_s:
        refuse_neutral(loop)
        if not loop.order and not loop.d:
            raise Doubtful("no loop")
    elif not loop.order or not loop.b.any() or not loop.c.any() or abs(1.0 + loop.d) <= _NEAR_ONE:
        raise Doubtful("the loop has no dynamics, or 1 + L(infinity) is next to zero")


def refuse_neutral(loop: RationalLoop) -> None:
    """Refuse a continuous loop that behind a delay would be closed to one of neutral type."""
    if loop.period_s is None and abs(loop.d) >= 1.0:
        raise InputError(
            f"a direct feed-through of {loop.d:.6g} behind a delay: the gain never falls below one, and "
            "the closed loop of neutral type has no margins"
        )


def _poles_behind_delay(loop: RationalLoop, gain_w: Real) -> int | None:
    """Unstable closed-loop poles of a continuous loop behind a delay, from those without it."""
    if loop.period_s is not None:
        return None  # part of a sample: no function of z
    free = sorted_poles(_closed(loop), False)
    return None if free.doubtful or free.at_limit else free.unstable + passed_into(loop, gain_w)


def passed_into(loop: RationalLoop, gain_w: Real) -> int:
    """How many closed-loop poles the delay of a continuous loop brings into the right half plane.

    As the delay grows, poles pass over the axis only where |L| = 1: by pairs into the right half plane where
    it falls, and back where it rises, at the delay that uses up the phase margin and after each further turn
    (Walton and Marshall, Direct method for TDS stability analysis, IEE Proc. D 134, 1987).
    """
    L, slope = loop.response_and_slope(gain_w)
    lead = np.angle(-L) % (2.0 * np.pi)
    passed = np.floor((loop.delay * gain_w - lead) / (2.0 * np.pi)) + 1.0
    into = np.where((slope / L).real < 0.0, 2.0, -2.0)
    return int((into * np.maximum(passed, 0.0)).sum())


def _trust_poles(loop: RationalLoop, poles: SortedPoles, closed: SortedPoles | None) -> None:
    """Poles that are clear of the stability limit, but for exact ones at zero frequency."""
    if poles.doubtful or (closed is not None and (closed.at_limit or closed.doubtful)):
        raise Doubtful("a pole may lie on either side of the stability boundary")
    if poles.at_limit != poles.at_dc:
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
