"""A second form of a function, for rows that hold known numbers: what these rule out costs nothing.

The function and all that it calls are emitted again with the known numbers in their places and without the
branches that these rule out. The arithmetic is the same.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

_COMPARE: dict[type, Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge,
    ast.Eq: operator.eq, ast.NotEq: operator.ne,
}  # fmt: skip


@dataclass(frozen=True)
class Form:
    """The form of a kernel for rows ``row`` that hold known numbers."""

    of: str  # name of the kernel
    name: str  # of the form
    row: str  # argument that holds the known numbers, in every function
    known: Mapping[int, float]  # what stands at which place

    def test(self) -> str:
        """Whether a row holds the known numbers, in C."""
        return " && ".join(f"{self.row}[{place}] == {value!r}" for place, value in self.known.items())


def value_of(node: ast.expr, look: Callable[[ast.expr], Any]) -> Any:
    """What an expression is worth as far as ``look`` knows its parts; None where it does not."""
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        inner = value_of(node.operand, look)
        return None if inner is None else not inner
    if isinstance(node, ast.BoolOp):
        values = [value_of(each, look) for each in node.values]
        decides = isinstance(node.op, ast.Or)
        if any(value is not None and bool(value) is decides for value in values):
            return decides
        return None if None in values else not decides
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
        left, right = value_of(node.left, look), value_of(node.comparators[0], look)
        return None if left is None or right is None else _COMPARE[type(node.ops[0])](left, right)
    return look(node)
