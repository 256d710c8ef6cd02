"""The other side of a job's process: it builds one report after the other until its parent is gone."""

from __future__ import annotations

import importlib
import os
import pickle
import signal
import sys
import traceback
from collections.abc import Callable, Mapping
from queue import SimpleQueue
from threading import Thread
from typing import Any, BinaryIO, NamedTuple

from actuator_lti.errors import InputError
from reports.nightly.cache import sealed
from reports.nightly.text import one_line

# A process that hangs in compiled code without its parent is ended by the system this long after its limit.
GRACE_S = 15
READY = b"ready"


class Answer(NamedTuple):
    """How a job ended: ``done`` with an entry for the cache, ``error``, ``timeout`` or ``crash``, and why."""

    status: str
    message: str = ""
    detail: str = ""
    entry: bytes = b""
    seconds: float = 0.0


def resolve(name: str) -> Callable[..., Any]:
    """Return the function that ``package.module:function`` names."""
    module, _, function = name.partition(":")
    return getattr(importlib.import_module(module), function)


def main(build: str, memory_bytes: int) -> None:
    """Read ``(key, payload, limit)`` from standard input, build, answer on standard output; never returns."""
    die_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a build prints is no answer
    limit_memory(memory_bytes)
    questions: SimpleQueue[tuple[str, Mapping[str, Any], float]] = SimpleQueue()
    Thread(target=_listen, args=(os.fdopen(os.dup(0), "rb"), questions), daemon=True).start()
    function = resolve(build)
    _say(answers, READY)
    while True:
        key, payload, time_limit_s = questions.get()
        _alarm(time_limit_s + GRACE_S)
        _say(answers, execute(function, key, payload))
        _alarm(0)


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


def _listen(source: BinaryIO, questions: SimpleQueue[Any]) -> None:
    """Hand on what is asked; the end of the pipe is that of the parent."""
    while True:
        try:
            questions.put(pickle.load(source))
        except EOFError:
            os._exit(0)


def _say(answers: BinaryIO, what: Any) -> None:
    pickle.dump(what, answers)
    answers.flush()


def _alarm(seconds: float) -> None:
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, seconds)


def limit_memory(limit_bytes: int) -> None:
    """Bound what this process may allocate; beyond it Python raises MemoryError, others give up.

    Counted is what can be written to (heap, stacks, private mappings), not files and code that are mapped.
    Systems without such a limit take no notice.
    """
    try:
        import resource
    except ImportError:  # not on Windows
        return
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    most = limit_bytes if hard == resource.RLIM_INFINITY else min(limit_bytes, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def die_with_parent() -> None:
    """Let the system end this process with its parent, also where a build never lets go (Linux)."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
