"""How a recorder writes its files: separators, columns, units, and what to do with a bad row."""

import json
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Annotated, Literal

from actuator_lti.design.plant import DC_PER_A
from actuator_lti.design.units import compatible, parse_unit
from actuator_lti.errors import InputError
from analyses.records.naming import KNOWN_UNITS
from analyses.records.record import RESAMPLE_TOLERANCE

Policy = Literal["error", "drop"]
Missing = Literal["error", "drop", "interpolate"]

MISSING_TEXTS = ("", "nan", "NaN", "NAN", "na", "NA", "N/A", "null", "NULL", "-")
AC_FORMS = {
    "A": {"dc": 1.0, "rms": DC_PER_A["rms-line"], "peak": DC_PER_A["peak-phase"]},
    "V": {"dc": 1.0, "rms": 2.0**0.5, "peak": 1.0},
}
"""Factors to the equivalent DC motor (`Design.effective_motor`): i from a line current, u from line-line."""
TO_LINE = 3.0**0.5


@dataclass(frozen=True, kw_only=True)
class CsvFormat:
    """The text layout of a file."""

    separator: str = ","  # one character, or "whitespace": any run of blanks and tabs
    decimal: str = "."
    comment: str = "#"  # begins lines that are counted and passed over
    row_end: str = ""  # closes each row before the line end
    header: bool | None = None  # whether the first line holds the column names; None: without ``names``
    names: tuple[str, ...] = ()
    skip_lines: int = 0
    encoding: str = "utf-8"  # of the header only
    matrix: str = ""  # of a MATLAB file, whose columns are ``names``, or named by a list of texts in the file
    stamps: bool = False  # the time is written as ISO 8601 stamps, read as seconds from the first

    def __post_init__(self) -> None:
        mark, encoding = self.separator, self.encoding
        try:
            ascii_like = "a,1\n".encode(encoding) == b"a,1\n"
        except LookupError:
            ascii_like = False
        odd = mark != "whitespace" and (len(mark) != 1 or mark in "\r\n\"'")
        for wrong, why in (
            (odd, f'separator = "{mark}": one character, or "whitespace"'),
            (self.decimal not in (".", ","), f'decimal = "{self.decimal}": "." or ","'),
            (mark == self.decimal, f'separator and decimal are both "{mark}": they must differ'),
            (not ascii_like, f'encoding = "{encoding}": must be one that extends ASCII, such as utf-8'),
            (self.skip_lines < 0, f"skip_lines = {self.skip_lines}: 0 or more"),
            (self.header is False and not self.names, "header = false: then names are needed"),
        ):
            if wrong:
                raise InputError(why)

    @property
    def has_header(self) -> bool:
        """Whether a line of column names is expected."""
        return not self.names if self.header is None else self.header


@dataclass(frozen=True, kw_only=True)
class TimeColumn:
    """Where the time comes from: a column in a unit of time or of ticks, or, without one, its period."""

    column: str | int | None = None
    unit: str = "s"
    tick_s: Annotated[float | None, "s"] = None  # period of one tick
    wrap: float | None = None  # ticks at which they begin anew
    minimum: float | None = None  # rows whose raw value is below are dropped, and counted
    period_s: Annotated[float | None, "s"] = None

    def __post_init__(self) -> None:
        if (self.column is None) == (self.period_s is None):
            raise InputError("time: give either a column or a period")
        for name, value in (("tick", self.tick_s), ("period", self.period_s), ("wrap", self.wrap)):
            if value is not None and not 0.0 < value < 1e30:
                raise InputError(f"time.{name} = {value}: must be positive")


@dataclass(frozen=True, kw_only=True)
class SignalColumn:
    """One signal; its value in SI is ``(raw + offset) * scale`` converted from ``unit``."""

    name: str  # in the analyses
    # its name, or number from 1; "u - pulses", where the file has no such, is the difference of those it has
    column: str | int
    unit: str = "1"
    scale: float = 1.0
    offset: float = 0.0
    # of an AC motor, for the equivalent DC motor of the model: how a line current or a voltage is written,
    # and whether a voltage is that of a phase to the star point
    value: Literal["dc", "rms", "peak"] = "dc"
    between: Literal["line-line", "phase"] = "line-line"

    def terms(self, there: Collection[str]) -> tuple[tuple[float, str | int], ...]:
        """Sign and column of each part of a sum of columns, where the file has no such column itself.

        >>> SignalColumn(name="voltage", column="u - pulses + 3rd").terms({"u", "pulses", "3rd"})
        ((1.0, 'u'), (-1.0, 'pulses'), (1.0, '3rd'))
        """
        parts = [] if isinstance(self.column, int) else re.split(r"\s+([+-])\s+", self.column)
        if len(parts) < 3 or self.column in there:
            return ((1.0, self.column),)
        signs = [1.0, *(1.0 if sign == "+" else -1.0 for sign in parts[1::2])]
        return tuple(zip(signs, parts[::2], strict=True))

    @property
    def note(self) -> str:
        """What is done beside the conversion of the unit; empty for nothing."""
        parts = [] if self.value == "dc" else [f"{self.value} of AC, as the equivalent DC motor has it"]
        parts += ["of a phase, times root 3"] if self.between == "phase" else []
        parts += [f"scale {self.scale:g}"] if self.scale != 1.0 else []
        parts += [f"offset {self.offset:g}"] if self.offset != 0.0 else []
        return ", ".join(parts)


