"""Chunks of a numbered study, computed here, on a local Dask cluster, or on one that is already there.

A task is a picklable object with ``evaluate(first, count) -> dict of arrays``; what it returns for a number
must not depend on the chunk that the number is in.  Results come back in any order and are given to a sink
one by one, so that memory holds only a few chunks, whatever their number.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from actuator_lti.errors import InputError, NumericalError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

Chunk = tuple[int, int]
Arrays = dict[str, np.ndarray]
Sink = Callable[[Chunk, Arrays], None]
Progress = Callable[[int, int], None]
_IN_FLIGHT = 3  # chunks a worker that are under way or waiting to be written
CONNECT_S = 10.0
_RETRIES = 20  # workers that may die over one chunk before the run gives up


class Task(Protocol):
    """What is evaluated for numbers first to first + count - 1."""

    def evaluate(self, first: int, count: int) -> Arrays:
        """Columns by name, each of shape (count,)."""


@dataclass(frozen=True)
class Engine:
    """Where chunks are computed.

    Attributes
    ----------
    workers : int or None
        Processes of a local Dask cluster; ``None`` for none.
    scheduler : str or None
        Address of a running Dask scheduler.
    threads : int or None
        Threads in this process when neither is given; all processors by default.
    """

    workers: int | None = None
    scheduler: str | None = None
    threads: int | None = None

    def __post_init__(self) -> None:
        if self.workers is not None and self.scheduler is not None:
            raise InputError("--workers and --scheduler: one of them")
        if self.workers is not None and self.workers < 1:
            raise InputError(f"--workers {self.workers}: at least 1")

    def run(self, task: Task, chunks: Iterable[Chunk], sink: Sink, progress: Progress | None = None) -> None:
        """Evaluate every chunk once and give each result to the sink, in any order.

        Raises
        ------
        NumericalError
            If workers keep dying, or the scheduler cannot be reached.
        """
        todo = list(chunks)
        if not todo:
            return
        counted = _Counted(sink, progress, sum(count for _, count in todo))
        if self.workers is None and self.scheduler is None:
            _threads(task, todo, counted, self.threads or os.cpu_count() or 1)
        else:
            self._dask(task, todo, counted)

    def _dask(self, task: Task, todo: list[Chunk], sink: _Counted) -> None:
        import distributed

        try:
            if self.scheduler is not None:
                with _connected(self.scheduler) as client:
                    _submit(client, task, todo, sink)
                return
            with _local_cluster(self.workers or 1) as cluster, distributed.Client(cluster) as client:
                _submit(client, task, todo, sink)
        except (OSError, TimeoutError) as error:
            raise NumericalError(f"Dask scheduler {self.scheduler or 'here'}: {error}") from error


def _connected(address: str) -> Client:
    """Connect to a running scheduler.

    Raises
    ------
    InputError
        If the address is none.
    """
    import distributed

    try:
        return distributed.Client(address, timeout=CONNECT_S)
    except ValueError as error:
        raise InputError(f"--scheduler {address!r}: an address such as tcp://host:8786") from error


def _local_cluster(workers: int) -> LocalCluster:
    """Start worker processes that leave Ctrl-C to this one: each would print its own traceback."""
    from multiprocessing import resource_tracker

    import distributed

    resource_tracker.ensure_running()  # its start would take the mask away again
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # what is started now inherits it
    try:
        return distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            silence_logs=50,
        )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)


@dataclass
class _Counted:
    """A sink that reports how many numbers are done."""

    sink: Sink
    progress: Progress | None
    total: int
    done: int = 0

    def __call__(self, chunk: Chunk, arrays: Arrays) -> None:
        self.sink(chunk, arrays)
        self.done += chunk[1]
        if self.progress is not None:
            self.progress(self.done, self.total)


def _threads(task: Task, todo: list[Chunk], sink: _Counted, threads: int) -> None:
    """Compute in threads of this process (the compiled parts run without the interpreter's lock)."""
    waiting = iter(todo)
    with ThreadPoolExecutor(threads) as pool:
        running = {
            pool.submit(task.evaluate, *chunk): chunk for chunk in islice(waiting, threads * _IN_FLIGHT)
        }
        try:
            while running:
                finished, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in finished:
                    sink(running.pop(future), future.result())
                    for chunk in islice(waiting, 1):
                        running[pool.submit(task.evaluate, *chunk)] = chunk
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _submit(client: Any, task: Task, todo: list[Chunk], sink: _Counted) -> None:
    """Compute on a Dask cluster, with a few chunks a worker under way; a lost worker's chunks run again."""
    import distributed

    client.wait_for_workers(1, timeout=30)
    _same_code(client)
    held = client.scatter(task, broadcast=True, hash=False)
    width = max(2, sum(client.nthreads().values())) * _IN_FLIGHT
    waiting: Iterator[Chunk] = iter(todo)

    def start(chunk: Chunk) -> Any:
        return client.submit(_evaluate, held, chunk, pure=False, retries=_RETRIES)

    running = distributed.as_completed([start(chunk) for chunk in islice(waiting, width)])
    for future in running:
        chunk, arrays = future.result()
        future.release()
        sink(chunk, arrays)
        for following in islice(waiting, 1):
            running.add(start(following))


def _evaluate(task: Task, chunk: Chunk) -> tuple[Chunk, Arrays]:
    return chunk, task.evaluate(*chunk)


def code_version() -> str:
    """Version and content hash of the code that computes samples: workers must have the same."""
    import hashlib
    from pathlib import Path

    import actuator_lti
    import nonlinear

    digest = hashlib.sha256()
    for package in (actuator_lti, nonlinear):
        folder = Path(package.__file__ or "").parent
        for path in sorted(folder.rglob("*.py")):
            digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _same_code(client: Any) -> None:
    """Refuse workers that run another version of the code."""
    here = code_version()
    others = {address: found for address, found in client.run(code_version).items() if found != here}
    if others:
        address = next(iter(others))
        raise InputError(f"worker {address} runs other code ({others[address]}, here {here})")
