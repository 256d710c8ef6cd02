"""Which amperes: the simulated current of an AC motor is that of its DC equivalent, not the data sheet's."""

import re
from collections.abc import Mapping
from typing import Any

from actuator_lti.design.model import Design
from actuator_lti.design.plant import DC_PER_A

_OTHER = r"\bA\b(?! ?(?:dc|rms|pe?a?k|phase)|\()"
_BEFORE = r"(?:(?<=\d )|(?<=[Nm]/))"  # a number or a torque per
_WHERE = {"unit": "", "label": "(?<=, )", **dict.fromkeys(("result", "text", "reason", "note"), _BEFORE)}
_SHEETS = {"rms-line": "rms", "peak-phase": "peak of a phase"}
_WORDS = {key: re.compile(before + _OTHER) for key, before in _WHERE.items()}


def in_amperes(value: Any, design: Design | None, key: str = "") -> Any:
    """Plain data of a design's results with ``A dc`` for A, where its file has several amperes.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> in_amperes({"result": "A limit of 2 A, 3 A rms, kM 4 N/A", "unit": "A"}, load_design("ballscrew"))
    {'result': 'A limit of 2 A dc, 3 A rms, kM 4 N/A dc', 'unit': 'A dc'}
    """
    if design is None or design.motor.constants == "dc":
        return value
    if isinstance(value, str):
        return _WORDS[key].sub("A dc", value) if key in _WORDS else value
    if isinstance(value, Mapping):
        made = {name: in_amperes(one, design, name) for name, one in value.items()}
        if made.get("kind") == "table" and made != value:
            constants = design.motor.constants
            same = f"1 A {_SHEETS[constants]} is {DC_PER_A[constants]:#.4g} A dc."
            made["note"] = f"{made['note']} {same}".strip()
        return made
    return [in_amperes(one, design, key) for one in value] if isinstance(value, list | tuple) else value
