"""From a design to all of its loops, in the form and at the operating point asked for."""

import copyreg
from functools import partial
from os import PathLike
from typing import Any

from actuator_lti.design.loader import as_design
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating, OperatingPoint, RotorState
from actuator_lti.drive.wiring import wire
from actuator_lti.errors import InputError
from actuator_lti.loops.flow import ALL
from actuator_lti.loops.result import Form, InnerLoops, Loops


def assemble_loops(
    design: Design | str | PathLike[str], form: Form = "sampled", operating_point: OperatingPoint = "sliding",
    load_Nm: float = 0.0, speed_amplitude_rad_s: float | None = None, direction: int = 1,
    rotor: RotorState = "free", inner_loops: InnerLoops = "closed", speed_rad_s: float = 0.0,
    angle_rad: float = 0.0, twist_rad: float = 0.0
) -> Loops:  # fmt: skip
    """All loops of a design as named python-control systems (model.md section 3).

    ``design``: a design, a shipped name, or the path of a design file.
    ``form``: "sampled": exact hold, exact computing delay, PI in z, slower loops held (state spaces with dt);
    "continuous": PI in s and exact delays (`DelaySystem`, no Pade; see `actuator_lti.loops.flow` for which
    loop carries which delay); "ideal": continuous without any delay, the paper's own model.
    ``operating_point``: slope of the friction and contact of the coupling: "sliding", "rest",
    "describing-function", "driving", "driven" or "gap", see `actuator_lti.drive.operating.Operating`.
    ``load_Nm``: load torque at the output shaft: more dry friction.
    ``speed_amplitude_rad_s``: amplitude (peak, motor side) for the describing function.
    ``direction``: direction of motion for asymmetric friction, 1 or -1.
    ``rotor``: "free", or "locked": only the current loop, without back-EMF, so that its closed loop starts at
    0 dB.
    ``inner_loops``: "closed", or "open": `Loops.velocity` and `Loops.position` with the feedback of the loops
    inside them taken away, the inner controllers still in the path. Break points, limiters and the response
    to the command are those of the closed drive in any case.
    ``speed_rad_s``, ``angle_rad``, ``twist_rad``: motor speed at which the slope of a friction map is taken,
    output angle (and twist of the coupling) at which torques that bend with the angle are made linear.

    With the rotor free, back-EMF gives the current loop a finite gain at DC although its controller
    integrates. The motor angle is an integrator that the inner loops do not see; it is no state of them. A
    load torque proportional to the angle acts through a back-drivable path as a stiffness.

    Raises `InputError`: for an unknown form or operating point, or a design without the stage asked for.

    Examples
    --------
    >>> assemble_loops("ilr33-amber")
    Loops(ilr33-amber: current, velocity, position; sampled, sliding, 0 N m, rotor free)
    """
    at = Operating(
        point=operating_point, load_Nm=load_Nm, speed_amplitude_rad_s=speed_amplitude_rad_s,
        direction=direction, rotor=rotor, speed_rad_s=speed_rad_s, angle_rad=angle_rad, twist_rad=twist_rad,
    )  # fmt: skip
    return loops_at(as_design(design), at, form, inner_loops)


def loops_at(
    design: Design, at: Operating, form: Form = "sampled", inner_loops: InnerLoops = "closed"
) -> Loops:
    wired = wire(design, at)
    if not wired.stages and at.rotor == "locked":
        raise InputError("rotor = 'locked': the design has no current loop")
    time: Any  # the module of the algebra of time, and what each of its functions takes besides the drive
    more: tuple[frozenset[str], ...] = ()
    if form == "sampled":
        from actuator_lti.loops import sampled as time
    else:
        from actuator_lti.loops import continuous as time

        more = (ALL if form == "continuous" else frozenset(),)
    opened = {stage: wired.inside(stage) if inner_loops == "open" else () for stage in wired.stages}
    stages = {stage: time.loop(wired, stage, *more, opened[stage]) for stage in wired.stages}
    whole, sampled_form = at.rotor == "free", form == "sampled"
    return Loops(
        design=design, form=form, operating=at, inner_loops=inner_loops, current=stages.get("current"),
        velocity=stages.get("velocity"), position=stages.get("position"),
        break_points={point: time.loop(wired, point, *more) for point in wired.points},
        limiters=time.limiters(wired, *more) if whole else {},
        plain_response=time.reference_to_output(wired, *more) if whole else None,
        load_torque_system=partial(time.load_torque_to_output, wired, *more) if whole else None,
        tick_system=time.tick_system(wired) if whole and sampled_form else None,
        period_s=wired.tick_s if sampled_form else None
    )  # fmt: skip


# sent to a worker as what it is made of
copyreg.pickle(Loops, lambda it: (loops_at, (it.design, it.operating, it.form, it.inner_loops)))
