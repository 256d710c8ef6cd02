"""The C reference, compiled where it is measured and called through ctypes."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from nonlinear._kernels import layout as at
from nonlinear._kernels.call import parameters

SOURCE = Path(__file__).with_name("c_reference.c")
FLAGS = ("-O3", "-march=native", "-std=c11", "-D_GNU_SOURCE", "-fPIC", "-shared")
DOUBLES = (
    at.PERIOD, at.RESISTANCE, at.INDUCTANCE, at.BACK_EMF, at.TORQUE_CONSTANT, at.INERTIA, at.RATIO,
    at.VISCOUS,
    at.DRY, at.LOAD_COEFFICIENT, at.BREAKAWAY, at.POSITION_GAIN, at.VELOCITY_GAIN, at.VELOCITY_INTEGRAL,
    at.CURRENT_GAIN, at.CURRENT_INTEGRAL, at.SPEED_LIMIT, at.ACCELERATION_LIMIT, at.CURRENT_LIMIT,
    at.VOLTAGE_LIMIT, at.LOAD, at.COMMAND + 1, at.COMMAND + 3, at.DELAY_FRACTION,
)  # fmt: skip
INTEGERS = (at.TICKS, at.EVERY_VELOCITY, at.EVERY_POSITION, at.DELAY_TICKS)


class CSimulator:
    """``simulate`` of ``c_reference.c``; needs gcc."""

    def __init__(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / "c_reference.so"
            subprocess.run(["gcc", *FLAGS, str(SOURCE), "-o", str(library), "-lm"], check=True)
            self._simulate = ctypes.CDLL(str(library)).simulate  # stays mapped when the file goes
        self._simulate.restype = ctypes.c_int64

    def run(self, row: np.ndarray, history: np.ndarray, flags: np.ndarray) -> int:
        """Fill history (8, ticks) and flags (ticks,) of the run that a row describes; events."""
        constants = parameters(row)[0][at.SLIP :].copy()
        drive = np.array([row[k] for k in DOUBLES])
        counts = np.array([row[k] for k in INTEGERS], dtype=np.int64)
        packed = np.frombuffer(drive.tobytes() + counts.tobytes(), dtype=np.uint8).copy()
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (packed, constants, history, flags)]
        return int(self._simulate(*pointers))