@dataclass(frozen=True, kw_only=True)
class RecordSpec:
    """Everything needed to read the files of one recorder; rows that are dropped are counted by reason."""

    time: TimeColumn
    signals: tuple[SignalColumn, ...]
    format: CsvFormat = CsvFormat()
    bad_rows: Policy = "error"  # where one holds no numbers: the file is refused, with line, column, reason
    missing: Missing = "drop"  # a value empty or NaN: its row; "interpolate" for signals at several rates
    disorder: Policy = "error"  # where the time does not increase
    resample_tolerance: Annotated[float, ""] = RESAMPLE_TOLERANCE  # see `Record.resampled`

    def __post_init__(self) -> None:
        if not 0.0 < self.resample_tolerance <= 1.0:
            raise InputError(f"resample_tolerance = {self.resample_tolerance}: above 0, up to 100 %")
        if not self.signals:
            raise InputError("signals: at least one is needed")
        names = [signal.name for signal in self.signals]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InputError(f"signals.{twice[0]}: given twice")

    def positions(self, header: Sequence[str], where: str) -> tuple[int, ...]:
        """Where the wanted columns stand (from 0): the time's first, then the signals'."""
        return tuple(_position(column, header, where) for column in self.columns(header))

    def columns(self, there: Collection[str]) -> tuple[str | int, ...]:
        """The columns to be read of a file that has those: the time's first, then those of each signal."""
        time = () if self.time.column is None else (self.time.column,)
        return (*time, *(column for one in self.signals for _, column in one.terms(there)))


def _position(column: str | int, header: Sequence[str], where: str) -> int:
    if isinstance(column, int):
        if not 1 <= column <= len(header):
            raise InputError(f"column {column}: the columns are numbered 1 to {len(header)}", where=where)
        return column - 1
    if column not in header:
        near = get_close_matches(column, header, 1)
        marks = [mark for mark in ";,\t" if mark in header[0]] if len(header) == 1 else []
        hint = f'; did you mean "{near[0]}"? There are: ' if near else "; there are: "
        if marks:
            hint = f"; is separator = {json.dumps(marks[0])} missing? There is: "
        there = ", ".join(f'"{name}"' for name in header[:20])
        raise InputError(f'no column "{column}"{hint}{there}', where=where)
    if header.count(column) > 1:
        raise InputError(f'column "{column}" is there {header.count(column)} times; give its number', where)
    return header.index(column)


def unit_factor(unit: str, known: str | None, what: str) -> float:
    """Factor from ``unit`` to SI; refused where its dimension is not that of ``known``."""
    try:
        result = parse_unit(unit)
        wanted = parse_unit(known) if known is not None else None
    except ValueError as error:
        raise InputError(f'{what}.unit = "{unit}": {error}') from None
    if wanted is not None and not compatible(result, wanted):
        raise InputError(f'{what}.unit = "{unit}": must be a unit like {known}')
    return result.factor


def to_si(signal: SignalColumn) -> tuple[float, str]:
    """The factor of ``raw + offset`` of one signal, and the SI unit of the result.

    >>> factor, unit = to_si(SignalColumn(name="speed", column="n", unit="rpm"))
    >>> round(9000.0 * factor, 3), unit
    (942.478, 'rad/s')
    """
    known = KNOWN_UNITS.get(signal.name)
    factor = unit_factor(signal.unit, known, f"signals.{signal.name}")
    forms = AC_FORMS.get(known or "")
    if forms is None and signal.value != "dc":
        raise InputError(f'signals.{signal.name}.value = "{signal.value}": only of a current or a voltage')
    factor *= 1.0 if forms is None else forms[signal.value]
    factor *= TO_LINE if signal.between == "phase" else 1.0
    return signal.scale * factor, known or f"SI of {signal.unit}"
