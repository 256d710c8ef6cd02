"""What dry friction and play lose at a reversal of a slow triangle of the command: predicted, simulated."""

import math
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.steady import drive_gain, filtered, motor_torque_Nm
from actuator_lti.systems.root import root
from actuator_lti.types import Floats
from analyses.friction_effects.breakaway import StaticThreshold
from analyses.friction_effects.orbit import Orbit
from analyses.large_signal.tones import LEFT
from analyses.motion.settling import settling_ticks_of
from nonlinear import commands, simulate
from nonlinear.bench.operating_motion import OperatingMotion, operating_motion_at

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


def hysteresis(
    design: Design, load_Nm: float, static: StaticThreshold, settling_ticks: int
) -> Hysteresis | None:
    """Simulate a slow triangle with and without dry friction and play and compare the two branches.

    ``None`` where the drive is not stable without friction: there is nothing to compare with.
    """
    bare = replace(design, friction=replace(design.friction, load_coefficient=0.0))
    if settling_ticks_of(bare, LEFT) == math.inf:
        return None
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
    updates = ticks // every
    last_s = 1.5 * period + every * design.controller.period_s
    linear, run = (
        simulate(drive, command, last_s, load_Nm, friction_on=friction_on, record_every=every)
        for drive, friction_on in ((tight, False), (design, True))
    )
    smooth = linear.output_angle_rad[updates // 2 :]  # from the first fall of the command through zero on
    lost = run.output_angle_rad[updates // 2 :] - smooth
    linear_width, shown = _width(smooth[:: updates // 2]), slice(-updates, None, max(1, updates // POINTS))
    return Hysteresis(
        amplitude, 1.0 / period, run.reference_rad[shown], run.output_angle_rad[shown],
        linear_width + _width(lost[:: updates // 2]), linear_width, float(np.abs(lost).max()),
        lost_predicted_rad(design, load_Nm, static, 4.0 * amplitude / period, period),
    )  # fmt: skip


def _width(passing: Floats) -> float:
    """Falling less rising in the periodic state, of three passages, the first falling.

    What a slow integral began with fades by one factor from each to the next, in the sum of both.
    """
    first, second = passing[:2] + passing[1:]
    fades = np.clip(second / first, 0.0, 1.0) if first else 0.0
    return float(2.0 * (passing[0] - first / (1.0 + fades)))


def lost_predicted_rad(
    design: Design, load_Nm: float, static: StaticThreshold, rate_rad_s: float, period_s: float
) -> float:
    """What dry friction and play lose at a reversal of a triangle of the command, as that passes zero.

    Where nothing integrates, the torque of sliding needs an error, over the stiffness; an integral takes it
    away in its time (`Orbit`), one alone but for ``T dT_f/dt`` where friction grows with a load that bends
    over the angle. A spring lags by its twist and half its play, unless the position loop sees the output.
    """
    times = (static.integral_time_s, static.outer_integral_time_s)
    rates = [0.0 if one is None else 1.0 / one for one in times]
    orbit = Orbit(0.0, 0.0, 0.0, rate_rad_s, 0.5 * period_s, np.array([sum(rates), math.prod(rates)]))
    branches = (_lag_rad(design, load_Nm, static, way, orbit) for way in (1.0, -1.0))
    return next(branches) - next(branches)


def _lag_rad(design: Design, load_Nm: float, static: StaticThreshold, way: float, orbit: Orbit) -> float:
    """Command less output while the drive slides through zero of the command, forward or backward."""
    loop, load, gain = design.controller.position_loop, design.load, static.torque_gain_Nm_rad
    fed = loop.friction_feedforward * float(drive_gain(design) * filtered(design, "torque")) / gain
    breakaway = 0.5 * (static.forward_rad + static.backward_rad) - fed

    def sliding(lag: float, sense: float) -> tuple[OperatingMotion, float]:
        moment = load_Nm + float(load.moment_Nm(-lag))
        motion = operating_motion_at(design, sense * SLOW_RAD_S, moment)
        return motion, motor_torque_Nm(design, motion.current_A, motion.voltage_V) / gain - sense * fed

    def missing(lag: float) -> float:
        (motion, needed), (_, other) = sliding(lag, way), sliding(lag, -way)
        level, stays = 0.5 * way * (needed - other), 0.5 * (needed + other)
        carried = -load_Nm - float(load.moment_Nm(-lag)) if design.coupling is None else motion.coupling_Nm
        slope = -np.sign(carried) * load.over_angle.slope_at(-lag, moving=True) * orbit.rate_rad_s
        growth, relief = way * design.friction.load_coefficient * slope / gain, 1.0
        if orbit.gains.any():  # which take away what stays, but for what the load gives way
            relief, stays = 1.0 + ((standing - stays) / lag if lag else 0.0), 0.0
        about = Orbit(
            level / relief, max(level, breakaway) / relief, growth / relief, orbit.rate_rad_s, orbit.half_s,
            orbit.gains / relief,
        )  # fmt: skip
        twist = motion.twist_rad / design.ratio_behind_coupling if loop.sensor == "motor" else 0.0
        return lag - way * about.at_zero_rad - stays - twist

    standing = 0.5 * (sliding(0.0, way)[1] + sliding(0.0, -way)[1])
    reach = -missing(0.0)  # what it is without the load's part, which bends that much further
    while missing(reach) * reach < 0.0:
        reach *= 2.0
    return root(missing, 0.0, reach)
