"""A record made ready for an analysis: on a regular grid, and only where the drive is enabled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_lti.errors import InputError
from analyses.estimation.arrays import longest
from analyses.records.record import Record


def prepared(record: Record) -> Record:
    """A record on a regular grid, cut to its longest stretch with the drive enabled, both noted."""
    record = record if record.is_regular else record.resampled()
    if "enable" not in record.signals:
        return record
    start, stop = longest(record["enable"] > 0.5)
    if start == stop:
        raise InputError("the drive is never enabled", where=record.name)
    if stop - start == len(record):
        return record
    note = (
        f"enabled from {record.time_s[start]:.4g} s to {record.time_s[stop - 1]:.4g} s: "
        f"{stop - start} of {len(record)} rows used"
    )
    return replace(record.slice(start, stop), notes=(*record.notes, note))


def period_of(record: Record) -> float:
    """The period, rounded to a whole number of ns past the rounding of the record's times."""
    return float(round(float(np.mean(np.diff(record.time_s))) * 1e9) * 1e-9)
