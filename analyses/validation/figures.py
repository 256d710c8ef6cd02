"""Bandwidth, resonance, peaks, phase margin and step figures read from measurements.

From a sweep: crossings and maxima are first bracketed on the measured grid, then measured again inside each
bracket, then interpolated by a polynomial through the nearest points; no linear model takes part.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
import numpy.typing as npt

from analyses.validation.response import Sweep
from analyses.validation.rig import Rig, small_rig
from analyses.validation.sweep import stepped_sine

Floats = npt.NDArray[np.float64]
INSIDE = 5  # points measured again inside a bracket
PEAK_DB = 1e-3  # a maximum is measured again until it no longer changes by so much
PEAK_ROUNDS = 5
DIP = 1.0  # of the value at zero frequency: lower minima are looked at closely
WIDE = 1.15  # ratio of two frequencies: a crossing between them is measured again
UNSETTLED = 2e-4  # of a step: so much may its last tenth still change for its end to count as the final value
NEAREST = 6  # points of the interpolating polynomial
SAME = 1e-9  # of log f: points nearer to each other count as one
HIGHEST_OF_NYQUIST = 0.4995
STEP_PART = 0.02  # of the room of the signal


@dataclass(frozen=True)
class StepMeasured:
    """Step response of a loop in the simulator; figures as `actuator_lti.step.StepFigures`.

    ``reason`` is empty where neither a limit nor a reversal took part.
    """

    rise_time_s: float
    overshoot_percent: float
    settling_time_s: float
    final_value: float
    time_s: Floats
    response: Floats
    reason: str


@dataclass(frozen=True)
class Measured:
    """Figures of one loop as measured; ``None`` where the response has no such figure in the range.

    Attributes
    ----------
    bandwidth_hz, minus90deg_hz : float or None
        As `actuator_lti.bandwidth.Bandwidth`, 1/sqrt(2) of the value at zero frequency.
    resonance_db, resonance_hz : float
        Largest T over its value at zero frequency.
    sensitivity_peak_db, complementary_peak_db : float
    phase_margin_deg, crossover_hz : float or None
        The phase margin nearest to zero.
    step : StepMeasured
    sweep : Sweep
        With the points measured again.
    peak_error_db : float
        Change of the maxima of T and S when they were last measured again more closely.
    """

    bandwidth_hz: float | None
    minus90deg_hz: float | None
    resonance_db: float
    resonance_hz: float
    sensitivity_peak_db: float
    complementary_peak_db: float
    phase_margin_deg: float | None
    crossover_hz: float | None
    step: StepMeasured
    sweep: Sweep
    peak_error_db: float = 0.0


def measure_figures(setup: Rig, sweep: Sweep, settle_ticks: int, step_ticks: int) -> Measured:
    """Measure what a sweep brackets, and the step.

    Parameters
    ----------
    setup : Rig
    sweep : Sweep
        Wide enough to hold what is looked for.
    settle_ticks, step_ticks : int
        Waited for before a point of the sweep; length of the step response.
    """
    step = step_response(setup, step_ticks)
    if step.reason or not np.isfinite(step.final_value) or step.final_value == 0.0:
        raise NotMeasured(f"the step that gives the value at zero frequency: {step.reason or 'no motion'}")
    if not sweep.valid.any():
        raise NotMeasured(f"no frequency could be measured: {most_frequent(sweep.reason)}")
    dc = step.final_value
    fine = refined(setup, sweep, [*_brackets(sweep, dc), *_dips(sweep, dc)], settle_ticks)
    wide = [pair for pair in _falls(fine, dc) if pair[1] > WIDE * pair[0]]
    fine = refined(setup, fine, wide, settle_ticks)
    fine, error = _peaks_refined(setup, fine, settle_ticks)
    f = fine.frequency_hz
    closed = np.abs(fine.closed_loop) / abs(dc)
    phase = np.degrees(_phase(fine.closed_loop * np.sign(dc)))
    crossover, margin = _phase_margin(fine)
    peak_t, at_t = maximum(f, closed)
    peak_s, _ = maximum(f, np.abs(fine.sensitivity))
    return Measured(
        bandwidth_hz=first_fall(f, closed, sqrt(0.5)),
        minus90deg_hz=first_fall(f, phase, -90.0),
        resonance_db=max(20.0 * np.log10(peak_t), 0.0),
        resonance_hz=at_t if peak_t > 1.0 else 0.0,
        sensitivity_peak_db=20.0 * np.log10(peak_s),
        complementary_peak_db=20.0 * np.log10(abs(dc) * max(peak_t, 1.0)),
        phase_margin_deg=margin,
        crossover_hz=crossover,
        step=step,
        sweep=fine,
        peak_error_db=error,
    )


class NotMeasured(Exception):
    """A loop of which nothing could be measured; the message says why."""


def most_frequent(reasons: Sequence[str]) -> str:
    """The reason that most points have, with their number."""
    given = [text for text in reasons if text]
    if not given:
        return ""
    word = max(sorted(set(given)), key=given.count)
    return f"{word} at {given.count(word)} of {len(reasons)} frequencies"


def _peaks_refined(setup: Rig, sweep: Sweep, settle_ticks: int) -> tuple[Sweep, float]:
    """Measure around the maxima of T and S until they no longer change; with the last change in dB."""
    before, change = _peaks_db(sweep), 0.0
    for _ in range(PEAK_ROUNDS):
        pairs = []
        for values in (np.abs(sweep.closed_loop), np.abs(sweep.sensitivity)):
            f, v = _distinct(sweep.frequency_hz, values)
            k = int(np.argmax(np.where(np.isfinite(v), v, -np.inf)))
            pairs += [(float(f[j]), float(f[j + 1])) for j in (k - 1, k) if j >= 0 and j + 1 < f.size]
        sweep = refined(setup, sweep, list(dict.fromkeys(pairs)), settle_ticks)
        after = _peaks_db(sweep)
        change, before = float(np.abs(after - before).max()), after
        if change < PEAK_DB:
            break
    return sweep, change


def _peaks_db(sweep: Sweep) -> Floats:
    """Maxima of T and S in dB."""
    both = (maximum(sweep.frequency_hz, np.abs(x))[0] for x in (sweep.closed_loop, sweep.sensitivity))
    return 20.0 * np.log10(np.array(list(both)))


def refined(setup: Rig, sweep: Sweep, brackets: list[tuple[float, float]], settle_ticks: int) -> Sweep:
    """The sweep with more points inside each bracket, at the amplitudes found before."""
    if not brackets:
        return sweep
    inside = [np.geomspace(a, b, INSIDE + 2)[1:-1] for a, b in brackets]
    asked = np.unique(np.concatenate(inside))
    asked = asked[asked < HIGHEST_OF_NYQUIST / setup.period_s]
    if not asked.size:
        return sweep
    amplitude = np.interp(np.log(asked), np.log(sweep.frequency_hz), sweep.amplitude)
    return sweep.joined(stepped_sine(setup, asked, settle_ticks, amplitude=amplitude))


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
    f, v = _distinct(sweep.frequency_hz, np.abs(sweep.closed_loop) / abs(dc))
    with np.errstate(invalid="ignore"):
        low = (v[1:-1] <= v[:-2]) & (v[1:-1] <= v[2:]) & (v[1:-1] >= sqrt(0.5)) & (v[1:-1] < DIP)
    return [(float(f[k + j]), float(f[k + j + 1])) for k in np.flatnonzero(low) for j in (0, 1)]


def _phase_margin(sweep: Sweep) -> tuple[float | None, float | None]:
    """Crossover (Hz) and phase margin (deg) nearest to zero."""
    with np.errstate(divide="ignore"):
        f, gain = _distinct(sweep.frequency_hz, np.log(np.abs(sweep.open_loop)))
    _, phase = _distinct(sweep.frequency_hz, _phase(sweep.open_loop))
    found = []
    for k in np.flatnonzero((gain[1:] > 0.0) != (gain[:-1] > 0.0)):
        if not np.isfinite(gain[k : k + 2]).all():
            continue  # a point that could not be measured hides what lies between
        hertz = _root(f, gain, int(k), 0.0)
        angle = np.degrees(float(_local(f, phase, int(k))(np.log(hertz))))
        found.append((hertz, (angle + 180.0 + 180.0) % 360.0 - 180.0))
    return min(found, key=lambda item: abs(item[1]), default=(None, None))


def first_fall(frequency_hz: Floats, values: Floats, level: float) -> float | None:
    """Frequency at which values first fall below a level.

    ``None`` if never in the range, or if the point before was not measured (not finite).
    """
    f, v = _distinct(frequency_hz, values)
    below = v < level
    k = int(np.argmax(below))
    if not below[k] or k == 0 or not np.isfinite(v[k - 1]):
        return None
    return _root(f, v, k - 1, level)


def _phase(response: npt.NDArray[np.complex128]) -> Floats:
    """Unwrapped phase in rad; NaN only where the response is not finite."""
    out, measured = np.full(response.size, np.nan), np.isfinite(response)
    out[measured] = np.unwrap(np.angle(response[measured]))
    return out


def _distinct(frequency_hz: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Points without those that lie on the one before."""
    apart = np.concatenate([[True], np.diff(np.log(frequency_hz)) > SAME])
    return frequency_hz[apart], values[apart]


