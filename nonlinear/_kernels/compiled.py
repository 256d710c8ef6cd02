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

from actuator_lti.compiled_late import CompiledLate
from actuator_lti.drive import signals


@cache
def source_stamp() -> str:
    """Digest of every Python file of this folder, and of the limiters that its layout reads."""
    import numba

    digest = hashlib.sha256(f"{numba.__version__} {signals.LIMITERS} {signals.REST_BIT}".encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls: at its first call, without the GIL, no fastmath, cached on disk.

    No kernel makes arrays, so none needs reference counts.
    """
    return _late(function, _nrt=False)


def scalar(function: Callable[..., Any]) -> Any:
    """The same for a function that only kernels call."""
    return _late(function, _nrt=False, no_cpython_wrapper=True)


def inlined(function: Callable[..., Any]) -> Any:
    """The same for a small function of the tick loop: its code is copied into its callers."""
    return _late(function, _nrt=False, forceinline=True, no_cpython_wrapper=True)


def woven(function: Callable[..., Any]) -> Any:
    """Copied into its callers before anything is compiled: for what the tick loop runs through once."""
    return CompiledLate(function, lambda python: _njit()(inline="always")(python))


def _njit() -> Any:
    import numba

    return numba.njit  # some of the options are not in its published signature


def _late(function: Callable[..., Any], **options: bool) -> CompiledLate:
    return CompiledLate(function, lambda python: _stamped(_njit()(**OPTIONS, **options)(python)))


def _stamped(dispatcher: Any) -> Any:
    cache_file: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(cache_file, "_source_stamp"):
        cache_file._source_stamp = source_stamp()
    return dispatcher
