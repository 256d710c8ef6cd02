"""What a drive can do at each load torque: rate, acceleration, current; manoeuvres, and their bounds."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Command, Design
from actuator_lti.design.plant import no_load_speed
from actuator_lti.drive import facts
from actuator_lti.drive.facts import stall_torque_Nm, steady_torque_Nm
from actuator_lti.drive.steady import current_limit_torque_Nm, motor_torque_Nm, voltage_limit_torque_Nm
from analyses.large_signal.tones import LONGEST_TICKS, tone
from nonlinear import commands, simulate

POINTS, PLANE_POINTS = 400, 41
STEP_TICKS, RUN_UP_TICKS = 60_000, 40_000
STEADY_SHARE = 0.1
PERIODS = (
    8  # of a sine after settling, of which the last counts: a rate limit halves what is left in each half
)


@dataclass(frozen=True)
class Manoeuvre:
    """One manoeuvre at one load torque."""

    name: str
    load_Nm: float
    speed_rad_s: np.ndarray  # of the motor along it, thinned for drawing, as the torque
    torque_Nm: np.ndarray
    rms_current_A: float | None  # ``None`` for an ideal source, which has no current
    peak_current_A: float | None
    rms_torque_Nm: float  # of the motor
    peak_torque_Nm: float
    duty: float | None  # `thermal_duty`, of one that repeats
    limits: dict[str, float]  # fraction of the time in which each limit acts, where it does
    periodic: bool  # whether it repeats: only then rms and duty say what can be kept up


def thermal_duty(design: Design, rms_current_A: float | None) -> float | None:
    """Share of the time that keeps the rms current at the continuous current; ``None`` where unknown.

    Copper heat goes with the square of the current, and the winding's time constant is taken as long against
    the manoeuvre.

    >>> from actuator_lti import load_design
    >>> thermal_duty(load_design("ilr33-amber"), 8.0)
    0.25
    """
    continuous = design.limits.continuous_current_A
    if rms_current_A is None or not math.isfinite(continuous):
        return None
    return 1.0 if rms_current_A <= continuous else (continuous / rms_current_A) ** 2


def manoeuvres(
    design: Design, load_Nm: float, rate_rad_s: float, acceleration_rad_s2: float, settling_s: float
) -> Iterator[Manoeuvre]:
    """A step, a sine below the top rate and a sawtooth, full deflection; rates of the output."""
    full = design.validation.full_deflection_rad
    moves, turns = 0.0 < rate_rad_s < math.inf, 0.0 < acceleration_rad_s2 < math.inf
    travel = full / rate_rad_s if moves else 0.0
    swing = math.sqrt(full / acceleration_rad_s2) if turns else 0.0
    time = travel + 8.0 * swing + 4.0 * settling_s
    yield _manoeuvre(design, "step to full deflection", commands.step(full), time, load_Nm, None)
    # angular frequencies at which a sine needs all of the rate, or of the acceleration
    bounds = [rate_rad_s / full] * moves + [math.sqrt(acceleration_rad_s2 / full)] * turns
    slow_hz = min(bounds, default=0.0) / (2.0 * math.pi)
    shares = {"sine at 70 % of what rate and torque allow": 0.7, "sine three times as fast as allowed": 3.0}
    for name, share in shares.items() if bounds else ():
        every = design.controller.position_loop.every
        hz = min(share * slow_hz, 0.2 / (every * design.controller.period_s))
        chosen = tone(hz, design)
        period = chosen.ticks / chosen.cycles * design.controller.period_s
        sine, said = commands.sine(full, chosen.frequency_hz), f"{name} ({hz:.3g} Hz)"
        yield _manoeuvre(design, said, sine, settling_s + PERIODS * period, load_Nm, period)


def _manoeuvre(
    design: Design, name: str, command: commands.Command, time: float, load_Nm: float, period: float | None
) -> Manoeuvre:
    most = STEP_TICKS if period is None else LONGEST_TICKS
    time = min(time, most * design.controller.period_s)
    run = simulate(design, command, time, load_Nm, raise_on_failure=False)
    count = run.time_s.size if period is None else min(round(period / run.period_s), run.time_s.size)
    torque = motor_torque_Nm(design, run.current_A, run.voltage_V)[-count:]
    current = np.abs(run.current_A[-count:]) if design.motor.has_electrical_dynamics else None
    speed = run.motor_speed_rad_s[-count:]
    # points that lie evenly along the path in the plane, so that fast parts keep their shape
    spans = [max(float(np.ptp(each)), 1e-300) for each in (speed, torque)]
    way = np.append(0.0, np.cumsum(np.hypot(np.diff(speed) / spans[0], np.diff(torque) / spans[1])))
    thin = np.unique(np.minimum(np.searchsorted(way, np.linspace(0.0, way[-1], POINTS)), len(way) - 1))
    rms = None if current is None else _rms(current)
    return Manoeuvre(
        name=name, load_Nm=load_Nm, speed_rad_s=speed[thin], torque_Nm=torque[thin], rms_current_A=rms,
        peak_current_A=None if current is None else float(current.max()), rms_torque_Nm=_rms(torque),
        peak_torque_Nm=float(np.max(np.abs(torque))),
        duty=thermal_duty(design, rms) if period is not None else None,
        limits={key: use.fraction for key, use in run.limits.items() if use.active},
        periodic=period is not None,
    )  # fmt: skip


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@dataclass(frozen=True)
class Curve:
    """A line in the plane: motor speed (rad/s) and motor torque (N m)."""

    name: str
    speed_rad_s: np.ndarray
    torque_Nm: np.ndarray


@dataclass(frozen=True)
class TorqueSpeedPlane:
    """Motor side, first quadrant."""

    bounds: tuple[Curve, ...]  # voltage line, peak current, continuous current, speed limit; those that exist
    demands: tuple[Curve, ...]  # friction (and load, where it passes) in steady motion at each load torque


def torque_speed_plane(design: Design, top_speed_rad_s: float) -> TorqueSpeedPlane:
    """The plane to a little above the top speed: ``u = R i + kE w`` (equation 1), and equation (9)."""
    motor, limits = design.effective_motor, design.limits
    top = top_speed_rad_s if 0.0 < top_speed_rad_s < math.inf else 1.0
    speed = np.linspace(0.0, 1.25 * top, PLANE_POINTS)
    ends = speed[[0, -1]]
    bounds, levels = list[Curve](), dict[str, float]()
    if motor.source_gain_Nm_V is not None:
        levels["drive signal at its limit"] = stall_torque_Nm(design)
    else:
        if math.isfinite(limits.voltage_V):
            line = np.linspace(0.0, no_load_speed(design), PLANE_POINTS)
            bounds.append(Curve("voltage limit", line, voltage_limit_torque_Nm(design, line)))
        if design.controller.current is not None and math.isfinite(limits.peak_current_A):
            bounds.append(Curve("peak current", ends, current_limit_torque_Nm(design, ends)))
        levels["continuous current"] = motor_torque_Nm(design, limits.continuous_current_A, math.nan)
    bounds += [Curve(name, ends, np.full(2, level)) for name, level in levels.items() if math.isfinite(level)]
    if design.controller.velocity is not None and math.isfinite(limits.speed_rad_s):
        high = max((float(curve.torque_Nm.max()) for curve in bounds), default=1.0)
        bounds.append(Curve("speed limit", np.full(2, limits.speed_rad_s), np.array([0.0, high])))
    demands = tuple(
        Curve(f"steady motion at {load:g} {design.load_unit}", speed, steady_torque_Nm(design, load, speed))
        for load in design.validation.loads_Nm
    )
    return TorqueSpeedPlane(tuple(bounds), demands)


@dataclass(frozen=True)
class DriveFigures:
    """`actuator_lti.drive.facts.Capability` of one design at one load torque at the output shaft."""

    load_Nm: float
    output_rate_rad_s: float
    rate_limit: str  # one of `actuator_lti.drive.facts.RATE_LIMITS`
    motor_current_A: float | None
    acceleration_rad_s2: float


def drive_figures(design: Design, load_Nm: float = 0.0) -> DriveFigures:
    """Rate, current and acceleration of a drive at a load at the output, N m (linear axis: N), either sign.

    Raises `InputError`: if the load is not finite.

    >>> from actuator_lti import load_design
    >>> result = drive_figures(load_design("ilr33-amber"), load_Nm=8.0)
    >>> round(result.motor_current_A, 3), result.rate_limit
    (3.037, 'speed limit')
    """
    capacity = facts.capability(design, load_Nm)
    rate, current = float(capacity.output_rate_rad_s), float(capacity.motor_current_A)
    limit, push = facts.RATE_LIMITS[int(capacity.rate_limit)], float(capacity.acceleration_rad_s2)
    return DriveFigures(load_Nm, rate, limit, None if math.isnan(current) else current, push)


@dataclass(frozen=True)
class Capability:
    """What the drive can do at one load torque; output side unless a name says motor."""

    figures: DriveFigures  # in closed form
    simulated_rate_rad_s: float | None  # steady, running away; ``None``: no bound, or not reached in time
    simulated_acceleration_rad_s2: float | None  # largest mean over a stretch of the start
    simulated_current_A: float | None  # mean motor current at the steady rate
    current_ratio: float | None  # that current over the continuous current
    duty: float | None  # share of the time in which that current may flow (`thermal_duty`)


def capability(design: Design, load_Nm: float, settling_s: float) -> Capability:
    """Run away from the output, behind the profile, at one load: without what depends on the angle.

    And without the overload protection, which would end it.
    """
    design = replace(
        design, command=Command(), load=design.load.level(), motor=design.motor.straight(),
        limits=replace(design.limits, peak_time_s=None),
    )  # fmt: skip
    figures = drive_figures(design, load_Nm)
    rate, push = figures.output_rate_rad_s, figures.acceleration_rad_s2
    current, continuous = figures.motor_current_A, design.limits.continuous_current_A
    ratio = current / continuous if current is not None and math.isfinite(continuous) else None
    found = Capability(figures, None, None, None, ratio, thermal_duty(design, current))
    if not (0.0 < rate < math.inf and 0.0 < push < math.inf):
        return found
    friction = design.friction  # the way that meets the greater resistance
    forward = friction.dry_Nm(load_Nm, 1) + friction.offset_torque_Nm
    direction = 1 if forward >= friction.dry_Nm(load_Nm, -1) - friction.offset_torque_Nm else -1
    Ts = design.controller.period_s
    force_bound = figures.rate_limit == "force" and friction.viscous(1) > 0.0
    viscous_s = design.inertia_kgm2 / friction.viscous(direction) if force_bound else 0.0
    time = min(12.0 * rate / push + 8.0 * settling_s + 8.0 * viscous_s, LONGEST_TICKS * Ts)
    load = direction * -abs(load_Nm)  # against the motion: what it does ahead of it may chatter
    run = simulate(design, commands.ramp(direction * 3.0 * rate), time, load)
    speed = direction * run.motor_speed_rad_s / design.total_ratio
    tail = max(4, int(STEADY_SHARE * speed.size))
    steady = float(speed[-tail:].mean())
    settled = abs(float(speed[-1] - speed[-tail])) < 2e-3 * abs(steady)
    acceleration = _acceleration(design, load, direction, rate, push)
    drawn = abs(float(run.current_A[-tail:].mean())) if design.motor.has_electrical_dynamics else None
    if settled:
        found = replace(found, simulated_rate_rad_s=steady, simulated_current_A=drawn)
    return replace(found, simulated_acceleration_rad_s2=acceleration)


def _acceleration(design: Design, load_Nm: float, direction: int, rate: float, push: float) -> float:
    """Largest mean acceleration over a tenth of a run-up after a step far away (less of a very slow one)."""
    Ts = design.controller.period_s
    stretch = max(2, round(min(0.1 * rate / push / Ts, RUN_UP_TICKS / 14)))
    command = commands.step(direction * 1e3 * (rate * Ts + design.validation.full_deflection_rad))
    run = simulate(design, command, (14 * stretch + 20) * Ts, load_Nm)
    speed = direction * run.motor_speed_rad_s / design.total_ratio
    return float(np.max(speed[stretch:] - speed[:-stretch])) / (stretch * Ts)
