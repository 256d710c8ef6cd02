"""What is left of kernels where rows are known: numbers in their places, branches and short loops worked out.

Each call is followed with what is known of its arguments, so that one kernel may leave several functions.
The arithmetic is the kernel's; only a known zero added, or multiplied by, and a limit at infinity go.
"""

import ast
import inspect
import math
import operator
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

from actuator_lti.compiled.form import Known
from actuator_lti.compiled.kernel import is_marked
from actuator_lti.compiled.kinds import named, stored, tree_of
from actuator_lti.compiled.statements import overlap, without_docstring

SHORT = 16  # rounds of a loop that is written out
_FOLD: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip
_BUILT_IN: dict[str, Callable[..., Any]] = {"abs": abs, "min": min, "max": max, "int": int, "float": float}
Replaced = Callable[[list[ast.expr], "Leftover"], ast.expr | None]


@dataclass
class Leftover:
    """One function that is left."""

    name: str
    python: Any  # the kernel
    tree: ast.FunctionDef  # what is left of it
    arguments: tuple[str, ...] = ()  # those that its text still uses
    known: dict[str, Any] = field(default_factory=dict)


@dataclass
class Residual:
    # The number at a place of a row, by the row's argument, which is called alike in every function, or None
    look: Callable[[str, int], float | None]
    # What stands for a call of a kernel, of its arguments and the function that calls it
    replaced: Mapping[Any, Replaced] = field(default_factory=dict)
    constants: Mapping[str, float] = field(default_factory=dict)  # named ones that have another value here
    functions: dict[str, Leftover] = field(default_factory=dict)  # what it leaves, callees first
    _done: dict[tuple[Any, ...], Leftover] = field(default_factory=dict)

    def follow(self, python: Any, known: Mapping[str, Any] | None = None) -> Leftover:
        """What is left of a kernel where some arguments are known."""
        known = dict(known or {})
        key = (python, *((name, repr(value)) for name, value in sorted(known.items())))
        if key not in self._done:
            tree = tree_of(python)
            names = [argument.arg for argument in tree.args.args]
            left = Leftover(python.__name__, python, tree, tuple(names), known)
            body = _Body(self, left).block(without_docstring(tree.body))
            tree.body = body or [ast.Pass()]
            used = {node.id for each in body for node in ast.walk(each) if isinstance(node, ast.Name)}
            left.arguments = tuple(name for name in names if name in used)
            self._done[key] = self._named(left)
        return self._done[key]

    def _named(self, left: Leftover) -> Leftover:
        """The function under a name of its own, or one that is the same."""
        others = [each for each in self.functions.values() if each.python is left.python]
        text = ast.unparse(left.tree.body)  # type: ignore[arg-type]
        for other in others:
            if ast.unparse(other.tree.body) == text:  # type: ignore[arg-type]
                return other
        left.name += f"_{len(others) + 1}" if others else ""
        self.functions[left.name] = left
        return left


