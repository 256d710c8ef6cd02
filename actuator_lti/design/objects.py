"""Settings of the motion controller (Faulhaber MC V3.0), to a design and back, without loss."""

from dataclasses import dataclass, replace
from math import inf, isfinite, pi
from typing import Any

from actuator_lti.design.access import parameter_value, with_values
from actuator_lti.design.asked import ControllerObject, ControllerObjects, FrozenMap, ObjectPlace
from actuator_lti.design.checks import contradictions
from actuator_lti.design.fields import FIELDS, parts_of
from actuator_lti.design.mistakes import Findings
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, in_file
from actuator_lti.files.reading import shown

U16, U32 = 2**16 - 1, 2**32 - 1
REV, RPM, PER_RPM = 2.0 * pi, 2.0 * pi / 60.0, 60.0 / (2.0 * pi)
MAX_OBJECTS = 5000
_TOLERATED = 1e-9
_RATES = (".period", ".computing_delay", ".every")
_TORQUE_LIMITS = ((0x60E0, 0), (0x60E1, 0))
_Values = dict[tuple[int, int], int]


@dataclass(frozen=True)
class KnownObject(ObjectPlace):
    """One object: what it means, its unit in SI, its range, and the keys that it sets."""

    meaning: str
    unit: str
    scale: float  # SI value of one step
    # The first is read on export, all are set on import; without any it is no part of the model
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
    return known.scale * (velocity_gain_factor if known.place == (0x2344, 1) else 1.0)


def model_value(design: Design, known: KnownObject) -> float | None:
    """In SI, of an AC motor that of the equivalent DC motor; None if the design says nothing."""
    if known.place == (0x2329, 10):  # all inertia but the rotor's
        return design.inertia_kgm2 - design.motor.rotor_inertia_kgm2
    paths = known.paths if known.alias_of is None else OBJECTS[known.alias_of].paths
    try:
        value = parameter_value(design, paths[0]) * _dc_of_sheet(design, paths[0]) if paths else inf
    except InputError:
        return None
    return value if isfinite(value) else None


def _dc_of_sheet(design: Design, path: str) -> float:
    """A controller counts the amperes of the equivalent DC motor, for which its kM, R and L hold."""
    return design.dc_of_sheet.get(FIELDS[path].attribute, 1.0)


@dataclass(frozen=True, kw_only=True)
class Rounding:
    """A value that the controller's resolution cannot hold exactly: in steps of its object."""

    label: str
    path: str
    exact: float
    written: int
    unit: str

    def __str__(self) -> str:
        return f"{self.label} ({self.path}): {self.exact:.9g} rounded to {self.written} {self.unit}"


