"""Which code made a result: hash of the sources, versions of the libraries, commit."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

from analyses.studies.proof import hash_of
from reports.nightly.job import canonical
from reports.nightly.text import one_line, sha256

PACKAGES = ("actuator_lti", "nonlinear", "analyses", "reports")
LIBRARIES = ("control", "numpy", "scipy", "matplotlib", "jinja2", "typst")
_SUFFIXES = (".py", ".toml", ".html", ".j2", ".css", ".js", ".typ", ".svg")
_GIT_TIME_LIMIT_S = 10.0
COMMITS = 8  # named at most between two nights
# A work tree is data: nothing that its own configuration names is started.
_SAFE_GIT = (
    "--no-pager", "-c", "core.fsmonitor=false", "-c", "core.hooksPath=/dev/null", "-c"
   ,"log.showSignature=false", "-c", "core.pager=cat", "-c", "protocol.allow=never",
)  # fmt: skip


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
    libraries = {name: _version(name) for name in LIBRARIES}
    sources = sha256(canonical([hash_of(folder / package, _SUFFIXES) for package in PACKAGES]))
    return CodeVersion(sources=sources, libraries=libraries, commit=commit_of(folder))


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "absent"


def commit_of(path: Path) -> str:
    """Commit that is checked out where a path lies; empty where there is none."""
    return _git(path, "rev-parse", "--verify", "HEAD^{commit}").strip()


@cache
def commits_between(path: Path, old: str, new: str) -> tuple[str, ...]:
    """First lines of the commits that lead from one commit to another, newest first."""
    if not old or not new or old == new:
        return ()
    text = _git(path, "log", f"--max-count={COMMITS}", "--format=%h %s", f"{old}..{new}", "--")
    return tuple(one_line(line, 120) for line in text.splitlines() if line.strip())


def _git(path: Path, *arguments: str) -> str:
    program = shutil.which("git")
    folder = path if path.is_dir() else path.parent
    if program is None or not folder.is_dir():
        return ""
    environment = {"PATH": os.defpath, "GIT_TERMINAL_PROMPT": "0", "GIT_OPTIONAL_LOCKS": "0", "LC_ALL": "C"}
    try:
        done = subprocess.run(
            [program, *_SAFE_GIT, "-C", str(folder), *arguments],
            capture_output=True, timeout=_GIT_TIME_LIMIT_S, check=False, env=environment,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.decode("utf-8", "replace") if done.returncode == 0 else ""
