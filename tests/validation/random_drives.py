"""Random drives over decades: what loops, validator and running drive are tried on."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import count as counter
from itertools import islice
from math import inf, pi, prod
from typing import Any, TypeVar

import numpy as np

from actuator_lti import InputError, NumericalError, assemble_loops, stability_margins
from actuator_lti.design import check_design, model
from tests.changed import changed

DAMPED = 80_000  # seeds from here on have damping of the load as well
T = TypeVar("T")
Parts = dict[str, Any]  # of a design, as `changed` takes them


class Dice:
    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def decades(self, low: float, high: float) -> float:
        """Evenly on a logarithmic scale."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def one_of(self, *values: T) -> T:
        return values[int(self.rng.integers(len(values)))]


def full_torque(design: model.Design) -> float:
    """What the motor reaches at its limits, at standstill."""
    motor, limits = design.motor, design.limits
    return motor.torque_constant_Nm_A * min(limits.peak_current_A, limits.voltage_V / motor.resistance_ohm)


def _rigid_drive(dice: Dice, seed: int) -> model.Design:
    period = dice.decades(2e-6 if dice.chance(0.1) else 2e-5, 1e-3)
    delay = period * dice.one_of(0.0, 0.5, 1.0, 1.0, 2.0, 3.0)
    axis = dice.one_of("rotary", "rotary", "rotary", "linear")
    motor, inertia, gears, load = _plant(dice, period + delay, axis)
    control = _controller(dice, motor, inertia, period, delay, dice.chance(0.7), dice.chance(0.85))
    limits, ratio = _limits(dice, motor, control), prod(gear.ratio for gear in gears)
    speed = min(limits.speed_rad_s, limits.voltage_V / motor.back_emf_constant_Vs_rad)
    slower = 1.0 if control.velocity else 3.0
    full = dice.decades(0.03, 3.0) * speed / (ratio * control.position_loop.gain * slower)
    design = model.Design(
        name=f"random-{seed}", title=f"Random drive {seed}", motor=motor, gears=gears, load=load, axis=axis,
        controller=control, limits=limits,
        validation=model.Validation(full_deflection_rad=full if full > 0.0 else 0.1),
    )  # fmt: skip
    torque = full_torque(design)
    design = replace(design, friction=_friction(dice, torque, speed), encoder=_encoder(dice, control, axis))
    if not dice.chance(0.2):
        return design
    slope = -dice.decades(0.01, 1.0) * torque * ratio / design.validation.full_deflection_rad
    return changed(design, load={"path": "back-drivable", "moment_slope_Nm_rad": slope})


def _plant(dice: Dice, delay: float, axis: str):
    R, k = dice.decades(0.05, 50.0), dice.decades(0.005, 2.0) * (20.0 if axis == "linear" else 1.0)
    L = R * delay * dice.decades(2.0, 60.0)
    inertia = dice.decades(1.0, 300.0) * (L / R) * k**2 / R
    if axis == "linear" and dice.chance(0.3):
        inertia = dice.decades(1.0, 150.0)
    share = dice.rng.uniform(0.05, 0.9)
    ratios = [dice.decades(2.0, 15.0) for _ in range(dice.one_of(0, 0, 1, 2, 3))]
    gears = tuple(model.Gear(name=f"g{n}", ratio=ratio) for n, ratio in enumerate(ratios))
    motor = model.Motor(
        rotor_inertia_kgm2=inertia * (1.0 - share), resistance_ohm=R, inductance_H=L,
        torque_constant_Nm_A=k, back_emf_constant_Vs_rad=k,
    )  # fmt: skip
    return motor, inertia, gears, model.Load(inertia_kgm2=inertia * share * prod(ratios) ** 2)


