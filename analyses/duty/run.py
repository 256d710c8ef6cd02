"""Simulate a duty, then heat the winding and the overload state with its current."""

from bisect import bisect_left
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import ceil, exp, inf, isfinite, log, pi, sqrt

import numpy as np

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import follows_angle, runs
from actuator_lti.drive.steady import winding
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats
from analyses.duty.asked import Asked
from analyses.failures.cases import jammed
from analyses.motion.settling import settling_ticks_of
from analyses.specification.requirements import RequirementVerdict, judged_by, tally
from nonlinear import commands, simulate
from nonlinear.runs.running import Piece
from nonlinear.runs.setup import check_frequency
from nonlinear.runs.trajectory import ADVICE


@dataclass(frozen=True)
class Overload:
    """The overload (I2t) state under this duty, for ever repeated; it acts at 1."""

    peak: float  # largest in the periodic state, as if the protection did not act
    acts_after_s: float | None  # from the cold drive, to the end of the cycle in which it does; None: never


@dataclass(frozen=True)
class Heating:
    """Temperature of the winding, the copper loss of a cycle taken as its mean."""

    loss_W: float  # mean copper loss at the reference temperature
    final_degC: float  # in the long run, the resistance growing with the temperature; inf: it never settles
    limit_degC: float
    limit_after_s: float | None  # when the limit is reached from ambient; None: never
    time_s: Floats  # the rise from ambient, for drawing
    temperature_degC: Floats


@dataclass(frozen=True)
class Duty:
    """A duty cycle and what it asks of the motor."""

    design: Design
    asked: Asked
    rms_A: float  # current of the whole cycle, in motion, at rest, largest; both steady
    moving_rms_A: float
    holding_A: float
    peak_A: float
    continuous_A: float  # what the design allows for ever; inf where it states none
    limited: tuple[str, ...]  # limiters that act in steady motion: the duty is then not followed as asked
    shaft_W: float  # mean over the cycle of what the motor gives its shaft
    peak_power_W: float  # largest into the motor, and back out of it: copper and shaft
    fed_back_W: float
    time_s: Floats  # one period of the steady motion, or several where the load turns with it
    current_A: Floats
    steady: bool  # whether it is; else the longest motion that is followed ends before
    overload: Overload | None  # none without protection; none without a thermal resistance
    heating: Heating | None

    @property
    def period_ticks(self) -> int:
        """Rows of one period of the motion."""
        return _period(self.asked, self.design.controller.period_s, self.time_s.size)

    @property
    def rms_torque_Nm(self) -> float:
        """Of the motor, over the cycle."""
        return float(winding(self.design.effective_motor)[1] * self.rms_A)

    @property
    def peak_torque_Nm(self) -> float:
        """Of the motor."""
        return float(winding(self.design.effective_motor)[1] * self.peak_A)

    @property
    def copper_W(self) -> float:
        """Mean over the cycle of what the winding takes, at the temperature that the design states."""
        return float(winding(self.design.effective_motor)[0] * self.rms_A**2)

    @property
    def mean_power_W(self) -> float:
        """Mean over the cycle of what goes into the motor: copper and shaft."""
        return self.copper_W + self.shaft_W

    @cached_property
    def requirements(self) -> tuple[RequirementVerdict, ...]:
        """Those of the design on a duty."""
        return judged_by(self.design, "duty", self)

    @property
    def verdict(self) -> Verdict:
        """The rating and the requirements; not proven where neither is stated."""
        rated = [self.rated] if self.rated is not Verdict.NOT_PROVEN or not self.requirements else []
        return (Tally.of(rated) + tally(self.requirements)).verdict

    @property
    def rated(self) -> Verdict:
        """Whether the drive may do this for ever by what is stated: current, protection, temperature."""
        if not self.steady:
            return Verdict.NOT_PROVEN
        stated = [self.rms_A <= self.continuous_A] if isfinite(self.continuous_A) else []
        if self.heating is not None and isfinite(self.heating.limit_degC):
            stated.append(self.heating.final_degC <= self.heating.limit_degC)
        if self.overload is not None:
            stated.append(self.overload.acts_after_s is None)
        return Verdict.of(all(stated) if stated else None)


PERIODS, MANY = 3, 32  # of the motion that pass at least before one is taken; that are taken at the most
STEADY = 1e-4  # of the rms current: it differs by less, in no printed digit, after twice as many periods
MOST_TICKS = 2_000_000
MOST_WORK = 10 * MOST_TICKS  # ticks that are waited, and integration steps within them: some seconds
MOST_CYCLES = 2**40
_DRAWN = 200


