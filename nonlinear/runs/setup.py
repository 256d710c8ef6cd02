"""What a drive is asked to do in a run, and how that is written into the run's row and tables."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from math import isfinite

import numpy as np
import numpy.typing as npt

from actuator_lti.bounds import RUN_TICKS
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, finite_number, positive_number, shown
from actuator_lti.start.public_arguments import asked
from actuator_lti.types import Compared, Floats
from nonlinear._kernels import layout as at
from nonlinear.bench.probe import Probe, write_probe
from nonlinear.commands import Command, numbers_of, write
from nonlinear.loads import LoadTorque, constant
from nonlinear.row.parameters import design_row
from nonlinear.runs.trajectory import State

CONTENT = 0.02  # of a command's range: so large a line above the Nyquist frequency is refused
STAGE_OF = {"w_ref": at.HAS_VELOCITY, "i_ref": at.HAS_CURRENT, "output": at.HAS_POSITION}
STATE_PLACES = {  # where a run begins with each number of a `State` (in the row), and ends with it
    "motor_angle_rad": (at.ANGLE_START, at.S_ANGLE),
    "motor_speed_rad_s": (at.SPEED_START, at.S_SPEED),
    "current_A": (at.CURRENT_START, at.S_CURRENT),
    "current_integral_V": (at.CURRENT_INTEGRATOR_START, at.S_CURRENT_INTEGRATOR),
    "velocity_integral": (at.VELOCITY_INTEGRATOR_START, at.S_VELOCITY_INTEGRATOR),
    "speed_command_rad_s": (at.SPEED_COMMAND_START, at.S_SPEED_COMMAND),
    "current_command_A": (at.CURRENT_COMMAND_START, at.S_CURRENT_REFERENCE),
    "voltage_V": (at.VOLTAGE_START, at.S_VOLTAGE),
}


@dataclass(eq=False)
class Tables(Compared):
    """All time series of one or many runs, end to end; a run knows offsets and lengths."""

    parts: list[Floats] = field(default_factory=list)
    size: int = 0

    def add(self, values: Floats) -> tuple[int, int]:
        """Append a series; returns its offset and length."""
        self.parts.append(np.ascontiguousarray(values, dtype=float))
        self.size += values.size
        return self.size - values.size, values.size

    def joined(self) -> Floats:
        return np.concatenate(self.parts) if self.parts else np.zeros(1)


@asked
@dataclass(frozen=True, kw_only=True)
class Reducers:
    """What to keep of a run beside final state, limit use and events.

    ``window_ticks, cycles``: length of the last window (and the one before it) in ticks, and whole periods of
    the fundamental in it (see `nonlinear.runs.reduced.whole_periods`); 0: no windows.
    ``harmonics``: correlated in the windows, 0 to 9.
    ``extremes``: minimum and maximum of every signal over the whole run.
    ``step_target_rad``: what a step asks for; of a drive without position loop the speed, current or voltage
    in its unit. Gives rise, peak and settling; 0: none.
    ``step_band``: settling band, relative to the target.
    """

    window_ticks: int = 0
    cycles: int = 1
    harmonics: int = 1
    extremes: bool = False
    step_target_rad: float = 0.0
    step_band: float = 0.02

    def write(self, row: Floats) -> None:
        """Write into a parameter row (or all rows of an array)."""
        if not 0 <= self.harmonics <= at.MAX_HARMONICS:
            raise InputError(f"harmonics = {self.harmonics}: must be 0 to {at.MAX_HARMONICS}")
        if self.window_ticks and not 0 < 2 * self.cycles < self.window_ticks:
            message = f"window of {self.window_ticks} ticks: must hold more than two ticks a period"
            raise InputError(f"{message} ({self.cycles} periods asked for)")
        row[..., at.WINDOW], row[..., at.CYCLES] = self.window_ticks, self.cycles
        row[..., at.HARMONICS], row[..., at.WITH_EXTREMES] = self.harmonics, self.extremes
        row[..., at.STEP_TARGET] = self.step_target_rad
        if finite_number("step_target_rad", self.step_target_rad):
            row[..., at.STEP_BAND] = positive_number("step_band", self.step_band)


@asked
@dataclass(frozen=True, kw_only=True)
class Run:
    """One run of a batch; the names are those of `nonlinear.simulate`."""

    design: AnyDesign
    command: Command
    duration_s: float
    load_Nm: float | LoadTorque = 0.0
    bias: Command | None = None
    probes: Sequence[Probe] = ()
    initial: State | None = None
    friction_on: bool = True
    limits_on: bool = True
    reducers: Reducers = Reducers()

    def row(self, tables: Tables) -> Floats:
        """The parameter row of this run; time series go into ``tables``."""
        design = as_design(self.design)
        row = _design_row(design, self.friction_on, self.limits_on).copy()
        row[at.TICKS] = ticks_of(self.duration_s, design.controller.period_s)
        for place, signal in ((at.COMMAND, self.command), (at.BIAS, self.bias)):
            if signal is not None:
                check_frequency(design, signal)
                _put_signal(row, place, signal, tables)
        _put_load(row, self.load_Nm, tables)
        _put_probes(row, self.probes, tables)
        put_state(row, self.initial or State())
        if 2 * self.reducers.window_ticks > row[at.TICKS]:
            message = f"window of {self.reducers.window_ticks} ticks: must fit twice into"
            raise InputError(f"{message} {row[at.TICKS]:.0f} ticks", where=design.name)
        self.reducers.write(row)
        return row


_kept_row = lru_cache(maxsize=16)(design_row)  # a design is mostly run more than once


def _design_row(design: Design, friction_on: bool, limits_on: bool) -> Floats:
    try:
        return _kept_row(design, friction_on=friction_on, limits_on=limits_on)
    except TypeError:  # a list in place of a tuple
        return design_row(design, friction_on=friction_on, limits_on=limits_on)


def ticks_of(duration_s: float, period_s: float) -> int:
    """Number of ticks in a duration, rounded; refuses a duration without any."""
    finite_number("duration_s", duration_s, "a finite number of seconds")
    ticks = round(min(duration_s / period_s, 1e18))
    RUN_TICKS.check(ticks, name=f"duration_s = {duration_s:g}")
    if ticks < 1:
        raise InputError(f"duration_s = {duration_s:g}: must hold at least one tick of {period_s:g} s")
    return ticks


def _put_signal(row: Floats, place: int, command: Command, tables: Tables) -> None:
    """Write a command at a place of the row, its table beside the others."""
    table = command.table(float(row[at.PERIOD]), int(row[at.TICKS]))
    offset, length = (0, 0) if table is None else tables.add(table)
    write(command, row, place, offset, length)


def check_frequency(design: Design, command: Command) -> None:
    """Refuse a command that the outermost loop, sampled, cannot follow in principle."""
    control = design.controller
    nyquist = 0.5 / control.period_of(control.outermost)
    sampled = control.outermost in ("position", "velocity")
    stage = f"the {control.outermost} loop" if sampled else "the drive"
    if command.highest_hz >= nyquist:
        message = f"command {command.kind}: {command.highest_hz:g} Hz: must be below the Nyquist frequency"
        raise InputError(f"{message} of {stage}, {nyquist:g} Hz", where=design.name)
    content = 0.0 if command.held else command.highest_content(nyquist)
    if content > CONTENT:
        words = f"a line of {100.0 * content:.2g} % of its range lies above the Nyquist frequency of {stage}"
        message = f"command {command.kind}: {words}, {nyquist:g} Hz"
        raise InputError(f"{message}: it would come back at a lower one; filter it first", where=design.name)


def _put_load(row: Floats, given: float | LoadTorque, tables: Tables) -> None:
    """Write the load torque; a plain number is a constant one."""
    load = given if isinstance(given, LoadTorque) else constant(given)
    row[at.LOAD] = load.constant_Nm
    row[at.LOAD_SLOPE] += load.slope_Nm_rad
    if load.series is not None:
        clock = float(row[at.PERIOD]), int(row[at.TICKS])
        table = load.series.table(*clock)
        values = load.series.values(*clock) if table is None else table
        row[at.LOAD_TABLE], row[at.LOAD_TABLE_LENGTH] = tables.add(values)


def put_torque(row: Floats, torque_Nm: npt.ArrayLike, tables: Tables) -> None:
    """Write an extra torque at the motor shaft: a number, or one value a tick."""
    values = numbers_of("disturbance_Nm", torque_Nm)
    if not values.size or not np.isfinite(values).all():
        raise InputError(f"disturbance_Nm = {shown(torque_Nm)}: must be finite numbers, at least one")
    row[at.TORQUE_TABLE], row[at.TORQUE_TABLE_LENGTH] = tables.add(values)


def put_supply(row: Floats, design: Design, supply: Command, scales: bool, tables: Tables) -> None:
    """Write a bus voltage over time; see `nonlinear.simulate`."""
    nominal = design.limits.voltage_V
    if scales and (design.controller.current is not None or not isfinite(nominal)):
        message = "supply_scales: needs a drive without a current loop, and a finite limits.voltage"
        raise InputError(message, where=design.name)
    table = supply.table(float(row[at.PERIOD]), int(row[at.TICKS]))
    if table is None or (table < 0.0).any():
        raise InputError("supply: voltages of 0 or more at times are needed", where=design.name)
    row[at.SUPPLY_TABLE], row[at.SUPPLY_TABLE_LENGTH] = tables.add(table)
    row[at.SUPPLY], row[at.SUPPLY_VOLTAGE] = at.SUPPLY_SCALES if scales else at.SUPPLY_LIMITS, nominal


def _put_probes(row: Floats, probes: Sequence[Probe], tables: Tables) -> None:
    seen = set()
    for probe in probes:
        if probe.point in seen:
            raise InputError(f"two probes at {probe.point}: one a point is allowed")
        seen.add(probe.point)
        if probe.point in STAGE_OF and not row[STAGE_OF[probe.point]]:
            raise InputError(f"probe point = {probe.point!r}: this design has no such stage")
        place = write_probe(probe, row)
        if isinstance(probe.injection, Command):
            _put_signal(row, place, probe.injection, tables)
        elif probe.injection is not None:
            series = tables.add(numbers_of("injection", probe.injection))
            row[place : place + 5] = at.TABLE, 1.0, 0.0, *series


def put_state(row: Floats, state: State) -> None:
    for name, value in vars(state).items():
        if name in STATE_PLACES or (name != "law" and value is not None):
            finite_number(f"initial.{name}", value)
    for name, (place, _) in STATE_PLACES.items():
        row[place] = getattr(state, name)
    if row[at.SOURCE]:
        row[at.CURRENT_START] = 0.0
    if row[at.ELASTIC_DRIVE]:
        angle, speed = state.motor_angle_rad / row[at.RATIO], state.motor_speed_rad_s / row[at.RATIO]
        behind = row[at.RATIO] / row[at.RATIO_TO_COUPLING]
        if state.output_angle_rad is not None:
            row[at.TWIST_START] = behind * (angle - state.output_angle_rad)
        output_speed = speed if state.output_speed_rad_s is None else state.output_speed_rad_s
        row[at.LOAD_SPEED_START] = behind * output_speed
    law, order = numbers_of("initial.law", state.law), int(row[at.OWN_STATES])
    if law.size:
        if law.size != order or not np.isfinite(law).all():
            given = shown(law.tolist())
            raise InputError(f"initial.law = {given}: allowed: {order} numbers, the states of the law")
        row[at.OWN_START : at.OWN_START + order] = law
