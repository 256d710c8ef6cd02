"""What a coupling, the load behind it and a self-locking stage ask of each other (model.md section 6)."""

from __future__ import annotations

from collections.abc import Iterator

from actuator_lti.design.mistakes import Refusal
from actuator_lti.design.model import Design
from actuator_lti.design.sections import part_at
from actuator_lti.design.unread import readable
from actuator_lti.files.reading import shown

_DRIVABLE = 'load.path = "back-drivable"'  # the default locks itself


def check_place(design: Design) -> Iterator[Refusal]:
    """Refuse names of gears that are none; whatever asks for an inertia needs the coupling's place."""
    for path, attribute in (("coupling", "after"), ("load", "locking_gear")):
        yield from readable(_no_gear(design, path, attribute))


def _no_gear(design: Design, path: str, attribute: str) -> Iterator[Refusal]:
    name, names = getattr(part_at(design, path), attribute, None), [gear.name for gear in design.gears]
    if name is not None and name not in names:
        known = ", ".join(names) or "none, as there are no gears; leave it out"
        yield f"{path}.{attribute}", shown(name), f"is no gear; allowed: {known}"


def _behind(design: Design) -> Iterator[Refusal]:
    """Friction of a load that has no coupling before it; a coupling without an inertia behind it."""
    coupling = design.coupling
    if coupling is None:
        if design.load.friction is not None:
            yield "load.friction", "a table", "allowed behind a coupling; a rigid drive has friction alone"
    elif design.load_side_inertia_kgm2 <= 0.0:
        allowed = "allowed with an inertia behind it; load.inertia, or that of a gear behind it, is missing"
        yield "coupling.stiffness", f"{coupling.stiffness_Nm_rad:g}", allowed


def _law(design: Design) -> Iterator[Refusal]:
    if design.coupling is not None and design.friction.law == "tanh":
        yield "friction.law", '"tanh"', 'allowed with a coupling: "coulomb"'


def _locking(design: Design) -> Iterator[Refusal]:
    """A self-locking stage behind the coupling, or whose friction would give energy."""
    coupling, locking = design.coupling, design.load.locking_gear
    if coupling is None:
        return
    if design.load.path != "self-locking":
        if locking is not None:
            yield "load.locking_gear", f'"{locking}"', 'allowed with load.path = "self-locking"'
        return
    names = [gear.name for gear in design.gears]
    locks = names.index(locking) + 1 if locking else len(names)
    least, coefficient = 1.0 / design.total_ratio, design.friction.load_coefficient
    if design.gears_before_coupling < locks:
        allowed = (
            f"lies before the self-locking stage; allowed: {', '.join(names[locks - 1 :])}, "
            f"load.locking_gear with a gear before the coupling, or {_DRIVABLE}"
        )
        yield "coupling.after", f'"{coupling.after or ""}"', allowed
    elif coefficient < least * (1 - 1e-12):
        reason = "a self-locking stage with less than 1/N gives energy"
        allowed = f"{reason}; allowed: at least {least:g}, or {_DRIVABLE}"
        yield "friction.load_coefficient", f"{coefficient:g}", allowed


def _bends(design: Design) -> Iterator[Refusal]:
    """Torques and stiffnesses of a spring that bends: each with its other, in order."""
    coupling = design.coupling
    if coupling is None:
        return
    bends = [(coupling.torque_1_Nm, coupling.stiffness_2_Nm_rad)]
    bends.append((coupling.torque_2_Nm, coupling.stiffness_3_Nm_rad))
    for number, (torque, stiffness) in enumerate(bends, 1):
        key, beside = f"coupling.torque_{number}", f"coupling.stiffness_{number + 1}"
        if (torque is None) != (stiffness is None):
            given, missing = (key, beside) if stiffness is None else (beside, key)
            yield given, f"{torque or stiffness:g}", f"allowed with {missing} beside it"
    first, second = bends[0][0], bends[1][0]
    if second is not None and (first is None or first >= second):
        allowed = "above coupling.torque_1" if first is not None else "with coupling.torque_1"
        yield "coupling.torque_2", f"{second:g}", f"allowed: {allowed}"


ELASTIC_CHECKS = (_behind, _bends, _law, _locking)
"""What the event-driven plant of a drive train cannot be."""


def elastic_warnings(design: Design) -> Iterator[str]:
    """A rigid self-locking drive that cannot lock its load, and a spring that nothing damps."""
    behind = design.load.friction
    if design.coupling is not None and design.coupling.damping_Nms_rad == 0.0:
        free = behind is None or not (behind.viscous_Nms_rad or behind.dry_torque_Nm)
        if free:
            yield "coupling.damping: 0, and no load.friction: with the motor at rest the load keeps ringing"
    least = 1.0 / design.total_ratio
    loaded = design.load.moment_max_Nm > 0.0
    rigid = design.coupling is None and design.load.path == "self-locking"
    coefficient = design.friction.load_coefficient
    if rigid and loaded and coefficient < least * (1 - 1e-12):
        yield (
            f"friction.load_coefficient: {coefficient:g} is less than 1/N = {least:g}: the friction of a "
            f"self-locking drive cannot hold its load; or is {_DRIVABLE}?"
        )
