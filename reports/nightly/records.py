"""What the history holds: nights, results, approvals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from reports.nightly.figures import Figure


@dataclass(frozen=True, kw_only=True)
class Run:
    """One night: when, and with which code and study."""

    id: int
    started: str
    finished: str | None
    state: str
    code: str
    code_commit: str
    study_commit: str
    libraries: Mapping[str, str]
    host: str


@dataclass(frozen=True, kw_only=True)
class Result:
    """What one design came to in one night; ``snapshot`` is ``None`` where there is no result."""

    run: int
    name: str
    kind: str
    status: str
    snapshot: int | None
    key: str
    seconds: float
    cached: bool
    failed: int
    total: int
    worst: float | None
    worst_id: str
    message: str


@dataclass(frozen=True, kw_only=True)
class Baseline:
    """A night that somebody has approved, for one design or for all of them (``name`` is ``None``)."""

    id: int
    run: int
    at: str
    by: str
    reason: str
    name: str | None


@dataclass(frozen=True, kw_only=True)
class NewResult:
    """What a night adds for one design."""

    name: str
    kind: str
    status: str
    key: str = ""
    figures: Sequence[Figure] = ()
    inputs: Mapping[str, Any] | None = None
    seconds: float = 0.0
    cached: bool = False
    failed: int = 0
    total: int = 0
    worst: float | None = None
    worst_id: str = ""
    message: str = ""
