"""A design becomes the row of floats that the compiled kernel reads."""

from collections.abc import Iterable
from math import inf
from typing import Any, get_args

import numpy as np

from actuator_lti.design.law import LAW_INPUTS, twist_of
from actuator_lti.design.model import AntiWindup, CurrentLoop, Design, FilterPlace, SpeedSource, VelocityLoop
from actuator_lti.design.over_angle import OverAngle
from actuator_lti.design.plant import torque_per_command
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.drive.steady import winding
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from nonlinear._kernels import layout as at
from nonlinear.row.elastic import put_drive_train
from nonlinear.row.filters import section

MAX_EVENTS_PER_TICK = 1000
TANH_TOLERANCE = 1e-8
LONGEST_AVERAGE = 100_000  # samples of the moving average that limits the jerk
SEEDS = 2**31
ANTI_WINDUP = get_args(AntiWindup)  # in the order of the kernel's numbers
SPEED_SOURCES = get_args(SpeedSource)
STAGES = ("current", "velocity", "position")  # in the order of the kernel's numbers
CHAINS: dict[FilterPlace, tuple[int, int]] = {  # where their number stands, and the first of their sections
    "speed": (at.SPEED_FILTERS, at.SPEED_CHAIN),
    "torque": (at.TORQUE_FILTERS, at.TORQUE_CHAIN),
}


def split_delay(delay_s: Any, period_s: Any) -> tuple[Any, Any]:
    """Whole ticks and the rest in seconds of a computing delay; a rest below 1e-9 of a tick is none.

    >>> [float(x) for x in split_delay(3e-4, 1e-4)]
    [3.0, 0.0]
    """
    whole = np.floor(delay_s / period_s + 1e-9)
    rest = delay_s - whole * period_s
    if hasattr(rest, "zero_below"):  # a key that is followed into the row
        return whole, rest.zero_below(1e-9 * period_s)
    return whole[()], np.where(np.abs(rest) < 1e-9 * period_s, 0.0, rest)[()]


def _somewhere(condition: Any) -> bool:
    """Whether it holds in one design, or in any of a stacked one."""
    return condition if isinstance(condition, bool) else bool(np.any(condition))


def design_row(
    design: Design, *, friction_on: bool = True, limits_on: bool = True, kind: type = float
) -> Floats:
    """The one row of a design, see `design_rows`."""
    return design_rows(design, 1, friction_on=friction_on, limits_on=limits_on, kind=kind)[0]


def design_rows(
    design: Design, count: int, *, friction_on: bool = True, limits_on: bool = True, kind: type = float
) -> Floats:
    """Parameters of the plant, the controllers and the limits of a design, at rest, without command or load.

    Shape (count, layout.SIZE), SI, motor side; the places are the names of ``nonlinear._kernels.layout``. One
    design, or one stacked over ``count``: with arrays of shape (count,) for some of its numbers
    (`actuator_lti.design.access.stacked`); which stages there are is the same in all. ``friction_on = False``
    leaves out the dry friction (C0, CM) and the offset torque; viscous friction stays, so that the drive
    without limits is a linear loop. ``limits_on = False`` takes speed, acceleration, peak current and voltage
    as unlimited. ``kind``: ``object`` keeps values that are no floats; `nonlinear.export` follows keys so.

    Raises `InputError`: if the stages of the design do not fit together.
    """
    rows: Floats = np.zeros((count, at.SIZE), dtype=kind)
    row = rows.T  # a place of it is a column
    _plant(design, row)
    _friction(design, row, friction_on)
    _controllers(design, row)
    _load(design, row)
    put_drive_train(design, row, friction_on=friction_on)
    _command(design, row)
    _supply(design, row)
    _instruments(design, row)
    _limits(design, row, limits_on)
    row[at.MAX_EVENTS] = MAX_EVENTS_PER_TICK
    row[at.RECORD_EVERY] = row[at.CYCLES] = row[at.HARMONICS] = 1
    row[at.TANH_TOLERANCE] = TANH_TOLERANCE
    row[at.TANH_LEVEL] = -1.0
    for point in range(4):
        row[at.PROBES + point * at.PROBE_SIZE + at.PROBE_GAIN] = 1.0
    return rows


