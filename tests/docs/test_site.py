"""The pages of the documentation: links, what sources cite of them, an example of every name and command."""

import doctest
import importlib
import importlib.util
import inspect
import re
from fnmatch import fnmatch
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import typer

from actuator_lti.design import FIELDS, QUANTITIES
from actuator_lti.design.fields import SECTIONS
from reports.cli.app import PANELS, build
from tests.command_line import commands

ROOT = Path(__file__).parents[2]
GENERATED = {"keys", "quantities", "commands", "glossary", "diagram", "bode", "map"}
PAGES = [
    ROOT / "README.md",
    *sorted(p for p in (ROOT / "docs").rglob("*.md") if p.parent.name != "generated"),
]
MOST = {"plant effect": 6, "limiter": 4, "controller block": 3, "figure": 3, "requirement quantity": 2}


@pytest.fixture(scope="module")
def made() -> ModuleType:
    path = ROOT / "docs" / "_ext" / "generated_pages.py"
    spec = importlib.util.spec_from_file_location("generated_pages", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_of_a_page_resolves(page: Path) -> None:
    targets = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    missing = [Path(target) for target in targets if not (page.parent / target).exists()]
    assert [one for one in missing if one.parent.name != "generated" or one.stem not in GENERATED] == []


def test_every_page_is_in_the_contents() -> None:
    named = {ROOT / "README.md"}
    for page in PAGES:
        trees = re.findall(r"(?s)```\{toctree\}.*?\n```", page.read_text("utf-8"))
        named |= {(page.parent / f"{line.strip()}.md").resolve() for line in "\n".join(trees).splitlines()}
    assert {*PAGES} - named == {ROOT / "docs" / "index.md"}


def test_every_part_of_a_drive_has_its_place_in_the_diagram(monkeypatch: pytest.MonkeyPatch) -> None:
    """All but what is asked of it, and what may stand at any stage."""
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_ext"))
    diagram = importlib.import_module("drive_diagram")
    free = {section.template for section in SECTIONS if section.asked or ".law" in section.path}
    sections = {section.template for section in SECTIONS} - free - {"control", "validation"}
    assert diagram.drawn_sections() == sections
    page = diagram.diagram_page()
    assert page.index('<div class="keys-wide"') < page.index("<svg")  # scrolls where it does not fit
    assert all(f">{field.key}</text>" in page for field in FIELDS.values() if field.section in sections)


@pytest.mark.parametrize("change", MOST)
def test_each_change_touches_no_more_files_than_promised(change: str) -> None:
    """Files of code that the page names for a change, and the number in its heading."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    title, table = re.split(rf"### A {change}", text)[1].split("\n", 1)
    rows = [line for line in table.split("\n### ")[0].splitlines() if line.startswith("| `")]
    assert len(rows) == int(title.rpartition(":")[2]) <= MOST[change]
    assert all(len(re.findall(r"`[\w/]+\.(?:py|md)`", row.split("|")[1])) <= 1 for row in rows)


def test_the_lists_hold_every_key_quantity_command_and_option(made: ModuleType) -> None:
    keys, quantities, page = made.keys_page(), made.quantities_page(), made.commands_page()
    for field in FIELDS.values():
        section = keys.split(f"## `[{field.section}]`")[1].split("\n## ")[0]
        assert f"| `{field.key}` |" in section, field.path
    assert all(f"| `{name}` | `{each.unit}` |" in quantities for name, each in QUANTITIES.items())
    root = typer.main.get_command(build())
    for panel, names in PANELS.items():
        assert f"## {panel}" in page
        for name in names:
            part = page.split(f"### `actuator-lti {name}`\n")[1].split("\n### ")[0]
            options = [o for p in root.commands[name].params for o in p.opts if o.startswith("--")]
            assert all(option in part for option in options if option != "--help")


def test_cells_of_tables_stay_cells(made: ModuleType) -> None:
    assert made.cell("a | b\n*c* <d>") == r"a \| b \*c\* &lt;d>"
    assert made.table(["a", "b"], [["1", "2"]]) == ["| a | b |", "| --- | --- |", "| 1 | 2 |", ""]


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
    assert re.search(rf"^actuator-lti {command}\b", SHELL, re.M), "no example that is run on a page"


def test_what_counts_as_an_example() -> None:
    assert has_doctest(importlib.import_module("actuator_lti").sweep)
    assert not has_doctest(lambda: None)
    assert "assemble_loops" in PYTHON
    assert "actuator-lti margins" in SHELL


MODEL = set(re.findall(r"(?m)^## ([0-9]+)\.", (ROOT / "docs" / "model.md").read_text(encoding="utf-8")))
OTHERS = {"README.md", "CHANGELOG.md", "SECURITY.md"}
OTHERS |= {"summary.md", "compiled_code.md"}  # written by a nightly build, and into an FMU
APART = re.compile(r"dist/|.*\bNAME\b|.*\.\.\.")  # made by a release, or for a name of one's own
CITED = re.compile(r"model\.md,?\s+sections?\s+([0-9]+(?:(?:\s*,\s*|\s+and\s+|\s+to\s+)[0-9]+)*)")


def sources() -> list[Path]:
    folders = ("actuator_lti", "nonlinear", "analyses", "reports", "tests", "benchmarks")
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def test_every_section_and_page_that_a_source_cites_exists() -> None:
    missing, result = [], 0
    pages = {path.name for path in (ROOT / "docs").rglob("*.md")} | OTHERS
    cited = re.compile(r"\b([A-Za-z][A-Za-z0-9_-]*\.md)\b")
    for path in sources():
        text = path.read_text(encoding="utf-8")
        for match in CITED.finditer(text):
            result += 1
            numbers = set(re.findall(r"[0-9]+", match[1]))
            missing += [f"{path.relative_to(ROOT)}: section {n}" for n in sorted(numbers - MODEL)]
        if path.name != Path(__file__).name:
            named = set(cited.findall(text)) - pages
            assert not {name for name in named if name[0].lower() + name[1:] not in pages}, path
    assert result > 20
    assert not missing


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/architecture.md", "SECURITY.md"])
def test_every_file_that_tells_where_things_are_is_there(page: str) -> None:
    """A path below the root, or the last parts of one."""
    tops = [ROOT / name for name in ("actuator_lti", "nonlinear", "analyses", "reports", "tests", "docs")]
    known = ["/" + path.relative_to(ROOT).as_posix() for top in tops for path in (top, *top.rglob("*"))]
    text = (ROOT / page).read_text(encoding="utf-8")
    named = {name for name in re.findall(r"`([\w./*-]+)`", text) if name.endswith(".py") or "/" in name}
    assert len(named) > 10
    gone = [name for name in named if not any(fnmatch(path, f"*/{name.strip('/')}") for path in known)]
    assert [name for name in gone if not APART.match(name)] == []
