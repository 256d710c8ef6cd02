"""Rows that come one after the other, looked at again and again: not joined anew each time."""

import numpy as np
import numpy.typing as npt

from actuator_lti.types import Floats


class Grown:
    """A table to which rows are added.

    >>> table = Grown(2)
    >>> table.add([[1.0, 2.0]])
    >>> table.rows
    array([[1., 2.]])
    """

    def __init__(self, columns: int) -> None:
        self._room, self._count = np.empty((64, columns)), 0

    @property
    def rows(self) -> Floats:
        """All that were added, shape (rows, columns)."""
        return self._room[: self._count]

    def add(self, rows: npt.ArrayLike) -> None:
        """Add some rows, shape (rows, columns)."""
        more = np.asarray(rows)
        count = self._count + len(more)
        if count > len(self._room):
            self._room = np.concatenate([self.rows, np.empty((count, more.shape[1]))])
        self._room[self._count : count], self._count = more, count
