"""What a job may take: memory, and no life after its parent."""

from __future__ import annotations

import signal
import sys


def limit_memory(limit_bytes: int) -> None:
    """Bound what this process may allocate; beyond it Python raises MemoryError, others give up.

    Counted is what can be written to (heap, stacks, private mappings), not files and code that are mapped.
    Systems without such a limit take no notice.
    """
    try:
        import resource
    except ImportError:  # not on Windows
        return
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    most = limit_bytes if hard == resource.RLIM_INFINITY else min(limit_bytes, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def die_with_parent() -> None:
    """Let the system end this process with its parent, also where a build never lets go (Linux)."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
