"""Matrices of a law of one's own from a .mat or JSON file."""

from math import isqrt
from numbers import Complex
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.design.field import BIG
from actuator_lti.design.law import balance
from actuator_lti.design.mistakes import nearest
from actuator_lti.errors import InputError
from actuator_lti.files.matlab import read_mat
from actuator_lti.files.reading import Tree, decode, parse_json, read_bytes, shown, shown_path

PARTS = ("A", "B", "C", "D")
_PERIODS = ("period", "Ts", "dt")
_KEYS = (*PARTS, "L", "gain", "inputs", *_PERIODS)
_WHAT = "file of one law: A, B, C, D, Ts and where needed L, as .mat up to version 7 or .json"


def read_law(path: Path) -> Tree:
    """What a file has of a law's table, with ``period``; an InputError says what is wrong with it.

    MATLAB: ``[A,B,C,D,Ts] = ssdata(K); save('k.mat','A','B','C','D','Ts')``, or a structure of these fields;
    L, gain and inputs may stand with them, nothing else in a structure or JSON; other variables of a
    workspace are passed over.
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
    tables = {"its own A, B, C, D": held} | (held if isinstance(held, dict) else {})
    laws = {name: one for name, one in tables.items() if isinstance(one, dict) and "D" in one}
    if len(laws) != 1:
        several = f"several laws: {', '.join(name.rstrip('.') for name in laws)}"
        raise refused(f"holds {shown(several)[1:-1] if laws else 'no A, B, C and D'}; ")
    ((name, held),) = laws.items()
    workspace = path.suffix == ".mat" and not name.endswith(".")  # whose other variables are no part of it
    if unknown := [key for key in held if key not in _KEYS and not workspace]:
        raise refused(f"{', '.join(map(shown, unknown[:12]))}: unknown key{nearest(unknown[0], _KEYS)}; ")
    periods = {name: _number(name, held[name]) for name in _PERIODS if name in held}
    if len({*periods.values()}) != 1:
        ends = " and ".join(periods) + " that differ" if periods else "no Ts, the period that it was made for"
        raise refused(f"has {ends}; ")
    A, B, C, D, L = (held.get(part, ()) for part in (*PARTS, "L"))
    tree = law_tree(A, B, C, D, L, *{*periods.values()})
    tree |= {"gain": _number("gain", held["gain"])} if "gain" in held else {}
    return tree | ({"inputs": [*held["inputs"]]} if held.get("inputs") else {})


def _from_mat(data: bytes) -> Tree:
    """What a file holds by name, fields of a structure in a table of its name; None: what cannot be read."""
    content, held = read_mat(data), Tree()
    every = {**dict.fromkeys(content.passed_over), **content.texts, **content.complexes, **content.arrays}
    for name, values in every.items():
        table, _, field = name.rpartition(".")
        (held.setdefault(f"{table}.", {}) if table else held)[field] = values
    return held


def _real(name: str, given: Any) -> np.ndarray:
    """An array of finite real numbers; text, truth and what has an imaginary part are none."""
    must = "real"
    try:
        values = np.array(given.toarray() if hasattr(given, "toarray") else given, dtype=object)
        numbers = [one.real for one in values.flat if isinstance(one, Complex) and one.imag == 0]
        if len(numbers) == values.size and bool not in map(type, values.flat):
            must = "finite"
            return np.asarray_chkfinite(numbers, dtype=float).reshape(values.shape)
    except (ValueError, TypeError):
        pass
    raise InputError(f"{name}: must be {must}; allowed: finite real numbers")


def _number(name: str, given: Any) -> float:
    values = _real(name, given)
    if values.size != 1:
        raise InputError(f"{name}: {_shape(values)}; allowed: one number")
    return float(values.item())


def law_tree(A: Any, B: Any, C: Any, D: Any, L: Any = (), period_s: Any = None) -> Tree:
    """Matrices of real numbers, of one output, as a design file writes them; other ones are an InputError."""
    parts = {name: _real(name, given) for name, given in zip((*PARTS, "L"), (A, B, C, D, L), strict=True)}
    n = isqrt(parts["A"].size)
    if parts["A"].size != n * n or (parts["A"].ndim == 2 and parts["A"].shape != (n, n)):
        raise InputError(f"A: {_shape(parts['A'])}; allowed: as many rows as columns")
    for name in ("C", "D"):
        if parts[name].ndim > 2 or (parts[name].ndim == 2 and len(parts[name]) > 1):
            raise InputError(f"{name}: {_shape(parts[name])}; allowed: one row, a law has one output")
    B = (
        parts["B"].reshape(n, 1) if parts["B"].size == n else np.atleast_2d(parts["B"])
    )  # a vector as it stands
    if n and len(B) != n:
        raise InputError(f"B: {_shape(parts['B'])}; allowed: {n} rows, as A has")
    A, C, D, L = parts["A"].reshape(n, n), *(parts[name].ravel() for name in ("C", "D", "L"))
    B = B.reshape(n, -1) if n else np.zeros((0, 0))
    beyond = max(np.abs(part).max(initial=0.0) for part in (A, B, C, L)) > BIG
    if beyond and n and C.size == n and L.size in (0, n):
        t = balance(A, np.hstack([B, L.reshape(n, -1)]), C)
        A, B, C, L = A * t / t[:, None], B / t[:, None], C * t, L / t[: L.size]
    named = zip((*PARTS, "L"), (A, B, C, D, L), strict=True)
    tree = {name: part.tolist() for name, part in named if part.size}
    return tree if period_s is None else {**tree, "period": f"{_number('dt', period_s)!r} s"}


def _shape(matrix: np.ndarray) -> str:
    return " x ".join(str(size) for size in matrix.shape) or "one number"
