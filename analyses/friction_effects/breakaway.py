"""At rest: the smallest command that moves the output, what a slow reversal loses; told and simulated."""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import root_scalar

from actuator_lti.design.model import Command, Design
from actuator_lti.drive.facts import breakaway_torque_Nm, stall_torque_Nm
from actuator_lti.drive.operating import holding_torque_Nm
from actuator_lti.drive.steady import drive_gain, filtered, motor_torque_Nm, torque_gain_Nm_rad
from analyses.finite import finite
from nonlinear import Rows, commands, simulate
from nonlinear.bench.operating_motion import operating_motion_at
from nonlinear.settling.rest import first_motion_s


@dataclass(frozen=True)
class StaticThreshold:
    """Smallest step that moves the output at once, by the proportional parts of the controllers."""

    load_Nm: float
    torque_gain_Nm_rad: float  # motor torque per output position error, before an integrator has acted
    # Command (peak, output side) that overcomes breakaway; 0 where the load does, ``inf``: too weak
    forward_rad: float
    backward_rad: float
    # Of the velocity controller, else the position controller; ``None``: the threshold is final
    integral_time_s: float | None
    outer_integral_time_s: float | None = None  # of the position controller, beside the other

    @property
    def smallest_rad(self) -> float:
        return min(self.forward_rad, self.backward_rad)

    def waiting_time_s(self, amplitude_rad: float) -> float:
        """Time until a forward step moves the output: ``Tn (A0/A - 1)``; ``inf`` where it never does.

        With a constant error the torque grows as ``1 + t/Tn``; two integrals one behind the other, of times T
        and U, give ``1 + t/T + t/U + t^2/(2 T U)``.
        """
        if amplitude_rad >= self.forward_rad:
            return 0.0
        if self.integral_time_s is None or amplitude_rad <= 0.0 or math.isinf(self.forward_rad):
            return math.inf
        more = self.forward_rad / amplitude_rad - 1.0
        if self.outer_integral_time_s is None:
            return self.integral_time_s * more
        T, U = self.integral_time_s, self.outer_integral_time_s
        return math.sqrt((T + U) ** 2 + 2.0 * T * U * more) - (T + U)


def static_threshold(design: Design, load_Nm: float = 0.0) -> StaticThreshold:
    """Find the smallest command that moves the output at once.

    >>> from actuator_lti import load_design
    >>> result = static_threshold(load_design("emps"))
    >>> round(1e6 * result.backward_rad, 3)  # um: (Fc - |offset|) and (Fc + |offset|) over the stiffness
    17.187
    """
    gain, strongest = float(torque_gain_Nm_rad(design)), float(stall_torque_Nm(design))
    needed = (breakaway_torque_Nm(design, load_Nm, direction) for direction in (1, -1))
    forward, backward = (torque / gain if torque < strongest else math.inf for torque in needed)
    velocity, position = design.controller.velocity, design.controller.position_loop
    times = [None if velocity is None else velocity.integral_time_s, position.integral_time_s]
    first, second, *_ = *(one for one in times if one is not None), None, None
    return StaticThreshold(load_Nm, gain, forward, backward, first, second)


FRACTIONS = (0.2, 0.3, 0.5, 0.7, 0.9)
WITHIN, RESOLUTION = 0.05, 2e-3  # of the threshold: beyond it something has to move, and it is known to


@dataclass(frozen=True)
class Waiting:
    """A step below the threshold: how long the speed controller must integrate until the output moves."""

    amplitude_rad: float
    predicted_s: float
    simulated_s: float | None


@dataclass(frozen=True)
class Threshold:
    """Threshold of motion at one load torque."""

    static: StaticThreshold  # What the gains predict
    waiting: tuple[Waiting, ...]  # steps below it, where a controller integrates and no kick moves it
    simulated_rad: float | None  # Smallest forward step that ever moves the output, where nothing integrates
    resolution: float  # Of ``simulated_rad``, relative


def threshold(design: Design, load_Nm: float) -> Threshold | None:
    """Simulate steps about the threshold of the motor, behind the profile; ``None``: none forward."""
    design = replace(design, command=Command())
    friction = design.friction
    at_zero = replace(  # its own torque there an offset, no friction behind the spring
        design,
        motor=design.motor.straight(),
        load=replace(design.load.level(), friction=None),
        friction=replace(friction, offset_torque_Nm=friction.offset_torque_Nm + holding_torque_Nm(design)),
    )
    static = static_threshold(at_zero, load_Nm + float(design.load.moment_Nm(0.0)))
    if not 0.0 < static.forward_rad < math.inf:
        return None
    if design.controller.position_loop.kicks:
        return Threshold(static, (), None, 0.0)  # a step's own kick moves it at once
    if static.integral_time_s is not None:
        sizes = static.forward_rad * np.array(FRACTIONS)
        times = zip(sizes.tolist(), _first_motion_s(design, load_Nm, sizes), strict=True)
        waiting = tuple(Waiting(size, static.waiting_time_s(size), finite(time)) for size, time in times)
        return Threshold(static, waiting, None, 0.0)
    low, high = 0.0, (1.0 + WITHIN) * static.forward_rad
    if _first_motion_s(design, load_Nm, np.array([high]))[0] == math.inf:
        return Threshold(static, (), None, RESOLUTION)
    while high - low > RESOLUTION * static.forward_rad:  # a current that overshoots moves it before
        size = 0.5 * (low + high)
        moves = _first_motion_s(design, load_Nm, np.array([size]))[0] < math.inf
        low, high = (low, size) if moves else (size, high)
    return Threshold(static, (), high, RESOLUTION)