def duty(design: AnyDesign, asked: Asked | None = None) -> Duty:
    """Current of a duty by simulation, against continuous current, overload protection and temperature.

    The protection is left out of the simulation, so that the current is that of the duty as asked; the output
    of a drive that is commanded in current is held.

    Raises `InputError`: for a drive without motor current or without a loop, or a period of too many ticks.

    >>> from actuator_lti.design import load_design
    >>> result = duty(load_design("joint"))
    >>> result.rms_A <= result.peak_A
    True
    """
    design = as_design(design)
    if not design.motor.has_electrical_dynamics:
        raise InputError("duty: an ideal torque source has no current")
    if not design.controller.stages:
        raise InputError("duty: needs a drive with a loop")
    asked = Asked.of(design) if asked is None else asked
    there = jammed(design) if design.controller.outermost == "current" else design
    free = replace(there, limits=replace(design.limits, peak_time_s=None))
    piece, rest, steady = _cycle(free, asked)
    current, speed = (piece.signal(name).copy() for name in ("current_A", "motor_speed_rad_s"))
    ticks, still = current.size, np.zeros(1) if rest is None else rest.signal("current_A")
    periods, more = divmod(_moving_ticks(asked, design.controller.period_s, ticks), ticks)

    def mean(values: Floats) -> float:
        return float((periods * np.sum(values) + np.sum(values[:more])) / (periods * ticks + more))

    moving, held = sqrt(mean(current**2)), float(np.sqrt(np.mean(still**2)))
    R, _, kE = winding(design.effective_motor)
    shaft = kE * current * speed
    power = R * current**2 + shaft
    peak = max(float(np.abs(part).max()) for part in (current, still))
    rms = float(np.sqrt(asked.share * moving**2 + (1.0 - asked.share) * held**2))
    return Duty(
        design, asked, rms, moving, held, peak,
        design.limits.continuous_current_A, piece.limited,
        asked.share * mean(shaft), float(power.max()), max(0.0, -float(power.min())),
        design.controller.period_s * np.arange(ticks, dtype=float), current, steady,
        _overload(design, asked, current, held), heating(design, rms),
    )  # fmt: skip


