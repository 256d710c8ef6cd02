"""Arrays of one kind of number, as all analyses of records type them, and rows that are marked in them."""

import numpy as np
from numpy.typing import NDArray

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


def stretches(marked: BoolArray) -> list[tuple[int, int]]:
    """Where marked rows follow each other: the first, and the one after the last.

    Examples
    --------
    >>> stretches(np.array([True, False, False, True, True]))
    [(0, 1), (3, 5)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], marked.astype(np.int8), [0]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def longest(marked: BoolArray) -> tuple[int, int]:
    """The longest such stretch, the first of equal ones; an empty one where nothing is marked."""
    return max(stretches(marked), key=lambda one: one[1] - one[0], default=(0, 0))


def lasting(marked: BoolArray, least: int) -> BoolArray:
    """Marked rows, but for those of stretches shorter than ``least``."""
    out = np.zeros(len(marked), dtype=bool)
    for start, stop in stretches(marked):
        out[start:stop] = stop - start >= least
    return out
