"""The map of amplitude and frequency, and frequency responses at several amplitudes, read from it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.drawing import draw
from actuator_lti.errors import finite_number, whole_number
from actuator_lti.loops import Loops
from actuator_lti.loops.limiters import onset
from actuator_lti.start.extras import need
from actuator_lti.types import Compared
from analyses.finite import finite
from analyses.friction_effects.breakaway import static_threshold
from analyses.large_signal import tones
from analyses.large_signal.classify import CAUSES, WAVEFORMS, causes, limiter_fractions, not_linear, waveforms
from analyses.large_signal.tones import MOST_TICKS, linear_steady_state, run_until_steady, tone_rows
from analyses.linear.loop_survey import with_cogging

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

COUNTS = 17, 28  # of amplitudes, of frequencies
BELOW_ONSET = 0.95
LONG = 0.1  # periods of the highest tone


@dataclass(frozen=True, eq=False)
class AmplitudeMap(Compared):
    """Sines of many amplitudes and frequencies, each settled; arrays of points are (amplitude, frequency)."""

    load_Nm: float
    amplitude_rad: np.ndarray  # shape (a,): peak command at the output shaft (linear axis: m)
    frequency_hz: np.ndarray  # shape (f,)
    cause: np.ndarray  # shape (a, f): index into `CAUSES`
    waveform: np.ndarray
    limiter_fraction: np.ndarray  # shape (a, f, limiters): of the last window in which each acts
    stick_fraction: np.ndarray  # shape (a, f), as what follows: of the output in the last window
    distortion: np.ndarray
    unsteadiness: np.ndarray  # change of the fundamental since half as long, relative
    response: np.ndarray  # shape (a, f): fundamental of the output over the command
    linear: np.ndarray  # shape (f,): the same from the linear sampled loop, sliding
    onset_rad: Mapping[str, np.ndarray]  # A_k(w) of each limiter, linear, no load; no `slow_protection`
    ticks: int  # simulated in all
    coarser: bool = False  # than asked for, as that would take more than `MOST_TICKS`

    @property
    def gain_db(self) -> np.ndarray:
        """Gain of the fundamental in dB; -inf where nothing moves."""
        with np.errstate(divide="ignore"):
            return np.asarray(20.0 * np.log10(np.abs(self.response)))

    @property
    def phase_deg(self) -> np.ndarray:
        """Phase of the fundamental, unwrapped from the linear one on; NaN where nothing moves."""
        moving = np.abs(self.response) > 1e-4 * np.abs(self.linear)
        phases, linear = np.full(self.response.shape, np.nan), np.unwrap(np.angle(self.linear))
        for phase, row, ok in zip(phases, self.response, moving, strict=True):
            first = linear[np.flatnonzero(ok)[:1]]
            phase[ok] = np.degrees(np.unwrap(np.append(first, np.angle(row[ok])))[first.size :])
        return phases

    def plot_map(self, axes: Any = None, *, linear_axis: bool = False) -> Axes:
        """Draw what acts at each point, and the linear onset lines; gives matplotlib's axes."""
        return draw("plot_map", self.frequency_hz, self.amplitude_rad, self.cause, CAUSES,
            onset_rad=self.onset_rad, linear_axis=linear_axis, axes=axes,
        )  # fmt: skip

    def to_pandas(self) -> pandas.DataFrame:
        """A data frame with one row a point: command, what acts, waveform, fundamental (pandas needed)."""
        amplitude, frequency = np.meshgrid(self.amplitude_rad, self.frequency_hz, indexing="ij")
        columns = {
            "amplitude_rad": amplitude,
            "frequency_hz": frequency,
            "cause": np.array(CAUSES)[self.cause],
            "waveform": np.array(WAVEFORMS)[self.waveform],
        }
        names = ("gain_db", "phase_deg", "distortion", "stick_fraction")
        columns |= {name: getattr(self, name) for name in names}
        frame = need("pandas", "tables", "to_pandas")
        return frame.DataFrame({name: values.ravel() for name, values in columns.items()})

    def share(self, *names: str) -> float:
        """Fraction of the points with one of these causes."""
        return float(np.isin(self.cause, [CAUSES.index(name) for name in names]).mean())


