"""Every public name and every command has an example that is run: a doctest, or code of a page."""

import doctest
import importlib
import inspect
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.command_line import commands

ROOT = Path(__file__).parents[2]
PAGES = [path for path in (ROOT / "docs").rglob("*.md") if path.parent.name != "generated"]
RUN = re.compile(r"^```\{(code-cell|python-run|shell-run)\}[^\n]*\n(.*?)^```", re.M | re.S)
PACKAGES = (
    "actuator_lti", "nonlinear", "nonlinear.commands", "nonlinear.loads", "analyses",
    "actuator_lti.drawing.plotting",
)  # fmt: skip


def code_of_pages() -> tuple[str, str]:
    result = [match for page in PAGES for match in RUN.findall(page.read_text(encoding="utf-8"))]
    python = "\n".join(code for kind, code in result if kind != "shell-run")
    return python, "\n".join(code for kind, code in result if kind == "shell-run")


PYTHON, SHELL = code_of_pages()


def public(package: str) -> dict[str, Any]:
    module = importlib.import_module(package)
    names = getattr(module, "__all__", None)
    if names is None:
        own = inspect.getmembers(module, lambda thing: getattr(thing, "__module__", "") == package)
        names = [name for name, thing in own if not name.startswith("_") and callable(thing)]
    return {f"{package}.{name}": getattr(module, name) for name in names}


THINGS = {name: thing for package in PACKAGES for name, thing in public(package).items()}


def has_doctest(thing: Any) -> bool:
    docs = [inspect.getdoc(thing) or ""]
    if inspect.isclass(thing):
        members = (member for name, member in vars(thing).items() if not name.startswith("__"))
        docs += [inspect.getdoc(member) or "" for member in members]
    return any(doctest.DocTestParser().get_examples(text) for text in docs)


def used(name: str, thing: Any) -> bool:
    short = name.rpartition(".")[2]
    word = rf"\b{re.escape(short)}\b"
    if isinstance(thing, ModuleType):
        word = rf"\b{re.escape(thing.__name__)}\b|\b{re.escape(short)}\."
    return re.search(word, PYTHON) is not None


@pytest.mark.parametrize("name", sorted(THINGS))
def test_every_public_name_has_an_example_and_words(name: str) -> None:
    thing = THINGS[name]
    assert has_doctest(thing) or used(name, thing), f"{name}: no example that is run"
    if callable(thing):
        assert (inspect.getdoc(thing) or "").strip(), f"{name}: no docstring"


@pytest.mark.parametrize("command", commands())
def test_every_command_has_an_example(command: str) -> None:
    assert re.search(rf"^actuator-lti {command}\b", SHELL, re.M), (
        f"{command}: no example that is run on a page"
    )


def test_what_counts_as_an_example() -> None:
    assert has_doctest(importlib.import_module("actuator_lti").sweep)
    assert not has_doctest(lambda: None)
    assert "assemble_loops" in PYTHON
    assert "actuator-lti margins" in SHELL
