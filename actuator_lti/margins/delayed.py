"""Margins of a loop with exact delays, by intervals that are split until nothing can hide in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.assemble import Figures, assembled, far_note, hidden_notes, out_of_sight, within
from actuator_lti.margins.collocation import closed_loop_matrix, points_for
from actuator_lti.margins.delay_distance import smallest_distance
from actuator_lti.margins.delay_form import DelayForm, Intervals, border_values, values
from actuator_lti.margins.delay_setting import FLOOR, Setting, dc_value, excluded, intervals_of, setting_of
from actuator_lti.margins.distances import disk, modulus
from actuator_lti.margins.loop import Mask, Real
from actuator_lti.margins.nyquist import angle_about, angle_between
from actuator_lti.margins.poles import SortedPoles, sorted_poles
from actuator_lti.margins.results import Agreement, GainMargin, PhaseMargin, StabilityMargins
from actuator_lti.margins.sweep import GAIN, PHASE, crossings, variation

_BESIDE = 1e-3  # of the next pole: this near to zero lies the hidden one, collocated


def delayed_margins(form: DelayForm, band_rad_s: tuple[float, float] | None) -> StabilityMargins:
    """All margins of a continuous loop with delays inside, see `stability_margins`."""
    if form.series_s == 0.0 and abs(1.0 + form.D11) <= 1e-12:
        raise InputError("1 + L is zero at infinite frequency: the closed loop is not well posed")
    setting = setting_of(form, band_rad_s)
    intervals = intervals_of(setting)
    R = variation(form, intervals)
    no_gain, no_phase = excluded(intervals, R, setting)
    gain_x, gain_touch = crossings(form, intervals, GAIN, no_gain)
    phase_x, phase_touch = crossings(form, intervals, PHASE, no_phase)
    count = _nyquist(setting, intervals)
    agreement = _agreement(setting, count, float(gain_x.max()) if gain_x.size else 0.0)
    nearest = [smallest_distance(setting, intervals, distance) for distance in (modulus, disk)]
    gain_margins, far = _gain_margins(setting, phase_x, phase_touch, listed_all=band_rad_s is not None)
    notes = [*hidden_notes(setting.hidden), *far_note(far)]
    if band_rad_s is None:
        notes.append(f"gain margins above 40 dB beyond {setting.high:.4g} rad/s are not listed")
    result = assembled(
        None,
        agreement,
        Figures(gain_margins, _phase_margins(form, gain_x, gain_touch), *nearest),
        method="intervals split until a bound on the change of L shows that nothing hides between two points",
        notes=tuple(notes),
        evidence="checked",
        reason=_reason(agreement),
        delay_s=form.series_s,
        band_rad_s=(0.0, setting.high),
        hidden_border=setting.hidden,
    )
    return within(result, band_rad_s)


def delayed_gain_crossings(form: DelayForm, level: float) -> list[float]:
    """Frequencies at which the gain crosses ``level``, in order (x)."""
    scaled = replace(form, C1=form.C1 / level, D11=form.D11 / level, D12=form.D12 / level)
    setting = setting_of(scaled, None)
    intervals = intervals_of(setting)
    x, touch = crossings(
        scaled, intervals, GAIN, excluded(intervals, variation(scaled, intervals), setting)[0]
    )
    return x[~touch].tolist() if x.size else []


def _nyquist(setting: Setting, intervals: Intervals) -> int | None:
    form = setting.form
    if any(pole.x > 0.0 for pole in setting.open_poles.border):
        return None
    F = 1.0 + intervals.L
    angle = float(np.angle(F[1:] * F[:-1].conj()).sum())
    if setting.order:
        r = setting.low
        on_real = values(form, np.array([r], dtype=complex))[0]
        on_axis = border_values(form, np.array([r]))[0]
        angle += angle_about(1.0 + on_real.real, 1.0 + on_axis, -0.5 * np.pi * setting.order)
        angle += angle_between(complex(1.0 + on_axis), complex(F[0]))
    else:
        angle += angle_between(1.0 + complex(dc_value(setting)), complex(F[0]))
    angle += angle_between(complex(F[-1]), 1.0 + 0j)
    return setting.open_poles.unstable - round(angle / np.pi)


def _agreement(setting: Setting, count: int | None, crossover: float) -> Agreement:
    form = setting.form
    points = points_for(form, 2.0 * crossover)
    if points is None:  # the gain is above one for many turns of the delay: more poles than can be collocated
        return Agreement(None, count)
    closed = sorted_poles(closed_loop_matrix(form, points), False)
    unstable, border = _without_hidden(closed, setting.hidden)
    return Agreement(unstable, count, border)


def _without_hidden(closed: SortedPoles, hidden: int) -> tuple[int, int]:
    """Unstable and border poles, less a hidden mode at zero, which collocation puts beside it on any side."""
    size = np.abs(closed.values)
    if not hidden or closed.at_dc or size.size < 2:
        return closed.unstable, max(closed.border_count - hidden, 0)
    k = int(size.argmin())
    if size[k] > _BESIDE * np.delete(size, k).min():
        return closed.unstable, closed.border_count
    return closed.unstable - int(closed.values[k].real > 0.0), closed.border_count


def _reason(agreement: Agreement) -> str:
    if agreement.unstable_poles is None:
        return "intervals with a bound that leaves nothing between them; stability by the Nyquist count alone"
    return "intervals with a bound that leaves nothing between them; poles and Nyquist count agree"


def _gain_margins(
    setting: Setting, x: Real, touch: Mask, listed_all: bool
) -> tuple[tuple[GainMargin, ...], int]:
    """Those within sight, and how many are not."""
    at_rest = 0.0 if setting.order else dc_value(setting)
    places = [(0.0, complex(at_rest), False)] if at_rest < 0.0 else []
    places += zip(x.tolist(), border_values(setting.form, x).tolist(), touch.tolist(), strict=True)
    seen = [place for place in places if not out_of_sight(place[1])]
    listed = [place for place in seen if listed_all or not place[0] or abs(place[1]) >= FLOOR]
    margins = tuple(GainMargin(1.0 / abs(L), at, flat) for at, L, flat in listed)
    return margins, len(places) - len(seen)


def _phase_margins(form: DelayForm, x: Real, touch: Mask) -> tuple[PhaseMargin, ...]:
    deg = np.degrees(np.angle(-border_values(form, x))) if x.size else x
    return tuple(
        PhaseMargin(float(d) if d > -180.0 else 180.0, float(at), bool(flat))
        for at, d, flat in zip(x, deg, touch, strict=True)
    )
