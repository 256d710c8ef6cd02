"""Many runs at once over the cores: different designs, commands and parameters, reduced as they run.

`simulate_many` takes `Run` objects; `nonlinear.rows.Rows` sets up thousands of runs by array arithmetic.

Every run is done by the same compiled function as `nonlinear.simulate`, by one thread, from its own row: the
numbers do not depend on the number of threads, nor on what else is in the batch.  A run needs no memory
for its ticks; it leaves ``layout.OUT_SIZE`` numbers.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from itertools import pairwise

import numpy as np

from actuator_lti.bounds import BATCH_TICKS
from actuator_lti.errors import InputError, TooManyTicks, shown, whole_number
from actuator_lti.types import Floats, Progress
from nonlinear._kernels import layout as at
from nonlinear.native import parameters, resume
from nonlinear.runs.reduced import BatchResult
from nonlinear.runs.running import Running
from nonlinear.runs.setup import Run, Tables

CHUNK_TICKS = 2_000_000  # ticks one thread does between two looks at the queue


def simulate_many(
    runs: Sequence[Run], *, threads: int | None = None, progress: Progress = None
) -> BatchResult:
    """Simulate many runs, each with its own design, command and reducers.

    ``threads``: by default the cores this process may use.
    ``progress``: called as ``progress(runs done, runs in all)``.

    The result has one entry a run, in order.  Runs that failed have a status that is not 0; look at it.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> from nonlinear import Reducers, Run, commands
    >>> design = load_design("ilr33-amber")
    >>> steps = [Run(design=design, command=commands.step(a), duration_s=0.2,
    ...              reducers=Reducers(step_target_rad=a)) for a in (0.01, 0.02)]
    >>> result = simulate_many(steps)
    >>> bool((result.step.rise_time_s < 0.1).all())
    True
    """
    if not runs:
        raise InputError(f"runs = {shown(runs)}: must be several, at least one")
    tables = Tables()
    rows = np.array([run.row(tables) for run in runs])
    return run_rows(rows, tables.joined(), threads=threads, progress=progress)


def run_rows(
    rows: Floats,
    tables: Floats,
    *,
    threads: int | None = None,
    progress: Progress = None,
    drives: Sequence[Running] | None = None,
) -> BatchResult:
    """Run parameter rows, shape (n, layout.SIZE), of `nonlinear.rows.Rows`.

    Each of ``drives``, one a row, goes on from where it is to the row's number of ticks.

    Raises `TooManyTicks`: if the runs have more ticks than can be computed in a reasonable time.
    """
    rows = np.ascontiguousarray(rows, dtype=float)
    ticks, n = float(rows[:, at.TICKS].sum()), len(rows)
    if not ticks <= BATCH_TICKS.most:
        raise TooManyTicks(f"{ticks:.3g} ticks to simulate; allowed: {BATCH_TICKS.allowed} in all runs")
    result = BatchResult(rows=rows, outs=np.empty((n, at.OUT_SIZE)), status=np.empty(n, np.int64))
    history, flags, shared, done = np.empty((0, 0)), np.empty(0, np.uint16), np.zeros(2), 0

    def run_span(start: int, stop: int) -> int:
        """Run rows start to stop in this thread, without the GIL; how many."""
        for r in range(start, stop):
            p, s = parameters(rows[r]) if drives is None else (drives[r].p, drives[r].s)
            p[at.TICKS] = rows[r, at.TICKS]
            result.status[r] = resume(p, s, tables, history, flags, result.outs[r], shared)
        return stop - start

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads = cores if threads is None else min(whole_number("threads", threads), n)
    spans = _spans(rows[:, at.TICKS], threads)
    if len(spans) == 1 and ticks <= CHUNK_TICKS:  # not worth a thread
        done = run_span(0, n)
        if progress is not None:
            progress(done, n)
        return result
    with ThreadPoolExecutor(max_workers=max(1, threads)) as pool:
        waiting = [pool.submit(run_span, *span) for span in spans]
        try:
            for future in as_completed(waiting):
                done += future.result()
                if progress is not None:
                    progress(done, n)
        except BaseException:
            shared[1] = 1.0  # stops the runs that are under way
            for future in waiting:
                future.cancel()
            raise
    return result


def _spans(ticks: Floats, threads: int) -> list[tuple[int, int]]:
    """Cut the rows into pieces of about equal work, several for each thread."""
    work = np.cumsum(ticks)
    size = min(CHUNK_TICKS, max(float(work[-1]) / (8 * threads), 1.0))
    cuts = np.unique(np.searchsorted(work, np.arange(size, work[-1], size), side="right"))
    edges = [0, *(int(c) for c in cuts if 0 < c < ticks.size), int(ticks.size)]
    return list(pairwise(edges))
