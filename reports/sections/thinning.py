"""Long series made short for a figure, with their peaks kept."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
BUCKETS = 300


def kept_rows(series: Sequence[Floats], buckets: int = BUCKETS) -> npt.NDArray[np.int64]:
    """Rows to draw: of each bucket the first, and the smallest and largest of every series.

    Examples
    --------
    >>> import numpy as np
    >>> y = np.zeros(1000)
    >>> y[503] = 1.0
    >>> bool(503 in kept_rows([y], 10))
    True
    """
    rows = len(series[0])
    if rows <= 2 * buckets:
        return np.arange(rows)
    edges = np.linspace(0, rows, buckets + 1).astype(np.int64)
    kept = {0, rows - 1}
    for values in series:
        for start, stop in pairwise(edges):
            part = values[start:stop]
            kept.update((int(start + np.argmin(part)), int(start + np.argmax(part))))
    return np.array(sorted(kept), dtype=np.int64)
