"""Parameters of the event-driven plant (model.md section 6): coupling, load-side friction, friction map."""

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from nonlinear._kernels import layout as at


def is_elastic(design: Design) -> bool:
    """Whether a design needs the event-driven plant: a coupling or a friction map."""
    return design.coupling is not None or bool(design.friction.points)


def put_drive_train(design: Design, row: Floats, *, friction_on: bool = True) -> None:
    """Write coupling, load side and friction map into a row that holds motor and friction already.

    ``friction_on = False`` leaves out dry friction and offset of the load, and the whole friction map; the
    viscous friction stays, so that the plant in contact is linear.

    Raises `InputError`: for the tanh law, a breakaway ratio below 1, or too many points of a friction map.
    """
    if not is_elastic(design):
        return
    row[at.ELASTIC_DRIVE] = 1.0
    if design.friction.law == "tanh":
        raise InputError('friction.law = "tanh": not with a coupling or a friction map', where=design.name)
    _coupling(design, row)
    if friction_on:
        _friction_map(design, row)
    _load_friction(design, row, friction_on)


def _coupling(design: Design, row: Floats) -> None:
    coupling = design.coupling
    row[at.RATIO_TO_COUPLING] = design.ratio_to_coupling
    if coupling is None:
        row[at.RIGID], row[at.LOAD_INERTIA], row[at.STIFFNESS] = 1.0, 1.0, 1.0
        row[at.MOTOR_INERTIA] = design.inertia_kgm2
        return
    row[at.MOTOR_INERTIA] = design.motor_side_inertia_kgm2
    row[at.LOAD_INERTIA] = design.load_side_inertia_kgm2
    row[at.STIFFNESS], row[at.COUPLING_DAMPING] = coupling.stiffness_Nm_rad, coupling.damping_Nms_rad
    row[at.HALF_PLAY] = 0.5 * coupling.play_rad
    for k, (torque, stiffness) in enumerate(coupling.bends):
        row[at.BEND_TORQUE + 2 * k], row[at.BEND_STIFFNESS + 2 * k] = torque or 0.0, stiffness or 0.0


def _friction_map(design: Design, row: Floats) -> None:
    for side, direction in enumerate((1, -1)):
        points = design.friction.map(direction)
        if len(points) > at.MAX_POINTS:
            message = f"friction.map: {len(points)} points on one side; allowed: at most {at.MAX_POINTS}"
            raise InputError(message, where=design.name)
        row[at.MAP_COUNT + side] = len(points)
        place = at.MAP + side * 2 * at.MAX_POINTS
        for j, point in enumerate(points):
            row[place + 2 * j], row[place + 2 * j + 1] = point.speed_rad_s, point.torque_Nm


def _load_friction(design: Design, row: Floats, friction_on: bool) -> None:
    friction = design.load.friction
    row[at.LOAD_BREAKAWAY] = 1.0
    if friction is None or design.coupling is None:
        return
    if friction.breakaway_ratio < 1.0:
        message = f"load.friction.breakaway_ratio = {friction.breakaway_ratio}: must be at least 1"
        raise InputError(message, where=design.name)
    row[at.LOAD_VISCOUS], row[at.LOAD_BREAKAWAY] = friction.viscous_Nms_rad, friction.breakaway_ratio
    if friction_on:
        row[at.LOAD_DRY], row[at.LOAD_OFFSET] = friction.dry_torque_Nm, friction.offset_torque_Nm
