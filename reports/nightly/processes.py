"""Jobs of a night, each in a process that can be ended; how many at once says `analyses.studies.engine`.

A process of its own can be ended when it takes too long or too much memory, and a job that kills it takes
nobody along. Here a process a thread stays warm from job to job, on a Dask cluster each job has a fresh one.
Its result comes home as an entry of the cache; a lost Dask worker's jobs are done again elsewhere.
"""

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from functools import partial
from pkgutil import resolve_name
from queue import SimpleQueue
from threading import Lock, Thread, Timer, get_ident
from typing import Any, NamedTuple

from actuator_lti.errors import InputError
from actuator_lti.start.apart import apart, limit_memory
from analyses.studies.engine import Engine
from reports.nightly.cache import sealed
from reports.nightly.text import one_line

START_LIMIT_S = 180.0
END_S = 10.0
READY = b"ready"


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


class Answer(NamedTuple):
    """How a job ended: ``done`` with an entry for the cache, ``error``, ``timeout`` or ``crash``, and why."""

    status: str
    message: str = ""
    detail: str = ""
    entry: bytes = b""
    seconds: float = 0.0


def build_each(
    tasks: Sequence[Task], limits: Limits, engine: Engine | None, sink: Callable[[Task, Answer], None]
) -> None:
    """Build every task once and tell how each ended, in the order in which they end.

    Without an engine they are built in this process: with no limit, and in the order of the tasks.
    """
    if engine is None:
        function = resolve_name(limits.build)
        for task in tasks:
            start = time.monotonic()
            answer = execute(function, task.key, task.payload)
            sink(task, answer._replace(seconds=time.monotonic() - start))
    elif engine.distributed:
        engine.map(partial(build_apart, limits), tasks, sink)
    else:
        with closing(Warm(limits)) as warm:
            engine.map(warm.build, tasks, sink)


def build_apart(limits: Limits, task: Task) -> Answer:
    with closing(_Child(limits)) as child:
        return child.build(task)


# ---- the side of the night -----------------------------------------------------------------------------


class Warm:
    """Processes that go from task to task: one for each thread that asks."""

    def __init__(self, limits: Limits) -> None:
        self._limits, self._lock, self._closed = limits, Lock(), False
        self._children: dict[int, _Child] = {}

    def build(self, task: Task) -> Answer:
        """Build a task in the process of this thread, in a new one where that has ended."""
        with self._lock:
            if self._closed:
                raise RuntimeError("no task after the end")
            child = self._children.get(get_ident())
            if child is None or not child.alive:
                if child is not None:
                    child.close()
                child = self._children[get_ident()] = _Child(self._limits)
        return child.build(task)

    def close(self) -> None:
        """End all processes, also one whose answer is awaited: its thread then has its end."""
        with self._lock:
            self._closed = True
            for child in self._children.values():
                child.close()


class _Child:
    """A process that builds one task after the other, seen from its parent."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        self._late = self._ready = False
        self._asked = Lock()
        self._process = subprocess.Popen(
            **apart(f"{__name__}:main", limits.build, str(limits.memory_bytes)),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said,
        )  # fmt: skip

    @property
    def alive(self) -> bool:
        """Whether it can take another task."""
        return not self._late and self._process.poll() is None

    def build(self, task: Task) -> Answer:
        """Build a task within its time; where that fails the process is at its end."""
        with self._asked:
            if not self._ready:
                self._ready = self._answer(START_LIMIT_S) == READY
                if not self._ready:
                    why = f"the worker process could not start: {self._end(START_LIMIT_S)}"
                    return Answer("crash", why, self._last_words(0))
            said, start = os.fstat(self._said.fileno()).st_size, time.monotonic()
            limit_s = self._limits.time_limit_s * task.limits
            answer = self._answer(limit_s, (task.key, dict(task.payload)))
            if answer is None:
                last = "" if self._late else self._last_words(said)
                answer = Answer("timeout" if self._late else "crash", self._end(limit_s), last)
            return answer._replace(seconds=time.monotonic() - start)

    def _answer(self, limit_s: float, question: Any = None) -> Any:
        """What the process says within the limit; None where it ends instead."""
        clock = Timer(limit_s, self._too_late)
        clock.daemon = True
        clock.start()
        try:
            if question is not None:
                _say(self._process.stdin, question)
            return pickle.load(self._process.stdout)  # type: ignore[arg-type]
        except (EOFError, OSError, pickle.UnpicklingError, ValueError):
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(END_S)  # it ends by itself, and its status says why
            self._process.kill()
            self._process.wait()
            return None
        finally:
            clock.cancel()
            clock.join()  # from here on it ends nobody

    def _too_late(self) -> None:
        self._late = True
        self._process.kill()

    def _end(self, limit_s: float) -> str:
        if self._late:
            return f"did not end within {limit_s:g} s"
        code = self._process.returncode
        return f"its process ended ({f'signal {-code}' if code < 0 else f'status {code}'})"

    def _last_words(self, since: int) -> str:
        size = self._said.seek(0, os.SEEK_END)
        self._said.seek(max(since, size - 2000))
        return self._said.read().decode("latin-1")

    def close(self) -> None:
        """End the process, whatever it does; then whoever waits for its answer has none, and its pipes go."""
        self._process.kill()
        with self._asked, self._said, suppress(OSError), self._process:
            pass  # who leaves waits and closes; a question that nobody has read is no error


# ---- the side of the process ---------------------------------------------------------------------------


def main(build: str, memory_bytes: str) -> None:
    """Read ``(key, payload)`` from standard input, build, answer on standard output; never returns."""
    if sys.platform == "linux":  # the system ends this process with its parent, in whatever build it is
        import ctypes

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a build prints is no answer
    limit_memory(int(memory_bytes))
    questions: SimpleQueue[tuple[str, Mapping[str, Any]]] = SimpleQueue()
    source = os.fdopen(os.dup(0), "rb")

    def listen() -> None:
        """Hand on what is asked; the end of the pipe is that of the parent."""
        try:
            while True:
                questions.put(pickle.load(source))
        except EOFError:
            os._exit(0)

    Thread(target=listen, daemon=True).start()
    function = resolve_name(build)
    _say(answers, READY)
    while True:
        _say(answers, execute(function, *questions.get()))


def execute(function: Callable[..., Any], key: str, payload: Mapping[str, Any]) -> Answer:
    """Build one report; its entry, or what went wrong and where.

    Any error of the build belongs to its design and is reported as such.
    """
    try:
        meta, files = function(dict(payload))
    except InputError as error:
        return Answer("error", one_line(str(error), 600))
    except MemoryError:
        return Answer("error", "needs more memory than a job may take: see --memory-limit")
    except Exception as error:  # noqa: BLE001 - the one place where a design may raise anything
        where = "".join(traceback.format_exception(error)[-6:])
        return Answer("error", f"{type(error).__name__}: {one_line(str(error), 400)}", where[-4000:])
    try:
        return Answer("done", entry=sealed(key, meta, files))
    except (TypeError, ValueError) as error:
        return Answer("error", f"result is no JSON: {one_line(str(error), 300)}")


def _say(pipe: Any, what: Any) -> None:
    pickle.dump(what, pipe)
    pipe.flush()
