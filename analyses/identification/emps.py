"""The measured EMPS record: an electromechanical positioning system with a P-P cascade on a force source."""

from __future__ import annotations

from analyses.records.spec import RecordSpec, SignalColumn, TimeColumn

EMPS_SPEC = RecordSpec(
    time=TimeColumn(column="t"),
    signals=(
        SignalColumn(name="position", column="qm", unit="m"),
        SignalColumn(name="position_reference", column="qg", unit="m"),
        SignalColumn(name="voltage", column="vir", unit="V"),
    ),
)
