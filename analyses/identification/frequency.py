"""Frequency response from a record of a periodic excitation: lines, their means over periods, their noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from actuator_lti.errors import InputError
from analyses.estimation.arrays import ComplexArray, FloatArray
from analyses.records.record import Record

MIN_PERIODS = 4
TOP = 0.4  # of the sampling frequency: lines above are not looked at
BESIDE = 6
"""Places on either side of a line that its noise is taken from; a sharp resonance allows no more."""
EXCITED = 25.0
"""A line counts as excited where its power is this many times that of its noise."""


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Spectral lines of several signals at the excited frequencies.

    ``means`` are complex amplitudes over all periods, shape (signals, lines); ``noise`` is their
    covariance, shape (lines, signals, signals), from the spectrum beside each line, with ``freedom``
    (complex) degrees.
    """

    omega_rad_s: FloatArray
    means: ComplexArray
    noise: ComplexArray
    names: tuple[str, ...]
    periods: int
    freedom: int


def excited_lines(record: Record, names: tuple[str, ...], period_s: float) -> Lines:
    """The lines of a periodic excitation; the first signal shows which of them are excited.

    The period is a whole number of samples; the first one is left out, for the transient. A signal that
    drifts (an angle under a mean speed) loses the straight line of its mean rate first. The noise of a line
    is what the spectrum of the whole record holds beside it, where a periodic signal has nothing. (The
    scatter between periods would be too large: what a motion that is not periodic leaves at the ends of one
    period comes back at the start of the next with the opposite sign, and goes out of the mean.)
    """
    samples = round(period_s / record.period_s)
    if samples < 8 or abs(samples * record.period_s - period_s) > 1e-3 * record.period_s:
        told = f"must be a whole number (8 or more) of samples of {record.period_s:g} s"
        raise InputError(f"period {period_s:g} s: {told}", where=record.name)
    periods = len(record) // samples - 1
    if periods < MIN_PERIODS:
        told = f"{periods} periods of {period_s:g} s after the first: at least {MIN_PERIODS}"
        raise InputError(told, where=record.name)
    start = len(record) - periods * samples
    spectra = np.array([_spectrum(record[name][start:], periods, samples) for name in names])
    means, noise, freedom = _lines(spectra, periods)
    hertz = np.arange(means.shape[1]) / period_s
    limit = TOP / record.period_s
    power = np.abs(means[0]) ** 2
    floor = np.maximum(np.real(noise[:, 0, 0]), 1e-24 * float(np.max(power[1:], initial=0.0)))
    strong = power > 1e-6 * float(np.max(power[1:], initial=0.0))
    chosen = (power > EXCITED * floor) & strong & (hertz > 0.0) & (hertz <= limit)
    if np.count_nonzero(chosen) < MIN_PERIODS:
        raise InputError(f"{names[0]}: no lines of a period of {period_s:g} s are excited", where=record.name)
    return Lines(
        omega_rad_s=np.asarray(2.0 * np.pi * hertz[chosen]),
        means=means[:, chosen],
        noise=noise[chosen],
        names=names,
        periods=periods,
        freedom=freedom,
    )


def _spectrum(values: FloatArray, periods: int, samples: int) -> ComplexArray:
    """Amplitudes of the whole record, a line at every ``periods``-th place; the mean rate is taken off."""
    block = values[: periods * samples].reshape(periods, samples)
    rate = (block[-1].mean() - block[0].mean()) / max((periods - 1) * samples, 1)
    straight = rate * np.arange(periods * samples)
    return np.asarray(np.fft.rfft(block.ravel() - straight) * (2.0 / (periods * samples)))


def _lines(spectra: ComplexArray, periods: int) -> tuple[ComplexArray, ComplexArray, int]:
    """Lines, their covariance from the nearest places beside each that are no lines, and its freedom."""
    reach = min(periods - 1, BESIDE)
    places = np.arange(0, spectra.shape[1] - reach, periods)
    away = np.array([step for step in range(-reach, reach + 1) if step])
    beside = spectra[:, np.abs(places[:, None] + away)]
    noise = np.einsum("akr,bkr->kab", beside, beside.conj()) / len(away)
    return spectra[:, places], noise, len(away)


def response(lines: Lines, output: str, by: str) -> tuple[ComplexArray, FloatArray]:
    """Frequency response from one signal to another, and its relative standard error, line by line."""
    k, j = lines.names.index(output), lines.names.index(by)
    g = lines.means[k] / lines.means[j]
    n = lines.noise
    relative = (
        np.real(n[:, k, k]) / np.abs(lines.means[k]) ** 2
        + np.real(n[:, j, j]) / np.abs(lines.means[j]) ** 2
        - 2.0 * np.real(n[:, k, j] / (lines.means[k] * lines.means[j].conj()))
    )
    return g, np.sqrt(np.maximum(relative, 0.0))


def period_of_excitation(record: Record, name: str) -> float:
    """The period with which a recorded command repeats itself, five times or more."""

    values = record[name] - np.polyval(np.polyfit(record.time_s, record[name], 1), record.time_s)
    n = len(values)
    size = next_fast_len(2 * n, real=True)
    spectrum = rfft(values, size)
    correlation = irfft(np.abs(spectrum) ** 2, size)[:n]
    power = np.cumsum(values[::-1] ** 2)[::-1]
    early = np.cumsum(values**2)
    lags = np.arange(1, n // (MIN_PERIODS + 1))
    alike = correlation[lags] / np.sqrt(np.maximum(power[lags] * early[n - 1 - lags], 1e-300))
    fallen = int(np.argmax(alike < 0.5))
    peaks = np.flatnonzero(alike[fallen:] > 0.98) + fallen
    if not len(alike) or not fallen or not len(peaks):
        told = f"{name} does not repeat itself {MIN_PERIODS + 1} times: give the period of the excitation"
        raise InputError(told, where=record.name)
    group = peaks[peaks <= peaks[0] * 1.02 + 2]
    best = group[int(np.argmax(alike[group]))]
    return float(lags[best] * record.period_s)