def _controller(dice, motor, inertia, period, delay, current, velocity) -> model.Controller:
    """A cascade whose crossovers are fractions of each other."""
    R, L, k = motor.resistance_ohm, motor.inductance_H, motor.torque_constant_Nm_A
    inner = dice.rng.uniform(0.1, 0.5) / (period + delay)
    currents = velocities = None
    if current:
        integral = None if dice.chance(0.1) else (L / R) * dice.decades(0.5, 3.0)
        currents = model.CurrentLoop(gain_V_A=L * inner, integral_time_s=integral)
    else:
        inner = min(inner, R / L)
    per_unit = inertia / k * (1.0 if current else R)
    n_v = dice.one_of(1, 1, 2, 5, 10)
    wv = min(inner / dice.decades(2.0, 20.0), dice.rng.uniform(0.1, 0.5) / (n_v * period))
    if velocity:
        integral = None if dice.chance(0.2) else dice.decades(2.0, 30.0) / wv
        velocities = model.VelocityLoop(gain=per_unit * wv, integral_time_s=integral, every=n_v)
        n_p = n_v * dice.one_of(1, 1, 2, 5)
        gain = min(wv / dice.decades(2.5, 20.0), 0.4 / (n_p * period))
        position = model.PositionLoop(gain=gain, every=n_p, feedforward=dice.one_of(0.0, 0.0, 1.0, 0.5))
    elif current:
        wp = wv / dice.decades(3.0, 10.0)
        position = model.PositionLoop(gain=per_unit * wp**2 / 2.0, every=n_v, derivative_time_s=2.0 / wp)
    else:
        slow = min(k**2 / (R * inertia), R / L)
        position = model.PositionLoop(gain=k * slow / dice.decades(2.5, 20.0), every=n_v)
    stages = {"position": position, "velocity": velocities, "current": currents}
    return model.Controller(period_s=period, computing_delay_s=delay, **stages)


def _limits(dice: Dice, motor: model.Motor, control: model.Controller) -> model.Limits:
    """Tight, loose, or hardly any."""
    volts = dice.decades(3.0, 600.0)
    short, fastest = volts / motor.resistance_ohm, volts / motor.back_emf_constant_Vs_rad
    speed = fastest * dice.rng.uniform(0.2, 1.0) if control.velocity and dice.chance(0.7) else inf
    limits = {"voltage_V": volts, "speed_rad_s": speed}
    if control.velocity is not None and dice.chance(0.3):
        limits["acceleration_rad_s2"] = fastest * control.position_loop.gain * dice.decades(0.3, 30.0)
    if control.current is not None and dice.chance(0.8):
        limits["peak_current_A"] = short * dice.decades(0.05, 1.0)
    return model.Limits(**limits)


def _friction(dice: Dice, torque: float, speed: float) -> model.Friction:
    """None, viscous, dry of either law."""
    if dice.chance(0.15):
        return model.Friction()
    dry = 0.0 if dice.chance(0.2) else torque * dice.decades(1e-3, 0.2)
    law = dice.one_of("coulomb", "coulomb", "coulomb", "tanh")
    viscous = 0.0 if dice.chance(0.2) else torque / speed * dice.decades(1e-4, 0.3)
    torques = {"dry_torque_Nm": dry, "viscous_Nms_rad": viscous}
    torques["breakaway_ratio"] = dice.one_of(1.0, 1.0, 1.3)
    return model.Friction(law=law, smoothing_speed_rad_s=1e-2 * speed, **torques)


def _encoder(dice: Dice, control: model.Controller, axis: str) -> model.Encoder:
    source = dice.one_of("ideal", "ideal", "difference", "tracking")
    counts = None
    if source != "ideal" and dice.chance(0.7):
        counts = int(dice.decades(1e3, 1e6)) * (100 if axis == "linear" else 1)
    inner = control.velocity.every if control.velocity else 1
    band = 0.2 / (control.period_s * inner) if source == "tracking" else None
    lag = inner * control.period_s * dice.one_of(0.0, 0.0, 0.5)
    return model.Encoder(counts_per_rev=counts, speed=source, bandwidth_rad_s=band, filter_time_s=lag)


