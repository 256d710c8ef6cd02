"""The map of amplitude and frequency: what limits, what the output looks like, gain and phase."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drawing.faces import draw
from actuator_lti.loops import Loops
from actuator_lti.loops.limiters import onset
from analyses.large_signal.classify import (
    CAUSES,
    WAVEFORMS,
    causes,
    limiter_fractions,
    not_linear,
    unexplained,
    waveforms,
)
from analyses.large_signal.grid import MOST_TICKS, amplitudes, frequency_range_hz, tones, work_ticks
from analyses.large_signal.steady_start import linear_steady_state
from analyses.large_signal.tones_run import run_tones
from analyses.linear.static_threshold import static_threshold

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

AMPLITUDES, FREQUENCIES = 17, 28
BELOW_ONSET = 0.95
LONG = 0.1  # periods of the highest tone


@dataclass(frozen=True)
class AmplitudeMap:
    """Sines of many amplitudes and frequencies, each settled; arrays of points are (amplitude, frequency).

    ``amplitude_rad``, shape (a,): peak command at the output shaft (linear axis: m).
    ``frequency_hz``, shape (f,).
    ``cause``, ``waveform``, shape (a, f): index into `CAUSES` and `WAVEFORMS`; criteria in
    `analyses.large_signal.classify`.
    ``limiter_fraction``, shape (a, f, limiters): fraction of the last window in which speed, acceleration,
    current and voltage limits act.
    ``stick_fraction``, ``distortion``, ``unsteadiness``, shape (a, f): of the output in the last window.
    ``response``, shape (a, f): fundamental of the output over the command.
    ``linear``, shape (f,): the same from the linear sampled loop, sliding.
    ``onset_rad``, shape (f,): A_k(w) of each limiter from the linear loop, no load; without protection that
    is slow against the tones, which acts later than they are simulated (`slow_protection`).
    ``ticks``: simulated in all.
    ``coarser``: whether the grid is coarser than asked for, as that would take more than `MOST_TICKS`.
    """

    load_Nm: float
    amplitude_rad: np.ndarray
    frequency_hz: np.ndarray
    cause: np.ndarray
    waveform: np.ndarray
    limiter_fraction: np.ndarray
    stick_fraction: np.ndarray
    distortion: np.ndarray
    unsteadiness: np.ndarray
    response: np.ndarray
    linear: np.ndarray
    onset_rad: Mapping[str, np.ndarray]
    ticks: int
    coarser: bool = False

    @property
    def gain_db(self) -> np.ndarray:
        """Gain of the fundamental in dB; -inf where nothing moves."""
        with np.errstate(divide="ignore"):
            return np.asarray(20.0 * np.log10(np.abs(self.response)))

    @property
    def phase_deg(self) -> np.ndarray:
        """Phase of the fundamental, unwrapped along frequency; NaN where nothing moves."""
        moving = np.abs(self.response) > 1e-4 * np.abs(self.linear)
        phases = np.full(self.response.shape, np.nan)
        for phase, row, ok in zip(phases, self.response, moving, strict=True):
            phase[ok] = np.degrees(np.unwrap(np.angle(row[ok])))
        return phases

    def plot_map(self, axes: Any = None, *, linear_axis: bool = False) -> Axes:
        """Draw what acts at each point, and the linear onset lines; gives matplotlib's axes."""
        return draw("plot_map", self.frequency_hz, self.amplitude_rad, self.cause, CAUSES,
            onset_rad=self.onset_rad, linear_axis=linear_axis, axes=axes,
        )  # fmt: skip

    def to_pandas(self) -> pandas.DataFrame:
        """A data frame with one row a point: command, what acts, waveform, fundamental (pandas needed)."""
        from actuator_lti.start.extras import need

        frame = need("pandas", "tables", "to_pandas")
        amplitude, frequency = np.meshgrid(self.amplitude_rad, self.frequency_hz, indexing="ij")
        return frame.DataFrame(
            {
                "amplitude_rad": amplitude.ravel(),
                "frequency_hz": frequency.ravel(),
                "cause": np.array(CAUSES)[self.cause].ravel(),
                "waveform": np.array(WAVEFORMS)[self.waveform].ravel(),
                "gain_db": self.gain_db.ravel(),
                "phase_deg": self.phase_deg.ravel(),
                "distortion": self.distortion.ravel(),
                "stick_fraction": self.stick_fraction.ravel(),
            }
        )

    def share(self, *names: str) -> float:
        """Fraction of the points with one of these causes."""
        return float(np.isin(self.cause, [CAUSES.index(name) for name in names]).mean())


