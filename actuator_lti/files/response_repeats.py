"""Rows of a measured response at the same frequency: their mean, and the noise as they scatter."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.measured.response import CONFIDENCE, NEIGHBOURS, student
from actuator_lti.types import Floats, Ints

if TYPE_CHECKING:
    from actuator_lti.files.response import RecordedResponse

_COLUMNS = ("frequency_hz", "response", "deviation", "coherence", "radius")


def averaged(read: RecordedResponse) -> RecordedResponse:
    """Each frequency once, rising. The same value again is the same row, not another measurement."""
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
    size, own = np.abs(z), np.abs(once.response)
    deviation, radius = (
        np.sqrt(mean((one * own) ** 2) / count) / size for one in (once.deviation, once.radius)
    )
    f, coherence = once.frequency_hz[first], mean(once.coherence)
    made = replace(once, frequency_hz=f, response=z, deviation=deviation, coherence=coherence, radius=radius)
    if np.isfinite(radius).all():
        return made
    off = np.abs(once.response - np.repeat(z, count)) ** 2 / np.repeat(size, count) ** 2
    return _by_scatter(made, np.add.reduceat(off, first), count)


def _by_scatter(read: RecordedResponse, squared: Floats, count: Ints) -> RecordedResponse:
    """The noise as repeats nearby scatter, where they tell it as surely as neighbours do."""
    width = min(NEIGHBOURS, count.size)
    start = np.clip(np.arange(count.size) - width // 2, 0, count.size - width)
    total, freedom = (
        np.diff(np.append(0, np.cumsum(one))[np.stack((start, start + width))], axis=0)[0]
        for one in (squared, count - 1)
    )
    if freedom.min() < NEIGHBOURS // 2:
        return read
    deviation = np.sqrt(total / freedom / count)
    radius = deviation * student(freedom, CONFIDENCE)
    return replace(read, deviation=deviation, radius=radius, noise="scatter of repeats")
