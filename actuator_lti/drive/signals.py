"""The signals and the limiters of a drive, each declared once: name, unit, words, bit of the limit flags."""

from dataclasses import dataclass
from typing import Any, Literal

from actuator_lti.design.model import Axis, Limits

Kind = Literal["value", "rate", "rms", "command"]


@dataclass(frozen=True)
class Signal:
    """A signal of the drive: what it is, and its unit on a rotary and on a linear axis."""

    name: str
    words: str
    unit: str
    linear_unit: str = ""

    def unit_for(self, axis: Axis) -> str:
        return self.linear_unit if axis == "linear" and self.linear_unit else self.unit


_SIGNALS = (
    Signal("th", "motor angle", "rad", "m"),
    Signal("w", "motor speed", "rad/s", "m/s"),
    Signal("i", "motor current", "A"),
    Signal("u", "voltage", "V"),
    Signal("i_ref", "current command", "A"),
    Signal("w_ref", "speed command", "rad/s", "m/s"),
    Signal("th_ref", "position command", "rad", "m"),
    Signal("phi", "angle behind the coupling", "rad", "m"),
    Signal("W", "speed behind the coupling", "rad/s", "m/s"),
    Signal("T_s", "coupling torque", "N m", "N"),
    Signal("output", "output angle", "rad", "m"),
    Signal("load_torque", "load torque on the output shaft", "N m", "N"),
    Signal("w_cmd", "speed command before its limits", "rad/s", "m/s"),
    Signal("torque_command", "velocity controller's output", "A"),
    Signal("w_meas", "measured speed", "rad/s", "m/s"),
    Signal("e_i", "current error", "A"),
    Signal("e_w", "speed error", "rad/s", "m/s"),
    Signal("e_th", "position error", "rad", "m"),
)
SIGNALS = {signal.name: signal for signal in _SIGNALS}


@dataclass(frozen=True)
class Limiter:
    """A limiter: where it acts and how reports call it."""

    name: str
    words: str
    signal: str  # what stands in front of it, of `SIGNALS`
    kind: Kind  # a clamp of the signal, of its change per update, of its mean square, or of the command
    limit: str  # attribute of `Limits`; empty: that of the stage's target, or of the command
    bit: int  # of the limit flags that a run writes (`REST_BIT` says that the rotor is at rest)
    always: bool = False  # whether every drive that has the signal is told of it, without such a limit too

    def limit_of(self, limits: Limits) -> Any:
        return getattr(limits, self.limit)

    def unit(self, axis: Axis = "rotary") -> str:
        unit = SIGNALS[self.signal].unit_for(axis)
        return unit if self.kind != "rate" else f"{unit}^2" if unit.endswith("/s") else f"{unit}/s"


_LIMITERS = (
    Limiter("speed", "speed limit", "w_ref", "value", "speed_rad_s", 0, always=True),
    Limiter("acceleration", "acceleration limit", "w_ref", "rate", "acceleration_rad_s2", 1, always=True),
    Limiter("current", "current limit", "i_ref", "value", "peak_current_A", 2, always=True),
    Limiter("voltage", "voltage limit", "u", "value", "voltage_V", 3, always=True),
    Limiter("torque-command", "limit in front of the torque filters", "torque_command", "value", "", 5, True),
    Limiter("overload", "overload protection", "i", "rms", "continuous_current_A", 6),
    Limiter("profile", "profile of the command", "w_ref", "command", "", 7),
    Limiter("current-rate", "slope limit of the current", "i_ref", "rate", "current_rate_A_s", 8),
)
LIMITERS = {limiter.name: limiter for limiter in _LIMITERS}  # every limiter, in the order of its flag bit
CLAMP_OF = {limiter.signal: limiter for limiter in _LIMITERS if limiter.kind == "value"}
"""The clamp of each signal that a stage drives."""
REST_BIT = 4
