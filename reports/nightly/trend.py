"""The course of a figure over the nights: where it changed for good, and whether it flaps.

Change points are those of the penalised least-squares segmentation into constant levels, exact by PELT
(Killick, Fearnhead, Eckley 2012; ruptures, linear kernel), penalty ``2 sigma^2 log n``, with sigma from the
median absolute first difference and never below a third of the figure's tolerance; steps of the level
smaller than the tolerance are dropped.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reports.nightly.text import to_seconds

WINDOW = 14
LOOK_BACK = 365  # nights in which changes of level are looked for: the search takes their square
RETURNS = 2
_GAP_FACTOR = 1.75


@dataclass(frozen=True, kw_only=True)
class ChangePoint:
    """A night from which on the level is another: index into the values, level before and after."""

    index: int
    before: float
    after: float


def change_points(values: np.ndarray, tolerance: float) -> tuple[ChangePoint, ...]:
    """Find the nights (values, NaN where there is none) at which the level of a figure changed.

    Steps that are smaller than the tolerance, in the unit of the values, do not count.

    Examples
    --------
    >>> import numpy as np
    >>> [p.index for p in change_points(np.array([1.0, 1.0, np.nan, 1.0, 2.0, 2.0]), 0.1)]
    [4]
    """
    there = np.flatnonzero(np.isfinite(values))
    x = values[there]
    if len(x) < 2 or np.ptp(x) <= tolerance:
        return ()
    noise = float(np.median(np.abs(np.diff(x)))) / (0.6745 * math.sqrt(2.0))
    scale = max(noise, tolerance / 3.0, 1e-12 * float(np.max(np.abs(x))))
    ends, z = [1], (x - x[0]) / scale
    if len(x) > 2:
        import ruptures

        search = ruptures.KernelCPD(kernel="linear", min_size=1)
        ends = search.fit_predict(z.reshape(-1, 1), pen=2.0 * math.log(len(x)))[:-1]
    levels = [float(np.mean(part)) for part in np.split(x, ends)]
    return tuple(
        ChangePoint(index=int(there[end]), before=before, after=after)
        for end, before, after in zip(ends, levels[:-1], levels[1:], strict=True)
        if abs(after - before) > tolerance
    )


def flaps(values: np.ndarray, tolerance: float) -> bool:
    """Whether a figure goes to and fro: within 14 nights twice or more back to where it was before.

    Examples
    --------
    >>> import numpy as np
    >>> flaps(np.array([1.0, 2.0, 1.0, 2.0]), 0.1), flaps(np.array([1.0, 1.0, 2.0, 2.0]), 0.1)
    (True, False)
    """
    x = values[np.isfinite(values)][-WINDOW:]
    if len(x) < 4:
        return False
    levels = x[np.concatenate([[True], np.abs(np.diff(x)) > tolerance])]
    returns = np.abs(levels[2:] - levels[:-2]) <= tolerance
    return int(np.count_nonzero(returns)) >= RETURNS


def missing_nights(starts: Sequence[str]) -> tuple[tuple[int, int], ...]:
    """Nights without a run: ``(index of the run before the gap, how many are missing)``.

    A gap is a pause longer than 1.75 times the usual one (the median of the last 60).

    Examples
    --------
    >>> missing_nights(["2026-01-0%dT02:00:00Z" % d for d in (1, 2, 3, 6, 7)])
    ((2, 2),)
    """
    pauses = np.diff([to_seconds(start) for start in starts])
    usual = float(np.median(pauses[-60:])) if len(pauses) >= 3 else 0.0
    if usual < 3600.0:
        return ()
    return tuple(
        (int(i), max(1, round(pauses[i] / usual) - 1)) for i in np.flatnonzero(pauses > _GAP_FACTOR * usual)
    )
