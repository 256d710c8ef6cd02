"""Two-mass drives for the tests, and the event-driven plant under prescribed voltages and moments."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_lti.design import model
from nonlinear._kernels import elastic_layout as at
from nonlinear._kernels import layout
from nonlinear.native import parameters, tick
from nonlinear.row.parameters import design_row
from tests.changed import changed
from tests.loops.loop_designs import MOTOR, drive_d

SOURCE = model.Motor(rotor_inertia_kgm2=2e-5, source_gain_Nm_V=1.0)


def drive_f() -> model.Design:
    """Drive F of the reference numbers: coupling with play and damping, three loops, limits."""
    return drive_d(
        load=model.Load(inertia_kgm2=1e-3, path="back-drivable"),
        friction=model.Friction(viscous_Nms_rad=1e-4),
        coupling=model.Coupling(stiffness_Nm_rad=200.0, damping_Nms_rad=0.02, play_rad=0.02),
        controller=model.Controller(
            period_s=2e-4,
            computing_delay_s=2e-4,
            position=model.PositionLoop(gain=20.0, every=2),
            velocity=model.VelocityLoop(gain=0.08, integral_time_s=0.03),
            current=model.CurrentLoop(gain_V_A=0.8, integral_time_s=2e-3),
        ),
        limits=model.Limits(voltage_V=24.0, speed_rad_s=300.0, peak_current_A=15.0),
        validation=model.Validation(full_deflection_rad=0.1),
    )


def two_mass(
    period_s: float = 2e-4, *, source: bool = False, path: Any = "back-drivable", **parts: Any
) -> model.Design:
    """Drive F with other parts: ``coupling``, ``friction``, ``load_friction`` as dicts of their fields."""
    design = drive_f()
    friction = model.LoadFriction(**parts["load_friction"]) if "load_friction" in parts else None
    control = {"period_s": period_s, "computing_delay_s": 0.0} | ({"current": None} if source else {})
    return changed(
        design,
        motor=SOURCE if source else design.motor,
        load={"path": path, "friction": friction, "inertia_kgm2": parts.get("J_l", 1e-3)},
        friction=model.Friction(**parts.get("friction", {})),
        coupling=parts.get("coupling", {}),
        controller=control,
        gears=(model.Gear(name="g", ratio=parts.get("ratio", 10.0)), *parts.get("behind", ())),
    )


def stribeck(*points: tuple[float, float], direction: Any = "both") -> tuple[model.FrictionPoint, ...]:
    return tuple(model.FrictionPoint(speed_rad_s=v, torque_Nm=T, direction=direction) for v, T in points)


@dataclass
class Run:
    """States (i, w, W, th, phi) and balances at the ticks, events in each, how it ended."""

    states: np.ndarray
    balances: np.ndarray
    events: list[int]
    status: int


PLACES = (layout.S_CURRENT, layout.S_SPEED, at.ES_LOAD_SPEED, layout.S_ANGLE)


def open_drive(
    design: model.Design, start: tuple[float, ...], fraction_s: float, **options: float
) -> np.ndarray:
    """Row of a design whose voltage is the command; ``start`` is (i, w, W, th, phi)."""
    row = design_row(design)
    row[[layout.HAS_POSITION, layout.HAS_VELOCITY, layout.HAS_CURRENT]] = 0.0
    row[[layout.VOLTAGE_LIMIT, layout.CURRENT_LIMIT]] = np.inf
    row[layout.DELAY_TICKS], row[layout.DELAY_FRACTION] = 0, fraction_s
    i, w, W, th, phi = start
    row[layout.CURRENT_START], row[layout.SPEED_START], row[layout.ANGLE_START] = i, w, th
    row[layout.LOAD_SPEED_START] = W
    row[layout.TWIST_START] = th / design.ratio_to_coupling - phi if design.coupling is not None else 0.0
    row[layout.LOAD_TABLE_LENGTH] = 1.0  # the moment changes from tick to tick
    for name, value in options.items():
        row[getattr(layout, name)] = value
    return row


def run_plant(
    design: model.Design,
    voltages: np.ndarray,
    moments: np.ndarray | float = 0.0,
    start: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0),
    fraction_s: float = 0.0,
    **options: float,
) -> Run:
    """The tick under prescribed voltages (the one before acts over the first ``fraction_s`` of a tick)."""
    p, s = parameters(open_drive(design, start, fraction_s, **options))
    io, count = np.zeros(layout.IO_SIZE), voltages.size
    moment = np.broadcast_to(moments, voltages.shape)
    states, balances = np.empty((count + 1, 5)), np.empty((count + 1, layout.ENERGY_SIZE))
    events, status = [], layout.OK
    for k in range(count + 1):
        states[k, :4], states[k, 4] = s[list(PLACES)], s[layout.S_OUTPUT] * design.ratio_behind_coupling
        balances[k] = s[layout.S_ENERGY : layout.S_ENERGY + layout.ENERGY_SIZE]
        io[layout.IN_COMMAND], io[layout.IN_LOAD] = (voltages[k], moment[k]) if k < count else (0.0, 0.0)
        before = s[layout.S_EVENTS]
        status = tick(p, s, io)
        if status != layout.OK:
            break
        events.append(int(s[layout.S_EVENTS] - before))
    return Run(states, balances, events[:count], status)


def power_of_ten(rng: np.random.Generator, low: float, high: float) -> float:
    return float(10.0 ** rng.uniform(low, high))


def random_drive(seed: int) -> tuple[model.Design, np.ndarray, np.ndarray, float]:
    """A random drive train with voltages, moments and the fraction of the delay; every part may be absent."""
    rng = np.random.default_rng(seed)
    N, J_m, torque = power_of_ten(rng, 0, 2), MOTOR.rotor_inertia_kgm2, 0.2
    J_l = N * N * J_m * power_of_ten(rng, -1.5, 1.5)
    resonance, source = power_of_ten(rng, 1.5, 3.5), rng.random() < 0.25
    k = resonance**2 * J_l / (1 + J_l / (N * N * J_m))
    locking, behind = rng.random() < 0.3, rng.random() < 0.4
    gears = (model.Gear(name="b", ratio=power_of_ten(rng, 0, 1)),) if behind else ()
    N_r = gears[0].ratio if behind else 1.0
    CM = power_of_ten(rng, 0.02, 0.5) / N if locking else rng.choice([0.0, power_of_ten(rng, -1.5, -0.3) / N])
    friction: dict[str, Any] = {
        "load_coefficient": CM / N_r,
        "breakaway_ratio": rng.choice([1.0, rng.uniform(1, 2)]),
        "offset_torque_Nm": rng.choice([0.0, torque * rng.uniform(-0.1, 0.1)]),
        "dry_torque_Nm": torque * rng.uniform(0.02, 0.4),
        "dry_torque_reverse_Nm": torque * rng.uniform(0.02, 0.4),
        "viscous_Nms_rad": power_of_ten(rng, -6, -4),
        "viscous_reverse_Nms_rad": power_of_ten(rng, -6, -4),
    }
    mapped = {"points": stribeck((0.0, 0.08), (power_of_ten(rng, -1, 1), 0.02), (100.0, 0.06))}
    friction = friction | (mapped if rng.random() < 0.3 else {})
    play = rng.choice([0.0, power_of_ten(rng, -2, 0.5) * N * torque / k])
    damping = rng.choice([0.0, power_of_ten(rng, -2.5, 0.3) * k / resonance])
    load_friction = {
        "dry_torque_Nm": rng.choice([0.0, N * torque * power_of_ten(rng, -2, -0.3)]),
        "viscous_Nms_rad": power_of_ten(rng, -2, 0) * J_l,
        "breakaway_ratio": rng.uniform(1, 1.6),
        "offset_torque_Nm": N * torque * rng.uniform(-0.1, 0.1),
    }
    Ts = power_of_ten(rng, -4.3, -2.3)
    bent, bends = np.random.default_rng([seed, 1]), {}  # of its own, so that the rest stays as it is
    for number in range(int(bent.integers(3))):
        bends[f"torque_{number + 1}_Nm"] = N * torque * power_of_ten(bent, number - 2.0, number - 1.0)
        bends[f"stiffness_{number + 2}_Nm_rad"] = k * power_of_ten(bent, -0.4, 0.6)
    design = two_mass(
        Ts, source=bool(source), path="self-locking" if locking else "back-drivable", friction=friction,
        ratio=N, behind=gears, J_l=J_l * N_r**2, load_friction=load_friction,
        coupling={"stiffness_Nm_rad": k, "damping_Nms_rad": damping, "play_rad": play, **bends},
    )  # fmt: skip
    voltages = np.repeat(rng.normal(size=8) * (torque if source else 4.0), 3)
    return design, voltages, 0.3 * N * N_r * torque * rng.normal(size=24), float(rng.choice([0.0, 0.4])) * Ts
