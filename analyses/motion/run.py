"""Command and load of one motion, and the motion."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from actuator_lti.bounds import TONES
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import straight
from actuator_lti.errors import InputError, whole_number
from actuator_lti.types import Progress
from analyses.motion.asked import KINDS, USUAL_CYCLES, Asked
from analyses.motion.settling import Conduct, conduct
from nonlinear import Trajectory, commands, loads, simulate
from nonlinear.commands import Command
from nonlinear.loads import LoadTorque
from nonlinear.runs.records import read_columns
from nonlinear.runs.trajectory import COMMAND_UNITS

USUAL_S = 1.0


@dataclass(frozen=True)
class Motion:
    """A motion that was asked for, and its rows."""

    design: Design
    asked: Asked
    run: Trajectory

    @cached_property
    def ended(self) -> Conduct:
        """What it ends in; of a drive that turns, without the torques that pass as well where it swings."""
        passing = self._passing_hz()
        own = conduct(self.run, self.design.validation.full_deflection_rad)
        if own.status != "limit cycle" or not passing:
            return own
        bare = motion(straight(self.design), replace(self.asked, csv=None, parquet=None)).ended
        names = " and ".join(passing)
        if bare.status == "becomes steady":
            often = " and ".join(f"{hertz:.3g} Hz" for hertz in passing.values())
            return replace(own, status="ripple", detail=f"{own.detail}, of the {names}, passing at {often}")
        return replace(own, detail=f"{own.detail}; without the {names} {bare.status}, {bare.said}")

    def _passing_hz(self) -> dict[str, float]:
        """How often a period of each torque that bends with the angle passes at the commanded speed."""
        if self.run.stage != "velocity":
            return {}
        motor, load = self.design.motor, self.design.load
        orders = {
            "cogging": bool(motor.cogging_Nm) * motor.cogging_periods * self.design.total_ratio,
            "gear error": bool(load.gear_error_Nm) * load.gear_error_periods,
            "gravity": float(load.gravity is not None),
        }
        turns = abs(float(self.run.reference_rad[-1])) / (2.0 * np.pi)
        return {name: turns * order for name, order in orders.items() if turns * order}

    @property
    def passed(self) -> bool | None:
        """False where it diverges; else a motion is not judged."""
        return False if self.ended.status == "diverging" else None


def motion(design: AnyDesign, asked: Asked, *, progress: Progress = None) -> Motion:
    """Simulate one motion, and write its rows where that is asked for.

    Raises `InputError`: for a command that does not fit the run, or a load that would not act in it.
    """
    design = as_design(design)
    unit, per_SI = COMMAND_UNITS[design.axis, design.controller.outermost]
    duration = asked.duration
    if asked.cycles is not None and asked.command != "stepped-sine":  # which has a duration of its own
        needed = asked.start + asked.cycles / asked.frequency
        if duration is not None and abs(duration - needed) > 1e-9 * needed:
            reason = f"--cycles {asked.cycles}, --duration {duration:g}: {asked.cycles} periods take"
            raise InputError(reason + f" {needed:g} s; allowed: one of the two options")
        duration = needed
    command = _command(design, asked, USUAL_S if duration is None else duration, unit, 1.0 / per_SI)
    seconds = duration
    if seconds is None:
        tabled = command.kind in ("stepped_sine", "recorded", "sampled")
        seconds = command.end_s if tabled and 0.0 < command.end_s < float("inf") else USUAL_S
    elif command.kind == "stepped_sine" and 0.0 < seconds < command.end_s * (1.0 - 1e-9):
        reason = f"--duration {seconds:g}: the stepped sine takes {command.end_s:.6g} s;"
        raise InputError(reason + " allowed: that or more, or fewer --count or --cycles")
    if asked.start >= seconds > 0.0 and asked.start > 0.0:
        reason = f"the run ends at {seconds:g} s; allowed: less, or --duration"
        raise InputError(f"--start {asked.start:g}: {reason}")
    run = simulate(
        design,
        command,
        seconds,
        _load(asked, seconds),
        bias=commands.ramp(asked.bias_rate / per_SI) if asked.bias_rate else None,
        friction_on=not asked.no_friction,
        limits_on=not asked.no_limits,
        energy=asked.energy,
        record_every=whole_number("every", asked.every),
        progress=progress,
    )
    if asked.csv is not None:
        run.to_csv(asked.csv)
    if asked.parquet is not None:
        run.to_parquet(asked.parquet)
    return Motion(design, asked, run)


def _command(design: Design, asked: Asked, duration: float, unit: str, scale: float) -> Command:
    """The command; ``scale`` is the unit of its amplitude in SI."""
    peak, start, frequency, count = asked.amplitude * scale, asked.start, asked.frequency, asked.count
    period, kind = design.controller.period_s, asked.command or "step"
    last = asked.to if asked.to is not None else 10.0 * frequency
    if asked.record is not None:
        return commands.recorded(asked.record, unit=unit, held=asked.held).later(start)
    if kind == "hold" and start > 0.0:
        raise InputError(f"--start {start:g}: a hold is there from the first tick on; use --command step")
    if kind in ("stepped-sine", "multisine"):
        if count < 1 or frequency <= 0.0 or last <= 0.0:
            raise InputError(f"--count {count}, --frequency {frequency:g}, --to {last:g}: must be positive")
        TONES.check(count)
        grid = np.geomspace(frequency, last, count).tolist()
        if kind == "stepped-sine":
            cycles = USUAL_CYCLES if asked.cycles is None else asked.cycles
            return commands.stepped_sine(peak, grid, cycles, period, settle_cycles=0).later(start)
        return commands.multisine(peak, grid, duration - start, period, seed=asked.seed).later(start)
    simple = {
        "hold": lambda: commands.hold(peak),
        "step": lambda: commands.step(peak, start),
        "ramp": lambda: commands.ramp(peak, start),
        "sine": lambda: commands.sine(peak, frequency, start_s=start),
        "triangle": lambda: commands.triangle(peak, frequency, start),
        "chirp": lambda: commands.chirp(peak, frequency, last, duration - start, start_s=start),
    }
    if kind not in simple:
        raise InputError(f"--command {kind}: must be one of {KINDS}")
    return simple[kind]()


def _load(asked: Asked, duration: float) -> LoadTorque:
    """The load; its file is on the clock of the record, whose first row is put at the start."""
    moment = loads.proportional(asked.load_slope, asked.load)
    if asked.load_file is None:
        return moment
    times, values = read_columns(asked.load_file, (0, 1))
    # The first time of a recorded command is where the run's clock has its zero
    shift = asked.start - (0.0 if asked.record is None else float(read_columns(asked.record, (0,))[0][0]))
    if not (times[0] + shift < duration and times[-1] + shift >= 0.0):
        span = f"its rows are from {times[0]:g} to {times[-1]:g} s, the run from {0.0 - shift:g}"
        clock = " on the record's clock" if shift else ""
        raise InputError(f"{span} to {duration - shift:g} s{clock}: no load would act", str(asked.load_file))
    series = loads.series(times + shift, values, where=str(asked.load_file)).series
    return replace(moment, series=series)
