"""Margins from frequency-response data: each with the range in which it lies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.assemble import delay_margins
from actuator_lti.margins.distances import DISK, MODULUS
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import (
    Agreement,
    DiskMargin,
    GainMargin,
    PhaseMargin,
    between_text,
    frequency_text,
)
from actuator_lti.measured.bounds import Bounds, Strip, bounds, distance_ranges
from actuator_lti.measured.local_fit import averaged
from actuator_lti.measured.response import MeasuredResponse, measured_response
from actuator_lti.types import Complex, Real

_MOST_UNRESOLVED = 0.5
_MOST = 6
_OPEN = "as it is known: crossings there are neither sure nor excluded"
_NOTES = (
    "measured data: stability cannot be determined from them, and outside of their band nothing is known",
    "each crossing lies between two points (bracket_rad_s); the figure between them is interpolated, it lies "
    "in ratio_range or deg_range as far as the loop between the points is no more curved than about them; "
    "these are bounds, gain and phase at their worst at once: they hold the truth in more than 99 of 100",
    "noise is averaged over as many neighbouring points as the curvature allows; their errors are taken as "
    "independent",
    "modulus and disk margin are the smallest values at these points; over the band and within the noise "
    "they lie in modulus_range and alpha_range",
)


def measured_margins(data: Any, delay_s: float, band_rad_s: tuple[float, float] | None) -> StabilityMargins:
    """Margins from `control.FrequencyResponseData` or `MeasuredResponse`, see `stability_margins`.

    Noise is averaged over neighbouring points (see `local_fit`). Every value lies in a circle (noise),
    every interval between two points in a strip about its chord that the second differences nearby allow
    (see `Bounds`). A crossing is listed where the strips pass the level from one side to the other, with the
    range of its margin over all places at which they may. Where the phase betrays a resonance between two
    points, or a pair of crossings cannot be excluded, a note says so.

    Raises `InputError`: for more than one input or output, fewer than two points, values that are zero or not
    finite, or points so coarse that more than half of the intervals turn by more than 60 deg or 10 dB.
    """
    response = measured_response(data)
    omega, L, radius = measured_points(response, band_rad_s)
    result = bounds(omega, L, radius, delay_s)
    refuse_coarse(omega, L, result)
    L = L * np.exp(-1j * omega * delay_s)
    phase_margins, spans, grazed = _phase_margins(omega, result)
    delays = delay_margins(phase_margins, response.dt)
    gain_margins, touched = _gain_margins(omega, result)
    distance, alpha = MODULUS.of(L), DISK.of(L)
    k, j = int(distance.argmin()), int(alpha.argmin())
    modulus_range, alpha_range = distance_ranges(L, radius, result)
    known = radius.any() or not response.noise_known
    noise = f"noise: {response.source}" if known else "noise: none, the ranges leave it out"
    margins = StabilityMargins(
        stable=None,
        verdict="undecided",
        gain_margins=gain_margins,
        phase_margins=phase_margins,
        delay_margins=tuple(replace(d, seconds_range=r) for d, r in zip(delays, spans, strict=True)),
        modulus_margin=float(distance[k]),
        modulus_frequency_rad_s=float(omega[k]),
        disk_margin=DiskMargin(float(alpha[j]), float(omega[j]), alpha_range),
        modulus_range=modulus_range,
        period_s=response.dt,
        delay_s=delay_s,
        band_rad_s=(float(omega[0]), float(omega[-1])),
        method="points of measured data, their noise averaged over neighbours; straight between them in dB "
        "and deg over log frequency",
        agreement=Agreement(None, None),
        evidence_reason=_reason(omega, result, response.noise_known),
        notes=(*_hidden(omega, result), *_lost(omega, result), *grazed, *touched, noise, *_NOTES),
    )
    return margins if response.noise_known else _without_ranges(margins)


def _without_ranges(margins: StabilityMargins) -> StabilityMargins:
    return replace(
        margins,
        gain_margins=tuple(replace(each, ratio_range=None) for each in margins.gain_margins),
        phase_margins=tuple(replace(each, deg_range=None) for each in margins.phase_margins),
        delay_margins=tuple(replace(each, seconds_range=None) for each in margins.delay_margins),
        disk_margin=margins.disk_margin and replace(margins.disk_margin, alpha_range=None),
        modulus_range=None,
    )


def measured_points(data: MeasuredResponse, band: tuple[float, float] | None) -> tuple[Real, Complex, Real]:
    order = data.omega.argsort()
    omega, L, radius = data.omega[order], data.frdata[order], data.radius[order]
    keep = omega > 0.0
    if band is not None:
        keep &= (omega >= band[0]) & (omega <= band[1])
    omega, L, radius = omega[keep], L[keep], radius[keep]
    if omega.size < 2:
        raise InputError("measured data: at least two points above zero frequency are needed")
    if not (np.isfinite(L).all() and np.isfinite(omega).all()) or (L == 0.0).any():
        raise InputError("measured data: every value must be finite and not zero")
    if (np.diff(omega) <= 0.0).any():
        twice = omega[1:][np.diff(omega) <= 0.0][0]
        allowed = "each once, repeats as MeasuredResponse.from_repeats"
        raise InputError(f"measured data: {twice:.6g} rad/s is given twice; allowed: {allowed}")
    return omega, *averaged(omega, L, radius)


def refuse_coarse(omega: Real, L: Complex, result: Bounds) -> None:
    if np.count_nonzero(result.unresolved) <= _MOST_UNRESOLVED * result.unresolved.size:
        return
    k = int(result.unresolved.argmax())
    ratio = L[k + 1] / L[k]
    raise InputError(
        f"measured data are too coarse: {np.count_nonzero(result.unresolved)} of {result.unresolved.size} "
        "intervals turn by more than 60 deg or 10 dB, the first "
        f"{between_text(omega[k], omega[k + 1])} ({np.degrees(np.angle(ratio)):+.1f} deg, "
        f"{20.0 * math.log10(abs(ratio)):+.1f} dB); measure more points"
    )


@dataclass(frozen=True)
class Group:
    """Neighbouring intervals first ... last in which a level may be passed, each in its part [t0, t1]."""

    first: int
    last: int
    t0: Real
    t1: Real

    def over(self, strip: Strip) -> tuple[float, float]:
        """Range of another function wherever the level may be passed."""
        spans = [
            strip.over(k, float(a), float(b))
            for k, a, b in zip(range(self.first, self.last + 1), self.t0, self.t1, strict=True)
        ]
        return min(low for low, _ in spans), max(high for _, high in spans)

    def part(self, first: int, last: int) -> Group:
        chosen = slice(first - self.first, last + 1 - self.first)
        return Group(first, last, self.t0[chosen], self.t1[chosen])

    def bracket(self, omega: Real) -> tuple[float, float]:
        """Where, rad/s."""
        return float(omega[self.first]), float(omega[self.last + 1])


def _groups(strip: Strip, level: float) -> list[Group]:
    t0, t1 = strip.meets(level)
    open_in = np.flatnonzero(t0 <= t1)
    before, after = open_in[:-1], open_in[1:]
    joined = (after == before + 1) & (t1[before] >= 1.0) & (t0[after] <= 0.0)
    parts = np.split(open_in, np.flatnonzero(~joined) + 1)
    return [Group(int(k[0]), int(k[-1]), t0[k], t1[k]) for k in parts if k.size]


def single_passages(strip: Strip, level: float) -> list[Group]:
    """The groups, cut at points that surely lie off the level so that none holds two sure passages."""
    out = []
    for group in _groups(strip, level):
        start, side = group.first, strip.side(group.first, 0, level)
        cut: int | None = None  # where the level was surely passed last
        for k in range(group.first, group.last + 1):
            after = strip.side(k, 1, level)
            if after == 0:
                continue
            if side and after != side:
                if cut is not None:  # the second one: the group before it ends where the first had passed
                    out.append(group.part(start, cut))
                    start = cut + 1
                cut = k
            side = after
        out.append(group.part(start, group.last))
    return out


def passed(strip: Strip, level: float, group: Group) -> tuple[int, float] | None:
    """Interval and place in it where the level is passed, the middle one of several; ``None``: not surely.

    Both ends of the group have to lie off the level: at an edge of the band they may not.
    """
    first, last = group.first, group.last
    sides = [strip.side(first, 0, level), strip.side(last, 1, level)]
    part = strip.middle[first : last + 2] - level
    if first == 0 and part[0] == 0.0:
        sides[0] = -sides[1]
    if sides[0] * sides[1] >= 0 or part[0] * part[-1] > 0.0 or part[0] == part[-1]:
        return None
    places = np.flatnonzero((part[:-1] * part[1:] <= 0.0) & (part[:-1] != part[1:]))
    k = int(places[places.size // 2])
    return first + k, float(part[k] / (part[k] - part[k + 1]))


def _passages(
    omega: Real, result: Bounds, strip: Strip, level: float, notes: list[str], what: str
) -> Iterator[tuple[Group, int, float]]:
    """Where a level is surely passed: group, interval and place in it; where that is open, a note."""
    doubtful = list[Group]()
    for group in single_passages(strip, level):
        if strip is result.phase and result.lost[group.first : group.last + 2].any():
            continue
        at = passed(strip, level, group)
        if at is not None:
            yield group, *at
        elif not result.unresolved[group.first : group.last + 1].all():  # told already
            doubtful.append(group)
    spans = [group.bracket(omega) for group in doubtful]
    if len(spans) > _MOST:
        notes.append(f"at {len(spans)} places {between_text(spans[0][0], spans[-1][1])} {what} {_OPEN}")
    else:
        notes += [f"{between_text(*ends)} {what} {_OPEN}" for ends in spans]


def _phase_margins(
    omega: Real, result: Bounds
) -> tuple[tuple[PhaseMargin, ...], list[tuple[float, float]], list[str]]:
    """Phase margins, the ranges of their delay margins in s, and notes."""
    out, delays, notes = [], list[tuple[float, float]](), list[str]()
    near = "the gain comes as near to one"
    for group, k, t in _passages(omega, result, result.log_gain, 0.0, notes, near):
        deg = math.degrees(_chord(result.phase.middle, k, t)) + 180.0
        turns = 360.0 * math.ceil((deg - 180.0) / 360.0)
        low, high = (math.degrees(each) + 180.0 - turns for each in group.over(result.phase))
        known = (-180.0, 180.0) if high - low >= 360.0 else (low, high)
        out.append(PhaseMargin(deg - turns, between(omega, k, t), False, group.bracket(omega), known))
        first = between(omega, group.first, float(group.t0[0]))
        last = between(omega, group.last, float(group.t1[-1]))  # a negative margin by way of a full turn
        low, high = (math.radians(each + (360.0 if known[1] < 0.0 else 0.0)) for each in known)
        delays.append((low / last, high / first) if low >= 0.0 else (0.0, 2.0 * math.pi / first))
    return tuple(out), delays, notes


def _gain_margins(omega: Real, result: Bounds) -> tuple[tuple[GainMargin, ...], list[str]]:
    out, notes = [], list[str]()
    lowest, highest = (0.5 * (float(end) / math.pi - 1.0) for end in result.phase.range)
    near = "the phase comes as near to -180 deg"
    for m in range(math.ceil(lowest), math.floor(highest) + 1):
        for group, k, t in _passages(omega, result, result.phase, (2 * m + 1) * math.pi, notes, near):
            low, high = group.over(result.log_gain)
            known = math.exp(-high), math.exp(-low) if low > -700.0 else math.inf
            ratio = math.exp(-_chord(result.log_gain.middle, k, t))
            out.append(GainMargin(ratio, between(omega, k, t), False, group.bracket(omega), known))
    return tuple(sorted(out, key=lambda margin: margin.frequency_rad_s)), notes


def _reason(omega: Real, result: Bounds, known: bool) -> str:
    ranges = "the figures lie in their ranges" if known else "the figures have no ranges"
    reason = f"measured points: {ranges}, stability is not determined"
    if not result.unresolved.any():
        return reason
    others = np.count_nonzero(result.unresolved) - 1
    more = f" and in {others} more place{'s' * int(others > 1)}" if others else ""
    return f"{reason}; {result.too_coarse(omega)}{more}: margins there may be missing"


def _hidden(omega: Real, result: Bounds) -> list[str]:
    notes = []
    places = np.flatnonzero(result.unresolved)
    for k in places[:_MOST].tolist():
        deg = math.degrees(result.turn[k])
        what = "a resonance" if deg < -25.0 else "an antiresonance" if deg > 25.0 else "something steep"
        if abs(deg) > 140.0:
            what = "a resonance or an antiresonance"
        notes.append(
            f"{between_text(omega[k], omega[k + 1])} the phase turns by {deg:+.0f} deg: {what} lies "
            "between these points; the gain there is not known, crossings are not excluded"
        )
    if places.size > _MOST:
        notes.append(
            f"the same in {places.size - _MOST} more intervals, up to {frequency_text(omega[places[-1] + 1])}"
        )
    return notes


def _lost(omega: Real, result: Bounds) -> list[str]:
    if not result.lost.any():
        return []
    first, count = omega[result.lost.argmax()], np.count_nonzero(result.lost)
    return [
        f"{count} values are smaller than their noise, the first at {frequency_text(first)}: "
        "no gain margin there"
    ]


def _chord(y: Real, k: int, t: float) -> float:
    return float(y[k] + t * (y[k + 1] - y[k]))


def between(omega: Real, k: int, t: float) -> float:
    return float(omega[k] * (omega[k + 1] / omega[k]) ** t)
