"""Work that falls into parts, computed here, on a local Dask cluster, or on one that is already there.

Parts are chunks of a numbered study (`Engine.run`) or any items (`Engine.map`). What comes of a part must not
depend on where it is computed; results come in any order and are given to a sink one by one, so that memory
holds only a few, whatever their number.

Whoever can talk to a Dask scheduler can run code on it. The local cluster therefore listens on this machine
only, under TLS with certificates that are made for the run and never leave it, and shows no dashboard.
"""

from __future__ import annotations

import ipaddress
import logging
import os
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.extras import need
from analyses.proof import Proof, hold_against, packages_of, prove, prove_once

if TYPE_CHECKING:
    from distributed import Client, LocalCluster
    from distributed.security import Security

Chunk = tuple[int, int]
Arrays = dict[str, np.ndarray]
Progress = Callable[[int, int], None]
Item = TypeVar("Item")
Part = TypeVar("Part", covariant=True)
Result = TypeVar("Result")
_IN_FLIGHT = 3  # parts a worker that are under way or waiting to be written
CONNECT_S = 10.0
_RETRIES = 20  # workers that may die over one part before the run gives up
_TLS_FILES = {"tls_ca_file": "ca.pem", "tls_client_cert": "cert.pem", "tls_client_key": "key.pem"}


class Task(Protocol[Part]):
    """What is evaluated for numbers first to first + count - 1."""

    def evaluate(self, first: int, count: int) -> Part:
        """What they come to: columns by name, each of shape (count,), say."""


@dataclass(frozen=True)
class Engine:
    """Where parts are computed.

    Attributes
    ----------
    workers : int or None
        Processes of a local Dask cluster; ``None`` for none.
    scheduler : str or None
        Address of a running Dask scheduler, such as ``tls://host:8786``.
    tls : Path or None
        Folder with ca.pem, cert.pem and key.pem for that scheduler.
    threads : int or None
        Threads in this process when neither is given; all processors by default.
    """

    workers: int | None = None
    scheduler: str | None = None
    threads: int | None = None
    tls: Path | None = None

    @property
    def caution(self) -> str:
        """What to know of the connection before it is used; empty where nothing."""
        scheme, _, rest = (self.scheduler or "tls://").rpartition("://")
        host = rest.rpartition(":")[0].strip("[]")
        if scheme not in ("", "tcp") or host == "localhost" or _is_loopback(host):
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
        if self.tls is not None and not (self.scheduler or "").startswith("tls://"):
            raise InputError("--tls: goes with --scheduler tls://HOST:PORT")
        if self.tls is None and (self.scheduler or "").startswith("tls://"):
            raise InputError(
                f"--scheduler {self.scheduler}: needs --tls DIR with {', '.join(_TLS_FILES.values())}"
            )

    @property
    def distributed(self) -> bool:
        """Whether parts go to other processes."""
        return self.workers is not None or self.scheduler is not None

    def run(
        self,
        task: Task[Result],
        chunks: Iterable[Chunk],
        sink: Callable[[Chunk, Result], None],
        progress: Progress | None = None,
    ) -> None:
        """Evaluate every chunk once and give each result to the sink, in any order.

        Raises
        ------
        NumericalError
            If workers keep dying, or the scheduler cannot be reached or is lost.
        InputError
            If a worker computes otherwise than this process (`analyses.proof`).
        """
        todo = list(chunks)
        counted = _Counted(progress, sum(count for _, count in todo))

        def take(chunk: Chunk, part: Result) -> None:
            sink(chunk, part)
            counted.add(chunk[1])

        self._each(_evaluate, task, todo, take)

    def map(
        self,
        work: Callable[[Item], Result],
        items: Sequence[Item],
        sink: Callable[[Item, Result], None],
        progress: Progress | None = None,
    ) -> None:
        """Apply a function of a module to every item once, each result to the sink, in any order.

        Raises
        ------
        NumericalError
            As `run`; whatever the work raises goes its way.
        """
        counted = _Counted(progress, len(items))

        def take(item: Item, result: Result) -> None:
            sink(item, result)
            counted.add(1)

        self._each(_applied, work, list(items), take)

    def _each(
        self, call: Callable[[Any, Any], Any], held: Any, todo: list[Any], sink: Callable[[Any, Any], None]
    ) -> None:
        """Give ``call(held, part)`` of every part to the sink."""
        if not todo:
            return
        if not self.distributed:
            _threads(partial(call, held), todo, sink, self.threads or os.cpu_count() or 1)
            return
        finished = False
        try:
            with self._client() as client:
                _submit(client, call, held, todo, sink)
                finished = True
        except (OSError, TimeoutError, CancelledError) as error:
            if isinstance(error, InputError):
                raise
            if not finished:  # a cluster too slow to close takes no result back
                lost = isinstance(error, CancelledError)
                said = (
                    "the connection is lost" if lost else " ".join(str(error).split()) or "no answer in time"
                )
                raise NumericalError(
                    f"Dask scheduler {self.scheduler or 'here'}: {said}; what is done is kept: the same"
                    " command goes on with it, on this scheduler or another"
                ) from error

    @contextmanager
    def _client(self) -> Iterator[Client]:
        need("distributed", "cluster", "a cluster of workers")
        import distributed

        if self.scheduler is not None:
            with _quiet(), _connected(self.scheduler, self.tls) as client:
                yield client
            return
        with _quiet(), _local_cluster(self.workers or 1) as cluster, distributed.Client(cluster) as client:
            yield client


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _connected(address: str, tls: Path | None) -> Client:
    """Connect to a running scheduler.

    Raises
    ------
    InputError
        If the address is none, or a certificate cannot be used.
    """
    import ssl

    import distributed

    security = None if tls is None else _security(tls)
    try:
        return distributed.Client(address, timeout=CONNECT_S, security=security)
    except ssl.SSLError as error:
        raise InputError(
            f"--tls {tls}: {error.reason or error}: certificates that fit the scheduler"
        ) from error
    except ValueError as error:
        raise InputError(f"--scheduler {address!r}: an address such as tcp://host:8786") from error


