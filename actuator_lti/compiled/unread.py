"""What nobody reads in functions left of kernels goes: stores, variables, arguments, empty functions."""

import ast
from collections.abc import Callable, Iterable

from actuator_lti.compiled.residual import Leftover

Place = Callable[[str, ast.expr], object]  # what an element of a row belongs to; None: always read


def without_unread(
    functions: dict[str, Leftover], entries: Iterable[str], place: Place
) -> dict[str, Leftover]:
    """The functions that the entries reach, without what none of them reads."""
    before = ""
    while before != (
        text := "".join(ast.unparse(each.tree) + ",".join(each.arguments) for each in functions.values())
    ):
        before = text
        trees = [left.tree for left in functions.values()]
        nodes = (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Subscript))
        read = {_owner(node, place) for node in nodes if isinstance(node.ctx, ast.Load)}
        for left in functions.values():
            left.tree = _Shorter(functions, left, read, place).visit(left.tree)
        functions = _reached(functions, entries)
        for name, left in functions.items():
            if name not in entries:
                _narrow(functions, left)
    return functions


def _owner(node: ast.Subscript, place: Place) -> object:
    assert isinstance(node.value, ast.Name)
    return place(node.value.id, node.slice)


def _reached(functions: dict[str, Leftover], entries: Iterable[str]) -> dict[str, Leftover]:
    found, wanted = set(), list(entries)
    while wanted:
        name = wanted.pop()
        if name not in found:
            found.add(name)
            wanted += [call.func.id for call in _calls(functions, functions[name].tree)]  # type: ignore[attr-defined]
    return {name: left for name, left in functions.items() if name in found}


def _calls(functions: dict[str, Leftover], tree: ast.AST) -> list[ast.Call]:
    calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return [each for each in calls if isinstance(each.func, ast.Name) and each.func.id in functions]


def _narrow(functions: dict[str, Leftover], left: Leftover) -> None:
    """Take the arguments that a function does not use from it and its calls."""
    used = {node.id for node in ast.walk(left.tree) if isinstance(node, ast.Name)}
    stay = [k for k, name in enumerate(left.arguments) if name in used]
    if len(stay) == len(left.arguments):
        return
    left.arguments = tuple(left.arguments[k] for k in stay)
    for other in functions.values():
        for call in _calls({left.name: left}, other.tree):
            call.args = [call.args[k] for k in stay]


class _Shorter(ast.NodeTransformer):
    """A function without stores that are not read."""

    def __init__(
        self, functions: dict[str, Leftover], left: Leftover, read: set[object], place: Place
    ) -> None:
        self.functions, self.read, self.place = functions, read, place
        names = [node for node in ast.walk(left.tree) if isinstance(node, ast.Name)]
        self.loaded = {node.id for node in names if isinstance(node.ctx, ast.Load)}

    def _is_read(self, target: ast.expr) -> bool:
        if isinstance(target, ast.Subscript):
            owner = _owner(target, self.place)
            return owner is None or owner in self.read
        return not isinstance(target, ast.Name) or target.id in self.loaded

    def visit_Assign(self, node: ast.Assign) -> ast.stmt | None:
        target = node.targets[0]
        if isinstance(target, ast.Tuple):
            return self._tuple(node, target)
        node.targets = [each for each in node.targets if self._is_read(each)]
        if node.targets:
            return node
        return ast.Expr(node.value) if _writing(self.functions, node.value) else None

    def _tuple(self, node: ast.Assign, target: ast.Tuple) -> ast.stmt | None:
        """Several assignments at once; results of a call that nobody reads get a name that says so."""
        if isinstance(node.value, ast.Tuple):
            pairs = list(zip(target.elts, node.value.elts, strict=True))
            pairs = [(a, b) for a, b in pairs if self._is_read(a) or _writing(self.functions, b)]
            target.elts, node.value.elts = [a for a, _ in pairs], [b for _, b in pairs]
            return node if pairs else None
        for each in target.elts:
            if isinstance(each, ast.Name) and not self._is_read(each):
                each.id = "_" + each.id.lstrip("_")
        return node

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.stmt | None:
        return node if self._is_read(node.target) else None

    def visit_Expr(self, node: ast.Expr) -> list[ast.stmt]:
        """Of a value that nobody reads the calls that write a row."""
        return [ast.Expr(call) for call in _writing(self.functions, node.value)]

    def visit_If(self, node: ast.If) -> ast.stmt | None:
        self.generic_visit(node)
        node.body, node.orelse = self._full(node.body), self._full(node.orelse)
        if not node.body and node.orelse:
            return ast.If(ast.UnaryOp(ast.Not(), node.test), node.orelse, [])
        return node if node.body else None

    def visit_For(self, node: ast.For) -> ast.stmt | None:
        self.generic_visit(node)
        return node if self._full(node.body) else None

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.stmt:
        self.generic_visit(node)
        node.body = self._full(node.body) or [ast.Pass()]
        return ast.fix_missing_locations(node)

    def _full(self, body: list[ast.stmt]) -> list[ast.stmt]:
        """Statements that do something: not values that the next assignment writes over unread."""
        rest = [each for each in body if not isinstance(each, ast.Pass)]
        return [each for k, each in enumerate(rest) if not self._is_written_over(each, rest[k + 1 :])]

    def _is_written_over(self, node: ast.stmt, behind: list[ast.stmt]) -> bool:
        targets = node.targets if isinstance(node, ast.Assign) else []
        if len(targets) != 1 or not isinstance(targets[0], ast.Name) or _calls(self.functions, node):
            return False
        for other in behind:
            uses = [
                each for each in ast.walk(other) if isinstance(each, ast.Name) and each.id == targets[0].id
            ]
            if (uses and isinstance(other, ast.AugAssign)) or any(isinstance(u.ctx, ast.Load) for u in uses):
                return False
            if uses and isinstance(other, ast.Assign):
                return True
        return False


def _writing(functions: dict[str, Leftover], tree: ast.AST) -> list[ast.Call]:
    """Calls in a tree that write into a row, themselves or by what they call."""

    def writes(tree: ast.AST) -> bool:
        rows = (each for each in ast.walk(tree) if isinstance(each, ast.Subscript))
        return any(isinstance(each.ctx, ast.Store) for each in rows) or bool(_writing(functions, tree))

    return [call for call in _calls(functions, tree) if writes(functions[call.func.id].tree)]  # type: ignore[attr-defined]
