"""Numbers as a reader wants them: few digits, no exponent where none is needed, a true minus sign."""

import math
import re
from collections.abc import Callable, Iterable
from typing import Any

from actuator_lti.asked.quantities import unit_words

MISSING = "–"
LONG_S = 1.0  # a time from which on it is no longer told in ms
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def show(value: Any, format: str = "text") -> str:
    """Write a table's value in the column's format (see `reports.document.column`).

    >>> show(2737.31, "sig:3"), show(0.0000612, "sig:3"), show(-3.04, "fix:1"), show(6.0), show(None)
    ('2737', '6.12×10⁻⁵', '−3.0', '6', '–')
    """
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    kind, _, digits = format.partition(":")
    if kind == "ms":  # a time in ms; a long one says its own unit
        return seconds(value / 1e3) if abs(value) >= 1e3 * LONG_S else significant(value, int(digits))
    if kind == "int":
        return to_minus(f"{value:.0f}")
    kinds: dict[str, Callable[[float, int], str]] = {"fix": fixed, "gain": gain_margin, "sig": significant}
    return kinds.get(kind, short)(value, int(digits or 4))


def fixed(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return to_minus(text.lstrip("-") if float(text) == 0 else text)


def gain_margin(decibel: float, decimals: int) -> str:
    """Write a gain margin in dB; one below 0 dB is that down to which the gain may fall.

    >>> gain_margin(9.54, 1), gain_margin(-3.64, 1)
    ('9.5', 'down to −3.6')
    """
    return f"{'down to ' if decibel < 0.0 else ''}{fixed(decibel, decimals)}"


def short(value: float, digits: int = 4) -> str:
    head, cross, power = significant(value, digits).partition("×")
    return (head.rstrip("0").rstrip(".") if "." in head else head) + cross + power


def significant(value: float, digits: int = 3) -> str:
    """Write a number with so many significant digits (more where its whole part has more, up to six)."""
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if -4 <= exponent < 6:
        return to_minus(f"{value:.{max(digits - 1 - exponent, 0)}f}")
    mantissa, _, power = f"{value:.{digits - 1}e}".partition("e")
    return to_minus(mantissa) + "×" + power_of_ten(int(power))


def show_signed(value: float | None, digits: int = 3) -> str:
    return MISSING if value is None else ("+" if value > 0 else "") + significant(value, digits)


def power_of_ten(exponent: int) -> str:
    return "10" + str(exponent).translate(_SUPERSCRIPT)


def or_none(value: float | None, digits: int = 4) -> str:
    """Write a number within a sentence; "none" where there is none."""
    return "none" if value is None else significant(value, digits)


def seconds(value: float) -> str:
    """Write a duration with the unit that suits it.

    >>> seconds(0.01234), seconds(3.2e-4), seconds(0.4705), show(470.5, "ms:3")
    ('12.3 ms', '320 µs', '470 ms', '470')
    """
    scale, unit = time_unit(value)
    return f"{float(f'{value * scale:.12g}'):.3g} {unit}"  # a tie is one in any unit


def time_unit(span_s: float) -> tuple[float, str]:
    """Choose s, ms or µs for a span, with the factor from seconds."""
    if span_s >= 1.0:
        return 1.0, "s"
    return (1e3, "ms") if span_s >= 1e-3 else (1e6, "µs")


def row_unit(unit: str, values: Iterable[float | None]) -> tuple[float, str]:
    """The unit in which a row is shown, with the factor to it: of times ms, or s where one of them is long.

    >>> row_unit("s", [0.023, None]), row_unit("s", [0.023, 23.0]), row_unit("N*m", [0.023])
    ((1000.0, 'ms'), (1.0, 's'), (1.0, 'N m'))
    """
    known = [abs(value) for value in values if value is not None and math.isfinite(value)]
    short_times = unit == "s" and max(known, default=0.0) < LONG_S
    return (1e3, "ms") if short_times else (1.0, unit_words(unit))


def plain_decade(value: float) -> str:
    """Write a tick such as 0.1, 10, 1k.

    >>> plain_decade(0.01), plain_decade(100.0), plain_decade(2e4), plain_decade(1e-6)
    ('0.01', '100', '20k', '10⁻⁶')
    """
    for scale, letter in ((1e6, "M"), (1e3, "k")):
        if scale <= value < 1e9:
            return f"{value / scale:.6g}{letter}"
    if 1e-4 <= value < 1e9:
        return f"{value:.6g}"
    words = short(value, 2)
    return words[2:] if words.startswith("1×") else words


def hertz(value: float) -> str:
    """Write a frequency with its unit.

    >>> hertz(88.457), hertz(1909.4)
    ('88.5 Hz', '1.91 kHz')
    """
    return f"{short(value / 1e3, 3)} kHz" if value >= 1e3 else f"{short(value, 3)} Hz"


def capital(words: str) -> str:
    return words[:1].upper() + words[1:]


_POWER = re.compile(r"(?<![\w.])([+-]?\d(?:\.\d+)?)e([+-]\d+)\b")
_MINUS = re.compile(r"(?<![\w)\]=`'\"-])-(?=\d)")


def prose(text: str) -> str:
    """Write the numbers of a sentence as its tables do: no exponent where none is needed, a true minus.

    >>> prose("off by 1.29e+03 deg, allowed 1e-09; -3 dB on 2026-11-23")
    'off by 1290 deg, allowed 10⁻⁹; −3 dB on 2026-11-23'
    """
    return _MINUS.sub("\N{MINUS SIGN}", _POWER.sub(_plain, text))


def _plain(power: re.Match[str]) -> str:
    digits = sum(map(str.isdigit, power[1]))
    return "+" * power[1].startswith("+") + significant(float(power[0]), digits).removeprefix("1×")


def to_minus(text: str) -> str:
    return text.replace("-", "−")
