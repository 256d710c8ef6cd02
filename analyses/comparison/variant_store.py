"""What was found of each design of a comparison, on disk as JSON: a study that was stopped goes on.

An entry's name is the hash of all that it depends on (texts of both designs, commands, code, libraries). It
is checked like any other file when it is read; one that is damaged is computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes
from actuator_lti.files.reading import decode, read_bytes
from actuator_lti.files.tree import Tree
from analyses.studies.proof import code_version

LIBRARIES = ("numpy", "scipy")


@dataclass(frozen=True)
class Store:
    """Entries in one folder."""

    folder: Path

    def read(self, key: str) -> Tree | None:
        """What was found; ``None`` where there is nothing, or nothing whole."""
        path = self._path(key)
        if not path.exists():
            return None
        try:
            head, _, body = decode(read_bytes(path, "entry"), str(path)).partition("\n")
            result = json.loads(body) if head == _digest(body) else None
        except (InputError, ValueError, RecursionError):
            return None
        return result if isinstance(result, dict) else None

    def write(self, key: str, result: Mapping[str, Any]) -> None:
        """Keep what was found."""
        body = json.dumps(result)
        write_bytes(self._path(key), f"{_digest(body)}\n{body}".encode())

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / f"{key}.json"


def address(designs: tuple[Design | None, ...], settings: object) -> str:
    """Name of what is found of designs with settings (whose ``repr`` says all of them)."""
    texts = [None if design is None else write_design(design) for design in designs]
    return _digest(json.dumps([texts, repr(settings), _code()]))


@cache
def _code() -> list[str]:
    return [code_version(), *(f"{name} {metadata.version(name)}" for name in LIBRARIES)]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
