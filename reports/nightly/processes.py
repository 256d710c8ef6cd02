"""Jobs of a night, each in a process of its own; how many at once says `analyses.studies.engine`.

Such a process is ended when it takes too long or too much memory, and a job that kills it takes nobody along.
Its result comes home as an entry of the cache; a lost Dask worker's jobs are done again elsewhere.
"""

from __future__ import annotations

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
from pkgutil import resolve_name
from threading import Event, Thread, Timer
from typing import Any, BinaryIO, NamedTuple

from actuator_lti.errors import InputError
from analyses.studies.engine import Engine
from reports.arithmetic import ONE_THREAD  # the jobs themselves are what runs in parallel
from reports.nightly.cache import sealed
from reports.nightly.text import one_line

START_LIMIT_S = 180.0  # beside the limit of the job, whose clock is the process's own
END_S = 10.0
ALARM = getattr(signal, "SIGALRM", 0)
_CHILD = "import sys; from reports.nightly.processes import main; main(sys.argv[1], int(sys.argv[2]))"


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
        for task in tasks:
            sink(task, execute(limits.build, task.key, task.payload))
    else:
        with closing(Apart(limits)) as apart:
            engine.map(apart.build, tasks, sink)


class Apart:
    """Builds each task in a process of its own, here or where Dask has carried it."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._running: set[subprocess.Popen[bytes]] = set()
        self._closed = False

    def __reduce__(self) -> tuple[Any, ...]:
        """Carried to a worker, or on from one to the next, without what runs there."""
        return Apart, (self._limits,)

    def build(self, task: Task) -> Answer:
        late, start, limit_s = Event(), time.monotonic(), self._limits.time_limit_s * task.limits

        def too_late() -> None:
            late.set()
            process.kill()

        with tempfile.TemporaryFile() as said:
            process = self._started(said)
            clock = Timer(START_LIMIT_S + limit_s, too_late)
            clock.daemon = True
            clock.start()
            try:
                _say(process.stdin, (task.key, dict(task.payload), limit_s))
                answer: Answer = pickle.load(process.stdout)  # type: ignore[arg-type]
                return answer
            except (EOFError, OSError, pickle.UnpicklingError, ValueError):
                with suppress(subprocess.TimeoutExpired):
                    process.wait(END_S)  # it ends by itself, and its status says why
                end = _end(process, said, late.is_set(), limit_s)
                return end._replace(seconds=time.monotonic() - start)
            finally:
                clock.cancel()
                self._ended(process)

    def _started(self, said: BinaryIO) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", _CHILD, self._limits.build, str(self._limits.memory_bytes)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=said,
            env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )  # fmt: skip
        self._running.add(process)
        if self._closed:
            process.kill()
        return process

    def _ended(self, process: subprocess.Popen[bytes]) -> None:
        process.kill()
        process.wait()
        self._running.discard(process)
        for stream in filter(None, (process.stdin, process.stdout)):
            with suppress(OSError):  # a question that nobody has read
                stream.close()

    def close(self) -> None:
        """End all processes; a thread that awaits an answer then has the end of its process."""
        self._closed = True
        for process in list(self._running):
            process.kill()
            process.wait()


def _end(process: subprocess.Popen[bytes], said: BinaryIO, late: bool, limit_s: float) -> Answer:
    """How a process ended that gave no answer, with its last words."""
    code = process.poll()
    if late or code == -ALARM:
        return Answer("timeout", f"did not end within {limit_s:g} s")
    size = said.seek(0, os.SEEK_END)
    said.seek(max(0, size - 2000))
    how = "does not end" if code is None else f"signal {-code}" if code < 0 else f"status {code}"
    return Answer("crash", f"its process ended ({how})", said.read().decode("latin-1"))


# ---- the side of the process ---------------------------------------------------------------------------


def main(build: str, memory_bytes: int) -> None:
    """Read ``(key, payload, limit)`` from standard input, build within it, answer on standard output."""
    if sys.platform == "linux":  # the system ends this process with its parent, in whatever build it is
        import ctypes

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a build prints is no answer
    _limit_memory(memory_bytes)
    resolve_name(build)
    key, payload, limit_s = pickle.load(sys.stdin.buffer)
    Thread(target=_end_with_parent, daemon=True).start()
    if ALARM:
        signal.signal(ALARM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, limit_s)
    _say(answers, execute(build, key, payload))


def _end_with_parent() -> None:
    os.read(0, 1)  # nothing more is asked: the end of the pipe is that of the parent
    os._exit(0)


def execute(build: str, key: str, payload: Mapping[str, Any]) -> Answer:
    """Build one report; its entry, or what went wrong and where, and how long it took.

    Any error of the build belongs to its design and is reported as such.
    """
    function, start = resolve_name(build), time.monotonic()
    return _executed(function, key, payload)._replace(seconds=time.monotonic() - start)


def _executed(function: Callable[..., Any], key: str, payload: Mapping[str, Any]) -> Answer:
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


def _limit_memory(limit_bytes: int) -> None:
    """Bound what this process may allocate; beyond it Python raises MemoryError, others give up.

    Counted is what can be written to (heap, stacks, private mappings), not files and code that are mapped.
    """
    with suppress(ImportError):  # Windows has no such limit
        import resource

        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        most = limit_bytes if hard == resource.RLIM_INFINITY else min(limit_bytes, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
