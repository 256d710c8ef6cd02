"""The process of its own that reads a MATLAB file, as a fork of this one: it has scipy, which takes 0.3 s."""

import io
import multiprocessing
import sys
import warnings
from subprocess import CompletedProcess, TimeoutExpired
from tempfile import TemporaryFile
from typing import IO, Any

import scipy.io  # noqa: F401 - here, not in every fork

from actuator_lti.files import matlab


def forked(*, input: bytes, timeout: float, args: Any, **_: object) -> CompletedProcess[bytes]:
    """In the place of `subprocess.run` in `actuator_lti.files.matlab`."""
    # a fork beside threads warns
    with TemporaryFile() as out, TemporaryFile() as err, warnings.catch_warnings(action="ignore"):
        process = multiprocessing.get_context("fork").Process(target=mat_reader, args=(input, out, err))
        process.start()
        process.join(timeout)
        if process.is_alive():
            process.kill()
            raise TimeoutExpired(args, timeout)
        for stream in (out, err):
            stream.seek(0)
        return CompletedProcess(args, process.exitcode or 0, out.read(), err.read())


def mat_reader(data: bytes, out: IO[bytes], err: IO[bytes]) -> None:
    sys.stdin, sys.stdout, sys.stderr = map(io.TextIOWrapper, (io.BytesIO(data), out, err))
    matlab.main()
