"""The compiled form of a package's kernels: a library of emitted C in the package, called with arrays.

It is compiled at installation, or comes inside the wheel; its name holds a hash of the sources that it was
made of, so that one of other sources is never loaded. Where it is missing and the sources lie in a checkout
that may be written, the first call compiles it. A call leaves the GIL to other threads.
"""

import ctypes
import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from actuator_lti.compiled.compiler import HERE, LIBRARY_FLAGS, TARGETS, compile_library
from actuator_lti.compiled.form import Form
from actuator_lti.compiled.kinds import Kind
from actuator_lti.errors import InputError

_BUILD = "python -m nonlinear.native"
_OURS = Path(__file__).parent


class _Bytes(ctypes.Structure):
    _fields_ = (("at", ctypes.c_void_p), ("length", ctypes.c_int))


_C_TYPES: dict[Kind | None, Any] = {
    "row": ctypes.c_void_p, "bytes": _Bytes, "int": ctypes.c_int, "float": ctypes.c_double, None: None,
}  # fmt: skip
_PLACE = ctypes.c_double * 0


@dataclass(frozen=True)
class Entry:
    """A kernel that is called from Python: where it is written, kinds of its arguments and of its result."""

    module: str
    name: str
    arguments: tuple[Kind, ...]
    returns: Kind | None = None

    @property
    def function(self) -> Callable[..., Any]:
        function: Callable[..., Any] = getattr(import_module(self.module), self.name)
        return function


class Called:
    """A kernel of an opened library, or as written; takes arrays of float64 for rows, of uint16 for bytes."""

    def __init__(self, function: Callable[..., Any], passing: Sequence[Callable[[Any], Any]]) -> None:
        self._function, self._passing = function, passing

    def __call__(self, *arguments: Any) -> Any:
        return self._function(*[way(each) for way, each in zip(self._passing, arguments, strict=True)])

    def bound(self, *arguments: Any) -> Callable[[], Any]:
        """The call with these arguments, to be made many times; the caller keeps the arrays."""
        passed = [way(each) for way, each in zip(self._passing, arguments, strict=True)]
        return lambda: self._function(*passed)


def _row(array: Any) -> Any:
    if array.flags.writeable:
        return _PLACE.from_buffer(array)  # refuses what is not contiguous
    assert array.flags.c_contiguous  # of another process: no buffer of ctypes, which may be written
    return array.ctypes.data


def _itself(number: Any) -> Any:
    return number


_PASSED: dict[Kind, Callable[[Any], Any]] = {
    "row": _row, "bytes": lambda array: _Bytes(array.ctypes.data, array.size), "int": _itself,
    "float": _itself,
}  # fmt: skip


@dataclass(frozen=True)
class Library:
    name: str  # stem of its file
    folder: Path  # of the package; the file lies in ``_native`` there
    entries: tuple[Entry, ...]  # what Python calls
    sources: tuple[Path, ...]  # modules that its C is emitted from, beside the emitter's
    forms: Callable[[], tuple[Form, ...]] = tuple  # second forms of its functions, see `emit_c`
    _others: list[Any] = field(default_factory=list)

    def path(self, target: str = HERE) -> Path:
        """Where the library of today's sources lies, or would lie, on a kind of machine."""
        suffix = TARGETS[target].suffix if target in TARGETS else ".so"
        return self.folder / "_native" / f"{self.name}-{self._digest}-{target}{suffix}"

    @cached_property
    def _digest(self) -> str:
        digest = hashlib.sha256(" ".join((*LIBRARY_FLAGS, repr(self.entries))).encode())
        for path in (*self.sources, *sorted(_OURS.glob("*.py"))):
            digest.update(path.read_bytes())
        return digest.hexdigest()[:16]

    def text(self) -> str:
        from actuator_lti.compiled.program import emit_c

        return emit_c({entry.function: entry.arguments for entry in self.entries}, forms=self.forms()).source

    def build(self) -> Path:
        """Emit, compile and keep the library, if it is not there; older ones of this kind of machine go.

        Raises `InputError`: without a C compiler, or where the folder cannot be written.
        """
        path = self.path()
        if not path.is_file():
            self.write(self.folder)
        for old in path.parent.glob(f"{self.name}-*-{HERE}.*"):
            if old != path:
                old.unlink(missing_ok=True)
        return path

    def write(self, package: Path, target: str = "") -> None:
        """Compile the library into a package, for this machine or for every one of `TARGETS[target]`.

        Raises `InputError`: as `build`.
        """
        from actuator_lti.files.atomic import write_bytes

        name = self.path(target or HERE).name
        data = compile_library(self.text(), name, target or HERE, portable=bool(target))
        write_bytes(package / "_native" / name, data)

    @property
    def functions(self) -> Any:
        """The entries by name, to be called.

        Raises `InputError`: where the library is missing and cannot be compiled here, or does not load.
        """
        return self._others[-1] if self._others else self._opened

    @cached_property
    def _opened(self) -> Any:
        path = self.path()
        if not path.is_file() and not os.access(self.folder, os.W_OK):
            raise InputError(f"{path.name}: no compiled kernels of these sources; allowed: {_BUILD} first")
        try:
            return self.loaded(self.build() if not path.is_file() else path)
        except InputError as error:
            raise InputError(
                f"{error}; then {_BUILD}: margins and simulations run as compiled kernels, which wheels hold "
                "and this checkout does not yet"
            ) from None
        except OSError as error:
            raise InputError(f"{path.name}: does not load ({error}); allowed: {_BUILD}") from None

    def loaded(self, path: Path) -> Any:
        opened, found = ctypes.CDLL(str(path)), SimpleNamespace()
        for entry in self.entries:
            function = getattr(opened, f"drive_{entry.name}")
            function.argtypes = [_C_TYPES[kind] for kind in entry.arguments]
            function.restype = _C_TYPES[entry.returns]
            setattr(found, entry.name, Called(function, [_PASSED[kind] for kind in entry.arguments]))
        return found

    def borrowed(self, path: Path) -> AbstractContextManager[None]:
        """Let every call of this process go through another library file of this text."""
        return self._instead(self.loaded(path))

    def written(self) -> AbstractContextManager[None]:
        """Let Python run the kernels as they are written, for a debugger or as the reference."""
        passed = {each.name: Called(each.function, [_itself] * len(each.arguments)) for each in self.entries}
        return self._instead(SimpleNamespace(**passed))

    @contextmanager
    def _instead(self, functions: Any) -> Iterator[None]:
        self._others.append(functions)
        try:
            yield
        finally:
            self._others.pop()


def source_files(*places: Path, wanted: str = "*.py") -> tuple[Path, ...]:
    """Files, and of folders the Python files, in order."""
    return tuple(
        path for place in places for path in (sorted(place.glob(wanted)) if place.is_dir() else [place])
    )
