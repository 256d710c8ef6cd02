"""Matrices of a law of one's own from a .mat or JSON file."""

from math import isqrt
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.files.mat5 import read_mat5
from actuator_lti.files.reading import decode, parse_json, read_bytes, shown, shown_path
from actuator_lti.files.tree import Tree

PARTS = ("A", "B", "C", "D")
_PERIODS = ("period", "Ts", "dt")
_WHAT = "file of a law: A, B, C, D and Ts, as .mat up to version 7 or .json"


def read_law(path: Path) -> Tree:
    """The matrices of a file as a design file writes them, with ``period``; an InputError names the file.

    MATLAB: ``[A,B,C,D,Ts] = ssdata(K); save('k.mat','A','B','C','D','Ts')``, or a structure of these fields.
    """
    where, data = shown_path(path), read_bytes(path, _WHAT)

    def refused(why: str) -> InputError:
        return InputError(f"{why}allowed: a {_WHAT}", where=where)

    if path.suffix not in (".mat", ".json"):
        raise refused("")
    try:
        held = _from_mat(data) if path.suffix == ".mat" else parse_json(decode(data, where), where)
    except InputError as error:
        raise refused(f"cannot be read: {error.message}; ") from None
    tables = [held, *(held.values() if isinstance(held, dict) else ())]  # the file itself, or one in it
    held = next((one for one in tables if isinstance(one, dict) and "D" in one), None)
    if held is None:
        raise refused("holds no A, B, C and D; ")
    period = next((held[name] for name in _PERIODS if name in held), None)
    if period is None:
        raise refused("has no Ts, the period that the law was made for; ")
    try:
        A, B, C, D, L = (held.get(part, ()) for part in (*PARTS, "L"))
        return law_tree(A, B, C, D, L, np.asarray(period).item())
    except (ValueError, TypeError) as error:
        raise refused(f"{error}; ") from None


def _from_mat(data: bytes) -> Tree:
    """Arrays by name, those of a structure in a table of its name."""
    held: Tree = {}
    for name, values in read_mat5(data).arrays.items():
        table, _, field = name.rpartition(".")
        (held.setdefault(f"{table}.", {}) if table else held)[field] = values
    return held


def law_tree(A: Any, B: Any, C: Any, D: Any, L: Any = (), period_s: Any = None) -> Tree:
    """Matrices of real numbers, of one output, as a design file writes them; other ones are an InputError."""
    parts = {}
    for name, given in zip((*PARTS, "L"), (A, B, C, D, L), strict=True):
        try:
            parts[name] = np.asarray_chkfinite(given, dtype=float)
        except (ValueError, TypeError):
            raise InputError(f"{name}: allowed: a matrix of finite real numbers") from None
    n = isqrt(parts["A"].size)
    if parts["A"].size != n * n or (parts["A"].ndim == 2 and parts["A"].shape != (n, n)):
        raise InputError(f"A: {_shape(parts['A'])}; allowed: as many rows as columns")
    for name in ("C", "D"):
        if parts[name].ndim > 2 or (parts[name].ndim == 2 and len(parts[name]) > 1):
            raise InputError(f"{name}: {_shape(parts[name])}; allowed: one row, a law has one output")
    if n and parts["B"].size % n:
        raise InputError(f"B: {_shape(parts['B'])}; allowed: {n} rows, as A has")
    tree: Tree = {
        "A": parts["A"].reshape(n, n).tolist(),
        "B": parts["B"].reshape(n, -1).tolist() if n else [],
        **{name: parts[name].ravel().tolist() for name in ("C", "D", "L")},
    }
    tree = {name: value for name, value in tree.items() if value}
    if period_s is None:
        return tree
    try:
        return {**tree, "period": f"{float(period_s)!r} s"}
    except (ValueError, TypeError):
        said = f"dt = {shown(period_s)}: allowed: a period in s, or 0 of a continuous system"
        raise InputError(said) from None


def _shape(matrix: np.ndarray) -> str:
    return " x ".join(str(size) for size in matrix.shape) or "one number"
