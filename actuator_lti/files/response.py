"""A measured frequency response from a table in text, a .mat file or python-control's own data."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from actuator_lti.bounds import CSV_COLUMNS, MAT_BYTES, TABLE_BYTES, TABLE_ROWS
from actuator_lti.errors import InputError, in_file
from actuator_lti.files.mat5 import read_mat5
from actuator_lti.files.reading import read_bytes, read_text, shown, shown_path
from actuator_lti.types import Floats

Loop = Literal["L", "T", "S"]
WHAT = "frequency response: CSV or .mat (up to -v7) with frequency, dB and deg or real and imaginary part"

NO_VALUE = ("", "nan", "na", "n/a", "null", "-", "inf", "-inf")
"""Of a row that is left out and counted."""

# what each column is named, by which it is known, and how a name says its unit; SI over it, or what it is
_UNITS: dict[str, tuple[re.Pattern[str], dict[str, object]]] = {
    "coherence": (re.compile(r"coh|gamma", re.I), {}),
    "averages": (re.compile(r"^n?_?av(g|erages?)\b", re.I), {}),
    "deviation": (re.compile(r"^(std|dev|sigma|spread|uncert)", re.I), {r"%|percent": 0.01}),
    "frequency": (
        re.compile(r"^f(req|_|\b)|^(omega|w)(_|\b)|hz\b", re.I),
        {"khz": 1e3, "hz": 1.0, r"rad|^omega|^w(_|\b)": 0.5 / np.pi},
    ),
    "real": (re.compile(r"^re(al)?(_|\b)|[._]re(al)?\b", re.I), {}),
    "imaginary": (re.compile(r"^im(ag)?[a-z]*(_|\b)|[._]im(ag)?\b", re.I), {}),
    "phase": (re.compile(r"phase|^arg|deg\b|^ph(_|\b)", re.I), {"deg|°": np.pi / 180.0, "rad": 1.0}),
    "size": (re.compile(r"mag|gain|abs|amp|db\b", re.I), {"db": "dB", r"abs|ratio|lin|\b1\b|[/]": "ratio"}),
}


@dataclass(frozen=True)
class RecordedResponse:
    """A response as it was measured.

    ``frequency_hz``, shape (m,): rising, above 0.
    ``response``, shape (m,).
    ``deviation``, shape (m,): root mean square of the complex error over the size of the value; not a number
    where it is not known.
    ``coherence``, shape (m,): ordinary coherence, 0 to 1; not a number where it is not known.
    ``name``: of the file.
    ``left_out``: rows without numbers, or without coherence.
    """

    frequency_hz: Floats
    response: NDArray[np.complex128]
    deviation: Floats
    coherence: Floats
    name: str
    left_out: int = 0

    def as_loop(self, of: Loop) -> RecordedResponse:
        """The open loop L = T/(1 - T) = 1/S - 1 of a closed loop or a sensitivity, its deviation with it.

        Examples
        --------
        >>> half = RecordedResponse(*np.array([[1.0], [0.5], [0.1], [np.nan]]), "T")
        >>> float(half.as_loop("T").response[0].real), float(half.as_loop("T").deviation[0])
        (1.0, 0.2)

        An InputError where a closed loop is 1, or a sensitivity 0, to the last digit.
        """
        if of == "L":
            return self
        rest = 1.0 - self.response
        under = rest if of == "T" else self.response
        if not (under != 0.0).all():
            raise InputError(f"{self.name}: {of} is {1 if of == 'T' else 0} at a frequency: no loop there")
        over, apart = self.response if of == "T" else rest, np.abs(rest)
        known = np.divide(self.deviation, apart, out=np.full(apart.shape, np.inf), where=apart > 0.0)
        return replace(self, response=over / under, deviation=known)


def read_response(source: Path | str | Any, averages: int | None = None) -> RecordedResponse:
    """Read a measured response.

    A table in text has its columns parted by comma, semicolon (then with decimal comma, too), tab or space,
    and says in its heading what they are: ``frequency_hz,gain_db,phase_deg``, ``f,real,imag,coherence``,
    ``omega,ratio...``; without a heading they are Hz, dB, deg and perhaps coherence. A .mat file has arrays
    of such names, or a complex one. What a name leaves open (dB or ratio, deg or rad) and the numbers do
    not decide is refused.

    ``source``: path or control.FrequencyResponseData.
    ``averages``: of the coherence; or as a column or array of this name. The deviation is then
    sqrt((1 - g2)/(g2 (n - 1))) (Bendat, Piersol, Random Data, chapter 9).

    An InputError names the file and what is allowed.
    """
    if hasattr(source, "frdata") and hasattr(source, "omega"):
        columns = {"f_hz": np.asarray(source.omega) / (2.0 * np.pi)}
        values = np.asarray(source.frdata).ravel()
        return _response(columns | {"re": values.real, "im": values.imag}, "measured response", averages)
    if not isinstance(source, (str, Path)):
        raise InputError(f"{shown(source)}: allowed: a path or control.FrequencyResponseData")
    with in_file(shown_path(source)):
        if Path(source).suffix.lower() != ".mat":
            columns = _table(read_text(source, WHAT, TABLE_BYTES))
        else:
            content = read_mat5(read_bytes(source, WHAT, MAT_BYTES))
            columns = {name: values.ravel() for name, values in content.arrays.items()}
            for name, values in content.complexes.items():
                columns |= {f"{name}.real": values.real.ravel(), f"{name}.imag": values.imag.ravel()}
        return _response(columns, Path(source).name, averages)


def _table(text: str) -> dict[str, Floats]:
    """Columns by their headings."""
    every = [(at, line.strip()) for at, line in enumerate(text.splitlines(), 1)]
    every = [(at, line) for at, line in every if line and line[0] not in "#%"]
    places, lines = [at for at, _ in every], [line for _, line in every]
    TABLE_ROWS.check(len(lines))
    if not lines:
        raise InputError(f"is empty; allowed: a {WHAT}")
    cut = next((sign for sign in ";\t," if sign in lines[0]), None)
    rows = [[word.strip().strip('"') for word in line.split(cut)] for line in lines]
    width = len(rows[0])
    CSV_COLUMNS.check(width)
    head = rows.pop(0) if any(np.isnan(_number(word, cut)) for word in rows[0]) else None
    if any(len(row) != width for row in rows):
        raise InputError(f"rows of {width} and of other numbers of columns; allowed: a {WHAT}")
    for line, row in zip(places[len(places) - len(rows) :], rows, strict=True):
        if wrong := [word for word in row if word.lower() not in NO_VALUE and np.isnan(_number(word, cut))]:
            raise InputError(f"line {line}: {shown(wrong[0])} is no number; allowed: numbers, or nothing")
    values = np.array([[_number(word, cut) for word in row] for row in rows]).reshape(-1, width)
    names = head or ["f_hz", "gain_db", "phase_deg", "coherence", *(f"column {k}" for k in range(4, width))]
    return dict(zip(names, values.T, strict=False))


def _number(word: str, cut: str | None) -> float:
    try:
        return float(word.replace(",", ".") if cut == ";" else word)
    except ValueError:
        return np.nan


def _response(columns: Mapping[str, Floats], name: str, averages: int | None) -> RecordedResponse:
    found: dict[str, str] = {}
    for role, (like, _) in _UNITS.items():
        named = next((one for one in columns if one not in found.values() and like.search(one)), None)
        if named is not None:
            found[role] = named
    if {"real", "imaginary"} <= set(found):
        found = {role: own for role, own in found.items() if role not in ("size", "phase")}
    wanted = ("frequency", "real", "imaginary") if "real" in found else ("frequency", "size", "phase")
    if missing := [role for role in wanted if role not in found]:
        held = ", ".join(shown(one)[1:-1] for one in list(columns)[:12])
        raise InputError(f"no {' and no '.join(missing)} in the columns {held}; allowed: a {WHAT}")
    count = columns[found["frequency"]].size
    taken = {role: columns[own] for role, own in found.items() if columns[own].size in (1, count)}
    if short := [found[role] for role in found if role not in taken]:
        raise InputError(f"{shown(short[0])}: {columns[short[0]].size} values for {count} frequencies")
    table = {role: np.broadcast_to(values, count) for role, values in taken.items()}
    good = np.all([np.isfinite(values) for values in table.values()], axis=0)
    good &= table.get("coherence", np.ones(count)) != 0.0
    table = {role: values[good] for role, values in table.items()}
    f = table["frequency"] * _unit("frequency", found["frequency"], 1.0)
    if f.size < 2 or not (f > 0.0).all():
        told = f"{f.size} rows of numbers, frequencies above 0 in {(f > 0.0).sum()}"
        raise InputError(f"{told}; allowed: two rows or more, each at a frequency above 0 Hz")
    order = f.argsort(kind="stable")
    if (np.diff(f[order]) == 0.0).any():
        raise InputError("a frequency is given twice")
    z, coherence = _values(table, found), table.get("coherence", np.full(f.size, np.nan))
    if not (np.isnan(coherence) | ((coherence > 0.0) & (coherence <= 1.0))).all():
        raise InputError("a coherence outside 0 to 1")
    if not np.isfinite(z).all() or (z == 0.0).any():
        raise InputError("a value that is 0 or beyond the range of floats")
    deviation = _deviation(table, found, coherence, averages)
    left_out = count - int(good.sum())
    return RecordedResponse(f[order], z[order], deviation[order], coherence[order], name, left_out)


def _unit(role: str, name: str, default: Any) -> Any:
    """What the name of a column says of its unit."""
    known = _UNITS[role][1]
    return next((unit for like, unit in known.items() if re.search(like, name, re.I)), default)


def _values(table: Mapping[str, Floats], found: Mapping[str, str]) -> NDArray[np.complex128]:
    if "real" in table:
        return table["real"] + 1j * table["imaginary"]
    size, phase = table["size"], table["phase"]
    unit = _unit("size", found["size"], "dB" if (size < 0.0).any() else None)
    turn = _unit("phase", found["phase"], np.pi / 180.0 if np.abs(phase).max() > 2.0 * np.pi else None)
    for role, said, allowed in (
        ("size", unit, "gain_db or gain_ratio"),
        ("phase", turn, "phase_deg or phase_rad"),
    ):
        if said is None:
            raise InputError(f"{shown(found[role])} says no unit; allowed: {allowed}")
    with np.errstate(over="ignore", under="ignore"):
        ratio = 10.0 ** (size / 20.0) if unit == "dB" else size
        made: NDArray[np.complex128] = ratio * np.exp(1j * turn * phase)
    return made


def _deviation(
    table: Mapping[str, Floats], found: Mapping[str, str], coherence: Floats, averages: int | None
) -> Floats:
    if "deviation" in table:
        deviation = table["deviation"] * _unit("deviation", found["deviation"], 1.0)
        if not (deviation >= 0.0).all():
            raise InputError("a deviation below 0")
        return deviation
    n = table.get("averages", np.nan) if averages is None else np.asarray(float(averages))
    if (np.asarray(n) < 2.0).any():
        raise InputError("averages: at least 2")
    made: Floats = np.sqrt((1.0 - coherence) / (coherence * (n - 1.0)))
    return made
