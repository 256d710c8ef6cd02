"""Work that falls into parts, computed here, on a local Dask cluster, or on one that is already there.

What comes of a part must not depend on where it is computed; results go to a sink one by one, in any order.

Whoever can talk to a Dask scheduler can run code on it. The local cluster therefore listens on this machine
only, under TLS with certificates that are made for the run and never leave it, and shows no dashboard.
"""

from __future__ import annotations

import ipaddress
import logging
import os
import signal
import warnings
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
from actuator_lti.types import Progress
from analyses.studies.proof import Proof, hold_against, packages_of, prove, prove_once

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

IN_FLIGHT = 3  # parts a worker that are under way or waiting to be written
CONNECT_S = 10.0
TLS_FILES = {"tls_ca_file": "ca.pem", "tls_client_cert": "cert.pem", "tls_client_key": "key.pem"}
PARTS = ("scheduler", "worker", "nanny")
Work = Callable[[Any], Any]
Sink = Callable[[Any, Any], None]  # of a part and what comes of it


def is_open(address: str) -> bool:
    """Whether others than this machine may reach an address, and nobody is asked who he is."""
    scheme, _, rest = address.rpartition("://")
    host = rest.rpartition(":")[0].strip("[]")
    if scheme not in ("", "tcp") or host in ("", "localhost"):
        return False
    try:
        return not ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name
        return True


def connected(address: str, tls: Path | None) -> Client:
    """Connect to a running scheduler; an address that is none, or a certificate of no use, is refused."""
    import ssl

    import distributed

    class Client(distributed.Client):
        """Closed at once where it cannot connect: collected while another starts, it would wait for ever."""

        def start(self, **settings: Any) -> None:
            try:
                super().start(**settings)
            except BaseException:
                self.close()
                raise

    security = None
    if tls is not None:
        files = {key: tls / name for key, name in TLS_FILES.items()}
        for path in files.values():
            if not path.is_file():
                raise InputError("no such file; allowed: a certificate in PEM", where=str(path))
        keys = {key: str(path) for key, path in files.items()}
        security = distributed.Security(require_encryption=True, **keys)
    try:
        return Client(address, timeout=CONNECT_S, security=security)
    except ssl.SSLError as error:
        said = f"--tls {tls}: {error.reason or error}: certificates that fit the scheduler"
        raise InputError(said) from error
    except ValueError as error:
        raise InputError(f"--scheduler {address!r}: an address such as tcp://host:8786") from error


def local_cluster(workers: int) -> LocalCluster:
    """Start worker processes that leave Ctrl-C to this one: each would print its own traceback."""
    from multiprocessing import resource_tracker

    import dask
    import distributed

    resource_tracker.ensure_running()  # its start would take the mask away again
    held = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # what is started now inherits it
    settings: dict[str, Any] = {f"distributed.{part}.http.routes": [] for part in PARTS}
    settings["distributed.nanny.pre-spawn-environ"] = {}  # workers add up as this process does
    try:
        with dask.config.set(settings):
            return distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                protocol="tls://",
                security=distributed.Security.temporary(),
                dashboard_address=None,
                scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # or it asks for 8787, and warns
                silence_logs=50,
            )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, held)


def submit(client: Any, work: Work, todo: list[Any], sink: Sink) -> None:
    """Compute on a Dask cluster, with a few parts a worker under way; a lost worker's parts run again."""
    import distributed

    client.wait_for_workers(1, timeout=30)
    packages = packages_of(work)
    here = prove(packages)
    for address, there in client.run(prove, packages, on_error="return").items():
        if not isinstance(there, OSError):  # gone: who takes its place proves itself before its first part
            hold_against(here, there, address)
    here = prove(packages, work)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sending large graph")  # a table of samples goes once
        sent = client.submit(_the_same, work, pure=False)  # lost with a worker, made again
    width = max(2, sum(client.nthreads().values())) * IN_FLIGHT
    waiting = iter(todo)
    parts: dict[str, Any] = {}

    def start(part: Any) -> Any:
        future = client.submit(_answered, sent, here, part, pure=False)
        parts[future.key] = part
        return future

    running = distributed.as_completed([start(part) for part in islice(waiting, width)])
    for future in running:
        try:
            result, error = future.result()
        except distributed.KilledWorker as death:
            raise NumericalError(
                "workers keep dying over one part, of too little memory, say; what is done is kept"
            ) from death
        future.release()
        if error is not None:
            raise error
        sink(parts.pop(future.key), result)
        for following in islice(waiting, 1):
            running.add(start(following))


def _the_same(work: Any) -> Any:
    return work


def _answered(work: Work, proof: Proof, part: Any) -> tuple[Any, Exception | None]:
    """The result or the error of a part; a worker proves itself before its first, whenever it joined."""
    try:
        prove_once(proof, packages_of(work), work)
        return work(part), None
    except Exception as error:  # noqa: BLE001 - raised again where it was asked for
        return None, error


Chunk = tuple[int, int]
Arrays = dict[str, np.ndarray]
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
        if self.scheduler is None or not is_open(self.scheduler):
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
            files = ", ".join(TLS_FILES.values())
            raise InputError(f"--scheduler {self.scheduler}: needs --tls DIR with {files}")

    @property
    def distributed(self) -> bool:
        return self.workers is not None or self.scheduler is not None

    def map(
        self, work: Callable[[Item], Result], items: Iterable[Item], sink: Callable[[Item, Result], None],
        progress: Progress = None, size: Callable[[Item], int] = lambda _: 1,
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
        need("distributed", "cluster", "a cluster of workers")
        from distributed.client import ClosedClientError  # what a client says that its scheduler has left

        finished = False
        try:
            with self._client() as client:
                submit(client, work, todo, take)
                finished = True
        except (OSError, CancelledError, ClosedClientError) as error:
            if not finished:  # a cluster too slow to close takes no result back
                said = " ".join(str(error).split()) or "no answer in time"
                if not isinstance(error, OSError):
                    said = "the connection is lost"
                raise NumericalError(
                    f"Dask scheduler {self.scheduler or 'here'}: {said}; what is done is kept: the same"
                    " command goes on with it, on this scheduler or another"
                ) from error

    @contextmanager
    def _client(self) -> Iterator[Client]:
        import distributed
        from distributed.utils import silence_logging_cmgr

        with ExitStack() as stack:
            stack.enter_context(silence_logging_cmgr(logging.CRITICAL + 1))  # what is raised says it
            if self.scheduler is not None:
                yield stack.enter_context(connected(self.scheduler, self.tls))
            else:
                here = stack.enter_context(local_cluster(self.workers or 1))
                yield stack.enter_context(distributed.Client(here))


def _threads(work: Work, todo: list[Any], sink: Sink, threads: int) -> None:
    """Compute in threads of this process (the compiled parts run without the interpreter's lock)."""
    waiting = iter(todo)
    pool = ThreadPoolExecutor(threads)
    try:
        running = {pool.submit(work, part): part for part in islice(waiting, threads * IN_FLIGHT)}
        while running:
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in sorted(finished, key=lambda one: one.exception() is not None):  # keep the good
                sink(running.pop(future), future.result())
                for part in islice(waiting, 1):
                    running[pool.submit(work, part)] = part
    finally:
        pool.shutdown(wait=False, cancel_futures=True)  # who holds a part that never ends can end it now
