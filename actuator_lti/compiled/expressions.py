"""Expressions: their kind, and their text in C."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

from actuator_lti.compiled.form import Form, value_of
from actuator_lti.compiled.kernel import is_kernel
from actuator_lti.compiled.kinds import FUNCTIONS, Function, Kind, c_float, c_name

Text = tuple[str, Kind]
Constant = int | float | tuple[float, ...] | tuple[int, ...]
Calls = Callable[[Any, list[Kind], ast.AST, Function], Function]

_TESTS = ("isfinite", "isnan", "isinf")
_MATH = set(FUNCTIONS.split()) - {*_TESTS, "abs", "floor"}
ARITHMETIC = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
_BITS = {ast.BitAnd: "&", ast.BitOr: "|", ast.BitXor: "^", ast.LShift: "<<", ast.RShift: ">>"}
_COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


class Expressions:
    """Translates the expressions of one function.

    ``call`` analyses a called function for the kinds of its arguments; ``constants`` is filled with every
    named constant that is used; ``prefix`` stands in front of the names of minimum and maximum; ``form``
    knows numbers that the function's row holds.
    """

    def __init__(
        self,
        function: Function,
        call: Calls,
        constants: dict[str, Constant],
        prefix: str,
        form: Form | None = None,
    ) -> None:
        self.function, self.call, self.constants, self.prefix = function, call, constants, prefix
        self.form = form
        self.told: dict[str, bool] = {}

    def value(self, node: ast.expr) -> Any:
        """What an expression is worth by the known numbers of the form; None where it is not known."""
        return None if self.form is None else value_of(node, self._look)

    def _look(self, node: ast.expr) -> Any:
        if isinstance(node, ast.Name) and node.id in self.told:
            return self.told[node.id]
        if isinstance(node, ast.Subscript):
            return self._known(node)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            value = getattr(self.function.scope.get(node.value.id), node.attr, None)
            return value if type(value) in (int, float) else None
        return None

    def _known(self, node: ast.Subscript) -> float | None:
        """The known number at a constant place of the form's row."""
        form = self.form
        if form is None or not isinstance(node.value, ast.Name) or node.value.id != form.row:
            return None
        place = self._place(node.slice)
        return None if place is None else form.known.get(place)

    def _place(self, node: ast.expr) -> int | None:
        if not isinstance(node, ast.Name | ast.Attribute):
            return None
        if isinstance(node, ast.Name) and node.id in (*self.function.variables, *self.function.arguments):
            return None
        value = self.constants.get(self.emit(node)[0])
        return value if isinstance(value, int) else None

    def emit(self, node: ast.expr) -> Text:
        """Text and kind of an expression."""
        method = getattr(self, f"_{type(node).__name__}", None)
        if method is None:
            raise self.function.error(node, f"{type(node).__name__} is not in the subset")
        text: Text = method(node)
        return text

    def condition(self, node: ast.expr) -> str:
        """A test; whole numbers are compared with 0, floats must be compared in the source."""
        text, kind = self.emit(node)
        if kind == "bool":
            return bare(text)
        if kind == "int":
            return f"{text} != 0"
        raise self.function.error(node, f"a {kind} as a condition; compare it")

    def as_float(self, node: ast.expr) -> str:
        """A number as a double."""
        text, kind = self.emit(node)
        if kind not in ("float", "int"):
            raise self.function.error(node, f"a {kind} where a number is wanted")
        return widened(text, kind)

    def _Constant(self, node: ast.Constant) -> Text:
        value = node.value
        if isinstance(value, bool):
            return ("true" if value else "false"), "bool"
        if isinstance(value, int):
            return str(value), "int"
        if isinstance(value, float):
            return c_float(value), "float"
        raise self.function.error(node, f"the constant {value!r} is not in the subset")

    def _Name(self, node: ast.Name) -> Text:
        function, name = self.function, node.id
        if name in self.told:
            return ("true" if self.told[name] else "false"), "bool"
        if name in function.variables:
            return c_name(name), function.variables[name]
        if name in function.arguments:
            return c_name(name), function.arguments[name]
        if name in function.scope:
            return self._constant(name, function.scope[name], node)
        raise function.error(node, f"{name} is not known here")

    def _Attribute(self, node: ast.Attribute) -> Text:
        base = node.value
        module = self.function.scope.get(base.id) if isinstance(base, ast.Name) else None
        if not isinstance(module, ModuleType):
            raise self.function.error(node, "an attribute of something that is no module")
        if module is math:
            return c_float(getattr(math, node.attr)), "float"
        return self._constant(node.attr, getattr(module, node.attr), node, module.__name__)

    def _constant(self, name: str, value: Any, node: ast.AST, module: str = "") -> Text:
        if type(value) not in (int, float):
            raise self.function.error(node, f"{name} is neither a whole number nor a float")
        return self._kept(name, value, node, module), "int" if type(value) is int else "float"

    def _kept(self, name: str, value: Constant, node: ast.AST, module: str = "") -> str:
        """A named constant or table; one of another module that has its name gets that module's in front."""
        if self.constants.get(name, value) != value:
            name = f"{(module or self.function.module).rpartition('.')[2].upper().lstrip('_')}_{name}"
        known = self.constants.setdefault(name, value)
        if known != value:
            raise self.function.error(node, f"the constant {name} has two values: {known}, {value}")
        return name

    def _Subscript(self, node: ast.Subscript) -> Text:
        length = self._length(node)
        if length is not None:
            return length, "int"
        table = self._table(node.value)
        whole = table is not None and type(self.constants[table][0]) is int  # type: ignore[index]
        return self.element(node), "int" if whole else "float"

    def _length(self, node: ast.Subscript) -> str | None:
        """``row.shape[0]`` of a table, or of a row that knows its length; None for anything else."""
        value, index = node.value, node.slice
        if not isinstance(value, ast.Attribute) or value.attr != "shape" or ast.unparse(index) != "0":
            return None
        table = self._table(value.value)
        if table is not None:
            return str(len(self.constants[table]))  # type: ignore[arg-type]
        text, kind = self.emit(value.value)
        return f"{text}.length" if kind == "bytes" else None

    def element(self, node: ast.Subscript) -> str:
        """``row[index]``."""
        table = self._table(node.value)
        known = self._known(node)
        if known is not None:
            return c_float(known)
        row, kind = (table, "row") if table else self.emit(node.value)
        if kind not in ("row", "bytes"):
            raise self.function.error(node, "only a row has elements")
        row = f"{row}.at" if kind == "bytes" else row
        index, index_kind = self.emit(node.slice)
        if index_kind != "int":
            raise self.function.error(node, f"an index that is a {index_kind}; use int()")
        return f"{row}[{bare(index)}]"

    def _table(self, node: ast.expr) -> str | None:
        """Name of a table of floats of the module; None for anything else."""
        if not isinstance(node, ast.Name) or node.id in (*self.function.variables, *self.function.arguments):
            return None
        value: Any = self.function.scope.get(node.id)
        if getattr(value, "ndim", None) == 1:  # an array of numpy
            value = tuple(value.tolist())
        if not isinstance(value, tuple) or not value:
            return None
        if any(type(item) is not type(value[0]) for item in value) or type(value[0]) not in (int, float):
            return None
        return self._kept(node.id, value, node)

    def _BinOp(self, node: ast.BinOp) -> Text:
        (left, a), (right, b) = self.emit(node.left), self.emit(node.right)
        kind = type(node.op)
        if kind in _BITS:
            if (a, b) != ("int", "int"):
                raise self.function.error(node, "bits of what is no whole number")
            return f"({left} {_BITS[kind]} {right})", "int"
        if kind not in ARITHMETIC:
            raise self.function.error(node, f"the operator {kind.__name__} is not in the subset")
        if "bool" in (a, b) or "row" in (a, b):
            raise self.function.error(node, f"arithmetic of {a} and {b}")
        # a quotient is a float in Python, of whole numbers too
        whole = (a, b) == ("int", "int") and kind is not ast.Div
        if not whole:
            left, right = widened(left, a), widened(right, b)
        return f"({left} {ARITHMETIC[kind]} {right})", "int" if whole else "float"

    def _UnaryOp(self, node: ast.UnaryOp) -> Text:
        if isinstance(node.op, ast.Not):
            return f"(!({self.condition(node.operand)}))", "bool"
        text, kind = self.emit(node.operand)
        if not isinstance(node.op, ast.USub) or kind not in ("int", "float"):
            raise self.function.error(node, "this unary operator is not in the subset")
        return f"(-{text})", kind

    def _BoolOp(self, node: ast.BoolOp) -> Text:
        sign = " && " if isinstance(node.op, ast.And) else " || "
        return "(" + sign.join(f"({self.condition(value)})" for value in node.values) + ")", "bool"

    def _Compare(self, node: ast.Compare) -> Text:
        values = [node.left, *node.comparators]
        if len(values) > 2 and any(
            not isinstance(v, ast.Name | ast.Constant | ast.Attribute) for v in values[1:-1]
        ):
            raise self.function.error(node, "a chained comparison evaluates its middle once; give it a name")
        parts = []
        for left, op, right in zip(values, node.ops, values[1:], strict=False):
            if type(op) not in _COMPARE:
                raise self.function.error(node, f"the comparison {type(op).__name__} is not in the subset")
            parts.append(self._compared(left, _COMPARE[type(op)], right))
        return "(" + " && ".join(f"({part})" if len(parts) > 1 else part for part in parts) + ")", "bool"

    def _compared(self, left: ast.expr, sign: str, right: ast.expr) -> str:
        (a, first), (b, second) = self.emit(left), self.emit(right)
        if (first, second) == ("int", "int"):
            return f"{a} {sign} {b}"
        return f"{self.as_float(left)} {sign} {self.as_float(right)}"

    def _IfExp(self, node: ast.IfExp) -> Text:
        value = self.value(node.test)
        if value is not None:
            return self.emit(node.body if value else node.orelse)
        (yes, a), (no, b) = self.emit(node.body), self.emit(node.orelse)
        if a != b:
            raise self.function.error(node, f"one branch is a {a}, the other a {b}")
        return f"(({self.condition(node.test)}) ? {yes} : {no})", a

    def _Call(self, node: ast.Call) -> Text:
        callee, texts = self.called(node)
        if callee is None:
            return texts[0], texts[1]  # type: ignore[return-value]  # the kind of one built in
        if callee.returns is None or len(callee.returns) != 1:
            raise self.function.error(node, f"{callee.name} returns no single value")
        return f"{callee.c_name}({', '.join(texts)})", callee.returns[0]

    def called(self, node: ast.Call) -> tuple[Function | None, list[str]]:
        """The function called and the texts of its arguments; None with text and kind for one built in."""
        if node.keywords:
            raise self.function.error(node, "arguments by name are not in the subset")
        built_in = self._built_in(node)
        if built_in is not None:
            return None, list(built_in)
        scope, target = self.function.scope, node.func
        value = scope.get(target.id) if isinstance(target, ast.Name) else None
        if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
            value = getattr(scope.get(target.value.id), target.attr, None)
        if not is_kernel(value):
            raise self.function.error(node, f"{ast.unparse(target)} is no compiled function")
        emitted = [self.emit(argument) for argument in node.args]
        callee = self.call(value, [kind for _, kind in emitted], node, self.function)
        return callee, [bare(text) for text, _ in emitted]

    def _built_in(self, node: ast.Call) -> tuple[str, str] | None:
        target = node.func
        if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
            if self.function.scope.get(target.value.id) is not math:
                return None
            return self._math(node, target.attr)
        name = target.id if isinstance(target, ast.Name) else ""
        if name in self.function.scope or name not in ("abs", "min", "max", "int", "float"):
            return None
        emitted = [self.emit(argument) for argument in node.args]
        texts, kinds = [text for text, _ in emitted], {kind for _, kind in emitted}
        if kinds - {"int", "float"}:
            raise self.function.error(node, f"{name} of what is no number")
        kind = "int" if kinds == {"int"} else "float"
        if name in ("int", "float"):
            return f"(({'int' if name == 'int' else 'double'}){texts[0]})", name
        if name == "abs":
            return f"{'abs' if kind == 'int' else 'fabs'}({bare(texts[0])})", kind
        if len(texts) != 2:
            raise self.function.error(node, f"{name} of {len(texts)} numbers; two are in the subset")
        suffix = "_int" if kind == "int" else ""
        if kind == "float":
            texts = [self.as_float(argument) for argument in node.args]
        return f"{self.prefix}{name}{suffix}({bare(texts[0])}, {bare(texts[1])})", kind

    def _math(self, node: ast.Call, name: str) -> tuple[str, str]:
        if name == "ldexp":
            (whole, kind), mantissa = self.emit(node.args[1]), bare(self.as_float(node.args[0]))
            if kind != "int":
                raise self.function.error(node, f"an exponent that is a {kind}; use int()")
            return f"ldexp({mantissa}, {bare(whole)})", "float"
        texts = ", ".join(bare(self.as_float(argument)) for argument in node.args)
        if name == "floor":  # a whole number in Python; adding 0 turns -0 into 0 as integers do
            return f"(floor({texts}) + 0.0)", "float"
        if name in _TESTS:
            return f"({name}({texts}) != 0)", "bool"
        if name not in _MATH:
            raise self.function.error(node, f"math.{name} is not in the subset")
        return f"{name}({texts})", "float"


def widened(text: str, kind: Kind) -> str:
    """A number in floating-point arithmetic: C would convert it by itself, here it is seen."""
    return f"((double){text})" if kind == "int" else text


def bare(text: str) -> str:
    """Text without the parentheses that enclose all of it."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    depth = 0
    for place, character in enumerate(text):
        depth += {"(": 1, ")": -1}.get(character, 0)
        if depth == 0 and place < len(text) - 1:
            return text
    return text[1:-1]
