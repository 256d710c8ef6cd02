"""Margins confirmed in time: every gain and delay margin beside the border that the simulator shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, inf, isfinite, log, pi
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from analyses.validation.borders import CYCLES, SLOW, Border, Kind, Search, find_borders
from analyses.validation.coherent import LEAST_SAMPLES
from analyses.validation.sweep import EVER_TICKS, SETTLE_TIME_CONSTANTS, settling_ticks_of
from analyses.validation.tolerance import allowed
from nonlinear import Rows
from nonlinear.loop_setup import LoopSetup
from nonlinear.probe import fractional_delay

if TYPE_CHECKING:
    from actuator_lti.loops import ExactMargins, Loops, PeriodicLoop
    from actuator_lti.margins import StabilityMargins

Floats = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]
SETTLE_CYCLES = 20
LONG_TICKS, FEWEST = 10_000, 0.15  # a window longer than this holds fewer periods, down to this share
LEAST_DELAY = 1e-3  # samples
LONGEST_SETTLE_TICKS = 5_000  # at first; what then contradicts is looked at again
AGAIN = 16  # times the wait
LONGEST_AGAIN_TICKS = 100_000
LONGEST_DRIFT_TICKS = 60_000  # a window is as long as the wait
WAY, DRIFTING, DIED_DOWN = 12, 1e-9, 5.0  # gains looked at; a pole at 1; time constants
LONGEST_BLIND_TICKS = 20_000  # nobody knows what to wait for: several of the slowest time constants
GRID, DIPS = 1000, 6  # frequencies looked at, and how many of the nearest approaches to -1 are refined
SLOWEST = 1e-4  # of half the sampling frequency: where looking begins, at least
REST = 1e-9  # of half the sampling frequency: a border below is a drift, no oscillation
BESIDE = (0.99, 1.01)  # of a gain at its border: a pole is outside on one side
AT_NYQUIST = 1e-6  # relative: a real pole at -1
FAR = 300.0  # margins beyond this factor count as none


@dataclass(frozen=True)
class Confirmation:
    """One margin and where the simulator finds it.

    Attributes
    ----------
    loop : str
        A stage (outer loops open) or a break point (all other loops closed).
    point : str
    kind : {"gain up", "gain down", "delay", "computing delay"}
    predicted : float or None
        Factor of the loop gain, or delay in samples of the point (computing delay: in ticks); ``None`` where
        the linear loop has no such margin within the search range.
    predicted_hz : float or None
        Where the linear loop would oscillate; 0 where a real pole leaves the unit circle at 1 (it drifts).
    instrument : float or None
        Delay in samples at which the loop with the instrument's own interpolated delay reaches its border:
        what the instrument can find at best; ``None`` for gains.
    border : Border
    period_s : float
        Sampling period of the point.
    condition : str
        On which motion.
    """

    loop: str
    point: str
    kind: str
    predicted: float | None
    predicted_hz: float | None
    instrument: float | None
    border: Border
    period_s: float
    condition: str = ""

    @property
    def instrument_error(self) -> float:
        """Relative error of the interpolated delay at the border; 0 for gains."""
        if self.instrument is None or not self.predicted:
            return 0.0
        return abs(self.instrument / self.predicted - 1.0)

    @property
    def error(self) -> float:
        """Relative error of what was found: of the border, and of the instrument."""
        return self.border.error + self.instrument_error

    @property
    def difference(self) -> float | None:
        """Measured over predicted less one."""
        if self.predicted is None or self.border.value is None:
            return None
        return self.border.value / self.predicted - 1.0

    @property
    def passed(self) -> bool:
        """Whether both agree: within the tolerance, or in that there is no border."""
        if self.border.unknown:
            return True
        if self.predicted is None or self.border.value is None:
            return self.predicted is None and self.border.value is None
        return abs(self.border.value / self.predicted - 1.0) <= allowed(self.error, 1.0)


class ComputingDelay(Search):
    """A search over the computing delay itself, exact at any fraction of a tick."""

    def set_up(self, values: Floats) -> Rows:
        """The rig with the voltage acting so many ticks later."""
        return Rows.join([self._later(float(value)) for value in values])

    def _later(self, ticks: float) -> Rows:
        design = self.setup.design
        control = design.controller
        later = replace(control, computing_delay_s=control.computing_delay_s + ticks * control.period_s)
        return replace(self.setup, design=replace(design, controller=later)).row()


@dataclass(frozen=True)
class Question:
    """A margin to be confirmed: the prediction and the search for it."""

    search: Search
    kind: str
    predicted: float | None
    predicted_hz: float | None
    instrument: float | None = None
    settles_ticks: int = 0  # in which the nominal drive does, for a search for a border that nobody expects

    def answer(self, border: Border) -> Confirmation:
        """The confirmation from the border found; an unexpected one is none while slow modes still move."""
        if (
            self.predicted is None
            and border.value is not None
            and self.search.settle_ticks < self.settles_ticks
        ):
            border = replace(border, value=None, unknown=SLOW)
        setup = self.search.setup
        return Confirmation(
            loop=setup.loop,
            point=setup.point,
            kind=self.kind,
            predicted=self.predicted,
            predicted_hz=self.predicted_hz,
            instrument=self.instrument,
            border=border,
            period_s=setup.period_s if self.kind != "computing delay" else setup.design.controller.period_s,
            condition=setup.condition,
        )


def confirm_margins(
    questions: Sequence[Question], *, threads: int | None = None, progress: Progress | None = None
) -> tuple[Confirmation, ...]:
    """Put all questions to the simulator together; see `stage_questions`, `point_questions`."""
    borders = find_borders([q.search for q in questions], threads=threads, progress=progress)
    result = [question.answer(border) for question, border in zip(questions, borders, strict=True)]
    return tuple(_doubted(questions, result, threads))


def _doubted(
    questions: Sequence[Question], result: list[Confirmation], threads: int | None
) -> list[Confirmation]:
    """Look again, with a longer wait, for what contradicts: a slow motion may look like growth."""
    odd = [k for k, item in enumerate(result) if not item.passed or item.border.unknown == SLOW]
    if not odd:
        return result
    searches = []
    for k in odd:
        search = questions[k].search
        wait = min(AGAIN * search.settle_ticks, max(LONGEST_AGAIN_TICKS, search.settle_ticks))
        searches.append(replace(search, settle_ticks=wait))
    for k, search, border in zip(odd, searches, find_borders(searches, threads=threads), strict=True):
        result[k] = replace(questions[k], search=search).answer(border)
    return result


def stage_questions(
    setup: LoopSetup, loop: Any, margins: StabilityMargins, settle_ticks: int
) -> list[Question]:
    """Gain up, gain down and delay of one loop (inner loops closed, outer ones open)."""
    ups = [(m.ratio, m.frequency_rad_s) for m in margins.gain_margins if m.ratio > 1.0]
    downs = [(m.ratio, m.frequency_rad_s) for m in margins.gain_margins if m.ratio < 1.0]
    up, down = min(ups, default=None), max(downs, default=None)
    ever = settling_ticks_of(loop.plain_closed, setup.hold_ticks, setup.design.name, EVER_TICKS)
    own = time_invariant(loop.plain_open)
    result = [
        replace(asked, settles_ticks=max(ever, asked.settles_ticks))
        for asked in (
            _gain(setup, "gain up", up, settle_ticks, own),
            _gain(setup, "gain down", down, settle_ticks, own),
        )
    ]
    delay = margins.delay_margin
    if delay is not None and delay.samples is not None and isfinite(delay.samples):
        hertz = delay.frequency_rad_s / (2.0 * pi)
        best = instrument_delay(loop.plain_open, delay.samples, delay.frequency_rad_s * loop.period_s)
        search = _expecting(setup, "delay", hertz, settle_ticks, delay.samples)
        result.append(Question(search, "delay", delay.samples, hertz, best))
    return result


def point_questions(
    setups: Mapping[str, LoopSetup],
    loops: Loops,
    settle_ticks: int,
    margins: Mapping[str, ExactMargins] | None = None,
) -> list[Question]:
    """Gain up and down at each break point with all other loops closed, and the computing delay at ``u``.

    Predicted by the eigenvalues of the whole loop over a position period (`exact_margins`), so also where it
    is periodically time-varying; ``margins`` holds those already known.
    """
    from actuator_lti.loops import exact_margins, periodic_loop

    result = []
    for point, setup in setups.items():
        exact, loop = (margins or {}).get(point) or exact_margins(loops, point), periodic_loop(loops, point)
        if not exact.stable:
            continue
        radius = exact.spectral_radius
        own = 0 if not 0.0 < radius < 1.0 else ceil(-SETTLE_TIME_CONSTANTS * setup.base_ticks / log(radius))
        for kind, ratio in (("gain up", exact.gain_upper), ("gain down", exact.gain_lower)):
            there = isfinite(ratio) and ratio > 0.0
            border = (ratio, 2.0 * pi * oscillation_hz(loop, gain=ratio)) if there else None
            asked = _gain(setup, kind, border, settle_ticks, loop)  # type: ignore[arg-type]
            result.append(replace(asked, settles_ticks=max(own, asked.settles_ticks)))
        if exact.delay_s is not None and isfinite(exact.delay_s):
            ticks = exact.delay_s / setup.design.controller.period_s
            hertz = oscillation_hz(loop, delay_s=exact.delay_s)
            search = _expecting(setup, "delay", hertz, settle_ticks, ticks, ComputingDelay)
            result.append(Question(search, "computing delay", ticks, hertz))
    return result


def time_invariant(system: Any) -> PeriodicLoop:
    """A loop of one update a period."""
    from actuator_lti.loops import PeriodicLoop

    return PeriodicLoop([(system.A, system.B, system.C)], system.dt)


def oscillation_hz(loop: PeriodicLoop, gain: float = 1.0, delay_s: float = 0.0) -> float:
    """About where a loop oscillates at its border: the angle of the pole that leaves the unit circle there.

    0, and half the sampling frequency, where a real pole leaves it at 1 or -1.  A pole over M updates is that
    of M frequencies: the one at which ``gain L`` comes nearest to -1 is meant.  With a delay, or where no
    pole leaves, that of all frequencies.
    """
    pole = None if delay_s else _leaving(loop, gain)
    if pole is None:
        return _nearest_hz(loop, gain, delay_s)
    count, angle = len(loop.systems), float(abs(np.angle(pole)))
    turns = 2.0 * pi * np.arange(count)
    angles = np.concatenate([turns + angle, turns[1:] - angle]) / count  # of an update
    angles = angles[angles <= pi * (1.0 + AT_NYQUIST)]
    if angles.size > 1:
        angles = angles[np.argsort(_distance(loop, angles, gain))]
    return float(angles[0]) / (2.0 * pi * loop.dt)


def _leaving(loop: PeriodicLoop, gain: float) -> complex | None:
    """The pole of the closed loop over a period that crosses the unit circle at a gain."""
    beside = [loop.modes(gain * factor) for factor in BESIDE]
    sizes = [float(np.abs(poles).max(initial=0.0)) for poles in beside]
    if not min(sizes) <= 1.0 + DRIFTING < max(sizes):
        return None
    out = beside[int(np.argmax(sizes))]
    leaves, there = out[int(np.argmax(np.abs(out)))], loop.modes(gain)
    return complex(there[int(np.argmin(np.abs(there - leaves)))])


def _distance(loop: PeriodicLoop, angles: Floats, factor: Any) -> Floats:
    """``|1 + k L|`` at angles an update: that of ``(1 - T) + k T`` over S, inf where L is."""
    T = loop.closed(np.exp(1j * angles))
    far = np.full(T.shape, inf)
    return np.divide(np.abs(1.0 - T + factor * T), np.abs(1.0 - T), out=far, where=T != 1.0)


def _nearest_hz(loop: PeriodicLoop, gain: float, delay_s: float) -> float:
    """Where ``gain L exp(-jwd)`` comes nearest to -1."""
    from scipy.optimize import minimize_scalar

    def distance(log_hz: npt.ArrayLike) -> Floats:
        omega = 2.0 * pi * np.exp(np.atleast_1d(log_hz))
        return _distance(loop, omega * loop.dt, gain * np.exp(-1j * omega * delay_s))

    poles = loop.modes()
    moving = np.abs(np.log(np.where(poles == 0.0, 1e-300, poles))) / len(loop.systems)
    slowest = min(SLOWEST, 0.1 * float(moving[moving > DRIFTING].min(initial=pi)) / pi)
    grid = np.log(np.geomspace(slowest, 0.999, GRID) * 0.5 / loop.dt)
    values = distance(grid)
    dips = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:])) + 1
    dips = dips[np.argsort(values[dips])][:DIPS] if dips.size else np.array([int(np.argmin(values))])
    result = []
    for k in map(int, dips):  # a narrow one is deeper than the grid shows
        ends = (float(grid[max(k - 1, 0)]), float(grid[min(k + 1, grid.size - 1)]))
        found = minimize_scalar(lambda x: float(distance(x)[0]), bounds=ends, method="bounded")
        result.append((float(found.fun), float(found.x)))
    nearest, best = min(result)
    nyquist = 0.5 / loop.dt
    at_minus_one = float(distance(np.log(nyquist))[0])
    if values[0] <= min(nearest, at_minus_one):
        return 0.0
    return nyquist if at_minus_one <= nearest else float(np.exp(best))


def _gain(
    setup: LoopSetup, kind: Kind, predicted: tuple[float, float] | None, settle_ticks: int, loop: PeriodicLoop
) -> Question:
    """A gain margin; where none is predicted within the search range the search looks all the same."""
    if predicted is None or max(predicted[0], 1.0 / predicted[0]) > FAR:
        return Question(_blind(setup, kind, settle_ticks), kind, None, None, settles_ticks=settle_ticks)
    ratio, omega = predicted
    hertz, tick_s = omega / (2.0 * pi), setup.design.controller.period_s
    halves = {0.5 / setup.period_s, 0.5 / (setup.base_ticks * tick_s), 0.5 / tick_s}
    alternating = [half for half in halves if abs(hertz / half - 1.0) < AT_NYQUIST]
    if hertz <= REST * min(halves):
        alternating = [0.0]
        settle_ticks = max(settle_ticks, _on_the_way(loop, ratio, setup.hold_ticks))
    if alternating:
        return Question(_real_pole(setup, kind, settle_ticks, alternating[0]), kind, ratio, alternating[0])
    hertz = min(hertz, 0.97 * 0.5 / setup.period_s)
    return Question(_expecting(setup, kind, hertz, settle_ticks, ratio), kind, ratio, hertz)


def _on_the_way(loop: PeriodicLoop, ratio: float, hold_ticks: int) -> int:
    """Ticks in which every other mode dies down between the nominal gain and a border where the drive drifts.

    On its way there a loop may swing more slowly than it ever does at its nominal gain, and a window shorter
    than the swing takes a part of it for growth.
    """
    slowest = 0.0
    for gain in np.geomspace(1.0, ratio, WAY)[1:-1]:
        sizes = np.abs(loop.modes(gain))
        slowest = max(slowest, float(sizes[sizes < 1.0 - DRIFTING].max(initial=0.0)))
    periods = DIED_DOWN / -log(slowest) if slowest > 0.0 else 0.0
    return min(ceil(periods * len(loop.systems)) * hold_ticks, LONGEST_DRIFT_TICKS)


def _blind(setup: LoopSetup, kind: Kind, settle_ticks: int) -> Search:
    """Look for a border nobody expects: upwards near Nyquist, downwards over several time constants."""
    wait = min(settle_ticks, LONGEST_BLIND_TICKS)
    if kind == "gain up":
        hertz = min(0.0625 / setup.period_s, CYCLES / (0.5 * wait * setup.design.controller.period_s))
        return Search(setup, kind, hertz, wait, search_range=100.0, smooth=False)
    hertz = 3.0 / (max(wait, 100) * setup.design.controller.period_s)
    return Search(setup, kind, hertz, 2 * wait, search_range=10.0, cycles=6, smooth=False)


def _real_pole(setup: LoopSetup, kind: Kind, settle_ticks: int, at_hz: float) -> Search:
    """Look for the gain at which a real pole reaches 1 (0 Hz, windows as long as the wait) or -1."""
    window = LEAST_SAMPLES * setup.base_ticks
    wait = max(min(settle_ticks, LONGEST_BLIND_TICKS if at_hz else LONGEST_DRIFT_TICKS), window)
    hertz = 1.0 / ((window if at_hz else wait) * setup.design.controller.period_s)
    return Search(setup, kind, hertz, wait, cycles=1, alternating_hz=at_hz)


def _expecting(
    setup: LoopSetup, kind: Kind, hertz: float, settle_ticks: int, expected: float, how: type[Search] = Search
) -> Search:
    """Look for an oscillation, about where it is expected first.

    Before the windows it waits for whatever is not the oscillation: for some of its periods, and for the
    nominal loop's slowest mode. Of an oscillation that is slow against the tick fewer periods are looked at.
    """
    period = 1.0 / (hertz * setup.design.controller.period_s)
    fewer = min(max(LONG_TICKS / (CYCLES * period), FEWEST), 1.0)
    wait = max(ceil(fewer * SETTLE_CYCLES * period), min(settle_ticks, LONGEST_SETTLE_TICKS))
    cycles = ceil(fewer * CYCLES)
    return how(setup, kind, hertz, wait, cycles=cycles, foreseen=max(expected, LEAST_DELAY))


def instrument_delay(open_loop: Any, samples: float, turn: float) -> float | None:
    """Delay in samples at which the loop with the interpolated delay of `Probe` reaches its border.

    Parameters
    ----------
    open_loop : python-control system
        Sampled.
    samples, turn : float
        Where the loop with an exact delay does: the delay, and the frequency in rad a sample.
    """
    from scipy.optimize import root

    def excess(x: Floats) -> list[float]:
        z = np.exp(1j * x[0])
        whole, taps = fractional_delay(max(float(x[1]), 0.0))
        delayed = z**-whole * np.sum(taps * z ** -np.arange(taps.size))
        value = complex(open_loop(z)) * delayed + 1.0
        return [value.real, value.imag]

    solved = root(excess, [turn, samples], tol=1e-13)
    return float(solved.x[1]) if abs(complex(*excess(solved.x))) < 1e-6 else None
