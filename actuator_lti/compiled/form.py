"""A second form of a function, for rows that hold known numbers: what these rule out costs nothing.

The function and all that it calls are emitted again with the known numbers in their places and without the
branches that these rule out. The arithmetic is the same.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from actuator_lti.compiled.kinds import named, stored

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

    def look(self, row: str, place: int) -> float | None:
        return self.known.get(place) if row == self.row else None


class Known(ast.NodeTransformer):
    """Puts known numbers into a function, and takes out what they decide.

    ``look`` gives the number at a place of a row, or None.
    """

    kept: tuple[type, ...] = (bool,)  # of a variable assigned once, a known value of this kind is followed

    def __init__(
        self, tree: ast.FunctionDef, scope: Mapping[str, Any], look: Callable[[str, int], float | None]
    ) -> None:
        names, self.scope, self.look = stored(tree), scope, look
        arguments = {argument.arg for argument in tree.args.args}
        self.local = {*names, *arguments}
        self.once = {name for name in names if names.count(name) == 1} - arguments
        self.known: dict[str, Any] = {}

    def block(self, nodes: list[ast.stmt]) -> list[ast.stmt]:
        """Statements that are left; none behind a return."""
        result: list[ast.stmt] = []
        for node in nodes:
            left = self.visit(node)
            result += left if isinstance(left, list) else [] if left is None else [left]
            if result and isinstance(result[-1], ast.Return):
                break
        return [ast.fix_missing_locations(each) for each in result]

    def visit_Name(self, node: ast.Name) -> ast.expr:
        there = isinstance(node.ctx, ast.Load) and node.id in self.known
        return ast.Constant(self.known[node.id]) if there else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        place = self.visit(node.slice)
        row = node.value.id if isinstance(node.value, ast.Name) else ""
        at = place.value if isinstance(place, ast.Constant) else named(place, self.scope)
        if isinstance(node.ctx, ast.Load) and type(at) is int and ast.unparse(place) not in self.local:
            value = self.look(row, at)
            if value is not None:
                return ast.Constant(value)
        return ast.copy_location(ast.Subscript(node.value, place, node.ctx), node)

    def visit_Assign(self, node: ast.Assign) -> ast.stmt | list[ast.stmt] | None:
        self.generic_visit(node)
        return None if len(node.targets) == 1 and self.is_followed(node.targets[0], node.value) else node

    def is_followed(self, target: ast.expr, value: ast.expr) -> bool:
        """Note a variable that is assigned here alone, and known."""
        if not (isinstance(target, ast.Name) and target.id in self.once and isinstance(value, ast.Constant)):
            return False
        if isinstance(value.value, self.kept):
            self.known[target.id] = value.value
        return target.id in self.known

    def visit_If(self, node: ast.If) -> list[ast.stmt]:
        test = self.visit(node.test)
        if isinstance(test, ast.Constant):
            return self.block(node.body if test.value else node.orelse)
        body, orelse = self.block(node.body), self.block(node.orelse)
        if not body and not orelse:
            return []
        if not body:
            test, body, orelse = self.visit(ast.UnaryOp(ast.Not(), test)), orelse, []
        return [ast.copy_location(ast.If(test, body, orelse), node)]

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        test = self.visit(node.test)
        if isinstance(test, ast.Constant):
            chosen: ast.expr = self.visit(node.body if test.value else node.orelse)
            return chosen
        return ast.copy_location(ast.IfExp(test, self.visit(node.body), self.visit(node.orelse)), node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        inner = self.visit(node.operand)
        if isinstance(inner, ast.Constant):
            return ast.Constant(not inner.value if isinstance(node.op, ast.Not) else -number(inner))
        return ast.copy_location(ast.UnaryOp(node.op, inner), node)

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        ends = isinstance(node.op, ast.Or)
        values = [self.visit(each) for each in node.values]
        if any(isinstance(each, ast.Constant) and bool(each.value) is ends for each in values):
            return ast.Constant(ends)
        rest = [each for each in values if not isinstance(each, ast.Constant)]
        return ast.BoolOp(node.op, rest) if len(rest) > 1 else rest[0] if rest else ast.Constant(not ends)

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        sides = [self.visit(each) for each in (node.left, *node.comparators)]
        worth = [each.value if isinstance(each, ast.Constant) else self.number_at(each) for each in sides]
        if len(sides) == 2 and None not in worth and type(node.ops[0]) in _COMPARE:
            return ast.Constant(_COMPARE[type(node.ops[0])](*worth))
        return ast.copy_location(ast.Compare(sides[0], node.ops, sides[1:]), node)

    def number_at(self, node: ast.expr) -> Any:
        """A named number of another module; None for anything else."""
        value = named(node, self.scope) if isinstance(node, ast.Attribute) else None
        return value if type(value) in (int, float) else None


def number(node: ast.Constant) -> Any:
    return node.value
