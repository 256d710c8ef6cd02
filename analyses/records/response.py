"""A measured frequency response from a table in text, a .mat file or python-control's own data."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from actuator_lti.bounds import CSV_COLUMNS, TABLE_BYTES, TABLE_ROWS
from actuator_lti.errors import InputError, in_file
from actuator_lti.files.matlab import MatContent
from actuator_lti.files.reading import UTF_16, read_bytes, shown, shown_path
from actuator_lti.measured.response import (
    CONFIDENCE,
    GAUSSIAN,
    NEIGHBOURS,
    MeasuredResponse,
    scatter_of_repeats,
    student,
)
from actuator_lti.types import Compared, Floats
from analyses.records import response_columns as column
from analyses.records.csv_stream import text_of
from analyses.records.readers import held_in

Loop = Literal["L", "T", "S"]
UNTITLED = ("f_hz", "gain_db", "phase_deg", "coherence")  # columns without a heading
NO_VALUE = ("", "nan", "na", "n/a", "null", "-", "inf", "-inf")  # of a row that is left out and counted
_COLUMNS = ("frequency_hz", "response", "deviation", "coherence", "radius")  # one value a row


@dataclass(frozen=True, eq=False)
class RecordedResponse(Compared):
    """A response as it was measured; arrays of shape (m,), NaN where something is not known."""

    frequency_hz: Floats  # rising, above 0
    response: NDArray[np.complex128]
    deviation: Floats  # root mean square of the complex error over the size of the value
    coherence: Floats  # ordinary coherence, 0 to 1
    name: str  # of the file
    left_out: int = 0  # rows without numbers, without coherence, or at 0 Hz
    # Of the circle that holds the true value in 99 of 100 cases, over its size; and where it is from
    radius: Floats = field(default_factory=lambda: np.array(np.nan))
    noise: str = ""
    read_as: str = ""  # how the columns of a file were taken
    period_s: float | None = None  # sampling period of which it says that it is; None where it says none

    def refuse_other_period(self, loop: str, period_s: float | None) -> None:
        """Refuse data that say another sampling period than that of the loop, s."""
        if self.period_s and period_s is not None and abs(self.period_s - period_s) > 1e-6 * period_s:
            allowed = f"{period_s:g} s, of the {loop} loop, or none"
            raise InputError(f"{self.name}: dt = {self.period_s:g} s; allowed: {allowed}")

    def as_loop(self, of: Loop) -> RecordedResponse:
        """The open loop L = T/(1 - T) = 1/S - 1 of a closed loop or a sensitivity, its deviation with it.

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

        def grown(error: Floats) -> Floats:
            return np.divide(error, apart, out=np.full(apart.shape, np.inf), where=apart > 0.0)

        known = grown(self.deviation), grown(self.radius)
        return replace(self, response=over / under, deviation=known[0], radius=known[1])


def read_response(source: Path | str | Any, averages: int | None = None) -> RecordedResponse:
    """Read a measured response.

    A table in text has its columns parted by comma, semicolon or tab (then with decimal comma, too) or space,
    and says in its heading what they are: ``frequency_hz,gain_db,phase_deg``, ``f,real,imag,coherence``,
    ``omega,ratio...``, perhaps in a comment, or above a row of units; what stands above it is passed over.
    Without a heading they are Hz, dB, deg and perhaps coherence. JSON and Parquet have columns, a .mat file
    arrays of such names, or a complex one. ``Ts`` or ``dt`` of one value is the sampling period. What a name
    leaves open (dB or ratio, deg or rad) and the numbers do not decide is refused, as are a unit that is none
    of its column's and two columns that say the same and contradict.

    Rows at the same frequency are repeats: their mean is taken, and where no noise is told their scatter.

    A deviation without unit, or in per cent, is the root mean square of the complex error over the size of
    the value. In dB it is that of the gain alone, in deg or rad of the phase alone: of one part of the error,
    and the other is taken to be as large where only one is there.

    ``source``: path, control.FrequencyResponseData or MeasuredResponse, whose radius is kept.
    ``averages``: of the coherence; or as a column or array of this name. The deviation is then
    sqrt((1 - g2)/(g2 (n - 1))) (Bendat, Piersol, Random Data, chapter 9).

    An InputError names the file and what is allowed.
    """
    if hasattr(source, "frdata") and hasattr(source, "omega"):
        values = np.asarray(source.frdata).ravel()
        columns = {"f_hz": np.asarray(source.omega) / (2.0 * np.pi), "re": values.real, "im": values.imag}
        dt = getattr(source, "dt", None)
        known = source if isinstance(source, MeasuredResponse) and source.noise_known else None
        if known is not None:
            with np.errstate(divide="ignore", invalid="ignore"):
                columns["deviation"] = known.radius / np.abs(values) / GAUSSIAN
        read = _response(columns, "measured response", averages)
        read = replace(read, read_as="", period_s=None if dt is True else dt)
        return read if known is None else replace(read, noise=known.source)
    if not isinstance(source, (str, Path)):
        raise InputError(f"{shown(source)}: allowed: a path or control.FrequencyResponseData")
    with in_file(shown_path(source)):
        titled, held = True, held_in(Path(source))
        if held is None:
            columns, titled = _table(read_bytes(source, column.WHAT, TABLE_BYTES))
        else:
            columns = _matlab(held[0]) if isinstance(held[0], MatContent) else dict(held[0])
        read = _response(columns, Path(source).name, averages)
        return read if titled else replace(read, read_as=f"without a heading, {read.read_as}")


