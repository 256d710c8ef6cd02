"""Where oscillations no longer die out: the border of stability found in time, many searches side by side.

A search varies one thing of a rig (loop gain up or down, or a delay added at the point), watches how an
oscillation grows from one window of whole periods to the next, and closes in on the value at which it
neither grows nor decays.  Each round runs a dozen values of every search in one batch and keeps the first
interval in which the verdict changes; at the end the growth rate, which is smooth there, is interpolated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import ceil, exp, inf, isfinite, log
from typing import Literal

import numpy as np
import numpy.typing as npt

from analyses.validation.budget import OutOfTime
from analyses.validation.coherent import Coherent, coherent
from nonlinear import LIMITERS, Rows
from nonlinear.loop_setup import LoopSetup
from nonlinear.reduced import BatchResult

Floats = npt.NDArray[np.float64]
Kind = Literal["gain up", "gain down", "delay"]
Progress = Callable[[int, int], None]

CUT = "the search was cut for lack of time"
GROUP_TICKS = 2_000_000  # in one batch: time is looked at in between
MOST_TICKS = 80_000_000  # of a search in one round: some seconds
VALUES = 12  # of each search in one round
ROUNDS = 6
CLOSE = 3e-3  # relative width at which the bracket is interpolated
CYCLES = 20  # periods in a window
FAINT = 1e-3  # kick, relative to the room of the signal
FAINTEST = 3e-5  # where a reversal, or a coupling that comes free, may end a motion that would die out
FAINT_IN_GRAVITY = 1e-9  # which is proportional to the angle only where that is small: growth takes its time
GROWN = 1e5  # times the kick: no motion that dies out reaches that
NOTHING = 1e-6  # of the kick: what is left counts as nothing
NOTHING_MOVING = (
    1e-4  # the same on a bias motion, where rounding of the growing angle is seen in a speed estimate
)
NEAR = 0.01  # relative width of the bracket from which on the frequency seen is that at the border
OFF_FREQUENCY = 1e-2  # relative: so far off, the windows are fitted anew
ATTEMPTS = 3  # at a border, each with more time to settle
LONGER = 4
FADED = 0.3  # of its size: what is left of an oscillation that keeps up, after twice the wait, is more
UNSTEADY = "the position controller remembers, and the drive cannot stand: no run begins in its steady state"
SLOW = "a slow motion that dies out hides the border: not told apart within the time given"
SUDDEN = "no steady growth: a limit, a reversal or the play is met before"
DECEIVED = 3.0  # widths of the bracket that a border may move when it is measured again
GAIN_RANGE = 1e3
NEXT_TO = (0.97, 0.9986, 1.0014, 1.03)  # of an expected border: those inside lie `CLOSE` apart
PART_WAY = np.array([0.02, 0.2, 0.4, 0.6, 0.8])  # of an expected delay
FURTHER = (1.2, 2.0, 6.0)  # times the expected border
APART, FEWEST = 1.5, 3  # ratio of two gains on the way to it, and how many at least
LONGEST_DELAY_SAMPLES = 2000.0
SHORTEST_DELAY_SAMPLES = 0.02


@dataclass(frozen=True)
class Search:
    """One border to be found.

    Attributes
    ----------
    setup : LoopSetup
        The loop, on its bias motion. For the border of the linear loop limits are off: at many times the
        gain a signal that dies out may still reach a limit on its way (where they are on, that counts as
        growth).
    kind : {"gain up", "gain down", "delay"}
        What is varied at the rig's point: the loop gain as a factor from 1 up or down, or a delay in samples
        of the point from 0 up.
    frequency_hz : float
        Where the oscillation is expected: sets the length of the windows, not the answer.
    settle_ticks : int
        Before the two windows.
    search_range : float
        Largest factor of gain (up or down).
    cycles : int
        Periods in a window.
    close : float
        Relative width of the bracket at which the search ends.
    smooth : bool
        Whether the growth rate is smooth at the border, so that it is interpolated; then it is that of the
        expected frequency.
    alternating_hz : float or None
        Where a real pole leaves the unit circle: 0 (at 1: the drive drifts away) or half a sampling
        frequency (at -1: it alternates); ``None`` for an oscillation.  The span of such a motion changes from
        window to window by its growth, exactly; then ``frequency_hz`` is one over the length of a window.
    foreseen : float or None
        Where the border is foreseen: values next to it are tried in the first round, beside those from the
        nominal drive on that find any other border.
    """

    setup: LoopSetup
    kind: Kind
    frequency_hz: float
    settle_ticks: int
    search_range: float = GAIN_RANGE
    cycles: int = CYCLES
    close: float = CLOSE
    smooth: bool = True
    alternating_hz: float | None = None
    foreseen: float | None = None

    @property
    def real_pole(self) -> bool:
        """Whether no oscillation, but a real pole makes the border."""
        return self.alternating_hz is not None

    def rows(self, values: Floats) -> Rows:
        """One run a value."""
        window = self._window()
        rows = self.started(values)
        rows["ticks"] = self.settle_ticks + 2 * window.ticks[0]
        rows.window(window.ticks[0], window.cycles[0])
        return rows

    def _window(self) -> Coherent:
        """One window of whole periods."""
        tick_s = self.setup.design.controller.period_s
        return coherent(self.frequency_hz, tick_s, self.setup.base_ticks, self.cycles)

    @property
    def ticks(self) -> int:
        """Length of one run."""
        return self.settle_ticks + 2 * int(self._window().ticks[0])

    def started(self, values: Floats) -> Rows:
        """The rig at each value, with a faint kick at the point at first."""
        rows = self.set_up(values)
        shape = self._burst() if self.smooth and not self.real_pole else IMPULSE
        rows.series(self.setup.point, shape, self.kick)
        return rows

    def set_up(self, values: Floats) -> Rows:
        """The rig at each value."""
        return self.setup.rows(delay_samples=values) if self.kind == "delay" else self.setup.rows(values)

    def _burst(self) -> Floats:
        """Some periods of the expected oscillation, swelling and dying away: other modes are hardly moved."""
        turn = 2.0 * np.pi * self.frequency_hz * self.setup.design.controller.period_s
        periods = max(BURST * self.cycles, LEAST_BURST)
        t = np.arange(int(np.ceil(2.0 * np.pi * periods / turn)) + 1)
        shape = np.sin(np.pi * t / max(t.size - 1, 1)) ** 2
        return np.append(shape * np.sin(turn * t + AHEAD), 0.0)

    @property
    def controlled(self) -> bool:
        """Whether the nominal drive is known to come to rest, which is looked at first."""
        return True

    @cached_property
    def kick(self) -> float:
        """Size of the impulse, in the unit of the point."""
        signal = {"u": "voltage_V", "i_ref": "current_command_A", "w_ref": "speed_command_rad_s"}
        room = replace(self.setup, limits_on=True).room[signal[self.setup.point]]
        if room == inf:
            room = max(abs(self.setup.bias.speed_rad_s), 1.0)
        if self.setup.design.load.gravity is not None:
            return FAINT_IN_GRAVITY * room
        return (FAINTEST if self.setup.bias.delicate else FAINT) * room

    def growth(self, result: BatchResult) -> Floats:
        """Growth of the oscillation from window to window as a logarithm; +-inf where it is plain."""
        last, earlier = (self.size(result, k) for k in (0, 1))
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.log(last / earlier)
        nothing = NOTHING_MOVING if self.setup.bias.speed_rad_s else NOTHING
        gone = (last <= nothing * self.kick) | ~np.isfinite(rate)
        limited = np.any([result.limit_fraction(name) > 0.0 for name in LIMITERS], axis=0)
        burst = ~result.ok | limited | ((result.events > 0) & self.setup.bias.delicate)
        if self.setup.bias.friction_on:  # so far only friction has one slope; a smooth law has no event
            low, high = result.span("motor_speed_rad_s")
            burst |= high - low > self.setup.bias.room_rad_s
        if self.setup.design.load.gravity is not None:  # a motion that has grown large is bounded by it
            burst |= last > GROWN * self.kick
        return np.where(burst, inf, np.where(gone, -inf, rate))

    def size(self, result: BatchResult, last: int) -> Floats:
        """Size in a window: of the fundamental, or from crest to crest where no frequency is expected."""
        if self.smooth and not self.real_pole:
            return np.abs(result.phasor(self.setup.before, 1, last))
        low, high = result.span(self.setup.before, last)
        return high - low

    def grid(self) -> Floats:
        """First values to try, outwards from the nominal drive."""
        if self.foreseen is not None:
            return self._about(self.foreseen)
        if self.kind == "delay":
            return np.geomspace(SHORTEST_DELAY_SAMPLES, LONGEST_DELAY_SAMPLES, 2 * VALUES)
        steps = np.geomspace(1.0 + 1e-3, self.search_range, 2 * VALUES if self.smooth else VALUES)
        return steps if self.kind == "gain up" else 1.0 / steps

    def _about(self, expected: float) -> Floats:
        """Values up to an expected border, next to it on both sides, and beyond."""
        if self.kind == "delay":
            before, last = expected * PART_WAY, LONGEST_DELAY_SAMPLES
            beyond = expected * np.array(FURTHER)
        else:
            way = abs(log(expected))
            count = max(ceil(way / log(APART)), FEWEST)
            before = np.exp(np.sign(log(expected)) * way * (np.arange(count) + 0.5) / count)
            last = self.search_range if self.kind == "gain up" else 1.0 / self.search_range
            beyond = expected ** np.sign(log(expected)) * np.array(FURTHER)
            beyond = beyond if self.kind == "gain up" else 1.0 / beyond
        near = expected * (np.array(NEXT_TO) if self.kind != "gain down" else np.array(NEXT_TO)[::-1])
        return np.concatenate([before, near, beyond[np.abs(np.log(beyond)) < abs(log(last))], [last]])

    def frequency(self, result: BatchResult) -> Floats:
        """Frequency of the oscillation, Hz, from the turn of the fundamental between the windows."""
        if self.alternating_hz is not None:
            return np.full(len(result.events), self.alternating_hz)
        last, earlier = (result.phasor(self.setup.before, 1, k) for k in (0, 1))
        turn = np.angle(last * earlier.conj())
        seconds = result.column("window") * result.column("period")
        return (result.column("cycles") + turn / (2.0 * np.pi)) / seconds


BURST, LEAST_BURST = 0.4, 3.0  # length of the kick over that of a window, and periods at least
AHEAD = 0.7  # rad, its phase: at half the sampling frequency a sine itself is nothing
IMPULSE = np.array([1.0, 0.0])


@dataclass(frozen=True)
class Border:
    """Where an oscillation neither grows nor decays.

    Attributes
    ----------
    value : float or None
        Factor of the gain, or delay in samples of the point; ``None``: none in the search range.
    bracket : tuple of float
        Decays at the first, grows at the second (the ends of the search where none was found).
    frequency_hz : float or None
        Of the oscillation at the border.
    runs : int
    unknown : str
        Why nothing is known (no time left, say): no border is then no finding.
    error : float
        Relative error of the value: how far a straight line and a polynomial through the growth rates next to
        the border lie apart, what a wait of twice the time changes, and what windows that do not hold whole
        periods leave.
    """

    value: float | None
    bracket: tuple[float, float]
    frequency_hz: float | None
    runs: int
    unknown: str = ""
    error: float = 0.0


@dataclass
class _Hunt:
    """A search under way."""

    search: Search
    values: Floats
    low: float = 0.0
    high: float = 0.0
    growths: tuple[float, float] = (-inf, inf)
    beside: tuple[tuple[float, float], ...] = ()
    frequency_hz: float | None = None
    runs: int = 0
    bracketed: bool | None = None
    spoiled: str = ""
    shift: float | None = None
    size: float = 0.0
    faded: bool = False

    def take(self, result: BatchResult) -> None:
        """Keep the first interval in which decay turns into growth."""
        growth, hertz = self.search.growth(result), self.search.frequency(result)
        self.runs += growth.size
        above = np.flatnonzero(growth >= 0.0)
        if self.bracketed is None:
            self.bracketed = bool(above.size)
            self.low, self.high = self.nominal(), float(self.values[-1])
            if not self.bracketed:
                return
        k = int(above[0]) if above.size else growth.size
        if k > 0:
            self.low, self.growths = float(self.values[k - 1]), (float(growth[k - 1]), self.growths[1])
            self.frequency_hz = float(hertz[k - 1])
            self.size = float(self.search.size(result, 0)[k - 1])
        if k < growth.size:
            self.high, self.growths = float(self.values[k]), (self.growths[0], float(growth[k]))
        near = [j for j in (k - 2, k + 1) if 0 <= j < growth.size and np.isfinite(growth[j])]
        self.beside = tuple((log(float(self.values[j])), float(growth[j])) for j in near)
        self.values = np.geomspace(self.low, self.high, VALUES + 2)[1:-1]
        if self.frequency_hz is not None and abs(log(self.high / self.low)) < NEAR:
            off = abs(self.frequency_hz / self.search.frequency_hz - 1.0)
            fitted = self.search.smooth and not self.search.real_pole
            if fitted and OFF_FREQUENCY < off < 0.5 / self.search.cycles:
                self.search = replace(self.search, frequency_hz=self.frequency_hz)

    def nominal(self) -> float:
        return SHORTEST_DELAY_SAMPLES / 10.0 if self.search.kind == "delay" else 1.0

    @property
    def done(self) -> bool:
        if self.bracketed is None:
            return False
        narrow = abs(log(self.high / self.low)) < self.search.close
        return not self.bracketed or (narrow and (not self.search.smooth or all(np.isfinite(self.growths))))

    def border(self, *, stopped: bool = False) -> Border:
        """Interpolate the growth between the ends."""
        bracket = (self.low, self.high)
        if self.spoiled or (stopped and not self.done):
            return Border(None, bracket, None, self.runs, self.spoiled or CUT)
        if not self.bracketed:
            return Border(None, bracket, None, self.runs)
        width = abs(log(self.high / self.low))
        if self.deceived:
            return Border(None, bracket, None, self.runs, SLOW)
        if not self.done:
            return Border(None, bracket, None, self.runs, SUDDEN)
        if not self.search.smooth:
            return Border(
                exp(0.5 * log(self.low * self.high)), bracket, self.frequency_hz, self.runs, "", width
            )
        value, error = self.interpolated()
        error += 0.125 * width if self.shift is None else abs(self.shift)
        return Border(exp(value), bracket, self.frequency_hz, self.runs, "", error)

    @property
    def smooth(self) -> bool:
        """Whether a border has been found between two growth rates."""
        return bool(self.bracketed and self.done and self.search.smooth and np.isfinite(self.growths).all())

    @property
    def looked_at_again(self) -> Floats:
        """Values run with a longer wait: the border, or (nothing moves at a real pole's) both ends."""
        if self.search.real_pole:
            return np.array([self.low, self.high])
        return np.array([exp(self.interpolated()[0])])

    def again(self, result: BatchResult) -> None:
        """Take the growth rate at the border after a longer wait: how far it says that the border lies."""
        growths, (a, b) = self.search.growth(result), self.growths
        if self.search.real_pole:
            low, high = (float(g) for g in growths)
            if isfinite(low) and isfinite(high) and high > low and b > a:
                self.shift = (a / (b - a) - low / (high - low)) * log(self.high / self.low)
                self.runs += 2
            return
        growth = float(growths[0])
        if isfinite(growth) and b > a:
            self.shift = growth / (b - a) * abs(log(self.high / self.low))
            self.runs += 1
        self.faded = float(self.search.size(result, 0)[0]) < FADED * self.size

    @property
    def deceived(self) -> bool:
        """Whether what looked like growth was something else that had not died out yet."""
        return self.faded or (
            self.shift is not None and abs(self.shift) > DECEIVED * abs(log(self.high / self.low))
        )

    def longer(self) -> _Hunt:
        """The same hunt with more time to settle."""
        search = replace(self.search, settle_ticks=LONGER * self.search.settle_ticks)
        return _Hunt(search, search.grid(), runs=self.runs)

    def interpolated(self) -> tuple[float, float]:
        """Logarithm of the value at which the growth rate is zero, and its error."""
        ends, (a, b) = (log(self.low), log(self.high)), self.growths
        width = abs(ends[1] - ends[0])
        if not (np.isfinite(a) and np.isfinite(b) and b > a):
            return 0.5 * (ends[0] + ends[1]), width
        line = ends[0] - a / (b - a) * (ends[1] - ends[0])
        points = sorted([(ends[0], a), (ends[1], b), *self.beside], key=lambda item: item[1])
        seen = self.search.frequency_hz if self.search.real_pole else self.frequency_hz or 0.0
        off = abs(seen / self.search.frequency_hz - 1.0)
        leak = off * width / (b - a)  # of a period that a window does not hold, over the slope of the growth
        if len(points) < 3 or any(y[1] <= x[1] for x, y in pairwise(points)):
            return line, 0.125 * width + leak
        curve = min(max(_through(points), min(ends)), max(ends))
        return curve, abs(curve - line) + leak


def _through(points: Sequence[tuple[float, float]]) -> float:
    """Where the polynomial of x over growth through (x, growth) passes zero growth (Lagrange)."""
    total = 0.0
    for j, (x, g) in enumerate(points):
        others = [h for k, (_, h) in enumerate(points) if k != j]
        total += x * float(np.prod([h / (h - g) for h in others]))
    return total


def find_borders(
    searches: Sequence[Search], *, threads: int | None = None, progress: Progress | None = None
) -> list[Border]:
    """Find the borders of many searches together.

    Returns
    -------
    list of Border
        In the order of the searches.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> from nonlinear.loop_setup import loop_setup
    >>> loop = loop_setup(load_design("ilr33-amber"), "current")
    >>> border, = find_borders([Search(loop, "gain up", 1900.0, 400)])
    >>> round(border.value, 2)
    2.95
    """
    hunts = [_Hunt(search, search.grid()) for search in searches]
    for hunt in hunts:
        if hunt.search.ticks * hunt.values.size > MOST_TICKS:
            hunt.spoiled = (
                f"an oscillation of {hunt.search.frequency_hz:.2g} Hz takes too many ticks to be followed"
            )
    for k in range(ATTEMPTS):
        open_ = [hunt for hunt in hunts if hunt.bracketed is None and not hunt.spoiled]
        if not _hunt(open_, threads, progress):
            return [hunt.border(stopped=True) for hunt in hunts]
        if k < ATTEMPTS - 1:
            hunts = [hunt.longer() if hunt.deceived else hunt for hunt in hunts]
    return [hunt.border() for hunt in hunts]


def _hunt(hunts: list[_Hunt], threads: int | None, progress: Progress | None) -> bool:
    """Take some hunts to their ends, the short ones first; whether there was time enough for all."""
    groups = _groups(hunts)
    for k, group in enumerate(groups):
        try:
            _control(group, threads)
            for _ in range(ROUNDS):
                waiting = [hunt for hunt in group if not hunt.done and not hunt.spoiled]
                if not waiting:
                    break
                _advance(waiting, threads)
        except OutOfTime:
            return False
        with suppress(OutOfTime):
            _measure_again([hunt for hunt in group if hunt.smooth], threads)
        if progress is not None:
            progress(k + 1, len(groups))
    return True


def _measure_again(hunts: list[_Hunt], threads: int | None) -> None:
    """Run every border found once more, with twice the wait."""
    if not hunts:
        return
    parts = []
    for hunt in hunts:
        later = replace(hunt.search, settle_ticks=2 * hunt.search.settle_ticks)
        parts.append(later.rows(hunt.looked_at_again))
    result = Rows.join(parts).run(threads=threads)
    ends = np.cumsum([len(part) for part in parts])
    for hunt, part, end in zip(hunts, parts, ends, strict=True):
        hunt.again(result.part(slice(end - len(part), end)))


def _control(hunts: list[_Hunt], threads: int | None) -> None:
    """Run the nominal drives: where one meets a limit or reverses, that says nothing of growth later."""
    ones = [hunt for hunt in hunts if hunt.search.controlled]
    for hunt in ones:
        hunt.spoiled = "" if hunt.search.setup.steady_start else UNSTEADY
    ones = [hunt for hunt in ones if not hunt.spoiled]
    if not ones:
        return
    parts = [hunt.search.rows(np.array([hunt.nominal()])) for hunt in ones]
    result = Rows.join(parts).run(threads=threads)
    for k, hunt in enumerate(ones):
        own = result.part(slice(k, k + 1))
        reversed_ = bool(own.events[0]) and hunt.search.setup.bias.delicate
        met = [f"{name} limit" for name in LIMITERS if own.limit_fraction(name)[0] > 0.0]
        met += ["reversal of the speed"] if reversed_ else []
        if not met and not hunt.search.smooth and 0.0 <= float(hunt.search.growth(own)[0]) < inf:
            hunt.spoiled = "the drive as it is has not come to rest within the time given"
        if met and (bool(own.ok[0]) or reversed_):  # behind a reversal, or in the gap, it is another drive
            hunt.spoiled = f"the drive as it is meets a {met[0]} after the faintest kick"


def _groups(hunts: list[_Hunt]) -> list[list[_Hunt]]:
    """Searches that run together to their ends, the short ones first: what is cut is then the longest."""
    ordered = sorted(hunts, key=lambda hunt: hunt.search.ticks)
    groups: list[list[_Hunt]] = [[]]
    ticks = 0
    for hunt in ordered:
        own = hunt.search.ticks * hunt.values.size
        if groups[-1] and ticks + own > GROUP_TICKS:
            groups.append([])
            ticks = 0
        groups[-1].append(hunt)
        ticks += own
    return groups


def _advance(hunts: list[_Hunt], threads: int | None) -> None:
    """One round of some searches in one batch."""
    parts = [hunt.search.rows(hunt.values) for hunt in hunts]
    result = Rows.join(parts).run(threads=threads)
    ends = np.cumsum([len(part) for part in parts])
    for hunt, part, end in zip(hunts, parts, ends, strict=True):
        hunt.take(result.part(slice(end - len(part), end)))
