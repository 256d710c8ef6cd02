"""Margins of a rational loop without delay in double precision: checked, or doubtful."""

from __future__ import annotations

import math

import numpy as np

from actuator_lti.margins.assemble import Figures, assembled, delay_margins
from actuator_lti.margins.crossings import Crossings, find_crossings
from actuator_lti.margins.extremes import DISK, FAR, MODULUS, Criterion, smallest
from actuator_lti.margins.factors import zeros
from actuator_lti.margins.level_crossings import LevelCrossings
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.nyquist import nyquist_count
from actuator_lti.margins.poles import SortedPoles, sorted_poles
from actuator_lti.margins.results import Agreement, GainMargin, PhaseMargin, StabilityMargins
from actuator_lti.margins.trust import MOST_ERROR, Doubtful, error_bound, hardly_placed

__all__ = ["checked_margins", "delay_margins", "rational_extreme"]

_REASON = (
    "poles and Nyquist count agree, the parity of the crossovers is right, no pole lies within its own error "
    "of the border"
)
_WIDEST = 1e6  # ratio of poles and zeros up to which one eigenvalue problem holds all crossings
_NEAR_ONE = 1e-6
_BELOW = np.array([0.01, 0.05, 0.2, 0.5])
_ABOVE = np.array([2.0, 5.0, 20.0, 100.0])


def checked_margins(loop: RationalLoop) -> StabilityMargins:
    """All margins of a rational loop in double precision, see `stability_margins`.

    Raises
    ------
    Doubtful
        They could not be checked.
    """
    try:
        with np.errstate(all="ignore"):
            return _margins(loop)
    except Doubtful:
        raise
    except (
        ArithmeticError,
        ValueError,
        RuntimeError,
    ) as error:  # LinAlgError, overflow, a search without end
        raise Doubtful(str(error)) from error


def _margins(loop: RationalLoop) -> StabilityMargins:
    if not loop.order or not loop.b.any() or not loop.c.any() or abs(1.0 + loop.d) <= _NEAR_ONE:
        raise Doubtful("no dynamics, or hardly well posed")
    poles = sorted_poles(loop.A, loop.in_z)
    closed = sorted_poles(loop.A - np.outer(loop.b / (1.0 + loop.d), loop.c), loop.in_z)
    _trust(loop, poles, closed)
    levels = LevelCrossings(loop, poles.values)
    crossings = find_crossings(loop, levels, _typical(loop, poles))
    dc, end = _ends(loop, poles)
    _trust_crossings(loop, crossings, dc, end)
    count = nyquist_count(loop, crossings, poles, dc, end)
    if count != closed.unstable:
        raise Doubtful("poles and Nyquist count disagree")
    x, L = _starts(loop, crossings, closed, dc, end)
    modulus = smallest(loop, levels, MODULUS, x, L, loop.end)
    disk = smallest(loop, levels, DISK, x, L, loop.end)
    way = "Hamiltonian matrix" if loop.period_s is None else "symplectic pencil"
    return assembled(
        loop.period_s,
        Agreement(closed.unstable, count, 0),
        Figures(
            _gain_margins(loop, crossings, dc, end),
            _phase_margins(loop, crossings),
            (modulus[0], loop.frequency(modulus[1])),
            (disk[0], loop.frequency(disk[1])),
        ),
        method=f"eigenvalues of a {way}, polished by Newton; no grid",
        notes=(),
        evidence="checked",
        reason=_REASON,
    )


def _trust(loop: RationalLoop, poles: SortedPoles, closed: SortedPoles) -> None:
    """Poles that are clear of the border, but for exact ones at zero frequency, and not too far apart."""
    if closed.border_count or closed.doubtful or poles.doubtful:
        raise Doubtful("a pole may lie on either side of the border")
    if poles.border_count != poles.at_dc:
        raise Doubtful("poles on the border")
    if hardly_placed(loop, poles.values, False) or hardly_placed(loop, closed.values, True):
        raise Doubtful("rounding of the coefficients moves a pole over the border")
    size = np.abs(poles.values - 1.0) if loop.in_z else np.abs(poles.values)
    if loop.numerator is not None:
        size = np.concatenate((size, np.abs(zeros(loop))))
    size = size[size > 0.0]
    if size.size and float(size.max()) > _WIDEST * float(size.min()):
        raise Doubtful("poles and zeros over too many decades")


def _trust_crossings(loop: RationalLoop, crossings: Crossings, dc: complex, end: complex) -> None:
    """Parity of the crossovers against the gain at both ends, and the error bound of every crossing."""
    sides = [math.log(max(abs(L), 1e-300)) for L in (dc, end)]
    if min(map(abs, sides)) < _NEAR_ONE:
        raise Doubtful("the gain is one at an end of the axis")
    if crossings.gain_x.size % 2 != (sides[0] > 0.0) ^ (sides[1] > 0.0):
        raise Doubtful("the number of gain crossovers does not fit the gain at both ends")
    ends = [x for x, L in ((0.0, dc), (loop.end, end)) if 0.0 < abs(L) < FAR]
    if loop.numerator is None and not loop.in_z:
        ends = [x for x in ends if x < math.inf]  # the direct feed-through is an entry: exact
    at = np.concatenate((crossings.gain_x, crossings.real_x, ends))
    if not (error_bound(loop, at) <= MOST_ERROR).all():
        raise Doubtful("the loop is too badly conditioned")