def maximum(frequency_hz: Floats, values: Floats) -> tuple[float, float]:
    """Largest value between the points, and where."""
    from scipy.optimize import minimize_scalar

    k = int(np.argmax(np.where(np.isfinite(values), values, -np.inf)))
    inside = 0 < k < values.size - 1 and np.isfinite(values[k - 1 : k + 2]).all()
    if not inside:
        return float(values[k]), float(frequency_hz[k])
    curve = _local(frequency_hz, values, k)
    ends = (np.log(frequency_hz[k - 1]), np.log(frequency_hz[k + 1]))
    found = minimize_scalar(
        lambda x: -float(curve(x)), bounds=ends, method="bounded", options={"xatol": 1e-9}
    )
    return -float(found.fun), float(np.exp(found.x))


def _root(frequency_hz: Floats, values: Floats, k: int, level: float) -> float:
    """Where the curve passes a level between points k and k + 1, both measured and apart."""
    from scipy.optimize import brentq

    curve = _local(frequency_hz, values - level, k)
    a, b = np.log(frequency_hz[k]), np.log(frequency_hz[k + 1])
    return float(np.exp(brentq(lambda x: float(curve(x)), a, b, xtol=1e-13)))


def _local(frequency_hz: Floats, values: Floats, k: int) -> Callable[[float], float]:
    """Polynomial in log f through the points nearest to k; exact at the points."""
    from scipy.interpolate import BarycentricInterpolator

    x = np.log(frequency_hz)
    good = np.flatnonzero(np.isfinite(values) & np.concatenate([[True], np.diff(x) > SAME]))
    order = np.argsort(np.abs(x[good] - 0.5 * (x[k] + x[min(k + 1, x.size - 1)])), kind="stable")
    near = np.sort(good[order[:NEAREST]])
    curve = BarycentricInterpolator(x[near], values[near])
    return lambda at_x: float(curve(at_x))


