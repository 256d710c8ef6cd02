"""C of what is left of kernels, with structures of named members in place of rows."""

import ast
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from actuator_lti.compiled.expressions import ARITHMETIC, Text, bare
from actuator_lti.compiled.form import number
from actuator_lti.compiled.kernel import kernel
from actuator_lti.compiled.kinds import Function, Kind, c_float, c_name
from actuator_lti.compiled.program import Collector, Program, declared, program_of
from actuator_lti.compiled.residual import Leftover
from actuator_lti.compiled.statements import INDENT, Statements

_WHOLE = re.compile(r"-?\d+\.0")


@dataclass(frozen=True)
class Member:
    """One member of a structure: the numbers of a row from ``first`` on; no ``length`` is a single one."""

    name: str
    first: int
    length: int = 0
    kind: Kind = "float"

    def holds(self, place: int) -> bool:
        return self.first <= place < self.first + max(self.length, 1)


@dataclass(frozen=True)
class Struct:
    type: str  # names in C, of it and of the pointer to it
    argument: str
    members: tuple[Member, ...]

    def member(self, index: ast.expr) -> tuple[Member, ast.expr]:
        """The member that an index of the row falls into, and the index within it."""
        begin, rest = split_index(index)
        found = next(each for each in self.members if each.holds(begin))
        offset: ast.expr = ast.Constant(begin - found.first)
        if rest is not None:
            offset = ast.BinOp(rest, ast.Add(), offset) if begin > found.first else rest
        return found, offset


def split_index(index: ast.expr) -> tuple[int, ast.expr | None]:
    """The known part of an index, and the rest of it."""
    if isinstance(index, ast.Constant):
        return int(number(index)), None
    if isinstance(index, ast.BinOp) and isinstance(index.op, ast.Add | ast.Sub):
        (left, a), (right, b) = split_index(index.left), split_index(index.right)
        if isinstance(index.op, ast.Sub):
            return left - right, a if b is None else ast.BinOp(a or ast.Constant(0), ast.Sub(), b)
        return left + right, b if a is None else a if b is None else ast.BinOp(a, ast.Add(), b)
    return 0, index


@dataclass(frozen=True)
class Rows:
    """The structures by the argument that is their row, and the counts per unit of what is counted."""

    structs: Mapping[str, Struct]
    counts_per_unit: float = math.nan


class _Members(Statements):
    """Statements and expressions whose rows are structures."""

    rows: Rows

    def _Name(self, node: ast.Name) -> Text:
        text, kind = super()._Name(node)
        return (self.rows.structs[node.id].argument, kind) if kind == "row" else (text, kind)

    def _Subscript(self, node: ast.Subscript) -> Text:
        return self.element(node), self.member(node).kind

    def member(self, node: ast.Subscript) -> Member:
        assert isinstance(node.value, ast.Name)
        return self.rows.structs[node.value.id].member(node.slice)[0]

    def element(self, node: ast.Subscript) -> str:
        assert isinstance(node.value, ast.Name)
        struct = self.rows.structs[node.value.id]
        found, offset = struct.member(node.slice)
        text = f"{struct.argument}->{found.name}"
        return f"{text}[{bare(self.emit(offset)[0])}]" if found.length else text

    def as_float(self, node: ast.expr) -> str:
        text, kind = self.emit(node)
        return self.of_counts(text) if kind == "count" else super().as_float(node)

    def of_counts(self, text: str) -> str:
        return f"((double){text} / {c_float(self.rows.counts_per_unit)})"

    def _BinOp(self, node: ast.BinOp) -> Text:
        (a, _), (b, _) = operands = self.emit(node.left), self.emit(node.right)
        kinds = [kind for _, kind in operands]
        if kinds == ["count", "count"] and isinstance(node.op, ast.Sub):
            return self.of_counts(f"(int32_t)((uint32_t){a} - (uint32_t){b})"), "float"
        if "count" in kinds:
            left, right = self.as_float(node.left), self.as_float(node.right)
            return f"({left} {ARITHMETIC[type(node.op)]} {right})", "float"
        if "int" in kinds and isinstance(node.op, ast.Add | ast.Sub | ast.Mult):
            return super()._BinOp(ast.BinOp(_as_whole(node.left), node.op, _as_whole(node.right)))
        return super()._BinOp(node)

    def _compared(self, left: ast.expr, sign: str, right: ast.expr) -> str:
        if "int" in (self.emit(left)[1], self.emit(right)[1]):
            left, right = _as_whole(left), _as_whole(right)
        return super()._compared(left, sign, right)

    def _Call(self, node: ast.Call) -> Text:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        text, kind = self.emit(node.args[0]) if name in ("int", "float") else ("", "")
        if (name, kind) == ("int", "int"):
            return text, "int"
        return (f"((double){text})", "float") if (name, kind) == ("float", "count") else super()._Call(node)

    def _store_element(self, target: ast.Subscript, text: str, kind: Kind) -> None:
        self._written(target)
        wanted = self.member(target).kind
        if kind == "count" and wanted == "float":
            text = bare(self.of_counts(text))
        elif kind == "float" and wanted != "float":
            text = _whole_text(text)
        elif kind == "int" and wanted == "float":
            text = f"(double){text}"
        self._put(f"{self.element(target)} = {text};")