def full_drive(seed: int) -> model.Design:
    """A drive with any mixture of what sections 6 and 7 of the model know; not known to be stable yet."""
    design, dice = _rigid_drive(Dice(seed), seed), Dice(10**6 + seed)
    for change in (
        elastic, _frictions, _loads, _motor_data, _filtered, _regulators, _outer, _sensors, _commanded,
        _supplied, _protected, _instrumented, _outermost,
    ):  # fmt: skip
        design = changed(design, **change(dice, design))
    return changed(design, **_damped(Dice(2 * 10**6 + seed), design)) if seed >= DAMPED else design


def _damped(dice: Dice, design: model.Design) -> Parts:
    """A load in air or water."""
    if not dice.chance(0.2):
        return {}
    own = design.inertia_kgm2 * design.total_ratio**2  # refused above J/Ts
    damping = dice.decades(1e-5, 1e-2) * own / design.controller.period_s
    path = "back-drivable" if dice.chance(0.7) else design.load.path
    return {"load": {"moment_damping_Nms_rad": damping, "path": path}}


def elastic(dice: Dice, design: model.Design) -> Parts:
    """A coupling, with play and friction behind it."""
    if not dice.chance(0.3) or design.friction.law == "tanh":
        return {}
    omega = dice.decades(3.0, 100.0) * design.controller.position_loop.gain
    if design.controller.velocity is None:
        omega = dice.decades(3.0, 30.0) * 0.05 / design.controller.period_s
    k = omega**2 * design.inertia_kgm2 * 0.2 * design.total_ratio**2
    friction = None
    if dice.chance(0.3):
        torque = full_torque(design)
        friction = model.LoadFriction(dry_torque_Nm=torque * design.total_ratio * dice.decades(1e-3, 0.03))
    damping = dice.decades(0.01, 0.2) * k / omega
    play = design.validation.full_deflection_rad * dice.one_of(0.0, 0.0, 1e-3, 0.01)
    coupling = model.Coupling(stiffness_Nm_rad=k, damping_Nms_rad=damping, play_rad=play)
    parts: Parts = {"load": {"friction": friction}, "coupling": coupling}
    if design.load.path == "self-locking" and dice.chance(0.5):
        return parts | {"friction": {"load_coefficient": 1.3 / design.total_ratio}}
    return parts | {"load": {"friction": friction, "path": "back-drivable"}}


def _frictions(dice: Dice, design: model.Design) -> Parts:
    """Asymmetric, with an offset, or as a map."""
    friction, kind = design.friction, dice.one_of("", "", "", "asymmetric", "offset", "map", "load")
    dry = friction.dry_torque_Nm
    if kind == "map" and dry > 0.0 and friction.law == "coulomb":
        return {"friction": friction_map(design)}
    viscous = 0.6 * friction.viscous_Nms_rad
    kinds: dict[str, Parts] = {
        "asymmetric": {"dry_torque_reverse_Nm": 1.4 * dry, "viscous_reverse_Nms_rad": viscous},
        "offset": {"offset_torque_Nm": 0.3 * dry},
        "load": {"load_coefficient": 2.0 / design.total_ratio},
    }
    return {"friction": kinds.get(kind, {})}


def friction_map(design: model.Design) -> Parts:
    """A Stribeck curve in the place of dry and viscous friction."""
    free = design.limits.voltage_V / design.motor.back_emf_constant_Vs_rad
    fast, dry = 0.3 * min(design.limits.speed_rad_s, free), design.friction.dry_torque_Nm
    curve = ((0.0, 1.0), (0.02, 0.7), (0.2, 0.75), (1.0, 1.2))
    points = tuple(model.FrictionPoint(speed_rad_s=w * fast, torque_Nm=dry * T) for w, T in curve)
    return {"dry_torque_Nm": 0.0, "viscous_Nms_rad": 0.0, "points": points}


