"""Which states of the sampled linear drive an analysis has a value for: no name is skipped in silence."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

AT_REST = (
    r"w|W|acc",  # speeds, and the angle gained since the last estimate
    r"speed\d*\..+|estimate\..+|hold_w_meas",  # what is made of the speed
    r"command\..+|ref_prev|rate_prev|rate\..+",  # the command's filter and feed-forward, the command at zero
)
"""Names of states that are zero where the motor rests and the command is zero (`actuator_lti.loops.tick`)."""


def without_value(states: Iterable[str], known: Collection[str], patterns: Iterable[str] = ()) -> list[str]:
    """Give the states that an analysis has no value for, by name or by pattern.

    Examples
    --------
    >>> without_value(("w", "th", "torque1.1"), {"th"}, AT_REST)
    ['torque1.1']
    """
    whole = re.compile("|".join(f"(?:{each})" for each in patterns) or r"(?!)")
    return [name for name in states if name not in known and not whole.fullmatch(name)]
