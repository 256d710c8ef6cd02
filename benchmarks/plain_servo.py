"""The same cascade as a plain C program that shares no code with the simulator, compiled for this machine."""

from __future__ import annotations

import ctypes
import tempfile
from math import inf
from pathlib import Path

import numpy as np
import numpy.typing as npt

from actuator_lti.compiled.compiler import compile_files
from actuator_lti.design.model import Design

Floats = npt.NDArray[np.float64]

FLAGS = ("-O3", "-march=native", "-fPIC", "-shared")
COLUMNS = ("th", "w", "i", "u", "i_ref", "w_ref")
_DOUBLES = (
    "R", "L", "kE", "kM", "J", "Cv", "C0", "CM", "Ubus", "Imax", "Wmax", "Amax", "Kpi", "Tni", "Kpv", "Tnv",
    "Kv", "Ts", "delay",
)  # fmt: skip


class _Parameters(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_double) for name in _DOUBLES), ("nv", ctypes.c_int), ("np", ctypes.c_int)
    )  # fmt: skip


class PlainServo:
    """The program for one rigid, self-locking design with three loops; needs gcc."""

    def __init__(self, design: Design) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path, text = Path(folder) / "servo.so", Path(__file__).with_suffix(".c").read_text()
            path.write_bytes(compile_files({"servo.c": text}, path.name, "here", FLAGS, command=["gcc"]))
            self._run = ctypes.CDLL(str(path)).sim  # stays mapped when the file goes
        self._run.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_long, ctypes.c_double, ctypes.c_void_p]
        self._run.restype = ctypes.c_long
        self._p = _parameters(design)

    def run(self, reference_rad: Floats, load_Nm: Floats) -> tuple[Floats, int]:
        """History, shape (ticks, 6), allocated here, and the number of events.

        The reference is the motor's angle.
        """
        history = np.empty((reference_rad.size, len(COLUMNS)))
        places = (each.ctypes.data for each in (reference_rad, load_Nm))
        events = self._run(ctypes.addressof(self._p), *places, reference_rad.size, 0.0, history.ctypes.data)
        return history, int(events)


def _parameters(design: Design) -> _Parameters:
    motor, control, friction, limits = design.motor, design.controller, design.friction, design.limits
    velocity, current, position = control.velocity, control.current, control.position_loop
    assert velocity is not None
    assert current is not None
    return _Parameters(
        R=motor.resistance_ohm, L=motor.inductance_H, kE=motor.back_emf_constant_Vs_rad,
        kM=motor.torque_constant_Nm_A, J=design.inertia_kgm2, Cv=friction.viscous_Nms_rad,
        C0=friction.dry_torque_Nm, CM=friction.load_coefficient, Ubus=limits.voltage_V,
        Imax=limits.peak_current_A, Wmax=limits.speed_rad_s,
        Amax=inf if limits.acceleration_rad_s2 is None else limits.acceleration_rad_s2,
        Kpi=current.gain_V_A, Tni=current.integral_time_s, Kpv=velocity.gain, Tnv=velocity.integral_time_s,
        Kv=position.gain, Ts=control.period_s, delay=control.computing_delay_s,
        nv=velocity.every, np=position.every,
    )  # fmt: skip
