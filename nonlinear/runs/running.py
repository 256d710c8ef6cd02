"""A drive that goes on from where a run left it, piece by piece, with its whole state at hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from actuator_lti.bounds import HISTORY_BYTES
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from nonlinear._kernels import elastic_layout
from nonlinear._kernels import layout as at
from nonlinear.native import LIBRARY, resume
from nonlinear.runs.reduced import COLUMNS
from nonlinear.runs.trajectory import STATUS, Status

_SIGNALS = (at.COMMAND, at.BIAS, *(at.PROBES + k * at.PROBE_SIZE + at.PROBE_SIGNAL for k in range(4)))
_NOISE = (at.CURRENT_NOISE, at.ANGLE_NOISE, at.OUTPUT_NOISE, at.JITTER)
_COUNTED = {at.S_TICK, at.S_STATUS, at.S_AVERAGE_PLACE, at.S_EVENTS, at.S_MAX_EVENTS, at.S_STEPS}
_BEHIND = (
    *range(at.S_CURRENT, at.S_NOISE),
    *range(at.S_COMMAND_CHAIN, at.S_PROBE_PLACES),
    *range(elastic_layout.ES_LOAD_SPEED, elastic_layout.ES_BEND + 1),
)


def limiters_of(flags: int) -> tuple[str, ...]:
    """Limiters whose flags are set."""
    return tuple(name for name, bit in zip(at.LIMITERS, at.LIMITER_BITS, strict=True) if flags & bit)


@dataclass(frozen=True)
class Piece:
    """Some ticks of a run, one entry every so many."""

    columns: Floats  # (columns, entries), as `nonlinear._kernels.layout` orders them
    flags: npt.NDArray[np.uint16]
    events: int  # landings, breakaways, reversals and contacts within it
    status: Status

    def signal(self, name: str) -> Floats:
        """A signal by its name in a run; those of probes have none here."""
        return self.columns[at.SIGNALS[: at.BASE_SIGNALS].index(name)]

    @property
    def limited(self) -> tuple[str, ...]:
        """Limiters that acted within it."""
        return limiters_of(int(np.bitwise_or.reduce(self.flags)))


@dataclass(eq=False)
class Running:
    """Parameters and state of one run, driven by hand: any state in, some ticks, the state behind them.

    A run keeps to itself what it does; this hands its state over between two ticks, so that it may begin in
    any state and be cut anywhere.  It is the same compiled code (`nonlinear.native`).

    >>> from actuator_lti import load_design
    >>> from nonlinear.rows import Rows
    >>> rows = Rows.of(load_design("ilr33-amber"))
    >>> rows.step("command", 0.01)
    >>> drive = rows.running()
    >>> drive.run(100)
    >>> drive.value("TICK")
    100.0
    """

    # Parameters with what is derived from them, and the state; write into them between two calls
    p: Floats
    s: Floats
    tables: Floats  # time series that the parameters refer to
    start: Floats = field(init=False, repr=False)  # the state that it began in
    work: int = field(init=False, default=0)  # ticks that `advance` went on by, integration steps within them

    def __post_init__(self) -> None:
        self.start = self.s.copy()

    @property
    def base_ticks(self) -> int:
        """Ticks from one update of the outermost stage to the next: after them the same map acts again."""
        return int(self.p[at.OUTER_EVERY])

    @cached_property
    def matter(self) -> npt.NDArray[np.intp]:
        """Places of the state that what comes depends on: plant, controller and their memories, no counts."""
        queue = range(at.S_QUEUE, int(self.p[at.AT_WORK]))
        return np.array([k for k in (*_BEHIND, *queue) if k not in _COUNTED])

    @property
    def happened(self) -> tuple[float, float]:
        """Events so far, and the status: equal in two runs on the same piece of the map."""
        return float(self.s[at.S_EVENTS]), float(self.s[at.S_STATUS])

    def value(self, name: str) -> float:
        """A number of the state by its name in the layout, without ``S_`` or ``ES_``."""
        return float(self.s[_place(name)])

    def start_value(self, name: str) -> float:
        """The same of the state that it began in."""
        return float(self.start[_place(name)])

    def change(self, column: str, value: float) -> None:
        """Change a parameter that nothing else is derived of, by its column of `Rows`."""
        self.p[COLUMNS[column]] = value

    def command(self, size: float) -> None:
        self.p[at.COMMAND : at.COMMAND + 3] = at.STEP, size, -1.0

    def copy(self) -> Running:
        return Running(self.p.copy(), self.s.copy(), self.tables)

    def held(self) -> Running | None:
        """A copy at tick 0, no noise, command and load as they now are; None where one still changes."""
        twin = self.copy()
        tick = int(self.s[at.S_TICK])
        for hold, places in ((_hold_signal, _SIGNALS), (_hold_table, at.TABLES)):
            if not all(hold(twin.p, place, self.tables, tick) for place in places):
                return None
        twin.p[list(_NOISE)] = 0.0
        twin.s[at.S_TICK] = 0.0
        return twin

    @cached_property
    def _tick(self) -> Callable[[], int]:
        """A call that runs on to tick ``p[TICKS]``; the rows are kept: what is compiled has their places."""
        rows, out = (np.zeros(at.IO_SIZE), np.zeros(at.BLOCK_SIZE), self.tables), np.zeros(at.OUT_SIZE)
        self._kept = (*rows, np.zeros(0), np.zeros(0, np.uint16), out, np.zeros(2))
        return LIBRARY.functions.run.bound(self.p, self.s, *self._kept)

    def run(self, ticks: int) -> None:
        """Run so many ticks on; a drive that has failed stands still."""
        self.p[at.TICKS] = self.s[at.S_TICK] + ticks
        self._tick()

    def begin(self, command: float | None = None, **state: float) -> Running:
        """Run one tick from the start under a command, some numbers of the state replaced, by their names."""
        if command is not None:
            self.command(command)
        self.s[:] = self.start
        for name, value in state.items():
            self.s[_place(name)] = value
        self.run(1)
        return self

    def each(self, states: Floats, ticks: int, place: int, values: Floats) -> None:
        """Run every row of ``states`` so many ticks on, with its own value of one parameter at ``place``."""
        if ticks == 0:
            return
        self.p[at.TICKS] = states[0, at.S_TICK] + ticks
        p, s, tick = self.p, self.s, self._tick
        for state, value in zip(states, values, strict=True):
            p[place] = value
            s[:] = state
            tick()
            state[:] = s

    def advance(self, ticks: int, every: int = 1) -> Piece:
        """Go on by some ticks, command and load as they are from tick 0 on, and be at tick 0 again."""
        p, self.s[at.S_TICK] = self.p, 0.0
        p[at.TICKS], p[at.RECORD_EVERY], p[at.WINDOW], p[at.STEP_TARGET] = ticks, every, 0.0, 0.0
        history, flags, out = self.history()
        before, steps = self.s[at.S_EVENTS], self.s[at.S_STEPS]
        status = resume(p, self.s, self.tables, history, flags, out, np.zeros(2))
        self.blank(history, out)
        self.s[at.S_TICK] = 0.0
        self.work += ticks + int(self.s[at.S_STEPS] - steps)
        return Piece(history, flags, int(self.s[at.S_EVENTS] - before), STATUS[status])

    @property
    def probing(self) -> list[str]:
        return [point for k, point in enumerate(at.POINTS) if self.p[at.PROBES + k * at.PROBE_SIZE] > 0.0]

    def history(self) -> tuple[Floats, npt.NDArray[np.uint16], Floats]:
        """Room for the columns of a run, its flags and its results."""
        p, every = self.p, int(self.p[at.RECORD_EVERY])
        rows = (int(p[at.TICKS]) + every - 1) // every
        columns = at.HISTORY_PROBES + 2 * len(self.probing) + int(p[at.LOAD_VARIES] > 0.0)
        columns += at.ELASTIC_COLUMNS * int(p[at.ELASTIC_DRIVE])
        if 8 * rows * columns > HISTORY_BYTES.most:
            message = f"{p[at.TICKS]:.0f} ticks: a history of {rows} rows does not fit into memory"
            raise InputError(f"{message}; use record_every, or simulate_many with reducers")
        return np.empty((columns, rows)), np.zeros(rows, np.uint16), np.zeros(at.OUT_SIZE)

    def blank(self, history: Floats, out: Floats) -> None:
        """Make NaN of the rows that a run, with these results, has not reached."""
        every = int(self.p[at.RECORD_EVERY])
        history[:, (int(out[at.OUT_TICKS]) + every - 1) // every :] = np.nan

    def returned(self, piece: Piece, point: str) -> Floats:
        """The signal in front of the instrument at a break point, of a piece."""
        return piece.columns[at.HISTORY_PROBES + 2 * self.probing.index(point)]


def _place(name: str) -> int:
    place = vars(at).get(f"S_{name}", vars(elastic_layout).get(f"ES_{name}"))
    if place is None:
        raise InputError(f"state {name!r}: not in the layout")
    return int(place)


def _hold_signal(p: Floats, place: int, tables: Floats, tick: int) -> bool:
    """Write a signal as the constant that it is from now on; whether it is one."""
    kind, time = int(p[place]), tick * p[at.PERIOD] - p[place + 2]
    if kind == at.NONE or p[place + 1] == 0.0:
        return True
    if kind == at.TABLE:
        return _hold_table(p, place + 3, tables, tick)
    if kind == at.RAMP:
        p[place + 1] = p[place + 4] + p[place + 1] * p[place + 3]
    over = time >= (p[place + 3] if kind == at.RAMP else 0.0)
    p[place], p[place + 2] = at.STEP, 0.0
    return over and kind in (at.STEP, at.RAMP)


def _hold_table(p: Floats, place: int, tables: Floats, tick: int) -> bool:
    """Shorten a series to its last value, if only that is left; whether it is."""
    offset, length = int(p[place]), int(p[place + 1])
    if length == 0:
        return True
    left = tables[offset + min(tick, length - 1) : offset + length]
    p[place], p[place + 1] = offset + length - 1, 1.0
    return bool((left == left[-1]).all())
