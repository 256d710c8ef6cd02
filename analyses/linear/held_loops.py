"""Inner loops that are driven away while the outer loops are open, though the drive as a whole is stable.

A load whose moment grows with its own deflection (a pendulum upright, a fin ahead of its centre of pressure)
moves away by itself, and so does a rotor whose friction falls with the speed. A current loop alone, or a P
velocity loop alone, does not stop that; the loops around them do. Such a loop is unstable in itself and no
fault of the drive: it is judged with the rotor locked (current loop), or with the load's moment held
(velocity loop).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from actuator_lti.design.model import Design
from actuator_lti.drive.angle import pushes_away
from actuator_lti.drive.operating import RotorState
from actuator_lti.loops.assemble import loops_at

if TYPE_CHECKING:
    from actuator_lti.loops import Loop, Loops

HELD = {"current": "rotor locked", "velocity": "load moment held"}
"""How an inner loop is judged that is unstable by itself, by its name."""
OPEN = {"current": "outer loops open and rotor free", "velocity": "outer loops open"}
"""How it stands then."""
AWAY = "the load or falling friction drives it away"


def held_loop(loops: Loops, name: str) -> Loop | None:
    """The inner loop with the rotor locked, or with the load's moment held; ``None`` where there is none."""
    at = loops.operating
    if name not in HELD or name == loops.design.controller.outermost:
        return None
    if not pushes_away(loops.design, at):  # the loop's own fault
        return None
    held = replace(at, rotor="locked") if name == "current" else replace(at, torques_held=True)
    return loops_at(loops.design, held, loops.form, loops.inner_loops).present[name]


def other_loops(loops: Loops, design: Design, *, rotor: RotorState = "free") -> Loops:
    """The loops of another design, or with another rotor, in the same form at the same operating point."""
    at = replace(loops.operating, rotor=rotor, torques_held=False)
    return loops_at(design, at, loops.form, loops.inner_loops)


def by_itself(name: str) -> str:
    """What is said of such a loop.

    Examples
    --------
    >>> by_itself("velocity")
    'with the load moment held; by itself, outer loops open, the load or falling friction drives it away'
    """
    return f"with the {HELD[name]}; by itself, {OPEN[name]}, {AWAY}"
