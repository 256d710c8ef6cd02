"""What drives the model over a record: the command and its stage, the load, the supply, the first state."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import isfinite
from typing import Any

import numpy as np
from scipy.interpolate import Akima1DInterpolator, CubicSpline

from actuator_lti.design.model import Command as CommandShape
from actuator_lti.design.model import Design
from actuator_lti.drive.steady import steady_voltage_V
from actuator_lti.errors import InputError
from actuator_lti.types import Floats, Ints
from analyses.records.holds import Hold, hold_of
from analyses.records.inputs import lacking
from analyses.records.naming import LOADS, PLACES
from analyses.records.record import HELD, SMOOTH, STRAIGHT, Record
from nonlinear import State, commands, loads
from nonlinear.loads import LoadTorque

STAGES = ("position", "velocity", "current", "voltage")
COMMANDS: Mapping[tuple[str, str], tuple[str, ...]] = {
    ("rotary", "position"): ("reference",),
    ("linear", "position"): ("position_reference",),
    ("rotary", "velocity"): ("output_speed_reference", "speed_reference"),
    ("linear", "velocity"): ("velocity_reference",),
    ("rotary", "current"): ("current_reference", "torque_reference"),
    ("linear", "current"): ("current_reference", "force_reference"),
    ("rotary", "voltage"): ("voltage_reference",),
    ("linear", "voltage"): ("voltage_reference",),
}
"""The signals that command a drive, by its axis and the stage that they go into."""
IN_MOTION = 0.02
FIRST_ROWS = 5
LEAST_FOR_A_SPLINE = 9
MOST_TOGETHER = 3  # jumps: five rows have four, and the slope that Akima's curve takes at the middle one


@dataclass(frozen=True, kw_only=True)
class Driven:
    """What a record commands."""

    signal: str
    stage: str  # it goes into
    values: Floats  # as the simulator takes them
    design: Design  # the drive from that stage on: under a current command no speed loop acts
    notes: tuple[str, ...] = ()
    together: int = 1  # jumps from row to row, between standstills, that are steps each and no curve
    between: str = SMOOTH
    early_s: Floats | None = None  # each step comes before its row, where that is known
    hold: Hold | None = None  # of a command whose steps are on a grid that the rows tell

    @cached_property
    def steps(self) -> Ints:
        """The first row behind each step."""
        return steps_at(self.values, self.together)

    @cached_property
    def first(self) -> Ints:
        """The first of the steps that come as much before their rows: neighbours, or all of one hold."""
        rows = len(self.values)
        return np.flatnonzero(np.diff(self.steps, prepend=-rows - 1) > (1 if self.hold is None else rows))

    @property
    def likely_s(self) -> Floats:
        """By how much each step comes before its row: as known, or where that is looked for from."""
        if self.early_s is not None:
            return self.early_s
        return np.zeros(len(self.steps)) if self.hold is None else self.hold.likely_s


def readings(driven: Driven, record: Record) -> list[Driven]:
    """How a command may go on between its samples where the drive's ticks are more; as the record has it.

    Jumps in neighbouring rows are a curve or steps; a curve is smooth, or the drive takes it in straight
    lines or, as from a field bus, held until the next sample. Where the rows tell a grid on which it jumps,
    it is held, and each jump on the grid or, of a sender that is not punctual, at any tick before its row
    (where more than a tick is left to them, or none but a clock that is off makes the grid: otherwise rows at
    all phases show that the jumps are on it).
    """
    early, tick_s = record.early_s, driven.design.controller.period_s
    held = replace(driven, together=len(record), between=HELD)
    row_s = float(record.time_s[-1] - record.time_s[0]) / max(len(record) - 1, 1)
    if (hold := hold_of(held.steps, len(record), row_s, tick_s)) is not None:
        anywhere = hold.room_s > tick_s or hold.tick_s != tick_s
        control = replace(driven.design.controller, period_s=hold.tick_s)  # by the record's clock
        on_grid = replace(held, design=replace(driven.design, controller=control), hold=hold)
        if early is None:
            return [on_grid, held] if anywhere else [on_grid]
        early_s = early[held.steps]
        return [replace(held if anywhere and not hold.holds(early_s) else on_grid, early_s=early_s)]
    found = [driven, replace(driven, together=MOST_TOGETHER)]
    if record.period_s > 1.5 * tick_s:
        found += [held, replace(driven, together=0, between=STRAIGHT)]
    other = [one for k, one in enumerate(found) if not k or len(one.steps) != len(found[k - 1].steps)]
    if early is not None:
        known = [one for one in other if np.array_equal(one.steps, np.flatnonzero(~np.isnan(early)))]
        other = [replace(one, early_s=early[one.steps]) for one in known]
    return [one for one in other if record.between in ("", one.between)] or [driven]


def command_names(design: Design) -> dict[str, str]:
    """Every signal that may command a design's drive, and its stage; the outermost first."""
    stages = [stage for stage in STAGES if stage in (*design.controller.stages, "voltage")]
    return {name: stage for stage in stages for name in COMMANDS[design.axis, stage]}