def _plant(design: Design, row: Floats) -> None:
    motor = design.effective_motor
    row[at.RATIO] = design.total_ratio
    row[at.INERTIA] = design.inertia_kgm2
    row[at.BACK_DRIVABLE] = design.load.path == "back-drivable"
    if motor.source_gain_Nm_V is not None:
        row[at.SOURCE], row[at.SOURCE_GAIN] = 1.0, motor.source_gain_Nm_V
        row[at.RESISTANCE], row[at.INDUCTANCE] = 1.0, 1.0
        return
    electrical = {
        at.RESISTANCE: motor.resistance_ohm,
        at.INDUCTANCE: motor.inductance_H,
        at.BACK_EMF: motor.back_emf_constant_Vs_rad,
        at.TORQUE_CONSTANT: motor.torque_constant_Nm_A,
    }
    for place, value in electrical.items():
        if value is None:
            message = (
                "motor: resistance, inductance, torque_constant and back_emf_constant or source_gain needed"
            )
            raise InputError(message, where=design.name)
        row[place] = value


def _friction(design: Design, row: Floats, friction_on: bool) -> None:
    friction = design.friction
    row[at.VISCOUS], row[at.VISCOUS_REVERSE] = friction.viscous(1), friction.viscous(-1)
    row[at.BREAKAWAY] = friction.breakaway_ratio
    row[at.SMOOTHING] = friction.smoothing_speed_rad_s
    if not friction_on:
        return
    row[at.LAW] = friction.law == "tanh"
    row[at.DRY], row[at.DRY_REVERSE] = friction.dry_Nm(0.0, 1), friction.dry_Nm(0.0, -1)
    row[at.LOAD_COEFFICIENT] = friction.load_coefficient
    row[at.OFFSET] = friction.offset_torque_Nm
    if _somewhere(friction.breakaway_ratio < 1.0):
        message = f"friction.breakaway_ratio = {friction.breakaway_ratio}: must be at least 1"
        raise InputError(message, where=design.name)


def _load(design: Design, row: Floats) -> None:
    """The drive's own torques and torques act in every run, told or not."""
    row[at.LOAD_DAMPING] = design.load.moment_damping_Nms_rad
    _over_angle(row, design.load.over_angle, at.LOAD_SLOPE, at.MOMENT_PEAK, at.MOMENT_ORDER)
    _over_angle(row, design.motor.over_angle, at.TORQUE_SLOPE, at.TORQUE_PEAK, at.TORQUE_ORDER)


def _over_angle(row: Floats, over_angle: OverAngle, slope_at: int, peak_at: int, order_at: int) -> None:
    """Slope of a torque over its angle; peak, order and phase of what bends."""
    row[slope_at] = over_angle.slope_Nm_rad
    for j, wave in enumerate(over_angle.waves):
        row[peak_at + j] = wave.peak_Nm
        row[order_at + 2 * j], row[order_at + 2 * j + 1] = wave.order, wave.phase_rad


def _controllers(design: Design, row: Floats) -> None:
    controller = design.controller
    Ts = controller.period_s
    row[at.PERIOD] = Ts
    row[at.DELAY_TICKS], row[at.DELAY_FRACTION] = split_delay(controller.computing_delay_s, Ts)
    row[at.EVERY_POSITION] = row[at.EVERY_VELOCITY] = 1
    row[at.FILTER_COEFFICIENT] = 1.0
    row[at.DIFFERENCE_SAMPLES] = 1
    row[at.DERIVATIVE_COEFFICIENT] = 1.0
    velocity, current = controller.velocity, controller.current
    if velocity is not None:
        row[at.HAS_VELOCITY], row[at.EVERY_VELOCITY] = 1.0, velocity.every
        row[at.SPEED_SENSOR] = velocity.sensor == "output"
        _regulator(row, at.VELOCITY_GAIN, at.VELOCITY_WINDUP, velocity.gain, velocity, velocity.every * Ts)
        _filters(velocity, row, Ts, design.name)
    _encoder(design, row, row[at.EVERY_VELOCITY] * Ts)
    if current is not None:
        if not design.motor.has_electrical_dynamics:
            message = "control.current: an ideal torque source has no current to control"
            raise InputError(message, where=design.name)
        row[at.HAS_CURRENT] = 1.0
        _regulator(row, at.CURRENT_GAIN, at.CURRENT_WINDUP, current.gain_V_A, current, Ts)
        R, _, kE = winding(design.controller_model.effective_motor)
        row[at.BACK_EMF_FEEDFORWARD] = current.back_emf_feedforward * kE
        row[at.RESISTANCE_FEEDFORWARD] = current.resistance_feedforward * R
    _position(design, row)
    _own_law(design, row)


