"""Expressions: their kind, and their text in C."""

import ast
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

from actuator_lti.compiled.kernel import is_marked
from actuator_lti.compiled.kinds import FUNCTIONS, Function, Kind, c_float, c_name, named

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
    named constant that is used; ``prefix`` stands in front of the names of minimum and maximum; ``whole`` is
    what a statement evaluates, of which an expression may be a part.
    """

    def __init__(self, function: Function, call: Calls, constants: dict[str, Constant], prefix: str) -> None:
        self.function, self.call, self.constants, self.prefix = function, call, constants, prefix
        self.want, self.whole = function.want, ast.AST()

    def emit(self, node: ast.expr) -> Text:
        text: Text = self.translated(node)
        return text

    def translated(self, node: ast.AST) -> Any:
        """What the method for this kind of node gives."""
        method = getattr(self, f"_{type(node).__name__}", None)
        if method is None:
            raise self.function.error(node, f"{type(node).__name__} is not in the subset")
        return method(node)

    def condition(self, node: ast.expr) -> str:
        """A test; whole numbers are compared with 0, floats must be compared in the source."""
        text, kind = self.emit(node)
        self.want(kind in ("bool", "int"), node, f"a {kind} as a condition; compare it")
        return bare(text) if kind == "bool" else f"{text} != 0"

    def as_float(self, node: ast.expr) -> str:
        text, kind = self.emit(node)
        self.want(kind in ("float", "int"), node, f"a {kind} where a number is wanted")
        return widened(text, kind)

    def whole_number(self, node: ast.expr, what: str) -> str:
        text, kind = self.emit(node)
        self.want(kind == "int", node, f"{what} that is a {kind}; use int()")
        return bare(text)

    def _Constant(self, node: ast.Constant) -> Text:
        value = node.value
        if isinstance(value, bool):
            return ("true" if value else "false"), "bool"
        self.want(isinstance(value, int | float), node, f"the constant {value!r} is not in the subset")
        return (str(value), "int") if isinstance(value, int) else (c_float(value), "float")  # type: ignore[arg-type]

    def _Name(self, node: ast.Name) -> Text:
        kind = self.function.local(node.id)
        if kind is not None:
            return c_name(node.id), kind
        self.want(node.id in self.function.scope, node, f"{node.id} is not known here")
        return self._constant(node.id, self.function.scope[node.id], node)

    def _Attribute(self, node: ast.Attribute) -> Text:
        module = named(node.value, self.function.scope)
        if not isinstance(module, ModuleType):
            raise self.function.error(node, "an attribute of something that is no module")
        if module is math:
            return c_float(getattr(math, node.attr)), "float"
        return self._constant(node.attr, getattr(module, node.attr), node, module.__name__)

    def _constant(self, name: str, value: Any, node: ast.AST, module: str = "") -> Text:
        self.want(type(value) in (int, float), node, f"{name} is neither a whole number nor a float")
        return self._kept(name, value, node, module), "int" if type(value) is int else "float"

    def _kept(self, name: str, value: Constant, node: ast.AST, module: str = "") -> str:
        """A named constant or table; one of another module that has its name gets that module's in front."""
        if self.constants.get(name, value) != value:
            name = f"{(module or self.function.module).rpartition('.')[2].upper().lstrip('_')}_{name}"
        known = self.constants.setdefault(name, value)
        self.want(known == value, node, f"the constant {name} has two values: {known}, {value}")
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
        value = node.value
        if not isinstance(value, ast.Attribute) or value.attr != "shape" or ast.unparse(node.slice) != "0":
            return None
        table = self._table(value.value)
        if table is not None:
            return str(len(self.constants[table]))  # type: ignore[arg-type]
        text, kind = self.emit(value.value)
        return f"{text}.length" if kind == "bytes" else None

    def element(self, node: ast.Subscript) -> str:
        table = self._table(node.value)
        row, kind = (table, "row") if table else self.emit(node.value)
        self.want(kind in ("row", "bytes"), node, "only a row has elements")
        return f"{row}{'.at' if kind == 'bytes' else ''}[{self.whole_number(node.slice, 'an index')}]"

    def _table(self, node: ast.expr) -> str | None:
        """Name of a table of numbers of the module; None for anything else."""
        if not isinstance(node, ast.Name) or self.function.local(node.id):
            return None
        value: Any = self.function.scope.get(node.id)
        if getattr(value, "ndim", None) == 1:  # an array of numpy
            value = tuple(value.tolist())
        if not isinstance(value, tuple) or {type(item) for item in value} not in ({int}, {float}):
            return None
        return self._kept(node.id, value, node)

    def _BinOp(self, node: ast.BinOp) -> Text:
        (left, a), (right, b) = self.emit(node.left), self.emit(node.right)
        kind = type(node.op)
        if kind in _BITS:
            self.want((a, b) == ("int", "int"), node, "bits of what is no whole number")
            return f"({left} {_BITS[kind]} {right})", "int"
        self.want(kind in ARITHMETIC, node, f"the operator {kind.__name__} is not in the subset")
        self.want(not {"bool", "row"} & {a, b}, node, f"arithmetic of {a} and {b}")
        # a quotient is a float in Python, of whole numbers too
        whole = (a, b) == ("int", "int") and kind is not ast.Div
        if not whole:
            left, right = widened(left, a), widened(right, b)
        return f"({left} {ARITHMETIC[kind]} {right})", "int" if whole else "float"

    def _UnaryOp(self, node: ast.UnaryOp) -> Text:
        if isinstance(node.op, ast.Not):
            return f"(!({self.condition(node.operand)}))", "bool"
        text, kind = self.emit(node.operand)
        known = isinstance(node.op, ast.USub) and kind in ("int", "float")
        self.want(known, node, "this unary operator is not in the subset")
        return f"(-{text})", kind

    def _BoolOp(self, node: ast.BoolOp) -> Text:
        sign = " && " if isinstance(node.op, ast.And) else " || "
        return "(" + sign.join(f"({self.condition(value)})" for value in node.values) + ")", "bool"

    def _Compare(self, node: ast.Compare) -> Text:
        values = [node.left, *node.comparators]
        once = all(isinstance(v, ast.Name | ast.Constant | ast.Attribute) for v in values[1:-1])
        self.want(once, node, "a chained comparison evaluates its middle once; give it a name")
        parts = []
        for left, op, right in zip(values, node.ops, values[1:], strict=False):
            self.want(type(op) in _COMPARE, node, f"the comparison {type(op).__name__} is not in the subset")
            parts.append(self._compared(left, _COMPARE[type(op)], right))
        return "(" + " && ".join(f"({part})" if len(parts) > 1 else part for part in parts) + ")", "bool"

    def _compared(self, left: ast.expr, sign: str, right: ast.expr) -> str:
        (a, first), (b, second) = self.emit(left), self.emit(right)
        if (first, second) == ("int", "int"):
            return f"{a} {sign} {b}"
        return f"{self.as_float(left)} {sign} {self.as_float(right)}"

    def _IfExp(self, node: ast.IfExp) -> Text:
        (yes, a), (no, b) = self.emit(node.body), self.emit(node.orelse)
        self.want(a == b, node, f"one branch is a {a}, the other a {b}")
        return f"(({self.condition(node.test)}) ? {yes} : {no})", a

    def _Call(self, node: ast.Call) -> Text:
        built_in = self.built_in(node)
        if built_in is not None:
            return built_in
        callee, texts = self.called(node)
        if callee.returns is None or len(callee.returns) != 1:
            raise self.function.error(node, f"{callee.name} returns no single value")
        return f"{callee.c_name}({', '.join(texts)})", callee.returns[0]

    def called(self, node: ast.Call) -> tuple[Function, list[str]]:
        """The kernel that is called and the texts of its arguments.

        Refused is a call that writes a row beside another look into that row: C leaves their order open.
        """
        self.want(not node.keywords, node, "arguments by name are not in the subset")
        value = named(node.func, self.function.scope)
        self.want(is_marked(value, "kernel"), node, f"{ast.unparse(node.func)} is no compiled function")
        emitted = [self.emit(argument) for argument in node.args]
        callee = self.call(value, [kind for _, kind in emitted], node, self.function)
        for argument, name in zip(node.args, callee.arguments, strict=True):
            if name in callee.written and isinstance(argument, ast.Name):
                row = argument.id
                self.function.written.add(row)
                if _uses(self.whole, row) > _uses(node, row):
                    text = f"writes {row} beside another use of {row}; give it a line of its own"
                    raise self.function.error(node, text)
        return callee, [bare(text) for text, _ in emitted]

    def built_in(self, node: ast.Call) -> Text | None:
        """A function of Python or of its module ``math``; None for any other."""
        self.want(not node.keywords, node, "arguments by name are not in the subset")
        target, scope = node.func, self.function.scope
        if isinstance(target, ast.Attribute):
            return self._math(node, target.attr) if named(target.value, scope) is math else None
        name = target.id if isinstance(target, ast.Name) else ""
        if name in scope or name not in ("abs", "min", "max", "int", "float"):
            return None
        emitted = [self.emit(argument) for argument in node.args]
        texts, kinds = [text for text, _ in emitted], {kind for _, kind in emitted}
        self.want(not kinds - {"int", "float"}, node, f"{name} of what is no number")
        kind: Kind = "int" if kinds == {"int"} else "float"
        if name in ("int", "float"):
            return (f"((int){texts[0]})", "int") if name == "int" else (f"((double){texts[0]})", "float")
        if name == "abs":
            return f"{'abs' if kind == 'int' else 'fabs'}({bare(texts[0])})", kind
        self.want(len(texts) == 2, node, f"{name} of {len(texts)} numbers; two are in the subset")
        if kind == "float":
            texts = [self.as_float(argument) for argument in node.args]
        suffix = "_int" if kind == "int" else ""
        return f"{self.prefix}{name}{suffix}({bare(texts[0])}, {bare(texts[1])})", kind

    def _math(self, node: ast.Call, name: str) -> Text:
        if name == "ldexp":
            mantissa = bare(self.as_float(node.args[0]))
            return f"ldexp({mantissa}, {self.whole_number(node.args[1], 'an exponent')})", "float"
        texts = ", ".join(bare(self.as_float(argument)) for argument in node.args)
        if name == "floor":  # a whole number in Python; adding 0 turns -0 into 0 as integers do
            return f"(floor({texts}) + 0.0)", "float"
        if name in _TESTS:
            return f"({name}({texts}) != 0)", "bool"
        self.want(name in _MATH, node, f"math.{name} is not in the subset")
        return f"{name}({texts})", "float"


def _uses(tree: ast.AST, name: str) -> int:
    return sum(isinstance(each, ast.Name) and each.id == name for each in ast.walk(tree))


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