def _as_whole(node: ast.expr) -> ast.expr:
    """A whole number that is written as a float, as one."""
    if isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value.is_integer():
        return ast.Constant(int(node.value))
    return node


def _whole_text(text: str) -> str:
    """A floating-point expression of a whole number, as one."""
    if _WHOLE.fullmatch(text):
        return text.removesuffix(".0")
    cast = re.fullmatch(r"\(double\)(\w+)", text)
    return cast[1] if cast else f"(int32_t)({text})"


class _MemberCollector(Collector):
    """Functions that are left of kernels, with structures for rows."""

    def __init__(self, prefix: str, rows: Rows, functions: Mapping[str, Leftover]) -> None:
        super().__init__(prefix)
        self.rows, self.functions = rows, functions
        self.scope: dict[str, Any] = {"math": math, **{name: _named(name) for name in functions}}

    def parsed(self, python: Any, kinds: list[Kind]) -> Function:
        left = self.functions[python.__name__]
        arguments = dict(zip(left.arguments, kinds, strict=True))
        return Function(left.name, __name__, "", 0, left.tree, self.scope, arguments, self.prefix)

    def statements(self, function: Function) -> Statements:
        members = _Members(function, self.call, self.constants, self.helpers)
        members.rows = self.rows
        return members

    def head(self, function: Function) -> str:
        text = super().head(function)
        for name in (name for name, kind in function.arguments.items() if kind == "row"):
            struct = self.rows.structs[name]
            text = re.sub(rf"\bdouble \*{c_name(name)}\b", f"{struct.type} *{struct.argument}", text)
        return text

    def definition(self, function: Function, head: str, lines: list[str]) -> str:
        left = self.functions[function.name]
        lines = [re.sub(r"\(\(double\)(\d+)\)", r"\1.0", line) for line in lines]
        body = [*declared(function), *(line.replace("fabs(", f"{self.prefix}abs(") for line in lines)]
        text, rows = "\n".join(body), [name for name, kind in function.arguments.items() if kind == "row"]
        names = dict.fromkeys(self.rows.structs[row].argument for row in rows)
        body[:0] = [f"{INDENT}(void){name};" for name in names if not re.search(rf"\b{name}\b", text)]
        about = (left.python.__doc__ or "").splitlines()[0]
        return "\n".join([f"/* {about} */", head, "{", *body, "}", ""])


def _named(name: str) -> Any:
    def function() -> None: ...

    function.__name__ = name
    return kernel(function)


def emit_structs(
    functions: Mapping[str, Leftover], entries: Mapping[str, list[Kind]], prefix: str, rows: Rows
) -> Program:
    """C99 for what is left of kernels; the entries by name, with the kinds of their arguments."""
    collector = _MemberCollector(prefix, rows, functions)
    for name, kinds in entries.items():
        collector.call(collector.scope[name], kinds, None, None)
    return program_of(collector, list(entries))


def struct_text(struct: Struct, words: Callable[[Member], str]) -> str:
    """The structure as C, each member with what it is (``""``: nothing)."""
    types: dict[Kind, str] = {"float": "double", "int": "int32_t", "count": "int32_t"}
    lines = [
        f"{INDENT}{types[each.kind]} {each.name}{f'[{each.length}]' if each.length else ''};"
        + (f" /* {words(each)} */" if words(each) else "")
        for each in struct.members
    ]
    return "\n".join(["typedef struct {", *lines, f"}} {struct.type};"])
