"""One nightly at a time on a site: the second waits, or says who holds the lock."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes
from reports.nightly.text import now, one_line


@contextmanager
def hold(state: Path, wait_s: float = 0.0) -> Iterator[None]:
    """Hold the lock of a state folder; the system frees it when the process ends, however it ends.

    Where it is still held after ``wait_s``, the refusal names process, host and since when.
    """
    state.mkdir(parents=True, exist_ok=True)
    lock = FileLock(state / "nightly.lock")
    try:
        lock.acquire(timeout=wait_s)
    except Timeout as error:
        raise InputError(
            f"another nightly holds the lock: {holder(state)}; wait for it with --wait SECONDS",
            where=str(state),
        ) from error
    try:
        who = {"pid": os.getpid(), "host": socket.gethostname(), "since": now()}
        write_bytes(state / "holder.json", json.dumps(who).encode())
        yield
    finally:
        (state / "holder.json").unlink(missing_ok=True)
        lock.release()


def holder(state: Path) -> str:
    """Who holds the lock, in words."""
    try:
        who = json.loads((state / "holder.json").read_text(encoding="utf-8"))
        return one_line(f"process {who['pid']} on {who['host']} since {who['since']}", 200)
    except (OSError, ValueError, KeyError, TypeError):
        return "a process that has just started or ended"
