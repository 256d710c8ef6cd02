"""The decorator of the compiled functions of this folder, with one cache stamp for all of them.

numba looks only at the file of a function when it asks whether its cached machine code is still good,
although code of other files has been linked in. Here the stamp is a digest of every file of the folder.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from actuator_lti.compiled_late import CompiledLate


@cache
def source_stamp() -> str:
    """Digest of every Python file of this folder."""
    import numba

    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def kernel(function: Callable[..., Any]) -> Any:
    """Compile at the first call: without the GIL, arithmetic as written (no fastmath), cached on disk."""
    return CompiledLate(function, _declared)


def _declared(function: Callable[..., Any]) -> Any:
    import numba

    dispatcher = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    cache_file: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(cache_file, "_source_stamp"):
        cache_file._source_stamp = source_stamp()
    return dispatcher
