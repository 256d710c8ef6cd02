"""A number, or ``None`` where there is none."""

from math import isfinite


def finite(value: float | None) -> float | None:
    """The value as a plain number; ``None`` for NaN, infinities and nothing.

    >>> finite(2.0), finite(float("nan"))
    (2.0, None)
    """
    return None if value is None or not isfinite(value) else float(value)