class _Body(Known):
    """The statements of one function, with what is known in them."""

    kept = (int, float)

    def __init__(self, residual: Residual, left: Leftover) -> None:
        super().__init__(left.tree, left.python.__globals__, residual.look)
        self.residual, self.left = residual, left
        written = stored(left.tree)
        self.known |= {name: value for name, value in left.known.items() if name not in written}

    # --- statements --------------------------------------------------------------------------------

    def visit_Assign(self, node: ast.Assign) -> list[ast.stmt]:
        target, value = node.targets[0], self.visit(node.value)
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and not overlap(target, value):
            pairs = zip(target.elts, value.elts, strict=True)
            return [ast.Assign([self.visit(t)], v, lineno=0) for t, v in pairs if not self.is_followed(t, v)]
        if len(node.targets) == 1 and self.is_followed(target, value):
            return []
        return [ast.Assign([self.visit(each) for each in node.targets], value, lineno=0)]

    def visit_AugAssign(self, node: ast.AugAssign) -> list[ast.stmt]:
        value = self.visit(node.value)
        if isinstance(node.op, ast.Add | ast.Sub) and _is(value, 0.0):
            return []
        return [ast.AugAssign(self.visit(node.target), node.op, value)]

    def visit_For(self, node: ast.For) -> list[ast.stmt]:
        assert isinstance(node.iter, ast.Call)
        assert isinstance(node.target, ast.Name)
        bounds = [self.visit(each) for each in node.iter.args]
        if not all(isinstance(each, ast.Constant) for each in bounds):
            return self._loop(node, bounds)
        rounds = range(*(each.value for each in bounds))
        if len(rounds) > SHORT:
            return self._loop(node, bounds)
        result = []
        for value in rounds:
            self.known[node.target.id] = value
            result += self.block(deepcopy(node.body))
        self.known.pop(node.target.id, None)
        return result

    def _loop(self, node: ast.For, bounds: list[ast.expr]) -> list[ast.stmt]:
        assert isinstance(node.iter, ast.Call)
        body = self.block(node.body)
        return [ast.For(node.target, ast.Call(node.iter.func, bounds, []), body, [])] if body else []

    def visit_Expr(self, node: ast.Expr) -> list[ast.stmt]:
        value = self.visit(node.value)
        return [ast.Expr(value)] if isinstance(value, ast.Call) else []

    # --- expressions -------------------------------------------------------------------------------

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if isinstance(node.ctx, ast.Store):
            self.known.pop(node.id, None)
            return node
        if node.id in self.known:
            return ast.Constant(self.known[node.id])
        if node.id in self.local:
            return node
        value = self.residual.constants.get(node.id, self.scope.get(node.id))
        return ast.Constant(value) if type(value) in (int, float) else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        value = self.number_at(node)
        return node if value is None else ast.Constant(value)

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        left, right, kind = self.visit(node.left), self.visit(node.right), type(node.op)
        if isinstance(left, ast.Constant) and isinstance(right, ast.Constant) and kind in _FOLD:
            return ast.Constant(_FOLD[kind](left.value, right.value))
        return _shorter(left, kind, right) or ast.BinOp(left, node.op, right)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        arguments = [self.visit(each) for each in node.args]
        target = named(node.func, {**_BUILT_IN, **self.scope})
        if not is_marked(target, "kernel"):
            if callable(target) and all(isinstance(each, ast.Constant) for each in arguments):
                return ast.Constant(target(*(each.value for each in arguments)))
            return _unlimited(node.func, arguments) or ast.Call(node.func, arguments, [])
        if target in self.residual.replaced:
            instead = self.residual.replaced[target](arguments, self.left)
            if instead is not None:
                return instead
        return self._followed(target, arguments)

    def _followed(self, target: Any, arguments: list[ast.expr]) -> ast.expr:
        names = list(inspect.signature(target).parameters)
        given = dict(zip(names, arguments, strict=True))
        known = {name: each.value for name, each in given.items() if isinstance(each, ast.Constant)}
        left = self.residual.follow(target, known)
        body = left.tree.body
        if len(body) == 1 and isinstance(body[0], ast.Return) and _is_brief(body[0].value, left):
            assert body[0].value is not None
            result: ast.expr = _Placed(given).visit(deepcopy(body[0].value))
            return result
        if isinstance(body[0], ast.Pass):
            return ast.Constant(None)
        return ast.Call(ast.Name(left.name, ast.Load()), [given[name] for name in left.arguments], [])


class _Placed(ast.NodeTransformer):
    """Arguments in the place of their names."""

    def __init__(self, given: Mapping[str, ast.expr]) -> None:
        self.given = given

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self.given.get(node.id, node)


def _is_brief(value: ast.expr | None, left: Leftover) -> bool:
    """Whether an expression may stand for its call: one value, each argument once, no row."""
    if value is None or isinstance(value, ast.Tuple):
        return False
    names = [node.id for node in ast.walk(value) if isinstance(node, ast.Name) and node.id in left.arguments]
    rows = any(isinstance(node, ast.Subscript | ast.IfExp) for node in ast.walk(value))
    return len(names) == len(set(names)) and not rows


def _is(node: ast.expr, value: float) -> bool:
    return isinstance(node, ast.Constant) and bool(node.value == value) and node.value is not False


def _shorter(left: ast.expr, kind: type, right: ast.expr) -> ast.expr | None:
    """A sum or product with a known 0 or 1."""
    if kind is ast.Mult and (_is(left, 0.0) or _is(right, 0.0)):
        return left if _is(left, 0.0) else right
    if kind is ast.Add and _is(left, 0.0):
        return right
    if kind in (ast.Add, ast.Sub) and _is(right, 0.0):
        return left
    if kind is ast.Mult and _is(left, 1.0):
        return right
    return left if kind in (ast.Mult, ast.Div) and _is(right, 1.0) else None


def _unlimited(function: ast.expr, arguments: list[ast.expr]) -> ast.expr | None:
    """What a minimum or maximum with an infinite number leaves."""
    beyond = {"min": math.inf, "max": -math.inf}.get(getattr(function, "id", ""))
    if beyond is None:
        return None
    rest = [each for each in arguments if not _is(each, beyond)]
    return rest[0] if len(rest) == 1 else None
