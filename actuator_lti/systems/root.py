"""Where a function of one number is zero; scipy's own take a tenth of a short command to load."""

from collections.abc import Callable
from typing import Any

from actuator_lti.errors import NumericalError

_ULPS = 2.0**-51


def root(of: Callable[[Any], Any], low: float, high: float, within: float = 0.0) -> float:
    """Where a function is zero between two values at which its signs differ, to four units in the last place.

    Or ``within`` so much. The inverse quadratic through three values where that is monotone, else the middle
    (T. R. Chandrupatla, Adv. Eng. Software 28, 1997). `NumericalError` where the signs do not differ.

    >>> abs(root(lambda x: x * x - 2.0, 0.0, 2.0) - 2.0**0.5) <= 4.0 * 2.0**-52
    True
    """
    a, b, share = float(low), float(high), 0.5
    f_a, f_b = float(of(a)), float(of(b))
    if not min(f_a, f_b) <= 0.0 <= max(f_a, f_b):
        raise NumericalError(f"no change of sign between {a:.6g} and {b:.6g}")
    while f_a and f_b:
        least = max(_ULPS * min(abs(a), abs(b)), 0.5 * within, 5e-324)
        if abs(b - a) <= 2.0 * least:
            break
        x = a + (b - a) * min(max(share, least / abs(b - a)), 1.0 - least / abs(b - a))
        f_x = float(of(x))
        if (f_x > 0.0) == (f_a > 0.0):
            a, f_a, c, f_c = x, f_x, a, f_a
        else:
            a, f_a, b, f_b, c, f_c = x, f_x, a, f_a, b, f_b
        share = _inverse(a, b, c, f_a, f_b, f_c)
    return a if abs(f_a) < abs(f_b) else b


def _inverse(a: float, b: float, c: float, f_a: float, f_b: float, f_c: float) -> float:
    """The share of the way from a to b at which the inverse quadratic is zero; a half where it turns."""
    along, up = (a - b) / (c - b), (f_a - f_b) / (f_c - f_b)
    if not (up * up < along and (1.0 - up) ** 2 < 1.0 - along):
        return 0.5
    return f_a / (f_b - f_a) * f_c / (f_b - f_c) + (c - a) / (b - a) * f_a / (f_c - f_a) * f_b / (f_c - f_b)
