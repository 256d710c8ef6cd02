"""The C files of ``actuator-lti export c``, compiled and called from Python: one tick at a time.

What a flight simulation does with them in C, with ctypes in its place.
"""

from __future__ import annotations

import ctypes
import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.compiled.compiler import compile_files
from actuator_lti.design.model import Design
from nonlinear._kernels import layout
from nonlinear.export import c_export


class ExportedDrive:
    """A drive that runs the exported C, whose shared library is put into a folder."""

    def __init__(self, design: Design, folder: Path) -> None:
        texts = c_export(design)
        sources = {name: text for name, text in texts.items() if name != "main.c" and name[-2:] != "md"}
        data = compile_files(sources, "drive.so", "linux64", ("-shared", "-fPIC"))
        path = folder / f"drive-{hashlib.sha256(data).hexdigest()[:16]}.so"
        if not path.exists():  # a library that is loaded must not be written again
            path.write_bytes(data)
        self._c: Any = ctypes.CDLL(str(path.resolve()))  # a name alone is sought elsewhere
        header = texts["drive_design.h"]
        self._p = np.zeros(_length(header, "DRIVE_P_LENGTH"))
        self._s = np.zeros(_length(header, "DRIVE_S_LENGTH"))
        self._io = np.zeros(layout.IO_SIZE)
        self._c.drive_load_design(_at(self._p))
        self._c.drive_prepare_sizes(_at(self._p))
        self._c.drive_derive(_at(self._p), _at(self._s))
        self.reset()

    def reset(self) -> None:
        """Everything at rest at zero."""
        self._c.drive_init(_at(self._p), _at(self._s))

    def step(self, command: float, moment: float = 0.0) -> float:
        """One tick; returns the output at its end: rad, or m of a linear axis.

        Raises `RuntimeError`: where the tick fails.
        """
        self._io[layout.IN_COMMAND], self._io[layout.IN_LOAD] = command, moment
        if self._c.drive_tick(_at(self._p), _at(self._s), _at(self._io)) != layout.OK:
            raise RuntimeError("the drive failed")
        return self._output(self._s)

    def within(self, time_s: float, command: float, moment: float = 0.0) -> float:
        """The output at a time into the tick that comes next, which is not gone on from."""
        if time_s <= 0.0:
            return self._output(self._s)
        q, s, io = self._p.copy(), self._s.copy(), self._io.copy()
        io[layout.IN_COMMAND], io[layout.IN_LOAD] = command, moment
        rows = (_at(row) for row in (self._p, q, s, io))
        if self._c.drive_part_of_tick(*rows, ctypes.c_double(time_s)) != layout.OK:
            raise RuntimeError("the drive failed")
        return self._output(s)

    def _output(self, s: np.ndarray) -> float:
        if self._p[layout.ELASTIC_DRIVE] > 0.0:
            return float(s[layout.S_OUTPUT])
        return float(s[layout.S_ANGLE] / self._p[layout.RATIO])


def _length(header: str, name: str) -> int:
    return int(header.partition(f"{name} = ")[2].split()[0].rstrip(","))


def _at(row: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(row.ctypes.data)