def _cycle(design: Design, asked: Asked) -> tuple[Piece, Piece | None, bool]:
    """What is taken of the motion, the rest that follows it, and whether the motion is steady.

    That is where the slowest pole has fallen to `STEADY` and, with all that is not linear, the rms current is
    the same after twice as long. The rest goes on from there: friction holds what the motion has left.
    """
    Ts, size = design.controller.period_s, asked.size_of(design)
    every = round(design.controller.period_of(design.controller.outermost) / Ts)
    lowest = (PERIODS + 1) / (MOST_TICKS * Ts)
    if asked.frequency_hz < lowest:
        motion = f"a peak of {size:.4g} (in SI) at {asked.frequency_hz:.4g} Hz"
        raise InputError(f"{motion}: at least {lowest:.4g} Hz with this period")
    check_frequency(design, commands.sine(size, asked.frequency_hz))
    periods, updates = _periods(design, asked, 1.0 / (asked.frequency_hz * Ts * every))
    taken = updates * every
    command = commands.sine(size, periods / (taken * Ts))
    if asked.ramp_s > 0.0:
        command = _trapezoid(asked, size, np.arange(0, taken, every), Ts, taken / periods)
    drive = simulate(design, command, taken * Ts, asked.load_Nm).running
    assert drive is not None
    gone, before, settling = 0, inf, settling_ticks_of(design, STEADY)
    wait = max(PERIODS * taken // periods, ceil(settling) if settling < inf else 0)
    while True:
        while gone < wait and drive.work < MOST_WORK:
            piece, gone = _went_well(drive.advance(taken)), gone + taken
        rms = float(np.sqrt(np.mean(piece.signal("current_A") ** 2)))
        steady = abs(rms - before) <= STEADY * rms
        if steady or drive.work >= MOST_WORK:
            break
        wait, before = 2 * gone, rms
    if asked.share == 1.0:
        return piece, None, steady
    drive.command(0.0)
    resting = min((1.0 - asked.share) * asked.cycle_s / Ts, float(MOST_TICKS))
    return piece, _went_well(drive.advance(max(1, round(resting)))), steady


def _went_well(piece: Piece) -> Piece:
    if piece.status != "ok":
        raise NumericalError(f"duty ({piece.status}): {ADVICE[piece.status]}")
    return piece


def _trapezoid(asked: Asked, size: float, at: Floats, Ts: float, ticks: float) -> commands.Command:
    """The command of a trapezoid of so many ticks, sampled at ticks."""
    ends = np.array([0.0, asked.ramp_s / Ts, ticks - asked.ramp_s / Ts, ticks])
    return commands.sampled(at * Ts, np.interp(at % ticks, ends, [0.0, size, size, 0.0]))


def _periods(design: Design, asked: Asked, updates: float) -> tuple[int, int]:
    """How many are taken, of so many updates each, and the updates of them all.

    Those that come nearest to whole updates, as the frequency is then the one that is asked; where a load
    turns with its drive nearest to whole turns.
    """
    longest_s = MOST_TICKS * design.controller.period_s
    most = min(MANY, max(1, int(longest_s * asked.frequency_hz) - PERIODS))
    if asked.share < 1.0:
        most = min(most, max(1, int(asked.share * asked.cycle_s * asked.frequency_hz)))
    if not (runs(design) and follows_angle(design) and asked.ramp_s > 0.0 and asked.share == 1.0):
        nearest = Fraction(updates).limit_denominator(most)
        return nearest.denominator, nearest.numerator
    turns = asked.size_of(design) * (1.0 / asked.frequency_hz - asked.ramp_s) / (2.0 * pi)
    periods = min(range(1, most + 1), key=lambda k: abs(k * turns - round(k * turns)))
    return periods, round(periods * updates)


def _overload(design: Design, asked: Asked, current: Floats, held: float) -> Overload | None:
    """The first-order state of (i/i_cont)^2 over motion and rest, repeated for ever."""
    from scipy.signal import lfilter  # takes a second to load, and the first screen asks of this room

    tau, Ts = design.limits.overload_time_s, design.controller.period_s
    if tau is None:
        return None
    drive = (current / design.limits.continuous_current_A) ** 2
    still = (held / design.limits.continuous_current_A) ** 2
    a = 1.0 - Ts / tau
    gained = lfilter([Ts / tau], [1.0, -a], drive)  # over a period, from 0
    decay = a ** (np.arange(drive.size) + 1.0)
    moving = _moving_ticks(asked, Ts, drive.size)
    periods, part = divmod(moving, drive.size)
    rest_s = moving * Ts * (1.0 / asked.share - 1.0)
    cooled = exp(-rest_s / tau)

    def after(x: float, periods: int) -> float:
        left = decay[-1] ** periods
        return float(left * x + gained[-1] * (1.0 - left) / (1.0 - decay[-1]))

    def cycle(x: float) -> tuple[float, float]:
        """Largest in the cycle that begins with x, in its first or last period or its rest; its end."""
        last = after(x, periods)
        levels = [decay * start + gained for start in (x, after(x, periods - 1), last)]
        levels[2] = levels[2][:part]
        end = float(levels[2][-1]) if part else last
        end = still + (end - still) * cooled
        return max(end, *(float(one.max(initial=0.0)) for one in levels)), end

    start = cycle(0.0)[1]
    slope = cycle(1.0)[1] - start  # of the state after a cycle over that before
    settled = start / (1.0 - slope)
    peak, _ = cycle(settled)
    if peak < 1.0:
        return Overload(peak, None)
    cycles = bisect_left(range(MOST_CYCLES), 1.0, key=lambda k: cycle(settled * (1.0 - slope**k))[0])
    if asked.share < 1.0:
        return Overload(peak, (cycles + 1) * (moving * Ts + rest_s))
    one = _period(asked, Ts, drive.size)
    over = int(np.argmax(decay * settled * (1.0 - slope**cycles) + gained >= 1.0))
    return Overload(peak, (cycles * drive.size + (over // one + 1) * one) * Ts)


def _period(asked: Asked, Ts: float, taken: int) -> int:
    """Ticks of a period, of those of all that are taken."""
    return taken // max(1, round(taken * Ts * asked.frequency_hz))


def _moving_ticks(asked: Asked, Ts: float, period: int) -> int:
    """Ticks of the motion in a cycle, at least a period; of one that does not rest, a period."""
    return max(period, round(asked.share * asked.cycle_s / Ts)) if asked.share < 1.0 else period


def heating(design: Design, rms_A: float) -> Heating | None:
    """Temperature of the winding under a current of this rms value: ``tau dT/dt = Ta + Rth P(T) - T``.

    P(T) = R i^2 (1 + alpha (T - T_ref)); None without a thermal resistance.
    """
    heat = design.temperature
    if heat is None or heat.thermal_resistance_K_W is None:
        return None
    cold = replace(design, temperature=replace(heat, winding_degC=heat.reference_degC)).effective_motor
    assert cold.resistance_ohm is not None
    loss = cold.resistance_ohm * rms_A**2
    rise = heat.thermal_resistance_K_W * loss
    share = 1.0 - rise * heat.resistance_per_K
    start = rise * (1.0 + heat.resistance_per_K * (heat.ambient_degC - heat.reference_degC))
    final = heat.ambient_degC + start / share if share > 0.0 else inf
    tau = heat.thermal_time_s or 0.0
    limit = heat.winding_limit_degC

    def after(t: Floats) -> Floats:
        if share == 0.0:
            return heat.ambient_degC + start * t / tau
        return heat.ambient_degC - start / share * np.expm1(-share * t / tau)

    reached, over = None, limit - heat.ambient_degC
    if final > limit and tau > 0.0:
        reached = tau * over / start if share == 0.0 else -tau * log(1.0 - over * share / start) / share
    last = 5.0 * tau / share if share > 0.0 else (reached or tau)
    time = np.linspace(0.0, last, _DRAWN)
    temperature = after(time) if tau > 0.0 else np.full(_DRAWN, final)
    return Heating(loss, final, limit, max(reached, 0.0) if reached is not None else None, time, temperature)
