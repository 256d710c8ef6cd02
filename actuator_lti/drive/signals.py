"""The signals and the limiters of a drive, each declared once: name, unit, words, bit of the limit flags."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from actuator_lti.design.model import Axis, Limits

Kind = Literal["value", "rate", "rms"]


@dataclass(frozen=True)
class Signal:
    """A signal of the drive: what it is, and its unit on a rotary and on a linear axis."""

    name: str
    words: str
    unit: str
    linear_unit: str = ""

    def unit_for(self, axis: Axis) -> str:
        """Unit on an axis."""
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
    Signal("moment", "moment on the output shaft", "N m", "N"),
    Signal("w_cmd", "speed command before its limits", "rad/s", "m/s"),
    Signal("w_meas", "measured speed", "rad/s", "m/s"),
    Signal("e_i", "current error", "A"),
    Signal("e_w", "speed error", "rad/s", "m/s"),
    Signal("e_th", "position error", "rad", "m"),
)
SIGNALS = {signal.name: signal for signal in _SIGNALS}


@dataclass(frozen=True)
class Limiter:
    """A limiter: where it acts and how it is told of.

    Attributes
    ----------
    name : str
    words : str
    limit : str
        Attribute of `Limits` that holds it; empty for ``torque-command``, which has that of the stage's
        target.
    kind : {"value", "rate", "rms"}
        A clamp of the signal, of its change per update, or of its mean square in the long run.
    bit : int
        Of the limit flags that a run writes (bit 4 says that the rotor is at rest).
    """

    name: str
    words: str
    limit: str
    kind: Kind
    bit: int

    def limit_of(self, limits: Limits) -> Any:
        """Its value in a design; ``inf`` where there is none."""
        return getattr(limits, self.limit)


_LIMITERS = (
    Limiter("speed", "speed limit", "speed_rad_s", "value", 0),
    Limiter("acceleration", "acceleration limit", "acceleration_rad_s2", "rate", 1),
    Limiter("current", "current limit", "peak_current_A", "value", 2),
    Limiter("voltage", "voltage limit", "voltage_V", "value", 3),
    Limiter("torque-command", "limit in front of the torque filters", "", "value", 5),
    Limiter("overload", "overload protection", "continuous_current_A", "rms", 6),
)
LIMITERS = {limiter.name: limiter for limiter in _LIMITERS}
"""Every limiter, in the order of its flag bit."""
CLAMP_OF = {"w_ref": "speed", "i_ref": "current", "u": "voltage"}
"""The clamp of each signal that a stage drives."""
