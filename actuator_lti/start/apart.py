"""A process of its own for what may crash, hang or take the memory: only that process ends."""

import os
import sys
from contextlib import suppress
from typing import Any

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_CHILD = "import pkgutil, sys; pkgutil.resolve_name(sys.argv[1])(*sys.argv[2:])"


def apart(function: str, *words: str) -> dict[str, Any]:
    """What `subprocess` starts: a Python that calls ``module:function`` with words, on one thread.

    It imports what this one can.
    """
    paths = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-P", "-c", _CHILD, function, *words]
    return {"args": command, "env": {**os.environ, **ONE_THREAD, **paths}}


def limit_memory(limit_bytes: int) -> None:
    """Bound what this process may allocate; beyond it Python raises MemoryError, others give up.

    Counted is what can be written to (heap, stacks, private mappings), not files and code that are mapped.
    """
    with suppress(ImportError):  # Windows has no such limit
        import resource

        hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
        most = limit_bytes if hard == resource.RLIM_INFINITY else min(limit_bytes, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
