"""Statements of one function: kinds of its variables first, then its text in C."""

import ast
from typing import Any

from actuator_lti.compiled.expressions import Expressions, bare, widened
from actuator_lti.compiled.kinds import C_TYPES, Function, Kind, c_name

INDENT = "    "


class Statements(Expressions):
    """Translates the body of one function, line by line."""

    def __init__(self, *parts: Any) -> None:
        super().__init__(*parts)
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
            # the expression that this statement itself evaluates, not those inside it
            own = {ast.If: "test", ast.While: "test", ast.For: "iter"}.get(type(node), "value")
            self.whole = getattr(node, own, None) or ast.Pass()
            self.translated(node)

    def _opened(self, head: str, nodes: list[ast.stmt]) -> None:
        """A block behind its head, its brace still to be closed."""
        self._put(f"{head} {{")
        self.depth += 1
        self._block(nodes)
        self.depth -= 1

    # --- assignment ------------------------------------------------------------------------------

    def _Assign(self, node: ast.Assign) -> None:
        target = node.targets[0]
        if len(node.targets) == 1 and isinstance(target, ast.Tuple):
            self._tuple(target, node)
            return
        text, kind = self.emit(node.value)
        text = bare(text) if len(node.targets) == 1 else self._temporary(kind, bare(text))
        for target in node.targets:
            self._store(target, text, kind)

    def _store(self, target: ast.expr, text: str, kind: Kind) -> None:
        if isinstance(target, ast.Subscript):
            self._store_element(target, text, kind)
        elif isinstance(target, ast.Name):
            self._declare(target, kind)
            self._put(f"{c_name(target.id)} = {text};")
        else:
            raise self.function.error(target, "this target is not in the subset")

    def _store_element(self, target: ast.Subscript, text: str, kind: Kind) -> None:
        self.want(kind in ("float", "int"), target, f"a {kind} stored in a row")
        row = self._written(target)
        if self.function.arguments.get(row) == "bytes":
            self.want(kind == "int", target, f"a {kind} stored in a row of small whole numbers")
            text = f"(unsigned short){text}"
        else:
            text = f"(double){text}" if kind == "int" and text.isidentifier() else bare(widened(text, kind))
        self._put(f"{self.element(target)} = {text};")

    def _written(self, target: ast.Subscript) -> str:
        """Note that a row is written; its name."""
        row = target.value.id if isinstance(target.value, ast.Name) else ""
        if row in self.function.arguments:
            self.function.written.add(row)
        return row

    def _declare(self, target: ast.Name, kind: Kind) -> None:
        function, name = self.function, target.id
        self.want(kind != "row", target, f"{name}: a second name for a row")
        self.want(name not in self.loops, target, f"{name} is the index of a loop")
        known = function.arguments.get(name) or function.variables.setdefault(name, kind)
        self.want(known == kind, target, f"{name} is a {known} and becomes a {kind}; one type a variable")

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
        emitted = [self.emit(value) for value in node.value.elts]
        if overlap(targets, node.value):
            emitted = [(self._temporary(kind, bare(text)), kind) for text, kind in emitted]
        for target, (text, kind) in zip(targets.elts, emitted, strict=True):
            self._store(target, bare(text), kind)

    def _results(self, targets: ast.Tuple, call: ast.Call) -> None:
        callee, texts = self.called(call)
        kinds = callee.returns or ()
        fits = len(kinds) == len(targets.elts)
        self.want(fits, call, "the number of results differs from the number of targets")
        name = self._named_result(callee, texts)
        for index, (target, kind) in enumerate(zip(targets.elts, kinds, strict=True)):
            if not (isinstance(target, ast.Name) and target.id.startswith("_")):
                self._store(target, f"{name}.r{index}", kind)

    def _AugAssign(self, node: ast.AugAssign) -> None:
        loaded = ast.parse(ast.unparse(node.target), mode="eval").body
        plain = ast.copy_location(ast.BinOp(left=loaded, op=node.op, right=node.value), node)
        text, kind = self.emit(ast.fix_missing_locations(plain))
        self._store(node.target, bare(text), kind)

    # --- control flow ----------------------------------------------------------------------------

    def _Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Call):
            raise self.function.error(node, "an expression that does nothing")
        callee, texts = self.called(node.value)
        cast = "" if callee.returns is None else "(void)"
        self._put(f"{cast}{callee.c_name}({', '.join(texts)});")

    def _If(self, node: ast.If, word: str = "if") -> None:
        self._opened(f"{word} ({self.condition(node.test)})", node.body)
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            self.whole = node.orelse[0].test
            self._If(node.orelse[0], "} else if")
            return
        if node.orelse:
            self._opened("} else", node.orelse)
        self._put("}")

    def _While(self, node: ast.While) -> None:
        self.want(not node.orelse, node, "else after while is not in the subset")
        self._opened(f"while ({self.condition(node.test)})", node.body)
        self._put("}")

    def _For(self, node: ast.For) -> None:
        call, index = node.iter, node.target
        ranged = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"
        if not ranged or not isinstance(index, ast.Name) or node.orelse:
            raise self.function.error(node, "only for NAME in range(...) is in the subset")
        assert isinstance(call, ast.Call)
        bounds = [self.emit(argument) for argument in call.args]
        whole = all(kind == "int" for _, kind in bounds) and len(bounds) <= 2
        self.want(whole, node, "range of whole numbers, first and last")
        first, last = ("0", bounds[0][0]) if len(bounds) == 1 else (bounds[0][0], bounds[1][0])
        self.want(index.id not in self.function.variables, node, f"{index.id} is a variable too")
        name = c_name(index.id.lstrip("_") or "round")
        end = bare(last)
        if not end.isdigit():
            end = f"{name}_end_{self._count()}"
            self._put(f"const int {end} = {bare(last)};")
        self.function.variables[index.id] = "int"
        self.loops[index.id] = self.loops.get(index.id, 0) + 1
        self._opened(f"for (int {name} = {bare(first)}; {name} < {end}; {name} += 1)", node.body)
        self._put("}")
        self.loops[index.id] -= 1
        if not self.loops[index.id]:
            del self.loops[index.id], self.function.variables[index.id]

    def _count(self) -> int:
        self.temporaries += 1
        return self.temporaries

    def _Break(self, node: ast.stmt) -> None:
        self._put(f"{type(node).__name__.lower()};")

    _Continue = _Break

    def _Pass(self, _node: ast.Pass) -> None:
        return

    def _Return(self, node: ast.Return) -> None:
        values = [] if node.value is None else getattr(node.value, "elts", [node.value])
        several = self._several_results(node.value)
        emitted = several or [self.emit(value) for value in values]
        kinds: tuple[Kind, ...] | None = tuple(kind for _, kind in emitted) or None
        known = self.function.returns
        self.want(known in (None, kinds), node, f"returns {kinds} here and {known} elsewhere")
        self.function.returns = kinds
        texts = ", ".join(bare(text) for text, _ in emitted)
        if len(emitted) > 1:
            texts = f"({result_type(self.function)}){{{texts}}}"
        self._put(f"return {texts};" if texts else "return;")

    def _several_results(self, node: ast.expr | None) -> list[tuple[str, Kind]]:
        """The results of another function, to be passed on; empty where it has one."""
        if not isinstance(node, ast.Call) or self.built_in(node) is not None:
            return []
        callee, texts = self.called(node)
        if callee.returns is None or len(callee.returns) == 1:
            return []
        name = self._named_result(callee, texts)
        return [(f"{name}.r{n}", kind) for n, kind in enumerate(callee.returns)]

    def _named_result(self, callee: Function, texts: list[str]) -> str:
        name = f"result_{self._count()}"
        self._put(f"const {result_type(callee)} {name} = {callee.c_name}({', '.join(texts)});")
        return name


def result_type(function: Function) -> str:
    """Name of the structure that a function with several results returns."""
    return f"{function.c_name}_result"


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


def without_docstring(body: list[ast.stmt]) -> list[ast.stmt]:
    first = body[0]
    described = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return body[1:] if described else body
