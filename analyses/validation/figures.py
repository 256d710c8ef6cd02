"""Bandwidth, resonance, peaks, phase margin and step figures read from measurements.

From a sweep: crossings and maxima are first bracketed on the measured grid, then measured again inside each
bracket, then interpolated by a polynomial through the nearest points; no linear model takes part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import nan, pi, sqrt

import numpy as np
import numpy.typing as npt

from analyses.validation.budget import OutOfTime
from analyses.validation.coherent import LEAST_SAMPLES, coherent
from analyses.validation.own_error import ROUNDING, angle_rounding, carried_on
from analyses.validation.reading import (
    NEAREST,
    NOTHING,
    SAME,
    Reading,
    crossing,
    distinct,
    first_fall,
    maximum,
    value_at,
)
from analyses.validation.response import Sweep
from analyses.validation.step import StepMeasured, step_response
from analyses.validation.sweep import SETTLE_TIME_CONSTANTS, stepped_sine
from analyses.validation.transient import Transient
from nonlinear.loop_setup import LoopSetup

Floats = npt.NDArray[np.float64]
INSIDE = 5  # points measured again inside a bracket
PEAK_DB = 1e-3  # a maximum is measured again until it no longer changes by so much
PEAK_ROUNDS = 5
TOP_DB = 0.02  # so much lower, the points beside a maximum lie close enough; closer, its place is all noise
MOST_SAMPLES = 20_000  # in the window of a point that is measured again
DIP = 1.0  # of the value at zero frequency: lower minima are looked at closely
WIDE = 1.15  # ratio of two frequencies: a crossing between them is measured again
HIGHEST_OF_NYQUIST = 0.4995
RESPONSES = ("open_loop", "closed_loop", "sensitivity")
NO_TIME = "no time left for it"


@dataclass(frozen=True)
class Measured:
    """Figures of one loop as measured, each with its own error; no value where the range holds none.

    Attributes
    ----------
    bandwidth, minus90deg : Reading
        Hz, as `actuator_lti.bandwidth.Bandwidth`, 1/sqrt(2) of the value at zero frequency.
    resonance_peak, resonance : Reading
        Largest T over its value at zero frequency, dB, and where, Hz.
    sensitivity_peak, complementary_peak : Reading
        dB.
    phase_margin, crossover : Reading
        The phase margin nearest to zero, deg, and its crossover, Hz.
    step : StepMeasured
    sweep : Sweep
        With the points measured again.
    point_error : mapping of str to ndarray, shape (K,)
        Relative error of each point of ``open_loop``, ``closed_loop`` and ``sensitivity``: what two windows
        differ by, carried on to the end of the transient.
    no_dc : str
        Why the value at zero frequency is not known; then what is related to it is nothing.
    cut : str
        What was left out for lack of time: coarser readings say so by their own errors.
    """

    bandwidth: Reading
    minus90deg: Reading
    resonance_peak: Reading
    resonance: Reading
    sensitivity_peak: Reading
    complementary_peak: Reading
    phase_margin: Reading
    crossover: Reading
    step: StepMeasured
    sweep: Sweep
    point_error: Mapping[str, Floats]
    no_dc: str = ""
    cut: str = ""


def measure_figures(
    setup: LoopSetup,
    sweep: Sweep,
    settle_ticks: int,
    step_ticks: int,
    slowest_ticks: float | None = None,
    transient: Transient | None = None,
) -> Measured:
    """Measure what a sweep brackets, and the step.

    Parameters
    ----------
    setup : LoopSetup
    sweep : Sweep
        Wide enough to hold what is looked for.
    settle_ticks, step_ticks : int
        Waited for before a point of the sweep; length of the step response.
    slowest_ticks : float, optional
        Slowest time constant of the loop; by default that which the step response is made for.
    transient : Transient, optional
        Where the sweep comes from it: its step, and its points in between.
    """
    cut, slowest = "", slowest_ticks or step_ticks / SETTLE_TIME_CONSTANTS
    try:
        step = step_response(setup, step_ticks, slowest) if transient is None else transient.step
    except OutOfTime:
        step, cut = StepMeasured(nan, nan, nan, nan, np.empty(0), np.empty(0), NO_TIME), "step response"
    lost = step.reason or not np.isfinite(step.final_value) or step.final_value == 0.0
    if not sweep.valid.any():
        raise NotMeasured(f"no frequency could be measured: {most_frequent(sweep.reason)}")
    dc = 1.0 if lost else step.final_value
    fine, changed = sweep, 0.0
    try:
        more = partial(refined, setup, settle_ticks=settle_ticks, transient=transient)
        fine = more(fine, [*_brackets(fine, dc), *_dips(fine, dc)])
        wide = [pair for pair in _falls(fine, dc) if pair[1] > WIDE * pair[0]]
        fine = more(fine, wide)
        fine, changed = _peaks_refined(more, fine)
    except OutOfTime:  # the sweep stands as it is
        cut = ", ".join([*([cut] if cut else []), "points about each figure"])
    f = fine.frequency_hz
    if transient is None:
        each = point_errors(setup, fine, slowest)
        own = dict.fromkeys(RESPONSES, each)
    else:
        own = transient.errors(fine)
    error = partial(_error_at, fine, own, everywhere=transient is None)
    closed = np.abs(fine.closed_loop) / abs(dc)
    phase = np.degrees(_phase(fine.closed_loop * np.sign(dc)))
    crossover, margin = _phase_margin(fine, error)
    at_top = error("closed_loop", _highest(f, closed))
    peak, at = maximum(f, closed, at_top + step.error + changed / 8.7)
    top, _ = maximum(f, np.abs(fine.closed_loop), at_top)
    peak_s, _ = maximum(
        f, np.abs(fine.sensitivity), error("sensitivity", _highest(f, np.abs(fine.sensitivity)))
    )
    low = Reading(abs(dc), abs(dc) * step.error)
    over = (peak.value or 0.0) > 1.0
    return Measured(
        bandwidth=first_fall(
            f, closed, sqrt(0.5), sqrt(0.5) * (error("closed_loop", _fall(f, closed, sqrt(0.5))) + step.error)
        ),
        minus90deg=first_fall(
            f, phase, -90.0, float(np.degrees(error("closed_loop", _fall(f, phase, -90.0))))
        ),
        resonance_peak=_decibel(peak) if over else Reading(0.0, 8.7 * peak.error),
        resonance=at if over else Reading(0.0),
        sensitivity_peak=_decibel(peak_s, changed),
        complementary_peak=_decibel(top if over else low, changed),
        phase_margin=margin,
        crossover=crossover,
        step=step,
        sweep=fine,
        point_error=own,
        no_dc=f"the step that gives the value at zero frequency: {step.reason or 'no motion'}"
        if lost
        else "",
        cut=cut,
    )


def _error_at(sweep: Sweep, own: Mapping[str, Floats], name: str, hertz: float, *, everywhere: bool) -> float:
    """Relative error of the points about a frequency; of all, where a transient may hide from some."""
    errors, valid = own[name], sweep.valid
    if everywhere or not np.isfinite(hertz):
        return float(errors[valid].max())
    k = int(np.searchsorted(sweep.frequency_hz, hertz))
    near = slice(max(k - NEAREST, 0), k + NEAREST)
    return float(errors[near][valid[near]].max(initial=0.0))


def _highest(f: Floats, values: Floats) -> float:
    return float(f[int(np.argmax(np.where(np.isfinite(values), values, -np.inf)))])


def _fall(f: Floats, values: Floats, level: float) -> float:
    """Where values first fall below a level; NaN if nowhere."""
    below = values < level
    return float(f[int(np.argmax(below))]) if below.any() else nan


BESIDE = 2  # points on either side


def point_errors(setup: LoopSetup, sweep: Sweep, slowest_ticks: float) -> Floats:
    """Relative error of each point: the change between its windows, carried on, and rounding."""
    from scipy.ndimage import maximum_filter1d

    tick_s = setup.design.controller.period_s
    window = coherent(sweep.frequency_hz, tick_s, setup.base_ticks).ticks
    slowest = max(slowest_ticks, 1.0)
    own = sweep.unsteadiness
    if own.size > 2 * BESIDE:  # a transient that swings may hide from one point, not from those beside it
        own = maximum_filter1d(np.where(np.isfinite(own), own, 0.0), 2 * BESIDE + 1)
    seen = np.maximum(np.abs(sweep.closed_loop * sweep.amplitude), 1e-300)
    rounding = angle_rounding(setup, window, sweep.ticks, seen) / seen
    return carried_on(own, window, slowest) + ROUNDING + np.where(np.isfinite(rounding), rounding, 0.0)


def _decibel(value: Reading, more_db: float = 0.0) -> Reading:
    """A ratio in dB, with an error that is added in dB."""
    size = max(value.value or 0.0, 1e-300)
    return Reading(20.0 * float(np.log10(size)), 8.7 * value.error / size + more_db)


class NotMeasured(Exception):
    """A loop of which nothing could be measured; the message says why."""


def most_frequent(reasons: Sequence[str]) -> str:
    """The reason that most points have, with their number."""
    given = [text for text in reasons if text]
    if not given:
        return ""
    word = max(sorted(set(given)), key=given.count)
    return f"{word} at {given.count(word)} of {len(reasons)} frequencies"


def _peaks_refined(
    more: Callable[[Sweep, list[tuple[float, float]]], Sweep], sweep: Sweep
) -> tuple[Sweep, float]:
    """Measure around the maxima of T and S until they no longer change; with the last change in dB."""
    before, change = _peaks_db(sweep), 0.0
    for _ in range(PEAK_ROUNDS):
        pairs = []
        for values in (np.abs(sweep.closed_loop), np.abs(sweep.sensitivity)):
            pairs += _beside_top(sweep.frequency_hz, values)
        if not pairs:
            break
        sweep = more(sweep, list(dict.fromkeys(pairs)))
        after = _peaks_db(sweep)
        change, before = float(np.abs(after - before).max()), after
        if change < PEAK_DB:
            break
    return sweep, change


def _beside_top(frequency_hz: Floats, values: Floats) -> list[tuple[float, float]]:
    """The intervals beside the largest value; none where the points beside it are nearly as high."""
    f, v = distinct(frequency_hz, values)
    k = int(np.argmax(np.where(np.isfinite(v), v, -np.inf)))
    if 0 < k < v.size - 1 and bool((20.0 * np.log10(v[k] / v[[k - 1, k + 1]]) < TOP_DB).all()):
        return []
    return [(float(f[j]), float(f[j + 1])) for j in (k - 1, k) if j >= 0 and j + 1 < f.size]


def _peaks_db(sweep: Sweep) -> Floats:
    """Maxima of T and S in dB."""
    both = (maximum(sweep.frequency_hz, np.abs(x))[0].value for x in (sweep.closed_loop, sweep.sensitivity))
    return 20.0 * np.log10(np.array(list(both), dtype=float))


def refined(
    setup: LoopSetup,
    sweep: Sweep,
    brackets: list[tuple[float, float]],
    settle_ticks: int,
    transient: Transient | None = None,
) -> Sweep:
    """The sweep with more points inside each bracket, at the amplitudes found before.

    Inside a narrow bracket windows are longer: the frequencies that fill one lie closer together.
    """
    asked = [np.geomspace(a, b, INSIDE + 2)[1:-1] for a, b in brackets if b > a]
    if not asked:
        return sweep
    samples = [np.full(INSIDE, _samples(a, b)) for a, b in brackets if b > a]
    hertz, order = np.unique(np.concatenate(asked), return_index=True)
    tick_s, highest = setup.design.controller.period_s, HIGHEST_OF_NYQUIST / setup.period_s
    if transient is not None:
        hertz = hertz[_new(hertz, sweep.frequency_hz, highest)]
        return sweep.joined(transient.sweep(hertz)) if hertz.size else sweep
    window = coherent(
        hertz,
        tick_s,
        setup.base_ticks,
        least_samples=np.maximum(np.concatenate(samples)[order], LEAST_SAMPLES),
    )
    window = window.part(_new(window.frequency_hz, sweep.frequency_hz, highest))
    if not window.ticks.size:
        return sweep
    amplitude = np.interp(np.log(window.frequency_hz), np.log(sweep.frequency_hz), sweep.amplitude)
    found = stepped_sine(setup, window.frequency_hz, settle_ticks, amplitude=amplitude, window=window)
    return sweep.joined(found)


def _samples(low: float, high: float) -> int:
    """Samples of a window of which the frequencies lie closer together than the points inside a bracket."""
    apart = float(np.log(high / low)) / (INSIDE + 1)
    return int(min(max(2.0 / apart, LEAST_SAMPLES), MOST_SAMPLES))


def _new(hertz: Floats, known: Floats, highest: float) -> npt.NDArray[np.int64]:
    """Numbers of the frequencies that have not been measured yet, each once."""
    result, seen = [], np.log(known)
    for k, x in enumerate(np.log(hertz)):
        if hertz[k] < highest and np.abs(seen - x).min(initial=np.inf) > SAME:
            result.append(k)
            seen = np.append(seen, x)
    return np.array(result, dtype=np.int64)


def _brackets(sweep: Sweep, dc: float) -> list[tuple[float, float]]:
    """Where to look closer: crossings of T and L, maxima of T and S."""
    f = sweep.frequency_hz
    closed = np.abs(sweep.closed_loop) / abs(dc)
    pairs = []
    gain = np.abs(sweep.open_loop)
    outside, known = gain > 1.0, np.isfinite(gain)
    crossed = (outside[1:] != outside[:-1]) & known[1:] & known[:-1]
    pairs += [(int(k), int(k) + 1) for k in np.flatnonzero(crossed)]
    for values in (closed, np.abs(sweep.sensitivity)):
        k = int(np.argmax(np.where(np.isfinite(values), values, -1.0)))
        pairs += [(j, j + 1) for j in (k - 1, k) if j >= 0 and j + 1 < f.size]
    return _falls(sweep, dc) + [(float(f[a]), float(f[b])) for a, b in dict.fromkeys(pairs)]


def _falls(sweep: Sweep, dc: float) -> list[tuple[float, float]]:
    """Where T falls through -3 dB and -90 deg first."""
    f = sweep.frequency_hz
    phase = np.degrees(_phase(sweep.closed_loop * np.sign(dc)))
    pairs = []
    for below in (np.abs(sweep.closed_loop) / abs(dc) < sqrt(0.5), phase < -90.0):
        k = int(np.argmax(below))
        if below[k] and k > 0:
            pairs.append((float(f[k - 1]), float(f[k])))
    return pairs


def _dips(sweep: Sweep, dc: float) -> list[tuple[float, float]]:
    """Around minima of T that may dip below -3 dB between two points."""
    f, v = distinct(sweep.frequency_hz, np.abs(sweep.closed_loop) / abs(dc))
    with np.errstate(invalid="ignore"):
        low = (v[1:-1] <= v[:-2]) & (v[1:-1] <= v[2:]) & (v[1:-1] >= sqrt(0.5)) & (v[1:-1] < DIP)
    return [(float(f[k + j]), float(f[k + j + 1])) for k in np.flatnonzero(low) for j in (0, 1)]


def _phase_margin(sweep: Sweep, error: Callable[[str, float], float]) -> tuple[Reading, Reading]:
    """Crossover (Hz) and phase margin (deg) nearest to zero; ``error`` gives that of the points."""
    with np.errstate(divide="ignore"):
        f, gain = distinct(sweep.frequency_hz, np.log(np.abs(sweep.open_loop)))
    _, phase = distinct(sweep.frequency_hz, np.degrees(_phase(sweep.open_loop)))
    result = []
    for k in np.flatnonzero((gain[1:] > 0.0) != (gain[:-1] > 0.0)):
        if not np.isfinite(gain[k : k + 2]).all():
            continue  # a point that could not be measured hides what lies between
        own = error("open_loop", float(f[k]))
        hertz = crossing(f, gain, int(k), 0.0, own)
        angle = value_at(f, phase, int(k), hertz, float(np.degrees(own)))
        assert angle.value is not None
        result.append((hertz, Reading((angle.value + 360.0) % 360.0 - 180.0, angle.error)))
    return min(result, key=lambda item: abs(item[1].value or 0.0), default=(NOTHING, NOTHING))


def _phase(response: npt.NDArray[np.complex128]) -> Floats:
    """Unwrapped phase in rad; NaN only where the response is not finite."""
    out, measured = np.full(response.size, np.nan), np.isfinite(response)
    out[measured] = np.unwrap(np.angle(response[measured]))
    return out


def hertz(omega_rad_s: float | None) -> float | None:
    """rad/s as Hz."""
    return None if omega_rad_s is None else omega_rad_s / (2.0 * pi)
