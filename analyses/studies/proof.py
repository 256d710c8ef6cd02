"""What a process computes with: a worker that would give other numbers is refused before it gets work.

Threads and kernel of linear algebra are settings that a process reads once, as it starts; what they, the
libraries and the processor come to is seen in computed samples, to the last bit.
"""

import hashlib
import os
import platform
import socket
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.errors import InputError

Proof = Mapping[str, str]
CODE = ("actuator_lti", "nonlinear", "analyses")
ARITHMETIC = ("OPENBLAS_CORETYPE", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "MKL_CBWR")
_UNSET = "not set"
_proven: set[str] = set()  # proofs of clients that this worker has met


def prove(packages: Sequence[str] = CODE, study: Any = None) -> Proof:
    """What this process computes with, by name: code, libraries, arithmetic, samples, also of a study."""
    import scipy

    # results of which another kernel, or another number of threads, gives other last digits
    a = (np.arange(4096.0) ** 2 % 101.0).reshape(64, 64) / 7.0 + 100.0 * np.eye(64)
    made = (a @ a, np.linalg.solve(a, a.T), np.linalg.eigvals(a), np.exp(a / 101.0), np.sin(a))
    proof = {
        "code": code_version(packages),
        "Python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        **{name: os.environ.get(name, _UNSET) for name in ARITHMETIC},
        "a sample of linear algebra": _hash(one.tobytes() for one in made),
    }
    sample = getattr(study, "sample", None)
    return proof if sample is None else {**proof, "sample 0 of the study": _hash([sample()])}


def hold_against(here: Proof, there: Any, worker: str) -> None:
    """Refuse a worker that computes otherwise, in one line: what differs, and how to start it."""
    if not isinstance(there, Mapping):
        said = " ".join(repr(there).split())[:200]
        raise InputError(f"worker {worker} is refused: it does not say what it computes with ({said})")
    name = next((name for name in here if there.get(name) != here[name]), None)
    if name is None:
        return
    words = f"worker {worker} is refused: {name} is {there.get(name, 'not known')}, here {here[name]}"
    if name in ARITHMETIC:
        settings = [f"{one}={here[one]}" for one in ARITHMETIC if here[one] != _UNSET]
        words += f"; start it with {' '.join(settings) or 'none of ' + ', '.join(ARITHMETIC)}"
    raise InputError(words)


def prove_once(wanted: Proof, packages: Sequence[str], study: Any) -> None:
    """On a worker: hold its own proof against that of a client, before its first part of a study."""
    known = _hash([repr(sorted(wanted.items())).encode()])
    if known not in _proven:
        hold_against(wanted, prove(packages, study), f"process {os.getpid()} on {socket.gethostname()}")
        _proven.add(known)


def packages_of(held: Any) -> tuple[str, ...]:
    """The packages that a task needs: those of all calculations, and its own."""
    owner = getattr(held, "func", held)  # a partial function is what it calls
    own = (getattr(owner, "__module__", None) or type(held).__module__).partition(".")[0]
    return CODE if own in CODE else (*CODE, own)


def code_version(packages: Sequence[str] = CODE) -> str:
    """Content hash of the code that computes parts."""
    digest = hashlib.sha256()
    for name in packages:
        try:
            source = import_module(name).__file__
        except (ImportError, AttributeError):  # not there, or part of Python itself
            digest.update(f"{name}: no file\0".encode())
            continue
        file = Path(source or "")
        digest.update(f"{name}: {hash_of(file.parent if file.name == '__init__.py' else file)}\0".encode())
    return digest.hexdigest()[:16]


def hash_of(place: Path, endings: Sequence[str] = (".py",)) -> str:
    """Content hash of a file, or of all files below a folder that end so, with their names."""
    files = [place] if place.is_file() else sorted(p for p in place.rglob("*") if p.suffix in endings)
    parts = ((path.relative_to(place.parent).as_posix(), path) for path in files if path.is_file())
    each = (f"{name}\0".encode() + hashlib.sha256(path.read_bytes()).digest() for name, path in parts)
    return hashlib.sha256(b"".join(each)).hexdigest()


def _hash(parts: Iterable[bytes]) -> str:
    return hashlib.sha256(b"".join(parts)).hexdigest()[:16]
