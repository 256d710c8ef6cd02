"""What each number of the flat rows is: name, words and unit, read from the layout of the kernels.

They are the comments behind each name in ``nonlinear/_kernels/layout.py``; units are SI, motor side (linear
axis: read N for N m, m for rad, kg for kg m2).
"""

from __future__ import annotations

import inspect
import re
from functools import cache

from actuator_lti.drive.signals import LIMITERS
from nonlinear._kernels import layout as at

_LINE = re.compile(
    r"^\s*(?P<name>[A-Z][A-Z_0-9]*)(?:,|(?:: \w+)? =[^#]*)\s*"
    r"(?:#\s*(?P<words>[^\[]*?)\s*(?:\[(?P<unit>.*)\])?)?$"
)
_SECTION = ("b0", "b1", "b2", "a1", "a2")
# places of a run's row without a name of their own: what, first, behind the last, parts of one
_GROUPS = (
    ("command signal", at.COMMAND, at.BIAS, ()),
    ("bias signal", at.BIAS, at.PROBES, ()),
    *((f"probe at {point}", at.PROBES + k * at.PROBE_SIZE, at.PROBES + (k + 1) * at.PROBE_SIZE, ())
      for k, point in enumerate(at.POINTS)),
    ("command filter", at.COMMAND_CHAIN, at.SPEED_CHAIN, _SECTION),
    ("speed filter", at.SPEED_CHAIN, at.TORQUE_CHAIN, _SECTION),
    ("torque filter", at.TORQUE_CHAIN, at.MAP, _SECTION),
    ("friction map", at.MAP, at.LIMITS, ("speed", "torque")),
    ("law of one's own, A, row by row,", at.OWN_A, at.OWN_B, ()),
    ("law of one's own, B, row by row,", at.OWN_B, at.OWN_C, ()),
    ("law of one's own, C", at.OWN_C, at.OWN_D, ()),
    ("law of one's own, D", at.OWN_D, at.OWN_L, ()),
    ("law of one's own, L", at.OWN_L, at.OWN_START, ()),
    ("law of one's own, start", at.OWN_START, at.SIZE, ()),
)  # fmt: skip


@cache
def _declared() -> dict[str, tuple[str, str]]:
    """Words and unit of each name of the layout, as they stand there; empty where they do not."""
    found = filter(None, map(_LINE.match, inspect.getsource(at).splitlines()))
    return {each["name"]: (each["words"] or "", each["unit"] or "") for each in found}


def said_of(name: str) -> tuple[str, str]:
    """What the layout says of a name beyond the name itself, and its unit; ``""`` where it says nothing."""
    return _declared().get(name, ("", ""))


@cache
def words() -> dict[str, str]:
    """Words and unit of each name of the layout; the name itself where there are no words."""
    texts = {name: said or name.removeprefix("S_").lower().replace("_", " ")
             for name, (said, _) in _declared().items()}  # fmt: skip
    return {name: f"{text} [{unit}]" if (unit := said_of(name)[1]) else text for name, text in texts.items()}


def names_of(first: int, last: int, begin: str = "") -> list[tuple[str, int]]:
    """Names of the layout whose value lies in ``first <= value < last``, in the order of the values."""
    known = [(name, value) for name, value in vars(at).items() if type(value) is int and name in words()]
    chosen = [(name, value) for name, value in known if first <= value < last and name.startswith(begin)]
    return sorted(chosen, key=lambda item: item[1])


def parameter_names() -> list[tuple[str, int]]:
    """The parameters of a run that stand alone, in the order of the row."""
    return [(name, place) for name, place in names_of(0, at.COMMAND) if name in at.COLUMN_NAMES]


def place_words() -> dict[int, str]:
    """What each place of the row of a run is, for every place from 0 to ``layout.SIZE``."""
    table = {place: f"{name}: {words()[name]}" for name, place in parameter_names()}
    for what, first, behind, parts in _GROUPS:
        for k in range(behind - first):
            number, part = divmod(k, max(len(parts), 1))
            table[first + k] = f"{what} {number + 1}" + (f", {parts[part]}" if parts else "")
    own = [(name, limiter) for name, limiter in LIMITERS.items() if at.LIMIT[name] >= at.LIMITS]
    return table | {at.LIMIT[name]: f"{limiter.words} [{limiter.unit()}]" for name, limiter in own}
