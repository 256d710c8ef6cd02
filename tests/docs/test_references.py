"""Every reference of the sources to the model page resolves inside the repository."""

import re
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SECTIONS = set(re.findall(r"(?m)^## ([0-9]+)\.", (ROOT / "docs" / "model.md").read_text(encoding="utf-8")))
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
            missing += [f"{path.relative_to(ROOT)}: section {n}" for n in sorted(numbers - SECTIONS)]
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
