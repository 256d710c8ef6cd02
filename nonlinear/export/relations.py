"""The relations between the keys of a design as C, found by running the checks of a design on traced values.

Each comparison that a check makes is turned over: where the check then refuses, that is a relation, in the
check's own words; where it does not, the check is followed from there.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from actuator_lti.design.access import stacked
from actuator_lti.design.checks import RELATIONS
from actuator_lti.design.model import Design
from actuator_lti.design.parameters import FrozenMap
from actuator_lti.errors import InputError
from nonlinear.export.program import c_text
from nonlinear.export.trace import Key, Tape, Traced, used_statements

MOST_TURNS = 2  # branches beside the design's own that are followed; beyond: another structure
BEYOND = "these parameters ask for another structure: export the changed design again"
_SHOWN = re.compile(r"\x01([^\x02]*)\x02([^\x03]*)\x03")


@dataclass
class _Way(Tape):
    """One way through a check: the first outcomes of comparisons are told, the rest those of the values."""

    told: Sequence[bool] = ()
    outcomes: list[bool] = field(default_factory=list)

    def condition(self, text: str, outcome: bool) -> bool:
        """Note a comparison among the statements."""
        number = len(self.outcomes)
        self.outcomes.append(self.told[number] if number < len(self.told) else outcome)
        self.lines.append(f"?{text}")
        return self.outcomes[-1]


def relation_functions(design: Design, keys: Sequence[Key]) -> list[list[str]]:
    """Statements of C functions of ``(k, why, size)``: 0 where keys contradict each other, and why."""
    bare = replace(design, parameters=FrozenMap({}))  # values are shown as they are then, not as written
    ways = [_followed(bare, keys, check, (), 0) for check in RELATIONS]
    return [list(used_statements(lines)) for lines in ways if _refuses(lines)]


def _followed(
    design: Design, keys: Sequence[Key], check: Any, told: tuple[bool, ...], turns: int
) -> list[str]:
    """What a check does behind the outcomes that are told."""
    way = _Way(loose=True, told=told)
    values = {key.path: Traced(way, f"k[{n}]", key.value) for n, key in enumerate(keys)}
    end = ["return 1;"]
    try:
        check(stacked(design, values), "")
    except InputError as refusal:
        end = _refusal(refusal.message)
    except ArithmeticError:  # a turn that no values take: those of the keys' ranges never come here
        end = _refusal(BEYOND)
    lines: list[str] = []
    number = 0
    for line in way.lines:
        if not line.startswith("?"):
            lines += [line] if number >= len(told) else []
            continue
        if number >= len(told):
            before, outcome = tuple(way.outcomes[:number]), way.outcomes[number]
            beyond = turns > MOST_TURNS
            body = (
                _refusal(BEYOND)
                if beyond
                else _followed(design, keys, check, (*before, not outcome), turns + 1)
            )
            if _refuses(body):
                sign = "!" if outcome else ""
                lines += [f"if ({sign}({line[1:]})) {{", *(f"    {more}" for more in body), "}"]
        number += 1
    return lines + end


def _refuses(lines: Sequence[str]) -> bool:
    return any("return 0;" in line for line in lines)


def _refusal(text: str) -> list[str]:
    """A message that shows the values of then."""
    parts = _SHOWN.sub("\x01", text.replace("%", "%%")).split("\x01")
    forms = [form for form, _ in _SHOWN.findall(text)]
    named = "".join(
        part + (f"%{form}" if form else "") for part, form in zip(parts, [*forms, ""], strict=True)
    )
    arguments = "".join(f", {name}" for _, name in _SHOWN.findall(text))
    return [f"(void)snprintf(why, size, {c_text(named)}{arguments});", "return 0;"]
