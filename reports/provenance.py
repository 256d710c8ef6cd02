"""Where a report comes from: versions, commit, hash of the design, time."""

import os
import platform
import shutil
import subprocess
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree
from actuator_lti.start.extras import package_version

LIBRARIES = ("control", "numpy", "scipy", "matplotlib", "jinja2")
_SAFE = (
    "--no-pager", "-c", "core.fsmonitor=false", "-c", "core.hooksPath=/dev/null", "-c",
    "log.showSignature=false", "-c", "core.pager=cat", "-c", "protocol.allow=never",
)  # fmt: skip


def provenance(design_hash: str | None = None) -> Tree:
    """Collect what is needed to build the same report again.

    The time is that of ``SOURCE_DATE_EPOCH`` where it is set (seconds since 1970, UTC), so that the same
    input gives the same bytes; an InputError where it is no number.
    """
    return {
        "version": package_version(), "commit": commit(), "design_hash": design_hash, "time": build_time(),
        "python": platform.python_version(), "platform": f"{platform.system()} {platform.machine()}",
        "libraries": {name: package_version(name) for name in LIBRARIES},
    }  # fmt: skip


def build_time() -> str:
    text = os.environ.get("SOURCE_DATE_EPOCH")
    if text is None:
        return datetime.now(UTC).isoformat(timespec="seconds")
    try:
        return datetime.fromtimestamp(int(text), UTC).isoformat(timespec="seconds")
    except (ValueError, OverflowError, OSError) as error:
        raise InputError(f"SOURCE_DATE_EPOCH = {text!r}: must be whole seconds since 1970") from error


@cache
def commit() -> str | None:
    """Give the git commit of the source tree, with ``+changes`` where it differs; ``None`` outside of git."""
    root = Path(__file__).resolve().parent.parent
    head = git(root, "rev-parse", "HEAD") if (root / ".git").exists() else None
    if head is None:
        return None
    return head + "+changes" * bool(git(root, "status", "--porcelain", "--untracked-files=no"))


def git(place: Path, *arguments: str) -> str | None:
    """What git says of the work tree of a file or folder; ``None`` where it is missing or fails.

    A work tree is data: nothing that its own configuration names is started.
    """
    program, folder = shutil.which("git"), place if place.is_dir() else place.parent
    if program is None or not folder.is_dir():
        return None
    environment = {name: os.environ[name] for name in ("HOME", "SYSTEMROOT") if name in os.environ}
    environment |= {"PATH": os.defpath, "GIT_TERMINAL_PROMPT": "0", "GIT_OPTIONAL_LOCKS": "0", "LC_ALL": "C"}
    command = [program, *_SAFE, "-C", str(folder), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, timeout=10, check=False, env=environment)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.decode("utf-8", "replace").strip() if done.returncode == 0 else None
