"""A record made ready for an analysis: on a regular grid, and only where the drive is enabled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_lti.errors import InputError
from analyses.records.record import Record


def prepared(record: Record) -> Record:
    """A record on a regular grid, cut to its longest stretch with the drive enabled, both noted."""
    record = record if record.is_regular else record.resampled()
    if "enable" not in record.signals:
        return record
    on = np.concatenate([[0], (record["enable"] > 0.5).astype(np.int8), [0]])
    edges = np.flatnonzero(np.diff(on))
    if not len(edges):
        raise InputError("the drive is never enabled", where=record.name)
    longest = int(np.argmax(edges[1::2] - edges[::2]))
    start, stop = int(edges[::2][longest]), int(edges[1::2][longest])
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
