"""Values missing in some rows, as of signals logged at several rates, taken from their neighbours."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator_lti.errors import InputError
from analyses.estimation.arrays import FloatArray
from analyses.records.record import RowCounts, line_error


def filled(
    time_s: FloatArray, signals: Mapping[str, FloatArray], tolerance: float, where: str
) -> tuple[dict[str, FloatArray], tuple[str, ...]]:
    """Signals without holes, linear between the values that there are; outside them the nearest is held.

    Returns
    -------
    signals : dict
    notes : tuple of str
        What was filled, and the error of a straight line over one step of the values that there are.

    Raises
    ------
    InputError
        If a signal has fewer than three values, or the error exceeds ``tolerance`` of its range.
    """
    whole, notes = {}, []
    for name, values in signals.items():
        there = ~np.isnan(values)
        if there.all():
            whole[name] = values
            continue
        if np.count_nonzero(there) < 3:
            raise InputError(f"{name}: {np.count_nonzero(there)} values, three wanted", where=where)
        error = 0.25 * line_error(time_s[there], values[there], 2.0)
        gaps = int(np.count_nonzero(~there))
        note = (
            f"{name}: {gaps} of {len(values)} values missing, linear between the others, "
            f"error up to {100.0 * error:.2g} % of the range"
        )
        if error > tolerance:
            allowed = f"allowed: {100.0 * tolerance:g} % (resample_tolerance of a record file)"
            raise InputError(f"{note}; {allowed}", where=where)
        whole[name] = np.interp(time_s, time_s[there], values[there])
        notes.append(note)
    return whole, tuple(notes)


def several_rates(counts: RowCounts) -> tuple[str, ...]:
    """A word where most rows were dropped for a missing value."""
    lacking = counts.dropped.get("with a missing value", 0)
    if 2 * lacking <= counts.rows_in:
        return ()
    return (
        f"{lacking} of {counts.rows_in} rows lack a value and are dropped: for signals logged at several "
        'rates give missing = "interpolate" in a record file',
    )
