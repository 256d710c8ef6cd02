"""From a design and arrays of changed values to the rows of numbers that the compiled loops read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, pi
from typing import TYPE_CHECKING, Literal

import numpy as np

from actuator_lti.errors import InputError

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

OperatingPoint = Literal["sliding", "rest", "describing-function"]
Values = Mapping[str, np.ndarray]

_CONTROL = {
    "control.period": "period_s",
    "control.computing_delay": "computing_delay_s",
    "control.current.gain": "gain_V_A",
    "control.current.integral_time": "integral_time_s",
    "control.velocity.gain": "gain",
    "control.velocity.integral_time": "integral_time_s",
    "control.position.gain": "gain",
}
_PLAIN = {
    "motor": {
        "rotor_inertia": "rotor_inertia_kgm2",
        "resistance": "resistance_ohm",
        "inductance": "inductance_H",
        "torque_constant": "torque_constant_Nm_A",
        "back_emf_constant": "back_emf_constant_Vs_rad",
        "source_gain": "source_gain_Nm_V",
    },
    "load": {"inertia": "inertia_kgm2", "moment_slope": "moment_slope_Nm_rad", "moment_max": "moment_max_Nm"},
    "friction": {
        "dry_torque": "dry_torque_Nm",
        "viscous": "viscous_Nms_rad",
        "load_coefficient": "load_coefficient",
        "smoothing_speed": "smoothing_speed_rad_s",
        "breakaway_ratio": "breakaway_ratio",
        "dry_torque_reverse": "dry_torque_reverse_Nm",
        "viscous_reverse": "viscous_reverse_Nms_rad",
        "offset_torque": "offset_torque_Nm",
    },
    "encoder": {"filter_time": "filter_time_s"},
    "limits": {
        "voltage": "voltage_V",
        "speed": "speed_rad_s",
        "acceleration": "acceleration_rad_s2",
        "peak_current": "peak_current_A",
        "continuous_current": "continuous_current_A",
    },
}
_GEAR = {"ratio": "ratio", "input_inertia": "input_inertia_kgm2", "output_inertia": "output_inertia_kgm2"}


def variable_paths(design: Design) -> tuple[str, ...]:
    """Every dotted key of a design that is a continuous number and that a batch may vary."""
    paths = [f"{section}.{key}" for section, keys in _PLAIN.items() for key in keys]
    paths = [path for path in paths if _nominal(design, path) is not None]
    for gear in design.gears:
        paths += [f"gear.{gear.name}.{key}" for key in _GEAR]
    paths += [path for path in _CONTROL if _nominal(design, path) is not None]
    if design.controller.position_loop.feedforward:
        paths.append("control.position.feedforward")
    return tuple(paths)


def _nominal(design: Design, path: str) -> float | None:
    """The SI value of a key, or None where the design does not have it."""
    section, _, key = path.rpartition(".")
    if section in _PLAIN:
        return getattr(getattr(design, section), _PLAIN[section][key], None)
    if path.startswith("gear."):
        named = {gear.name: gear for gear in design.gears}
        gear = named.get(section.removeprefix("gear."))
        return None if gear is None else getattr(gear, _GEAR[key])
    if path == "control.position.feedforward":
        return design.controller.position_loop.feedforward
    owner = design.controller if section == "control" else getattr(design.controller, section.split(".")[1])
    return None if owner is None else getattr(owner, _CONTROL[path])


@dataclass(frozen=True)
class Population:
    """Many designs of one structure: a nominal design and, for some keys, an array of SI values.

    Attributes
    ----------
    design : Design
    values : mapping of str to ndarray, shape (count,)
        By dotted key; a key that is not there has its nominal value.
    count : int
    """

    design: Design
    values: Values
    count: int

    def __post_init__(self) -> None:
        known = set(variable_paths(self.design))
        for path, array in self.values.items():
            if path not in known:
                raise InputError(f"{path}: not a number of this design that can vary")
            if np.shape(array) != (self.count,):
                raise InputError(f"{path}: {np.shape(array)} values where ({self.count},) are needed")
            if not np.all(np.isfinite(array)):
                raise InputError(f"{path}: values must be finite")

    def get(self, path: str, otherwise: float = 0.0) -> np.ndarray | float:
        """The values of a key, its nominal value where it does not vary, or a default."""
        if path in self.values:
            return np.asarray(self.values[path], dtype=float)
        nominal = _nominal(self.design, path)
        return otherwise if nominal is None else nominal

    @property
    def total_ratio(self) -> np.ndarray | float:
        """N, motor angle over output angle."""
        ratio: np.ndarray | float = 1.0
        for gear in self.design.gears:
            ratio = ratio * self.get(f"gear.{gear.name}.ratio")
        return ratio

    @property
    def inertia_kgm2(self) -> np.ndarray | float:
        """J at the motor shaft, equation (12)."""
        total = self.get("motor.rotor_inertia")
        ratio: np.ndarray | float = 1.0
        for gear in self.design.gears:
            total = total + self.get(f"gear.{gear.name}.input_inertia") / ratio**2
            ratio = ratio * self.get(f"gear.{gear.name}.ratio")
            total = total + self.get(f"gear.{gear.name}.output_inertia") / ratio**2
        return total + self.get("load.inertia") / ratio**2

    def dry_Nm(self, load_Nm: float, direction: int = 1) -> np.ndarray | float:
        """Tc = C0 + CM |M_ext| of equation (9)."""
        base = self.get("friction.dry_torque")
        if direction < 0:
            base = self.get("friction.dry_torque_reverse", base)  # type: ignore[arg-type]
        return base + self.get("friction.load_coefficient") * abs(load_Nm)

    def viscous(self, direction: int = 1) -> np.ndarray | float:
        """Cv for a direction of motion."""
        base = self.get("friction.viscous")
        return self.get("friction.viscous_reverse", base) if direction < 0 else base  # type: ignore[arg-type]

    def friction_slope(
        self,
        operating_point: OperatingPoint,
        load_Nm: float,
        speed_amplitude_rad_s: float | None,
        direction: int,
    ) -> np.ndarray | float:
        """Slope of friction over speed at an operating point (model.md, section 3)."""
        if operating_point == "sliding":
            return self.viscous(direction)
        if operating_point == "rest":
            return self.viscous(direction) + self.dry_Nm(load_Nm, direction) / self.get(
                "friction.smoothing_speed"
            )
        if speed_amplitude_rad_s is None or not speed_amplitude_rad_s > 0:
            raise InputError("speed_amplitude_rad_s: needed, positive, by the describing function")
        dry = (self.dry_Nm(load_Nm, 1) + self.dry_Nm(load_Nm, -1)) / 2
        return (self.viscous(1) + self.viscous(-1)) / 2 + 4 * dry / (pi * speed_amplitude_rad_s)

    def rows(
        self,
        operating_point: OperatingPoint = "sliding",
        load_Nm: float = 0.0,
        speed_amplitude_rad_s: float | None = None,
        direction: int = 1,
    ) -> np.ndarray:
        """Parameters of the compiled loops, one row a design, in the order of ``_assemble``."""
        stiffness: np.ndarray | float = 0.0
        if self.design.load.path == "back-drivable":
            stiffness = self.get("load.moment_slope") / self.total_ratio**2
        torque = "motor.torque_constant" if self.design.motor.has_electrical_dynamics else "motor.source_gain"
        columns = [
            self.get("motor.resistance"), self.get("motor.inductance"), self.get(torque),
            self.get("motor.back_emf_constant"), self.inertia_kgm2,
            self.friction_slope(operating_point, load_Nm, speed_amplitude_rad_s, direction), stiffness,
            self.get("control.period"), self.get("control.computing_delay"),
            *(self._controller(f"control.{loop}.{key}") for loop in ("current", "velocity")
              for key in ("gain", "integral_time")),
            self.get("control.position.gain"), self.get("encoder.filter_time"),
            self.get("control.position.feedforward"),
        ]  # fmt: skip
        rows = np.empty((self.count, len(columns)))
        for k, column in enumerate(columns):
            rows[:, k] = column
        return rows

    def _controller(self, path: str) -> np.ndarray | float:
        present = getattr(self.design.controller, path.split(".")[1]) is not None
        return self.get(path) if present else 0.0

    def structure(self) -> np.ndarray:
        """What all designs share, as integers for the compiled loops."""
        design, control = self.design, self.design.controller
        velocity = control.velocity
        current_kind = 0 if control.current is None else 1 if control.current.integral_time_s is None else 2
        velocity_kind = 0 if velocity is None else 1 if velocity.integral_time_s is None else 2
        every = 1 if velocity is None else velocity.every
        difference = design.encoder.difference_samples if design.encoder.speed == "difference" else 0
        filtered = bool(np.any(np.asarray(self.get("encoder.filter_time")) > 0))
        return np.array(
            [
                design.motor.has_electrical_dynamics, current_kind, velocity_kind, every,
                control.position_loop.every, difference if velocity is not None else 0,
                filtered and velocity is not None,
            ],
            dtype=np.int64,
        )  # fmt: skip

    def largest_order(self, rows: np.ndarray, kind: np.ndarray) -> int:
        """States of the largest loop: plant, voltages on their way, integrators, speed measurement."""
        ticks = ceil(float(np.max(rows[:, 8] / rows[:, 7]))) + 1
        return 3 + ticks + 3 + int(kind[5]) + int(kind[6])
