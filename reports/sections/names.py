"""Words that several sections use for the same things."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from actuator_lti.asked.quantities import QUANTITIES as REGISTRY
from actuator_lti.asked.quantities import shown_unit
from actuator_lti.design.model import Design
from nonlinear.runs.trajectory import COMMAND_UNITS
from reports import document as doc

LOOPS = {"current": "Current loop", "velocity": "Velocity loop", "position": "Position loop"}
FORMS = {"sampled": "sampled", "continuous": "continuous with delays", "ideal": "ideal, no delay"}
POINTS = {
    "u": "voltage u",
    "i_ref": "current command i_ref",
    "w_ref": "speed command w_ref",
    "output": "output angle",
}
QUANTITIES = {name: quantity.words for name, quantity in REGISTRY.items()}


def loop_words(name: str, rotor: str = "free") -> str:
    return f"{LOOPS[name]}, rotor {rotor or 'free'}" if name == "current" else LOOPS[name]


def figure_column(quantity: str, key: str, *, format: str, label: str = "") -> doc.Column:
    """Describe the column of a figure of the registry: its heading, unit and better direction."""
    of = REGISTRY[quantity]
    return doc.column(key, label or of.heading, of.shown[0], format=format, better=of.direction)


class Unit(NamedTuple):
    """A unit in which amounts are shown, and the factor to it from SI."""

    scale: float
    unit: str

    def of(self, value: float, digits: int = 3) -> str:
        """Write an amount in SI with its unit."""
        return f"{self.scale * value:.{digits}g} {self.unit}"

    def per(self, what: str) -> Unit:
        return Unit(self.scale, f"{self.unit}/{what}")

    def column(self, format: str = "sig:3", **more: Any) -> dict[str, Any]:
        """What `reports.document.of` has to know of a column in it."""
        return {**self._asdict(), "format": format, **more}


def output_unit(axis: str) -> Unit:
    """Unit of a position at the output: degrees, or millimetres on a linear axis."""
    return Unit(1e3, "mm") if axis == "linear" else Unit(math.degrees(1.0), "deg")


def command_unit(design: Design) -> Unit:
    """Unit of a command: a position or speed at the output, a current, a voltage."""
    unit, scale = COMMAND_UNITS[design.axis, design.controller.outermost]
    return Unit(scale, unit)


def fine_unit(axis: str) -> Unit:
    """The same a thousand times finer."""
    scale, unit = output_unit(axis)
    return Unit(1e3 * scale, {"deg": "mdeg", "mm": "µm"}[unit])


def speed_unit(axis: str) -> str:
    """Unit of the motor's speed, or of the axis' own."""
    return "m/s" if axis == "linear" else "rad/s"


def push_words(design: Design) -> str:
    return "force" if design.axis == "linear" else "torque"


def in_shown(value: float | None, unit: str) -> float | None:
    """A figure in the unit in which reports write those of a unit."""
    return None if value is None else shown_unit(unit)[1] * value


def hertz(omega_rad_s: float | None) -> float | None:
    """Turn rad/s into Hz; nothing stays nothing."""
    return None if omega_rad_s is None else omega_rad_s / (2.0 * math.pi)
