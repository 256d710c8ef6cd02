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

from actuator_lti.compiled.kinds import Function, named, stored

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


class Known(ast.NodeTransformer):
    """Puts the known numbers of a form into a function, and takes out what they decide."""

    def __init__(self, form: Form, function: Function) -> None:
        self.form, self.function = form, function
        names = stored(function.tree)
        self.once = {name for name in names if names.count(name) == 1}
        self.told: dict[str, bool] = {}  # variables that are a known test

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.copy_location(ast.Constant(self.told[node.id]), node) if node.id in self.told else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        place = named(node.slice, self.function.scope)
        row = isinstance(node.value, ast.Name) and node.value.id == self.form.row
        if row and type(place) is int and place in self.form.known:
            return ast.copy_location(ast.Constant(self.form.known[place]), node)
        return self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> ast.stmt | None:
        self.generic_visit(node)
        target, value = node.targets[0], value_of(node.value, self._number)
        if isinstance(target, ast.Name) and target.id in self.once and isinstance(value, bool):
            self.told[target.id] = value
            return None
        return node

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        node.test = self.visit(node.test)
        value = value_of(node.test, self._number)
        if value is None:
            return self.generic_visit(node)
        kept = ast.Module(node.body if value else node.orelse, [])
        return list(self.generic_visit(kept).body)  # type: ignore[attr-defined]

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        self.generic_visit(node)
        value = value_of(node.test, self._number)
        return node if value is None else node.body if value else node.orelse

    def _number(self, node: ast.expr) -> Any:
        """A named number of another module."""
        value = named(node, self.function.scope) if isinstance(node, ast.Attribute) else None
        return value if type(value) in (int, float) else None


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
