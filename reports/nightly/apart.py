"""Jobs of a night, each in a process that can be ended; how many at once says `analyses.studies.engine`.

A process of its own can be ended when it takes too long or too much memory, and a job that kills it takes
nobody along. Here the processes stay warm from job to job, on a Dask cluster each job has a fresh one. Its
result comes home as an entry of the cache; a lost Dask worker's jobs are done again elsewhere.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from functools import partial
from threading import Lock, Timer
from typing import Any, NamedTuple

from analyses.studies.engine import Engine
from reports.arithmetic import ONE_THREAD  # the jobs themselves are what runs in parallel
from reports.nightly import worker
from reports.nightly.worker import Answer

START_LIMIT_S = 180.0
END_S = 10.0
_CHILD = "import sys; from reports.nightly.worker import main; main(sys.argv[1], int(sys.argv[2]))"


class Task(NamedTuple):
    """Something to build: an address, what the build function gets, and how many time limits it may take."""

    key: str
    payload: Mapping[str, Any]
    limits: int = 1


class Limits(NamedTuple):
    """What builds a task, ``module:function`` from a payload to ``(meta, files)``, and what it may take."""

    build: str
    time_limit_s: float
    memory_bytes: int


def build_each(
    tasks: Sequence[Task], limits: Limits, engine: Engine | None, sink: Callable[[Task, Answer], None]
) -> None:
    """Build every task once and tell how each ended, in the order in which they end.

    Without an engine they are built in this process: with no limit, and in the order of the tasks.
    """
    if engine is None:
        function = worker.resolve(limits.build)
        for task in tasks:
            start = time.monotonic()
            sink(task, _since(start, worker.execute(function, task.key, task.payload)))
    elif engine.distributed:
        engine.map(partial(build_apart, limits), tasks, sink)
    else:
        with closing(_Warm(limits)) as warm:
            engine.map(warm.build, tasks, sink)


def build_apart(limits: Limits, task: Task) -> Answer:
    """Build one task in a process of its own."""
    with closing(_Child(limits)) as child:
        return child.build(task)


class _Child:
    """A process that builds one task after the other, seen from its parent."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        self._late = self._ready = False
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", _CHILD, limits.build, str(limits.memory_bytes)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said,
            env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )  # fmt: skip

    def build(self, task: Task) -> Answer:
        """Build a task within its time; where that fails the process is at its end."""
        if not self._ready:
            self._ready = self._answer(START_LIMIT_S) == worker.READY
            if not self._ready:
                why = f"the worker process could not start: {self._end(START_LIMIT_S)}"
                return Answer("crash", why, self._last_words(0))
        said, start = os.fstat(self._said.fileno()).st_size, time.monotonic()
        limit_s = self._limits.time_limit_s * task.limits
        answer = self._answer(limit_s, (task.key, dict(task.payload), limit_s))
        if answer is None and self._late:
            answer = Answer("timeout", self._end(limit_s))
        elif answer is None:
            answer = Answer("crash", self._end(limit_s), self._last_words(said))
        return _since(start, answer)

    def _answer(self, limit_s: float, question: Any = None) -> Any:
        """What the process says within the limit; None where it ends instead."""
        ask, listen = self._process.stdin, self._process.stdout
        assert ask is not None
        assert listen is not None
        clock = Timer(limit_s, self._too_late)
        clock.daemon = True
        clock.start()
        try:
            if question is not None:
                pickle.dump(question, ask)
                ask.flush()
            return pickle.load(listen)
        except (EOFError, OSError, pickle.UnpicklingError, ValueError):
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(END_S)  # it ends by itself, and its status says why
            self.end()
            return None
        finally:
            clock.cancel()
            clock.join()  # from here on it ends nobody

    def _too_late(self) -> None:
        self._late = True
        self._process.kill()

    def _end(self, limit_s: float) -> str:
        """In words how the process ended."""
        if self._late:
            return f"did not end within {limit_s:g} s"
        code = self._process.returncode
        return f"its process ended ({f'signal {-code}' if code < 0 else f'status {code}'})"

    def _last_words(self, since: int) -> str:
        size = self._said.seek(0, os.SEEK_END)
        self._said.seek(max(since, size - 2000))
        return self._said.read().decode("latin-1")

    @property
    def alive(self) -> bool:
        """Whether it can take another task."""
        return not self._late and self._process.poll() is None

    def end(self) -> None:
        """End the process, whatever it does."""
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """End the process and give back its pipes; not while another thread waits for its answer."""
        self.end()
        for stream in (self._process.stdin, self._process.stdout, self._said):
            if stream is not None:
                with suppress(OSError):  # a question that nobody has read
                    stream.close()


class _Warm:
    """Processes that go from task to task: one for each that is under way."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._lock = Lock()
        self._idle: list[_Child] = []
        self._busy: list[_Child] = []
        self._closed = False

    def build(self, task: Task) -> Answer:
        """Build a task in an idle process, or in a new one."""
        with self._lock:
            if self._closed:
                raise RuntimeError("no task after the end")
            child = next((one for one in self._idle if one.alive), None)
            if child is None:
                child = _Child(self._limits)
            else:
                self._idle.remove(child)
            self._busy.append(child)
        try:
            return child.build(task)
        finally:
            with self._lock:
                self._busy.remove(child)
                if child.alive and not self._closed:
                    self._idle.append(child)
                else:
                    child.close()

    def close(self) -> None:
        """End all processes, also one whose answer is awaited: its thread then has its end."""
        with self._lock:
            self._closed = True
            for child in self._busy:
                child.end()
            for child in self._idle:
                child.close()


def _since(start: float, answer: Answer) -> Answer:
    return answer._replace(seconds=time.monotonic() - start)