@dataclass(frozen=True, kw_only=True)
class Imported:
    """A design with a controller's settings, and what the import did."""

    design: Design
    changed: tuple[str, ...]
    kept: tuple[ControllerObject, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Exported:
    """A controller's settings from a design, and which values its resolution rounded."""

    objects: ControllerObjects
    rounded: tuple[Rounding, ...]
    notes: tuple[str, ...]


def import_objects(objects: ControllerObjects, base: Design, where: str = "settings") -> Imported:
    """Put a controller's settings into a design.

    Values that the design already holds, to the resolution of the object, stay as they are written there.
    Objects that no key of a design holds are kept in ``design.objects`` and written back by
    :func:`export_objects`.

    The base is a rotary drive with all three loops; else, and for a value out of its object's range, an
    InputError names the file ``where``.
    """
    _check_cascade(base)
    with in_file(where):
        given = _checked(objects.values)
    changes: dict[str, float] = {}
    kept: list[ControllerObject] = []
    for item in objects.values:
        known = OBJECTS.get(item.place)
        if known is None or not known.paths:
            kept += [] if known and _follows(known, item.value, given) else [item]
            continue
        step = step_of(known, objects.velocity_gain_factor)
        current = model_value(base, known)
        if current is None or round(current / step) != item.value:
            changes.update({path: item.value * step / _dc_of_sheet(base, path) for path in known.paths})
    design = with_values(base, changes, check=False) if changes else base
    source, old = f"controller settings {where}", design.parameters
    named = {path: replace(old[path], source=source, grade="B") for path in changes}
    design = replace(design, objects=objects, parameters=FrozenMap({**old, **named}))
    Findings(where).refuse(contradictions(design))
    notes = _import_notes(given, objects.velocity_gain_factor, design)
    return Imported(design=design, changed=tuple(changes), kept=tuple(kept), notes=notes)


def _follows(known: KnownObject, value: int, given: _Values) -> bool:
    """Whether an object only repeats another one (deceleration and acceleration)."""
    return known.alias_of is not None and given.get(known.alias_of) == value


def _check_cascade(design: Design) -> None:
    control = design.controller
    cascade = {"velocity", "current"} <= {*control.stages} and control.own_law is None
    if design.axis != "rotary" or not cascade:
        raise InputError(
            f"the design {design.name} cannot hold a motion controller's settings; "
            "allowed: a rotary drive with current, velocity and position loop, all by gains"
        )


def _checked(values: tuple[ControllerObject, ...]) -> _Values:
    """Values by index and subindex; duplicates and values out of their object's range are refused."""
    seen: _Values = {}
    for item in values:
        known, allowed = OBJECTS.get(item.place), ""
        if item.place in seen:
            allowed = "each object once"
        elif known is not None and not known.low <= item.value <= known.high:
            allowed = f"{known.low} to {known.high} {known.unit}, the {known.meaning}"
        elif not (-(2**63) <= item.value < 2**64 and item.index <= 0xFFFF and item.subindex <= 0xFF):
            allowed = "an integer of at most 64 bits"
        if allowed:
            raise InputError(f"{item.label} = {item.value}: allowed: {allowed}")
        seen[item.index, item.subindex] = item.value
    return seen


def checked_objects(values: tuple[ControllerObject, ...], factor: Any) -> ControllerObjects:
    """Settings from their parts as every file of them is held to: each in its range, the factor positive."""
    if len(values) > MAX_OBJECTS:
        raise InputError(f"{len(values)} objects; allowed: at most {MAX_OBJECTS}")
    _checked(values)
    if isinstance(factor, bool) or not isinstance(factor, int | float) or not 1e-6 <= factor <= 1e6:
        raise InputError(f"velocity_gain_factor = {shown(factor)}: allowed: 1 (per rad/s) or 9.549 (per rpm)")
    return ControllerObjects(velocity_gain_factor=float(factor), values=values)


def _import_notes(given: _Values, factor: float, design: Design) -> tuple[str, ...]:
    first, second = given.get((0x6083, 0)), given.get((0x6084, 0))
    rated_A, peak_A = given.get((0x2329, 1), 0) * 1e-3, design.limits.peak_current_A
    stated = [key for key in _TORQUE_LIMITS if key in given and (0x2329, 1) in given]
    limits = {key: given[key] * 1e-3 * rated_A for key in stated}
    per = "per rad/s" if factor == 1.0 else "per rpm"
    notes = [
        (f"velocity gain 0x2344.01 read as A s {per} (calibration factor {factor:.4g})",
         (0x2344, 1) in given),
        ("torque feed-forward 0x2349.01 read as the share of J/kM times the command's acceleration",
         given.get((0x2349, 1))),
        ("friction of 0x232A read as that of the whole drive at the motor; check that it is not the motor's "
         "alone", (0x232A, 2) in given or (0x232A, 3) in given),
        *((f"{OBJECTS[key].label} limits the torque to that of {limit_A:.4g} A, below the peak current",
           limit_A < peak_A) for key, limit_A in limits.items()),
        (f"deceleration 0x6084 = {second} differs from acceleration 0x6083 = {first}, which the model uses "
         "for both", None not in (first, second) and first != second),
        ("0x2347.01 changes the velocity gain at target; the model leaves it out",
         given.get((0x2347, 1), 128) != 128),
    ]  # fmt: skip
    return tuple(note for note, holds in notes if holds)


def export_objects(design: Design, *, complete: bool | None = None) -> Exported:
    """Settings of a drive with all loops; ``complete`` adds those that the imported ones did not have."""
    _check_cascade(design)
    before = design.objects
    complete = not before.values if complete is None else complete
    original = {item.place: item.value for item in before.values}
    rounded: list[Rounding] = []
    written = list(before.values)
    for k, item in enumerate(before.values):
        known = OBJECTS.get(item.place)
        if known is not None and (known.paths or _follows(known, item.value, original)):
            value = _encode(design, known, rounded)
            written[k] = item if value is None else replace(item, value=value)
    missing = [known for key, known in OBJECTS.items() if key not in original]
    for known in missing if complete else []:
        value = _encode(design, known, rounded)
        if value is not None:
            written.append(ControllerObject(index=known.index, subindex=known.subindex, value=value))
    notes = [f"velocity gain 0x2344.01 written with calibration factor {before.velocity_gain_factor:.4g}"]
    left = [] if complete else [known.label for known in missing if known.paths]
    notes += [f"not in the imported settings, so not written: {', '.join(left)}"] if left else []
    unheld = _unheld(design)
    notes += [f"no object holds, so not written: {', '.join(unheld)}"] if unheld else []
    settings = replace(before, values=tuple(written))
    return Exported(objects=settings, rounded=tuple(rounded), notes=tuple(notes))


def _unheld(design: Design) -> list[str]:
    """What the design's controller has besides: filters and keys with a number, rates and delay aside."""
    held = {path for known in _LIST for path in known.paths}
    filters = [path for _, path, _ in parts_of(design) if ".filter." in path]
    stated = [path for path, one in design.parameters.items() if one.value and ".filter." not in path]
    return filters + [
        path for path in stated
        if path.startswith(("control.", "command.")) and path not in held and not path.endswith(_RATES)
    ]  # fmt: skip


def _encode(design: Design, known: KnownObject, rounded: list[Rounding]) -> int | None:
    value = model_value(design, known)
    path = known.paths[0] if known.paths else known.meaning
    allowed = f"{known.low} to {known.high} {known.unit}"
    if value is None:
        if path in ("control.current.integral_time", "control.velocity.integral_time"):
            raise InputError(f"{path}: missing; {known.label} needs {allowed}")
        return None
    exact = value / step_of(known, design.objects.velocity_gain_factor)
    number = round(exact)
    if not known.low <= number <= known.high:
        raise InputError(f"{path} = {exact:.6g} {known.unit}: object {known.label}: allowed: {allowed}")
    if abs(exact - number) > _TOLERATED * max(1.0, abs(exact)):
        rounded.append(Rounding(label=known.label, path=path, exact=exact, written=number, unit=known.unit))
    return number


def calibration(per: str) -> float:
    """The calibration factor of the velocity gain: ``"rad/s"`` gives 1, ``"rpm"`` gives 9.549."""
    factors = {"rad/s": 1.0, "rpm": PER_RPM}
    if per not in factors:
        raise InputError(f'velocity gain per "{per}": allowed: "rad/s" or "rpm"')
    return factors[per]
