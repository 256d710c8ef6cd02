"""Central differences of the compiled tick over one base period, all numbers of the state at once.

Which numbers take part, a kick at the place shows: those that it moves.  A first estimate, by steps as large
as no event forbids, says how far a large sine at the place moves each number.  From far above that motion on
steps fall by tens, until a smaller one agrees no better.  Each column is taken where successive steps agree
best, by what their difference does to the response: larger steps bend, smaller ones are lost in rounding.
Steps over many periods of a torque that repeats agree too, on nothing: they lie beyond steps that do not, and
are not looked at.  The sum of these differences is the stated error.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from actuator_lti.errors import NumericalError
from nonlinear._kernels import layout as at
from nonlinear._kernels.state_kinds import CONTINUOUS, COUNTER, FLAG, names_of, places_of
from nonlinear.bench.injection import Injection, Watched
from nonlinear.bench.lifted import GRID, Floats, sensitivities, sized
from nonlinear.bench.loop_setup import LoopSetup

Parts = tuple[Floats, Floats, Floats, Floats]
DECADES, MOST_DECADES = 13, 40  # of steps; where events forbid the larger ones, or they bend
TENFOLD = 100.0  # what the truncation of central differences grows by with a step ten times as large
SWAY = 1e3  # times the motion that a large sine makes: the largest step
LEAST = float(np.sqrt(np.finfo(float).eps))  # of the number itself: the largest step is no smaller
FAR = 1e8  # times a kick's first motion: the largest step of the first estimate
FRESH = 4  # periods from when a number is first moved, in which its motion gives its scale


class Differences:
    """One place of a drive that runs by hand.

    A row is a state, and behind it what is injected at each update at the place.

    Attributes
    ----------
    hold, updates : int
        Ticks between two updates at the place; updates in a base period.
    moved : ndarray of int
        Places of the numbers of the state that take part.
    """

    def __init__(self, setup: LoopSetup, place: str, watched: Sequence[Watched | None] = (None,)) -> None:
        self.where = f"{setup.design.name}: {place}"
        self.injected = Injection(setup, place, watched)
        self.drive = self.injected.rows.running()
        self.injected.prepare(self.drive.p)
        control = setup.design.controller
        if setup.bias.speed_rad_s == 0.0 and control.position and control.position.sensor == "output":
            stands = setup.design.total_ratio * setup.bias.output_rad(setup.design)
            self.drive.start[[at.S_REFERENCE, at.S_REFERENCE_BEFORE]] = (
                stands  # else it is fed forward to there
            )
        self.base, self.hold = setup.base_ticks, self.injected.hold_ticks
        self.updates, self.size = self.base // self.hold, self.drive.start.size
        self.watched = places_of(self.drive.p, FLAG, COUNTER)
        self.start = np.concatenate([self.drive.start, np.full(self.updates, self.injected.steady)])
        after, _, self.calm = self._runs(self.start[None])
        if after[0, at.S_EVENTS] != self.start[at.S_EVENTS]:
            raise NumericalError(f"{self.where}: an event happens on the operating motion itself")
        self.moved, scale, self.kick = self._reached()
        self.places = np.concatenate([self.moved, self.size + np.arange(self.updates)])
        self.scale = np.concatenate([scale, np.full(self.updates, self.kick)])

    @property
    def names(self) -> tuple[str, ...]:
        """Of the numbers of the state that take part."""
        return names_of(self.moved)

    def parts(self) -> Iterator[tuple[Parts, Floats, float]]:
        """A, B, C, D; stated errors of A over C beside B over D; the largest of the response, relative.

        One after the other for each thing that is read.
        """
        estimate, n = self._estimate(), self.moved.size
        rows = [
            np.concatenate([np.arange(n), n + np.arange(k, self.updates * readings, readings)])
            for readings in [self.injected.readings]
            for k in range(readings)
        ]
        felt = [self._felt(estimate[each]) for each in rows]
        sway = SWAY * self.kick * np.max(felt[0][1], axis=0)
        tried = self._tried(np.maximum(sway, LEAST * np.abs(self.start[self.places])), rows, felt)
        for columns, (left, right) in zip(tried, felt, strict=True):
            first, _ = columns.best(left, right)
            left, right = self._felt(first)  # what is felt of an error is known once the response is
            whole, off = columns.best(left, right)
            yield self._split(whole), off, float(np.max(np.einsum("zi,ik,zk->z", left, off, right)))

    def _split(self, whole: Floats) -> Parts:
        n = self.moved.size
        return whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:]

    def _felt(self, whole: Floats) -> tuple[Floats, Floats]:
        """What errors of the entries do to the response, over its size, see `sensitivities`."""
        n = self.moved.size
        left, right = sensitivities(*self._split(whole), np.exp(1j * GRID))
        answer = np.einsum("zi,ik,zk->z", left[:, n:], whole[n:], right)
        return np.abs(left) / sized(answer)[:, None], np.abs(right)

    def _runs(self, rows: Floats) -> tuple[Floats, Floats, Floats]:
        """States behind one base period, what is read at each update, and flags on the way."""
        states, injected = rows[:, : self.size].copy(), rows[:, self.size :]
        back = np.empty((*injected.shape, self.injected.readings))
        flags = np.empty((*injected.shape, self.watched.size))
        for k in range(self.updates):
            back[:, k] = self.injected.run(self.drive, states, injected[:, k])
            flags[:, k] = states[:, self.watched]
        return states, back, flags

    def _reached(self) -> tuple[npt.NDArray[np.intp], Floats, float]:
        """Which numbers a kick moves, how far each, and the kick: the largest without an event."""
        kick, continuous = self.injected.size, places_of(self.drive.p, CONTINUOUS)
        for _ in range(16):
            moved = self._kicked(kick)
            if moved is not None:
                places = continuous[moved[continuous] > 0.0]
                return places, moved[places], kick
            kick /= 10.0
        raise NumericalError(
            f"{self.where}: every kick at it ends in an event; no operating motion without one"
        )

    @property
    def _memory(self) -> int:
        """Ticks that a change may take through delay line, stored angles and moving average."""
        p = self.drive.p
        stored = p[at.DIFFERENCE_SAMPLES] * p[at.EVERY_VELOCITY] + p[at.PROFILE_SAMPLES] * p[at.OUTER_EVERY]
        return int(p[at.DELAY_LINE] + stored)

    def _kicked(self, kick: float) -> Floats | None:
        """How far a kick moves each number soon after it reaches it; None where it ends in an event."""
        rows = np.stack([self.start, self.start])
        rows[0, self.size] += kick
        moved, since = np.zeros(self.size), np.full(self.size, -1)
        quiet, period = 0, 0
        while quiet <= self._memory // self.base + FRESH:
            rows[:, : self.size], _, flags = self._runs(rows)
            rows[0, self.size] = self.injected.steady
            if not np.array_equal(*flags):
                return None
            kicked, calm = rows[:, : self.size]
            off = np.abs(np.where(kicked == calm, 0.0, kicked) - np.where(kicked == calm, 0.0, calm))
            new = (off > 0.0) & (since < 0)  # a limit that is lifted is infinite in both
            since[new] = period
            young = (since >= 0) & (period - since < FRESH)
            moved[young] = np.maximum(moved[young], off[young])
            quiet, period = (0 if new.any() else quiet + 1), period + 1
        return moved

    def _estimate(self) -> Floats:
        """Columns by the largest step each, far beyond the kick's own motion, that ends in no event."""
        steps, outputs = FAR * self.scale, self.updates * self.injected.readings
        columns = np.zeros((steps.size, self.moved.size + outputs))
        free = np.zeros(steps.size, bool)
        for _ in range(MOST_DECADES):
            found = self._differences(steps)[0]
            new = ~free & np.isfinite(found).all(axis=1)
            columns[new], free = found[new], free | new
            if free.all():
                return columns.T
            steps = np.where(free, 0.0, 0.1 * steps)
        raise self._refused(free)

    def _tried(
        self, largest: Floats, rows: list[npt.NDArray[np.intp]], felt: list[tuple[Floats, Floats]]
    ) -> list[_Columns]:
        """Columns by steps that differ by tens, of the rows of each thing that is read.

        From small steps up, each column until larger ones do not count for it; then by smaller ones, until it
        had three without an event and the last did not bend.
        """
        tried = [self._differences(largest * 10.0 ** (1 - DECADES))]
        done: list[list[Floats]] = [[] for _ in rows]
        going = np.ones(largest.size, bool)
        for decade in reversed(range(DECADES - 1)):
            tried.insert(0, self._differences(np.where(going, largest * 10.0**-decade, 0.0)))
            off = np.maximum(np.abs(tried[0][0] - tried[1][0]), tried[0][1])
            for each, (left, right), below in zip(rows, felt, done, strict=True):
                below.insert(0, _felt(off[:, each], left, right))
            going = ~np.all([_upwards(np.stack(below))[1][-1] for below in done], axis=0)
        for decade in range(DECADES, MOST_DECADES):
            values, rounding = (np.stack(each) for each in zip(*tried, strict=True))
            columns = [_Columns(values[:, :, each], rounding[:, :, each]) for each in rows]
            going = ~columns[0].free
            for one, (left, right) in zip(columns, felt, strict=True):
                going = going | one.bend(left, right)
            if not going.any():
                return columns
            tried.append(self._differences(np.where(going, largest * 10.0**-decade, 0.0)))
        raise self._refused(~going)

    def _refused(self, free: npt.NDArray[np.bool_]) -> NumericalError:
        """No step without an event."""
        name = (*self.names, *["the injection"] * self.updates)[int(np.argmin(free))]
        return NumericalError(f"{self.where}: every step of {name} ends in an event")

    def _differences(self, steps: Floats) -> tuple[Floats, Floats]:
        """Central differences over all numbers, one a row, and what rounding may make of them.

        NaN where the step is 0 or lost in the number, and where an event took place.
        """
        asked = np.flatnonzero(steps > 0.0)
        K, both = asked.size, np.arange(2 * asked.size)
        columns = np.full((2, steps.size, self.moved.size + self.updates * self.injected.readings), np.nan)
        if K == 0:
            return columns[0], columns[1]
        rows, places = np.tile(self.start, (2 * K, 1)), np.tile(self.places[asked], 2)
        rows[both, places] += np.concatenate([steps[asked], -steps[asked]])
        ends = rows[both, places]
        after, back, flags = self._runs(rows)
        found = np.concatenate([after[:, self.moved], back.reshape(2 * K, -1)], axis=1)
        calm = (flags == self.calm).all(axis=(1, 2)) & np.isfinite(found).all(axis=1)
        width = ends[:K] - ends[K:]
        width = np.where(calm[:K] & calm[K:] & (width > 0.0), width, np.nan)[:, None]
        size = np.maximum(np.abs(found[:K]), np.abs(found[K:]))
        columns[:, asked] = (found[:K] - found[K:]) / width, np.spacing(size) / width
        return columns[0], columns[1]


