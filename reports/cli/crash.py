"""What nobody foresaw, on disk: the traceback and what is needed to see it again."""

from __future__ import annotations

import os
import platform
import sys
import tempfile


def write_crash_file(tracebacks: str) -> str:
    """Write tracebacks to a new file among the temporary ones; its path, or why there is none."""
    from reports.provenance import package_version

    head = [
        f"actuator-lti {package_version()}, Python {platform.python_version()}, {platform.platform()}",
        f"arguments: {sys.argv[1:]!a}",
        "",
    ]
    try:
        handle, path = tempfile.mkstemp(prefix="actuator-lti-", suffix=".traceback.txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write("\n".join(head) + tracebacks)
    except OSError as error:
        return f"could not be written: {error.strerror or error}"
    return path