def _own_law(design: Design, row: Floats) -> None:
    """Matrices of a law of one's own, a column for each signal that there is."""
    own = design.controller.own_law
    if own is None:
        return
    stage, law = own
    row[at.OWN_STAGE], row[at.OWN_STATES] = STAGES.index(stage) + 1, len(law.A)
    row[at.OWN_GAIN], row[at.OWN_READS_SPEED] = law.gain, "speed" in law.inputs
    for place, quantum in (
        (at.OWN_COUNTS, design.angle_quantum_rad),
        (at.OWN_OUTPUT_COUNTS, design.output_quantum_rad),
    ):
        row[place] = 0.0 if quantum is None else 1.0 / quantum
    if stage == "position" and design.controller.position_loop.sensor == "motor":
        row[at.POSITION_COUNTS] = row[at.OWN_COUNTS]
    made = {"twist": twist_of(design) if "twist" in law.inputs else {}}
    for at_row, driven in (
        (at.OWN_D, law.D),
        *((at.OWN_B + k * at.OWN_INPUTS, one) for k, one in enumerate(law.B)),
    ):
        for name, value in zip(law.inputs, driven, strict=bool(driven)):
            for signal, gain in made.get(name, {name: 1.0}).items():
                row[at_row + LAW_INPUTS.index(signal)] += value * gain
    for k, own_row in enumerate(law.A):
        _put(row, at.OWN_A + k * at.MOST_STATES, own_row)
    _put(row, at.OWN_C, law.C)
    _put(row, at.OWN_L, law.L)


def _regulator(
    row: Floats, gain_at: int, windup_at: int, gain: float, loop: VelocityLoop | CurrentLoop, T: Any
) -> None:
    """Gain, Kp T/Tn and anti-windup of a PI; T/Tt of the back-calculation is T/Tn where Tt is not given."""
    row[gain_at] = gain
    row[windup_at] = ANTI_WINDUP.index(loop.anti_windup)
    if loop.integral_time_s is None:
        return
    row[gain_at + 1] = gain * T / loop.integral_time_s
    row[windup_at + 1] = T / (loop.integral_time_s if loop.tracking_time_s is None else loop.tracking_time_s)


def _filters(velocity: VelocityLoop, row: Floats, Ts: Any, where: str) -> None:
    for place, (count_at, chain_at) in CHAINS.items():
        chosen, T = velocity.filters_on(place), velocity.every * Ts
        if len(chosen) > at.MAX_SECTIONS:
            message = f"control.velocity.filter: {len(chosen)} on the {place}: at most {at.MAX_SECTIONS} fit"
            raise InputError(message, where=where)
        row[count_at] = len(chosen)
        for k, item in enumerate(chosen):
            _put(row, chain_at + k * at.SECTION, section(item, T, where=where))


def _put(row: Floats, begin: int, numbers: Iterable[Any]) -> None:
    for k, number in enumerate(numbers):
        row[begin + k] = number


def _position(design: Design, row: Floats) -> None:
    loop = design.controller.position
    if loop is None:
        return
    T = loop.every * row[at.PERIOD]
    row[at.HAS_POSITION], row[at.EVERY_POSITION] = 1.0, loop.every
    row[at.POSITION_GAIN], row[at.FEEDFORWARD] = loop.gain, loop.feedforward
    if loop.integral_time_s is not None:
        row[at.POSITION_INTEGRAL] = loop.gain * T / loop.integral_time_s
    row[at.DERIVATIVE] = loop.gain * loop.derivative_time_s
    row[at.DERIVATIVE_COEFFICIENT] = T / (loop.derivative_filter_s + T)
    row[at.FRICTION_FEEDFORWARD] = loop.friction_feedforward
    model = design.controller_model
    needed = loop.acceleration_feedforward * model.inertia_kgm2
    row[at.ACCELERATION_FEEDFORWARD] = needed / (torque_per_command(model) * T**2)
    if loop.sensor == "output":
        row[at.OUTPUT_SENSOR] = 1.0
        quantum = design.output_quantum_rad
        row[at.POSITION_COUNTS] = 0.0 if quantum is None else 1.0 / quantum


