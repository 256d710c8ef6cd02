"""Statements of one function: kinds of its variables first, then its text in C."""

from __future__ import annotations

import ast

from actuator_lti.compiled.expressions import Expressions, bare, widened
from actuator_lti.compiled.kinds import C_TYPES, Function, Kind, c_name

INDENT = "    "


class Statements:
    """Translates the body of one function, line by line."""

    def __init__(self, expressions: Expressions) -> None:
        self.function, self.expressions = expressions.function, expressions
        self.once = assigned_once(self.function.tree) if expressions.form is not None else frozenset()
        self.lines: list[str] = []
        self.depth = 1
        self.temporaries = 0
        self.loops: dict[str, int] = {}

    def body(self) -> list[str]:
        """The lines of the body, without the declarations of its variables."""
        self._block(without_docstring(self.function.tree.body))
        return self.lines

    def _put(self, text: str) -> None:
        self.lines.append(INDENT * self.depth + text)

    def _block(self, nodes: list[ast.stmt]) -> None:
        for node in nodes:
            method = getattr(self, f"_{type(node).__name__}", None)
            if method is None:
                raise self.function.error(node, f"{type(node).__name__} is not in the subset")
            check_order(self.function, node, self.expressions)
            method(node)

    def _indented(self, nodes: list[ast.stmt]) -> None:
        self.depth += 1
        self._block(nodes)
        self.depth -= 1

    # --- assignment ------------------------------------------------------------------------------

    def _Assign(self, node: ast.Assign) -> None:
        if len(node.targets) > 1:
            self._chained(node)
        elif isinstance(node.targets[0], ast.Tuple):
            self._tuple(node.targets[0], node)
        else:
            target, value = node.targets[0], self.expressions.value(node.value)
            if isinstance(target, ast.Name) and target.id in self.once and isinstance(value, bool):
                self.expressions.told[target.id] = value
                return
            text, kind = self.expressions.emit(node.value)
            self._store(target, bare(text), kind)

    def _store(self, target: ast.expr, text: str, kind: Kind) -> None:
        if isinstance(target, ast.Subscript):
            if kind not in ("float", "int"):
                raise self.function.error(target, f"a {kind} stored in a row")
            self._mark_written(target)
            if self._is_bytes(target):
                if kind != "int":
                    raise self.function.error(target, f"a {kind} stored in a row of small whole numbers")
                self._put(f"{self.expressions.element(target)} = (unsigned short){text};")
                return
            text = f"(double){text}" if kind == "int" and text.isidentifier() else bare(widened(text, kind))
            self._put(f"{self.expressions.element(target)} = {text};")
        elif isinstance(target, ast.Name):
            self._declare(target, kind)
            self._put(f"{c_name(target.id)} = {text};")
        else:
            raise self.function.error(target, "this target is not in the subset")

    def _is_bytes(self, target: ast.Subscript) -> bool:
        name = target.value.id if isinstance(target.value, ast.Name) else ""
        return self.function.arguments.get(name) == "bytes"

    def _declare(self, target: ast.Name, kind: Kind) -> None:
        function, name = self.function, target.id
        if kind == "row":
            raise function.error(target, f"{name}: a second name for a row")
        if name in self.loops:
            raise function.error(target, f"{name} is the index of a loop")
        known = function.arguments.get(name) or function.variables.setdefault(name, kind)
        if known != kind:
            raise function.error(target, f"{name} is a {known} and becomes a {kind}; one type a variable")

    def _mark_written(self, target: ast.Subscript) -> None:
        if isinstance(target.value, ast.Name) and target.value.id in self.function.arguments:
            self.function.written.add(target.value.id)

    def _chained(self, node: ast.Assign) -> None:
        text, kind = self.expressions.emit(node.value)
        name = self._temporary(kind, bare(text))
        for target in node.targets:
            self._store(target, name, kind)

    def _temporary(self, kind: Kind, text: str) -> str:
        name = f"value_{self._count()}"
        self._put(f"const {C_TYPES[kind]} {name} = {text};")
        return name

    def _tuple(self, targets: ast.Tuple, node: ast.Assign) -> None:
        if isinstance(node.value, ast.Call):
            self._results(targets, node.value)
            return
        if not isinstance(node.value, ast.Tuple) or len(node.value.elts) != len(targets.elts):
            raise self.function.error(node, "a tuple on the left wants one of the same length on the right")
        emitted = [self.expressions.emit(value) for value in node.value.elts]
        if overlap(targets, node.value):
            emitted = [(self._temporary(kind, bare(text)), kind) for text, kind in emitted]
        for target, (text, kind) in zip(targets.elts, emitted, strict=True):
            self._store(target, bare(text), kind)

    def _results(self, targets: ast.Tuple, call: ast.Call) -> None:
        callee, texts = self.expressions.called(call)
        if callee is None or callee.returns is None or len(callee.returns) != len(targets.elts):
            raise self.function.error(call, "the number of results differs from the number of targets")
        self._mark_callee_writes(call, callee)
        name = self._named_result(callee, texts)
        for index, (target, kind) in enumerate(zip(targets.elts, callee.returns, strict=True)):
            if not (isinstance(target, ast.Name) and target.id.startswith("_")):
                self._store(target, f"{name}.r{index}", kind)

    def _mark_callee_writes(self, call: ast.Call, callee: Function) -> None:
        for argument, name in zip(call.args, callee.arguments, strict=True):
            if name in callee.written and isinstance(argument, ast.Name):
                self.function.written.add(argument.id)

    def _AugAssign(self, node: ast.AugAssign) -> None:
        plain = ast.BinOp(left=_loaded(node.target), op=node.op, right=node.value)
        ast.copy_location(plain, node)
        text, kind = self.expressions.emit(ast.fix_missing_locations(plain))
        self._store(node.target, bare(text), kind)

    # --- control flow ----------------------------------------------------------------------------

    def _Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Call):
            raise self.function.error(node, "an expression that does nothing")
        callee, texts = self.expressions.called(node.value)
        if callee is None:
            raise self.function.error(node, "a call that does nothing")
        self._mark_callee_writes(node.value, callee)
        cast = "" if callee.returns is None else "(void)"
        self._put(f"{cast}{callee.c_name}({', '.join(texts)});")

    def _If(self, node: ast.If, word: str = "if") -> None:
        known = self.expressions.value(node.test) if word == "if" else None
        if known is not None:
            self._block(node.body if known else node.orelse)
            return
        self._put(f"{word} ({self.expressions.condition(node.test)}) {{")
        self._indented(node.body)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            check_order(self.function, node.orelse[0], self.expressions)
            self._If(node.orelse[0], "} else if")
            return
        if node.orelse:
            self._put("} else {")
            self._indented(node.orelse)
        self._put("}")

    def _While(self, node: ast.While) -> None:
        if node.orelse:
            raise self.function.error(node, "else after while is not in the subset")
        self._put(f"while ({self.expressions.condition(node.test)}) {{")
        self._indented(node.body)
        self._put("}")

    def _For(self, node: ast.For) -> None:
        call, index = node.iter, node.target
        ranged = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"
        if not ranged or not isinstance(index, ast.Name) or node.orelse:
            raise self.function.error(node, "only for NAME in range(...) is in the subset")
        assert isinstance(call, ast.Call)
        bounds = [self.expressions.emit(argument) for argument in call.args]
        if any(kind != "int" for _, kind in bounds) or len(bounds) > 2:
            raise self.function.error(node, "range of whole numbers, first and last")
        first, last = ("0", bounds[0][0]) if len(bounds) == 1 else (bounds[0][0], bounds[1][0])
        if index.id in self.function.variables:
            raise self.function.error(node, f"{index.id} is a variable too")
        name = c_name(index.id.lstrip("_") or "round")
        end = bare(last)
        if not end.isdigit():
            end = f"{name}_end_{self._count()}"
            self._put(f"const int {end} = {bare(last)};")
        self.function.variables[index.id] = "int"
        self.loops[index.id] = self.loops.get(index.id, 0) + 1
        self._put(f"for (int {name} = {bare(first)}; {name} < {end}; {name} += 1) {{")
        self._indented(node.body)
        self._put("}")
        self.loops[index.id] -= 1
        if not self.loops[index.id]:
            del self.loops[index.id], self.function.variables[index.id]

    def _count(self) -> int:
        self.temporaries += 1
        return self.temporaries

    def _Break(self, _node: ast.Break) -> None:
        self._put("break;")

    def _Continue(self, _node: ast.Continue) -> None:
        self._put("continue;")

    def _Pass(self, _node: ast.Pass) -> None:
        return

    def _Return(self, node: ast.Return) -> None:
        if isinstance(node.value, ast.Call) and self._passed_on(node.value):
            return
        values = [] if node.value is None else getattr(node.value, "elts", [node.value])
        emitted = [self.expressions.emit(value) for value in values]
        kinds: tuple[Kind, ...] | None = tuple(kind for _, kind in emitted) or None
        self._returns(node, kinds)
        if kinds is None:
            self._put("return;")
        elif len(kinds) == 1:
            self._put(f"return {bare(emitted[0][0])};")
        else:
            texts = ", ".join(bare(text) for text, _ in emitted)
            self._put(f"return ({result_type(self.function)}){{{texts}}};")

    def _passed_on(self, call: ast.Call) -> bool:
        """Return the several results of another function; False where it has one."""
        callee, texts = self.expressions.called(call)
        if callee is None or callee.returns is None or len(callee.returns) == 1:
            return False
        self._returns(call, callee.returns)
        self._mark_callee_writes(call, callee)
        name = self._named_result(callee, texts)
        fields = ", ".join(f"{name}.r{n}" for n in range(len(callee.returns)))
        self._put(f"return ({result_type(self.function)}){{{fields}}};")
        return True

    def _returns(self, node: ast.AST, kinds: tuple[Kind, ...] | None) -> None:
        known = self.function.returns
        if known not in (None, kinds):
            raise self.function.error(node, f"returns {kinds} here and {known} elsewhere")
        self.function.returns = kinds

    def _named_result(self, callee: Function, texts: list[str]) -> str:
        name = f"result_{self._count()}"
        self._put(f"const {result_type(callee)} {name} = {callee.c_name}({', '.join(texts)});")
        return name


