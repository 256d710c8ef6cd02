"""The sawtooth of the paper: a sine faster than the speed limit, against a pure rate limit's formulas."""

import math
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Command, Design
from actuator_lti.errors import positive_number
from analyses.large_signal.classify import FULL_TRIANGLE, RateLimited, rate_limited
from analyses.large_signal.tones import Tone, tone
from analyses.specification.capability import drive_figures
from nonlinear import State, Trajectory, commands, simulate

OVERRUN = 3.0  # x = w A/R that is shown
PERIODS_SHOWN = 2
POINTS = 900
FAST, REVERSAL_DEG = 50.0, 1.0  # Kv/w from which, reversal up to which the formulas hold to 1 % and 1 deg
GAIN_TOLERANCE, LAG_TOLERANCE_DEG = 0.01, 1.0
LONGEST_TICKS = 400_000  # of a sine that is not steady by then


@dataclass(frozen=True)
class SawtoothRun:
    """The last periods at one load torque; output side, motor speed and current at the motor."""

    load_Nm: float
    time_s: np.ndarray  # thinned for drawing; rates are those of the output (motor over N)
    reference_rad: np.ndarray
    output_rad: np.ndarray
    output_rate_rad_s: np.ndarray
    speed_command_rad_s: np.ndarray
    current_A: np.ndarray
    # Of the output over the last window of periods: fundamental over the command, its lag, largest deflection
    # from the mean, everything but mean and fundamental over the fundamental, peak over rms
    gain: float
    lag_deg: float
    peak_rad: float
    distortion: float
    crest: float
    formula: RateLimited  # what a pure rate limit would do
    steady: bool  # the fundamental is within `GAIN_TOLERANCE` that of half as long

    @property
    def gain_error(self) -> float:
        return self.gain / self.formula.gain - 1.0

    @property
    def lag_error_deg(self) -> float:
        return self.lag_deg - self.formula.lag_deg


@dataclass(frozen=True)
class Sawtooth:
    """A sine command that the output can follow only at its top speed."""

    amplitude_rad: float  # of the command
    frequency_hz: float
    rate_limit_rad_s: float  # R at the output
    gain_over_frequency: float = 0.0  # Kv/w: the formulas hold where this is large
    reversal_deg: float = 0.0  # of a period, in which the drive turns round; the formulas do so at once
    has_current: bool = False
    runs: tuple[SawtoothRun, ...] = ()  # one a load torque
    reason: str = ""  # why there is none; then ``runs`` is empty
    slowest_rad_s: float = math.inf  # at the slowest load; below R by the droop of a P velocity loop

    @property
    def droops(self) -> bool:
        """Whether the output stays below R by the droop of a P velocity loop."""
        return self.slowest_rad_s < self.rate_limit_rad_s * (1.0 - 1e-9)

    @property
    def applicable(self) -> bool:
        """Whether loops and torque are fast enough for 1 % and 1 degree, and the output's rate is R."""
        fast = self.gain_over_frequency >= FAST and self.reversal_deg <= REVERSAL_DEG
        return fast and not self.droops

    @property
    def passed(self) -> bool | None:
        """Whether the formulas are met; ``None`` where they do not apply."""
        if not self.runs or not self.applicable:
            return None
        return all(
            abs(run.gain_error) <= GAIN_TOLERANCE and abs(run.lag_error_deg) <= LAG_TOLERANCE_DEG
            for run in self.runs
        )


