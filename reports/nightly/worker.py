"""The other side of the pool: a process that builds one report after the other."""

from __future__ import annotations

import importlib
import os
import signal
import threading
import traceback
from collections.abc import Callable
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from actuator_lti.errors import InputError
from reports.nightly.cache import Cache
from reports.nightly.limits import die_with_parent, limit_memory
from reports.nightly.text import one_line

# A worker that hangs in compiled code without its parent is ended by the system this long after its limit.
GRACE_S = 15


def resolve(name: str) -> Callable[..., Any]:
    """Return the function that ``package.module:function`` names."""
    module, _, function = name.partition(":")
    return getattr(importlib.import_module(module), function)


def main(connection: Connection, build: str, cache: Path, memory_bytes: int) -> None:
    """Receive ``(key, payload, limit)``, build, store, answer; ends with the pipe or the parent."""
    _end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    limit_memory(memory_bytes)
    function = resolve(build)
    store = Cache(cache)
    connection.send(("ready", "", ""))
    while True:
        try:
            task = connection.recv()
        except (EOFError, OSError):
            return
        if task is None:
            return
        key, payload, time_limit_s = task
        _alarm(time_limit_s + GRACE_S)
        connection.send(execute(function, store, key, payload))
        _alarm(0)


def execute(
    function: Callable[..., Any], store: Cache, key: str, payload: dict[str, Any]
) -> tuple[str, str, str]:
    """Build one report and store it; ``("done", "", "")``, or what went wrong and where.

    Any error of the build belongs to its design and is reported as such; errors of the disk are not.
    """
    try:
        meta, files = function(payload)
    except InputError as error:
        return ("error", one_line(str(error), 600), "")
    except MemoryError:
        return ("error", "needs more memory than a job may take: see --memory-limit", "")
    except Exception as error:  # noqa: BLE001 - the one place where a design may raise anything
        where = "".join(traceback.format_exception(error)[-6:])
        return ("error", f"{type(error).__name__}: {one_line(str(error), 400)}", where[-4000:])
    try:
        store.write(key, meta, files)
    except InputError as error:
        return ("disk", one_line(str(error), 400), "")
    except (TypeError, ValueError) as error:
        return ("error", f"result is no JSON: {one_line(str(error), 300)}", "")
    return ("done", "", "")


def _alarm(seconds: float) -> None:
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
    die_with_parent()
