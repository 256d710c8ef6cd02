"""What a record can tell of a drive: name, label and unit of each value, and the key that it goes to."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actuator_lti.design.model import Design


@dataclass(frozen=True)
class Parameter:
    """One value. ``key`` is empty where it is shared out among keys; ``linear``: label on a linear axis."""

    label: str
    unit: str
    key: str = ""
    linear: str = ""
    scale: float = 1.0  # of the value in SI, to the unit in which it is shown


UNSTATED = 0.05  # relative standard deviation of a number of a design that states no tolerance
TORQUE, VISCOUS, INERTIA = "N m", "N m s/rad", "kg m²"
ON_A_LINE = {TORQUE: "N", VISCOUS: "N s/m", INERTIA: "kg", "N m/(N m)": "N/N"}
ON_A_LINE |= {"N m/A": "N/A", "N m/V": "N/V", "N m/rad": "N/m"}

PARAMETERS = {
    "inertia": Parameter("Inertia, all at the motor", INERTIA, linear="Mass"),
    "viscous": Parameter("Viscous friction", VISCOUS, "friction.viscous"),
    "dry": Parameter("Dry friction", TORQUE, "friction.dry_torque"),
    "offset": Parameter("Offset", TORQUE, "friction.offset_torque"),
    "viscous_forward": Parameter("Viscous friction, forward", VISCOUS, "friction.viscous"),
    "dry_forward": Parameter("Dry friction, forward", TORQUE, "friction.dry_torque"),
    "viscous_reverse": Parameter("Viscous friction, reverse", VISCOUS, "friction.viscous_reverse"),
    "dry_reverse": Parameter("Dry friction, reverse", TORQUE, "friction.dry_torque_reverse"),
    "load_coefficient": Parameter("Load friction", "N m/(N m)", "friction.load_coefficient"),
    "gravity_sin": Parameter("Gravity, m g l cos(offset less the design's)", TORQUE),
    "gravity_cos": Parameter("Gravity, m g l sin(offset less the design's)", TORQUE),
    "gravity": Parameter("Gravity, m g l", TORQUE),
    "motor_inertia": Parameter("Inertia before the coupling, at the motor", INERTIA, "motor.rotor_inertia"),
    "load_inertia": Parameter("Inertia behind it, at its own shaft", INERTIA, "load.inertia"),
    "stiffness": Parameter("Stiffness", "N m/rad", "coupling.stiffness"),
    "damping": Parameter("Damping", VISCOUS, "coupling.damping"),
    "load_viscous": Parameter("Viscous friction of the load", VISCOUS, "load.friction.viscous"),
    "antiresonance": Parameter("Antiresonance", "rad/s"),
    "resonance": Parameter("Resonance", "rad/s"),
    "play": Parameter("Play, total", "rad", "coupling.play"),
    "resistance": Parameter("Resistance R", "ohm", "motor.resistance"),
    "back_emf": Parameter("Back-EMF constant kE (kM follows)", "V s/rad", "motor.back_emf_constant"),
    "torque_constant": Parameter("Torque constant kM", "N m/A", "motor.torque_constant", "Force constant kM"),
    "source_gain": Parameter("Gain of the source", "N m/V", "motor.source_gain"),
    "inductance": Parameter("Inductance L", "H", "motor.inductance"),
    "voltage_offset": Parameter("Offset of the voltage", "V"),
    "delay": Parameter("Computing delay", "s", "control.computing_delay"),
    "C0": Parameter("C0, static", "mN m", "friction.dry_torque", scale=1e3),
    "Cv": Parameter("Cv, viscous", "µN m s/rad", "friction.viscous", scale=1e6),
    "CM": Parameter("CM, load", "mN m/(N m)", "friction.load_coefficient", scale=1e3),
}


def parameter(name: str, axis: str = "rotary") -> Parameter:
    """A parameter by its name, with label and unit as an axis has them; a key of a design is its own label.

    >>> parameter("inertia", "linear").label, parameter("dry", "linear").unit, parameter("map_0").key
    ('Mass', 'N', 'friction.point.1.torque')
    """
    one = PARAMETERS.get(name)
    if name.startswith("map_"):
        number = int(name[4:]) + 1
        one = Parameter(f"Friction map, point {number}", TORQUE, f"friction.point.{number}.torque")
    if one is None:
        like = next((each for each in PARAMETERS.values() if each.key == name and each.scale == 1.0), None)
        one = Parameter(name, like.unit if like else "SI", name)
    if axis != "linear":
        return one
    return Parameter(one.linear or one.label, ON_A_LINE.get(one.unit, one.unit), one.key, scale=one.scale)


def pendulum_angle(design: Design) -> float:
    """The offset of the design's pendulum, rad; 0 without one."""
    return 0.0 if design.load.gravity is None else design.load.gravity.offset_rad


def default_value(design: Design, name: str, start: Design | None = None) -> float:
    """The design's own value of a parameter of an inverse model, at the motor.

    ``start`` is the design that the model was fitted with, where it is another.
    """
    friction, gravity = design.friction, design.load.gravity
    if name == "inertia":
        return design.inertia_kgm2
    if name.startswith("map_"):
        return dict(enumerate(point.torque_Nm for point in friction.map(1))).get(int(name[4:]), 0.0)
    if name.startswith("gravity_") and gravity is not None:
        part = cos if name == "gravity_sin" else sin
        return gravity.peak_Nm * part(gravity.offset_rad - pendulum_angle(start or design))
    side = -1 if name.endswith("_reverse") else 1
    own = {
        "viscous": friction.viscous(side),
        "dry": friction.dry_Nm(0.0, side),
        "offset": friction.offset_torque_Nm,
        "load": friction.load_coefficient,
    }
    return own.get(name.partition("_")[0], 0.0)


def own_std(design: Design, key: str) -> float:
    """Standard deviation of a design's own value, from its tolerance; 0 where none is stated."""
    one = design.parameters.get(key)
    if one is None or one.tolerance is None:
        return 0.0
    return float(one.tolerance.std or (one.tolerance.half_width or 0.0) / sqrt(3.0))


def own_share(design: Design, key: str, value: float | None = None) -> float:
    """That over the value; 5 % where no tolerance is stated."""
    one = design.parameters.get(key)
    size = abs(value or (float(one.value) if one is not None else 0.0))
    return own_std(design, key) / size if size and own_std(design, key) else UNSTATED
