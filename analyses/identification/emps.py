"""The measured EMPS record: an electromechanical positioning system with a P-P cascade on a force source."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analyses.identification.differentiation import FloatArray
from analyses.records.mat_reader import read_mat_record
from analyses.records.record import Record
from analyses.records.spec import RecordSpec, SignalColumn, TimeColumn

EMPS_SPEC = RecordSpec(
    time=TimeColumn(column="t"),
    signals=(
        SignalColumn(name="position", column="qm", unit="m"),
        SignalColumn(name="position_reference", column="qg", unit="m"),
        SignalColumn(name="voltage", column="vir", unit="V"),
    ),
)
PERIOD_S = 1e-3


@dataclass(frozen=True, kw_only=True)
class EmpsRecord:
    """Reference and measured position (m) and drive force (N) at 1 kHz."""

    record: Record
    position_m: FloatArray
    reference_m: FloatArray
    force_N: FloatArray
    period_s: float = PERIOD_S


def load_emps(path: str | Path) -> EmpsRecord:
    """Read ``DATA_EMPS.mat``; the force is the drive signal times the gain that the file holds.

    The time of the file has 1e-8 s of rounding noise; the period of 1 ms is used.
    """
    record = read_mat_record(path, EMPS_SPEC, name="emps")
    force = np.asarray(record.constants["gtau"] * record["voltage"])
    return EmpsRecord(
        record=record,
        position_m=record["position"],
        reference_m=record["position_reference"],
        force_N=force,
    )
