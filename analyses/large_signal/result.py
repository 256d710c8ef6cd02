"""Everything that is said of large signals, in one result; how far dry friction moves the linear limit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Command, Design
from actuator_lti.drive.operating import rubs
from actuator_lti.drive.profile import command_mean
from actuator_lti.loops import Loops, assemble_loops
from actuator_lti.loops.assemble import loops_at
from actuator_lti.loops.limiters import onset
from analyses.large_signal.classify import limiter_fractions
from analyses.large_signal.map import COUNTS, AmplitudeBode, AmplitudeMap, amplitude_bode, amplitude_map
from analyses.large_signal.sawtooth import Sawtooth, sawtooth
from analyses.large_signal.tones import MOST_TICKS, linear_steady_state, tone_rows, tones, work_ticks
from analyses.linear.responses import response_at
from nonlinear import LIMITERS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COUNT, LEAST, ROUNDS = 12, 3, 9
TRIED = (0.3, 3.0)  # times the linear limit
SETTLED = 1e-4  # of what begins at rest is left by the window: a limit is closed in to 0.5 %


@dataclass(frozen=True)
class LimitShift:
    """Amplitude at which a limit first acts, linear and simulated with friction, at each frequency."""

    frequency_hz: np.ndarray  # shape (f,)
    # Shape (f,): smallest A_k(w); what is simulated; NaN where none acts within the range tried
    linear_rad: np.ndarray
    simulated_rad: np.ndarray
    linear_limiter: tuple[str, ...]  # empty where there is none
    simulated_limiter: tuple[str, ...]
    resolution: float  # relative width of the last interval of the bisection
    command_gain: np.ndarray | float = 1.0  # shape (f,): of mean and filter of the command in front
    coarser: bool = False  # fewer frequencies than asked for, as those would take more than `MOST_TICKS`

    @property
    def ratio(self) -> np.ndarray:
        return np.asarray(self.simulated_rad / self.linear_rad)


def limit_shift(design: Design, loops: Loops, count: int = COUNT) -> LimitShift | None:
    """Bisect the amplitude at which a limit first acts in steady state, at each of several frequencies.

    Begun in the linear steady state just below the limit, the command as behind its profile and filter.
    ``None`` where the loop is unstable, or nothing limits. Fewer than ``count``, down to `LEAST`, where those
    take more than `MOST_TICKS`.
    """
    given, design = loops, replace(design, command=Command())
    if loops.design.command != design.command:
        loops = loops_at(replace(loops.design, command=design.command), loops.operating)
    work = (ROUNDS + 2) * work_ticks(design, loops, count)
    within = min(count, max(int(count * MOST_TICKS / work), LEAST))
    chosen = tones(design, loops, within)
    omega = np.array([t.omega_rad_s for t in chosen])
    linear_limit, start = onset(loops, omega), linear_steady_state(loops, omega, SETTLED)
    there = np.isfinite(linear_limit.amplitude_rad)
    limited, linear = np.flatnonzero(there), linear_limit.amplitude_rad[there]
    if not (start.stable and limited.size):
        return None

    def acting(amplitude: np.ndarray) -> np.ndarray:
        begin = np.minimum(amplitude, 0.99 * linear)
        return limiter_fractions(
            tone_rows(design, chosen, limited, amplitude, start, begin, harmonics=1).run()
        )

    simulated, names = np.full(len(omega), np.nan), np.full(len(omega), "", dtype=object)
    simulated[limited], names[limited] = _bisect(acting, linear, [linear_limit.active[k] for k in limited])
    resolution, gain = (TRIED[1] / TRIED[0]) ** (0.5**ROUNDS) - 1.0, _command_gain(given, loops, omega)
    found = np.where(there, linear_limit.amplitude_rad, np.nan), simulated, linear_limit.active, tuple(names)
    return LimitShift(omega / (2.0 * np.pi), *found, resolution, gain, within < count)


def _command_gain(given: Loops, behind: Loops, omega_rad_s: np.ndarray) -> np.ndarray | float:
    """What mean and filter of the command make of a sine, from how far in front of each a limit lies."""
    if given.design.command == behind.design.command:
        return 1.0
    mean = command_mean(given.design)
    gain = 1.0 if mean is None else np.abs(mean.response(omega_rad_s))
    whole, rest = (np.abs(response_at(one.plain_response, omega_rad_s)) for one in (given, behind))
    return np.asarray(gain * whole / rest)


def _bisect(
    acting: Callable[[np.ndarray], np.ndarray], linear: np.ndarray, wanted: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Close in on the limit from both sides; the limiter is the predicted one, wherever that acts."""
    low, high = np.log(TRIED[0] * linear), np.log(TRIED[1] * linear)
    at_low, last = acting(np.exp(low)), acting(np.exp(high))
    valid = (at_low.max(axis=1) == 0.0) & (last.max(axis=1) > 0.0)
    for _ in range(ROUNDS):
        middle = 0.5 * (low + high)
        seen = acting(np.exp(middle))
        hit = seen.max(axis=1) > 0.0
        low, high = np.where(hit, low, middle), np.where(hit, middle, high)
        last = np.where(hit[:, None], seen, last)
    names = [
        "" if not ok else one if one and row[LIMITERS.index(one)] > 0.0 else LIMITERS[int(np.argmax(row))]
        for row, ok, one in zip(last, valid, wanted, strict=True)
    ]
    return np.where(valid, np.exp(0.5 * (low + high)), np.nan), np.array(names, dtype=object)


@dataclass(frozen=True)
class LargeSignals:
    """Map, shift of the linear limit, amplitude Bode and sawtooth of a design."""

    design: Design
    map: AmplitudeMap  # with friction, no load
    shift: LimitShift | None  # of the linear limit by dry friction; ``None`` without it, or unstable
    bode: AmplitudeBode
    sawtooth: Sawtooth

    def __str__(self) -> str:
        rows, columns = len(self.map.amplitude_rad), len(self.map.frequency_hz)
        return f"{self.design.name}: large signals, {rows} amplitudes x {columns} frequencies of the map"

    def plot_map(self, axes: Any = None) -> Axes:
        """Draw what acts at each amplitude and frequency; gives matplotlib's axes."""
        return self.map.plot_map(axes, linear_axis=self.design.axis == "linear")


def large_signals(
    design: AnyDesign, loops: Loops | None = None, *, counts: tuple[int, int] = COUNTS
) -> LargeSignals:
    """Look at large signals from every side (model.md section 5).

    ``loops``: sampled and sliding, of this design, if they are there already.
    ``counts``: amplitudes and frequencies of the map, at least 2 of each.

    Raises `InputError`, `NumericalError`: as `assemble_loops` and `simulate`.
    """
    design = as_design(design)
    loops = assemble_loops(design) if loops is None else loops
    map_ = amplitude_map(design, loops, counts=counts)
    shift = limit_shift(design, loops) if rubs(design) else None
    return LargeSignals(design, map_, shift, amplitude_bode(design, loops, map_), sawtooth(design))