def amplitude_map(
    design: AnyDesign, loops: Loops, *, load_Nm: float = 0.0, friction_on: bool = True,
    counts: tuple[int, int] = COUNTS,
) -> AmplitudeMap:  # fmt: skip
    """Simulate sines over amplitude and frequency and say what each shows.

    ``loops`` are sampled and sliding, of this design; ``counts`` are fewer where they would take more than
    `MOST_TICKS`.
    """
    design = as_design(design)
    finite_number("load_Nm", load_Nm)
    given = tuple(whole_number("counts", each, 2) for each in counts)
    part = min(np.sqrt(MOST_TICKS / (given[0] * tones.work_ticks(design, loops, given[1]))), 1.0)
    counts = max(int(part * given[0]), 2), max(int(part * given[1]), 2)
    frequencies = tones.tones(design, loops, counts[1])
    omega = np.array([t.omega_rad_s for t in frequencies])
    threshold = static_threshold(design, load_Nm).smallest_rad if friction_on else None
    levels = tones.amplitudes(design, counts[0], threshold or None)
    start = linear_steady_state(loops, omega)
    linear_limit, slow = with_cogging(loops, onset(loops, omega)), slow_protection(design, loops)
    which = np.tile(np.arange(len(omega)), len(levels))
    amplitude, linear = np.repeat(levels, len(omega)), start.output[which]
    begin = np.minimum(amplitude, BELOW_ONSET * linear_limit.amplitude_rad[which])
    rows = tone_rows(
        design, frequencies, which, amplitude, start, begin, load_Nm=load_Nm, friction_on=friction_on
    )
    result, change = run_until_steady(rows)
    cause = causes(result, linear, amplitude, friction_on)
    off = np.flatnonzero(cause == CAUSES.index("friction"))
    if len(off):  # the same runs without dry friction: is it that?
        free = tone_rows(
            design, frequencies, which[off], amplitude[off], start, begin[off],
            load_Nm=load_Nm, friction_on=False,
        )  # fmt: skip
        cause[off[not_linear(free.run(), linear[off], amplitude[off])]] = CAUSES.index("other")
    shape = (len(levels), len(omega))
    return AmplitudeMap(
        load_Nm=load_Nm, amplitude_rad=levels, frequency_hz=omega / (2.0 * np.pi), cause=cause.reshape(shape),
        waveform=waveforms(result, change).reshape(shape),
        limiter_fraction=limiter_fractions(result).reshape((*shape, -1)),
        stick_fraction=result.window_stick_fraction.reshape(shape),
        distortion=result.distortion("output_angle_rad").reshape(shape),
        unsteadiness=change.reshape(shape),
        response=(result.phasor("output_angle_rad") / amplitude).reshape(shape), linear=start.output,
        onset_rad={name: a for name, a in linear_limit.each_rad.items() if name not in slow},
        ticks=int(result.column("ticks").sum()), coarser=counts != given,
    )  # fmt: skip


def slow_protection(design: Design, loops: Loops) -> list[str]:
    """Limiters that average for longer than a tone is simulated: they act much later."""
    limits = design.limits
    if limits.peak_time_s is None or limits.overload_time_s is None:
        return []
    return ["overload"] if limits.overload_time_s * tones.frequency_range_hz(design, loops)[1] > LONG else []


FINE = 64  # points between two frequencies of the map, at which the linear response is known
MINUS_3DB = 20.0 * math.log10(math.sqrt(0.5))


@dataclass(frozen=True, eq=False)
class AmplitudeBode(Compared):
    """Responses at the amplitudes that a design asks for, and how the bandwidth falls with amplitude."""

    load_Nm: float
    frequency_hz: np.ndarray  # shape (f,)
    fractions: tuple[float, ...]  # Of full deflection; those of the design that the map has
    amplitude_rad: np.ndarray  # shape (k,)
    gain_db: np.ndarray  # shape (k, f): -inf and NaN where nothing moves, NaN where it did not settle
    phase_deg: np.ndarray
    linear_db: np.ndarray  # shape (f,)
    linear_deg: np.ndarray
    all_amplitude_rad: np.ndarray  # shape (a,): Every amplitude of the map
    # Shape (a,): First crossing; between two frequencies of the map the linear response, and what the
    # simulated one is off by, interpolated on the logarithm of frequency; NaN where there is none in the
    # range (`below_from_start`: already below at the whole frequency), and where it lies beside points that
    # are not steady: a missing point is no value. -3 dB is 1/sqrt(2) of the linear gain at zero frequency
    minus3db_hz: np.ndarray
    minus90deg_hz: np.ndarray
    # Shape (a, 2): steady frequencies between which it first falls; from 0 if the first is below, to inf
    minus3db_range_hz: np.ndarray
    below_from_start: np.ndarray  # shape (a,): below -3 dB at the whole frequency already
    linear_minus3db_hz: float | None
    linear_minus90deg_hz: float | None
    level_db: float = MINUS_3DB


