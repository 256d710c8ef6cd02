"""The motion controller's objects (Faulhaber MC V3.0 family) that a design knows: unit, range, key.

Grades as in a design file: A the maker's documents, B a file of a real device, D derived, X assumed.
"""

from dataclasses import dataclass
from math import inf, isfinite, pi

from actuator_lti.design.access import parameter_value
from actuator_lti.design.asked import ObjectPlace
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError

U16 = 2**16 - 1
U32 = 2**32 - 1
RPM = 2.0 * pi / 60.0
REV = 2.0 * pi
PER_RPM = 60.0 / (2.0 * pi)


@dataclass(frozen=True)
class KnownObject(ObjectPlace):
    """One object: what it means, its unit in SI, its range, and the keys that it sets.

    ``scale`` is the SI value of one step.  The first of ``paths`` is read on export, all are set on import;
    without paths the object is known but not part of the model.
    """

    meaning: str
    unit: str
    scale: float
    paths: tuple[str, ...] = ()
    low: int = 0
    high: int = U32
    grade: str = "B"
    alias_of: tuple[int, int] | None = None


_LIST = (
    KnownObject(0x2329, 1, "rated current", "mA", 1e-3),
    KnownObject(0x2329, 2, "continuous current", "mA", 1e-3, ("limits.continuous_current",), low=1),
    KnownObject(0x2329, 3, "peak current", "mA", 1e-3, ("limits.peak_current",), low=1),
    KnownObject(0x2329, 4, "torque constant", "uN m/A", 1e-6, ("motor.torque_constant",
                "motor.back_emf_constant"), low=1),
    KnownObject(0x2329, 5, "inductance", "uH", 1e-6, ("motor.inductance",), low=1),
    KnownObject(0x2329, 6, "inductance, second axis", "uH", 1e-6, low=1, alias_of=(0x2329, 5)),
    KnownObject(0x2329, 9, "rotor inertia", "1e-3 g cm2", 1e-10, ("motor.rotor_inertia",), low=1),
    KnownObject(0x2329, 10, "load inertia at the motor", "1e-3 g cm2", 1e-10),
    KnownObject(0x232A, 1, "resistance", "mohm", 1e-3, ("motor.resistance",), low=1),
    KnownObject(0x232A, 2, "static friction C0", "1e-6 mN m", 1e-9, ("friction.dry_torque",)),
    KnownObject(0x232A, 3, "viscous friction Cv", "1e-9 mN m/rpm", 1e-12 / RPM, ("friction.viscous",)),
    KnownObject(0x2342, 1, "torque PI gain", "mohm", 1e-3, ("control.current.gain",), low=1),
    KnownObject(0x2342, 2, "torque PI integral time", "us", 1e-6, ("control.current.integral_time",),
                low=150, high=2600),
    KnownObject(0x2344, 1, "velocity PI gain", "1e-6 A s", 1e-6, ("control.velocity.gain",), low=1,
                grade="A"),
    KnownObject(0x2344, 2, "velocity PI integral time", "100 us", 1e-4,
                ("control.velocity.integral_time",), low=20, high=1000, grade="A"),
    KnownObject(0x2345, 1, "actual-velocity filter time", "100 us", 1e-4, ("encoder.filter_time",),
                high=U16, grade="A/D"),
    KnownObject(0x2346, 1, "setpoint-velocity filter time", "100 us", 1e-4, high=U16, grade="A"),
    KnownObject(0x2346, 2, "setpoint-velocity filter enable", "1", 1.0, high=U16, grade="A"),
    KnownObject(0x2347, 1, "factor on the velocity gain at target", "1/128", 1 / 128, high=U16, grade="A"),
    KnownObject(0x2348, 1, "position gain Kv", "1/s", 1.0, ("control.position.gain",), low=1, high=250,
                grade="A"),
    KnownObject(0x2349, 1, "torque feed-forward", "1/128", 1 / 128,
                ("control.position.acceleration_feedforward",), high=1280, grade="A/D"),
    KnownObject(0x234A, 1, "velocity feed-forward", "1/128", 1 / 128, ("control.position.feedforward",),
                high=1280, grade="A"),
    KnownObject(0x6080, 0, "max motor speed", "rpm", RPM, ("limits.speed",), low=1),
    KnownObject(0x6083, 0, "profile acceleration", "rev/s2", REV, ("limits.acceleration",), low=1, grade="A"),
    KnownObject(0x6084, 0, "profile deceleration", "rev/s2", REV, low=1, grade="A", alias_of=(0x6083, 0)),
    KnownObject(0x60E0, 0, "positive torque limit", "1/1000 of rated", 1e-3, high=U16),
    KnownObject(0x60E1, 0, "negative torque limit", "1/1000 of rated", 1e-3, high=U16),
)  # fmt: skip

OBJECTS: dict[tuple[int, int], KnownObject] = {item.place: item for item in _LIST}
"""Known objects by index and subindex."""


def step_of(known: KnownObject, velocity_gain_factor: float) -> float:
    """The SI value of one step of an object."""
    return known.scale * (velocity_gain_factor if known.place == (0x2344, 1) else 1.0)


def model_value(design: Design, known: KnownObject) -> float | None:
    """What the design says for an object, in SI; None if nothing."""
    if known.place == (0x2329, 10):  # all inertia but the rotor's
        return design.inertia_kgm2 - design.motor.rotor_inertia_kgm2
    paths = known.paths if known.alias_of is None else OBJECTS[known.alias_of].paths
    try:
        value = parameter_value(design, paths[0]) if paths else inf
    except InputError:
        return None
    return value if isfinite(value) else None