def result_type(function: Function) -> str:
    """Name of the structure that a function with several results returns."""
    return f"{function.c_name}_result"


def check_order(function: Function, node: ast.stmt, expressions: Expressions) -> None:
    """Refuse an expression whose value depends on an order of evaluation that C leaves open.

    That is one with a call that writes a row, and beside it another such call or a look into that row.
    """
    for expression in _own_expressions(node):
        for call in ast.walk(expression):
            if not isinstance(call, ast.Call) or not any(_is_row(each, function) for each in call.args):
                continue
            callee, _ = expressions.called(call)
            if callee is None or not callee.written:
                continue
            for argument, name in zip(call.args, callee.arguments, strict=True):
                if name in callee.written and isinstance(argument, ast.Name):
                    function.written.add(argument.id)
                    _refuse_beside(function, expression, call, argument.id)


def _refuse_beside(function: Function, expression: ast.expr, call: ast.Call, row: str) -> None:
    everywhere, inside = (
        sum(isinstance(each, ast.Name) and each.id == row for each in ast.walk(tree))
        for tree in (expression, call)
    )
    if everywhere > inside:
        raise function.error(call, f"writes {row} beside another use of {row}; give it a line of its own")


def _is_row(node: ast.expr, function: Function) -> bool:
    return isinstance(node, ast.Name) and function.arguments.get(node.id) == "row"


