"""Work that falls into parts, computed here, on a local Dask cluster, or on one that is already there.

Parts are chunks of a numbered study, or any items. What comes of a part must not depend on where it is
computed; results come in any order and are given to a sink one by one, so that memory holds only a few,
whatever their number.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.start.extras import need
from analyses.studies import cluster

if TYPE_CHECKING:
    from distributed import Client

Chunk = tuple[int, int]
Arrays = dict[str, np.ndarray]
Progress = Callable[[int, int], None]
Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Engine:
    """Where parts are computed."""

    workers: int | None = None  # processes of a local Dask cluster
    scheduler: str | None = None  # one that is running, such as ``tls://host:8786``
    threads: int | None = None  # without either, of this process; all processors where left out
    tls: Path | None = None  # with a scheduler: folder with ca.pem, cert.pem and key.pem

    @property
    def caution(self) -> str:
        """What to know of the connection before it is used; empty where nothing."""
        if self.scheduler is None or not cluster.is_open(self.scheduler):
            return ""
        return (
            f"--scheduler {self.scheduler}: not encrypted, and whoever reaches it can run code on its workers"
            " and here; use tls:// with --tls"
        )

    def __post_init__(self) -> None:
        if self.workers is not None and self.scheduler is not None:
            raise InputError("--workers and --scheduler: one of them")
        if self.workers is not None and self.workers < 1:
            raise InputError(f"--workers {self.workers}: at least 1")
        encrypted = (self.scheduler or "").startswith("tls://")
        if self.tls is not None and not encrypted:
            raise InputError("--tls: goes with --scheduler tls://HOST:PORT")
        if self.tls is None and encrypted:
            files = ", ".join(cluster.TLS_FILES.values())
            raise InputError(f"--scheduler {self.scheduler}: needs --tls DIR with {files}")

    @property
    def distributed(self) -> bool:
        """Whether parts go to other processes."""
        return self.workers is not None or self.scheduler is not None

    def map(
        self, work: Callable[[Item], Result], items: Iterable[Item], sink: Callable[[Item, Result], None],
        progress: Progress | None = None, size: Callable[[Item], int] = lambda _: 1,
    ) -> None:  # fmt: skip
        """Apply a function of a module, or a task that is called like one, to every item once.

        Results go to the sink in any order; progress counts the sizes of the items.

        Raises `NumericalError`: if workers keep dying, or the scheduler cannot be reached or is lost.
        Raises `InputError`: if a worker computes otherwise than this process (`analyses.studies.proof`).
        """
        todo = list(items)
        if not todo:
            return
        done, total = 0, sum(map(size, todo))

        def take(item: Item, result: Result) -> None:
            nonlocal done
            sink(item, result)
            done += size(item)
            if progress is not None:
                progress(done, total)

        if not self.distributed:
            _threads(work, todo, take, self.threads or os.cpu_count() or 1)
            return
        finished = False
        try:
            with self._client() as client:
                cluster.submit(client, work, todo, take)
                finished = True
        except (OSError, CancelledError) as error:
            if not finished:  # a cluster too slow to close takes no result back
                said = " ".join(str(error).split()) or "no answer in time"
                if isinstance(error, CancelledError):
                    said = "the connection is lost"
                raise NumericalError(
                    f"Dask scheduler {self.scheduler or 'here'}: {said}; what is done is kept: the same"
                    " command goes on with it, on this scheduler or another"
                ) from error

    @contextmanager
    def _client(self) -> Iterator[Client]:
        need("distributed", "cluster", "a cluster of workers")
        import distributed

        with ExitStack() as stack:
            stack.enter_context(cluster.quiet())
            if self.scheduler is not None:
                yield stack.enter_context(cluster.connected(self.scheduler, self.tls))
            else:
                here = stack.enter_context(cluster.local_cluster(self.workers or 1))
                yield stack.enter_context(distributed.Client(here))


def _threads(
    call: Callable[[Any], Any], todo: list[Any], sink: Callable[[Any, Any], None], threads: int
) -> None:
    """Compute in threads of this process (the compiled parts run without the interpreter's lock)."""
    waiting = iter(todo)
    pool = ThreadPoolExecutor(threads)
    try:
        running = {pool.submit(call, part): part for part in islice(waiting, threads * cluster.IN_FLIGHT)}
        while running:
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in sorted(finished, key=lambda one: one.exception() is not None):  # keep the good
                sink(running.pop(future), future.result())
                for part in islice(waiting, 1):
                    running[pool.submit(call, part)] = part
    finally:
        pool.shutdown(wait=False, cancel_futures=True)  # who holds a part that never ends can end it now