def rational_extreme(
    loop: RationalLoop, criterion: Criterion, at_rest: complex | None = None
) -> tuple[float, float]:
    """Smallest value of a criterion over the whole axis, ends included, and where (x of `RationalLoop`).

    ``at_rest`` is the response at zero frequency where a mode there, that it does not show, hides it.
    """
    if not loop.order:
        return float(criterion.distance(np.array([loop.d + 0j]))[0]), 0.0
    poles = sorted_poles(loop.A, loop.in_z, gather=True)
    end_x = loop.end
    size = np.abs(np.angle(poles.values)) if loop.in_z else np.abs(poles.values)
    around = size[(size > 1e-9 * size.max()) & (size < end_x)] if size.size else size
    x = np.concatenate((around * 0.7, np.minimum(around * 1.4, 0.5 * (around + min(end_x, 1e300)))))
    L = loop.response(x)
    x, L = np.append(x, end_x), np.append(L, loop.response(np.array([math.pi])) if loop.in_z else loop.d)
    at_dc = any(pole.x == 0.0 for pole in poles.border)
    start = at_rest if at_rest is not None else FAR if at_dc else loop.response(np.zeros(1))
    x, L = np.append(x, 0.0), np.append(L, start)
    return smallest(loop, LevelCrossings(loop, poles.values), criterion, x, L, end_x)


def _gain_margins(
    loop: RationalLoop, crossings: Crossings, dc: complex, end: complex
) -> tuple[GainMargin, ...]:
    at_dc = [GainMargin(-1.0 / dc.real, 0.0)] if dc.real < 0.0 else []
    at_end = [GainMargin(-1.0 / end.real, loop.frequency(loop.end))] if end.real < 0.0 else []
    crossed = [
        GainMargin(float(1.0 / abs(L)), loop.frequency(x))
        for x, L in zip(crossings.real_x, crossings.real_L, strict=True)
        if L.real < 0.0
    ]
    return (*at_dc, *crossed, *at_end)


def _phase_margins(loop: RationalLoop, crossings: Crossings) -> tuple[PhaseMargin, ...]:
    margins = np.degrees(np.angle(-crossings.gain_L))
    return tuple(
        PhaseMargin(float(deg) if deg > -180.0 else 180.0, loop.frequency(x))
        for deg, x in zip(margins, crossings.gain_x, strict=True)
    )


def _typical(loop: RationalLoop, poles: SortedPoles) -> Real:
    """Frequencies at which to look at the signs besides: about each pole, beyond, about the asymptote."""
    upper = poles.values[poles.values.imag >= 0.0]
    size = np.angle(upper) if loop.in_z else np.abs(upper)
    size = size[(size > 0.0) & (size < 3.1)] if loop.in_z else size[size > 0.0]
    low, high = (float(size.min()), float(size.max())) if size.size else (1.0, 1.0)
    x = np.concatenate((size * 1.03, low * _BELOW, high * _ABOVE))
    if not loop.in_z:
        x = np.concatenate((x, _asymptotic(loop, 100.0 * high)))
    return x[x < math.pi] if loop.in_z else x


def _asymptotic(loop: RationalLoop, high: float) -> Real:
    """Where the gain falls below one on its last slope, L about k/s^r: |k|^(1/r), and to both sides."""
    if loop.d:
        return np.empty(0)
    far = loop.response(np.array([high, 10.0 * high]))
    slope = max(round(math.log10(abs(far[0]) / max(abs(far[1]), 1e-300))), 1)
    crossover = high * abs(far[0]) ** (1.0 / slope)
    return np.array([0.1, 0.5, 2.0, 10.0]) * crossover


def _ends(loop: RationalLoop, poles: SortedPoles) -> tuple[complex, complex]:
    """L at both ends of the axis; `FAR` where it has a pole there."""
    dc = complex(FAR) if poles.at_dc else complex(loop.response(np.zeros(1))[0].real)
    return dc, complex(loop.response(np.array([math.pi]))[0].real) if loop.in_z else complex(loop.d)


def _starts(
    loop: RationalLoop, crossings: Crossings, closed: SortedPoles, dc: complex, end: complex
) -> tuple[Real, Complex]:
    """Where to look for the smallest distance first: crossings, and the resonances of the closed loop."""
    values = closed.values
    own = np.abs(np.angle(values)) if loop.in_z else np.abs(values)
    own = own[(values.imag >= 0.0) & (own > 1e-9 * own.max()) & (own < math.pi if loop.in_z else own > 0.0)]
    x = np.concatenate((crossings.gain_x, crossings.real_x, crossings.between_x, own, [0.0, loop.end]))
    L = np.concatenate(
        (crossings.gain_L, crossings.real_L, crossings.between_L, loop.response(own), [dc, end])
    )
    return x, L