def sawtooth(
    design: AnyDesign, *, amplitude_rad: float | None = None, frequency_hz: float | None = None
) -> Sawtooth:
    """Simulate a sine of which the output can only follow the flanks, at each load torque of the design.

    By default of full deflection, where x = w A/R is three, well inside the range of whole triangles
    (x >= 1.862). The sine comes behind profile and filter of the command, which would limit it first.
    """
    design = replace(as_design(design), command=Command())
    for name, value in (("amplitude_rad", amplitude_rad), ("frequency_hz", frequency_hz)):
        if value is not None:
            positive_number(name, value)
    amplitude = design.validation.full_deflection_rad if amplitude_rad is None else amplitude_rad
    limit = design.limits.speed_rad_s
    if design.controller.velocity is None or not math.isfinite(limit):
        reason = "the drive has no speed limit of its own, so its output is no sawtooth"
        return Sawtooth(amplitude, 0.0, math.inf, reason=reason)
    figures = [drive_figures(design, load) for load in design.validation.loads_Nm]
    slowest = min(result.output_rate_rad_s for result in figures)
    rate = limit / design.total_ratio
    weak = any(result.rate_limit in ("voltage", "force") for result in figures)
    if weak and slowest < rate * (1.0 - 1e-9):
        share = f"{100 * slowest / rate:.0f} %"
        reason = f"not every load lets the drive reach its speed limit: it stays at {share}"
        return Sawtooth(amplitude, 0.0, rate, reason=reason)
    wanted = OVERRUN * rate / (2.0 * math.pi * amplitude) if frequency_hz is None else frequency_hz
    chosen = tone(wanted, design, least_updates=400)
    runs = list[SawtoothRun]()
    for load in design.validation.loads_Nm:
        if (run := _run(design, amplitude, chosen, load, rate)) is None:
            reason = f"at a load of {load:g} {design.load_unit} the output stands still"
            return Sawtooth(amplitude, chosen.frequency_hz, rate, reason=reason)
        runs.append(run)
    push = min(result.acceleration_rad_s2 for result in figures)
    return Sawtooth(
        amplitude,
        chosen.frequency_hz,
        rate,
        gain_over_frequency=design.controller.position_loop.gain / chosen.omega_rad_s,
        reversal_deg=math.degrees(2.0 * rate / push * chosen.omega_rad_s),
        has_current=design.motor.has_electrical_dynamics,
        runs=tuple(runs),
        slowest_rad_s=slowest,
    )


def _run(design: Design, amplitude: float, at: Tone, load_Nm: float, rate: float) -> SawtoothRun | None:
    """Simulate from the flank of the triangle on, and keep the last periods; none of a drive that stands."""
    formula = rate_limited(amplitude, at.omega_rad_s, rate)
    N, period, begin = design.total_ratio, at.ticks // at.cycles, State()
    if formula.x >= FULL_TRIANGLE:
        lag_s = math.radians(formula.lag_deg) / at.omega_rad_s
        begin = State(motor_angle_rad=-N * rate * lag_s)
    command, windows = commands.sine(amplitude, at.frequency_hz), 2 + PERIODS_SHOWN
    while True:
        seconds = windows * at.ticks * design.controller.period_s
        run = simulate(design, command, seconds, load_Nm, initial=begin)
        output, phasors = _by_window(run, at, windows)
        y, phasor = output[-1], phasors[-1]
        steady = bool(abs(phasor - phasors[windows // 2 - 1]) <= GAIN_TOLERANCE * abs(phasor))
        if steady or 2 * windows * at.ticks > LONGEST_TICKS:
            break
        windows *= 2
    fundamental, rms, peak = abs(phasor), float(np.sqrt(np.mean(y**2))), float(np.max(np.abs(y)))
    if rms == 0.0 or fundamental == 0.0:
        return None
    shown = slice(-PERIODS_SHOWN * period, None, max(1, PERIODS_SHOWN * period // POINTS))
    time = run.time_s[shown]
    return SawtoothRun(
        load_Nm=load_Nm, time_s=time - time[0], reference_rad=run.reference_rad[shown],
        output_rad=run.output_angle_rad[shown], output_rate_rad_s=run.motor_speed_rad_s[shown] / N,
        speed_command_rad_s=run.speed_command_rad_s[shown] / N, current_A=run.current_A[shown],
        gain=fundamental / amplitude, lag_deg=float(-np.degrees(np.angle(phasor)) % 360.0), peak_rad=peak,
        distortion=math.sqrt(max(rms**2 - fundamental**2 / 2.0, 0.0)) / (fundamental / math.sqrt(2.0)),
        crest=peak / rms, formula=formula,
        steady=steady,
    )  # fmt: skip


def _by_window(run: Trajectory, at: Tone, windows: int) -> tuple[np.ndarray, np.ndarray]:
    """The output less its mean in each window of whole periods, and its fundamental there."""
    time, angle = (x[-windows * at.ticks :].reshape(windows, -1) for x in (run.time_s, run.output_angle_rad))
    output = angle - angle.mean(axis=1)[:, None]
    return output, 2j * np.mean(output * np.exp(-1j * at.omega_rad_s * time), axis=1)
