"""The kinds of values that the subset knows, and how C spells them."""

import ast
import inspect
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

# bytes: a row of small whole numbers that knows its length; count: of an encoder, it goes round at 2**32
Kind = Literal["float", "int", "bool", "row", "bytes", "count"]

C_TYPES: dict[Kind, str] = {"float": "double", "int": "int", "bool": "bool", "count": "int32_t"}

# names that C, its standard headers or its compilers take
_KEYWORDS = """
    auto bool break case char const continue default do double else enum extern false float for goto if inline
    int long register restrict return short signed sizeof static struct switch true typedef union unsigned
    void volatile while complex imaginary I NULL NAN INFINITY HUGE_VAL errno index gamma y0 y1 yn j0 j1 jn
    near far
"""
FUNCTIONS = """
    sqrt exp expm1 log log1p sin cos tan asin acos atan atanh asinh acosh atan2 sinh cosh tanh hypot copysign
    ldexp fabs ceil floor abs isfinite isnan isinf
"""
RESERVED = frozenset((_KEYWORDS + FUNCTIONS).split())


class EmitError(ValueError):
    """A construct that the emitter does not know, with its file and line."""


@dataclass
class Function:
    """One function of the program, analysed for one list of argument kinds."""

    name: str
    module: str
    file: str
    first_line: int
    tree: ast.FunctionDef
    scope: dict[str, Any]  # the globals of its module
    arguments: dict[str, Kind]
    prefix: str  # in front of its name in C
    returns: tuple[Kind, ...] | None = None  # None where nothing is returned; one kind is a plain value
    # local variables in order of first assignment, loop indices apart
    variables: dict[str, Kind] = field(default_factory=dict)
    # row arguments whose elements it, or a function it calls, assigns
    written: set[str] = field(default_factory=set)

    @property
    def c_name(self) -> str:
        return f"{self.prefix}{self.name}"

    def local(self, name: str) -> Kind | None:
        """The kind of a variable or argument; None for any other name."""
        return self.variables.get(name) or self.arguments.get(name)

    def error(self, node: ast.AST, text: str) -> EmitError:
        line = self.first_line + getattr(node, "lineno", 1) - 1
        return EmitError(f"{self.file}:{line}: {self.name}: {text}")

    def want(self, holds: bool, node: ast.AST, text: str) -> None:
        """Refuse a place in the source where something does not hold."""
        if not holds:
            raise self.error(node, text)


def tree_of(python: Any) -> ast.FunctionDef:
    tree = ast.parse(textwrap.dedent(inspect.getsource(python))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    return tree


def named(node: ast.AST, scope: Mapping[str, Any]) -> Any:
    """What a global name, or an attribute of one, stands for; None for anything else."""
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        return getattr(scope.get(node.value.id), node.attr, None)
    return scope.get(node.id) if isinstance(node, ast.Name) else None


def stored(tree: ast.AST) -> list[str]:
    """The variables that a function assigns, once for each place where it does."""
    return [n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]


def c_name(name: str) -> str:
    return f"{name}_" if name in RESERVED else name


def c_float(value: float) -> str:
    """A literal that reads back as the same double."""
    if value != value:
        return "NAN"
    if value in (float("inf"), float("-inf")):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    text = repr(value)
    return text if any(c in text for c in ".e") else text + ".0"
