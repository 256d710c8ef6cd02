"""Which compiled form of the kernels runs: the emitted C built at installation, or numba's.

Both give the same bits.  numba compiles at the first call, which takes some twenty seconds; the C library is
there from the start.  ``python -m nonlinear.native`` builds it (``make install`` does); it is used as long
as the kernels' source is the one that it was made of.  ``ACTUATOR_LTI_KERNEL`` chooses: ``auto`` (the library
where there is one), ``c`` (or an error), ``numba``.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from actuator_lti.errors import InputError
from nonlinear._kernels import layout
from nonlinear._kernels.lengths import lengthened
from nonlinear.waiting import told_if_slow

Floats = npt.NDArray[np.float64]

SWITCH = "ACTUATOR_LTI_KERNEL"
CHOICES = ("auto", "c", "numba")
COMPILING = (
    "numba compiles the simulator, once on this machine; python -m nonlinear.native spares it where a "
    "C compiler is"
)
_HERE = Path(__file__).parent
_FOLDER = _HERE / "_native"
_SOURCES = ("_kernels", "emit")
_FLAGS = ("-O3", "-shared", "-fPIC", "-fvisibility=default")


class _Bytes(ctypes.Structure):
    _fields_ = (("at", ctypes.c_void_p), ("length", ctypes.c_int))


def chosen() -> str:
    """What the switch says.

    Raises
    ------
    InputError
        For anything but ``auto``, ``c`` and ``numba``.
    """
    text = os.environ.get(SWITCH, "auto")
    if text not in CHOICES:
        raise InputError(f"{SWITCH} = {text}: allowed: {', '.join(CHOICES)}")
    return text


@cache
def library_path() -> Path:
    """Where the library of today's kernels lies, or would lie."""
    digest = hashlib.sha256(" ".join(_FLAGS).encode())
    paths = [path for folder in _SOURCES for path in sorted((_HERE / folder).glob("*.py"))]
    for path in (*paths, _HERE / "export/entries.py", Path(__file__)):
        digest.update(path.read_bytes())
    return _FOLDER / f"run-{digest.hexdigest()[:16]}-{sys.platform}.so"


@cache
def _opened(choice: str) -> ctypes.CDLL | None:
    path = library_path()
    if choice == "numba" or not path.is_file():
        if choice == "c":
            raise InputError(
                f"{SWITCH} = c: no library of these kernels; allowed: python -m nonlinear.native first"
            )
        return None
    try:
        return loaded(path)
    except OSError:  # made for another machine
        if choice == "c":
            raise InputError(f"{path.name}: does not load; allowed: python -m nonlinear.native") from None
        return None


def loaded(path: Path) -> ctypes.CDLL:
    """Open a library of `nonlinear.export.run_library`."""
    opened = ctypes.CDLL(str(path))
    pointers = (ctypes.c_void_p,) * 6
    opened.drive_run.argtypes = [*pointers, _Bytes, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double]
    return opened


_borrowed: list[ctypes.CDLL] = []


@contextmanager
def borrowed(path: Path) -> Iterator[None]:
    """Let every run of this process go through another library of `nonlinear.export.run_library`."""
    _borrowed.append(loaded(path))
    try:
        yield
    finally:
        _borrowed.pop()


def _running() -> ctypes.CDLL | None:
    return _borrowed[-1] if _borrowed else _opened(chosen())


def kernel_name() -> str:
    """What runs, for the provenance of a report."""
    return "C library" if _running() is not None else "numba"


def call(
    row: Floats, tables: Floats, history: Floats, flags: npt.NDArray[np.uint16], out: Floats, shared: Floats
) -> int:
    """Run one row, see `nonlinear._kernels.run`; ``history`` is (columns, rows) or empty."""
    opened = _running()
    if opened is None:
        with told_if_slow(COMPILING):
            from nonlinear._kernels.call import call as numba_call

            return numba_call(row, tables, history, flags, out, shared)
    return call_library(opened, row, tables, history, flags, out, shared)


def call_library(
    opened: Any, row: Floats, tables: Floats, history: Floats, flags: Any, out: Floats, shared: Floats
) -> int:
    """Run one row by an opened library; see `call`."""
    p, s = _prepared(opened, row)
    io, block = np.zeros(layout.IO_SIZE), np.zeros(layout.BLOCK_SIZE)
    rows = _Bytes(flags.ctypes.data, flags.size)
    ours = (_at(p), _at(s), _at(io), _at(block), _at(tables), _at(history), rows, _at(out), _at(shared))
    return int(opened.drive_run(*ours, 1.0))


def resumed(
    p: Floats, s: Floats, io: Floats, block: Floats, tables: Floats, history: Floats, flags: Any, out: Floats,
    shared: Floats,
) -> Callable[[], int]:  # fmt: skip
    """A call that runs the state ``s`` on to tick ``p[TICKS]``; the caller keeps all the rows."""
    opened = _running()
    if opened is None:
        from nonlinear._kernels.run import run as numba_run

        return lambda: int(numba_run(p, s, io, block, tables, history, flags, out, shared, 1.0))
    rows = _Bytes(flags.ctypes.data, flags.size)
    places = (_at(p), _at(s), _at(io), _at(block), _at(tables), _at(history), rows, _at(out), _at(shared))
    return lambda: int(opened.drive_run(*places, 1.0))


def _prepared(opened: Any, row: Floats) -> tuple[Floats, Floats]:
    p = lengthened(row, lambda head: opened.drive_prepare_sizes(_at(head)))
    s = np.zeros(int(p[layout.STATE_SIZE]))
    opened.drive_derive(_at(p), _at(s))
    opened.drive_init(_at(p), _at(s))
    return p, s


def parameters(row: Floats) -> tuple[Floats, Floats]:
    """All parameters of a row with what is derived from them, and the state at t_0."""
    opened = _running()
    if opened is not None:
        return _prepared(opened, row)
    with told_if_slow(COMPILING):
        from nonlinear._kernels.call import parameters as numba_parameters

        return numba_parameters(row)


def _at(row: npt.NDArray[Any]) -> ctypes.c_void_p:
    assert row.flags.c_contiguous
    return ctypes.c_void_p(row.ctypes.data)


def build() -> Path:
    """Emit, compile and keep the library; older ones go.

    Raises
    ------
    InputError
        Without a C compiler, or where the folder cannot be written.
    """
    from actuator_lti.atomic import write_bytes
    from nonlinear.export.build import compile_files, system_compiler
    from nonlinear.export.run_library import run_sources

    compiler = system_compiler()
    if compiler is None:
        raise InputError("no C compiler; allowed: gcc or clang, or leave it to numba")
    data = compile_files(run_sources(), "run.so", "this machine", _FLAGS, command=[compiler])
    path = library_path()
    write_bytes(path, data)
    for old in _FOLDER.glob("run-*.so"):
        if old != path:
            old.unlink(missing_ok=True)
    return path


if __name__ == "__main__":
    try:
        sys.stdout.write(f"{build().name}: the simulator starts without compiling\n")
    except InputError as error:
        sys.stdout.write(f"the simulator will compile at its first call: {error}\n")
