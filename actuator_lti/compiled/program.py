"""A whole program: the entry functions and all that they call, callees first."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from actuator_lti.compiled.expressions import Constant
from actuator_lti.compiled.form import Form, Known
from actuator_lti.compiled.kernel import is_marked
from actuator_lti.compiled.kinds import C_TYPES, EmitError, Function, Kind, c_float, c_name, tree_of
from actuator_lti.compiled.statements import INDENT, Statements, result_type

_INCLUDES = "#include <math.h>\n#include <stdbool.h>\n#include <stdlib.h>\n"
_BYTES = "typedef struct { unsigned short *at; int length; } @bytes;"
_MINMAX = {
    "min": "static inline double @min(double a, double b) { return (b < a) ? b : a; }",
    "max": "static inline double @max(double a, double b) { return (b > a) ? b : a; }",
    "abs": "static inline double @abs(double a) { return (a < 0.0) ? -a : a; }",
    "min_int": "static inline int @min_int(int a, int b) { return (b < a) ? b : a; }",
    "max_int": "static inline int @max_int(int a, int b) { return (b > a) ? b : a; }",
}

# a form of a loop, or a wide one, once for processors with AVX2 and once for all others, with the same
# arithmetic; what a wide one calls is put into it
_CLONES = """\
#if defined(__GLIBC__) && !defined(__UCLIBC__) && defined(__x86_64__) && !defined(__clang__)
#define @clones __attribute__((target_clones("avx2", "default")))
#define @wide @clones __attribute__((flatten))
#else
#define @clones
#define @wide
#endif
"""
_INLINED = "static inline __attribute__((always_inline)) "
_ZERO: dict[Kind, str] = {"float": "0.0", "int": "0", "bool": "false", "count": "0"}


@dataclass(frozen=True)
class Program:
    """C text of functions and what they need."""

    constants: Mapping[str, Constant]  # named constants used, in the order of first use
    types: str  # structures of functions with several results
    functions: str  # definitions, callees first; entries have external linkage, all others are static
    declarations: Mapping[str, str]  # prototype of each entry function
    prefix: str  # in front of every function and type name

    @property
    def helpers(self) -> list[str]:
        known = {name: text.replace("@", self.prefix) for name, text in _MINMAX.items()}
        return [text for name, text in known.items() if f"{self.prefix}{name}(" in self.functions]

    @property
    def source(self) -> str:
        cloned = any(f"{self.prefix}{mark} " in self.functions for mark in ("clones", "wide"))
        clones = _CLONES.replace("@", self.prefix) if cloned else ""
        parts = [_INCLUDES + clones, _BYTES.replace("@", self.prefix), self.constants_text(), *self.helpers]
        return "\n".join([*parts, self.types, *self.declarations.values(), self.functions])

    def constants_text(self, notes: Mapping[str, str] | None = None) -> str:
        """The constants as C, whole numbers as one enum; ``notes`` says what each is."""
        notes = notes or {}
        whole = [(name, value) for name, value in self.constants.items() if isinstance(value, int)]
        listed = []
        for name, number in sorted(whole, key=lambda item: (item[1], item[0])):
            note = f" /* {_plain(notes[name])} */" if notes.get(name) else ""
            listed.append(f"{INDENT}{name} = {number},{note}")
        lines = ["enum {", *listed, "};"] if listed else []
        for name, value in self.constants.items():
            if isinstance(value, float):
                lines.append(f"static const double {name} = {c_float(value)};")
            elif isinstance(value, tuple):
                whole_numbers = type(value[0]) is int
                texts = ", ".join(str(item) if whole_numbers else c_float(item) for item in value)
                kind = "int" if whole_numbers else "double"
                lines.append(f"static const {kind} {name}[{len(value)}] = {{{texts}}};")
        return "\n".join(lines)


def emit_c(entries: Mapping[Any, Sequence[Kind]], forms: Sequence[Form] = ()) -> Program:
    """C99 for compiled functions, with the kinds of their arguments, and everything that they call.

    ``forms`` are second forms of functions that these call; the function itself chooses by its row, at every
    call. `EmitError`: the first construct outside the subset, with its file and line.
    """
    collector = Collector("drive_")
    names = [collector.call(python, list(kinds), None, None).name for python, kinds in entries.items()]
    return program_of(collector, names, [_Formed(collector, form) for form in forms])


def program_of(collector: Collector, names: Sequence[str], second: Sequence[_Formed] = ()) -> Program:
    """The program of the functions that a collector holds, those named with external linkage."""
    prefix = collector.prefix
    texts, types, declarations = [], [], {}
    done = [*collector.done.values(), *(each for formed in second for each in formed.done.values())]
    for function, lines in done:
        head = collector.head(function)
        public = function.prefix == prefix and function.name in names
        if public:
            declarations[function.name] = f"{head};"
        if function.returns is not None and len(function.returns) > 1:
            fields = " ".join(f"{C_TYPES[kind]} r{n};" for n, kind in enumerate(function.returns))
            types.append(f"typedef struct {{ {fields} }} {result_type(function)};")
        root = any(function is formed.root for formed in second)
        inner = function.prefix != prefix and not root
        linkage = "" if public else _INLINED if inner else "static "
        linkage += f"{prefix}clones " if root else ""
        linkage += f"{prefix}wide " if is_marked(function.scope.get(function.name), "wide") else ""
        texts.append(collector.definition(function, linkage + head, lines))
    texts = [f"static {collector.head(formed.root)};" for formed in second] + texts
    parts = "\n".join(types), "\n".join(texts)
    return Program(collector.constants, *parts, declarations, prefix)


class Collector:
    """The functions of a program, analysed as they are called."""

    def __init__(self, prefix: str, helpers: str = "") -> None:
        self.prefix, self.helpers = prefix, helpers or prefix
        self.constants: dict[str, Constant] = {}
        self.done: dict[str, tuple[Function, list[str]]] = {}
        self.open: list[str] = []

    def call(self, python: Any, kinds: list[Kind], node: ast.AST | None, caller: Function | None) -> Function:
        """A function analysed for these kinds of arguments."""
        name = python.__name__
        if name in self.done:
            known = self.done[name][0]
            if known.module != python.__module__:
                raise EmitError(f"two functions are called {name}: in {known.module} and {python.__module__}")
            if list(known.arguments.values()) != kinds:
                expected = ", ".join(known.arguments.values())
                text = f"{name} is called with ({', '.join(kinds)}), elsewhere with ({expected})"
                raise caller.error(node, text) if caller is not None and node is not None else EmitError(text)
            return known
        if name in self.open:
            raise EmitError(f"{name} calls itself: recursion is not in the subset")
        function = self.parsed(python, kinds)
        self.open.append(name)
        lines = self.statements(function).body()
        self.open.pop()
        self.done[name] = (function, lines)
        return function

    def parsed(self, python: Any, kinds: list[Kind]) -> Function:
        tree, first = tree_of(python), inspect.getsourcelines(python)[1]
        names = [argument.arg for argument in tree.args.args]
        file, scope = Path(inspect.getsourcefile(python) or "?").name, python.__globals__
        given, own = dict(zip(names, kinds, strict=False)), (python.__name__, python.__module__)
        function = Function(*own, file, first, tree, scope, given, self.prefix)
        if len(names) != len(kinds) or tree.args.defaults or tree.args.vararg or tree.args.kwonlyargs:
            taken = ", ".join(names)
            raise function.error(tree, f"takes ({taken}); defaults and stars are not in the subset")
        return function

    def statements(self, function: Function) -> Statements:
        return Statements(function, self.call, self.constants, self.helpers)

    def definition(self, function: Function, head: str, lines: list[str]) -> str:
        about = _plain(ast.get_docstring(function.tree) or "")
        described = [f" * {line}".rstrip() for line in about.splitlines()]
        comment = ["/*", *described, f" * ({function.file}, line {function.first_line})", " */"]
        names, text = map(c_name, function.arguments), "\n".join(lines)
        unused = [f"{INDENT}(void){name};" for name in names if not re.search(rf"\b{name}\b", text)]
        return "\n".join([*comment, head, "{", *declared(function), *unused, *lines, "}", ""])

    def head(self, function: Function) -> str:
        """The C prototype without its semicolon."""
        parts = []
        for name, kind in function.arguments.items():
            if kind == "row":
                const = "" if name in function.written else "const "
                parts.append(f"{const}double *{c_name(name)}")
            elif kind == "bytes":
                parts.append(f"{self.prefix}bytes {c_name(name)}")
            else:
                parts.append(f"{C_TYPES[kind]} {c_name(name)}")
        kinds = function.returns or ()
        returned = (
            result_type(function) if len(kinds) > 1 else "".join(C_TYPES[kind] for kind in kinds) or "void"
        )
        return f"{returned} {function.c_name}({', '.join(parts) or 'void'})"


class _Formed(Collector):
    """The functions of a form; those marked `seldom` are those of the program."""

    def __init__(self, program: Collector, form: Form) -> None:
        super().__init__(f"{program.prefix}{form.name}_", program.helpers)
        self.program, self.form, self.constants = program, form, program.constants
        self.chooser, lines = program.done[form.of]
        self.root = self.call(self.chooser.scope[form.of], list(self.chooser.arguments.values()), None, None)
        given = ", ".join(map(c_name, self.root.arguments))
        chosen = f"return {self.root.c_name}({given});"
        lines[:0] = [f"{INDENT}if ({form.test()}) {{", f"{INDENT * 2}{chosen}", f"{INDENT}}}"]

    def parsed(self, python: Any, kinds: list[Kind]) -> Function:
        function = super().parsed(python, kinds)
        function.tree.body = Known(function.tree, function.scope, self.form.look).block(function.tree.body)
        return function

    def call(self, python: Any, kinds: list[Kind], node: ast.AST | None, caller: Function | None) -> Function:
        collect = self.program.call if is_marked(python, "seldom") else super().call
        return collect(python, kinds, node, caller)


def declared(function: Function) -> list[str]:
    return [
        f"{INDENT}{C_TYPES[kind]} {c_name(name)} = {_ZERO[kind]};"
        for name, kind in function.variables.items()
    ]


def _plain(text: str) -> str:
    return text.replace("*/", "* /").replace("`", "")