def _encoder(design: Design, row: Floats, period_s: Any) -> None:
    encoder = design.encoder
    row[at.FILTER_COEFFICIENT] = period_s / (encoder.filter_time_s + period_s)
    row[at.SPEED_SOURCE] = SPEED_SOURCES.index(encoder.speed)
    if encoder.speed == "ideal":
        return
    if encoder.speed == "difference":
        row[at.DIFFERENCE_SAMPLES] = encoder.difference_samples
    elif encoder.bandwidth_rad_s is None:
        raise InputError("encoder.bandwidth: missing; the tracking loop needs one", where=design.name)
    else:
        w0T = encoder.bandwidth_rad_s * period_s
        row[at.TRACKING_ANGLE], row[at.TRACKING_SPEED] = 2.0 * w0T, w0T * encoder.bandwidth_rad_s
    quantum, ratio = design.angle_quantum_rad, 1.0
    velocity = design.controller.velocity
    if velocity is not None and velocity.sensor == "output":
        quantum, ratio = design.output_quantum_rad, design.total_ratio
    row[at.COUNTS_PER_RAD] = 0.0 if quantum is None else 1.0 / (quantum * ratio)


def _command(design: Design, row: Floats) -> None:
    """Profile and filter of the command, at the period of the outermost stage."""
    command, control = design.command, design.controller
    outermost = control.outermost
    period = control.period_of(outermost)
    limits: list[Any] = [command.rate_rad_s, command.acceleration_rad_s2, command.jerk_rad_s3]
    limited = any(_somewhere(limit < inf) for limit in limits)
    if outermost in ("current", "voltage") and limited:
        message = f"command: rate, acceleration and jerk need a position or a velocity loop, not {outermost}"
        raise InputError(message, where=design.name)
    # a speed command is limited itself where an angle's first derivative is
    ranges = [inf, *limits] if outermost == "position" else [*limits, inf]
    row[at.PROFILE_RANGE], row[at.PROFILE_RATE], row[at.PROFILE_ACCELERATION] = ranges[:3]
    row[at.PROFILED] = limited
    if _somewhere(ranges[3] < inf):
        if _somewhere(ranges[2] == inf):
            raise InputError("command.jerk: needs command.acceleration as well", where=design.name)
        samples = np.ceil(2.0 * ranges[2] / (ranges[3] * period) - 1e-9)
        if np.max(samples) > LONGEST_AVERAGE:
            message = f"command.jerk = {np.min(ranges[3]):g}: a mean over {np.max(samples):.0f} samples"
            raise InputError(f"{message}; at most {LONGEST_AVERAGE} fit", where=design.name)
        row[at.PROFILE_SAMPLES] = np.maximum(samples, 1.0)
    if _somewhere(command.filter_time_s > 0.0):
        row[at.COMMAND_FILTERS] = 1
        lowpass = command.lowpass(period, design.name)
        _put(row, at.COMMAND_CHAIN, section(lowpass, period, design.name))


def _supply(design: Design, row: Floats) -> None:
    supply = design.supply
    if supply is None:
        return
    row[at.SUPPLY], row[at.SUPPLY_VOLTAGE] = 1.0, design.limits.voltage_V
    row[at.SUPPLY_RESISTANCE], row[at.REGENERATIVE] = supply.resistance_ohm, supply.regenerative
    row[at.BRAKE_VOLTAGE] = inf if supply.brake_voltage_V is None else supply.brake_voltage_V
    if not supply.regenerative and supply.capacitance_F is None:
        message = "supply.capacitance: missing; a supply that takes no energy back needs one"
        raise InputError(message, where=design.name)
    row[at.CAPACITANCE] = supply.capacitance_F or 0.0


def _instruments(design: Design, row: Floats) -> None:
    instruments = design.instruments
    row[at.CURRENT_RESOLUTION] = instruments.current_resolution_A
    row[at.CURRENT_NOISE] = instruments.current_noise_A
    row[at.ANGLE_NOISE] = instruments.angle_noise_rad
    row[at.OUTPUT_NOISE] = instruments.output_angle_noise_rad
    row[at.JITTER] = instruments.jitter_s
    row[at.SEED] = instruments.seed % SEEDS


def _limits(design: Design, row: Floats, limits_on: bool) -> None:
    limits = design.limits
    for name, limiter in LIMITERS.items():
        if limiter.limit and limiter.kind != "rms":
            row[at.LIMIT[name]] = limiter.limit_of(limits) if limits_on else inf
    if not limits_on:
        row[at.SUPPLY] = 0.0
        return
    tau = limits.overload_time_s
    if tau is not None:
        if design.controller.current is None:
            raise InputError("limits.peak_time: needs a current loop", where=design.name)
        row[at.OVERLOAD], row[at.OVERLOAD_RATE] = 1.0, row[at.PERIOD] / tau
        row[at.OVERLOAD_RELEASE], row[at.CONTINUOUS_CURRENT] = limits.release, limits.continuous_current_A
