"""What a coupling, the load behind it and a self-locking stage ask of each other (model.md section 6)."""

from __future__ import annotations

from collections.abc import Iterator

from actuator_lti.design.mistakes import Refusal
from actuator_lti.design.model import Coupling, Design
from actuator_lti.files.reading import shown


def check_place(design: Design) -> Iterator[Refusal]:
    """Refuse names of gears that are none; whatever asks for an inertia needs the coupling's place."""
    after = None if design.coupling is None else design.coupling.after
    names = [gear.name for gear in design.gears]
    for key, name in (("coupling.after", after), ("load.locking_gear", design.load.locking_gear)):
        if name is not None and name not in names:
            known = ", ".join(names) or "none, as there are no gears; leave it out"
            yield key, shown(name), f"is no gear; allowed: {known}"


def check_elastic(design: Design) -> Iterator[Refusal]:
    """Refuse a drive train that the event-driven plant cannot be.

    A coupling or play without an inertia behind it, with the tanh law, or before the self-locking stage; a
    self-locking stage whose friction would give energy; friction of a load that has no coupling before it.
    """
    coupling, friction = design.coupling, design.load.friction
    if friction is not None and coupling is None:
        yield "load.friction", "a table", "allowed behind a coupling; a rigid drive has friction alone"
    if coupling is None:
        return
    if design.load_side_inertia_kgm2 <= 0.0:
        allowed = "allowed with an inertia behind it; load.inertia, or that of a gear behind it, is missing"
        yield "coupling.stiffness", f"{coupling.stiffness_Nm_rad:g}", allowed
    yield from _bends(coupling)
    if design.friction.law == "tanh":
        yield "friction.law", '"tanh"', 'allowed with a coupling: "coulomb"'
    names, locking = [gear.name for gear in design.gears], design.load.locking_gear
    locks = names.index(locking) + 1 if locking else len(names)
    if design.load.path != "self-locking":
        if locking is not None:
            yield "load.locking_gear", f'"{locking}"', 'allowed with load.path = "self-locking"'
        return
    least, coefficient = 1.0 / design.total_ratio, design.friction.load_coefficient
    if design.gears_before_coupling < locks:
        allowed = (
            f"lies before the self-locking stage; allowed: {', '.join(names[locks - 1 :])}, "
            "load.locking_gear with a gear before the coupling, or load.path = back-drivable"
        )
        yield "coupling.after", f'"{coupling.after or ""}"', allowed
    elif coefficient < least * (1 - 1e-12):
        allowed = f"a self-locking stage with less than 1/N gives energy; allowed: at least {least:g}"
        yield "friction.load_coefficient", f"{coefficient:g}", allowed


def _bends(coupling: Coupling) -> Iterator[Refusal]:
    """Torques and stiffnesses of a spring that bends: each with its other, in order."""
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
            "self-locking drive cannot hold its load"
        )
