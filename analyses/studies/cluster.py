"""A Dask cluster: connecting to one, starting one here, computing parts on it.

Whoever can talk to a Dask scheduler can run code on it. The local cluster therefore listens on this machine
only, under TLS with certificates that are made for the run and never leave it, and shows no dashboard.
"""

from __future__ import annotations

import ipaddress
import logging
import signal
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import AbstractContextManager, contextmanager
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_lti.errors import InputError, NumericalError
from analyses.studies.proof import Proof, hold_against, packages_of, prove, prove_once

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

IN_FLIGHT = 3  # parts a worker that are under way or waiting to be written
CONNECT_S = 10.0
TLS_FILES = {"tls_ca_file": "ca.pem", "tls_client_cert": "cert.pem", "tls_client_key": "key.pem"}
PARTS = ("scheduler", "worker", "nanny")
_RETRIES = 20  # workers that may die over one part before the run gives up


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

    security = None
    if tls is not None:
        files = {key: tls / name for key, name in TLS_FILES.items()}
        for path in files.values():
            if not path.is_file():
                raise InputError("no such file; allowed: a certificate in PEM", where=str(path))
        keys = {key: str(path) for key, path in files.items()}
        security = distributed.Security(require_encryption=True, **keys)
    try:
        return distributed.Client(address, timeout=CONNECT_S, security=security)
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


def quiet() -> AbstractContextManager[None]:
    """What Dask would log of a lost connection is said in one line, by what is raised."""
    from distributed.utils import silence_logging_cmgr

    return silence_logging_cmgr(logging.CRITICAL + 1)


@contextmanager
def _closed_is_lost() -> Iterator[None]:
    """A client that its scheduler has left is asked for more: `CancelledError`, as for what it was asked."""
    from distributed.client import ClosedClientError

    try:
        yield
    except ClosedClientError as error:
        raise CancelledError from error


@_closed_is_lost()
def submit(
    client: Any, work: Callable[[Any], Any], todo: list[Any], sink: Callable[[Any, Any], None]
) -> None:
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
        sent = client.submit(_the_same, work, pure=False, retries=_RETRIES)  # lost with a worker, made again
    width = max(2, sum(client.nthreads().values())) * IN_FLIGHT
    waiting = iter(todo)
    parts: dict[str, Any] = {}

    def start(part: Any) -> Any:
        future = client.submit(_answered, sent, here, part, pure=False, retries=_RETRIES)
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


def _answered(work: Callable[[Any], Any], proof: Proof, part: Any) -> tuple[Any, Exception | None]:
    """The result or the error of a part: tried again is only what a dying worker took along.

    A worker proves itself before its first part, also one that has joined late.
    """
    try:
        prove_once(proof, packages_of(work), work)
        return work(part), None
    except Exception as error:  # noqa: BLE001 - raised again where it was asked for
        return None, error
