"""Central differences of the compiled tick over one base period, all numbers of the state at once.

Which numbers take part, a kick at the place shows: those that it moves.  The tick is affine but for events,
which are seen, and for what bends, of which the design says over how far: a moment over its angle, the tanh
law beside its flat part.  So the steps begin far above the kick's own motion, or with the largest without an
event, or where what bends is moved by `BENT` of that and the tanh law is flat in every tick; and they fall by
tens while a smaller one agrees better: larger ones bend, smaller ones are lost in rounding.  Where even the
largest is lost in it, they grow.  Each column is taken where two successive steps agree best, by what their
difference does to the response.  The sum of these differences is the stated error.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from actuator_lti.errors import NumericalError
from actuator_lti.systems.resolvent import balanced
from nonlinear._kernels import layout as at
from nonlinear._kernels.state_kinds import CONTINUOUS, COUNTER, FLAG, names_of, places_of
from nonlinear.bench.injection import Injection, Watched
from nonlinear.bench.lifted import GRID, Floats, sensitivities, sized
from nonlinear.bench.loop_setup import LoopSetup

Parts = tuple[Floats, Floats, Floats, Floats]
Pair = tuple[Floats, Floats]
Places = npt.NDArray[np.intp]
MOST_DECADES = 40  # of steps, where events forbid the larger ones
TENFOLD = 100.0  # what the truncation of central differences grows by with a step ten times as large
FAR = 1e8  # times a kick's first motion: the largest step
BENT = 1e-3  # of the way over which a torque bends, that the largest step may move it
GROWN, KNOWN = 8, 1e-9  # decades that a column's steps may grow by, while its error is more than that
LEAST = 3  # steps of a column: two differences, of which the second says whether it bends
SLOWEST = 1e-13  # rad a sample: what is slower is at rest
NOTHING = 1e-150  # that a kick moves a number by: a rotor that is held
FRESH = 4  # periods from when a number is first moved, in which its motion gives its scale


class Differences:
    """One place of a drive that runs by hand.

    A row is a state, and behind it what is injected at each update at the place. ``hold``, ``updates``: ticks
    between two of them, their number in a base period. ``moved``, ``names``: places and names of the numbers
    of the state that take part.
    """

    def __init__(self, setup: LoopSetup, place: str, watched: Sequence[Watched | None] = (None,)) -> None:
        self.setup, self.where = setup, f"{setup.design.name}: {place}"
        self.injected = Injection(setup, place, watched)
        self.drive = self.injected.rows.running()
        self.injected.prepare(self.drive.p)
        self._led()
        self.base, self.hold = setup.base_ticks, self.injected.hold_ticks
        self.updates, self.size = self.base // self.hold, self.drive.start.size
        self.watched = places_of(self.drive.p, FLAG, COUNTER)
        self.start = np.concatenate([self.drive.start, np.full(self.updates, self.injected.steady)])
        after, _, self.calm = self._runs(self.start[None])
        if after[0, at.S_EVENTS] != self.start[at.S_EVENTS]:
            raise NumericalError(f"{self.where}: an event happens on the operating motion itself")
        self.moved, scale, self.kick = self._reached()
        self.names = names_of(self.moved)
        self.places = np.concatenate([self.moved, self.size + np.arange(self.updates)])
        self.scale = np.concatenate([scale, np.full(self.updates, self.kick)])

    def _led(self) -> None:
        """Let the commands before the first be those of the motion: else it is fed forward to there."""
        setup, start = self.setup, self.drive.start
        place, N, speed = setup.design.controller.position, setup.design.total_ratio, setup.bias.speed_rad_s
        if place is None or setup.outer != "position":
            return
        if speed == 0.0 and place.integral_time_s is not None:
            start[at.S_POSITION_INTEGRATOR] = setup.wanted  # in no row, either
        now = N * self.injected.rows.values[0, at.BIAS + (4 if speed else 1)]  # of a ramp, or of a step
        period_s = place.every * setup.design.controller.period_s
        start[[at.S_REFERENCE, at.S_REFERENCE_BEFORE]] = now - speed * period_s * np.array([1.0, 2.0])

    def parts(self) -> Iterator[tuple[Parts, Floats, float]]:
        """A, B, C, D, errors of A over C beside B over D, the largest of the response, of each thing read."""
        n, readings = self.moved.size, self.injected.readings
        rows = [
            np.concatenate([np.arange(n), n + np.arange(k, self.updates * readings, readings)])
            for k in range(readings)
        ]
        for columns, (left, right) in self._tried(rows):
            whole, off = columns.best(left, right)
            g = GRID.size
            yield self._split(whole), off, float(np.max(np.einsum("zi,ik,zk->z", left[:g], off, right[:g])))

    def _split(self, whole: Floats) -> Parts:
        n = self.moved.size
        return whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:]

    def _felt(self, whole: Floats) -> Pair:
        """What errors of entries do to the response, over its size: at `GRID`, and where slow poles are."""
        n = self.moved.size
        angles = np.abs(np.linalg.eigvals(balanced(whole[:n, :n])[0] - np.eye(n))) / self.updates
        slow = angles[(angles > SLOWEST) & (angles < GRID[0])]  # but of those at rest
        left, right = sensitivities(*self._split(whole), np.exp(1j * np.concatenate([GRID, slow])))
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

    def _reached(self) -> tuple[Places, Floats, float]:
        """Which numbers a kick moves, how far each, and the kick: the largest without an event."""
        kick, continuous = self.injected.size, places_of(self.drive.p, CONTINUOUS)
        for _ in range(16):
            moved = self._kicked(kick)
            if moved is not None:
                places = continuous[moved[continuous] > NOTHING]
                return places, moved[places], kick
            kick /= 10.0
        message = "every kick at it ends in an event; no operating motion without one"
        raise NumericalError(f"{self.where}: {message}")

    def _kicked(self, kick: float) -> Floats | None:
        """How far a kick moves each number soon after it reaches it; None where it ends in an event."""
        p, rows = self.drive.p, np.stack([self.start, self.start])
        stored = p[at.DIFFERENCE_SAMPLES] * p[at.EVERY_VELOCITY] + p[at.PROFILE_SAMPLES] * p[at.OUTER_EVERY]
        longest = int(p[at.DELAY_LINE] + stored) // self.base + FRESH  # periods that a change may take
        rows[0, self.size] += kick
        moved, since = np.zeros(self.size), np.full(self.size, -1)
        quiet, period = 0, 0
        while quiet <= longest:
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

    @cached_property
    def _bends(self) -> tuple[tuple[int, float], ...]:
        """Numbers of the state that a torque bends over, and over how far."""
        setup, found = self.setup, list[tuple[int, float]]()
        design, room = setup.design, setup.bias.room_rad_s
        elastic = self.drive.p[at.ELASTIC_DRIVE] > 0.0
        output = (at.S_OUTPUT, 1.0) if elastic else (at.S_ANGLE, design.total_ratio)
        for own, place, ratio in (
            (design.motor.over_angle, at.S_ANGLE, 1.0),
            (design.load.over_angle, *output),
        ):
            found += [(place, BENT * ratio / wave.order) for wave in own.waves if wave.peak_Nm]
        if setup.bias.friction_on and np.isfinite(room):
            found.append((at.S_SPEED, room))
        return tuple(
            (int(np.flatnonzero(self.moved == place)[0]), far) for place, far in found if place in self.moved
        )

    @cached_property
    def _largest(self) -> Floats:
        """Steps far above the kick's own motion that in no tick leave the flat part of tanh."""
        # where it was between two ends of periods no event says, as of dry friction: the law is smooth
        steps, bias = FAR * self.scale, self.setup.bias
        if self.setup.design.friction.law != "tanh" or not bias.friction_on:
            return steps
        rows, _ = self._stepped(steps)
        states, injected = rows[:, : self.size].copy(), rows[:, self.size :]
        moved = np.zeros(steps.size)
        for tick in range(self.base + 1):
            above, below = np.split(states[:, at.S_SPEED], 2)
            moved = np.fmax(moved, np.abs(0.5 * (above - below)))
            if tick < self.base:
                self.drive.each(states, 1, self.injected.at, injected[:, tick // self.hold])
        return np.fmin(steps, bias.room_rad_s * steps / np.maximum(moved, 1e-250))

    def _tried(self, rows: list[Places]) -> list[tuple[_Columns, Pair]]:
        """Columns by steps that fall by tens, of each thing that is read, and what is felt there."""
        # of each column until it had three without an event, and the last did not bend; where events forbid
        # the larger ones, they begin with the largest without one, found by halves
        steps, going, seen = self._largest, np.ones(self.scale.size, bool), np.zeros(self.scale.size, bool)
        felt, tried = list[Pair](), list[Pair]()
        for tries in range(1, MOST_DECADES + 1):
            values, rounding = self._differences(np.where(going, steps, 0.0))
            free = np.isfinite(values).all(axis=1)
            small = free & ~seen & (tries > 1)
            values[small] = np.nan
            smaller = np.where(small, 5.0, np.where(seen & ~free, 0.5, 0.1))
            steps, seen = np.where(going, smaller, 1.0) * steps, seen | free
            tried.append((values, rounding))
            for row, far in self._bends:
                moved = np.abs(values[:, row])
                moved[row] = np.fmax(moved[row], 1.0)  # by the step itself
                steps = np.fmin(steps, far / np.maximum(moved, 1e-250))
            if tries < LEAST:
                continue
            columns = [_Columns(tried, each) for each in rows]
            going = ~columns[0].free
            if not going.any():
                felt = felt or [self._felt(each.last) for each in columns]
                for one, (left, right) in zip(columns, felt, strict=True):
                    going = going | one.bend(left, right)
                if not going.any():
                    return self._grown(rows, tried, felt)
        name = (*self.names, *["the injection"] * self.updates)[int(np.argmax(going))]
        raise NumericalError(f"{self.where}: every step of {name} ends in an event")

    def _grown(self, rows: list[Places], tried: list[Pair], felt: list[Pair]) -> list[tuple[_Columns, Pair]]:
        """The same with larger steps of columns that the largest knows best, while they agree better."""
        # a number that hardly moves beside large ones is lost in their rounding at steps by its own motion
        steps = self._largest
        for _ in range(GROWN):
            columns = [_Columns(tried, each) for each in rows]
            going = np.any([one.grow(*each) for one, each in zip(columns, felt, strict=True)], axis=0)
            if not going.any():
                break
            steps = np.where(going, 10.0 * steps, 0.0)
            tried.insert(0, self._differences(steps))
        return [(_Columns(tried, each), seen) for each, seen in zip(rows, felt, strict=True)]

    def _differences(self, steps: Floats) -> Pair:
        """Central differences, a number a row, and their rounding; NaN where lost, or an event was."""
        asked = np.flatnonzero(steps > 0.0)
        K = asked.size
        columns = np.full((2, steps.size, self.moved.size + self.updates * self.injected.readings), np.nan)
        if K == 0:
            return columns[0], columns[1]
        rows, ends = self._stepped(steps[asked], asked)
        after, back, flags = self._runs(rows)
        found = np.concatenate([after[:, self.moved], back.reshape(2 * K, -1)], axis=1)
        calm = (flags == self.calm).all(axis=(1, 2)) & np.isfinite(found).all(axis=1)
        width = ends[:K] - ends[K:]
        width = np.where(calm[:K] & calm[K:] & (width > 0.0), width, np.nan)[:, None]
        size = np.maximum(np.abs(found[:K]), np.abs(found[K:]))
        columns[:, asked] = (found[:K] - found[K:]) / width, np.spacing(size) / width
        return columns[0], columns[1]

    def _stepped(self, steps: Floats, numbers: slice | Places = slice(None)) -> Pair:
        """Rows with numbers of the state one step above, then one below; where these numbers then are."""
        both, places = np.arange(2 * steps.size), np.tile(self.places[numbers], 2)
        rows = np.tile(self.start, (both.size, 1))
        rows[both, places] += np.concatenate([steps, -steps])
        return rows, rows[both, places]


class _Columns:
    """All columns of one thing that is read, by steps that fall; ``off``: what differs in the next one."""

    def __init__(self, tried: list[Pair], rows: Places) -> None:
        values, rounding = (np.stack(each)[:, :, rows] for each in zip(*tried, strict=True))
        self.values = values[:-1]
        self.off = np.maximum(np.abs(np.diff(values, axis=0)), rounding[:-1])
        self.there = np.isfinite(self.off).all(axis=2)
        self.smallest = len(self.there) - 1 - np.argmax(self.there[::-1], axis=0)

    @property
    def free(self) -> npt.NDArray[np.bool_]:
        """Which have three successive steps without an event."""
        return np.asarray((self.there[:-1] & self.there[1:]).any(axis=0))

    @property
    def last(self) -> Floats:
        """Each column by its smallest step but one."""
        return self._taken(self.smallest, self.values)

    def bend(self, left: Floats, right: Floats) -> npt.NDArray[np.bool_]:
        """Of which truncation still falls with the smallest step."""
        felt, last, columns = self._felt(left, right), self.smallest, np.arange(right.shape[1])
        return np.asarray(felt[last, columns] * np.sqrt(TENFOLD) < felt[last - 1, columns])

    def grow(self, left: Floats, right: Floats) -> npt.NDArray[np.bool_]:
        """Which the largest step of all knows best, but not well."""
        felt = self._felt(left, right)
        best = np.argmin(np.where(np.isfinite(felt), felt, np.inf), axis=0)
        return np.asarray((best == 0) & np.isfinite(felt[0]) & (felt[0] > KNOWN))

    def best(self, left: Floats, right: Floats) -> Pair:
        """Each column by the step whose error does least to the response; and that error."""
        felt = self._felt(left, right)
        chosen = np.argmin(np.where(np.isfinite(felt), felt, np.inf), axis=0)
        return self._taken(chosen, self.values), self._taken(chosen, self.off)

    def _felt(self, left: Floats, right: Floats) -> Floats:
        """What the error of each column by each step does to the response."""
        return np.asarray(np.max((self.off @ left.T) * right.T, axis=-1))

    @staticmethod
    def _taken(chosen: Places, values: Floats) -> Floats:
        return values[chosen, np.arange(chosen.size)].T
