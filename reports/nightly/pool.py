"""Worker processes that stay warm, are ended when a job takes too long, and do not take each other down."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from actuator_lti.bounds import JOB_MEMORY
from reports.nightly import worker
from reports.nightly.cache import Cache

START_LIMIT_S = 180.0
# One thread a worker: the jobs themselves are what runs in parallel.
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


@dataclass(frozen=True, kw_only=True)
class Task:
    """Something to build: an address, what the build function gets, and how many time limits it may take."""

    key: str
    payload: Mapping[str, Any]
    limits: int = 1


@dataclass(frozen=True, kw_only=True)
class Done:
    """How a task ended: ``done``, ``error``, ``timeout``, ``crash`` or ``disk``."""

    key: str
    status: str
    message: str = ""
    detail: str = ""
    seconds: float = 0.0


@dataclass
class _Worker:
    process: multiprocessing.process.BaseProcess
    connection: Connection
    deadline: float
    started: float
    task: Task | None = None
    ready: bool = field(default=False)


class Pool:
    """Build tasks in ``workers`` processes.

    Parameters
    ----------
    build : str
        ``module:function``; gets a payload, returns ``(meta, files)`` (see `reports.nightly.cache`).
    cache : pathlib.Path
        Folder of the store that the workers write to.
    workers : int
        Number of processes; 0 builds in this process (no time limit then).
    time_limit_s : float
        A task that takes longer is ended, with its process.
    memory_limit_bytes : int
        A process that asks for more gets none; not where ``workers`` is 0.
    """

    def __init__(
        self,
        build: str,
        cache: Path,
        workers: int,
        time_limit_s: float,
        memory_limit_bytes: int = JOB_MEMORY.most,
    ) -> None:
        self._build = build
        self._cache = cache
        self._count = workers
        self._limit = time_limit_s
        self._memory = memory_limit_bytes
        self._workers: list[_Worker] = []
        self._context = multiprocessing.get_context("spawn")

    def run(self, tasks: Sequence[Task]) -> Iterator[Done]:
        """Yield how each task ended, in the order in which they end."""
        if self._count == 0:
            yield from self._inline(tasks)
            return
        queue = deque(tasks)
        try:
            self._workers = [self._start() for _ in range(min(self._count, len(tasks)))]
            for _ in range(len(tasks)):
                yield self._next(queue)
        finally:
            self._stop()

    def _inline(self, tasks: Sequence[Task]) -> Iterator[Done]:
        function = worker.resolve(self._build)
        for task in tasks:
            start = time.monotonic()
            status, message, detail = worker.execute(
                function, Cache(self._cache), task.key, dict(task.payload)
            )
            yield Done(
                key=task.key, status=status, message=message, detail=detail, seconds=time.monotonic() - start
            )

    def _start(self) -> _Worker:
        here, there = self._context.Pipe()
        before = {name: os.environ.get(name) for name in ONE_THREAD}
        os.environ.update(ONE_THREAD)
        try:
            process = self._context.Process(
                target=worker.main,
                args=(there, self._build, self._cache, self._memory),
                daemon=True,
            )
            process.start()
        finally:
            _restore(before)
        there.close()
        now = time.monotonic()
        return _Worker(process, here, deadline=now + START_LIMIT_S, started=now)

    def _next(self, queue: deque[Task]) -> Done:
        while True:
            busy = [w for w in self._workers if w.task is not None or not w.ready]
            pause = max(0.0, min(w.deadline for w in busy) - time.monotonic())
            events = wait([w.connection for w in busy] + [w.process.sentinel for w in busy], timeout=pause)
            for one in busy:
                done = self._look(one, events, queue)
                if done is not None:
                    return done

    def _look(self, one: _Worker, events: Sequence[Any], queue: deque[Task]) -> Done | None:
        """Handle what one worker has to say; the end of its task, if that is what it is."""
        if one.connection in events:
            try:
                status, message, detail = one.connection.recv()
            except (EOFError, OSError):
                return self._replace(one, queue, "crash")
            if status == "ready":
                one.ready = True
                self._give(one, queue)
                return None
            done = _finish(one, status, message, detail)
            self._give(one, queue)
            return done
        if one.process.sentinel in events:
            return self._replace(one, queue, "crash")
        if time.monotonic() >= one.deadline:
            return self._replace(one, queue, "timeout")
        return None

    def _give(self, one: _Worker, queue: deque[Task]) -> None:
        if not queue:
            one.deadline = float("inf")
            return
        task = queue.popleft()
        now = time.monotonic()
        one.task, one.started, one.deadline = task, now, now + self._limit * task.limits
        one.connection.send((task.key, dict(task.payload), self._limit * task.limits))

    def _replace(self, one: _Worker, queue: deque[Task], status: str) -> Done | None:
        """End a worker, put a fresh one in its place while there is work, and say what became of its task."""
        _kill(one)
        self._workers = [w for w in self._workers if w is not one]
        code = one.process.exitcode
        if status == "timeout":
            limit = START_LIMIT_S if one.task is None else self._limit * one.task.limits
            message = f"did not end within {limit:g} s"
        else:
            how = f"signal {-code}" if code is not None and code < 0 else f"status {code}"
            message = f"its process ended ({how})"
        if one.task is None:
            if not queue:
                return None
            one.task = queue.popleft()
            status, message = "crash", f"the worker process could not start: {message}"
        done = _finish(one, status, message, "")
        if queue:
            self._workers.append(self._start())
        return done

    def _stop(self) -> None:
        for one in self._workers:
            if one.task is None and one.ready and one.process.is_alive():
                try:
                    one.connection.send(None)
                except OSError:
                    continue
        for one in self._workers:
            one.process.join(0.5 if one.task is None and one.ready else 0.0)
            _kill(one)
        self._workers = []


def ended(done: Done, status: str, message: str) -> Done:
    """The same task with another end."""
    return replace(done, status=status, message=message)


def _finish(one: _Worker, status: str, message: str, detail: str) -> Done:
    task, one.task = one.task, None
    assert task is not None
    seconds = time.monotonic() - one.started
    return Done(key=task.key, status=status, message=message, detail=detail, seconds=seconds)


def _kill(one: _Worker) -> None:
    if one.process.is_alive():
        one.process.kill()
    one.process.join()
    one.connection.close()


def _restore(before: Mapping[str, str | None]) -> None:
    for name, value in before.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value
