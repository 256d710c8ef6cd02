"""What of a drive no single linear loop describes, beside its limits."""

from __future__ import annotations

from math import inf

from actuator_lti.design.model import Design


def nonlinear_parts(design: Design) -> list[str]:
    """What a motion about rest meets that no linear loop holds, in words."""
    friction, load, place = design.friction, design.load, design.controller.position
    behind, coupling, profile = load.friction, design.coupling, design.command
    there = {
        "dry friction": friction.dry_Nm(0.0) > 0.0,
        "friction map": bool(friction.points),
        "offset torque": friction.offset_torque_Nm != 0.0,
        "viscous friction that differs by direction": friction.viscous(1) != friction.viscous(-1),
        "friction of the load": behind is not None
        and (behind.dry_torque_Nm, behind.offset_torque_Nm) != (0, 0),
        "friction of the coupling's torque": coupling is not None and friction.load_coefficient > 0.0,
        "friction of the load's moment": friction.load_coefficient > 0.0 and bool(load.acting()),
        "play": coupling is not None and coupling.play_rad > 0.0,
        "gravity": load.gravity is not None,
        "profile of the command": min(profile.rate_rad_s, profile.acceleration_rad_s2) < inf,
        "friction feed-forward": place is not None and place.friction_feedforward != 0.0,
        "counts of an encoder": not (design.angle_quantum_rad is None and design.output_quantum_rad is None),
        "noise of the instruments": not design.instruments.ideal,
    }
    return [word for word, yes in there.items() if yes]
