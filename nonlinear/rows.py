"""Many runs of a drive side by side: the one door from a design to the simulator's rows.

A row holds everything that describes one run; `Rows` holds n of them and their time series, and changes them
column by column, so that thousands of runs are set up by array arithmetic::

    rows = Rows.of(design, 3)
    rows["ticks"] = 20_000
    rows["resistance"] = samples               # a number, or one value a run
    rows.sine("command", amplitude_rad, frequency_hz)
    rows.window(ticks, cycles)
    result = rows.run()

The columns are those of ``COLUMNS``; signals are put at ``"command"``, ``"bias"`` or a break point (``"u"``,
``"i_ref"``, ``"w_ref"``, ``"output"``), where they are injected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Compared, Floats
from nonlinear._kernels import layout as at
from nonlinear.bench.probe import Probe, write_probe
from nonlinear.native import parameters
from nonlinear.row.parameters import design_rows
from nonlinear.runs.batch import Progress, run_rows
from nonlinear.runs.reduced import COLUMNS, BatchResult
from nonlinear.runs.running import Running
from nonlinear.runs.setup import Tables
from nonlinear.runs.simulation import run_row
from nonlinear.runs.trajectory import Trajectory

LIMITERS = at.LIMITERS
POINTS = at.POINTS


@dataclass(frozen=True, eq=False)
class Rows(Compared):
    """n runs of one design, see the module: values, shape (n, columns), and time series they refer to."""

    design: Design
    values: Floats
    tables: Tables = field(default_factory=Tables)

    @classmethod
    def of(cls, design: Design, count: int = 1, *, friction_on: bool = True, limits_on: bool = True) -> Rows:
        """``count`` rows of a design at rest, without command (see `nonlinear.simulate`).

        They are equal, or those of a design stacked over ``count`` (`actuator_lti.design.access.stacked`).

        Examples
        --------
        >>> from actuator_lti.design import load_design
        >>> rows = Rows.of(load_design("ilr33-amber"), 2)
        >>> rows["ticks"] = 1000
        >>> rows.step("command", [0.01, 0.02])
        >>> bool((rows.run().final_output_rad > 0.0099).all())
        True
        """
        return cls(design, design_rows(design, count, friction_on=friction_on, limits_on=limits_on))

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, name: str) -> Floats:
        """A column, shape (n,), by its name; writing into it changes the rows."""
        return self.values[:, _column(name)]

    def __setitem__(self, name: str, value: npt.ArrayLike) -> None:
        self.values[:, _column(name)] = value

    def value(self, name: str) -> float:
        """A column of the first row."""
        return float(self.values[0, _column(name)])

    def copy(self) -> Rows:
        """The same rows, to be changed."""
        return self._with(self.values.copy())

    def _with(self, values: Floats) -> Rows:
        """Other values with the same time series, to which more may be added."""
        return replace(self, values=values, tables=Tables([*self.tables.parts], self.tables.size))

    def repeat(self, count: int) -> Rows:
        """The first row ``count`` times."""
        return self._with(np.tile(self.values[0], (count, 1)))

    def take(self, which: npt.ArrayLike) -> Rows:
        """Some of the rows, by number or mask."""
        return self._with(self.values[np.atleast_1d(np.asarray(which))])

    def step(self, place: str, size: npt.ArrayLike, start_s: npt.ArrayLike = 0.0) -> None:
        """Step from ``start_s`` on; a start before zero is a constant."""
        self._signal(place, at.STEP, size, start_s)

    def ramp(self, place: str, rate: npt.ArrayLike, first: npt.ArrayLike = 0.0) -> None:
        """Ramp from t = 0 and a first value on."""
        self._signal(place, at.RAMP, rate, 0.0, np.inf, first)

    def sine(
        self,
        place: str,
        amplitude: npt.ArrayLike,
        frequency_hz: npt.ArrayLike,
        phase_rad: npt.ArrayLike = 0.0,
    ) -> None:
        """Sine from t = 0, peak amplitude."""
        self._signal(place, at.SINE, amplitude, 0.0, frequency_hz, phase_rad)

    def series(self, place: str, values: npt.ArrayLike, factor: npt.ArrayLike = 1.0) -> None:
        """One value a tick times a factor, the last held."""
        table = np.asarray(values, dtype=float)
        offset, length = self.tables.add(table)
        self._signal(place, at.TABLE, factor, 0.0, offset, length)

    def _signal(self, place: str, kind: int, *numbers: npt.ArrayLike) -> None:
        begin = _signal_place(place)
        self.values[:, begin] = kind
        for k, number in enumerate(numbers):
            self.values[:, begin + 1 + k] = number
        if place in POINTS:
            self.values[:, _probe_place(place) + at.PROBE_ON] = 1.0

    def frequency_hz(self, place: str = "command") -> Floats:
        """Frequencies of the sines at a place."""
        return self.values[:, _signal_place(place) + 3].copy()

    def probe(self, probe: Probe) -> None:
        """Put gain and delay of a probe into every row (its injection by the functions above)."""
        for row in self.values:
            write_probe(probe, row)

    def window(self, ticks: npt.ArrayLike, cycles: npt.ArrayLike = 1, harmonics: int = 1) -> None:
        """Reduce the last two windows (`nonlinear.runs.reduced.whole_periods` finds ticks and cycles)."""
        self["window"], self["cycles"], self["harmonics"] = ticks, cycles, harmonics

    def step_figures(self, target_rad: npt.ArrayLike, band: float = 0.02) -> None:
        """Take rise, peak and settling of what the command orders on its way to a target in its unit.

        That is the output's angle, of a drive without position loop `Trajectory.followed`.
        """
        self["step_target"], self["step_band"] = target_rad, band

    def extremes(self) -> None:
        """Keep minimum and maximum of every signal over the run."""
        self["with_extremes"] = 1.0

    def run(
        self,
        *,
        threads: int | None = None,
        progress: Progress = None,
        drives: Sequence[Running] | None = None,
    ) -> BatchResult:
        """Run all rows over the cores; what is kept of each is in the result.

        With ``drives`` (`running`, one a row) each goes on from where it is, and stays where its row ends.
        """
        return run_rows(self.values, self.tables.joined(), threads=threads, progress=progress, drives=drives)

    def running(self, k: int = 0) -> Running:
        """One row at its start, to go on from piece by piece."""
        return Running(*parameters(self.values[k].copy()), self.tables.joined())

    def trajectory(self, k: int = 0) -> Trajectory:
        """Run one row with its history."""
        return run_row(self.design, self.values[k].copy(), self.tables.joined())


def _column(name: str) -> int:
    if name not in COLUMNS:
        raise InputError(f"column {name!r} of a row: one of {', '.join(COLUMNS)}")
    return COLUMNS[name]


def _probe_place(point: str) -> int:
    return at.PROBES + POINTS.index(point) * at.PROBE_SIZE


def _signal_place(place: str) -> int:
    if place in POINTS:
        return _probe_place(place) + at.PROBE_SIGNAL
    places = {"command": at.COMMAND, "bias": at.BIAS}
    if place not in places:
        raise InputError(f"place = {place!r} of a signal: one of {', '.join((*places, *POINTS))}")
    return places[place]
