"""The model driven by a record's own command, load and supply."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats, Progress
from analyses.correlation import driving
from analyses.correlation.between_ticks import likeliest_s, signals_at
from analyses.correlation.compare import SignalComparison, compare_signals
from analyses.correlation.following import Followed, followed, following_finding
from analyses.records.consistency import check_record
from analyses.records.differentiation import filtered_motion, lowest_cutoff_hz
from analyses.records.finding import Finding, because
from analyses.records.inputs import InputUse, account, lacking
from analyses.records.naming import KNOWN_UNITS, LOADS, PLACES
from analyses.records.record import Record, period_of, prepared
from nonlinear import State, Trajectory, commands, simulate

AXIS_SIGNALS = {
    "rotary": ("angle", "output_angle", "speed", "current", "voltage"),
    "linear": ("position", "velocity", "current", "voltage", "force"),
}
"""What a record of an axis may hold that the model has too."""
VELOCITY_CUTOFF_HZ = 100.0
FIRST_ROWS = 50
ANSWERS = (*PLACES, "speed", "velocity", "current", "force")
"""What tells when a step of the command acted, the surest first."""
STEP_ROUNDS = 6


@dataclass(frozen=True, kw_only=True)
class CorrelationResult:
    """The comparison of every signal that the record and the model share."""

    record: str
    design: str
    signals: Mapping[str, SignalComparison]
    limits: dict[str, float]  # share of the simulated time in which each limiter was active
    notes: tuple[str, ...]  # what was done to the record, and what the model was given
    counts: str
    sha256: str
    source: Record = field(repr=False)
    used: Mapping[str, str] = field(default_factory=dict, repr=False)  # what each signal was used for
    findings: tuple[Finding, ...] = ()  # whether the record agrees with itself and with the design's limits

    @property
    def inputs(self) -> tuple[InputUse, ...]:
        """The record's columns, and what each was used for."""
        return account(self.source, self.used)

    def __getitem__(self, name: str) -> SignalComparison:
        if name not in self.signals:
            raise InputError(f'no signal "{name}"; there are: {", ".join(self.signals)}', self.record)
        return self.signals[name]


def correlate_record(
    design: AnyDesign, record: Record, *, command: str | None = None, progress: Progress = None
) -> CorrelationResult:
    """Simulate the design with a record's command and compare every signal.

    The record needs a command: of position (``reference``, output angle; ``position_reference`` on a linear
    axis), of speed (``speed_reference``, at the motor; ``velocity_reference``), of current, torque or
    voltage. The outermost one that is recorded drives the model, whose loops outside it do not act; or
    ``command``, where ``"voltage"`` is the measured voltage of the motor. A ``torque`` signal is the load
    torque at the output, ``supply`` the bus voltage (see `driving.supply_of`).

    Compared are, where recorded: angle, output_angle or position, speed or velocity (else the derivative of
    either position: 4th-order Butterworth at 100 Hz, or the lowest that a short record allows, forward and
    backward, central differences), current, voltage, force. The force of a drive with an ideal source is its
    gain times the voltage.

    Raises `InputError`: if the record holds no command, or nothing to compare.
    """
    record = prepared(record)
    design = record.drive(as_design(design))
    notes = list(record.notes)
    findings = check_record(design, record)
    with because({record.name: findings}):
        measured = measured_signals(design, record, True, notes)
        measured.pop(command or "", None)
        if not measured:
            known = ", ".join(AXIS_SIGNALS[design.axis])
            raise lacking(record, f"nothing to compare; known signals: {known}")
        driven, run, series = nearest_run(design, record, measured, progress, command)
    modelled, uncounted = _as_measured(design, record, measured, series), dict[str, Floats]()
    if design.angle_quantum_rad or design.output_quantum_rad:
        motor, output = driven.design.encoder, driven.design.output_encoder
        motor, output = replace(motor, counts_per_rev=None), replace(output, counts_per_rev=None)
        bare = replace(driven.design, encoder=motor, output_encoder=output)
        *_, without = _run_so(replace(driven, design=bare), record, measured, None)
        uncounted = _as_measured(design, record, measured, without)
    if (follows := with_zero(design, record, followed(design, record, modelled, command))) is not None:
        findings += (following_finding(design, follows),)
    outermost = driven.stage == design.controller.outermost
    used = dict.fromkeys(measured, "compared") | {LOADS[design.axis]: "load", "enable": "enabled part"}
    used[driven.signal] = "command" if outermost else f"{driven.stage} command"
    if design.effective_motor.source_gain_Nm_V is None:
        used["supply"] = "supply"
    if "force" in measured and "force" not in record.signals:
        used["voltage"] = "force, by the source's gain"
    at_s, units = record.time_s, KNOWN_UNITS
    signals = {
        name: compare_signals(name, units[name], at_s, own, modelled[name], uncounted.get(name))
        for name, own in measured.items()
    }
    return CorrelationResult(
        record=record.name,
        design=design.name,
        signals=signals,
        limits={name: use.fraction for name, use in run.limits.items()},
        notes=(*notes, *driven.notes),
        counts=str(record.counts),
        sha256=record.sha256,
        source=record,
        used={name: text for name, text in used.items() if name in record.signals},
        findings=findings,
    )


