"""Motion and torque on either side of an elastic coupling, as far as a record and the design tell them."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import schur
from scipy.signal import lfilter

from actuator_lti.design.model import Coupling, Design, LoadFriction
from actuator_lti.systems.sampling import held_step
from actuator_lti.types import Floats
from analyses.identification.joint_model import Recipe
from analyses.records.differentiation import Motion
from analyses.records.record import Record

ROUNDS = 4  # rounds in which the sign of the load's speed and its moment are found from the speed itself
NOISE_SHARE = 0.1  # largest share of the coupling's torque that noise of the output encoder may make


@dataclass(frozen=True, kw_only=True)
class TwoSides:
    """Motor and load of a drive with a coupling."""

    motor: Motion  # at the motor shaft
    load: Motion  # at the coupling's own shaft
    torque: Floats  # what the coupling carries without a moment at the output, ``J_l dW/dt + T_f,load``
    note: str  # where the load's motion comes from
    used: Mapping[str, str] = field(default_factory=dict)  # which signal it takes


def two_sides(
    design: Design, record: Record, place: str, motion: Motion, moment: Floats, recipe: Recipe
) -> TwoSides:
    """Motor's and load's motion of a record, from the motion at the motor as if the coupling were rigid.

    The load turns back at another instant than the motor: its friction and inertia act by its own speed.
    That is taken from the output's encoder where one is recorded whose noise is small; else the load
    follows from the motor's motion and the design's coupling, ``J_l dW/dt = k (th/N_c - phi) + c (w/N_c -
    W) - T_f,load + M/N_r``. Where the output alone is recorded, the motor's motion is that and the twist.
    Play is in what is recorded only. ``moment`` is that at the output, ``place`` the signal of the motion.
    """
    behind, coupling = design.ratio_behind_coupling, design.coupling
    assert coupling is not None
    if place in ("output_angle", "position", "velocity"):
        load = motion.scaled(1.0 / design.ratio_to_coupling)
        torque = _of_load(design, load)
        twist = design.ratio_to_coupling / coupling.stiffness_Nm_rad * (torque - moment / behind)
        extra = recipe.motion(twist, record.period_s)
        motor = Motion(**{name: values + vars(extra)[name] for name, values in vars(motion).items()})
        note = "load's own motion, the motor's by the design's stiffness"
        return TwoSides(motor=motor, load=load, torque=torque, note=note)
    load, note, used = _follows(design, coupling, record, motion, moment), "by the design's coupling", {}
    if (measured := _measured(design, record, load, moment, recipe)) is not None:
        load, note, used = measured, "of the output's encoder", {"output_angle": "load's motion"}
    note = f"load's motion {note}"
    return TwoSides(motor=motion, load=load, torque=_of_load(design, load), note=note, used=used)


def _of_load(design: Design, load: Motion) -> Floats:
    """What the coupling carries without a moment: for inertia and friction behind it."""
    friction = design.load.friction or LoadFriction()
    dry = design.load_side_inertia_kgm2 * load.acceleration + friction.dry_torque_Nm * np.sign(load.velocity)
    return np.asarray(dry + friction.viscous_Nms_rad * load.velocity + friction.offset_torque_Nm)


def _measured(
    design: Design, record: Record, followed: Motion, moment: Floats, recipe: Recipe
) -> Motion | None:
    """The load's motion by the output's encoder; None without one, or where its noise is too large."""
    if "output_angle" not in record.signals:
        return None
    behind, cutoff = design.ratio_behind_coupling, recipe.cutoff_hz
    angle = behind * record["output_angle"]
    made = recipe.motion(angle, record.period_s)
    noise = float(np.std(angle - made.position))
    # white noise of rms s over the Nyquist band leaves s (2 pi f)^2 sqrt(2 f T/5) of acceleration below f
    rough = noise * (2.0 * np.pi * cutoff) ** 2 * np.sqrt(0.4 * cutoff * record.period_s)
    carried = float(np.std(_of_load(design, followed) - moment / behind))
    return made if design.load_side_inertia_kgm2 * rough < NOISE_SHARE * carried else None


def _follows(design: Design, coupling: Coupling, record: Record, motion: Motion, moment: Floats) -> Motion:
    """The load's motion that the motor's makes through the design's coupling, from rest in the twist."""
    friction, inertia = design.load.friction or LoadFriction(), design.load_side_inertia_kgm2
    driver = motion.scaled(1.0 / design.ratio_to_coupling)
    if inertia == 0.0:
        return driver
    k, c = coupling.stiffness_Nm_rad, coupling.damping_Nms_rad
    viscous, dry, offset = friction.viscous_Nms_rad, friction.dry_torque_Nm, friction.offset_torque_Nm
    a = np.array([[0.0, 1.0, 0.0], [-k / inertia, -(c + viscous) / inertia, 1.0 / inertia], [0.0, 0.0, 0.0]])
    step, turned = held_step(a, np.eye(3)[:, 2:] / record.period_s, record.period_s)  # straight between rows
    pull = k * driver.position + c * driver.velocity + moment / design.ratio_behind_coupling - offset
    place, speed = driver.position, driver.velocity
    for _ in range(ROUNDS if dry > 0.0 else 1):
        force = pull - dry * np.sign(speed)
        rest = force[0] - (c + viscous) * speed[0]
        driven = np.outer(step[:2, 2], force[:-1]) + np.outer(turned[:2], np.diff(force))
        place, speed = _recursion(step[:2, :2], np.array([rest / k, speed[0]]), driven)
    rate = (k * (driver.position - place) + c * (driver.velocity - speed) - viscous * speed) / inertia
    rate += (moment / design.ratio_behind_coupling - offset - dry * np.sign(speed)) / inertia
    return Motion(position=place, velocity=speed, acceleration=rate)


def _recursion(A: Floats, start: Floats, driven: Floats) -> Floats:
    """``x_(k+1) = A x_k + driven_k``, shape (states, rows): along the triangular form, state by state."""
    R, U = schur(A, output="complex")
    z = U.conj().T @ np.column_stack((start, driven))
    for j in reversed(range(len(R))):
        z[j, 1:] += R[j, j + 1 :] @ z[j + 1 :, :-1]
        z[j] = lfilter([1.0], [1.0, -R[j, j]], z[j])
    return np.asarray((U @ z).real)
