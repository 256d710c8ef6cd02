"""Many runs at once over the cores: different designs, commands and parameters, reduced as they run.

`simulate_many` takes `Run` objects; `nonlinear.rows.Rows` sets up thousands of runs by array arithmetic.

Every run is done by the same compiled function as `nonlinear.simulate`, by one thread, from its own row: the
numbers do not depend on the number of threads, nor on what else is in the batch.  A run needs no memory
for its ticks; it leaves ``layout.OUT_SIZE`` numbers.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from actuator_lti.bounds import BATCH_TICKS
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, TooManyTicks, shown, whole_number
from nonlinear._kernels import layout as at
from nonlinear.bench.probe import Probe
from nonlinear.commands import Command
from nonlinear.loads import LoadMoment, as_load
from nonlinear.row.parameters import design_row
from nonlinear.runs.reduced import BatchResult
from nonlinear.runs.running import Running
from nonlinear.runs.setup import Tables, put_run
from nonlinear.runs.trajectory import State
from nonlinear.runs.watch import watch

Floats = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]
LOOK_S = 0.1  # between two looks of who watches
CHUNK_TICKS = 2_000_000  # ticks one thread does between two looks at the queue


@dataclass(frozen=True, kw_only=True)
class Reducers:
    """What to keep of a run beside final state, limit use and events.

    Parameters
    ----------
    window_ticks, cycles : int
        Length of the last window (and the one before it) in ticks, and whole periods of the fundamental in
        it (see `nonlinear.runs.reduced.whole_periods`); 0: no windows.
    harmonics : int
        Harmonics correlated in the windows, 0 to 9.
    extremes : bool
        Minimum and maximum of every signal over the whole run.
    step_target_rad : float
        Output angle that a step asks for; gives rise, peak and settling. 0: none.
    step_band : float
        Settling band, relative to the target.
    """

    window_ticks: int = 0
    cycles: int = 1
    harmonics: int = 1
    extremes: bool = False
    step_target_rad: float = 0.0
    step_band: float = 0.02

    def write(self, row: Floats) -> None:
        """Write into a parameter row (or all rows of an array)."""
        if not 0 <= self.harmonics <= at.MAX_HARMONICS:
            raise InputError(f"harmonics = {self.harmonics}: must be 0 to {at.MAX_HARMONICS}")
        if self.window_ticks and not 0 < 2 * self.cycles < self.window_ticks:
            message = f"window of {self.window_ticks} ticks: must hold more than two ticks a period"
            raise InputError(f"{message} ({self.cycles} periods asked for)")
        row[..., at.WINDOW], row[..., at.CYCLES] = self.window_ticks, self.cycles
        row[..., at.HARMONICS], row[..., at.WITH_EXTREMES] = self.harmonics, self.extremes
        row[..., at.STEP_TARGET], row[..., at.STEP_BAND] = self.step_target_rad, self.step_band


@dataclass(frozen=True, kw_only=True)
class Run:
    """One run of a batch; the names are those of `nonlinear.simulate`."""

    design: Design
    command: Command
    duration_s: float
    load_Nm: float | LoadMoment = 0.0
    bias: Command | None = None
    probes: tuple[Probe, ...] = ()
    initial: State | None = None
    friction_on: bool = True
    limits_on: bool = True
    reducers: Reducers = Reducers()

    def row(self, tables: Tables) -> Floats:
        """The parameter row of this run; time series go into ``tables``."""
        row = design_row(self.design, friction_on=self.friction_on, limits_on=self.limits_on)
        load, window = as_load(self.load_Nm), self.reducers.window_ticks
        put_run(
            row,
            self.design,
            self.duration_s,
            self.command,
            self.bias,
            load,
            self.probes,
            self.initial,
            tables,
        )
        if 2 * window > row[at.TICKS]:
            message = f"window of {window} ticks: must fit twice into {row[at.TICKS]:.0f} ticks"
            raise InputError(message, where=self.design.name)
        self.reducers.write(row)
        return row


def simulate_many(
    runs: Sequence[Run], *, threads: int | None = None, progress: Progress | None = None
) -> BatchResult:
    """Simulate many runs, each with its own design, command and reducers.

    Parameters
    ----------
    runs : sequence of Run
    threads : int, optional
        Default: the cores this process may use.
    progress : callable, optional
        Called as ``progress(runs done, runs in all)``.

    Returns
    -------
    BatchResult
        One entry a run, in order.  Runs that failed have a status that is not 0; look at it.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> from nonlinear import commands
    >>> design = load_design("ilr33-amber")
    >>> steps = [Run(design=design, command=commands.step(a), duration_s=0.2,
    ...              reducers=Reducers(step_target_rad=a)) for a in (0.01, 0.02)]
    >>> result = simulate_many(steps)
    >>> bool((result.step.rise_time_s < 0.1).all())
    True
    """
    if not isinstance(runs, Sequence) or not runs or not isinstance(runs[0], Run):
        raise InputError(f"runs = {shown(runs)}: allowed: a sequence of Run, at least one")
    tables = Tables()
    rows = np.array([run.row(tables) for run in runs])
    return run_rows(rows, tables.joined(), threads=threads, progress=progress)


def run_rows(
    rows: Floats,
    tables: Floats | None = None,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    drives: Sequence[Running] | None = None,
) -> BatchResult:
    """Run parameter rows, shape (n, layout.SIZE), of `nonlinear.rows.Rows`.

    Each of ``drives``, one a row, goes on from where it is to the row's number of ticks.

    Raises
    ------
    TooManyTicks
        If the runs have more ticks than can be computed in a reasonable time.
    """
    rows = np.ascontiguousarray(rows, dtype=float)
    ticks = float(rows[:, at.TICKS].sum())
    if not ticks <= BATCH_TICKS.most:
        raise TooManyTicks(f"{ticks:.3g} ticks to simulate; allowed: {BATCH_TICKS.allowed} in all runs")
    series = np.zeros(1) if tables is None else np.ascontiguousarray(tables, dtype=float)
    n = rows.shape[0]
    outs, statuses = np.empty((n, at.OUT_SIZE)), np.empty(n, np.int64)
    threads = available_threads() if threads is None else min(whole_number("threads", threads), len(rows))
    spans = _spans(rows[:, at.TICKS], threads)
    done, shared = 0, np.zeros(2)
    each = [None] * n if drives is None else drives
    if len(spans) == 1 and ticks <= CHUNK_TICKS and watch() is None:  # not worth a thread
        _run_span(rows, series, each, 0, n, outs, statuses, shared)
        if progress is not None:
            progress(n, n)
        return BatchResult(rows=rows, outs=outs, status=statuses)
    with ThreadPoolExecutor(max_workers=max(1, threads)) as pool:
        waiting = [pool.submit(_run_span, rows, series, each, a, b, outs, statuses, shared) for a, b in spans]
        sizes = {future: b - a for future, (a, b) in zip(waiting, spans, strict=True)}
        try:
            pending, look = set(waiting), watch()
            while pending:
                ended, pending = wait(pending, None if look is None else LOOK_S, FIRST_COMPLETED)
                if look is not None:
                    look()
                for future in ended:
                    future.result()
                    done += sizes[future]
                    if progress is not None:
                        progress(done, n)
        except BaseException:
            shared[1] = 1.0  # stops the runs that are under way
            for future in waiting:
                future.cancel()
            raise
    return BatchResult(rows=rows, outs=outs, status=statuses)


def _run_span(
    rows: Floats, tables: Floats, drives: Sequence[Running | None], start: int, stop: int, outs: Floats,
    statuses: np.ndarray, shared: Floats,
) -> None:  # fmt: skip
    """Run rows start to stop in this thread; the kernel runs without the GIL."""
    from nonlinear.native import parameters, resume

    history, flags = np.empty((0, 0)), np.empty(0, np.uint16)
    for r in range(start, stop):
        drive = drives[r]
        p, s = parameters(rows[r]) if drive is None else (drive.p, drive.s)
        p[at.TICKS] = rows[r, at.TICKS]
        statuses[r] = resume(p, s, tables, history, flags, outs[r], shared)


def available_threads() -> int:
    """Cores this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else (os.cpu_count() or 1)


def _spans(ticks: Floats, threads: int) -> list[tuple[int, int]]:
    """Cut the rows into pieces of about equal work, several for each thread."""
    work = np.cumsum(ticks)
    size = min(CHUNK_TICKS, max(float(work[-1]) / (8 * threads), 1.0))
    cuts = np.unique(np.searchsorted(work, np.arange(size, work[-1], size), side="right"))
    edges = [0, *(int(c) for c in cuts if 0 < c < ticks.size), int(ticks.size)]
    return list(pairwise(edges))