def measured_signals(
    design: Design, record: Record, derive: bool = False, notes: list[str] | None = None
) -> dict[str, Floats]:
    """The recorded signals that the model has too; with ``derive``, a speed from the position as well.

    A signal that is zero throughout is left out.
    """
    notes = [] if notes is None else notes
    there = {name: record[name] for name in AXIS_SIGNALS[design.axis] if name in record.signals}
    result = {name: values for name, values in there.items() if values @ values > 0.0}
    notes += [f"{name} is zero throughout: not compared" for name in there if name not in result]
    gain, place, rate = design.effective_motor.source_gain_Nm_V, "position", "velocity"
    if design.axis == "rotary":
        place, rate = ("angle" if "angle" in result else "output_angle"), "speed"
    elif "force" not in result and "voltage" in result and gain is not None:
        result["force"] = gain * result["voltage"]
        notes.append(f"measured force: {gain:g} N/V times the recorded voltage")
    if derive and rate not in result and place in result:
        result[rate], cutoff = _rate_of(design, place, result[place], record.period_s)
        notes.append(f"{rate}: derivative of either {place}, filtered at {cutoff:.4g} Hz without phase")
    return result


def _as_measured(
    design: Design, record: Record, measured: Mapping[str, Floats], series: Mapping[str, Floats]
) -> dict[str, Floats]:
    """The signals of a run that are measured; a rate is taken from the place as that of the record is."""
    modelled = {name: series[name] for name in measured}
    for rate in {"speed", "velocity"} & measured.keys() - record.signals.keys():
        place = next(name for name in PLACES if name in measured)
        modelled[rate] = _rate_of(design, place, modelled[place], record.period_s)[0]
    return modelled


def _rate_of(design: Design, place: str, values: Floats, period_s: float) -> tuple[Floats, float]:
    """The motor's speed, or a linear axis's, by a place, and the cut-off: as low as so few rows allow."""
    cutoff = max(VELOCITY_CUTOFF_HZ, lowest_cutoff_hz(len(values), period_s, 4))
    cutoff = min(cutoff, 0.2 / period_s)
    motion = filtered_motion(values, period_s, cutoff_hz=cutoff, order=4)
    return motion.velocity * (design.total_ratio if place == "output_angle" else 1.0), cutoff


def model_signals(design: Design, record: Record, measured: Mapping[str, Floats]) -> dict[str, Floats]:
    """The model's signals at a regular record's times.

    ``measured`` are the signals wanted; the simulation starts from what their first samples show.
    """
    series = nearest_run(design, record, measured)[2]
    return {name: series[name] for name in measured}


def with_zero(design: Design, record: Record, one: Followed | None) -> Followed | None:
    """How a record fails to follow, with the zero of its position where that is most of it.

    The position is moved to where the loops hold it, and the drive simulated from there.
    """
    if one is None or not one.fails or one.stage != "position":
        return one

    def left(record: Record) -> Floats:
        model = model_signals(design, record, measured_signals(design, record))[one.place]
        return record[one.place][: len(model)] - model

    before = left(record)
    zero = float(np.median(before))
    after = left(replace(record, signals={**record.signals, one.place: record[one.place] - zero}))
    return replace(one, zero=zero) if 2.0 * float(after @ after) < float(before @ before) else one


def as_driven(design: Design, record: Record) -> Record:
    """The record with how a design's drive took its command, as that meets the record best.

    It stays so whatever drive is simulated with it: in a search each would have its steps where they suit it.
    """
    driven, *_ = nearest_run(design, record, measured_signals(design, record))
    early = np.full(len(record), np.nan)
    early[driven.steps] = driven.early_s
    return replace(record, between=driven.between, early_s=early)


_Modelled = tuple[driving.Driven, Trajectory, dict[str, Floats]]


def nearest_run(
    design: Design,
    record: Record,
    measured: Mapping[str, Floats],
    progress: Progress = None,
    command: str | None = None,
) -> _Modelled:
    """The reading of a command with which a run is nearest, its notes say what was done; run and signals."""
    readings = driving.readings(driving.needed_command(design, record, command), record)
    first, *others = (_run_so(one, record, measured, progress) for one in readings)
    return min((first, *others), key=lambda one: _unlikely(one, measured)) if others else first


def _unlikely(tried: _Modelled, measured: Mapping[str, Floats]) -> float:
    """How far a reading is from the record: one that finds more times has to be nearer (Schwarz, 1978)."""
    driven, _, series = tried
    rows = len(next(iter(measured.values())))
    misfit = np.log(max(_off(measured, series), 1e-300))
    return float(rows * len(measured) * misfit + len(driven.first) * np.log(rows))


