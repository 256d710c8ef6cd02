"""Layouts of published records: the EMPS benchmark's MATLAB file, and the ODrive recorder's CSV."""

from __future__ import annotations

from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn

EMPS_SPEC = RecordSpec(
    time=TimeColumn(column="t"),
    signals=(
        SignalColumn(name="position", column="qm", unit="m"),
        SignalColumn(name="position_reference", column="qg", unit="m"),
        SignalColumn(name="voltage", column="vir", unit="V"),
    ),
)
ODRIVE_SPEC = RecordSpec(
    format=CsvFormat(comment="%", row_end=";", names=("timestep", "voltage", "position", "velocity")),
    time=TimeColumn(column="timestep", tick_s=1.0 / 8000.0, minimum=1.0),
    signals=(
        SignalColumn(name="voltage", column="voltage", unit="V"),
        SignalColumn(name="angle", column="position", unit="turn"),
        SignalColumn(name="speed", column="velocity", unit="turn/s"),
    ),
)
