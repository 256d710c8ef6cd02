"""Settings of the motion controller: from its own objects to a design and back, without loss."""

from dataclasses import dataclass, replace
from typing import Any

from actuator_lti.design.access import with_values
from actuator_lti.design.asked import FrozenMap
from actuator_lti.design.checks import check_relations
from actuator_lti.design.model import ControllerObject, ControllerObjects, Design
from actuator_lti.design.object_dictionary import OBJECTS, PER_RPM, KnownObject, model_value, step_of
from actuator_lti.errors import InputError, in_file
from actuator_lti.files.reading import shown

__all__ = ["PER_RPM", "Exported", "Imported", "Rounding", "export_objects", "import_objects"]

MAX_OBJECTS = 5000
_TOLERATED = 1e-9
_TORQUE_LIMITS = ((0x60E0, 0), (0x60E1, 0))
_Values = dict[tuple[int, int], int]


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
            kept += [] if known is not None and _follows(known, item.value, given) else [item]
            continue
        step = step_of(known, objects.velocity_gain_factor)
        current = model_value(base, known)
        if current is None or round(current / step) != item.value:
            changes.update(dict.fromkeys(known.paths, item.value * step))
    design = with_values(base, changes, check=False) if changes else base
    source, old = f"controller settings {where}", design.parameters
    named = {path: replace(old[path], source=source, grade="B") for path in changes}
    design = replace(design, objects=objects, parameters=FrozenMap({**old, **named}))
    check_relations(design, where)
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
    """What a reader of the import has to know."""
    first, second = given.get((0x6083, 0)), given.get((0x6084, 0))
    rated_A, peak_A = given.get((0x2329, 1), 0) * 1e-3, design.limits.peak_current_A
    limits = {
        key: given[key] * 1e-3 * rated_A for key in _TORQUE_LIMITS if key in given and (0x2329, 1) in given
    }
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
    """A controller's settings from a rotary drive with all three loops, unknown objects as they were.

    ``complete`` adds those that the imported settings did not have; by default only a design that was never
    imported gets them. A value that does not fit its object's range is an InputError.
    """
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
    return Exported(
        objects=replace(before, values=tuple(written)), rounded=tuple(rounded), notes=tuple(notes)
    )


def _encode(design: Design, known: KnownObject, rounded: list[Rounding]) -> int | None:
    """The integer of an object for this design; None where the design says nothing."""
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
