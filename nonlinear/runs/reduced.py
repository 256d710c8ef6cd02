"""What is left of many runs: one entry a run of everything that was reduced."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from actuator_lti.types import Compared, Complexes, Floats
from nonlinear._kernels import layout as at

COLUMNS = {name.lower(): place for name, place in vars(at).items() if name in at.COLUMN_NAMES}
"""The columns of a row by name: every parameter of ``_kernels.layout`` in small letters."""


def whole_periods(
    frequency_hz: float, period_s: float, *, least_ticks: int = 400, least_cycles: int = 1
) -> tuple[float, int, int]:
    """Frequency next to the one asked for, of which a whole number of periods fills whole ticks.

    It is off by at most half a tick over the window, 0.13 % with 400 ticks; behind it ticks and periods of
    that.

    >>> whole_periods(333.0, 1e-4)
    (333.3333333333333, 420, 14)
    """
    cycles = max(least_cycles, int(np.ceil(least_ticks * frequency_hz * period_s)))
    ticks = round(cycles / (frequency_hz * period_s))
    return cycles / (ticks * period_s), ticks, cycles


@dataclass(frozen=True, eq=False)
class StepFigures(Compared):
    """Step response of each run, relative to the target; NaN where a level was not reached."""

    rise_time_s: Floats
    overshoot_percent: Floats
    settling_time_s: Floats
    final_ratio: Floats


@dataclass(frozen=True, eq=False)
class BatchResult(Compared):
    """Reduced results; arrays have one entry a run, in the order of the runs.

    Signals are named as in ``layout.SIGNALS``: ``reference_rad``, ``output_angle_rad``,
    ``motor_speed_rad_s``, ``current_A``, ``voltage_V``, ``current_command_A``, ``speed_command_rad_s`` and
    ``probe_<point>_before``, ``probe_<point>_after``.  ``last = 0`` is the last window, 1 the one before.
    """

    rows: Floats  # shape (n, layout.SIZE): parameters
    outs: Floats  # shape (n, layout.OUT_SIZE): the kernel's numbers
    status: npt.NDArray[np.int64]  # shape (n,): 0: done; else ``layout.TOO_MANY_EVENTS``, ``NOT_FINITE``

    @property
    def ok(self) -> npt.NDArray[np.bool_]:
        """Which runs reached their end."""
        return self.status == at.OK

    def column(self, name: str) -> Floats:
        """A column of the parameters, by its name in `COLUMNS`."""
        return self.rows[:, COLUMNS[name]]

    def part(self, which: np.ndarray | slice) -> BatchResult:
        """Some of the runs."""
        return BatchResult(rows=self.rows[which], outs=self.outs[which], status=self.status[which])

    def with_part(self, which: np.ndarray, other: BatchResult) -> BatchResult:
        """The same with some runs taken from another result."""
        rows, outs, status = self.rows.copy(), self.outs.copy(), self.status.copy()
        rows[which], outs[which], status[which] = other.rows, other.outs, other.status
        return BatchResult(rows=rows, outs=outs, status=status)

    @property
    def events(self) -> npt.NDArray[np.int64]:
        """Landings, breakaways and reversals of each run."""
        return self._final(at.S_EVENTS).astype(np.int64)

    def _final(self, place: int) -> Floats:
        return self.outs[:, at.OUT_STATE + place]

    @property
    def stick_fraction(self) -> Floats:
        """Fraction of ticks that began at rest."""
        return self.outs[:, at.OUT_STICK_TICKS] / self.rows[:, at.TICKS]

    @property
    def final_output_rad(self) -> Floats:
        """Output angle after the last tick."""
        rigid = self._final(at.S_ANGLE) / self.rows[:, at.RATIO]
        return np.where(self.rows[:, at.ELASTIC_DRIVE] > 0.0, self._final(at.S_OUTPUT), rigid)

    def limit_fraction(self, name: str) -> Floats:
        """Fraction of the ticks in which a limiter acted: speed, acceleration, current, voltage."""
        return self.outs[:, at.OUT_LIMIT_TICKS + at.LIMITERS.index(name)] / self.rows[:, at.TICKS]

    def window_limit_fraction(self, name: str) -> Floats:
        """Fraction of the last window in which a limiter acted."""
        return self.outs[:, at.OUT_WINDOW_LIMITS + at.LIMITERS.index(name)] / self.rows[:, at.WINDOW]

    @property
    def window_stick_fraction(self) -> Floats:
        """Fraction of the ticks of the last window that began at rest."""
        return self.outs[:, at.OUT_WINDOW_STICK] / self.rows[:, at.WINDOW]

    def extreme(self, signal: str) -> tuple[Floats, Floats]:
        """Minimum and maximum over the run."""
        place = at.OUT_EXTREMES + 2 * at.SIGNALS.index(signal)
        return self.outs[:, place], self.outs[:, place + 1]

    def _window(self, signal: str, last: int) -> int:
        return at.OUT_WINDOWS + (last * at.ALL_SIGNALS + at.SIGNALS.index(signal)) * at.WINDOW_SIGNAL

    def mean(self, signal: str, last: int = 0) -> Floats:
        """Mean over a window."""
        return self.outs[:, self._window(signal, last)] / self.rows[:, at.WINDOW]

    def rms(self, signal: str, last: int = 0) -> Floats:
        """Root of the mean square over a window (mean included)."""
        return np.sqrt(self.outs[:, self._window(signal, last) + 1] / self.rows[:, at.WINDOW])

    def span(self, signal: str, last: int = 0) -> tuple[Floats, Floats]:
        """Minimum and maximum over a window."""
        place = self._window(signal, last)
        return self.outs[:, place + 2], self.outs[:, place + 3]

    def phasor(self, signal: str, harmonic: int = 1, last: int = 0) -> Complexes:
        """Complex peak amplitude X of a harmonic: ``x(t) = Im(X exp(j w t))`` from t = 0 of the run.

        A command ``sine(A, f)`` has X = A, so ``phasor(output)/A`` is the response from command to output.
        """
        place = self._window(signal, last) + at.WINDOW_BASE + 2 * (harmonic - 1)
        total = self.outs[:, place] - 1j * self.outs[:, place + 1]
        length = self.rows[:, at.WINDOW]
        start = self.rows[:, at.TICKS] - (last + 1) * length
        turned = np.mod(start * self.rows[:, at.CYCLES] * harmonic, length) / length
        return 2j * total / length * np.exp(-2j * np.pi * turned)

    def distortion(self, signal: str, last: int = 0) -> Floats:
        """Everything but mean and fundamental, relative to the fundamental (rms over rms)."""
        fundamental = np.abs(self.phasor(signal, 1, last)) ** 2 / 2.0
        rest = self.rms(signal, last) ** 2 - self.mean(signal, last) ** 2 - fundamental
        return np.sqrt(np.maximum(rest, 0.0) / np.maximum(fundamental, 1e-300))

    def unsteadiness(self, signal: str) -> Floats:
        """Change of the fundamental between the last two windows, relative to the last (H3: compare with
        the stated tolerance before a point is called steady)."""
        a, b = self.phasor(signal, 1, 0), self.phasor(signal, 1, 1)
        return np.abs(a - b) / np.maximum(np.abs(a), 1e-300)

    @cached_property
    def step(self) -> StepFigures:
        """Figures of step responses (needs ``step_target_rad``): 10 to 90 %, peak, settling."""
        s = self.outs[:, at.OUT_STEP : at.OUT_STEP + at.STEP_SIZE]
        Ts = self.rows[:, at.PERIOD]
        t10, t90, settled = (
            np.where(s[:, k] < 0.0, np.nan, s[:, k] * Ts) for k in (at.STEP_T10, at.STEP_T90, at.STEP_SETTLED)
        )
        return StepFigures(
            rise_time_s=t90 - t10,
            overshoot_percent=100.0 * np.maximum(s[:, at.STEP_PEAK] - 1.0, 0.0),
            settling_time_s=settled,
            final_ratio=s[:, at.STEP_LAST],
        )
