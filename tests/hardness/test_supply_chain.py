"""What is installed: pinned, with hashes, the same versions everywhere they are written."""

import importlib.metadata
import re
import tomllib
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
CORE, REST = (
    (ROOT / name).read_text(encoding="utf-8") for name in ("requirements.lock", "requirements-all.lock")
)


def entries(lock: str) -> list[str]:
    """One text a package."""
    return [entry for entry in re.split(r"\n(?=\S)", lock) if entry.strip() and not entry.startswith("#")]


def versions(lock: str) -> dict[str, str]:
    return dict(re.match(r"([A-Za-z0-9._-]+)==(\S+)", entry).groups() for entry in entries(lock))


ENTRIES = entries(CORE) + entries(REST)
LOCKED = versions(CORE) | versions(REST)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXTRAS = PROJECT["project"]["optional-dependencies"]

APART = {"all", "release", "examples"}  # not part of an installation by the lock


def test_what_make_report_installs_is_pinned_and_what_the_toolkit_itself_needs() -> None:
    """And that is locked once: in the one file or in the other."""
    core = versions(CORE)
    asked = (*PROJECT["project"]["dependencies"], *PROJECT["build-system"]["requires"])
    needed = {canonicalize_name(Requirement(words).name) for words in asked}
    todo = list(needed)
    while todo:
        for words in importlib.metadata.requires(todo.pop()) or ():
            one = Requirement(words)
            name = canonicalize_name(one.name)
            if name not in needed and (one.marker is None or one.marker.evaluate({"extra": ""})):
                needed.add(name)
                todo.append(name)
    assert (set(core), set(core) & set(versions(REST))) == (needed, set())
    assert len(ENTRIES) > 50
    for entry in ENTRIES:
        assert re.match(r"[A-Za-z0-9._-]+==\S+ ", entry), entry[:60]
        hashes = re.findall(r"--hash=sha256:[0-9a-f]{64}", entry)
        assert len(hashes) == entry.count("--hash=") >= 1, entry[:60]
    assert not re.search("--index-url|://", CORE + REST)


def test_all_that_the_project_asks_for_is_locked_in_a_version_that_fits() -> None:
    asked = [*PROJECT["project"]["dependencies"], *PROJECT["build-system"]["requires"]]
    asked += [words for name, wanted in EXTRAS.items() if name not in APART for words in wanted]
    for words in asked:
        wanted = Requirement(words)
        name = canonicalize_name(wanted.name)
        assert name in LOCKED, f"{name}: make lock"
        assert wanted.specifier.contains(LOCKED[name], prereleases=True), words
    for words in PROJECT["build-system"]["requires"]:
        assert [one.operator for one in Requirement(words).specifier] == ["=="]
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").split():
        name, _, version = line.partition("==")
        assert LOCKED.get(canonicalize_name(name), version) == version, f"{name}: make lock"


def test_the_extra_all_has_what_the_commands_ask_for() -> None:
    (words,), extras = EXTRAS["all"], set(EXTRAS) - APART - {"dev", "docs"}
    assert Requirement(words).extras == extras
    named: set[str] = set()
    for top in ("actuator_lti", "nonlinear", "analyses", "reports"):
        for path in (ROOT / top).rglob("*.py"):
            named.update(re.findall(r'\bneed\("?[\w.]+"?, "(\w+)"', path.read_text(encoding="utf-8")))
    assert {"cluster", "nightly", "pdf", "plot", "tables"} <= named <= extras


def test_every_promise_of_the_security_note_names_a_test_that_is_there() -> None:
    text = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
    promises = text.partition("## Promises")[2].partition("Not promised")[0]
    rows = [row for row in promises.splitlines() if row[:2] == "| "]
    assert len(rows) > 15
    for row in rows[1:]:
        folder, file = Path(), Path()
        named = re.findall(r"`((?:tests/)?[\w/]*test_\w+\.py)?(?:::(\w+))?`", row)
        result = [(path, function) for path, function in named if path or function]
        assert result, row
        for path, function in result:
            if path:
                file = ROOT / path if "/" in path else folder / path
                folder = file.parent
            assert file.is_file(), (row, path)
            assert f"def {function}" in file.read_text(encoding="utf-8"), (row, function)
