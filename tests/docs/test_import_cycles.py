"""No module imports itself by way of others, at start-up or later: read from the source, nothing is run."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any

import grimp
import pytest

GRAPH = grimp.build_graph(
    "actuator_lti", "nonlinear", "analyses", "reports", exclude_type_checking_imports=True, cache_dir=None
)
CONVENIENCES = {"actuator_lti.design.model"}
"""Modules whose methods ask what is built on them (`Design.with_values`, what a notebook shows)."""
LAZY = {"actuator_lti", "nonlinear", "analyses"}
"""Packages whose names are loaded on first use (`actuator_lti.start.on_first_use`)."""


def imports(module: str) -> Iterator[Any]:
    for name in GRAPH.find_modules_directly_imported_by(module):
        yield from GRAPH.get_import_details(importer=module, imported=name)


@cache
def later(module: str) -> set[int]:
    path = Path(__file__).resolve().parents[2].joinpath(*module.split("."))
    tree = ast.parse((path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text())
    functions = [one for one in ast.walk(tree) if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)]
    inside = (node for one in functions for node in ast.walk(one))
    return {node.lineno for node in inside if isinstance(node, ast.Import | ast.ImportFrom)}


def graph(with_functions: bool) -> dict[str, set[str]]:
    """What each module imports as it is loaded, or in a function, too."""
    result = {}
    for module in GRAPH.modules:
        whole = with_functions and module not in CONVENIENCES and not GRAPH.find_children(module)
        left_out = set() if whole else later(module)
        result[module] = {one["imported"] for one in imports(module) if one["line_number"] not in left_out}
    return result


def test_no_import_cycle() -> None:
    result = graph(True)
    assert len(result) > 300
    try:
        TopologicalSorter(result).prepare()
    except CycleError as error:
        pytest.fail(" <- ".join(error.args[1]))


def test_a_cycle_would_be_seen() -> None:
    result = graph(False)
    assert "actuator_lti.margins.engine" in result["actuator_lti.margins"]
    result["actuator_lti.errors"].add("actuator_lti.margins.engine")
    with pytest.raises(CycleError):
        TopologicalSorter(result).prepare()


def everything_loaded(module: str, direct: dict[str, set[str]]) -> set[str]:
    """The project's modules that are there once this one is, packages above them too."""
    result: set[str] = set()
    waiting = [module]
    while waiting:
        one = waiting.pop()
        parts = one.split(".")
        above = {".".join(parts[:k]) for k in range(1, len(parts))}
        waiting += [name for name in direct[one] | above if name not in result]
        result.add(one)
    return result


def test_no_function_imports_what_is_loaded_anyway() -> None:
    """An import in a function is for start-up or for an extra; else it stands at the top."""
    direct, idle = graph(False), []
    loaded = cache(lambda name: everything_loaded(name, direct))
    for module in GRAPH.modules - CONVENIENCES:
        there = loaded(module) - {module} - LAZY
        for one in imports(module):
            name = one["imported"]
            if one["line_number"] in later(module) and name in there and module not in loaded(name):
                idle.append(f"{module}:{one['line_number']}: {one['line_contents']}")
    assert not idle, "\n".join(sorted(set(idle)))
