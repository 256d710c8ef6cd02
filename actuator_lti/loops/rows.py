"""A signal as a linear combination of states and inputs, by name: what a walk computes with."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np


class Row:
    """``sum_v coefficient[v] * v``; a coefficient is a float, or an array of shape (K,) over stacked designs.

    A name that is not there has no influence, by structure and not by chance.

    >>> e = Row.of("ref") - Row.of("th")
    >>> (2.0 * e + Row.of("th")).terms
    {'ref': 2.0, 'th': -1.0}
    """

    __slots__ = ("terms",)
    __array_ufunc__ = None  # an array times a row is a row

    def __init__(self, terms: dict[str, Any] | None = None) -> None:
        self.terms = {} if terms is None else terms  # its own: nobody else writes them

    @classmethod
    def of(cls, name: str) -> Row:
        return cls({name: 1.0})

    def __add__(self, other: Row) -> Row:
        return total((self, other))

    def __sub__(self, other: Row) -> Row:
        return self + -1.0 * other

    def __mul__(self, factor: Any) -> Row:
        if isinstance(factor, float) and factor == 0.0:
            return Row()
        return Row({name: factor * value for name, value in self.terms.items()})

    __rmul__ = __mul__

    def __truediv__(self, factor: Any) -> Row:
        return self * (1 / factor)

    def __repr__(self) -> str:
        return " + ".join(f"{value} {name}" for name, value in self.terms.items()) or "0"


def total(rows: Iterable[Row]) -> Row:
    result = Row()
    terms = result.terms
    for row in rows:
        for name, value in row.terms.items():
            terms[name] = terms[name] + value if name in terms else value
    return result


def table(rows: Iterable[Row], names: tuple[str, ...]) -> np.ndarray:
    """Coefficients of rows over names, shape (..., rows, names)."""
    listed = list(rows)
    place = {name: k for k, name in enumerate(names)}
    values = (v for row in listed for v in row.terms.values() if not isinstance(v, float))
    out = np.zeros((*np.broadcast_shapes(*{np.shape(v) for v in values}), len(listed), len(names)))
    for r, row in enumerate(listed):
        for name, value in row.terms.items():
            if name in place:
                out[..., r, place[name]] = value
    return out
