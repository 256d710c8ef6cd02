"""JSON files as records: columns by name, or a list of rows."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.bounds import CSV_COLUMNS, TABLE_BYTES
from actuator_lti.errors import InputError
from actuator_lti.files.reading import decode, parse_json, read_bytes, shown_path
from analyses.estimation.arrays import FloatArray


def load_json(path: Path) -> tuple[Mapping[str, FloatArray], str]:
    """The columns of numbers by name (``group.name`` in groups), NaN for null, and the file's SHA-256."""
    where = shown_path(path)
    data = read_bytes(path, "JSON record", TABLE_BYTES)
    tree = parse_json(decode(data, where), where)
    if isinstance(tree, list) and all(isinstance(row, dict) for row in tree):
        names = dict.fromkeys(name for row in tree for name in row)
        CSV_COLUMNS.check(len(names), where)
        tree = {name: [row.get(name) for row in tree] for name in names}
    if not isinstance(tree, dict):
        raise InputError("no record; allowed: columns by name, or a list of rows by name", where=where)
    return dict(_columns(tree, "")), hashlib.sha256(data).hexdigest()


def _columns(tree: Mapping[str, Any], group: str) -> Iterator[tuple[str, FloatArray]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _columns(value, f"{group}{name}.")
        elif isinstance(value, list) and {type(one) for one in value} <= {int, float, type(None)}:
            yield group + name, np.array(value, dtype=np.float64)
