"""What a site remembers of its history, so that a lost one does not pass for a first night.

``summary.json`` is published with the site and survives where the state folder does not (a cache that was
not restored, a deleted file). A night is refused where the history knows less than the site.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from actuator_lti.errors import InputError
from actuator_lti.files.reading import read_json


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
    """What a site remembers; ``None`` where nothing was ever published there."""
    if not (site / "index.html").exists() and not (site / "summary.json").exists():
        return None
    try:
        result = read_json(site / "summary.json", "summary.json").get("history")
    except (InputError, AttributeError):
        result = None
    if not isinstance(result, Mapping):
        return Memory("", 1)  # published by an older version, or damaged: at least one night
    numbers = [result.get(key) for key in ("nights", "approvals")]
    nights, approvals = (n if isinstance(n, int) and not isinstance(n, bool) else 0 for n in numbers)
    return Memory(str(result.get("id", "")), max(nights, 1), max(approvals, 0))


def check(site: Path, now: Memory, state: Path) -> None:
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
    if now.nights == 0:
        what = "is missing or empty"
    elif before.id and now.id != before.id:
        what = "is that of another site"
    elif now.nights < before.nights or now.approvals < before.approvals:
        what = f"holds {now}"
    else:
        return
    raise HistoryLost(
        f"{state / 'history.json'}: {what}, but the site knows of {before}: regressions cannot be determined."
        " Restore the state folder from a copy, or begin anew on purpose with --accept-lost-history"
    )
