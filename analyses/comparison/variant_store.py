"""What is found of each design of a comparison, on disk as JSON: a study that was stopped goes on.

An entry's name is the hash of all that it depends on (texts of both designs, commands, code, libraries). It
is checked like any other file when it is read; one that is damaged is computed again.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path

from pydantic import TypeAdapter

from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes
from actuator_lti.files.reading import decode, read_bytes
from analyses.specification.requirements import RequirementVerdict
from analyses.studies.proof import code_version
from analyses.validation.row import Row

LIBRARIES = ("numpy", "scipy")


@dataclass(frozen=True)
class Changed:
    """One key that differs from the base, as texts."""

    path: str
    base: str
    text: str


@dataclass(frozen=True)
class Contribution:
    """What one changed key alone does to a figure, starting from the base."""

    path: str
    amount: float


@dataclass(frozen=True, kw_only=True)
class Found:
    """What is found of one design of a comparison: plain data, kept on disk as they are."""

    # By column, such as ``"position.phase_margin"``; ``None`` where there is none
    figures: dict[str, float | None]
    verdicts: tuple[RequirementVerdict, ...]
    changed: tuple[Changed, ...] = ()
    differences: dict[str, float] = field(default_factory=dict)  # figure minus the base's, where they differ
    # For each difference the changed keys one at a time, the strongest first; what is left over is their
    # interaction (or a key without a number)
    moved_by: dict[str, tuple[Contribution, ...]] = field(default_factory=dict)
    # Of the validator: each prediction beside what the simulator shows; empty where not asked for
    checks: tuple[Row, ...] = ()
    untested: str = ""  # why the validator could not test this design


@dataclass(frozen=True)
class Kept:
    """What is found of the designs of a study, in one folder; nothing without one."""

    folder: Path | None
    base: Design
    settings: object  # its ``repr`` says all of them

    def read(self, design: Design) -> Found | None:
        """What was found; ``None`` where there is nothing, or nothing whole."""
        path = self._path(design)
        if path is None or not path.exists():
            return None
        try:
            head, _, body = decode(read_bytes(path, "entry"), str(path)).partition("\n")
            return _adapter().validate_python(json.loads(body)) if head == _digest(body) else None
        except (InputError, ValueError, RecursionError):  # or not what this version writes
            return None

    def write(self, design: Design, found: Found) -> Found:
        """Keep what was found, and give it back."""
        if (path := self._path(design)) is not None:
            body = json.dumps(_adapter().dump_python(found))
            write_bytes(path, f"{_digest(body)}\n{body}".encode())
        return found

    def _path(self, design: Design) -> Path | None:
        if self.folder is None:
            return None
        texts = [write_design(one) for one in (self.base, design)]
        key = _digest(json.dumps([texts, repr(self.settings), _code()]))
        return self.folder / key[:2] / f"{key}.json"


@cache
def _adapter() -> TypeAdapter[Found]:
    """Turns what is found into plain data and back."""
    return TypeAdapter(Found)


@cache
def _code() -> list[str]:
    return [code_version(), *(f"{name} {metadata.version(name)}" for name in LIBRARIES)]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