def _security(folder: Path) -> Security:
    """The certificates of a folder."""
    from distributed.security import Security

    files = {key: folder / name for key, name in _TLS_FILES.items()}
    for path in files.values():
        if not path.is_file():
            raise InputError("no such file; allowed: a certificate in PEM", where=str(path))
    return Security(require_encryption=True, **{key: str(path) for key, path in files.items()})


def _local_cluster(workers: int) -> LocalCluster:
    """Start worker processes that leave Ctrl-C to this one: each would print its own traceback."""
    from multiprocessing import resource_tracker

    import dask
    import distributed
    from distributed.security import Security

    resource_tracker.ensure_running()  # its start would take the mask away again
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # what is started now inherits it
    settings: dict[str, Any] = {
        f"distributed.{part}.http.routes": [] for part in ("scheduler", "worker", "nanny")
    }
    settings["distributed.nanny.pre-spawn-environ"] = {}  # workers add up as this process does
    try:
        with dask.config.set(settings):
            return distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                protocol="tls://",
                security=Security.temporary(),
                dashboard_address=None,
                scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # or it asks for 8787, and warns
                silence_logs=50,
            )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)


@contextmanager
def _quiet() -> Iterator[None]:
    """What Dask would log of a lost connection is said in one line, by what is raised."""
    import distributed  # noqa: F401 - sets its handlers up

    names = [
        "distributed",
        *(name for name in logging.root.manager.loggerDict if name.startswith("distributed.")),
    ]
    handlers = {handler for name in names for handler in logging.getLogger(name).handlers}
    before = {handler: handler.level for handler in handlers}
    for handler in handlers:
        handler.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for handler, level in before.items():
            handler.setLevel(level)


@dataclass
class _Counted:
    """Reports how much is done."""

    progress: Progress | None
    total: int
    done: int = 0

    def add(self, count: int) -> None:
        self.done += count
        if self.progress is not None:
            self.progress(self.done, self.total)


def _threads(
    call: Callable[[Any], Any], todo: list[Any], sink: Callable[[Any, Any], None], threads: int
) -> None:
    """Compute in threads of this process (the compiled parts run without the interpreter's lock)."""
    waiting = iter(todo)
    pool = ThreadPoolExecutor(threads)
    try:
        running = {pool.submit(call, part): part for part in islice(waiting, threads * _IN_FLIGHT)}
        while running:
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in sorted(finished, key=lambda one: one.exception() is not None):  # keep the good
                sink(running.pop(future), future.result())
                for part in islice(waiting, 1):
                    running[pool.submit(call, part)] = part
    finally:
        pool.shutdown(wait=False, cancel_futures=True)  # who holds a part that never ends can end it now


def _submit(
    client: Any, call: Callable[[Any, Any], Any], held: Any, todo: list[Any], sink: Callable[[Any, Any], None]
) -> None:
    """Compute on a Dask cluster, with a few parts a worker under way; a lost worker's parts run again."""
    import distributed

    client.wait_for_workers(1, timeout=30)
    packages = packages_of(held)
    here = prove(packages)
    for address, there in client.run(prove, packages, on_error="return").items():
        hold_against(here, there, address)
    here = prove(packages, held)
    sent = client.scatter(held, broadcast=True, hash=False)
    width = max(2, sum(client.nthreads().values())) * _IN_FLIGHT
    waiting = iter(todo)
    parts: dict[str, Any] = {}

    def start(part: Any) -> Any:
        future = client.submit(_answered, call, sent, here, part, pure=False, retries=_RETRIES)
        parts[future.key] = part
        return future

    running = distributed.as_completed([start(part) for part in islice(waiting, width)])
    for future in running:
        result, error = future.result()
        future.release()
        if error is not None:
            raise error
        sink(parts.pop(future.key), result)
        for following in islice(waiting, 1):
            running.add(start(following))


def _answered(
    call: Callable[[Any, Any], Any], held: Any, proof: Proof, part: Any
) -> tuple[Any, Exception | None]:
    """The result or the error of a part: tried again is only what a dying worker took along.

    A worker proves itself before its first part, also one that has joined late.
    """
    try:
        prove_once(proof, packages_of(held), held)
        return call(held, part), None
    except Exception as error:  # noqa: BLE001 - raised again where it was asked for
        return None, error


def _evaluate(task: Task[Result], chunk: Chunk) -> Result:
    return task.evaluate(*chunk)


def _applied(work: Callable[[Any], Any], item: Any) -> Any:
    return work(item)
