"""What the history holds: nights, what came of each design in them, approvals."""

from base64 import b64decode, b64encode
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from reports.nightly.figures import Figure

Named = tuple[str, str, int, str]  # of a figure: name, unit, which way is better, kind


def packed(figures: Iterable[Figure]) -> str:
    """Values of figures as text, no bit lost: base64 of float64, NaN where there is none.

    >>> unpacked(packed([Figure(name="x", value=0.1), Figure(name="y", value=None)]))
    array([0.1, nan])
    """
    return b64encode(np.array([f.value for f in figures], dtype="<f8").tobytes()).decode()


def unpacked(text: str) -> np.ndarray:
    return np.frombuffer(b64decode(text), dtype="<f8")


@dataclass(frozen=True, kw_only=True)
class Run:
    """One night: when, with which code and study, and the checksum of its file."""

    id: int
    started: str
    code: str
    code_commit: str
    study_commit: str
    libraries: Mapping[str, str]
    host: str
    finished: str = ""
    sha256: str = ""


@dataclass(frozen=True, kw_only=True)
class Content:
    """Of a result: its figures as `packed` in one of the layouts of the night; parameters and settings."""

    layout: int
    values: str
    inputs: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Result:
    """What one design came to in one night."""

    run: int
    name: str
    kind: str
    status: str
    key: str = ""
    seconds: float = 0.0
    cached: bool = False
    failed: int = 0
    total: int = 0
    worst: float | None = None
    worst_id: str = ""
    message: str = ""
    home: int | None = None  # the night whose file holds the content, maybe an earlier one; None: no result
    content: Content | None = None


@dataclass(frozen=True, kw_only=True)
class Night:
    """The file of a night: its results, and the lists of figures that they share."""

    id: int
    layouts: list[list[Named]]
    results: list[Result]

    @cached_property
    def by_name(self) -> dict[str, Result]:
        return {result.name: result for result in self.results}

    @cached_property
    def figures(self) -> list[tuple[Figure, ...]]:
        return [
            tuple(Figure(name, None, unit, better, kind) for name, unit, better, kind in one)
            for one in self.layouts
        ]


@dataclass(frozen=True, kw_only=True)
class Baseline:
    """A night that somebody has approved, for one design or for all of them (``name`` is ``None``)."""

    run: int
    at: str
    by: str
    reason: str
    name: str | None


@dataclass(frozen=True, kw_only=True)
class Index:
    """All nights: those that ended, when others began that did not, and what was approved."""

    id: str
    study: str = ""
    begun: int = 0  # every night that ever began
    running: str = ""  # when the one began that has not ended
    runs: list[Run] = field(default_factory=list)
    interrupted: list[str] = field(default_factory=list)
    baselines: list[Baseline] = field(default_factory=list)
