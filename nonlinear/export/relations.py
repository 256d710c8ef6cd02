"""The relations between the keys of a design as statements: the checks of a design, run on traced values.

Each comparison that a check makes is turned over: where the check then refuses, that is a relation, in the
check's own words; where it does not, the check is followed from there.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from actuator_lti.design.asked import FrozenMap
from actuator_lti.design.checks import FIRST_RELATIONS, RELATIONS
from actuator_lti.design.mistakes import refusal_text
from actuator_lti.design.model import Design
from nonlinear.export.program import c_text
from nonlinear.export.statement import Statement, used
from nonlinear.export.trace import Key, Tape, followed

MOST_TURNS = 2  # branches beside the design's own that are followed; beyond: another structure
BEYOND = "these parameters ask for another structure: export the changed design again"
_SHOWN = re.compile(r"\x01([^\x02]*)\x02([^\x03]*)\x03")


@dataclass
class _Way(Tape):
    """One way through a check: the first outcomes of comparisons are given, the rest those of the values."""

    taken: Sequence[bool] = ()
    outcomes: list[bool] = field(default_factory=list)

    def condition(self, does: str, terms: tuple[Any, ...], outcome: bool) -> bool:
        number = len(self.outcomes)
        self.outcomes.append(self.taken[number] if number < len(self.taken) else outcome)
        return super().condition(does, terms, self.outcomes[-1])


def relation_functions(design: Design, keys: Sequence[Key]) -> list[list[str]]:
    """Statements of C functions of ``(k, why, size)``: 0 where keys contradict each other, and why."""
    return [_indented(way) for way in relation_statements(design, {key.path: key.value for key in keys})]


def relation_statements(design: Design, keys: Mapping[str, float]) -> list[tuple[Statement, ...]]:
    """Each check of a design as statements of its keys, ``k[0]``, ``k[1]``, ... in their order."""
    bare = replace(design, parameters=FrozenMap({}))  # values are shown as they are then, not as written
    ways = [_followed(bare, keys, check, (), 0) for check in (*FIRST_RELATIONS, *RELATIONS)]
    return [used(way) for way in ways if _refuses(way)]


def _followed(
    design: Design, keys: Mapping[str, float], check: Any, taken: tuple[bool, ...], turns: int
) -> list[Statement]:
    """What a check does behind the outcomes given, up to what it refuses first."""
    way = _Way(loose=True, taken=taken)
    end = Statement("allowed")
    try:
        for refusal in check(followed(design, keys, way)):
            end = _refusal(refusal_text(refusal))
            break
    except ArithmeticError:  # a turn that no values take: those of the keys' ranges never come here
        end = _refusal(BEYOND)
    rest, number = [end], len(way.outcomes)
    for statement in reversed(way.statements):
        if statement.kind != "condition":
            rest.insert(0, statement)
            continue
        number -= 1
        if number < len(taken):  # that, and what lies before it, is there already
            break
        turned = (*way.outcomes[:number], not way.outcomes[number])
        deep = turns > MOST_TURNS
        body = [_refusal(BEYOND)] if deep else _followed(design, keys, check, turned, turns + 1)
        if _refuses(body) or _refuses(rest):  # else the outcome makes no difference
            rest = [replace(statement, kind="branch"), *body, Statement("end"), *rest]
    return rest


def _refuses(statements: Sequence[Statement]) -> bool:
    return any(statement.kind == "refusal" for statement in statements)


def _refusal(text: str) -> Statement:
    """A message that shows the values of then."""
    parts = _SHOWN.split(text.replace("%", "%%"))  # words, form, name, words, ...
    words = "".join(part if n % 3 == 0 else f"%{part}" for n, part in enumerate(parts) if n % 3 < 2)
    return Statement("refusal", does=words, terms=tuple(parts[2::3]))


def _indented(statements: Sequence[Statement]) -> list[str]:
    lines: list[str] = []
    depth = 0
    for statement in statements:
        depth -= statement.kind == "end"
        shown = replace(statement, does=c_text(statement.does)) if statement.kind == "refusal" else statement
        lines.append("    " * depth + shown.c)
        depth += statement.kind == "branch"
    return lines