def _run_so(
    driven: driving.Driven, record: Record, measured: Mapping[str, Floats], progress: Progress
) -> _Modelled:
    """The run of one reading and its signals, from the state in which the record begins."""
    notes = [*driven.notes]
    time, even = record.time_s - record.time_s[0], period_of(record) * np.arange(len(record))
    if (np.abs(time - even) <= 4.0 * np.spacing(np.abs(record.time_s).max())).all():
        time = even  # stamps of an epoch have few digits: a step of the command would miss its tick
    if driven.hold is not None:
        time = driven.hold.row_s * np.arange(len(record)) + driven.hold.ahead_s(driven.likely_s)
    supply = driving.supply_of(driven, record, time, notes)
    model, load = driving.load_of(driven.design, record, time, notes)
    period = model.controller.period_s
    duration = float(time[-1]) + 2.0 * period
    initial, moving = driving.first_states(driven, record, measured)

    def run(early_s: Floats, *, until: float = duration, at: State = initial, **more: Any) -> Trajectory:
        wanted = commands.sampled(*driving.at_ticks(driven, time, duration, early_s), where=record.name)
        return simulate(model, wanted, until, load, initial=at, **supply, **more)

    if moving is not initial:
        part = {name: values[:FIRST_ROWS] for name, values in measured.items()}
        until = float(time[:FIRST_ROWS][-1]) + 2.0 * period
        early = driven.likely_s
        rest, goes = (signals_at(model, run(early, until=until, at=at), time) for at in (initial, moving))
        if _off(part, goes) < _off(part, rest):
            initial = moving
            notes.append("the record begins in motion or under load, and so does the model")
    driven, made, series = _with_steps(driven, time, measured, partial(run, at=initial, progress=progress))
    notes.append(f"model: {len(made.time_s)} ticks of {period * 1e6:g} us, command {driven.between}")
    return replace(driven, notes=tuple(notes)), made, series


def _off(measured: Mapping[str, Floats], modelled: Mapping[str, Floats]) -> float:
    """Sum over the signals of the squared relative difference, over the measured rows."""
    pairs = [(values, modelled[name][: len(values)]) for name, values in measured.items()]
    return sum(float(np.sum((made - own) ** 2) / (own @ own)) for own, made in pairs if own @ own > 0.0)


def _with_steps(
    driven: driving.Driven, time: Floats, measured: Mapping[str, Floats], run: Callable[[Floats], Trajectory]
) -> _Modelled:
    """A run and its signals at the record's times, each step of the command at the tick that meets it best.

    The record says between which samples a step was written, the answer to it at which tick: from a tick
    after the later sample (written before it acts) to the earlier one.
    """
    tick, early = driven.design.controller.period_s, driven.likely_s
    ticks = None if driven.hold is None else 0.0
    made, hold = run(early), driven.hold
    more_s = hold.more_s if hold is not None and not hold.is_whole else None
    if more_s is not None and driven.early_s is not None:
        # what was found may be a little beyond the ends, but no row sees another voltage
        inside = float(np.clip(0.0, *more_s(early)))
        return replace(driven, early_s=early), made, signals_at(driven.design, made, time + inside, -inside)
    series = signals_at(driven.design, made, time, ticks)
    name = next((name for name in ANSWERS if name in measured), "")
    for _ in range(STEP_ROUNDS if driven.early_s is None and len(early) and name else 0):
        more = driving.earlier_s(driven, time, measured[name], series[name])
        if hold is None:
            moved = tick * np.clip(np.round((early + more) / tick), *ticks_early(driven.design, time))
        else:
            moved = early + tick * np.clip(np.round(more / tick), *hold.more_ticks(early))
        if np.array_equal(moved, early):
            break
        other = run(moved)
        if _off(measured, nearer := signals_at(driven.design, other, time, ticks)) >= _off(measured, series):
            break
        early, made, series = moved, other, nearer
    if more_s is not None:
        later = likeliest_s(driven.design, made, time, measured, more_s(early))
        early, series = early + later, signals_at(driven.design, made, time + later, ticks)
    return replace(driven, early_s=early), made, series


def later_s(design: Design, record: Record) -> tuple[float, float] | None:
    """Ends of how much later the rows of a hold may be; None where they are at the drive's ticks."""
    driven = driving.readings(driving.needed_command(design, record), record)[0]
    if driven.hold is None or driven.hold.is_whole:
        return None
    return driven.hold.more_s(driven.likely_s)


def ticks_early(design: Design, time_s: Floats) -> tuple[float, float]:
    """By how many ticks a step of the command comes before the row that shows it, at least and at most."""
    return -1.0, float(np.floor(np.median(np.diff(time_s)) / design.controller.period_s * (1.0 + 1e-9)))