def _matlab(content: MatContent) -> dict[str, Floats]:
    """The arrays of a file, complex ones as both parts; of a structure's its text ``...Unit`` with it."""
    columns = {name: values.ravel() for name, values in content.arrays.items()}
    for name, values in content.complexes.items():
        columns |= {f"{name}.real": values.real.ravel(), f"{name}.imag": values.imag.ravel()}
    texts = {name: one[0] for name, one in content.texts.items() if one}
    for name in [name for name in columns if f"{name}Unit" in texts]:
        group = name.rpartition(".")[0]
        unit = texts[f"{name}Unit"].replace("TimeUnit", texts.get(f"{group}.TimeUnit", "s"))
        columns[f"{name} [{unit}]"] = columns.pop(name)
    alone = len({name.partition(".")[0] for name in columns}) == 1
    return {name.partition(".")[2] or name if alone else name: one for name, one in columns.items()}


def _table(data: bytes) -> tuple[dict[str, Floats], bool]:
    if data[:2] in UTF_16:
        raise InputError("is UTF-16; allowed: UTF-8 text")
    every = [
        (at, line.strip()) for at, line in enumerate(text_of(data.removeprefix(BOM_UTF8)).splitlines(), 1)
    ]
    plain = [(at, line) for at, line in every if line and line[0] not in "#%"]
    TABLE_ROWS.check(len(plain))
    if not plain:
        raise InputError(f"is empty; allowed: a {column.TABLE}")
    first = next((k for k, (_, line) in enumerate(plain) if _is_row(line)), -1)
    place, line = plain[first]
    if first < 0:
        raise InputError(f"{shown(line)} in line {place} is no row of numbers; allowed: a {column.TABLE}")
    cut = _cut(line)
    rows = [_words(line, cut) for _, line in plain[first:]]
    width = len(rows[0])
    CSV_COLUMNS.check(width)
    for (at, _), row in zip(plain[first:], rows, strict=True):
        if len(row) != width:
            there = f"{len(row)} columns in line {at}, {width} in the first"
            raise InputError(f"{there}; allowed: a {column.TABLE}")
        if wrong := [word for word in row if word.lower() not in NO_VALUE and np.isnan(_number(word, cut))]:
            raise InputError(f"line {at}: {shown(wrong[0])} is no number; allowed: numbers, or nothing")
    above = [_words(line.lstrip("#%!/ "), cut) for at, line in every if at < place]
    head = _heading([words for words in above if len(words) == width])
    if head is None and first:  # no comment, and no heading that is known
        head = _words(plain[first - 1][1], cut)
        if len(head) != width:
            there = f"{len(head)} columns in line {plain[first - 1][0]}, {width} in the rows below"
            raise InputError(f"{there}; allowed: a {column.TABLE}")
    values = np.array([[_number(word, cut) for word in row] for row in rows]).reshape(-1, width)
    names = (head or [*UNTITLED, *(f"column {k}" for k in range(5, width + 1))])[:width]
    apart = [f"{name} ({k})" if name and name in names[: k - 1] else name for k, name in enumerate(names, 1)]
    return dict(zip(apart, values.T, strict=True)), head is not None


def _heading(above: list[list[str]]) -> list[str] | None:
    """The names above a table, each with what a row of units below them says; ``None``: there are none."""
    before, last = above[:-1], above[-1] if above else []
    if before and column.are_units(last) and column.is_heading(before[-1]):
        units = [unit.strip("[]() ") for unit in last]
        return [f"{name} [{unit}]" if unit else name for name, unit in zip(before[-1], units, strict=True)]
    return last if column.is_heading(last) else None


def _cut(line: str) -> str | None:
    return next((sign for sign in ";\t," if sign in line), None)


def _words(line: str, cut: str | None) -> list[str]:
    return [word.strip().strip('"') for word in line.split(cut)]


