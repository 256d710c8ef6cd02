"""An outer loop from a JSON file: coefficients or matrices, sampling, sign, names."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from actuator_lti.errors import InputError
from actuator_lti.files.reading import read_json, shown_path
from analyses.linear.outer_loop import OuterLoop

if TYPE_CHECKING:
    import control

Matrix = npt.NDArray[np.float64]
COEFFICIENTS, MATRICES = ("num", "den"), ("A", "B", "C", "D")
_OTHER = ("dt", "sampling_period", "sign", "name", "input", "output")
_WORDS = {"name": "outer loop", "input": "output of the drive", "output": "command of the drive"}
MOST_STATES = 200


def read_outer_loop(path: str | PathLike[str]) -> OuterLoop:
    """Read an outer loop from a JSON file: one object with these keys.

    ``num`` and ``den`` (coefficients, highest power first), or ``A``, ``B``, ``C``, ``D`` (lists of rows);
    ``dt`` in s, 0 for a continuous system; ``sampling_period`` in s of a continuous one that a sampled drive
    is closed around; ``sign`` -1 (usual) or 1; ``name``, ``input``, ``output``.

    Raises
    ------
    InputError
        For anything else, naming file, key and what is allowed.
    """

    return outer_loop(read_json(path, "JSON file of an outer loop"), shown_path(path))


def outer_loop(table: Any, where: str) -> OuterLoop:
    """An outer loop from the object of a file, see `read_outer_loop`."""
    if not isinstance(table, dict):
        raise InputError("an outer loop is one object; allowed keys: " + _allowed(), where=where)
    unknown = next((key for key in table if key not in (*COEFFICIENTS, *MATRICES, *_OTHER)), None)
    if unknown is not None:
        raise InputError(f"{unknown}: no such key; allowed: {_allowed()}", where=where)
    dt = _time(table, "dt", where)
    if dt is None:
        raise InputError("dt: missing; allowed: the sampling period in s, or 0 for continuous", where=where)
    sampling = _time(table, "sampling_period", where)
    if sampling == 0.0 or (sampling is not None and dt > 0.0):
        message = "sampling_period: allowed: a time > 0 in s, for a continuous system (dt = 0)"
        raise InputError(message, where=where)
    sign = table.get("sign", -1)
    if isinstance(sign, bool) or sign not in (-1, 1):
        raise InputError("sign: allowed: -1 (negative feedback) or 1", where=where)
    words = {key: _text(table, key, default, where) for key, default in _WORDS.items()}
    return OuterLoop(system=_system(table, dt, where), sampling_period_s=sampling, sign=int(sign), **words)


def _allowed() -> str:
    return "num and den, or A, B, C and D; dt, sampling_period, sign, name, input, output"


def _text(table: Mapping[str, Any], key: str, default: str, where: str) -> str:
    value = table.get(key, default)
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{key}: allowed: a text", where=where)
    return value


def _time(table: Mapping[str, Any], key: str, where: str) -> float | None:
    value = table.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < 1e6:
        raise InputError(f"{key}: allowed: a time in s, at least 0", where=where)
    return float(value)


def _system(table: Mapping[str, Any], dt: float, where: str) -> control.StateSpace:
    import control

    given = {key for key in (*COEFFICIENTS, *MATRICES) if key in table}
    if given == set(COEFFICIENTS):
        num, den = (_numbers(table, key, where) for key in COEFFICIENTS)
        num, den = np.trim_zeros(num, "f"), np.trim_zeros(den, "f")
        if den.size == 0 or num.size == 0:
            raise InputError("num, den: all zero; allowed: one coefficient that is not", where=where)
        if num.size > den.size:
            raise InputError("num: of a higher degree than den; allowed: a proper system", where=where)
        if den.size - 1 > MOST_STATES:
            raise InputError(f"den: more than {MOST_STATES} poles; allowed: fewer", where=where)
        return control.ss(control.tf(num, den, dt))
    if given != set(MATRICES):
        raise InputError(f"allowed: {_allowed()}", where=where)
    A, B, C, D = (_matrix(table, key, where) for key in MATRICES)
    n = A.shape[0]
    if A.shape != (n, n) or B.shape != (n, 1) or C.shape != (1, n) or D.shape != (1, 1) or n > MOST_STATES:
        message = f"A, B, C, D: allowed: n by n, n by 1, 1 by n and 1 by 1, n at most {MOST_STATES}"
        raise InputError(message, where=where)
    return control.ss(A, B, C, D, dt)


def _numbers(table: Mapping[str, Any], key: str, where: str) -> Matrix:
    values = table[key]
    number = isinstance(values, list) and all(
        isinstance(v, int | float) and not isinstance(v, bool) for v in values
    )
    if not number or not values:
        raise InputError(f"{key}: allowed: a list of numbers", where=where)
    result: Matrix = np.array(values, dtype=float)
    if not np.isfinite(result).all():
        raise InputError(f"{key}: allowed: finite numbers", where=where)
    return result


def _matrix(table: Mapping[str, Any], key: str, where: str) -> Matrix:
    rows = table[key]
    if not isinstance(rows, list) or not rows or not all(isinstance(row, list) for row in rows):
        raise InputError(f"{key}: allowed: a list of rows, each a list of numbers", where=where)
    read = [_numbers({key: row}, key, where) for row in rows]
    if len({row.size for row in read}) != 1:
        raise InputError(f"{key}: rows of different lengths; allowed: a matrix", where=where)
    return np.array(read)
