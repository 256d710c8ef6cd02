"""The compiled tick driven by hand: any state in, some ticks, the state behind them.

A run keeps to itself what it does; this hands its state row over between two ticks, so that it may begin in
any state and be cut anywhere.  It is the same compiled code (`nonlinear.native`).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from actuator_lti.errors import InputError
from nonlinear import native
from nonlinear._kernels import elastic_layout
from nonlinear._kernels import layout as at
from nonlinear.rows import Rows
from nonlinear.runs.reduced import COLUMNS

Floats = npt.NDArray[np.float64]


class Stepper:
    """One row of `Rows`, run by hand.

    Attributes
    ----------
    p : ndarray
        All parameters, with what is derived of them.
    s : ndarray
        The state; write into it, or replace its content, between two calls.
    start : ndarray
        The state that the row begins in.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> rows = Rows.of(load_design("ilr33-amber"))
    >>> rows.step("command", 0.01)
    >>> drive = Stepper(rows)
    >>> drive.run(100)
    >>> drive.value("TICK")
    100.0
    """

    def __init__(self, rows: Rows) -> None:
        self.p, self.start = native.parameters(rows.values[0].copy())
        self.s = self.start.copy()
        self._buffers = (
            np.zeros(at.IO_SIZE), np.zeros(at.BLOCK_SIZE), rows.tables.joined(), np.zeros(0),
            np.zeros(0, np.uint16), np.zeros(at.OUT_SIZE), np.zeros(2),
        )  # fmt: skip
        self._tick = native.resumed(self.p, self.s, *self._buffers)

    def put(self, state: Floats) -> None:
        """Go on from a state."""
        self.s[:] = state

    def run(self, ticks: int) -> None:
        """Run so many ticks on; a drive that has failed stands still."""
        self.p[at.TICKS] = self.s[at.S_TICK] + ticks
        self._tick()

    def each(self, states: Floats, ticks: int, place: int, values: Floats) -> None:
        """Run every row of ``states`` so many ticks on, with its own value of one parameter at ``place``."""
        self.p[at.TICKS] = states[0, at.S_TICK] + ticks
        p, s, tick = self.p, self.s, self._tick
        for state, value in zip(states, values, strict=True):
            p[place] = value
            s[:] = state
            tick()
            state[:] = s

    @property
    def happened(self) -> tuple[float, float]:
        """Events so far, and the status: equal in two runs on the same piece of the map."""
        return float(self.s[at.S_EVENTS]), float(self.s[at.S_STATUS])

    def value(self, name: str) -> float:
        """A number of the state by its name in the layout, without ``S_`` or ``ES_``."""
        return float(self.s[_place(name)])

    def start_value(self, name: str) -> float:
        """The same of the state that the row begins in."""
        return float(self.start[_place(name)])

    def begin(self, ticks: int = 1, **state: float) -> None:
        """Run so many ticks from the start with some numbers of the state replaced, by their names."""
        self.put(self.start)
        for name, value in state.items():
            self.s[_place(name)] = value
        self.run(ticks)

    def change(self, column: str, value: float) -> None:
        """Change a parameter that nothing else is derived of, by its column of `Rows`."""
        self.p[COLUMNS[column]] = value

    def command(self, size: float) -> None:
        """Hold the command at a value."""
        self.p[at.COMMAND : at.COMMAND + 3] = at.STEP, size, -1.0


def _place(name: str) -> int:
    place = vars(at).get(f"S_{name}", vars(elastic_layout).get(f"ES_{name}"))
    if place is None:
        raise InputError(f"state {name!r}: not in the layout")
    return int(place)