def command_of(design: Design, record: Record, signal: str | None = None) -> Driven | None:
    """The command of a record: the outermost one that it holds, or the ``signal`` that is asked for.

    With ``"voltage"`` the motor is driven by its measured voltage. None where the record holds no command.
    """
    design = record.drive(design)
    names, outermost = command_names(design), design.controller.outermost
    if signal is None:
        signal = next((name for name in names if name in record.signals), None)
        if signal is None:
            return None
    elif signal not in (names := names | {"voltage": "voltage"}):
        raise InputError(f'command "{signal}": one of {", ".join(names)}', where=design.name)
    values, stage, notes = record[signal], names[signal], []
    if signal == "speed_reference":
        values = values / design.total_ratio
    elif signal in ("torque_reference", "force_reference"):
        constant = design.effective_motor.torque_constant_Nm_A
        if constant is None:
            raise InputError(f"{signal}: needs motor.torque_constant", where=design.name)
        values, unit = values / constant, "N/A" if design.axis == "linear" else "N m/A"
        notes.append(f"command: {signal.replace('_', ' ')} over kM = {constant:g} {unit}")
    if stage != outermost:
        notes.append(f"command: {signal.replace('_', ' ')}; the loops outside the {stage} do not act")
        outside = STAGES[: STAGES.index(stage)]
        cascade = replace(design.controller, **dict.fromkeys(outside))  # type: ignore[arg-type]
        design = replace(design, controller=cascade, command=CommandShape())
    values = np.asarray(values, float)
    return Driven(signal=signal, stage=stage, values=values, design=design, notes=tuple(notes))


def needed_command(design: Design, record: Record, signal: str | None = None) -> Driven:
    """As `command_of`, refused where there is none."""
    driven = command_of(design, record, signal)
    if driven is None:
        first, *others = command_names(design)
        more = f" (or {', '.join(others)})" if others else ""
        message = f'no command: the signal "{first}" is needed for a {design.axis} axis{more}'
        raise lacking(record, message)
    return driven


def at_ticks(driven: Driven, time_s: Floats, duration_s: float, early_s: Floats) -> tuple[Floats, Floats]:
    """Times and values of the command at the drive's ticks.

    Through the samples goes a smooth curve, as a feed-forward takes the slope, or straight lines, which give
    it steps at the very instants of the record (see `readings`). A jump between two stretches that stand
    still is a step of the command, and comes ``early_s`` (one for each) before the later sample.
    """
    period = driven.design.controller.period_s
    ticks = np.asarray(np.arange(round(duration_s / period) + 1) * period, dtype=np.float64)
    values = np.empty_like(ticks)
    starts, ends = np.append(0, driven.steps), np.append(driven.steps, len(time_s))
    edges = np.searchsorted(ticks, time_s[starts] - np.append(0.0, early_s) - 1e-6 * period)
    edges[0] = 0
    if driven.between == HELD:
        return ticks, np.repeat(driven.values[starts], np.diff(edges, append=len(ticks)))
    for start, end, first, last in zip(starts, ends, edges, [*edges[1:], len(ticks)], strict=True):
        part = slice(start, end)
        points, at = (time_s[part], driven.values[part]), ticks[first:last]
        values[first:last] = np.interp(at, *points) if driven.between == STRAIGHT else _smooth(*points, at)
    return ticks, values


def _smooth(time_s: Floats, values: Floats, at_s: Floats) -> Floats:
    """A spline or Akima's curve, which misses every other sample less; beyond the ends it stands still."""
    inside = np.clip(at_s, time_s[0], time_s[-1])
    if len(values) < 3 or np.ptp(values) == 0.0:
        return np.interp(inside, time_s, values)
    akima = partial(Akima1DInterpolator, method="makima")
    between = slice(1, len(values) - 1 + len(values) % 2, 2)

    def missed(curve: Callable[..., Callable[[Floats], Floats]]) -> float:
        return float(np.linalg.norm(curve(time_s[::2], values[::2])(time_s[between]) - values[between]))

    curve = akima if len(values) < LEAST_FOR_A_SPLINE else min((akima, CubicSpline), key=missed)
    return np.asarray(curve(time_s, values)(inside), dtype=np.float64)


def steps_at(values: Floats, together: int = 1) -> Ints:
    """The first row behind each jump of the values, of at most so many ``together``, between standstills.

    >>> values = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.5, 2.0, 2.0])
    >>> steps_at(values).tolist(), steps_at(values, 2).tolist()
    ([2], [2, 5, 6])
    """
    moves = np.diff(values) != 0.0
    ends = np.flatnonzero(np.diff(np.concatenate([[False], moves, [False]])))
    count = ends[1::2] - ends[::2]
    return np.flatnonzero(moves)[np.repeat(count, count) <= together] + 1


