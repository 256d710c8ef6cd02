"""Arrays and texts of a MATLAB file (up to -v7), by scipy's reader in a process of its own.

A damaged file can crash that reader, hold it or have it take the memory: then only its process ends. Texts
and cells of texts are lists of names, sparse matrices full ones, fields of a structure ``name.field``; all
else is passed over and named, complex arrays too, which stand beside the real ones.
"""

import pickle
import sys
from dataclasses import dataclass, field
from io import BytesIO
from math import prod
from subprocess import TimeoutExpired, run
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_lti.bounds import MAT_MEMORY, MAT_SECONDS, MAT_VALUES
from actuator_lti.errors import InputError
from actuator_lti.start.apart import apart, limit_memory
from actuator_lti.types import Floats

ALLOWED = "allowed: a MATLAB file as save -v7 writes it"


@dataclass
class MatContent:
    """Arrays by name, lists of texts by name, and the names of what was passed over."""

    arrays: dict[str, Floats] = field(default_factory=dict)
    texts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    passed_over: list[str] = field(default_factory=list)
    complexes: dict[str, NDArray[np.complex128]] = field(default_factory=dict)

    def take(self, name: str, value: Any) -> None:
        """Keep a variable as scipy reads it, or its name."""
        if hasattr(value, "toarray") and prod(value.shape) <= MAT_VALUES.most:  # sparse
            value = value.toarray()
        kind = value.dtype.kind if type(value) is np.ndarray else ""  # objects are of types beside it
        if kind == "V" and value.size == 1 and value.dtype.names:
            for key, part in zip(value.dtype.names, value.item(), strict=True):
                self.take(f"{name}.{key}", part)
        elif kind in ("b", "i", "u", "f"):
            self.arrays[name] = value.astype(float)
        elif kind == "U" or (kind == "O" and all(_is_text(cell) for cell in value.flat)):
            cells = value.ravel("F") if kind == "O" else [value]
            self.texts[name] = tuple(str(text).strip() for cell in cells for text in cell.flat)
        else:
            self.passed_over.append(name)
            if kind == "c":
                self.complexes[name] = value


def _is_text(cell: Any) -> bool:
    return isinstance(cell, np.ndarray) and cell.dtype.kind == "U" and cell.size == 1


def read_mat(data: bytes) -> MatContent:
    """Read what a MATLAB file holds; an InputError says, without the file's name, what is wrong.

    >>> read_mat(b"MATLAB")
    Traceback (most recent call last):
    ...
    actuator_lti.errors.InputError: damaged, or no MATLAB file (...); allowed: ...
    """
    try:
        done = run(**apart(f"{__name__}:main"), input=data, capture_output=True, timeout=MAT_SECONDS.most)
    except TimeoutExpired:
        raise InputError(f"is not read within {MAT_SECONDS.most} s; {ALLOWED}") from None
    if done.returncode:
        why = done.stderr.decode(errors="replace").splitlines()[-1] if done.returncode == 1 else "damaged"
        raise InputError(why if "allowed" in why else f"{why}; {ALLOWED}")
    content: MatContent = pickle.loads(done.stdout)
    return content


def main() -> None:
    """Read a file from standard input and write its `MatContent`, or on standard error why there is none."""
    limit_memory(MAT_MEMORY.most)
    try:
        content = _content(BytesIO(sys.stdin.buffer.read()))
    except InputError as error:
        sys.exit(str(error))
    except MemoryError:
        sys.exit(f"holds more than allowed: {MAT_VALUES.allowed} numbers")
    except NotImplementedError:
        sys.exit("is a MATLAB 7.3 (HDF5) file")
    except Exception as error:  # noqa: BLE001 - a reader that trusts what it reads raises anything
        sys.exit(f"damaged, or no MATLAB file ({str(error).partition(';')[0] or type(error).__name__})")
    pickle.dump(content, sys.stdout.buffer)


def _content(stream: BytesIO) -> MatContent:
    from scipy.io import loadmat, whosmat  # in that process alone: it takes as long as reading

    MAT_VALUES.check(sum(prod(shape) for _, shape, kind in whosmat(stream) if kind != "sparse"))
    content = MatContent()
    for name, value in loadmat(stream).items():
        if not name.startswith("__"):  # of scipy's own
            content.take(name, value)
    MAT_VALUES.check(sum(value.size for value in content.arrays.values()))
    return content