def amplitude_map(
    design: Design,
    loops: Loops,
    *,
    load_Nm: float = 0.0,
    friction_on: bool = True,
    counts: tuple[int, int] = (AMPLITUDES, FREQUENCIES),
) -> AmplitudeMap:
    """Simulate sines over amplitude and frequency and say what each shows.

    ``loops`` are sampled and sliding, of this design; ``counts`` are fewer where they would take more than
    `MOST_TICKS`.
    """
    asked, counts = counts, _within(design, loops, counts)
    frequencies = tones(design, loops, counts[1])
    omega = np.array([t.omega_rad_s for t in frequencies])
    threshold = static_threshold(design, load_Nm).smallest_rad if friction_on else None
    levels = amplitudes(design, counts[0], threshold or None)
    start = linear_steady_state(loops, omega)
    border, slow = onset(loops, omega), slow_protection(design, loops)
    which = np.tile(np.arange(len(omega)), len(levels))
    amplitude = np.repeat(levels, len(omega))
    begin = np.minimum(amplitude, BELOW_ONSET * border.amplitude_rad[which])
    result = run_tones(
        design, frequencies, which, amplitude, start, begin,
        load_Nm=load_Nm, friction_on=friction_on, insist=True,
    )  # fmt: skip
    rubs = np.zeros(len(which), dtype=bool)
    off = np.flatnonzero(friction_on & unexplained(result, start.output[which], amplitude))
    if len(off):  # the same runs without dry friction: is it that?
        free = run_tones(
            design, frequencies, which[off], amplitude[off], start, begin[off],
            load_Nm=load_Nm, friction_on=False,
        )  # fmt: skip
        rubs[off] = ~not_linear(free, start.output[which[off]], amplitude[off])
    shape = (len(levels), len(omega))
    return AmplitudeMap(
        load_Nm=load_Nm,
        amplitude_rad=levels,
        frequency_hz=omega / (2.0 * np.pi),
        cause=causes(result, start.output[which], amplitude, rubs).reshape(shape),
        waveform=waveforms(result).reshape(shape),
        limiter_fraction=limiter_fractions(result).reshape((*shape, -1)),
        stick_fraction=result.window_stick_fraction.reshape(shape),
        distortion=result.distortion("output_angle_rad").reshape(shape),
        unsteadiness=result.unsteadiness("output_angle_rad").reshape(shape),
        response=(result.phasor("output_angle_rad") / amplitude).reshape(shape),
        linear=start.output,
        onset_rad={name: a for name, a in border.each_rad.items() if name not in slow},
        ticks=int(result.column("ticks").sum()),
        coarser=counts != asked,
    )


def _within(design: Design, loops: Loops, counts: tuple[int, int]) -> tuple[int, int]:
    """The grid asked for, or one of the same shape whose first run takes at most `MOST_TICKS`."""
    part = min(np.sqrt(MOST_TICKS / (counts[0] * work_ticks(design, loops, counts[1]))), 1.0)
    return max(int(part * counts[0]), 2), max(int(part * counts[1]), 2)


def slow_protection(design: Design, loops: Loops) -> list[str]:
    """Limiters that average for longer than a tone is simulated: they act much later."""
    limits = design.limits
    if limits.peak_time_s is None or limits.overload_time_s is None:
        return []
    _, high = frequency_range_hz(design, loops)
    return ["overload"] if limits.overload_time_s * high > LONG else []
