"""What is done with the keys of a design on the way to its row, one statement a line: data, and its C."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from actuator_lti.compiled.kinds import c_float

Term = str | float  # a key "k[3]", an earlier value "v7", or a number
SIGNS = frozenset({"+", "-", "*", "/", "<", "<=", ">", ">=", "==", "!=", "&&", "||"})
_ENDS = {"end": "}", "allowed": "return 1;"}


@dataclass(frozen=True)
class Statement:
    """One step: a value of some terms, a condition on them, or a place of the row that gets one.

    Where another outcome of a condition is followed too, a branch with its end stands for the condition;
    each way ends with all being allowed, or a refusal.
    """

    kind: Literal["value", "condition", "store", "branch", "end", "allowed", "refusal"]
    target: int = 0  # number of the value, place in the row; of a condition or branch 1 where it has to hold
    # A sign between two terms, the name of a function of the C library, `where` (condition, yes, no),
    # `zero_below` (value, least), or empty for the term itself; of a refusal its words, the form of `printf`
    # where a term is shown
    does: str = ""
    terms: tuple[Term, ...] = ()

    @property
    def c(self) -> str:
        """The statement in C, of the rows ``k`` (keys) and ``p`` (parameters)."""
        if self.kind in _ENDS:
            return _ENDS[self.kind]
        if self.kind == "refusal":
            shown = ", ".join((self.does, *map(str, self.terms)))
            return f"(void)snprintf(why, size, {shown}); return 0;"
        text = self._expression()
        if self.kind == "value":
            return f"const double v{self.target} = {text};"
        if self.kind == "store":
            return f"p[{self.target}] = {text};"
        then = "{" if self.kind == "branch" else "{ return 0; }"
        return f"if ({'!' if self.target else ''}({text})) {then}"

    def _expression(self) -> str:
        words = [term if isinstance(term, str) else c_float(term) for term in self.terms]
        if self.does in SIGNS:
            return f" {self.does} ".join(words) if len(words) > 1 else f"{self.does}{words[0]}"
        return f"{self.does}({', '.join(words)})" if self.does else words[0]

    @property
    def data(self) -> list[Term]:
        """The statement for JSON: kind, target, what it does, terms; numbers that JSON lacks as text."""
        finite = (each if isinstance(each, str) or abs(each) < math.inf else str(each) for each in self.terms)
        return [self.kind, self.target, self.does, *finite]


def used(statements: Sequence[Statement]) -> tuple[Statement, ...]:
    """Statements without the values that nothing asks for."""
    kept: list[Statement] = []
    wanted: set[Term] = set()
    for statement in reversed(statements):
        if statement.kind == "value":
            name = f"v{statement.target}"
            if name not in wanted:
                continue
            wanted.remove(name)  # another branch may have another of this name
        wanted |= {*statement.terms}
        kept.append(statement)
    return tuple(reversed(kept))
