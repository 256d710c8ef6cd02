"""Friction, breakaway, play and inertia of a drive's mechanics, each confronted by one tick.

An ideal source of torque stands in place of motor and controllers. From the predicted steady state speeds
stay over a tick, or show what is missing: ``T = T_predicted - J (w_1 - w_0)/Ts``. Thresholds are bisected.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise, product
from math import copysign, isfinite, tanh

import numpy as np

from actuator_lti.design.model import Command, Controller, Design, Instruments, Limits, Motor
from actuator_lti.design.plant import reachable_speed
from actuator_lti.drive.facts import stall_torque_Nm
from actuator_lti.drive.operating import dry_torque
from actuator_lti.systems.root import root
from analyses.validation.row import WITHIN, Row, judged
from nonlinear.bench.operating_motion import OperatingMotion, operating_motion_at
from nonlinear.rows import Rows
from nonlinear.runs.running import Running

EXACT = 1e-9  # of an inertia; of the largest torque that takes part in a balance
ULPS = 64.0  # of a speed, a twist: what the transition of a tick rounds to
SHARE = 0.1  # of the full torque: a load where none is named
FAST, SLOW = 0.4, 1e-3  # of the largest speed; of that
BESIDE = 1e-7  # of a threshold: where it is looked for first
FAR = 4.0  # times a threshold: where it is looked for then


def torque_rows(design: Design, model: Design) -> Iterator[Row]:
    yield from _inertias(design, model)
    rows = Rows.of(mechanics(design))
    for direction, load in product((1, -1), loads_of(design)):
        for speed in speeds_of(design, direction):
            yield from _at_speed(rows, design, model, direction * speed, load)
    if design.friction.law == "coulomb":
        yield from _breakaways(design, model)
    if design.coupling is not None and model.coupling is not None:
        yield from _load_breakaways(design, model)
        yield from _play(design, model)


def mechanics(design: Design) -> Design:
    """A drive whose command is the torque at the motor shaft."""
    return replace(
        design, motor=Motor(rotor_inertia_kgm2=design.motor.rotor_inertia_kgm2, source_gain_Nm_V=1.0),
        controller=Controller(period_s=design.controller.period_s, computing_delay_s=0.0),
        limits=Limits(voltage_V=float("inf")), command=Command(), supply=None, instruments=Instruments(),
        encoder=replace(design.encoder, counts_per_rev=None, speed="ideal"),
    )  # fmt: skip


def edge(passed: Callable[[float], bool], predicted: float, beside: float, far: float) -> float | None:
    """Where ``passed`` turns true on the way out from ``predicted - beside`` to ``far``; None: nowhere."""
    near, out = predicted - beside, predicted + beside
    if passed(near) or not passed(out):
        near, out = 2.0 * predicted - far, far
        if passed(near) or not passed(out):
            return None
    return root(lambda x: passed(x) - 0.5, near, out, 1e-13 * max(abs(near), abs(out)))


def loads_of(design: Design) -> tuple[float, ...]:
    """No load, and every named one with either sign; where none is, a share of the full torque."""
    named = [abs(load) for load in (*design.validation.loads_Nm, design.load.moment_max_Nm) if load]
    if not named:
        full = stall_torque_Nm(design) * design.total_ratio
        named = [SHARE * full if isfinite(full) else 1.0]
    return tuple(sorted({0.0, *named, *(-load for load in named)}))


def _inertias(design: Design, model: Design) -> Iterator[Row]:
    """What a torque accelerates, without friction and with the coupling in its gap."""
    rows = Rows.of(replace(mechanics(design), load=design.load.bare()), friction_on=False)
    rows["viscous"] = rows["viscous_reverse"] = rows["load_viscous"] = 0.0
    rows["coupling_damping"], rows["half_play"] = 0.0, 1e9
    torque = design.inertia_kgm2
    rows["load"] = design.load_side_inertia_kgm2 * design.ratio_behind_coupling if design.coupling else 0.0
    drive = rows.running().begin(torque)
    Ts = design.controller.period_s
    unit, push = ("kg", "force") if design.axis == "linear" else ("kg*m^2", "torque")
    pairs = [("inertia", model.inertia_kgm2, torque * Ts / drive.value("SPEED"))]
    if design.coupling is not None:
        behind = design.load_side_inertia_kgm2 * Ts / drive.value("LOAD_SPEED")
        pairs = [
            ("motor_side_inertia", model.motor_side_inertia_kgm2, pairs[0][2]),
            ("load_side_inertia", model.load_side_inertia_kgm2, behind),
        ]
    for name, predicted, found in pairs:
        yield judged(name, "drive", predicted, found, EXACT * predicted, unit=unit,
                     condition=f"a known {push} over one tick, without friction")  # fmt: skip


def speeds_of(design: Design, direction: int) -> list[float]:
    """Speeds at which friction is read: fast, slow, one in each piece of a map, where a tanh bends."""
    top = reachable_speed(design)
    fast = FAST * top if isfinite(top) else 1.0
    points = [point.speed_rad_s for point in design.friction.map(direction)]
    if points:
        return [*(0.5 * (a + b) for a, b in pairwise(points)), 1.5 * points[-1] or fast]
    bent = [design.friction.smoothing_speed_rad_s] if design.friction.law == "tanh" else []
    return [fast, SLOW * fast, *bent]


def _predicted(model: Design, speed_rad_s: float, load_Nm: float) -> tuple[float, float, OperatingMotion]:
    """Torque, the largest that takes part, motion: the steady state of ``model``, the output at zero."""
    moment = load_Nm + float(model.load.moment_Nm(0.0))
    motion = operating_motion_at(mechanics(model), speed_rad_s, moment)
    torque, friction = motion.voltage_V, model.friction
    sense = int(copysign(1.0, speed_rad_s))
    damped = model.load.moment_damping_Nms_rad * speed_rad_s / model.total_ratio
    if friction.law == "tanh":
        smooth = tanh(abs(speed_rad_s) / friction.smoothing_speed_rad_s)
        torque -= sense * (1.0 - smooth) * float(dry_torque(model, moment - damped, sense))
    parts = (torque, moment / model.total_ratio, damped / model.total_ratio, friction.offset_torque_Nm,
             motion.coupling_Nm / model.ratio_to_coupling)  # fmt: skip
    return torque, max(map(abs, parts)), motion


def _at_speed(rows: Rows, design: Design, model: Design, speed: float, load: float) -> Iterator[Row]:
    """Torques that a constant speed takes, at motor and coupling, by one tick from the steady state."""
    torque, largest, motion = _predicted(model, speed, load)
    Ts, N_c = design.controller.period_s, design.ratio_to_coupling
    elastic = design.coupling is not None
    rows["load"], rows["speed_start"], rows["load_speed_start"] = load, speed, speed / N_c
    rows["twist_start"], rows["angle_start"] = motion.twist_rad, N_c * motion.twist_rad
    drive = rows.running().begin(torque)
    unit = design.load_unit
    condition = f"at {speed:.4g} {'m/s' if unit == 'N' else 'rad/s'} under {load:g} {unit}"
    J = design.motor_side_inertia_kgm2 if elastic else design.inertia_kgm2
    unbalanced = max(1.0, Ts / J)  # the exponential of a tick is scaled by its largest entry
    floor, behind = ULPS * J * unbalanced * float(np.spacing(abs(speed))) / Ts + _weight_rounding(model), 0.0
    if design.coupling is not None:
        W, coupling = abs(speed) / N_c, design.coupling
        stretch, ulp = float(np.spacing(max(abs(motion.twist_rad), Ts * W))), float(np.spacing(W))
        behind = coupling.stiffness_at(motion.twist_rad) * stretch + coupling.damping_Nms_rad * ulp
        behind = ULPS * (behind + design.load_side_inertia_kgm2 * ulp / Ts)
        floor += behind / N_c
    found = torque - J * (drive.value("SPEED") - speed) / Ts
    allowed = WITHIN * abs(torque) + EXACT * largest + floor
    words = f"rounding of the speed is worth {floor:.1e} {unit}"
    yield judged("steady_torque", "drive", torque, found, allowed, unit=unit, because=words,
                 condition=condition)  # fmt: skip
    if not elastic:
        return
    slowed = design.load_side_inertia_kgm2 * (drive.value("LOAD_SPEED") - speed / N_c) / Ts
    allowed = WITHIN * abs(motion.coupling_Nm) + EXACT * N_c * largest + behind
    yield judged("coupling_torque", "drive", motion.coupling_Nm, motion.coupling_Nm - slowed, allowed,
                 unit=unit, because=words, condition=condition)  # fmt: skip


def _at_rest(model: Design, load: float) -> tuple[float, float, float, float]:
    """What a standing drive predicts: twist, torque that balances, motor friction forward and backward."""
    moment, friction = load + float(model.load.moment_Nm(0.0)), model.friction
    passed = 1.0 if model.load.path == "back-drivable" else 0.0
    twist, pushed = 0.0, -passed * moment / model.total_ratio
    if model.coupling is not None:
        behind = model.load.friction
        T_s = -moment / model.ratio_behind_coupling + (behind.offset_torque_Nm if behind else 0.0)
        twist = model.coupling.twist_rad(T_s)
        pushed, moment = passed * T_s / model.ratio_to_coupling, T_s * model.ratio_behind_coupling
    held = [float(dry_torque(model, moment, side)) * friction.breakaway_ratio for side in (1, -1)]
    return twist, pushed + friction.offset_torque_Nm, held[0], held[1]


def _breakaways(design: Design, model: Design) -> Iterator[Row]:
    """Torques at which the standing motor starts, under every load, forward and backward."""
    rows, unit = Rows.of(mechanics(design)), design.load_unit
    for load in loads_of(design):
        twist, middle, ahead, back = _at_rest(model, load)
        if ahead + back <= 2.0 * _weight_rounding(model):
            continue
        span = max(ahead, back)  # one of them may be none
        rows["load"], rows["twist_start"] = load, twist
        rows["angle_start"], rows["voltage_start"] = design.ratio_to_coupling * twist, middle
        drive = rows.running()
        for side, held in ((1, ahead), (-1, back)):
            wanted = middle + side * held

            def moves(torque: float, drive: Running = drive, side: int = side) -> bool:
                drive.begin(torque)
                turned = drive.value("ANGLE") - drive.start_value("ANGLE")  # it may stand again by now
                return drive.value("SPEED") * side > 0.0 or turned * side > 0.0

            found = edge(moves, wanted, side * BESIDE * span, wanted + side * 0.5 * span)
            allowed = WITHIN * held + EXACT * (abs(middle) + span) + _weight_rounding(model)
            allowed += _spring_rounding(model, twist)
            yield judged("breakaway_torque", "drive", wanted, found, allowed, unit=unit,
                         condition=f"at rest under {load:g} {unit}, {WAYS[side]}")  # fmt: skip


def _weight_rounding(model: Design) -> float:
    """What a unit in the last place of the load's angle makes of its weight, at the motor."""
    gravity, N = model.load.gravity, model.total_ratio
    peak = 0.0 if gravity is None else gravity.peak_Nm
    return ULPS * float(np.spacing(peak)) * (model.friction.load_coefficient + 1.0 / N)


