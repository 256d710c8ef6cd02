"""The row of parameters made as long as it has to be, for whichever compiled form fills it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import elastic_layout, layout

Floats = npt.NDArray[np.float64]


def lengthened(row: Floats, put_sizes: Callable[[Floats], None]) -> Floats:
    """The parameters of a run with room for all that is derived, the sizes written already.

    Parameters
    ----------
    row : ndarray, shape (layout.SIZE,)
    put_sizes : callable
        Writes the sizes into a row of ``elastic_layout.EL_LEAST`` numbers.
    """
    head = np.zeros(elastic_layout.EL_LEAST)
    head[: layout.SIZE] = row
    put_sizes(head)
    p = np.zeros(int(head[layout.PARAMETER_SIZE]))
    known = min(p.size, head.size)
    p[:known] = head[:known]
    return p
