"""Margins from frequency-response data: bounded by neighbouring points, or refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.extremes import DISK
from actuator_lti.margins.loop import Complex, Real
from actuator_lti.margins.rational import delay_margins
from actuator_lti.margins.results import Agreement, DiskMargin, GainMargin, PhaseMargin, StabilityMargins

LARGEST_TURN_DEG = 60.0
LARGEST_STEP_DB = 10.0
_NOTES = (
    "measured data: stability cannot be told from them, and outside of their band nothing is known",
    "each crossing lies between two neighbouring points (bracket_rad_s); the figure between them is "
    "interpolated, its bounds are ratio_range and deg_range",
    "modulus and disk margin are the smallest values at measured points: upper bounds",
)


def measured_margins(data: Any, delay_s: float, band_rad_s: tuple[float, float] | None) -> StabilityMargins:
    """Margins from `control.FrequencyResponseData`, see `stability_margins`.

    Raises
    ------
    InputError
        More than one input or output, fewer than two points, values that are zero or not finite, or
        neighbouring points so far apart (60 deg, 10 dB) that a crossing between them could not be bounded.
    """
    period_s = float(data.dt) if data.dt not in (None, 0, True) else None
    omega, L = _points(data, delay_s, band_rad_s)
    _refuse_coarse(omega, L)
    phase_margins = _phase_margins(omega, L)
    distance, alpha = np.abs(1.0 + L), DISK.distance(L)
    k, j = int(distance.argmin()), int(alpha.argmin())
    return StabilityMargins(
        stable=None,
        verdict="undecided",
        gain_margins=_gain_margins(omega, L),
        phase_margins=phase_margins,
        delay_margins=delay_margins(phase_margins, period_s),
        modulus_margin=float(distance[k]),
        modulus_frequency_rad_s=float(omega[k]),
        disk_margin=DiskMargin(float(alpha[j]), float(omega[j])),
        period_s=period_s,
        delay_s=delay_s,
        band_rad_s=(float(omega[0]), float(omega[-1])),
        method="neighbouring points of measured data; straight between them in dB and deg over log frequency",
        agreement=Agreement(None, None),
        notes=_NOTES,
    )


def _points(data: Any, delay_s: float, band: tuple[float, float] | None) -> tuple[Real, Complex]:
    if data.ninputs != 1 or data.noutputs != 1:
        raise InputError(f"a loop has one input and one output; this has {data.ninputs} and {data.noutputs}")
    omega = np.asarray(data.omega, dtype=float)
    L = np.asarray(data.frdata, dtype=complex).reshape(-1)
    order = omega.argsort()
    omega, L = omega[order], L[order]
    if band is not None:
        inside = (omega >= band[0]) & (omega <= band[1])
        omega, L = omega[inside], L[inside]
    positive = omega > 0.0
    omega, L = omega[positive], L[positive]
    if omega.size < 2:
        raise InputError("measured data: at least two points above zero frequency are needed")
    if not (np.isfinite(L).all() and np.isfinite(omega).all()) or (L == 0.0).any():
        raise InputError("measured data: every value must be finite and not zero")
    if (np.diff(omega) <= 0.0).any():
        raise InputError("measured data: a frequency is given twice")
    return omega, L * np.exp(-1j * omega * delay_s)


def _refuse_coarse(omega: Real, L: Complex) -> None:
    ratio = L[1:] / L[:-1]
    turn, step = np.abs(np.degrees(np.angle(ratio))), np.abs(20.0 * np.log10(np.abs(ratio)))
    bad = np.flatnonzero((turn > LARGEST_TURN_DEG) | (step > LARGEST_STEP_DB))
    if bad.size:
        k = int(bad[0])
        raise InputError(
            f"measured data are too coarse between {omega[k]:.6g} and {omega[k + 1]:.6g} rad/s: "
            f"{turn[k]:.1f} deg and {step[k]:.1f} dB from point to point (allowed: {LARGEST_TURN_DEG:g} deg, "
            f"{LARGEST_STEP_DB:g} dB), a crossing in between could not be bounded; measure more points there"
        )


def _gain_margins(omega: Real, L: Complex) -> tuple[GainMargin, ...]:
    angle = np.angle(-L)
    out = []
    near = (angle[1:] * angle[:-1] <= 0.0) & (np.abs(angle[1:] - angle[:-1]) < math.pi)
    for k in np.flatnonzero(near).tolist():
        if angle[k] == 0.0 and k > 0:
            continue  # counted with the interval before
        t = float(angle[k] / (angle[k] - angle[k + 1])) if angle[k] != angle[k + 1] else 0.0
        low, high = -np.log(np.abs(L[k])), -np.log(np.abs(L[k + 1]))
        ends = sorted((math.exp(low), math.exp(high)))
        ratio = math.exp(low + t * (high - low))
        out.append(GainMargin(ratio, _between(omega, k, t), False, _bracket(omega, k), (ends[0], ends[1])))
    return tuple(out)


def _phase_margins(omega: Real, L: Complex) -> tuple[PhaseMargin, ...]:
    gain = np.log(np.abs(L))
    out = []
    for k in np.flatnonzero(gain[1:] * gain[:-1] <= 0.0).tolist():
        if (gain[k] == 0.0 and k > 0) or gain[k] == gain[k + 1]:
            continue
        t = float(gain[k] / (gain[k] - gain[k + 1]))
        low = float(np.degrees(np.angle(-L[k])))
        turn = float(np.degrees(np.angle(L[k + 1] / L[k])))
        deg = low + t * turn
        deg -= 360.0 * math.ceil((deg - 180.0) / 360.0)
        ends = sorted((low, low + turn))
        out.append(PhaseMargin(deg, _between(omega, k, t), False, _bracket(omega, k), (ends[0], ends[1])))
    return tuple(out)


def _between(omega: Real, k: int, t: float) -> float:
    return float(omega[k] * (omega[k + 1] / omega[k]) ** t)


def _bracket(omega: Real, k: int) -> tuple[float, float]:
    return float(omega[k]), float(omega[k + 1])