def _loads(dice: Dice, design: model.Design) -> Parts:
    if not dice.chance(0.15) or design.axis == "linear":
        return {}
    peak = dice.decades(0.01, 0.2) * full_torque(design) * design.total_ratio
    gravity = model.Gravity(mass_kg=peak / 9.80665, arm_m=1.0, offset_rad=dice.one_of(0.0, 0.5, pi))
    return {"load": {"gravity": gravity, "path": "back-drivable", "moment_slope_Nm_rad": 0.0}}


def _motor_data(dice: Dice, design: model.Design) -> Parts:
    """The same motor from the data sheet of an AC servo motor, or a warm one."""
    motor, kind = design.motor, dice.one_of("", "", "ac", "warm")
    if kind == "warm":
        return {"temperature": model.Temperature(winding_degC=90.0, magnet_degC=70.0)}
    if not kind:
        return {}
    constants = dice.one_of("rms-line", "peak-phase")
    same = changed(design, motor={"constants": constants}).effective_motor
    names = ("resistance_ohm", "inductance_H", "torque_constant_Nm_A", "back_emf_constant_Vs_rad")
    sheet = {name: getattr(motor, name) * (getattr(motor, name) / getattr(same, name)) for name in names}
    return {"motor": {"constants": constants, **sheet}}


def _filtered(dice: Dice, design: model.Design) -> Parts:
    """Filters of the torque command and of the speed."""
    velocity = design.controller.velocity
    if velocity is None:
        return {}
    at = 2.0 * pi * 0.05 / (design.controller.period_s * velocity.every)
    shelf = (
        model.Filter(kind="lowpass", on="torque", frequency_rad_s=2.0 * at, order=2),
        model.Filter(kind="lowpass", on="speed", frequency_rad_s=3.0 * at),
        model.Filter(kind="notch", on="torque", frequency_rad_s=at, width_rad_s=0.5 * at, depth=0.1),
        model.Filter(kind="leadlag", on="torque", zero_rad_s=at, pole_rad_s=1.5 * at),
        model.Filter(kind="biquad", on="torque", b=(0.5, 0.3, 0.0), a=(-0.2, 0.0)),
    )
    return {"controller": {"velocity": {"filters": tuple(item for item in shelf if dice.chance(0.12))}}}


def _regulators(dice: Dice, design: model.Design) -> Parts:
    """Other kinds of anti-windup, and feed-forward in the current loop."""
    control, kinds = design.controller, ("conditional", "conditional", "clamped", "back-calculation")
    parts: Parts = {}
    if control.velocity is not None and control.velocity.integral_time_s is not None:
        parts["velocity"] = {"anti_windup": dice.one_of(*kinds)}
    if control.current is not None:
        parts["current"] = {"back_emf_feedforward": dice.one_of(0.0, 0.0, 0.8)}
        if control.current.integral_time_s is not None:
            parts["current"]["anti_windup"] = dice.one_of(*kinds)
    return {"controller": parts}


def _outer(dice: Dice, design: model.Design) -> Parts:
    """PI, PID and feed-forward of the position loop."""
    control, gain = design.controller, design.controller.position_loop.gain
    place: Parts = {}
    if dice.chance(0.25):
        place["integral_time_s"] = dice.decades(5.0, 30.0) / gain
    if control.velocity is not None and dice.chance(0.15):
        place |= {"derivative_time_s": 0.1 / gain, "derivative_filter_s": 0.02 / gain}
    if control.velocity is not None and dice.chance(0.2):
        place["acceleration_feedforward"] = dice.one_of(0.5, 1.0)
    if dice.chance(0.15):
        share = design.friction.dry_torque_Nm / design.motor.torque_constant_Nm_A
        place["friction_feedforward"] = share * (1.0 if control.current else design.motor.resistance_ohm)
    return {"controller": {"position": place}}


