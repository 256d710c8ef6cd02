"""Margins of a rational loop without delay."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.circles import Circles
from actuator_lti.margins.crossings import Crossings, find_crossings
from actuator_lti.margins.extremes import DISK, FAR, MODULUS, Criterion, smallest
from actuator_lti.margins.loop import Complex, RationalLoop, Real
from actuator_lti.margins.nyquist import nyquist_count, slope_at_dc
from actuator_lti.margins.poles import SortedPoles, sorted_poles
from actuator_lti.margins.results import (
    Agreement,
    DelayMargin,
    DiskMargin,
    GainMargin,
    PhaseMargin,
    StabilityMargins,
    Verdict,
)

_HIDDEN = (
    "one mode at zero frequency that the loop neither drives nor sees is left out (it is no instability)"
)

_WIDE = 1e11
_FLOOR = 30.0  # times the scatter of a multiple pole at zero frequency: below, no crossing is looked for
_BELOW = np.array([0.01, 0.05, 0.2, 0.5])
_ABOVE = np.array([2.0, 5.0, 20.0, 100.0])


@dataclass(frozen=True)
class Ends:
    """L at both ends of the axis; ``None`` where it has a pole there.

    Attributes
    ----------
    dc, end : complex or None
        L(0) or L(z = 1); L(infinity) or L(z = -1).
    dc_order, end_order : int
        Multiplicity of the pole there in L.
    hidden : int
        Modes at zero frequency that L does not show.
    """

    dc: complex | None
    end: complex | None
    dc_order: int
    end_order: int
    hidden: int


def rational_margins(loop: RationalLoop) -> StabilityMargins:
    """All margins of a rational loop, see `stability_margins`."""
    if abs(1.0 + loop.d) <= 1e-12:
        raise InputError("1 + L is zero at infinite frequency: the closed loop is not well posed")
    if not loop.order or not loop.b.any() or not loop.c.any():
        return _constant(loop)
    poles = sorted_poles(loop.A, loop.in_z, gather=loop.numerator is None)
    closed = sorted_poles(loop.A - np.outer(loop.b / (1.0 + loop.d), loop.c), loop.in_z)
    end_x = loop.end
    inner = np.array([pole.x for pole in poles.border if 0.0 < pole.x < end_x])
    inspected = _inspect(loop, poles, inner, careful=False)
    if inspected.dynamic_range > _WIDE or inspected.count != closed.unstable:
        inspected = _inspect(loop, poles, inner, careful=True)
    circles, found, ends, count = inspected.circles, inspected.found, inspected.ends, inspected.count
    border = closed.border_count - ends.hidden
    agreement = Agreement(closed.unstable, count, border)
    x, L = _starts(loop, found, closed, ends)
    modulus, modulus_x = smallest(loop, circles, MODULUS, x, L, end_x)
    alpha, alpha_x = smallest(loop, circles, DISK, x, L, end_x)
    return _assembled(
        loop,
        agreement,
        gain_margins=_gain_margins(loop, found, ends),
        phase_margins=_phase_margins(loop, found),
        modulus=(modulus, modulus_x),
        disk=(alpha, alpha_x),
        notes=(_HIDDEN,) if ends.hidden else (),
    )


@dataclass(frozen=True)
class _Inspected:
    circles: Circles
    found: Crossings
    ends: Ends
    count: int  # unstable closed-loop poles by Nyquist

    @property
    def dynamic_range(self) -> float:
        """Largest over smallest gain between the lowest and the highest pole, about."""
        size = np.abs(self.found.between_L[len(_BELOW) : -len(_ABOVE)])
        return float(size.max() / max(float(size.min()), 1e-300)) if size.size else 1.0


def _inspect(loop: RationalLoop, poles: SortedPoles, inner: Real, careful: bool) -> _Inspected:
    circles = Circles(loop, poles.values, careful)
    found = find_crossings(loop, circles, inner, _typical(poles, loop.in_z), _FLOOR * poles.cloud)
    ends = _ends(loop, poles, found)
    count = nyquist_count(loop, found, poles, ends.dc_order, ends.dc or 0j, ends.end or 0j)
    return _Inspected(circles, found, ends, count)


def rational_extreme(loop: RationalLoop, criterion: Criterion) -> tuple[float, float]:
    """Smallest value of a criterion over the whole axis, ends included, and where (x of `RationalLoop`)."""
    if not loop.order:
        return float(criterion.distance(np.array([loop.d + 0j]))[0]), 0.0
    poles = sorted_poles(loop.A, loop.in_z)
    end_x = loop.end
    size = np.abs(np.angle(poles.values)) if loop.in_z else np.abs(poles.values)
    around = size[(size > 1e-9 * size.max()) & (size < end_x)] if size.size else size
    x = np.concatenate((around * 0.7, np.minimum(around * 1.4, 0.5 * (around + min(end_x, 1e300)))))
    L = loop.response(x)
    x, L = np.append(x, end_x), np.append(L, loop.response(np.array([math.pi])) if loop.in_z else loop.d)
    at_dc = any(pole.x == 0.0 for pole in poles.border)
    x, L = np.append(x, 0.0), np.append(L, FAR if at_dc else loop.response(np.zeros(1)))
    return smallest(loop, Circles(loop, poles.values), criterion, x, L, end_x)


def _constant(loop: RationalLoop) -> StabilityMargins:
    poles = sorted_poles(loop.A, loop.in_z)
    stable = not poles.unstable and not poles.border_count
    agreement = Agreement(poles.unstable, poles.unstable, poles.border_count)
    gains = (GainMargin(-1.0 / loop.d, 0.0),) if loop.d < 0.0 else ()
    distance = abs(1.0 + loop.d)
    alpha = math.inf if loop.d == 1.0 else 2.0 * distance / abs(1.0 - loop.d)
    notes = () if stable else ("the loop has states that it neither drives nor sees",)
    return _assembled(loop, agreement, gains, (), (distance, 0.0), (alpha, 0.0), notes)


def _assembled(
    loop: RationalLoop,
    agreement: Agreement,
    gain_margins: tuple[GainMargin, ...],
    phase_margins: tuple[PhaseMargin, ...],
    modulus: tuple[float, float],
    disk: tuple[float, float],
    notes: tuple[str, ...],
) -> StabilityMargins:
    T = loop.period_s
    band = (0.0, math.inf if T is None else math.pi / T)
    way = "Hamiltonian matrix" if T is None else "symplectic pencil"
    method = f"eigenvalues of a {way}, polished by Newton; no grid"
    stable, verdict = verdict_of(agreement)
    if stable is None:
        return StabilityMargins(
            None, verdict, (), (), (), None, None, None, T, 0.0, band, method, agreement,
            (*notes, "poles and Nyquist count disagree: no figure is given; the loop is too badly "
             "conditioned for double precision, or a pole is cancelled"),
        )  # fmt: skip
    return StabilityMargins(
        stable=stable,
        verdict=verdict,
        gain_margins=gain_margins,
        phase_margins=phase_margins,
        delay_margins=delay_margins(phase_margins, T),
        modulus_margin=modulus[0],
        modulus_frequency_rad_s=loop.frequency(modulus[1]),
        disk_margin=DiskMargin(disk[0], loop.frequency(disk[1])),
        period_s=T,
        delay_s=0.0,
        band_rad_s=band,
        method=method,
        agreement=agreement,
        notes=notes,
    )


def verdict_of(agreement: Agreement) -> tuple[bool | None, Verdict]:
    """Verdict from the two ways; both are asked only where no pole is on the border."""
    if not agreement.agree:
        return None, "undecided"
    counts = (agreement.unstable_poles, agreement.unstable_nyquist)
    count = next((c for c in counts if c is not None), None)
    if count is None:
        return None, "undecided"
    if count:
        return False, "unstable"
    return (False, "on the border") if agreement.border_poles else (True, "stable")


def delay_margins(phase_margins: tuple[PhaseMargin, ...], period_s: float | None) -> tuple[DelayMargin, ...]:
    """The delay that uses up each phase margin; a negative margin by way of a full turn."""
    out = []
    for margin in phase_margins:
        lag = math.radians(margin.deg if margin.deg >= 0.0 else margin.deg + 360.0)
        seconds = lag / margin.frequency_rad_s
        samples = None if period_s is None else seconds / period_s
        out.append(DelayMargin(seconds, samples, margin.frequency_rad_s))
    return tuple(out)


def _gain_margins(loop: RationalLoop, found: Crossings, ends: Ends) -> tuple[GainMargin, ...]:
    out = []
    if ends.dc is not None and ends.dc.real < 0.0:
        out.append(GainMargin(-1.0 / ends.dc.real, 0.0))
    for x, L, touch in zip(found.real_x, found.real_L, found.real_touch, strict=True):
        if L.real < 0.0:
            out.append(GainMargin(float(1.0 / abs(L)), loop.frequency(x), bool(touch)))
    if ends.end is not None and ends.end.real < 0.0:
        out.append(GainMargin(-1.0 / ends.end.real, loop.frequency(loop.end)))
    return tuple(out)


def _phase_margins(loop: RationalLoop, found: Crossings) -> tuple[PhaseMargin, ...]:
    margins = np.degrees(np.angle(-found.gain_L))
    return tuple(
        PhaseMargin(float(deg) if deg > -180.0 else 180.0, loop.frequency(x), bool(touch))
        for deg, x, touch in zip(margins, found.gain_x, found.gain_touch, strict=True)
    )


def _typical(poles: SortedPoles, in_z: bool) -> Real:
    """Frequencies at which to look at the signs besides: about every pole, and a decade to both sides."""
    size = np.abs(np.angle(poles.values)) if in_z else np.abs(poles.values)
    size = size[(size > 1e-9 * size.max()) & (size < 3.1)] if in_z else size[size > 1e-9 * size.max()]
    if not size.size:
        return np.array([0.1, 0.3, 1.0, 3.0])
    low, high = float(size.min()), float(size.max())
    x = np.concatenate((size * 1.03, low * _BELOW, high * _ABOVE))
    x = x[x > _FLOOR * poles.cloud]
    return x[x < math.pi] if in_z else x


def _ends(loop: RationalLoop, poles: SortedPoles, found: Crossings) -> Ends:
    at_dc = poles.at_dc
    at_pi = sum(pole.multiplicity for pole in poles.border if loop.in_z and pole.x == math.pi)
    dc, order = None, 0
    if at_dc:
        order, value = _order_at_dc(loop, poles, float(found.between_x[0]))
        dc = None if order else value
    else:
        dc = complex(loop.response(np.zeros(1))[0])
    if at_dc - order > 1:
        raise InputError("poles at zero frequency are cancelled by zeros: cancel them in the loop first")
    end = None
    if not at_pi:
        end = complex(loop.response(np.array([math.pi]))[0].real) if loop.in_z else complex(loop.d)
    return Ends(dc, end, order, at_pi, at_dc - order)


def _order_at_dc(loop: RationalLoop, poles: SortedPoles, first_x: float) -> tuple[int, complex]:
    """Multiplicity of the pole at zero frequency that L shows, and L just beside it.

    The slope of the gain is followed downwards: zeros near zero frequency make it too small at first, the
    split of a multiple eigenvalue too small again in the end; the steepest whole number is the one.
    """
    distance = np.abs(poles.values - 1.0) if loop.in_z else np.abs(poles.values)
    away = distance[distance > 1e-9 * distance.max()]
    start = 0.1 * float(away.min() if away.size else first_x)
    return slope_at_dc(loop.response, max(start, _FLOOR * poles.cloud), poles.at_dc)


def _starts(loop: RationalLoop, found: Crossings, closed: SortedPoles, ends: Ends) -> tuple[Real, Complex]:
    """Where to look for the smallest distance first: crossings, and the resonances of the closed loop."""
    values = closed.values
    own = np.abs(np.angle(values)) if loop.in_z else np.abs(values)
    own = own[(values.imag >= 0.0) & (own > 1e-9 * own.max()) & (own < math.pi if loop.in_z else own > 0.0)]
    x = np.concatenate((found.gain_x, found.real_x, found.between_x, own))
    L = np.concatenate((found.gain_L, found.real_L, found.between_L, loop.response(own)))
    x = np.concatenate((x, [0.0, loop.end]))
    return x, np.concatenate((L, [FAR if value is None else value for value in (ends.dc, ends.end)]))
