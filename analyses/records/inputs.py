"""The account of a file's columns, and the layout that their names tell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown
from analyses.records.naming import MEANINGS, NOT_NEEDED, is_time, signal_of, taken_apart
from analyses.records.record import InputColumn, Record
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn

NOT_USED = "not needed for this"
NO_SIGNAL = "not named as a signal"


@dataclass(frozen=True, kw_only=True)
class InputUse:
    """One column of a file in an analysis: meaning, range in SI, what it was used for or why not."""

    column: str
    meaning: str = "–"
    unit: str = "–"
    low: float | None = None
    high: float | None = None
    si: str = ""
    use: str = ""
    file: str = ""

    @property
    def is_used(self) -> bool:
        return not self.use.startswith("no: ")


def account(record: Record, used: Mapping[str, str]) -> tuple[InputUse, ...]:
    """Every column of a record's file; ``used`` tells for each signal what it was used for."""
    return tuple(_use(record, one, used) for one in record.inputs)


def _use(record: Record, one: InputColumn, used: Mapping[str, str]) -> InputUse:
    unit, note = one.unit or "–", f" ({one.note})" if one.note else ""
    if one.signal == "time":
        meaning, si = f"time, every {1e3 * record.period_s:.6g} ms", "s"
        values, use = record.time_s, "time"
    elif one.signal in record.signals:
        meaning, si = MEANINGS.get(one.signal, one.signal), record.units.get(one.signal, "")
        values, use = record[one.signal], used.get(one.signal, f"no: {NOT_USED}")
    else:
        why = f"no: {one.note or NOT_USED}" + note * bool(one.signal)
        return InputUse(column=one.column, unit=unit, use=why)
    low, high = float(np.min(values)), float(np.max(values))
    return InputUse(column=one.column, meaning=meaning, unit=unit, low=low, high=high, si=si, use=use + note)


def lacking(record: Record, why: str) -> InputError:
    """What a record lacks, and which columns of its file were not read, and why."""
    left = "; ".join(f"{shown(one.column)}: {one.note}" for one in record.inputs if not one.signal)
    why += f"; of its columns were not read, unless a record file (TOML) says what they are: {left}" * bool(
        left
    )
    return InputError(why, where=record.name)


def inputs_of(spec: RecordSpec, columns: Sequence[str]) -> tuple[InputColumn, ...]:
    """Every column that was read, the time first, and those that were not."""

    def name(column: str | int) -> str:
        return columns[column - 1] if isinstance(column, int) and column <= len(columns) else str(column)

    time = spec.time
    made = [InputColumn(column=name(s.column), signal=s.name, unit=s.unit, note=s.note) for s in spec.signals]
    if time.column is not None:
        unit = f"ticks of {time.tick_s:g} s" if time.tick_s else time.unit
        made.insert(0, InputColumn(column=name(time.column), signal="time", unit=unit))
    read = {name(column) for column in spec.columns(columns)}
    return (*made, *(InputColumn(column=c, note=NO_SIGNAL) for c in columns if c not in read))


def spec_of_names(
    columns: Sequence[str], layout: CsvFormat | None = None
) -> tuple[RecordSpec | None, Mapping[str, str]]:
    """The layout that column names such as ``time_s`` and ``Motor speed [rpm]`` tell.

    None without a time or without any signal that is known; and for each column that is not read: why.
    """
    times: list[str] = []
    signals: dict[str, SignalColumn] = {}
    why: dict[str, str] = {}
    for column in columns:
        name = _own_name(column)
        if is_time(name):
            times.append(column)
            continue
        found = _signal(column, name)
        if isinstance(found, str):
            why[column] = found
            continue
        before = signals.setdefault(found.name, found)
        if before is not found:  # behind a coupling the output's column is not the motor's
            new, old = (taken_apart(str(one.column)).base for one in (found, before))
            behind = new.startswith("output_") and old.startswith("motor_")
            taken, other = (found, before) if behind else (before, found)
            why[str(other.column)] = f"{MEANINGS[found.name]} is read from {taken.column}"
            signals[found.name] = taken
    first, *others = times or [""]
    why |= dict.fromkeys(others, f"the time is read from {first}")
    if not first or not signals:
        lacks = "no column of the time; allowed: one such as time_s, or time.period_s in a record file"
        return None, ({"time": lacks} if signals else {}) | why
    time = TimeColumn(column=first, unit=taken_apart(_own_name(first)).unit or "s")
    return RecordSpec(format=layout or CsvFormat(), time=time, signals=tuple(signals.values())), why


def _own_name(column: str) -> str:
    """The name of a field of a structure, where only that is known."""
    own = column.partition(".")[2]
    return own if not _is_known(column) and _is_known(own) else column


def _is_known(name: str) -> bool:
    parts = taken_apart(name)
    return is_time(name) or (parts.unit is not None and signal_of(parts.base, parts.unit) is not None)


def _signal(column: str, name: str) -> SignalColumn | str:
    """The signal of one column by its name or, where there is none, the reason."""
    parts = taken_apart(name)
    if parts.unit is None:
        known = parts.base in MEANINGS or any(signal_of(parts.base, u) for u in ("rad", "A", "V", "N*m"))
        return "has no unit in its name" if known else "no name that is known"
    if NOT_NEEDED.get(parts.base) == parts.unit:
        return "the position once more"
    signal = signal_of(parts.base, parts.unit)
    if signal is None:
        return "no name and unit that are known together"
    return SignalColumn(name=signal.name, column=column, unit=parts.unit, value="rms" if parts.rms else "dc")