def step_response(setup: Rig, settle_ticks: int) -> StepMeasured:
    """Step added at the rig's point: what comes back is the step response of T."""
    signal = {"u": "voltage_V", "i_ref": "current_command_A", "w_ref": "speed_command_rad_s"}[setup.point]
    room = setup.room[signal]
    size = STEP_PART * (room if np.isfinite(room) else max(abs(setup.ride.speed_rad_s), 1.0))
    for _ in range(3):
        time_s, response, reason = _step(setup, size, settle_ticks)
        if not reason:
            break
        size *= 0.2
    found = step_figures_of(time_s, response, reason)
    if reason:  # the smallest step still met a limit, or friction: the linear loop shows itself without them
        time_s, response, reason = _step(
            small_rig(setup.design, setup.loop, held=setup.held), size, settle_ticks
        )
        found = step_figures_of(time_s, response, reason)
    return found


def _step(setup: Rig, size: float, settle_ticks: int) -> tuple[Floats, Floats, str]:
    """Run one step; times and response at the updates of the point."""
    row = setup.row()
    n = setup.hold_ticks
    row["ticks"] = settle_ticks + 4 * n
    row.step(setup.point, size)
    run = row.trajectory()
    before = run.probes[setup.point].before[::n]
    steady = before[0]
    reason = next((f"{name} limit" for name, use in run.limits.items() if use.active), "")
    if run.status != "ok":
        reason = run.status
    elif not reason and run.events and setup.ride.friction_on:
        reason = "speed reversal"
    return run.time_s[::n], (steady - before) / size, reason


def step_figures_of(time_s: Floats, response: Floats, reason: str = "") -> StepMeasured:
    """Rise (10 to 90 %), overshoot and settling (2 %) at the samples of a response."""
    final = float(response[-1])
    nothing = float("nan")
    if not np.isfinite(response).all() or final == 0.0:
        return StepMeasured(nothing, nothing, nothing, nothing, time_s, response, reason or "run stopped")
    y = response / final
    moved = float(np.ptp(y[-max(y.size // 10, 2) :]))
    if not reason and moved > UNSETTLED:
        reason = (
            f"not settled at the end of the longest run of {time_s[-1]:.3g} s (still moves by {moved:.1g})"
        )
    rise = float(time_s[int(np.argmax(y >= 0.9))] - time_s[int(np.argmax(y >= 0.1))])
    outside = np.flatnonzero(np.abs(y - 1.0) > 0.02)
    settled = float(time_s[min(int(outside[-1]) + 1, y.size - 1)]) if outside.size else 0.0
    over = max(100.0 * (float(y.max()) - 1.0), 0.0)
    return StepMeasured(rise, over, settled, final, time_s, response, reason)


def hertz(omega_rad_s: float | None) -> float | None:
    """rad/s as Hz."""
    return None if omega_rad_s is None else omega_rad_s / (2.0 * pi)