def _spring_rounding(model: Design, twist_rad: float) -> float:
    """What a unit in the last place of the twist makes of friction and reaction at the motor."""
    if model.coupling is None:
        return 0.0
    share = 1.0 / model.ratio_to_coupling + model.friction.load_coefficient * model.ratio_behind_coupling
    return ULPS * model.coupling.stiffness_at(twist_rad) * float(np.spacing(abs(twist_rad))) * share


WAYS = {1: "forward", -1: "backward"}


def _load_breakaways(design: Design, model: Design) -> Iterator[Row]:
    """Moments at which the standing load starts, the coupling without torque."""
    behind = model.load.friction
    held = 0.0 if behind is None else behind.dry_torque_Nm * behind.breakaway_ratio
    if behind is None or held == 0.0:
        return
    rows = Rows.of(mechanics(design))
    rows["voltage_start"] = design.friction.offset_torque_Nm
    drive = rows.running()
    drive.command(design.friction.offset_torque_Nm)
    own, N_r = float(model.load.moment_Nm(0.0)), model.ratio_behind_coupling
    for side in (1, -1):
        wanted = N_r * (behind.offset_torque_Nm + side * held) - own

        def moves(moment: float, side: int = side) -> bool:
            drive.change("load", moment)
            drive.begin(LOAD=moment)
            return drive.value("LOAD_SPEED") * side > 0.0 or drive.value("LOAD_ANGLE") * side > 0.0

        found = edge(moves, wanted, side * BESIDE * N_r * held, wanted + side * 0.5 * N_r * held)
        allowed = N_r * (WITHIN * held + EXACT * abs(behind.offset_torque_Nm)) + EXACT * abs(own)
        yield judged("load_breakaway_moment", "drive", wanted, found, allowed, unit=design.load_unit,
                     condition=f"load at rest, {WAYS[side]}")  # fmt: skip


def _play(design: Design, model: Design) -> Iterator[Row]:
    """The twist at which the coupling is met, on either side."""
    assert design.coupling is not None
    assert model.coupling is not None
    wanted = 0.5 * model.coupling.play_rad
    if not design.coupling.play_rad and not wanted:
        return
    rows = Rows.of(mechanics(design))
    for side in (1, -1):

        def meets(twist: float, side: int = side) -> bool:
            rows["twist_start"] = side * twist
            return rows.running().value("CONTACT") == side

        found = edge(meets, wanted, BESIDE * wanted, FAR * wanted)
        yield judged("half_play", "drive", wanted, found, WITHIN * wanted,
                     unit="m" if design.axis == "linear" else "rad",
                     condition=f"contact on the {WAYS[side]} side")  # fmt: skip
