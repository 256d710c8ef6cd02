"""Factors that a wrong unit or a wrong convention leaves behind, by name."""

from collections.abc import Mapping
from math import pi, sqrt

NEAR = 0.03
NEAR_ONE = 0.012
_PLAIN = {
    1e3: "1000 (milli read as one, or the reverse)",
    1e6: "1e6 (micro read as one, or the reverse)",
    100.0: "100 (centi, or per cent, read as one, or the reverse)",
    10.0: "10",
    60.0 / (2.0 * pi): "60/2 pi (rpm read as rad/s, or the reverse)",
    180.0 / pi: "180/pi (degrees read as radians, or the reverse)",
    2.0 * pi: "2 pi (turns read as radians, or the reverse)",
    60.0: "60 (per minute read as per second, or the reverse)",
    6.0: "6 (rpm read as deg/s, or the reverse)",
    sqrt(2.0): "root 2 (rms read as peak, or the reverse)",
    sqrt(3.0): "root 3 (line to line read as phase, or the reverse)",
    sqrt(1.5): "root 3/2 (rms of AC read as the equivalent DC, or the reverse)",
    2.0 / sqrt(3.0): "2/root 3 (peak of AC read as the equivalent DC, or the reverse)",
    1.3558179483314: "1.356 (lbf ft read as N m, or the reverse)",
    141.61193227806: "141.6 (ozf in read as N m, or the reverse)",
}


def named_factor(ratio: float, more: Mapping[float, str] | None = None) -> str | None:
    """The name of a factor within 3 % (1.2 % below 2) of a ratio or of its inverse; None where none is near.

    The ratio is recorded over expected, its sign is told too; ``more`` are factors of the case at hand.

    >>> named_factor(9.56)
    '60/2 pi (rpm read as rad/s, or the reverse)'
    >>> named_factor(-1.001), named_factor(1.18)
    ('-1 (the sign is turned)', None)
    """
    if not abs(ratio) > 0.0:
        return None
    if abs(ratio + 1.0) <= NEAR:
        return "-1 (the sign is turned)"
    size = max(abs(ratio), 1.0 / abs(ratio))
    known = {**_PLAIN, **(more or {})}
    near = [f for f in known if f > 1.0 + NEAR and abs(size / f - 1.0) <= (NEAR if f > 2.0 else NEAR_ONE)]
    if not near:
        return None
    best = min(near, key=lambda factor: abs(size / factor - 1.0))
    turned = ", and the sign is turned" if ratio < 0.0 else ""
    return known[best] + turned


def with_factor(text: str, ratio: float, more: Mapping[float, str] | None = None) -> str:
    """A text and, where a ratio has a name, that."""
    named = named_factor(ratio, more)
    return f"{text}: factor {named}" if named else text


USUAL = {"A": (1e3,), "V": (1e3,), "rad/s": (60.0 / (2.0 * pi), 180.0 / pi, 2.0 * pi), "N m": (100.0, 1e3)}
"""Factors that are usual with a unit, for a value that can only be held against a limit."""


def explaining(over: float, unit: str) -> str | None:
    """The usual factor of a unit that brings a value back below its limit, but not far below it.

    >>> explaining(640.0, "A")
    '1000 (milli read as one, or the reverse)'
    """
    back = [factor for factor in USUAL.get(unit, ()) if 0.05 <= over / factor <= 1.1]
    return _PLAIN[back[0]] if back else None
