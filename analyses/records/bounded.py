"""Holding a stream of rows in bounded memory: when it grows too long, neighbours are averaged."""

from __future__ import annotations

import numpy as np

from analyses.estimation.arrays import FloatArray


class BoundedRows:
    """Collects rows; never holds more than ``2 * limit`` of them.

    Once more than ``limit`` rows are held, every two neighbours become their mean and each new row is a mean
    of twice as many rows of the file. ``factor`` tells how many. A remainder shorter than ``factor`` at
    the end of the file becomes a row of its own, so no row is lost.

    Examples
    --------
    >>> import numpy as np
    >>> rows = BoundedRows(columns=1, limit=4)
    >>> rows.add(np.arange(8.0).reshape(-1, 1))
    >>> rows.array()[:, 0].tolist(), rows.factor
    ([0.5, 2.5, 4.5, 6.5], 2)
    """

    def __init__(self, columns: int, limit: int) -> None:
        self.limit = max(int(limit), 2)
        self.factor = 1
        self._columns = columns
        self._blocks: list[FloatArray] = []
        self._held = 0
        self._rest = np.empty((0, columns))

    def add(self, rows: FloatArray) -> None:
        """Append rows, shape (n, columns)."""
        for start in range(0, len(rows), self.limit):
            self._add(rows[start : start + self.limit])

    def _add(self, rows: FloatArray) -> None:
        if len(self._rest):
            rows = np.concatenate([self._rest, rows])
        whole = len(rows) // self.factor * self.factor
        self._rest = rows[whole:].copy()
        if whole:
            self._blocks.append(_averaged(rows[:whole], self.factor))
            self._held += whole // self.factor
        while self._held > self.limit:
            self._halve()

    def _halve(self) -> None:
        held = np.concatenate(self._blocks)
        even = len(held) // 2 * 2
        odd = np.repeat(held[even:], self.factor, axis=0)
        self._rest = np.concatenate([odd, self._rest])
        self._blocks = [_averaged(held[:even], 2)]
        self._held = even // 2
        self.factor *= 2

    def array(self) -> FloatArray:
        """All rows, shape (m, columns)."""
        blocks = list(self._blocks)
        if len(self._rest):
            blocks.append(self._rest.mean(axis=0, keepdims=True))
        return np.concatenate(blocks) if blocks else np.empty((0, self._columns))


def _averaged(rows: FloatArray, factor: int) -> FloatArray:
    if factor == 1:
        return rows
    mean: FloatArray = rows.reshape(-1, factor, rows.shape[1]).mean(axis=1)
    return mean
