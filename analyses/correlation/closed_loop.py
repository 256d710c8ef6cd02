"""The model driven by a record's own command, load and supply."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from actuator_lti.design import with_values
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.correlation.compare import SignalComparison, compare_signals
from analyses.identification.differentiation import filtered_motion
from analyses.records.consistency import Finding, check_record
from analyses.records.prepare import prepared
from analyses.records.record import Record

if TYPE_CHECKING:
    from nonlinear import State
    from nonlinear.loads import LoadMoment

FloatArray = NDArray[np.float64]

LOADS = {"rotary": "torque", "linear": "load_force"}
UNITS = {
    "angle": "rad",
    "output_angle": "rad",
    "position": "m",
    "speed": "rad/s",
    "velocity": "m/s",
    "current": "A",
    "voltage": "V",
    "force": "N",
}
COMMANDS = {
    ("rotary", "position"): "reference",
    ("linear", "position"): "position_reference",
    ("rotary", "velocity"): "speed_reference",
    ("linear", "velocity"): "velocity_reference",
    ("rotary", "current"): "current_reference",
    ("linear", "current"): "current_reference",
    ("rotary", "voltage"): "voltage_reference",
    ("linear", "voltage"): "voltage_reference",
}
"""The signal that commands a drive, by its axis and its outermost stage."""
VELOCITY_CUTOFF_HZ = 100.0


@dataclass(frozen=True, kw_only=True)
class CorrelationResult:
    """The comparison of every signal that the record and the model share.

    ``limits`` tells for each limiter what share of the simulated time it was active. ``notes`` tells what was
    done to the record, and what the model was given. ``used`` tells for each signal what it was used for,
    ``findings`` whether the record agrees with itself and with the design's limits.
    """

    record: str
    design: str
    signals: tuple[SignalComparison, ...]
    limits: dict[str, float]
    notes: tuple[str, ...]
    counts: str
    sha256: str
    source: Record
    used: Mapping[str, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    def __getitem__(self, name: str) -> SignalComparison:
        for signal in self.signals:
            if signal.name == name:
                return signal
        raise InputError(
            f'no signal "{name}"; there are: {", ".join(s.name for s in self.signals)}', self.record
        )


def correlate_record(
    design: Design,
    record: Record,
    *,
    derive_velocity: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> CorrelationResult:
    """Simulate the design with a record's command and compare every signal.

    Parameters
    ----------
    design : Design
    record : Record
        Needs the command of the design's outermost stage: ``reference`` (output angle, rad) or
        ``position_reference`` (m, linear axis) of a position loop, else that of speed, current or voltage. A
        ``torque`` signal is the hinge moment at the output, a ``supply`` signal the bus voltage (its median
        becomes the voltage limit). Compared are, where recorded: angle, output_angle or position, speed or
        velocity, current, voltage, force. The force of a drive with an ideal source is its gain times the
        voltage.
    derive_velocity : bool
        Where no speed was recorded, compare with the derivative of the recorded position (4th-order
        Butterworth at 100 Hz forward and backward, central differences).
    progress : callable, optional

    Raises
    ------
    InputError
        If the record holds no command, or nothing to compare.
    """
    record = prepared(record)
    notes = list(record.notes)
    findings = check_record(design, record)
    measured = measured_signals(design, record, derive_velocity, notes)
    if not measured:
        raise InputError(f"nothing to compare; known signals: {', '.join(UNITS)}", where=record.name)
    modelled, limits = model_signals(design, record, measured, notes, progress)
    signals = tuple(
        compare_signals(name, UNITS[name], record.time_s, values, modelled[name])
        for name, values in measured.items()
    )
    return CorrelationResult(
        record=record.name,
        design=design.name,
        signals=signals,
        limits=limits,
        notes=tuple(notes),
        counts=str(record.counts),
        sha256=record.sha256,
        source=record,
        used=_used(design, record, measured),
        findings=findings,
    )


def _used(design: Design, record: Record, measured: Mapping[str, FloatArray]) -> dict[str, str]:
    used = {name: "compared" for name in measured if name in record.signals}
    command = command_of(design, record)
    if command is not None:
        used[command[0]] = "command"
    used |= {name: "load" for name in (LOADS[design.axis],) if name in record.signals}
    used |= {"supply": "supply", "enable": "enabled part"}
    if "force" in measured and "force" not in record.signals:
        used["voltage"] = "force, by the source's gain"
    return {name: text for name, text in used.items() if name in record.signals}


def command_name(design: Design) -> str:
    """The signal that commands a design's drive: that of its outermost stage."""
    return COMMANDS[design.axis, design.controller.outermost]


def command_of(design: Design, record: Record) -> tuple[str, FloatArray] | None:
    """The command of a record that the design's drive takes: its signal and values; None without one."""
    name = command_name(design)
    return (name, record[name]) if name in record.signals else None


