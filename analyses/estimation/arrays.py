"""Rows that are marked in the arrays of a record."""

import numpy as np

from actuator_lti.types import Mask


def stretches(marked: Mask) -> list[tuple[int, int]]:
    """Where marked rows follow each other: the first, and the one after the last.

    Examples
    --------
    >>> stretches(np.array([True, False, False, True, True]))
    [(0, 1), (3, 5)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], marked.astype(np.int8), [0]]))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def longest(marked: Mask) -> tuple[int, int]:
    """The longest such stretch, the first of equal ones; an empty one where nothing is marked."""
    return max(stretches(marked), key=lambda one: one[1] - one[0], default=(0, 0))


def lasting(marked: Mask, least: int) -> Mask:
    """Marked rows, but for those of stretches shorter than ``least``."""
    out = np.zeros(len(marked), dtype=bool)
    for start, stop in stretches(marked):
        out[start:stop] = stop - start >= least
    return out
