"""Whether a drive comes to rest under a command and a load that stay: the one judge of it.

With constant inputs a run is one map applied again and again, once a period of the outermost stage.  So the
question is asked of the whole state, and the drive is followed until it is answered:

- *at rest*: over `DRIFT` periods nothing changes by more than `STILL` of the largest value that it had; or
  swings that do not grow move it by no more than that of the largest angle;
- held by friction while an integral grows is not rest.  Then every period adds the same to the state; the
  state is set forward to just before breakaway (`nonlinear.settling.drift`), and the drive is followed
  from there;
- *limit cycle*: held by friction it breaks away a third time from one place in one direction, after equal
  times and swings (to `EQUAL`): what follows from there is known, so it does so for ever.  Or of `PERIODS`
  swings or more the later half is as large as the earlier, of the motor, too, and an event, a limit or a
  sensor's counts are in it, as a linear drive has none.  (A load that nothing damps swings on, at any size,
  while the motor comes to rest: no cycle.)  Which one a drive ends in may depend on the step.  Or swings of
  many sizes go on up to the end of the work, and have not shrunk part by part since its first quarter;
- *diverging*: no finite state, or a motion that still grows at the end of the work, without a limit in each
  of its parts;
- *still moving*: none of these within `MOST_WORK` ticks and integration steps, as a stiff drive takes
  thousands of steps a tick.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import reduce
from itertools import pairwise
from math import inf
from operator import or_
from typing import Literal

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from nonlinear._kernels import layout as at
from nonlinear.runs.running import Piece, Running, limiters_of
from nonlinear.settling import drift
from nonlinear.settling.grown import Grown

Verdict = Literal["at rest", "limit cycle", "still moving", "diverging"]

PERIODS, EQUAL, PARTS = 8, 0.01, 8
MOST_WORK = 4_000_000  # ticks, and integration steps within them
PIECE_TICKS = 4096
PART_WORK = 4096  # ticks and steps after which the work is looked at, where ticks may take many steps
_RANGED = [1, at.HISTORY_ANGLE, 3, 4, 5, 6]  # both angles, currents, voltage, commands


@dataclass(frozen=True, kw_only=True)
class Rest:
    """What a motion ends in; angles at the output, in the unit of the outermost stage's command.

    An amplitude is half the span of what follows the command, or of the motor's own angle over the reduction
    (speed, for a speed drive), over the cycle that returned, else in the last half of the work; 0 at rest.
    """

    verdict: Verdict
    error: float  # command less what follows it, at the end; of a limit cycle the mean between its ends
    amplitude: float
    motor_amplitude: float
    frequency_hz: float | None  # of a limit cycle
    periods: int  # whole swings seen
    limited: tuple[str, ...]  # limiters that act in the last half of the work
    after_s: float  # from the start of the judgement to its end, waits that were leapt over included
    work: int  # ticks gone through, and integration steps within them

    @property
    def comes_to_rest(self) -> bool:
        return self.verdict == "at rest"


def judge(running: Running, most_work: int = MOST_WORK) -> Rest | None:
    """Follow a drive from its present state until it is known what it ends in.

    ``running``: of a run (``run.running``) or of `nonlinear.Rows.running`; it is not changed.
    ``most_work``: ticks and integration steps within them; it ends with the part that passes it.

    None where command, load or supply still change of themselves. Noise is left out: it is no cycle.

    >>> from nonlinear import commands, simulate
    >>> judge(simulate("ilr33-amber", commands.step(0.01), 0.05).running).verdict
    'at rest'
    """
    drive = running.held()
    return None if drive is None else _Watch(drive, most_work).judged()


def first_motion_s(running: Running) -> float:
    """Time after which the motor first moves from where it is; inf: never, as far as the work goes.

    Raises `InputError`: where command, load or supply still change of themselves.
    """
    drive = running.held()
    if drive is None:
        raise InputError("first motion: command, load and supply must stay as they are")
    watch, start = _Watch(drive, MOST_WORK), drive.s[at.S_ANGLE]
    while not watch.spent and not watch.quiet():
        moved = np.concatenate([seen[2] for seen in watch.seen[-2:]]) != start / drive.p[at.RATIO]
        if moved.any():
            return float(np.concatenate(watch.times[-2:])[np.argmax(moved)])
    return inf


@dataclass
class _Watch:
    """The drive and what was seen of it."""

    drive: Running
    most_work: int
    rate: float = float(PART_WORK)  # of work, a tick; not known before the first one
    periods: int = 0  # gone by, leaps included
    times: list[Floats] = field(default_factory=list)
    seen: list[Floats] = field(default_factory=list)  # per piece: reference, followed, motor
    entries: int = 0
    extents: Grown = field(default_factory=lambda: Grown(5))  # per piece: entries, of followed and motor
    ranges: list[tuple[Floats, Floats]] = field(default_factory=list)  # per piece, of _RANGED
    acted: list[tuple[int, int, int]] = field(default_factory=list)  # entries, flags, events
    left: Grown = field(default_factory=lambda: Grown(5))  # of each breakaway: `_breakaways`
    looked: int = 0  # pieces in which breakaways were looked for
    leaps: int = 0  # over waits
    scales: drift.Scales = field(init=False)
    period_s: float = field(init=False)

    def __post_init__(self) -> None:
        self.period_s = self.drive.base_ticks * float(self.drive.p[at.PERIOD])
        self.scales = drift.Scales(self.drive, drift.DRIFT * self.period_s)

    def judged(self) -> Rest:
        due, periods = 8, max(PIECE_TICKS // self.drive.base_ticks, 2)
        while not self.spent:
            piece = self._advance(periods)
            if piece.status != "ok":
                return self._rest("diverging")
            leaps = self.leaps
            if self.quiet():
                return self._rest("at rest")
            if self.leaps > leaps and (cycle := self._returns()) is not None:
                return self._rest("limit cycle", *cycle)
            if len(self.seen) >= due:
                due += due // 2
                if (known := self._known()) is not None:
                    return known
        if (known := self._known()) is not None:
            return known
        if self._grows():
            return self._rest("diverging", self._swing())
        return self._rest("limit cycle" if self._goes_on() else "still moving", self._swing())

    def _known(self) -> Rest | None:
        """What is seen in the last half of the entries; None: nothing that tells the end."""
        if self._faint(swing := self._swing()):
            return self._rest("at rest")
        if swing.equal and self._bent() and self._motor_keeps_on():
            return self._rest("limit cycle", swing)
        return self._rest("at rest") if self._idle() else None

    def _advance(self, periods: int) -> Piece:
        """Go on and keep one entry a period."""
        piece = self._gone(periods)
        periods = piece.flags.size
        self.times.append(self.period_s * np.arange(self.periods, self.periods + periods, dtype=float))
        self.periods += periods
        self.seen.append(self._signals(piece.columns))
        moved = self.seen[-1][1:]
        self.entries += periods
        self.extents.add([[self.entries, *moved.min(axis=1), *moved.max(axis=1)]])
        flags = int(np.bitwise_or.reduce(piece.flags))
        self.acted.append((periods, flags, piece.events))
        ranged = piece.columns[_RANGED]
        self.ranges.append((ranged.min(axis=1), ranged.max(axis=1)))
        self.scales.take(self.drive, piece)
        return piece

    def _breakaways(self) -> Floats:
        """Time, entry, place (followed, motor), direction: a column for each breakaway so far."""
        # it stands while it moves no further in an entry than its share of what a window may (`drift.small`)
        known = max(self.looked - 1, 0)
        times, seen = np.concatenate(self.times[known:]), np.concatenate(self.seen[known:], axis=1)
        new = max(self.times[known].size - 2, 0) if self.looked else 0  # the last entry is judged now
        first = new + (int(self.extents.rows[known - 1, 0]) if known else 0)
        times, places = times[new:], seen[1:, new:]
        steps = np.diff(places, axis=1)
        moves = np.abs(steps).max(axis=0) > self._least / drift.DRIFT
        last = np.flatnonzero(moves[1:] & ~moves[:-1]) + 1
        ways = np.sign(steps[:, last].sum(axis=0))
        self.left.add(np.column_stack([times[last], first + last, *places[:, last], ways]))
        self.looked = len(self.times)
        return self.left.rows.T

    @property
    def spent(self) -> bool:
        return self.drive.work >= self.most_work

    def _gone(self, periods: int) -> Piece:
        """Go on; of a drive whose ticks may take many steps, in parts and no further than the work allows."""
        drive, base, parts = self.drive, self.drive.base_ticks, list[Piece]()
        if drive.p[at.LAW] == 0.0 and drive.p[at.ELASTIC_DRIVE] == 0.0:
            return drive.advance(periods * base, base)
        while periods and not (parts and self.spent):
            part = max(min(int(PART_WORK / (base * self.rate)), periods), 1)
            before, periods = drive.work, periods - part
            parts.append(drive.advance(part * base, base))
            self.rate = (drive.work - before) / (part * base)
        return Piece(
            np.concatenate([part.columns for part in parts], axis=1),
            np.concatenate([part.flags for part in parts]),
            sum(part.events for part in parts),
            next((part.status for part in parts if part.status != "ok"), "ok"),
        )

    def _signals(self, columns: Floats) -> Floats:
        """Command, what follows it, and the motor's part of that, all in the command's unit."""
        p, w = self.drive.p, columns[2] / self.drive.p[at.RATIO]
        if p[at.HAS_POSITION] > 0.0:
            return np.stack([columns[0], columns[1], columns[at.HISTORY_ANGLE] / p[at.RATIO]])
        if p[at.HAS_CURRENT] > 0.0 and p[at.HAS_VELOCITY] <= 0.0:
            return np.stack([columns[0], columns[3], columns[3]])
        if p[at.ELASTIC_DRIVE] > 0.0:
            place = columns.shape[0] - at.ELASTIC_COLUMNS - int(p[at.LOAD_VARIES] > 0.0)
            return np.stack([columns[0], columns[place], w])
        return np.stack([columns[0], w, w])

    def quiet(self) -> bool:
        """Whether nothing changes any more; an even drift is leapt over, up to what happens next."""
        drive, places = self.drive, drift.matter(self.drive)
        states, pieces = [drive.s[places]], []
        for _ in range(2):
            pieces.append(self._advance(drift.DRIFT))
            states.append(drive.s[places])
        if any(piece.flags.size < drift.DRIFT for piece in pieces):
            return False  # cut short, as the work is done
        scale = self.scales.states[places]
        before, step = drift.change(states[1], states[0]), drift.change(states[2], states[1])
        kept = (places == at.S_OVERLOAD) & drift.stays_overloaded(drive)
        still = drift.small(before, scale) & drift.small(step, scale)
        if all(self._still(piece) for piece in pieces) and ((kept | still).all() or self._turning):
            return True
        if not all(drift.eventless(piece) for piece in pieces):
            return False
        if places[~still].tolist() == [at.S_OVERLOAD]:
            self._wait_for_overload()
            return False
        if not drift.even(step, before, scale):
            return False
        windows = drift.leap(drive, places, step, before, scale)
        self.periods += windows * drift.DRIFT
        self.leaps += windows > 0
        return windows >= drift.MOST_LEAPS

    def _wait_for_overload(self) -> None:
        """Nothing moves but the overload memory: set it forward to the window before the one it acts in."""
        p, s, window = self.drive.p, self.drive.s, drift.DRIFT * self.drive.base_ticks
        windows = max(drift.ticks_until_it_acts(p, s) // window - 1, 0)
        s[at.S_OVERLOAD] = drift.overload(p, s, float(s[at.S_CURRENT]), windows * window)
        self.periods += windows * drift.DRIFT

    def _returns(self) -> tuple[_Swing, int] | None:
        """The swing between breakaways from one place one way, and its first entry; None: not known."""
        # as near as a count of the sensors, or `STILL` of the largest angle, is the same place
        p, left = self.drive.p, self._breakaways()
        counts = p[at.COUNTS_PER_RAD] * p[at.RATIO], p[at.POSITION_COUNTS]
        far = max([self._least, *(1.0 / each for each in counts if each > 0.0)])
        near = np.abs(left[2:4] - left[2:4, -1:]).max(axis=0, initial=0.0) <= far
        like = np.flatnonzero(near & (left[4] == left[4, -1:]))[::-1]
        spans = self._spans_from(left[1])[like]
        if like.size < 3 or spans[-1] <= far:
            return None  # no swing that a sensor counts
        moved = np.empty((0, 0))
        for turns in range(1, (like.size - 1) // 2 + 1):
            each = like[2 * turns :: -turns]  # the breakaway that this is, a period ago, two
            (before, now), (first, middle, last) = np.diff(left[0, each]), left[1, each].astype(int)
            if each[2] - each[1] != each[1] - each[0] or spans[turns] <= far or not _equal(before, now):
                continue
            moved = moved if moved.size else np.concatenate(self.seen, axis=1)[1:]
            span, seen = _span(moved[:, middle:last]), left[:, each[0] :]
            if span > far and _equal(span, _span(moved[:, first:middle])):
                n = next((n for n in range(1, each[2] - each[1] + 1) if _repeated(seen, n, span)), 0)
                if n:
                    return _Swing(2, (seen.shape[1] - 1) / n / (before + now), equal=True), middle
        return None

    def _spans_from(self, entries: Floats) -> Floats:
        """Spans of all that moved from the pieces of entries to the end."""
        ends, low, high = np.split(self.extents.rows[::-1], [1, 3], axis=1)
        spans = (np.maximum.accumulate(high) - np.minimum.accumulate(low)).max(axis=1)[::-1]
        return spans[np.searchsorted(ends[::-1, 0], entries, side="right")]

    def _still(self, piece: Piece) -> bool:
        """Whether all signals keep their values; of a speed drive, all but the angles."""
        names = [2, 3, 4, 5, 6] if self._turning else [1, 2, 3, 4, 5, 6, at.HISTORY_ANGLE]
        return bool((np.ptp(piece.columns[names], axis=1) <= drift.STILL * self.scales.signals[names]).all())

    @property
    def _turning(self) -> bool:
        """Whether a steady motion is what the command orders."""
        return bool(self.drive.p[at.HAS_POSITION] <= 0.0)

    def _grows(self) -> bool:
        """Whether the command was never missed by more than in the last quarter of the entries.

        Where no limit acts, that may be chance: a drive that is then linear grows in each part of them.
        """
        command, followed, _ = np.concatenate(self.seen, axis=1)
        missed = [float(part.max()) for part in np.array_split(np.abs(command - followed), PARTS)]
        limited = any(flags & ~at.FLAG_STICK for _, flags, _ in self._late())
        grown = max(missed[-2:]) > (1.0 + EQUAL) * max(missed[:-2])
        return grown and (limited or all(a < b for a, b in pairwise(missed[PARTS // 2 :])))

    def _goes_on(self) -> bool:
        """Whether what swings at the end of the work, the motor too, has not shrunk part by part.

        What follows need not repeat: friction that is left and met again makes swings of many sizes.
        """
        if self._swing().frequency_hz is None or not self._bent():
            return False
        moved = np.concatenate(self.seen, axis=1)[1:]
        for signal in (moved[np.argmax(np.ptp(self._half()[1][1:], axis=1))], moved[1]):
            spans = [float(np.ptp(part)) for part in np.array_split(signal, PARTS)][2:]
            if all(a > b for a, b in pairwise(spans)) or not 2.0 * max(spans[-2:]) > max(spans):
                return False
        return True

    def _idle(self) -> bool:
        """Whether nothing moved in the later half of the pieces, and what goes on in it keeps its range."""
        ranges = np.array(self.ranges[len(self.ranges) // 2 :])
        early, late = ((part[:, 0].min(axis=0), part[:, 1].max(axis=0)) for part in np.array_split(ranges, 2))
        kept = bool((late[0] >= early[0]).all() and (late[1] <= early[1]).all())
        return kept and not self._turning and bool((early[0][:2] == early[1][:2]).all())

    def _faint(self, swing: _Swing) -> bool:
        """Whether the swings of the last half of the entries move next to nothing, and do not grow."""
        late = self._half()[1][1:]
        if self._turning or swing.periods < PERIODS or np.ptp(late, axis=1).max() > self._least:
            return False
        first, second = (float(np.ptp(part, axis=1).max()) for part in np.array_split(late, 2, axis=1))
        return second <= 2.0 * first

    @property
    def _least(self) -> float:
        """A motion that counts for none, beside the largest angle."""
        return drift.STILL * float(self.scales.signals[1])

    def _bent(self) -> bool:
        """Whether anything but a linear drive is in the last half: events, limits, counts, waves."""
        p, limits = self.drive.p, ~at.FLAG_STICK
        counted = max(p[at.COUNTS_PER_RAD], p[at.POSITION_COUNTS], p[at.CURRENT_RESOLUTION]) > 0.0
        passes = self._turning and bool(p[[at.MOMENT_PEAK, at.MOMENT_PEAK_2, at.TORQUE_PEAK]].any())
        return bool(
            counted or passes or p[at.LAW] > 0.0 or any(flags & limits or n for _, flags, n in self._late())
        )

    def _motor_keeps_on(self) -> bool:
        """Whether the motor swings in the last half of the entries, and as far at its end."""
        early, late = (float(np.ptp(part)) for part in np.array_split(self._half()[1][2], 2))
        return early > 0.0 and _equal(early, late)

    def _late(self) -> list[tuple[int, int, int]]:
        left, result = sum(one[0] for one in self.acted) // 2, []
        for one in reversed(self.acted):
            if left <= 0:
                break
            result.append(one)
            left -= one[0]
        return result

    def _half(self) -> tuple[Floats, Floats]:
        """Times and signals of the last half of the entries."""
        entries = sum(map(len, self.times))
        first, left = len(self.times), entries - entries // 2
        while left > 0:
            first -= 1
            left -= len(self.times[first])
        times, seen = np.concatenate(self.times[first:]), np.concatenate(self.seen[first:], axis=1)
        return times[-left:], seen[:, -left:]

    def _swing(self) -> _Swing:
        """The swings of the last half of the entries, of whatever moves most."""
        times, seen = self._half()
        return _swing_of(times, seen[1 + int(np.argmax(np.ptp(seen[1:], axis=1)))])

    def _rest(self, verdict: Verdict, swing: _Swing | None = None, since: int | None = None) -> Rest:
        """What is known by now; of the last half of the entries, or of those ``since`` one."""
        command, followed, motor = (
            self._half()[1] if since is None else np.concatenate(self.seen, axis=1)[:, since:]
        )
        still, p = verdict == "at rest", self.drive.p
        acted = self._late()[: 1 if still else None]
        end = followed[-1] if still else 0.5 * (followed.max() + followed.min())
        orders = max(p[at.HAS_POSITION], p[at.HAS_VELOCITY], p[at.HAS_CURRENT]) > 0.0  # a voltage: nothing
        return Rest(
            verdict=verdict,
            error=float(command[-1] - end) if orders else 0.0,
            amplitude=0.0 if still else 0.5 * float(np.ptp(followed)),
            motor_amplitude=0.0 if still else 0.5 * float(np.ptp(motor)),
            frequency_hz=swing.frequency_hz if swing is not None and verdict == "limit cycle" else None,
            periods=0 if swing is None else swing.periods,
            limited=limiters_of(reduce(or_, (flags for _, flags, _ in acted), 0)),
            after_s=self.periods * self.period_s,
            work=self.drive.work,
        )


@dataclass(frozen=True)
class _Swing:
    periods: int
    frequency_hz: float | None
    equal: bool


def _swing_of(times: Floats, values: Floats) -> _Swing:
    """Swings between passages from below to above the middle, each by a quarter of the span."""
    middle, quarter = 0.5 * (values.max() + values.min()), 0.25 * float(np.ptp(values))
    side = np.where(values > middle + quarter, 1, np.where(values < middle - quarter, -1, 0))
    places = np.flatnonzero(side)
    up = places[1:][(side[places][1:] > 0) & (side[places][:-1] < 0)]
    n = max(up.size - 1, 0)
    if n < 2:
        return _Swing(n, None, equal=False)
    sizes = np.array([np.ptp(values[a:b]) for a, b in pairwise(up)])
    first, second = (float(half.mean()) for half in np.array_split(sizes, 2))
    equal = n >= PERIODS and _equal(first, second)
    return _Swing(n, float(n / (times[up[-1]] - times[up[0]])), equal)


def _equal(first: float, second: float) -> bool:
    """Whether two swings, or their times, are as large as each other."""
    return abs(second - first) <= EQUAL * first


def _span(moved: Floats) -> float:
    return float(np.ptp(moved, axis=1).max())


def _repeated(left: Floats, n: int, span: float) -> bool:
    """Whether breakaways (`_Watch._breakaways`) are those of n before: directions, times, places."""
    later, earlier = left[:, n:], left[:, :-n]
    periods = later[0] - earlier[0]
    places = np.abs(later[2:4] - earlier[2:4]).max()
    return bool(
        (later[4] == earlier[4]).all() and np.ptp(periods) <= EQUAL * periods.max() and places <= EQUAL * span
    )
