"""Stick-slip hunting, predicted exactly where a describing function is blind: rest, breakaway, slip, rest.

A speed integral winds up while the rotor rests at an error E, until the drive torque reaches breakaway; then
the drive is the sampled linear loop with the smaller sliding friction until the speed returns to zero.  A
symmetric cycle is an E that the slip turns into -E.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from actuator_lti.design.model import Design
from actuator_lti.drive.facts import breakaway_torque_Nm
from actuator_lti.drive.steady import drive_gain, steady_input
from actuator_lti.loops import Loops, assemble_loops
from analyses.large_signal.tones import AT_REST, settling_ticks_in_periods, without_value

SMALLEST, LARGEST, POINTS = 1e-3, 1.0, 241  # of the threshold
SLOPE_STEP = 1e-3


@dataclass(frozen=True)
class StickSlipCycle:
    """A symmetric stick-slip cycle."""

    output_amplitude_rad: float  # error at rest on either side, output side
    frequency_hz: float
    rest_s: float  # of half a period
    slope: float  # of the next error over this; below 1 in magnitude the cycle attracts

    @property
    def stable(self) -> bool:
        """Whether motion near it comes nearer."""
        return abs(self.slope) < 1.0


@dataclass(frozen=True)
class _Slip:
    """Slip from breakaway as the sum of a part that goes with E and a part that does not."""

    period_s: float
    gain: float
    integral_gain: float
    start: float
    w: np.ndarray
    th: np.ndarray
    command: np.ndarray

    def from_error(self, error: float) -> tuple[float, float, float] | None:
        """Error after the slip in its direction, duration, rest until the next; None: it does not end."""
        w = self.w[0] + error * self.w[1]
        ends = np.flatnonzero((w[1:-1] > 0.0) & (w[2:] <= 0.0)) + 1
        if not ends.size:
            return None
        k = int(ends[0])
        part = w[k] / (w[k] - w[k + 1])
        th, command = (
            float((1.0 - part) * (a[0, k] + error * a[1, k]) + part * (a[0, k + 1] + error * a[1, k + 1]))
            for a in (self.th, self.command)
        )
        if th <= 0.0:
            return -th, float(k + part) * self.period_s, math.inf
        # the error is now -th: the command falls from its value at landing to -start
        rest = (command + self.start) / (self.integral_gain * self.gain * th)
        return -th, float(k + part) * self.period_s, max(rest, 0.0)


def stick_slip_cycle(design: Design, load_Nm: float, loops: Loops | None = None) -> StickSlipCycle | None:
    """The symmetric cycle of an integrating speed controller, by its sampled sliding ``loops``, if any."""
    if (slip := _slip(design, load_Nm, loops)) is None:
        return None
    grid = slip.start / slip.gain * np.geomspace(SMALLEST, LARGEST, POINTS)

    def surplus(error: float) -> float:
        result = slip.from_error(error)
        return -error if result is None else -result[0] - error

    values = np.array([surplus(float(error)) for error in grid])
    falls = np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0))
    if not falls.size:
        return None
    k = int(falls[-1])
    error = float(brentq(surplus, grid[k], grid[k + 1], xtol=1e-12 * grid[k]))
    result = slip.from_error(error)
    if result is None or not math.isfinite(result[2]):
        return None
    _, slipping, resting = result
    step = SLOPE_STEP * error
    slope = (surplus(error + step) - surplus(error - step)) / (2.0 * step) + 1.0
    return StickSlipCycle(error / design.total_ratio, 0.5 / (slipping + resting), resting, slope)


def _slip(design: Design, load_Nm: float, loops: Loops | None) -> _Slip | None:
    """Follow the slip after breakaway; None: not that of the linear loop with one constant friction."""
    control, friction = design.controller, design.friction
    velocity, plain = control.velocity, control.own_law is None  # what such a law does meanwhile is not known
    alike = friction.dry_torque_reverse_Nm is None and friction.offset_torque_Nm == 0.0
    rubs = friction.law == "coulomb" and not friction.points and friction.dry_Nm(load_Nm) > 0.0
    if not (plain and alike and rubs and design.load.path != "back-drivable"):
        return None
    if velocity is None or velocity.integral_time_s is None:
        return None
    loops = assemble_loops(design) if loops is None else loops
    if (system := loops.tick_system) is None:
        return None
    ticks = settling_ticks_in_periods(loops)
    torque = breakaway_torque_Nm(design, load_Nm, 1)
    current, volts = steady_input(design, torque, 0.0)
    start = torque / float(drive_gain(design))
    gain = velocity.gain * control.position_loop.gain
    held = {"i": start, "velocity.I": start, "hold_i_ref": start}
    if design.motor.has_electrical_dynamics:
        held["i"] = current
    held |= {"current.I": volts} | {name: volts for name in system.states if name[0] == "u"}
    error = {"th": -1.0, "velocity.I": -gain, "hold_w_ref": control.position_loop.gain}
    if without_value(system.states, held.keys() | error.keys(), AT_REST):
        return None  # what a filter, say, holds before breakaway is not known here
    runs = []
    for state, torque in ((held, -friction.dry_Nm(load_Nm)), (error, 0.0)):
        rest = system.initial_state({k: v for k, v in state.items() if k in system.states})
        runs.append(system.respond(np.zeros(ticks), torque, rest))
    names = ("w", "th", "u" if control.current is None else "i_ref")
    w, th, command = (np.array([run[name] for run in runs]) for name in names)
    return _Slip(control.period_s, gain, 1.0 / velocity.integral_time_s, start, w, th, command)