def amplitude_bode(design: Design, loops: Loops, amplitude_map: AmplitudeMap) -> AmplitudeBode:
    """Read the responses at the design's amplitude fractions, and the bandwidths at all, from a map."""
    full = design.validation.full_deflection_rad
    there = amplitude_map.amplitude_rad / full  # a coarse map has not all
    asked = sorted(design.validation.amplitude_fractions)
    nearest = {fraction: int(np.argmin(np.abs(there - fraction))) for fraction in asked}
    on_it = {one: k for one, k in nearest.items() if math.isclose(there[k], one, rel_tol=1e-9)}
    places = list(on_it.values())
    hz, unsteady = amplitude_map.frequency_hz, amplitude_map.waveform == WAVEFORMS.index("not steady")
    gain = np.where(unsteady, np.nan, amplitude_map.gain_db)
    phase = np.where(unsteady, np.nan, amplitude_map.phase_deg)
    steps = np.arange(FINE * (hz.size - 1) + 1) / FINE
    fine = np.exp(np.interp(steps, np.arange(hz.size), np.log(hz)))
    whole = linear_steady_state(loops, 2.0 * math.pi * np.array([1e-6 * hz[0], *fine])).output
    with np.errstate(divide="ignore"):  # the mean of a limited jerk has zeros
        start, *curve = 20.0 * np.log10(np.abs(whole))
    level, fine_db = MINUS_3DB + start, np.array(curve)
    fine_deg = np.degrees(np.unwrap(np.angle(whole[1:])))

    def between(values: np.ndarray, linear: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):
            return linear + np.interp(steps, np.arange(hz.size), values - linear[::FINE])

    first_3 = np.array([_crossing(fine, between(row, fine_db), level) for row in gain])
    first_90 = np.array([_crossing(fine, between(row, fine_deg), -90.0) for row in phase])
    return AmplitudeBode(
        load_Nm=amplitude_map.load_Nm, frequency_hz=hz, fractions=tuple(on_it),
        amplitude_rad=amplitude_map.amplitude_rad[places], gain_db=gain[places], phase_deg=phase[places],
        linear_db=fine_db[::FINE], linear_deg=fine_deg[::FINE], all_amplitude_rad=amplitude_map.amplitude_rad,
        minus3db_hz=first_3, minus90deg_hz=first_90,
        minus3db_range_hz=np.array([crossing_range(hz, row, level) for row in gain]),
        below_from_start=gain[:, 0] < level, linear_minus3db_hz=finite(_crossing(fine, fine_db, level)),
        linear_minus90deg_hz=finite(_crossing(fine, fine_deg, -90.0)), level_db=level,
    )  # fmt: skip


def _crossing(hz: np.ndarray, values: np.ndarray, level: float) -> float:
    """Give the first frequency at which the values fall through a level; NaN where it is not known."""
    low, high = crossing_range(hz, values, level)
    k = int(np.searchsorted(hz, low))
    if low == 0.0 or not math.isfinite(high) or hz[k + 1] != high or not math.isfinite(values[k + 1]):
        return math.nan
    part = (values[k] - level) / (values[k] - values[k + 1])
    return float(hz[k] * (hz[k + 1] / hz[k]) ** part)


def crossing_range(hz: np.ndarray, values: np.ndarray, level: float) -> tuple[float, float]:
    """The frequencies between which the values first fall through a level; what is NaN tells nothing."""
    known = np.flatnonzero(~np.isnan(values))
    above = values[known] >= level
    first = int(np.argmin(above)) if known.size and not above.all() else known.size
    low = float(hz[known[first - 1]]) if first > 0 else 0.0
    return low, float(hz[known[first]]) if first < known.size else math.inf