def _sensors(dice: Dice, design: model.Design) -> Parts:
    """Position, speed or both from the output's encoder, with counts or without."""
    kind = dice.one_of("", "", "", "", "position", "both")
    if not kind:
        return {}
    counts = dice.one_of(None, int(dice.decades(1e4, 1e6)) * (100 if design.axis == "linear" else 1))
    both = kind == "both" and design.controller.velocity is not None
    stages = ("position", "velocity") if both else ("position",)
    sensors = {stage: {"sensor": "output"} for stage in stages}
    return {"controller": sensors, "output_encoder": model.OutputEncoder(counts_per_rev=counts)}


def _commanded(dice: Dice, design: model.Design) -> Parts:
    kind = dice.one_of("", "", "", "filter", "profile")
    gain, full = design.controller.position_loop.gain, design.validation.full_deflection_rad
    if kind == "filter":
        return {"command": {"filter_time_s": 0.2 / gain, "filter_order": dice.one_of(1, 2)}}
    if kind == "profile" and design.controller.velocity is not None:
        rate = 0.2 * full * gain
        jerk = dice.one_of(inf, rate * gain**2)
        return {"command": {"rate_rad_s": rate, "acceleration_rad_s2": rate * gain, "jerk_rad_s3": jerk}}
    return {}


def _supplied(dice: Dice, design: model.Design) -> Parts:
    """A supply with resistance, one that takes nothing back."""
    R, kind = design.motor.resistance_ohm, dice.one_of("", "", "", "resistance", "capacitor")
    farad, brake = 200.0 * design.controller.period_s / R, 1.2 * design.limits.voltage_V
    taken = {"regenerative": False, "capacitance_F": farad, "brake_voltage_V": brake}
    kinds = {"resistance": {"resistance_ohm": 0.1 * R}, "capacitor": {"resistance_ohm": 0.05 * R, **taken}}
    return {"supply": model.Supply(**kinds[kind])} if kind else {}


def _protected(dice: Dice, design: model.Design) -> Parts:
    peak = design.limits.peak_current_A
    if peak == inf or not dice.chance(0.3):
        return {}
    kind = dice.one_of("thermal", "excess")
    return {"limits": {"continuous_current_A": 0.4 * peak, "peak_time_s": 1.0, "overload": kind}}


def _instrumented(dice: Dice, design: model.Design) -> Parts:
    if not dice.chance(0.15):
        return {}
    noise = 1e-4 * design.validation.full_deflection_rad * design.total_ratio
    finest = 1e-3 * design.limits.voltage_V / design.motor.resistance_ohm
    jitter = 0.01 * design.controller.period_s
    own = {"seed": 1, "angle_noise_rad": noise, "current_resolution_A": finest, "jitter_s": jitter}
    return {"instruments": own}


def _outermost(dice: Dice, design: model.Design) -> Parts:
    """Now and then the drive ends at its speed, its current or its voltage."""
    control, kind = design.controller, dice.one_of("", "", "", "", "", "", "speed", "torque")
    plain = {"rate_rad_s": inf, "acceleration_rad_s2": inf, "jerk_rad_s3": inf}
    if kind == "speed" and control.velocity is not None:
        return {"controller": {"position": None}, "command": plain}
    if kind == "torque" and control.current is not None:
        encoder = {"speed": "ideal", "counts_per_rev": None, "bandwidth_rad_s": None}
        return {"controller": {"position": None, "velocity": None}, "command": plain, "encoder": encoder}
    return {}


def is_stable(design: model.Design) -> bool:
    """Whether every loop is stable, inner ones too."""
    try:
        loops = assemble_loops(design).present.values() if is_allowed(design) else ()
        return bool(loops) and all(stability_margins(loop.open_loop).stable is True for loop in loops)
    except (InputError, NumericalError):
        return False


def drives(first: int, count: int) -> Iterator[model.Design]:
    """Those of the first so many seeds that a design file may hold, stable or not."""
    return islice(filter(is_allowed, map(full_drive, counter(first))), count)


def is_allowed(design: model.Design) -> bool:
    try:
        check_design(design, design.name)
    except InputError:
        return False
    return True