def _own_expressions(node: ast.stmt) -> list[ast.expr]:
    """The expressions evaluated by this statement itself, not by those inside it."""
    if isinstance(node, ast.If | ast.While):
        return [node.test]
    if isinstance(node, ast.For):
        return [node.iter]
    if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple):
        return [node.value]
    value = getattr(node, "value", None)
    return [value] if isinstance(value, ast.expr) else []


def overlap(targets: ast.Tuple, values: ast.Tuple) -> bool:
    """Whether a value on the right reads what an earlier target on the left has changed."""
    changed: set[str] = set()
    for target, value in zip(targets.elts, values.elts, strict=True):
        if changed & {n.id for n in ast.walk(value) if isinstance(n, ast.Name)}:
            return True
        base = target.value if isinstance(target, ast.Subscript) else target
        if isinstance(base, ast.Name):
            changed.add(base.id)
    return False


def _loaded(target: ast.expr) -> ast.expr:
    return ast.parse(ast.unparse(target), mode="eval").body


def assigned_once(tree: ast.FunctionDef) -> frozenset[str]:
    """Variables that a function assigns at one place alone."""
    names = [n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    return frozenset(name for name in names if names.count(name) == 1)


def without_docstring(body: list[ast.stmt]) -> list[ast.stmt]:
    first = body[0]
    described = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return body[1:] if described else body
