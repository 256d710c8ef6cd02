"""Simulate a duty, then heat the winding and the overload state with its current."""

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import accumulate
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
    rms_A: float  # current of the whole cycle, in motion from its start on, at rest, largest
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
    piece, motion, still, steady = _cycle(free, asked)
    (R, _, kE), legs = winding(design.effective_motor), (*motion, *still)

    def means(of: Callable[[_Leg], Floats]) -> tuple[float, float]:
        """Over the motion and over the rest."""
        totals = (sum(leg.times * float(of(leg).sum()) for leg in each) for each in (motion, still))
        ticks = (sum(leg.times * leg.current_A.size for leg in each) for each in (motion, still))
        moved, held = (total / max(count, 1) for total, count in zip(totals, ticks, strict=True))
        return moved, held

    heats, gives = means(lambda leg: leg.current_A**2), means(lambda leg: leg.shaft_A_rad_s)
    whole = (asked.share, 1.0 - asked.share)
    rms = sqrt(float(np.dot(whole, heats)))
    power = np.concatenate([R * leg.current_A**2 + kE * leg.shaft_A_rad_s for leg in legs])
    current = piece.signal("current_A").copy()
    return Duty(
        design, asked, rms, sqrt(heats[0]), sqrt(heats[1]),
        max(float(np.abs(leg.current_A).max()) for leg in legs),
        design.limits.continuous_current_A, piece.limited,
        kE * float(np.dot(whole, gives)), float(power.max()), max(0.0, -float(power.min())),
        design.controller.period_s * np.arange(current.size, dtype=float), current, steady,
        _overload(design, asked, motion, sqrt(heats[1])), heating(design, rms),
    )  # fmt: skip


@dataclass(frozen=True)
class _Leg:
    """A part of a cycle, which comes so many times: current, and current times speed."""

    current_A: Floats
    shaft_A_rad_s: Floats
    times: int = 1

    @classmethod
    def of(cls, piece: Piece, times: int = 1, ticks: int | None = None) -> "_Leg":
        """Of a piece, or its first ticks."""
        current, speed = (piece.signal(name)[:ticks] for name in ("current_A", "motor_speed_rad_s"))
        return cls(current.copy(), current * speed, times)


Legs = tuple[_Leg, ...]


def _cycle(design: Design, asked: Asked) -> tuple[Piece, Legs, Legs, bool]:
    """Steady motion, motion and rest of a cycle, and whether the motion is steady.

    That is where the slowest pole has fallen to `STEADY` and, with all that is not linear, the rms current of
    as long again is the same; counts of a sensor let that of single periods differ for ever. The rest goes on
    from there, and the motion begins from the rest; one too short to forget that is followed with its rest
    until the rms current of a cycle is the same again, or for as long as the motion itself was.
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
    first = wait = max(PERIODS * taken // periods, ceil(settling) if settling < inf else 0)
    heats = list[float]()  # mean squares of the current since the last doubling
    while True:
        while gone < wait and drive.work < MOST_WORK:
            piece, gone = _went_well(drive.advance(taken)), gone + taken
            heats.append(float(np.mean(piece.signal("current_A") ** 2)))
        rms = sqrt(np.mean(heats)) if before < inf else sqrt(heats[-1])  # at first it settles
        steady = abs(rms - before) <= STEADY * rms
        if steady or drive.work >= MOST_WORK:
            break
        wait, before, heats = 2 * gone, rms, []
    if asked.share == 1.0:
        return piece, (_Leg.of(piece),), (), steady
    moving, moves = max(taken, round(asked.share * asked.cycle_s / Ts)), drive.p.copy()
    begins = min(moving, taken * max(1, min(ceil(first / taken), MOST_TICKS // taken)))
    times, more = divmod(moving - begins, taken)
    motion = (_Leg.of(piece, times),) * (times > 0) + (_Leg.of(piece, ticks=more),) * (more > 0)

    def rest() -> Legs:
        drive.command(0.0)
        ticks = min((1.0 - asked.share) * asked.cycle_s / Ts, float(MOST_TICKS))
        there = (_Leg.of(_went_well(drive.advance(max(1, round(ticks))))),)
        drive.p[:] = moves
        return there

    if more:
        drive.advance(more)
    still, before, until = rest(), inf, drive.work + gone
    while True:
        parts = (drive.advance(min(taken, begins - k)) for k in range(0, begins, taken))
        begun = tuple(_Leg.of(_went_well(part)) for part in parts)
        if motion:  # long enough to forget how it began
            return piece, begun + motion, still, steady
        still = rest()
        rms = sqrt(sum(float(leg.current_A @ leg.current_A) for leg in begun + still))
        if abs(rms - before) <= STEADY * rms or drive.work >= until:
            return piece, begun, still, steady
        before = rms


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


def _overload(design: Design, asked: Asked, motion: Legs, held: float) -> Overload | None:
    """The first-order state of (i/i_cont)^2 over motion and rest, repeated for ever."""
    tau, Ts = design.limits.overload_time_s, design.controller.period_s
    if tau is None:
        return None
    rated, a = design.limits.continuous_current_A, 1.0 - Ts / tau
    moving_s = Ts * sum(leg.times * leg.current_A.size for leg in motion)
    rest_s = moving_s * (1.0 / asked.share - 1.0)
    still, cooled = (held / rated) ** 2, exp(-rest_s / tau)
    driven = (Ts / tau * (leg.current_A / rated) ** 2 for leg in motion)
    gained = [np.array([*accumulate(each.tolist(), lambda x, more: a * x + more)]) for each in driven]
    decay = [a ** (np.arange(each.size) + 1.0) for each in gained]

    def cycle(x: float) -> tuple[float, float]:
        """Largest in the cycle that begins with x, in the first or last time of each leg; its end."""
        most = x
        for leg, more, left in zip(motion, gained, decay, strict=True):
            kept = left[-1] ** (leg.times - 1)
            last = kept * x + more[-1] * (1.0 - kept) / (1.0 - left[-1])
            most = max(most, *(float((left * begin + more).max()) for begin in (x, last)))
            x = float(left[-1] * last + more[-1])
        end = still + (x - still) * cooled
        return max(most, end), end

    start = cycle(0.0)[1]
    slope = cycle(1.0)[1] - start  # of the state after a cycle over that before
    settled = start / (1.0 - slope)
    peak, _ = cycle(settled)
    if peak < 1.0:
        return Overload(peak, None)
    cycles = bisect_left(range(MOST_CYCLES), 1.0, key=lambda k: cycle(settled * (1.0 - slope**k))[0])
    if asked.share < 1.0:
        return Overload(peak, (cycles + 1) * (moving_s + rest_s))
    one = _period(asked, Ts, gained[0].size)
    over = int(np.argmax(decay[0] * settled * (1.0 - slope**cycles) + gained[0] >= 1.0))
    return Overload(peak, (cycles * gained[0].size + (over // one + 1) * one) * Ts)


def _period(asked: Asked, Ts: float, taken: int) -> int:
    """Ticks of a period, of those of all that are taken."""
    return taken // max(1, round(taken * Ts * asked.frequency_hz))


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