def _first_motion_s(design: Design, load_Nm: float, sizes: np.ndarray) -> np.ndarray:
    """When each step first moves the motor, spring loaded, the sensor at zero; ``inf`` if none does."""
    rows = Rows.of(design, len(sizes))
    rows["load"] = load_Nm
    rows.step("command", sizes)
    if design.coupling is not None:
        moment, behind = load_Nm + float(design.load.moment_Nm(0.0)), design.load.friction
        offset = 0.0 if behind is None else behind.offset_torque_Nm
        twist = design.coupling.twist_rad(offset - moment / design.ratio_behind_coupling)
        rows["twist_start"] = twist
        if design.controller.position_loop.sensor == "output":
            rows["angle_start"] = design.ratio_to_coupling * twist
    return np.array([first_motion_s(rows.running(k)) for k in range(len(sizes))])


SPAN = 25.0  # amplitude over the threshold
PERIOD_SETTLINGS = 16  # settling times (to 1e-9) in one period
LEAST_TICKS = 4000
POINTS = 500
SLOW_RAD_S = 1e-100  # motor speed at which nothing viscous counts


@dataclass(frozen=True)
class Hysteresis:
    """One settled period of a slow triangle at the command."""

    amplitude_rad: float  # of the triangle; the width depends on its rate where a controller integrates
    frequency_hz: float
    command_rad: np.ndarray  # one period at updates of the position loop, thinned
    output_rad: np.ndarray
    width_rad: float  # output falling less output rising, both where the command passes zero
    # The same without dry friction, its feed-forward and play: what the loop lags by at this rate
    linear_width_rad: float
    largest_rad: float  # distance of the output from that without dry friction and play, at any update
    predicted_rad: float  # what a reversal loses of a slow command: `lost_predicted_rad`

    @property
    def lost_motion_rad(self) -> float:
        """What friction and play add to the width."""
        return self.width_rad - self.linear_width_rad


def hysteresis(design: Design, load_Nm: float, static: StaticThreshold, settling_ticks: int) -> Hysteresis:
    """Simulate a slow triangle with and without dry friction and play and compare the two branches."""
    ticks = max(PERIOD_SETTLINGS * settling_ticks, LEAST_TICKS)
    every = design.controller.position_loop.every
    ticks = 4 * every * round(ticks / (4 * every))
    period = ticks * design.controller.period_s
    smallest = min(design.validation.amplitude_fractions) * design.validation.full_deflection_rad
    unfed, play = replace(design.controller.position_loop, friction_feedforward=0.0), 0.0
    tight = replace(design, controller=replace(design.controller, position=unfed))
    if design.coupling is not None:
        play = design.coupling.play_rad / design.ratio_behind_coupling
        tight = replace(tight, coupling=replace(design.coupling, play_rad=0.0))
    amplitude = min(SPAN * (static.forward_rad + play), max(smallest, 2.0 * play))
    command = commands.triangle(amplitude, 1.0 / period)
    widths, outputs, updates = [], [], ticks // every
    for drive, friction_on in ((tight, False), (design, True)):
        run = simulate(drive, command, 1.25 * period, load_Nm, friction_on=friction_on, record_every=every)
        y = run.output_angle_rad[-updates:]  # from the first reversal on, where it slides settled already
        widths.append(float(y[updates // 4] - y[3 * updates // 4]))
        outputs.append(y)
    shown = slice(-updates, None, max(1, updates // POINTS))
    return Hysteresis(
        amplitude, 1.0 / period, run.reference_rad[shown], run.output_angle_rad[shown],
        widths[1], widths[0], float(np.max(np.abs(outputs[1] - outputs[0]))),
        lost_predicted_rad(design, load_Nm, static, 4.0 * amplitude / period),
    )  # fmt: skip


def lost_predicted_rad(design: Design, load_Nm: float, static: StaticThreshold, rate_rad_s: float) -> float:
    """What dry friction and play lose at a reversal of a slow command, where the command passes zero.

    Where nothing integrates, the torque of sliding needs an error, over the stiffness; one integral of time T
    needs ``T dT_f/dt`` where friction grows with a load that bends over the angle, two none. A spring lags by
    its twist and half its play, unless the position loop sees the output itself.
    """
    branches = (_lag_rad(design, load_Nm, static, way * rate_rad_s) for way in (1.0, -1.0))
    return next(branches) - next(branches)


def _lag_rad(design: Design, load_Nm: float, static: StaticThreshold, rate_rad_s: float) -> float:
    """Command less output while the drive slides through zero of the command at a rate."""
    loop, load, sense = design.controller.position_loop, design.load, math.copysign(1.0, rate_rad_s)
    fed = sense * loop.friction_feedforward * float(drive_gain(design) * filtered(design, "torque"))

    def missing(lag: float) -> float:
        moment = load_Nm + float(load.moment_Nm(-lag))
        motion = operating_motion_at(design, sense * SLOW_RAD_S, moment)
        torque = motor_torque_Nm(design, motion.current_A, motion.voltage_V) - fed
        if static.integral_time_s is not None:
            carried = -moment if design.coupling is None else motion.coupling_Nm
            slope = -np.sign(carried) * load.over_angle.slope_at(-lag, moving=True)
            growth = design.friction.load_coefficient * slope * abs(rate_rad_s)
            torque = static.integral_time_s * growth if static.outer_integral_time_s is None else 0.0
        twist = motion.twist_rad / design.ratio_behind_coupling if loop.sensor == "motor" else 0.0
        return lag - torque / static.torque_gain_Nm_rad - twist

    return float(root_scalar(missing, x0=0.0, x1=-missing(0.0) or 1e-12).root)
