"""Margins of a loop with exact delays, by intervals that are split until nothing can hide in them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.collocation import closed_loop_matrix, open_loop_matrix, points_for
from actuator_lti.margins.delay_form import Cells, DelayForm, border_values, values
from actuator_lti.margins.extremes import COMPLEMENTARY, DISK, FAR, MODULUS, PEAK, Criterion
from actuator_lti.margins.loop import Complex, Mask, Real
from actuator_lti.margins.nyquist import _arc, _turn, slope_at_dc
from actuator_lti.margins.poles import SortedPoles, sorted_poles
from actuator_lti.margins.rational import delay_margins, verdict_of
from actuator_lti.margins.results import (
    Agreement,
    DiskMargin,
    GainMargin,
    PhaseMargin,
    StabilityMargins,
)
from actuator_lti.margins.sweep import GAIN, PHASE, RESOLVED, crossings, joined, reach, subdivided

FLOOR = 0.01  # gain below which no crossing of the real axis is listed: 40 dB
_PER_DECADE = 12
_FINEST = 1e-3  # how much lower the smallest distance may be, relative, before it is polished


@dataclass(frozen=True)
class _Setting:
    form: DelayForm
    open_poles: SortedPoles
    low: float  # x from which on the intervals run; below, L follows its pole at zero
    high: float  # x beyond which the gain stays below the floor, or pi
    order: int  # of the pole at zero frequency in L
    hidden: int
    listed_to: float = 0.0  # x up to which crossings of the real axis are listed however small the gain


def delayed_margins(form: DelayForm, band_rad_s: tuple[float, float] | None) -> StabilityMargins:
    """All margins of a loop with delays, see `stability_margins`."""
    if form.series_s == 0.0 and abs(1.0 + form.D11) <= 1e-12:
        raise InputError("1 + L is zero at infinite frequency: the closed loop is not well posed")
    setting = _setting(form, band_rad_s)
    found = _cells(setting)
    R = reach(form, found)
    no_gain, no_phase = _excluded(found, R, setting.listed_to)
    gain_x, gain_touch = crossings(form, found, GAIN, no_gain)
    phase_x, phase_touch = crossings(form, found, PHASE, no_phase)
    count = _nyquist(setting, found)
    agreement = _agreement(setting, count, found, float(gain_x.max()) if gain_x.size else 0.0)
    distances = [_smallest(setting, found, criterion) for criterion in (MODULUS, DISK)]
    return _assembled(setting, band_rad_s, agreement, (gain_x, gain_touch), (phase_x, phase_touch), distances)


def _setting(form: DelayForm, band: tuple[float, float] | None, tail: bool = True) -> _Setting:
    poles = sorted_poles(open_loop_matrix(form, 24), form.sampled, gather=True)
    at_dc = poles.at_dc
    with np.errstate(divide="ignore"):
        sizes = np.abs(np.log(poles.values)) if form.sampled else np.abs(poles.values)
    sizes = sizes[(sizes > 0.0) & np.isfinite(sizes)]
    low = 1e-3 * float(sizes.min()) if sizes.size else 1e-3
    longest = max([form.series, *form.delays.tolist()], default=0.0)
    if longest:
        low = min(low, 1e-2 / longest)
    order, hidden = 0, 0
    if at_dc:
        low, order = _order_at_dc(form.without_series(), low, at_dc)
        hidden = at_dc - order
        if hidden not in (0, 1):
            raise InputError("poles at zero frequency are cancelled by zeros: cancel them in the loop first")
    if form.sampled:
        return _Setting(form, poles, low, math.pi, order, hidden, math.pi)
    if not tail:
        return _Setting(form, poles, low, math.inf, order, hidden)
    high = _tail(form, max(float(sizes.max()) if sizes.size else 0.0, low * 10.0))
    listed_to = 0.0 if band is None else float(band[1])
    return _Setting(form, poles, low, max(high, listed_to), order, hidden, listed_to)


def low_frequency(form: DelayForm) -> tuple[float, int]:
    """A frequency x below which L follows its pole at zero, and the multiplicity of that pole in L."""
    setting = _setting(form.without_series(), None, tail=False)
    return setting.low, setting.order


def _order_at_dc(form: DelayForm, low: float, most: int) -> tuple[float, int]:
    """A frequency at which L already follows its pole at zero, and the order of that pole."""
    order, _ = slope_at_dc(lambda x: border_values(form, x), 10.0 * low, most)
    for _ in range(14):
        L = border_values(form, np.array([low, 0.1 * low]))
        slope = float(np.log10(np.abs(L[1]) / np.abs(L[0])))
        if abs(slope - order) < 2e-3 and (not order or abs(L[0]) > 1e3):
            return low, order
        low *= 0.1
    raise InputError("the loop has a pole at zero frequency that is almost cancelled: cancel it first")


def _tail(form: DelayForm, start: float) -> float:
    """A frequency from which on \\|L\\| < FLOOR: with abs(F^-1) <= (w - |A|, ...)^-1 an M-matrix."""
    n, q = form.B1.size, form.delays.size
    if form.D11 and not form.series_s:
        raise InputError("a loop with delays and direct feed-through: its gain does not fall off")
    if not n and not q:
        return start

    def bound(w: float) -> float:
        M = np.block(
            [
                [w * np.eye(n) - np.abs(form.A), -np.abs(form.B2)],
                [-np.abs(form.C2), np.eye(q) - np.abs(form.D22)],
            ]
        )
        try:
            inverse = np.linalg.inv(M)
        except np.linalg.LinAlgError:
            return math.inf
        if inverse.min() < -1e-12 * np.abs(inverse).max():
            return math.inf  # w is not yet large enough for an M-matrix
        X = inverse @ np.concatenate((np.abs(form.B1), np.abs(form.D21)))
        return float(np.abs(form.C1) @ X[:n] + np.abs(form.D12) @ X[n:]) + abs(form.D11)

    w = start
    for _ in range(60):
        if bound(w) < FLOOR:
            return w
        w *= 2.0
    raise InputError(
        "the gain of the loop does not fall off towards high frequency (direct feed-through through a delay): "
        "its closed loop is of neutral type, for which no margins are given"
    )


def _excluded(found: Cells, R: Real, listed_to: float) -> tuple[Mask, Mask]:
    size = np.abs(found.L)
    no_gain = (size - found.spread > 1.0) | (size + found.spread < 1.0)
    to_axis = np.where(found.L.real < 0.0, np.abs(found.L.imag), size)
    return no_gain, (to_axis > R) | ((size + R < FLOOR) & (found.x > listed_to))


def _cells(setting: _Setting) -> Cells:
    form = setting.form

    def resolved(found: Cells) -> Mask:
        R = reach(form, found)
        no_gain, no_phase = _excluded(found, R, setting.listed_to)
        turns = 0.7 * np.abs(1.0 + found.L) > R
        return turns & ((RESOLVED * np.abs(found.L) >= R) | (no_gain & no_phase))

    decades = max(math.log10(setting.high / setting.low), 0.1)
    edges = np.geomspace(setting.low, setting.high, int(_PER_DECADE * decades) + 2)
    if setting.order == 0 and setting.hidden == 0:
        edges = np.concatenate(([0.0], edges))
    try:
        return subdivided(form, edges, resolved)
    except NumericalError as error:
        if _touches(form, edges):
            raise NumericalError(f"{error} (or a closed-loop pole there)") from error
        raise


def delayed_extreme(form: DelayForm, criterion: Criterion) -> tuple[float, float]:
    """Smallest value of a criterion over the axis, and where (x)."""
    setting = _setting(form, None)
    return _smallest(setting, _cells(setting), criterion)


def delayed_gain_crossings(form: DelayForm, level: float) -> list[float]:
    """Frequencies at which the gain crosses ``level``, in order (x)."""
    scaled = replace(form, C1=form.C1 / level, D11=form.D11 / level, D12=form.D12 / level)
    found = _cells(_setting(scaled, None))
    x, touch = crossings(scaled, found, GAIN, _excluded(found, reach(scaled, found), 0.0)[0])
    return x[~touch].tolist() if x.size else []


def _touches(form: DelayForm, edges: Real) -> bool:
    return bool(np.abs(1.0 + border_values(form, edges[1:])).min() < 1e-6)


def _nyquist(setting: _Setting, found: Cells) -> int | None:
    form = setting.form
    if any(pole.x > 0.0 for pole in setting.open_poles.border):
        return None
    F = 1.0 + found.L
    angle = float(np.angle(F[1:] * F[:-1].conj()).sum())
    if setting.order:
        r = setting.low
        on_real = values(form, np.array([np.exp(r) if form.sampled else r], dtype=complex))[0]
        on_axis = border_values(form, np.array([r]))[0]
        angle += _arc(1.0 + on_real.real, 1.0 + on_axis, -0.5 * np.pi * setting.order)
        angle += _turn(complex(1.0 + on_axis), complex(F[0]))
    else:
        angle += _turn(1.0 + complex(_dc(setting)), complex(F[0]))
    end = 1.0 if not form.sampled else 1.0 + float(border_values(form, np.array([math.pi]))[0].real)
    angle += _turn(complex(F[-1]), complex(end))
    return setting.open_poles.unstable - round(angle / np.pi)


def _dc(setting: _Setting) -> float:
    x = setting.low if setting.hidden else 0.0
    return float(border_values(setting.form.without_series(), np.array([x]))[0].real)


def _agreement(setting: _Setting, count: int | None, found: Cells, crossover: float) -> Agreement:
    form = setting.form
    if form.sampled:
        return Agreement(None, count)
    closed = sorted_poles(closed_loop_matrix(form, points_for(form, 2.0 * crossover)), False)
    return Agreement(closed.unstable, count, max(closed.border_count - setting.hidden, 0))


def _smallest(setting: _Setting, found: Cells, criterion: Criterion) -> tuple[float, float]:
    """Smallest distance: split where the bound allows less than the best so far, then polish."""
    form = setting.form
    ends_x, ends_L = _end_values(setting)
    while True:
        distance = criterion.distance(found.L)
        best = min(float(distance.min()), float(criterion.distance(ends_L).min()))
        below = _lower_bound(criterion, found, reach(form, found))
        again = below < best * (1.0 - _FINEST)
        if not again.any():
            break
        low, high = (found.x - found.half)[again], (found.x + found.half)[again]
        middle = 0.5 * (low + high)
        kept = Cells(*(getattr(found, name)[~again] for name in Cells.__dataclass_fields__))
        edges_low, edges_high = np.concatenate((low, middle)), np.concatenate((middle, high))
        from actuator_lti.margins.delay_form import cells

        found = joined([kept, cells(form, edges_low, edges_high)])
        if found.x.size > 400_000 or best < 1e-9:
            break
    return _polished(form, criterion, found, np.asarray(ends_x), ends_L)


def _end_values(setting: _Setting) -> tuple[list[float], Complex]:
    x: list[float] = [0.0]
    L: list[complex] = [FAR if setting.order else _dc(setting)]
    if setting.form.sampled:
        x.append(math.pi)
        L.append(complex(border_values(setting.form, np.array([math.pi]))[0]))
    else:
        x.append(math.inf)
        L.append(0.0)
    return x, np.array(L, dtype=complex)


def _lower_bound(criterion: Criterion, found: Cells, R: Real) -> Real:
    distance = criterion.distance(found.L)
    if criterion is MODULUS:
        return distance - R
    size = np.abs(found.L)
    if criterion is PEAK:
        return 1.0 / (size + R)
    if criterion is COMPLEMENTARY:
        return np.where(size > R, distance - R / (size * (size - R)), -np.inf)
    away = np.abs(1.0 - found.L)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(away > R, distance - 4.0 * R / (away * (away - R)), -np.inf)


def _polished(
    form: DelayForm, criterion: Criterion, found: Cells, ends_x: Real, ends_L: Complex
) -> tuple[float, float]:
    distance = criterion.distance(found.L)
    at_ends = criterion.distance(ends_L)
    best, place = float(at_ends.min()), float(ends_x[int(at_ends.argmin())])
    k = int(distance.argmin())
    if distance[k] > best * (1.0 - 1e-12):
        return best, place
    low = float(found.x[max(k - 1, 0)])
    high = float(found.x[min(k + 1, found.x.size - 1)])

    def at(x: float) -> float:
        return float(criterion.distance(border_values(form, np.array([x])))[0])

    result = minimize_scalar(at, bounds=(low, high), method="bounded", options={"xatol": 1e-9 * high})
    if result.fun < min(best, float(distance[k])):
        return float(result.fun), float(result.x)
    return (float(distance[k]), float(found.x[k])) if distance[k] < best else (best, place)


def _assembled(
    setting: _Setting,
    band: tuple[float, float] | None,
    agreement: Agreement,
    gains: tuple[Real, Mask],
    phases: tuple[Real, Mask],
    distances: list[tuple[float, float]],
) -> StabilityMargins:
    form = setting.form
    unit = 1.0 if form.period_s is None else 1.0 / form.period_s
    low, high = band if band is not None else (0.0, setting.high * unit)
    stable, verdict = verdict_of(agreement)
    method = "intervals split until a bound on the change of L shows that nothing hides between two points"
    notes = []
    if setting.hidden:
        notes.append("one mode at zero frequency that the loop neither drives nor sees is left out")
    if band is None and not form.sampled:
        notes.append(f"gain margins above 40 dB beyond {setting.high * unit:.4g} rad/s are not listed")
    common = {
        "period_s": form.period_s,
        "delay_s": form.series_s,
        "band_rad_s": (low, high),
        "method": method,
    }
    if not agreement.agree:
        notes.append("poles and Nyquist count disagree: no figure is given")
        return StabilityMargins(
            None, verdict, (), (), (), None, None, None, agreement=agreement, notes=tuple(notes), **common
        )  # type: ignore[arg-type]
    gain_margins = _gain_margins(setting, phases, (low, high), band is not None or form.sampled)
    phase_margins = _phase_margins(form, gains, (low, high))
    return StabilityMargins(
        stable=stable,
        verdict=verdict,
        gain_margins=gain_margins,
        phase_margins=phase_margins,
        delay_margins=delay_margins(phase_margins, form.period_s),
        modulus_margin=distances[0][0],
        modulus_frequency_rad_s=distances[0][1] * unit,
        disk_margin=DiskMargin(distances[1][0], distances[1][1] * unit),
        agreement=agreement,
        notes=tuple(notes),
        **common,  # type: ignore[arg-type]
    )


def _gain_margins(
    setting: _Setting, phases: tuple[Real, Mask], band: tuple[float, float], listed_all: bool
) -> tuple[GainMargin, ...]:
    form = setting.form
    unit = 1.0 if form.period_s is None else 1.0 / form.period_s
    out = []
    if setting.order == 0 and _dc(setting) < 0.0 and band[0] <= 0.0:
        out.append(GainMargin(-1.0 / _dc(setting), 0.0))
    x, touch = phases
    for at, L, flat in zip(x, border_values(form, x), touch, strict=True):
        if band[0] <= at * unit <= band[1] and (listed_all or abs(L) >= FLOOR):
            out.append(GainMargin(float(1.0 / abs(L)), float(at) * unit, bool(flat)))
    return tuple(out)


def _phase_margins(
    form: DelayForm, gains: tuple[Real, Mask], band: tuple[float, float]
) -> tuple[PhaseMargin, ...]:
    unit = 1.0 if form.period_s is None else 1.0 / form.period_s
    x, touch = gains
    deg = np.degrees(np.angle(-border_values(form, x))) if x.size else x
    return tuple(
        PhaseMargin(float(d) if d > -180.0 else 180.0, float(at) * unit, bool(flat))
        for at, d, flat in zip(x, deg, touch, strict=True)
        if band[0] <= at * unit <= band[1]
    )