def measured_signals(
    design: Design, record: Record, derive: bool = False, notes: list[str] | None = None
) -> dict[str, FloatArray]:
    """The recorded signals that the model has too; with ``derive``, a speed from the position as well.

    A signal that is zero throughout is left out.
    """
    notes = [] if notes is None else notes
    found = {name: record[name] for name in UNITS if name in record.signals}
    for name in [name for name, values in found.items() if not np.any(values)]:
        del found[name]
        notes.append(f"{name} is zero throughout: not compared")
    gain = design.effective_motor.source_gain_Nm_V
    if design.axis == "linear":
        place, rate = "position", "velocity"
        if "force" not in found and "voltage" in found and gain is not None:
            found["force"] = gain * found["voltage"]
            notes.append(f"measured force: {gain:g} N/V times the recorded voltage")
    else:
        place, rate = ("angle" if "angle" in found else "output_angle"), "speed"
    if derive and rate not in found and place in found:
        cutoff = min(VELOCITY_CUTOFF_HZ, 0.2 / record.period_s)
        motion = filtered_motion(found[place], record.period_s, cutoff_hz=cutoff, order=4)
        ratio = design.total_ratio if place == "output_angle" else 1.0
        found[rate] = ratio * motion.velocity
        notes.append(f"measured {rate}: derivative of the {place}, filtered at {cutoff:g} Hz without phase")
    return found


def _with_supply(design: Design, record: Record, notes: list[str]) -> Design:
    if "supply" not in record.signals:
        return design
    level = float(np.median(record["supply"]))
    spread = float(np.std(record["supply"]))
    notes.append(f"supply: the median of the record, {level:.4g} V (std {spread:.2g} V)")
    return with_values(design, {"limits.voltage": level}, check=False)


def model_signals(
    design: Design,
    record: Record,
    measured: dict[str, FloatArray],
    notes: list[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[dict[str, FloatArray], dict[str, float]]:
    """The model's signals at a regular record's times, and the limiters' shares of the time.

    Parameters
    ----------
    design, record
        As for `correlate_record`.
    measured : dict
        The signals wanted; the simulation starts from the position among them, at rest.
    notes : list of str, optional
        What was done is added to it.
    """
    from nonlinear import commands, simulate

    command = command_of(design, record)
    if command is None:
        wanted = command_name(design)
        raise InputError(f'no command: the signal "{wanted}" is needed for a {design.axis} axis', record.name)
    notes = [] if notes is None else notes
    design = _with_supply(design, record, notes)
    time = record.time_s - record.time_s[0]
    design, load = _load(design, record, time, notes)
    period = design.controller.period_s
    run = simulate(
        design,
        commands.sampled(time, command[1], where=record.name),
        float(time[-1]) + 2.0 * period,
        load,
        initial=_initial(design, measured),
        progress=progress,
    )
    gain = design.effective_motor.source_gain_Nm_V
    series = {
        "angle": run.motor_angle_rad,
        "output_angle": run.output_angle_rad,
        "position": run.output_angle_rad,
        "speed": run.motor_speed_rad_s,
        "velocity": run.motor_speed_rad_s / design.total_ratio,
        "current": run.current_A,
        "voltage": run.voltage_V,
        "force": run.voltage_V * (1.0 if gain is None else gain),
    }
    notes.append(f"model: {len(run.time_s)} ticks of {period * 1e6:g} us, command linear between samples")
    limits = {name: use.fraction for name, use in run.limits.items()}
    return {name: np.interp(time, run.time_s, series[name]) for name in measured}, limits


def _load(design: Design, record: Record, time: FloatArray, notes: list[str]) -> tuple[Design, LoadMoment]:
    """The recorded load, which holds all of it; without one, the design's own slope and gravity act."""
    from nonlinear import loads

    name, own = LOADS[design.axis], []
    if design.load.moment_slope_Nm_rad:
        own.append("load.moment_slope")
    if design.load.gravity is not None:
        own.append("load.gravity")
    if name not in record.signals:
        notes.extend(f"load: the design's {key} acts" for key in own)
        return design, loads.constant(0.0)
    notes.extend(f"the recorded load holds all of it: the design's {key} is not added" for key in own)
    bare = replace(design, load=replace(design.load, gravity=None, moment_slope_Nm_rad=0.0))
    return bare, loads.series(time, record[name])


def _initial(design: Design, measured: dict[str, FloatArray]) -> State:
    """The state at the record's first sample, as far as it tells."""
    from nonlinear import State

    ratio = design.total_ratio
    place = 0.0
    if "angle" in measured:
        place = float(measured["angle"][0])
    for name in ("output_angle", "position"):
        if name in measured and "angle" not in measured:
            place = ratio * float(measured[name][0])
    return State(motor_angle_rad=place)
