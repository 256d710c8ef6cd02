"""Which code made a result: hash of the sources, versions of the libraries, commit."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from analyses.studies.proof import hash_of
from reports.nightly.source import canonical
from reports.nightly.text import one_line, sha256
from reports.provenance import git, package_version

PACKAGES = ("actuator_lti", "nonlinear", "analyses", "reports")
LIBRARIES = ("control", "numpy", "scipy", "matplotlib", "jinja2", "typst")
_SUFFIXES = (".py", ".toml", ".html", ".j2", ".css", ".js", ".typ", ".svg")
COMMITS = 8  # named at most between two nights


@dataclass(frozen=True, kw_only=True)
class CodeVersion:
    """Hash of the sources and the libraries, and the commit if there is one."""

    sources: str
    libraries: dict[str, str]
    commit: str

    @property
    def hash(self) -> str:
        """What enters the address of a result; a commit that changes no source does not."""
        return sha256(canonical([self.sources, self.libraries, platform.python_version()]))


def code_version(root: Path | None = None) -> CodeVersion:
    """Version of the code as installed (or below ``root``)."""
    folder = Path(__file__).resolve().parents[2] if root is None else root
    libraries = {name: package_version(name, "absent") for name in LIBRARIES}
    sources = sha256(canonical([hash_of(folder / package, _SUFFIXES) for package in PACKAGES]))
    return CodeVersion(sources=sources, libraries=libraries, commit=commit_of(folder))


def commit_of(path: Path) -> str:
    """Commit that is checked out where a path lies; empty where there is none."""
    return git(path, "rev-parse", "--verify", "HEAD^{commit}") or ""


@cache
def commits_between(path: Path, old: str, new: str) -> tuple[str, ...]:
    """First lines of the commits that lead from one commit to another, newest first."""
    if not old or not new or old == new:
        return ()
    text = git(path, "log", f"--max-count={COMMITS}", "--format=%h %s", f"{old}..{new}", "--")
    return tuple(one_line(line, 120) for line in (text or "").splitlines() if line.strip())
