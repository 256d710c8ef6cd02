"""The account of a file's columns, and the layout that their names tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

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
        """Whether the analysis read it."""
        return not self.use.startswith("no: ")


def account(record: Record, used: Mapping[str, str]) -> tuple[InputUse, ...]:
    """Every column of a record's file; ``used`` tells for each signal what it was used for."""
    return tuple(_use(record, one, used) for one in record.inputs)


def _use(record: Record, one: InputColumn, used: Mapping[str, str]) -> InputUse:
    unit, note = one.unit or "–", f" ({one.note})" if one.note else ""
    if one.signal == "time":
        every, si = f"time, every {1e3 * record.period_s:.6g} ms", "s"
        values, use = record.time_s, "time"
    elif one.signal in record.signals:
        every, si = MEANINGS.get(one.signal, one.signal), record.units.get(one.signal, "")
        values, use = record[one.signal], used.get(one.signal, f"no: {NOT_USED}")
    else:
        return InputUse(
            column=one.column, unit=unit, use=f"no: {one.note or NOT_USED}" + note * bool(one.signal)
        )
    return InputUse(
        column=one.column,
        meaning=every,
        unit=unit,
        low=float(np.min(values)),
        high=float(np.max(values)),
        si=si,
        use=use + note,
    )


def inputs_of(spec: RecordSpec, columns: Sequence[str]) -> tuple[InputColumn, ...]:
    """Every column that was read, the time first, and those that were not."""

    def name(column: str | int) -> str:
        return columns[column - 1] if isinstance(column, int) and column <= len(columns) else str(column)

    time = spec.time
    result = []
    if time.column is not None:
        unit = f"ticks of {time.tick_s:g} s" if time.tick_s else time.unit
        result.append(InputColumn(column=name(time.column), signal="time", unit=unit))
    result += [
        InputColumn(column=name(s.column), signal=s.name, unit=s.unit, note=s.note) for s in spec.signals
    ]
    read = {name(column) for column in spec.columns(columns)}
    return (*result, *(InputColumn(column=c, note=NO_SIGNAL) for c in columns if c not in read))


def spec_of_names(
    columns: Sequence[str], layout: CsvFormat | None = None
) -> tuple[RecordSpec | None, Mapping[str, str]]:
    """The layout that column names such as ``time_s`` and ``Motor speed [rpm]`` tell.

    None without a time or without any signal that is known; and for each column that is not read: why.
    """
    layout = CsvFormat() if layout is None else layout
    time: str | None = None
    signals: dict[str, SignalColumn] = {}
    why: dict[str, str] = {}
    own = {column: _own_name(column) for column in columns}
    for column in columns:
        if is_time(own[column]):
            if time is None:
                time = column
            else:
                why[column] = f"the time is read from {time}"
            continue
        result = _signal(column, own[column], why)
        if result is not None and result.name in signals and _at_the_output(column, result, signals):
            before = signals[result.name].column
            why[str(before)] = f"{MEANINGS[result.name]} is read from {column}"
            signals[result.name] = result
        elif result is not None and result.name in signals:
            why[column] = f"{MEANINGS[result.name]} is read from {signals[result.name].column}"
        elif result is not None:
            signals[result.name] = result
    if time is None or not signals:
        return None, why
    unit = taken_apart(own[time]).unit or "s"
    read = TimeColumn(column=time, unit=unit)
    return RecordSpec(format=layout, time=read, signals=tuple(signals.values())), why


def _at_the_output(column: str, result: SignalColumn, signals: Mapping[str, SignalColumn]) -> bool:
    """Whether a column is the output's, where the motor's was taken: behind a coupling they differ."""
    before = signals[result.name].column
    if not isinstance(before, str):
        return False
    return taken_apart(column).base.startswith("output_") and taken_apart(before).base.startswith("motor_")


def _own_name(column: str) -> str:
    """The name of a field of a structure, where only that is known."""
    own = column.partition(".")[2]
    return own if not _is_known(column) and _is_known(own) else column


def _is_known(name: str) -> bool:
    parts = taken_apart(name)
    return is_time(name) or (parts.unit is not None and signal_of(parts.base, parts.unit) is not None)


def _signal(column: str, name: str, why: dict[str, str]) -> SignalColumn | None:
    """The signal of one column by its name; where there is none, the reason is noted."""
    parts = taken_apart(name)
    if parts.unit is None:
        known = parts.base in MEANINGS or any(signal_of(parts.base, u) for u in ("rad", "A", "V", "N*m"))
        why[column] = "has no unit in its name" if known else "no name that is known"
        return None
    if NOT_NEEDED.get(parts.base) == parts.unit:
        why[column] = "the position once more"
        return None
    signal = signal_of(parts.base, parts.unit)
    if signal is None:
        why[column] = "no name and unit that are known together"
        return None
    return SignalColumn(name=signal.name, column=column, unit=parts.unit, value="rms" if parts.rms else "dc")
