"""No module imports itself by way of others, at start-up or later: read from the source, nothing is run."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("actuator_lti", "nonlinear", "analyses", "reports")
CONVENIENCES = {"actuator_lti.design.model"}
"""Modules whose methods ask what is built on them (`Design.with_values`, what a notebook shows)."""
Node = ast.Import | ast.ImportFrom


def named(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {named(path): path for package in PACKAGES for path in (ROOT / package).rglob("*.py")}


@cache
def read(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def imports(body: list[ast.stmt]) -> Iterator[Node]:
    """Imports that run when a module is loaded; not those for the type checker, nor in functions."""
    for node in body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif isinstance(node, ast.If):
            yield from () if "TYPE_CHECKING" in ast.unparse(node.test) else imports(node.body)
            yield from imports(node.orelse)
        elif isinstance(node, ast.Try | ast.With):
            yield from imports(node.body)


def later(tree: ast.Module) -> Iterator[Node]:
    """Imports in functions."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from (node for node in ast.walk(function) if isinstance(node, ast.Import | ast.ImportFrom))


def targets(node: Node, module: str) -> set[str]:
    if isinstance(node, ast.Import):
        return {item.name for item in node.names} & MODULES.keys()
    base = node.module or ""
    if node.level:
        package = module if MODULES[module].stem == "__init__" else module.rpartition(".")[0]
        above = package.split(".")
        above = above[: len(above) - node.level + 1]
        base = ".".join([*above, base] if base else above)
    named_modules = {f"{base}.{item.name}" for item in node.names} & MODULES.keys()
    whole = len(named_modules) == len(node.names)
    return named_modules if whole else named_modules | ({base} & MODULES.keys())


def graph(with_functions: bool) -> dict[str, set[str]]:
    result = {}
    for module, path in MODULES.items():
        tree = read(path)
        nodes = list(imports(tree.body))
        if with_functions and module not in CONVENIENCES and path.stem != "__init__":
            nodes += later(tree)
        result[module] = {name for node in nodes for name in targets(node, module)} - {module}
    return result


@pytest.mark.parametrize("with_functions", [False, True], ids=["at start-up", "in functions, too"])
def test_no_import_cycle(with_functions: bool) -> None:
    result = graph(with_functions)
    assert len(result) > 300
    assert "actuator_lti.margins.engine" in result["actuator_lti.margins"] or with_functions
    try:
        TopologicalSorter(result).prepare()
    except CycleError as error:
        pytest.fail(" <- ".join(error.args[1]))


def test_a_cycle_would_be_seen() -> None:
    result = graph(False)
    result["actuator_lti.errors"].add("actuator_lti.margins.engine")
    with pytest.raises(CycleError):
        TopologicalSorter(result).prepare()


LAZY = {"actuator_lti", "nonlinear", "analyses"}
"""Packages whose names are loaded on first use (`actuator_lti.start.on_first_use`)."""


def everything_loaded(module: str, direct: dict[str, set[str]]) -> set[str]:
    """The project's modules that are there once this one is, packages above them too."""
    result: set[str] = set()
    waiting = [module]
    while waiting:
        one = waiting.pop()
        parts = one.split(".")
        above = {".".join(parts[:k]) for k in range(1, len(parts))} & MODULES.keys()
        waiting += [name for name in direct.get(one, set()) | above if name not in result]
        result.add(one)
    return result


def test_no_function_imports_what_is_loaded_anyway() -> None:
    """An import in a function is for start-up or for an extra; else it stands at the top."""
    direct, idle = graph(False), []
    loaded = cache(lambda name: everything_loaded(name, direct))
    for module, path in MODULES.items():
        if module in CONVENIENCES:
            continue
        there = loaded(module) - {module}
        for node in later(read(path)):
            named_ones = targets(node, module)
            if not named_ones or named_ones & LAZY or not named_ones <= there:
                continue
            if not any(module in loaded(name) for name in named_ones):
                idle.append(f"{path.relative_to(ROOT)}:{node.lineno}: {ast.unparse(node)}")
    assert not idle, "\n".join(sorted(set(idle)))