def _is_row(line: str) -> bool:
    """Whether a line holds two numbers or more, and nothing else."""
    cut = _cut(line)
    words = [word for word in _words(line, cut) if word.lower() not in NO_VALUE]
    return len(words) > 1 and not any(np.isnan(_number(word, cut)) for word in words)


def _number(word: str, cut: str | None) -> float:
    try:
        return float(word.replace(",", ".") if cut in (";", "\t") else word)
    except ValueError:
        return np.nan


def _response(columns: Mapping[str, Floats], name: str, averages: int | None) -> RecordedResponse:
    found = column.roles(columns)
    count = columns[found["frequency"]].size
    taken = {role: columns[own] for role, own in found.items() if columns[own].size in (1, count)}
    if short := [found[role] for role in found if role not in taken]:
        raise InputError(f"{shown(short[0])}: {columns[short[0]].size} values for {count} frequencies")
    table = {role: np.broadcast_to(values, count) for role, values in taken.items()}
    good = np.all([np.isfinite(values) for values in table.values()], axis=0)
    good &= (table.get("coherence", np.ones(count)) != 0.0) & (table["frequency"] != 0.0)
    table = {role: values[good] for role, values in table.items()}
    units = {role: column.unit_of(role, own, table[role]) for role, own in found.items()}
    f = table["frequency"] * column.si_of("frequency", units["frequency"])
    if f.size < 2 or not (f > 0.0).all():
        why = f"{f.size} rows of numbers, frequencies above 0 in {(f > 0.0).sum()}"
        raise InputError(f"{why}; allowed: two rows or more, each at a frequency above 0 Hz")
    z, coherence = column.complex_values(table, units), table.get("coherence", np.full(f.size, np.nan))
    if (odd := coherence[(coherence < 0.0) | (coherence > 1.0)]).size:
        per_cent = ", a ratio and not per cent" * bool((coherence[coherence > 1.0] <= 100.0).any())
        raise InputError(f"a coherence of {odd[0]:g}; allowed: 0 to 1{per_cent}")
    if not np.isfinite(z).all() or (z == 0.0).any():
        raise InputError("a value that is 0 or beyond the range of floats")
    beside = {own: columns[own] for own in columns if own not in found.values()}
    column.refuse_contradiction(beside, f, z, good)
    deviation, radius, noise = column.noise_of(table, units, averages)
    left_out, read_as = count - int(good.sum()), column.taken_as(columns, found, units, known=bool(noise))
    read = _averaged(RecordedResponse(f, z, deviation, coherence, name, left_out, radius, noise))
    if (few := read.frequency_hz).size < 2:
        raise InputError(f"every row is at {few[0]:.6g} Hz; allowed: two frequencies or more")
    if twice := f.size - few.size:
        read_as += f"; rows that repeat a frequency are averaged ({twice})"
    period_s = float(table[column.PERIOD][0]) if column.PERIOD in table else None
    return replace(read, read_as=read_as, period_s=period_s)


def _averaged(read: RecordedResponse) -> RecordedResponse:
    """Each frequency once, rising: mean and scatter of its rows; the same value again is the same row."""
    f, z = read.frequency_hz, read.response
    order = np.lexsort((z.imag, z.real, f))
    kept = order[np.append(True, (np.diff(f[order]) != 0.0) | (np.diff(z[order]) != 0.0))]
    once = replace(read, **{name: getattr(read, name)[kept] for name in _COLUMNS})
    first = np.flatnonzero(np.diff(once.frequency_hz, prepend=-1.0) > 0.0)
    if first.size == kept.size:
        return once
    count = np.diff(first, append=kept.size)

    def mean(values: Floats) -> Floats:
        return np.asarray(np.add.reduceat(values, first) / count)

    z = np.asarray(np.add.reduceat(once.response, first) / count, dtype=np.complex128)
    if not z.all():
        raise InputError("repeats whose mean is 0; allowed: values that do not cancel")
    size, own = np.abs(z), np.abs(once.response)
    errors = (once.deviation, once.radius)
    deviation, radius = (np.sqrt(mean((one * own) ** 2) / count) / size for one in errors)
    f, coherence = once.frequency_hz[first], mean(once.coherence)
    made = replace(once, frequency_hz=f, response=z, deviation=deviation, coherence=coherence, radius=radius)
    if np.isfinite(radius).all():
        return made
    squared = np.add.reduceat(np.abs(once.response - np.repeat(z, count)) ** 2, first)
    scatter, freedom = scatter_of_repeats(size, squared, count)
    if freedom.min() < NEIGHBOURS // 2:  # neighbours tell it as surely
        return made
    radius = scatter / size * student(freedom, CONFIDENCE)
    return replace(made, deviation=scatter / size, radius=radius, noise="scatter of repeats")
