"""The folder beside a site that holds history and cache: where it lies, who holds it, and that it is whole.

``summary.json`` is published with the site and survives where the state folder does not (a cache that was
not restored, a deleted file). A night is refused where the history knows less than the site, so that a lost
one does not pass for a first night.
"""

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes
from actuator_lti.files.reading import read_json, shown_path
from reports.nightly.text import now, one_line

INDEX, NIGHTS, CACHE = "history.json", "nights", "cache"


def state_of(site: Path, state: Path | None = None) -> Path:
    """Return the folder of history, cache and lock: beside the site, so that none of it is published.

    Refused is what is no folder, leads elsewhere or lies inside the site.
    """
    if state is None:
        place = Path(os.path.abspath(site))  # "." and ".." have names, too
        if not place.name:
            raise InputError("is the root of the disk: --site takes a folder below it", shown_path(site))
        state = place.with_name(f"{place.name}.state")
    elif Path(os.path.realpath(state)).is_relative_to(os.path.realpath(site)):
        why = "lies inside the site and would be published with it: --state takes a folder elsewhere"
        raise InputError(why, shown_path(state))
    folders = (state, state / CACHE, state / NIGHTS)
    for folder in (one for one in folders if os.path.lexists(one) and not one.is_dir()):
        raise InputError("is no folder; allowed: a folder, or none yet", shown_path(folder))
    inside = [path for folder in folders if folder.is_dir() for path in folder.iterdir()]
    for path in filter(Path.is_symlink, (state, *inside)):
        why = "is a symbolic link: history and cache are kept in the state folder itself"
        raise InputError(why, shown_path(path))
    return state


@contextmanager
def hold(state: Path, wait_s: float = 0.0) -> Iterator[None]:
    """Hold the lock of a state folder; the system frees it when the process ends, however it ends.

    Where it is still held after ``wait_s``, the refusal names process, host and since when.
    """
    from filelock import FileLock, Timeout

    state.mkdir(parents=True, exist_ok=True)
    lock, note = FileLock(state / "nightly.lock"), state / "holder.json"
    try:
        lock.acquire(timeout=wait_s)
    except Timeout as error:
        holder = "a process that has just started or ended"
        with suppress(OSError, ValueError, KeyError, TypeError):
            holder = "process {pid} on {host} since {since}".format(**json.loads(note.read_text("utf-8")))
        reason = f"another nightly holds the lock: {one_line(holder, 200)}; wait for it with --wait SECONDS"
        raise InputError(reason, where=str(state)) from error
    try:
        who = {"pid": os.getpid(), "host": socket.gethostname(), "since": now()}
        write_bytes(note, json.dumps(who).encode())
        yield
    finally:
        note.unlink(missing_ok=True)
        lock.release()


class HistoryLost(Exception):
    """The history beside a site is missing, empty or older than the site; the message says what to do."""


@dataclass(frozen=True)
class Memory:
    """How much a history held when the site was published; ``id`` is empty where it is not known."""

    id: str = ""
    nights: int = 0
    approvals: int = 0

    def __str__(self) -> str:
        return f"{self.nights} night(s) and {self.approvals} approval(s)"


def remembered(site: Path) -> Memory | None:
    """What a site remembers, at least one night; ``None`` where nothing was ever published there.

    Of a summary by an older version, or a damaged one, every field that is as it should be counts.
    """
    if not any((site / name).exists() for name in ("index.html", "summary.json")):
        return None
    history: Any = None
    with suppress(InputError, AttributeError):
        history = read_json(site / "summary.json", "summary.json").get("history")
    known = history if isinstance(history, dict) else {}
    kinds = {"id": str, "nights": int, "approvals": int}
    of = Memory(**{name: known[name] for name, kind in kinds.items() if type(known.get(name)) is kind})
    return replace(of, nights=max(of.nights, 1), approvals=max(of.approvals, 0))


def check_memory(site: Path, now: Memory, state: Path) -> None:
    """Refuse a history that knows less than its site: what is missing, how to go on."""
    old = state / "history.sqlite"
    if not now.nights and old.exists():
        raise HistoryLost(
            f"{old}: is the history of an earlier version, which this one does not read: go on with that"
            " version, or begin anew on purpose with --accept-lost-history"
        )
    before = remembered(site)
    if before is None:
        return
    other = before.id and now.id != before.id
    if not other and now.nights >= before.nights and now.approvals >= before.approvals:
        return
    what = "is that of another site" if other else f"holds {now}"
    what = what if now.nights else "is missing or empty"
    raise HistoryLost(
        f"{state / INDEX}: {what}, but the site knows of {before}: regressions cannot be determined."
        " Restore the state folder from a copy, or begin anew on purpose with --accept-lost-history"
    )
