"""A drive that goes on from where a run left it, piece by piece, with its whole state at hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import elastic_layout
from nonlinear._kernels import layout as at
from nonlinear.runs.trajectory import STATUS, Status

Floats = npt.NDArray[np.float64]
_SIGNALS = (at.COMMAND, at.BIAS, *(at.PROBES + k * at.PROBE_SIZE + at.PROBE_SIGNAL for k in range(4)))
_TABLES = (at.LOAD_TABLE, at.TORQUE_TABLE, at.SUPPLY_TABLE)
_NOISE = (at.CURRENT_NOISE, at.ANGLE_NOISE, at.OUTPUT_NOISE, at.JITTER)
_COUNTED = {at.S_TICK, at.S_STATUS, at.S_AVERAGE_PLACE, at.S_EVENTS, at.S_MAX_EVENTS}
_BEHIND = (
    *range(at.S_CURRENT, at.S_NOISE),
    *range(at.S_COMMAND_CHAIN, at.S_PROBE_PLACES),
    *range(elastic_layout.ES_LOAD_SPEED, elastic_layout.ES_CONTACT + 1),
)


@dataclass(frozen=True)
class Piece:
    """Some ticks of a run, one entry every so many.

    Attributes
    ----------
    columns : ndarray, shape (columns, entries)
        As `nonlinear._kernels.layout` orders them.
    flags : ndarray of uint16
    events : int
        Landings, breakaways, reversals and contacts within it.
    status : str
    """

    columns: Floats
    flags: npt.NDArray[np.uint16]
    events: int
    status: Status


@dataclass(frozen=True)
class Running:
    """Parameters and state of one run; `advance` changes the state.

    Attributes
    ----------
    p, s : ndarray
        Parameters with what is derived from them, and the state.
    tables : ndarray
        Time series that the parameters refer to.
    """

    p: Floats
    s: Floats
    tables: Floats

    @property
    def base_ticks(self) -> int:
        """Ticks from one update of the outermost stage to the next: after them the same map acts again."""
        return int(self.p[at.OUTER_EVERY])

    @property
    def matter(self) -> npt.NDArray[np.intp]:
        """Places of the state that what comes depends on: plant, controller and their memories, no counts."""
        queue = range(at.S_QUEUE, int(self.p[at.AT_WORK]))
        return np.array([k for k in (*_BEHIND, *queue) if k not in _COUNTED])

    def copy(self) -> Running:
        """The same drive, to be changed."""
        return Running(self.p.copy(), self.s.copy(), self.tables)

    def held(self) -> Running | None:
        """A copy whose command and load stay for ever as they now are, without noise; its ticks count from 0.

        ``None`` where command, bias, load, torque or supply still change of themselves.
        """
        twin = self.copy()
        tick = int(self.s[at.S_TICK])
        for hold, places in ((_hold_signal, _SIGNALS), (_hold_table, _TABLES)):
            if not all(hold(twin.p, place, self.tables, tick) for place in places):
                return None
        twin.p[list(_NOISE)] = 0.0
        twin.s[at.S_TICK] = 0.0
        return twin

    def advance(self, ticks: int, every: int = 1) -> Piece:
        """Go on by some ticks from tick 0, and be at tick 0 again."""
        from nonlinear.native import resume

        p, rows = self.p, (ticks + every - 1) // every
        p[at.TICKS], p[at.RECORD_EVERY], p[at.WINDOW], p[at.STEP_TARGET] = ticks, every, 0.0, 0.0
        probing = sum(p[at.PROBES + k * at.PROBE_SIZE] > 0.0 for k in range(len(at.POINTS)))
        columns = at.HISTORY_PROBES + 2 * probing + int(p[at.RARE_LOAD] > 0.0)
        columns += at.ELASTIC_COLUMNS * int(p[at.ELASTIC_DRIVE])
        history, flags, out = np.empty((columns, rows)), np.zeros(rows, np.uint16), np.zeros(at.OUT_SIZE)
        before = self.s[at.S_EVENTS]
        status = resume(p, self.s, self.tables, history, flags, out, np.zeros(2))
        self.s[at.S_TICK] = 0.0
        return Piece(history, flags, int(self.s[at.S_EVENTS] - before), STATUS[status])


def _hold_signal(p: Floats, place: int, tables: Floats, tick: int) -> bool:
    """Write a signal as the constant that it is from now on; whether it is one."""
    kind, time = int(p[place]), tick * p[at.PERIOD] - p[place + 2]
    if kind == at.NONE or p[place + 1] == 0.0:
        return True
    if kind == at.TABLE:
        offset, length = int(p[place + 3]), int(p[place + 4])
        left = tables[offset + min(tick, length - 1) : offset + length]
        p[place + 3], p[place + 4] = offset + length - 1, 1.0
        return bool((left == left[-1]).all())
    if kind == at.RAMP:
        p[place + 1] *= p[place + 3]
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
