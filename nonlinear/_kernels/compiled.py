"""The decorator of every compiled function here, with one cache stamp for the whole folder.

numba looks only at the file of a function when it asks whether its cached machine code is still good,
although the code of callees in other files has been linked in.  Here the stamp is a digest of all
kernel files, so an edit or an update of any of them compiles again what depends on it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

from actuator_lti.drive import signals


@cache
def source_stamp() -> str:
    """Digest of every Python file of this folder, and of the limiters that its layout reads."""
    digest = hashlib.sha256(f"{numba.__version__} {signals.LIMITERS} {signals.REST_BIT}".encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


njit: Any = numba.njit  # some of the options are not in its published signature
OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls: at its first call, without the GIL, no fastmath, cached on disk.

    No kernel makes arrays, so none needs reference counts.
    """
    return _stamped(njit(**OPTIONS, _nrt=False)(function))


def scalar(function: Callable[..., Any]) -> Any:
    """The same for a function that only kernels call."""
    return _stamped(njit(**OPTIONS, _nrt=False, no_cpython_wrapper=True)(function))


def inlined(function: Callable[..., Any]) -> Any:
    """The same for a small function of the tick loop: its code is copied into its callers."""
    return _stamped(njit(**OPTIONS, _nrt=False, forceinline=True, no_cpython_wrapper=True)(function))


def woven(function: Callable[..., Any]) -> Any:
    """Copied into its callers before anything is compiled: for what the tick loop runs through once."""
    return njit(inline="always")(function)


def _stamped(dispatcher: Any) -> Any:
    cache_file: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(cache_file, "_source_stamp"):
        cache_file._source_stamp = source_stamp()
    return dispatcher
