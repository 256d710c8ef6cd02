"""Jobs of a night on a Dask cluster: each in a process of its own there, its result brought home.

A process of its own can be ended when it takes too long or too much memory, and a job that kills it does not
take the Dask worker along. A lost worker's jobs are done again elsewhere; what is finished is in the cache.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from threading import Thread

from actuator_lti.errors import InputError
from analyses.engine import Engine
from reports.nightly.cache import Cache, CorruptEntry
from reports.nightly.limits import die_with_parent, limit_memory
from reports.nightly.pool import ONE_THREAD, Done, Task, ended
from reports.nightly.worker import execute, resolve

_CHILD = "from reports.nightly.apart import child; child()"


class Cluster:
    """Build tasks on a Dask cluster; the counterpart of `reports.nightly.pool.Pool`.

    Parameters
    ----------
    build : str
        ``module:function``, as for the pool.
    cache : pathlib.Path
        Folder of the store, here; the workers need not see it.
    engine : Engine
    time_limit_s : float
    memory_limit_bytes : int
    """

    def __init__(
        self, build: str, cache: Path, engine: Engine, time_limit_s: float, memory_limit_bytes: int
    ) -> None:
        self._work = partial(build_apart, build, time_limit_s, memory_limit_bytes)
        self._store = Cache(cache)
        self._engine = engine

    def run(self, tasks: Sequence[Task]) -> Iterator[Done]:
        """Yield how each task ended, in the order in which they end; each is in the cache by then."""
        ends: SimpleQueue[Done | BaseException] = SimpleQueue()

        def keep(task: Task, answer: tuple[Done, bytes]) -> None:
            ends.put(self._kept(*answer))

        def work() -> None:
            try:
                self._engine.map(self._work, tasks, keep)
            except BaseException as error:  # noqa: BLE001 - raised in the thread that waits
                ends.put(error)

        Thread(target=work, daemon=True).start()
        for _ in tasks:
            end = ends.get()
            if isinstance(end, BaseException):
                raise end
            yield end

    def _kept(self, done: Done, entry: bytes) -> Done:
        if done.status != "done":
            return done
        try:
            self._store.take(done.key, entry)
        except InputError as error:
            return ended(done, "disk", str(error))
        except CorruptEntry as error:
            return ended(done, "crash", f"its result came damaged ({error})")
        return done


def build_apart(build: str, time_limit_s: float, memory_limit_bytes: int, task: Task) -> tuple[Done, bytes]:
    """Build one task in a process of its own; how it ended, and the entry for the cache."""
    start, limit_s = time.monotonic(), time_limit_s * task.limits
    question = pickle.dumps((build, memory_limit_bytes, task.key, dict(task.payload)))
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    status, message, detail, entry = "timeout", f"did not end within {limit_s:g} s", "", b""
    try:
        done = subprocess.run(
            [sys.executable, "-c", _CHILD],
            input=question, capture_output=True, timeout=limit_s, env=environment, check=False,
        )  # fmt: skip
        if done.returncode == 0:
            status, message, detail, entry = pickle.loads(done.stdout)
        else:
            how = f"signal {-done.returncode}" if done.returncode < 0 else f"status {done.returncode}"
            status, message, detail = (
                "crash",
                f"its process ended ({how})",
                done.stderr[-2000:].decode("latin-1"),
            )
    except subprocess.TimeoutExpired:
        pass
    seconds = time.monotonic() - start
    return Done(key=task.key, status=status, message=message, detail=detail, seconds=seconds), entry


def child() -> None:
    """The other side of `build_apart`: question on standard input, answer on standard output."""

    die_with_parent()
    answer_to = os.dup(1)
    os.dup2(2, 1)  # what a build prints is no answer
    build, memory, key, payload = pickle.load(sys.stdin.buffer)
    limit_memory(memory)
    with tempfile.TemporaryDirectory(prefix="nightly-") as folder:
        store = Cache(Path(folder))
        status, message, detail = execute(resolve(build), store, key, payload)
        entry = store.path(key).read_bytes() if status == "done" else b""
    with os.fdopen(answer_to, "wb") as answer:
        pickle.dump((status, message, detail, entry), answer)