def earlier_s(driven: Driven, time_s: Floats, measured: Floats, modelled: Floats) -> Floats:
    """By how much each step of the command came earlier than it was modelled, by a signal that answers it, s.

    From each step to the next one the answer moves with it, by its rate; a stretch of all the answers (the
    gains, the inertia, the clock) stands beside them, so that it is not taken for a time. Steps in
    neighbouring rows, or of one hold, come as much earlier, by what answers all of them.
    """
    rate, off = np.gradient(modelled, time_s), measured - modelled
    steps, first = driven.steps, driven.first
    begins = steps[first]
    at = np.repeat(np.arange(len(begins)), np.diff(begins, append=len(time_s)))  # the step before each row
    rows, before, starts = slice(begins[0], None), begins[at] - 1, begins - begins[0]
    moved, left = rate[rows] - rate[before], off[rows] - off[before]
    stretched = (time_s[rows] - time_s[before]) * moved
    sizes = np.add.reduceat(moved**2, starts)

    def shares(values: Floats) -> Floats:
        """How much of the motion after each step is in some values."""
        inside = np.add.reduceat(moved * values, starts)
        return np.divide(inside, sizes, np.zeros(len(begins)), where=sizes > 0.0)

    alone = stretched - shares(stretched)[at] * moved  # what no times make of a stretch
    if np.linalg.norm(alone) > len(alone) * np.finfo(float).eps * np.linalg.norm(stretched):
        left = left - float(alone @ left / (alone @ alone)) * stretched
    return np.repeat(shares(left), np.diff(first, append=len(steps)))


def supply_of(driven: Driven, record: Record, time_s: Floats, notes: list[str]) -> dict[str, Any]:
    """The recorded supply as `simulate` takes it; nothing without one, or for an ideal source.

    It limits the voltage. Where a loop sets the voltage itself (no current loop), that voltage is a duty
    ratio of the bus, so the supply scales it too: the loop's gain is the design's at ``limits.voltage``. A
    command in volts is taken as volts.
    """
    design = driven.design
    if "supply" not in record.signals or design.effective_motor.source_gain_Nm_V is not None:
        return {}
    values, control = record["supply"], design.controller
    scales = bool(control.stages and control.current is None and isfinite(design.limits.voltage_V))
    part = " and scales the loop's voltage" if scales else ""
    notes.append(f"supply: {values.min():.4g} to {values.max():.4g} V over time, limits the voltage{part}")
    return {"supply": commands.sampled(time_s, values, where=record.name), "supply_scales": scales}


def load_of(design: Design, record: Record, time_s: Floats, notes: list[str]) -> tuple[Design, LoadTorque]:
    """The recorded load, which holds all of it; without one, the design's own load torques act."""
    name, own = LOADS[design.axis], design.load.acting()
    if name not in record.signals:
        notes.extend(f"load: the design's {key} acts" for key in own)
        return design, loads.constant(0.0)
    notes.extend(f"the recorded load holds all of it: the design's {key} is not added" for key in own)
    series = loads.series(time_s, record[name], where=record.name)
    return replace(design, load=design.load.bare()), series


def first_states(driven: Driven, record: Record, measured: Mapping[str, Floats]) -> tuple[State, State]:
    """The state at the record's first sample: at rest there, or in the motion that the first samples show.

    In motion, or with a current, the controllers are settled: their integrals hold what is needed for it.
    """
    design = driven.design
    ratio, motor = design.total_ratio, design.effective_motor
    place = next((name for name in PLACES if name in measured), None)
    first = float(measured[place][0]) if place else 0.0
    rest = State(motor_angle_rad=first if place == "angle" else ratio * first)
    speed = 0.0
    for name, factor in (("velocity", ratio), ("speed", 1.0)):
        if name in measured:
            values = measured[name]
            early = float(np.median(values[:FIRST_ROWS]))
            speed = factor * early if abs(early) > IN_MOTION * float(np.max(np.abs(values))) else 0.0
    values, ideal = record.signals.get("current", np.zeros(1)), motor.source_gain_Nm_V is not None
    holds = float(np.median(np.abs(values[:FIRST_ROWS]))) > 0.1 * float(np.max(np.abs(values)))
    current = float(np.median(values[:FIRST_ROWS])) if not ideal and (speed or holds) else 0.0
    if speed == 0.0 and current == 0.0:
        return rest, rest
    volts = 0.0 if ideal else steady_voltage_V(design, current, speed)
    cascaded = design.controller.current is not None
    first = float(driven.values[0])
    return rest, replace(
        rest,
        motor_speed_rad_s=speed,
        current_A=current,
        current_integral_V=volts if cascaded else 0.0,
        velocity_integral=current if cascaded else volts,
        speed_command_rad_s=ratio * first if driven.stage == "velocity" else speed,
        current_command_A=first if driven.stage == "current" else current,
        voltage_V=first if driven.stage == "voltage" else volts,
    )
