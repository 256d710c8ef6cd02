"""Rows of a measured response at the same frequency: their mean, and the noise as they scatter."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from actuator_lti.measured.response import CONFIDENCE, NEIGHBOURS, student
from actuator_lti.types import Floats, Ints


@dataclass(frozen=True)
class Repeats:
    """Rows by rising frequency, Hz; deviation and radius are over the size, see RecordedResponse."""

    f: Floats
    z: NDArray[np.complex128]
    deviation: Floats
    coherence: Floats
    radius: Floats
    noise: str

    def averaged(self) -> Repeats:
        """Each frequency once. The same value again is the same row, not another measurement."""
        once = self._without_copies()
        first = np.flatnonzero(np.diff(once.f, prepend=-1.0) > 0.0)
        if first.size == once.f.size:
            return once
        count = np.diff(first, append=once.f.size)

        def mean(values: Floats) -> Floats:
            return np.asarray(np.add.reduceat(values, first) / count)

        z = np.asarray(np.add.reduceat(once.z, first) / count, dtype=np.complex128)
        size, own = np.abs(z), np.abs(once.z)
        deviation, radius = (
            np.sqrt(mean((one * own) ** 2) / count) / size for one in (once.deviation, once.radius)
        )
        made = Repeats(once.f[first], z, deviation, mean(once.coherence), radius, once.noise)
        if np.isfinite(radius).all():
            return made
        off = np.abs(once.z - np.repeat(z, count)) ** 2 / np.repeat(size, count) ** 2
        return made._by_scatter(np.add.reduceat(off, first), count)

    def _without_copies(self) -> Repeats:
        order = np.lexsort((self.z.imag, self.z.real, self.f))
        f, z = self.f[order], self.z[order]
        kept = np.append(True, (np.diff(f) != 0.0) | (np.diff(z) != 0.0))
        return Repeats(
            f[kept], z[kept], self.deviation[order][kept], self.coherence[order][kept],
            self.radius[order][kept], self.noise,
        )  # fmt: skip

    def _by_scatter(self, squared: Floats, count: Ints) -> Repeats:
        """The noise as repeats nearby scatter, where they tell it as surely as neighbours do."""
        width = min(NEIGHBOURS, count.size)
        start = np.clip(np.arange(count.size) - width // 2, 0, count.size - width)
        total, freedom = (
            np.diff(np.append(0, np.cumsum(one))[np.stack((start, start + width))], axis=0)[0]
            for one in (squared, count - 1)
        )
        if freedom.min() < NEIGHBOURS // 2:
            return self
        deviation = np.sqrt(total / freedom / count)
        radius = deviation * student(freedom, CONFIDENCE)
        return replace(self, deviation=deviation, radius=radius, noise="scatter of repeats")
