"""A number, or ``None`` where there is none."""

from math import isfinite


def finite(value: float) -> float | None:
    """The value as a plain number; ``None`` for NaN and infinities.

    Examples
    --------
    >>> finite(2.0), finite(float("nan"))
    (2.0, None)
    """
    return float(value) if isfinite(value) else None