class _Columns:
    """All columns by steps that fall by tens, and what each differs in from that of the next smaller step."""

    def __init__(self, values: Floats, rounding: Floats) -> None:
        self.values = values[:-1]
        self.off = np.maximum(np.abs(np.diff(values, axis=0)), rounding[:-1])

    @property
    def free(self) -> npt.NDArray[np.bool_]:
        """Which have three successive steps without an event."""
        there = np.asarray(np.isfinite(self.off).all(axis=2))
        return np.asarray((there[:-1] & there[1:]).any(axis=0))

    def bend(self, left: Floats, right: Floats) -> npt.NDArray[np.bool_]:
        """Of which truncation still falls with the smallest step."""
        felt = _felt(self.off[-2:], left, right)
        return np.asarray(felt[-1] * np.sqrt(TENFOLD) < felt[-2])

    def best(self, left: Floats, right: Floats) -> tuple[Floats, Floats]:
        """Each column by the step whose error does least to the response; and that error."""
        felt, beyond = _upwards(_felt(self.off, left, right))
        chosen = len(felt) - 1 - np.argmin(np.where(beyond, np.inf, felt), axis=0)
        columns = np.arange(chosen.size)
        return self.values[chosen, columns].T, self.off[chosen, columns].T


def _felt(off: Floats, left: Floats, right: Floats) -> Floats:
    """What the error of each column by each step does to the response."""
    return np.asarray(np.max((off @ left.T) * right.T, axis=-1))


def _upwards(felt: Floats) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """What errors do to the response, from small steps up, and which steps lie beyond a rise.

    Of a step counts what its neighbours are off by as well: a step that is lost in rounding changes nothing,
    and agrees with the next smaller one by that.  What lies beyond a rise that truncation makes is left.
    """
    larger = np.nan_to_num(np.vstack([0.0 * felt[:1], felt[:-1]]), nan=0.0)
    smaller = np.vstack([felt[1:], np.full_like(felt[:1], np.inf)])
    felt = np.maximum(np.maximum(felt, smaller), larger)
    felt = np.where(np.isfinite(felt), felt, np.inf)[::-1]
    least = np.minimum.accumulate(felt, axis=0)
    return felt, np.logical_or.accumulate(felt > TENFOLD**2 * least, axis=0)
