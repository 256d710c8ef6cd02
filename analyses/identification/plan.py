"""Motions within a drive's limits that tell its values as closely as asked: the plan of an experiment."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.design.plant import reachable_speed
from actuator_lti.errors import InputError
from actuator_lti.types import Floats, Progress
from analyses.correlation.closed_loop import nearest_run
from analyses.estimation.fit import COVERAGE, Fit
from analyses.estimation.least_squares import Information, covariance_of, identifiable, information_of
from analyses.estimation.parameters import default_value
from analyses.identification.joint_model import JointModel, Rows
from analyses.identification.rows import record_rows
from analyses.records.naming import REFERENCES
from analyses.records.record import Record, RowCounts

SEGMENT_S = 4.0
RISE_S = 0.4
PERIOD_S = 1e-3
CYCLES = (1, 2, 4, 8, 16)
SHAPES = {
    "two sines": ((1.0, 1.0), (2.0, 0.3)),
    "triangle": ((1.0, 1.0), (3.0, -1.0 / 9.0), (5.0, 1.0 / 25.0)),
}
"""Harmonics of a segment and their sizes; the speed passes zero quickly, so that no drive sticks there."""
USED = 0.8  # of deflection, speed and current: the drive may differ from its design
DRAWS = 8
MOST_SEGMENTS = 60


@dataclass(frozen=True, kw_only=True)
class Segment:
    """One motion of 4 s from rest to rest, its peaks at the motor, and what a record of it would tell."""

    shape: str
    cycles: int
    amplitude: float
    speed: float
    drive_rms: float
    command: Floats = field(repr=False)
    information: Information = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The motions, one after the other, and the intervals that they are expected to give."""

    design: Design
    within: float  # what was asked
    noise: float
    measured: int  # records that are there already
    segments: tuple[Segment, ...]
    expected: Fit  # of the design's own values
    half_widths: dict[str, float]  # of the 95 % intervals over the value (offset: over the dry friction)
    time_s: Floats = field(repr=False)
    command: Floats = field(repr=False)  # of all motions, at the output

    @property
    def passed(self) -> bool:
        """Whether every interval is expected to be as small as asked."""
        return all(width <= self.within for width in self.half_widths.values())


def plan_motions(
    design: Design,
    *,
    within: float,
    noise: float,
    measured: JointModel | None = None,
    progress: Progress = None,
) -> Plan:
    """Choose motions, one after the other, until every interval is expected to be as small as asked.

    The next one is that which lowers the sum of the squared intervals, each over what was asked, most
    (A-optimal). Intervals follow from the rows that a fit makes of the simulated motion, and from noise
    that went the same way: the covariance is the fit's own, for a drive of the design's friction law (a
    bend that is too small to be sure widens what records then state). ``within`` is half of each 95 %
    interval, over the value; ``noise`` is white, of the recorded current (V: voltage, of a drive without
    one) at 1 kHz, rms; ``measured`` is what records tell that are there already.
    """
    if design.controller.position is None:
        raise InputError("a plan of motions needs a position loop", where=design.name)
    if not noise > 0.0:
        raise InputError("the noise of the recorded current is needed: --noise, or instruments.current_noise")
    if measured is not None and measured.form != "symmetric":
        raise InputError("a plan adds to records that were fitted with symmetric friction")
    family = list(product(SHAPES, CYCLES))
    made = []
    for k, (shape, cycles) in enumerate(family, 1):
        command, record = _largest(design, shape, cycles)
        made.append((shape, cycles, command, record, record_rows(design, record, "symmetric", None)))
        if progress is not None:
            progress(k, len(family))
    every = made[0][-1].names
    kept, _ = identifiable(np.concatenate([rows.w for *_, rows in made]), every)
    names = tuple(every[k] for k in kept)
    segments = [
        Segment(
            shape=shape,
            cycles=cycles,
            amplitude=float(np.max(np.abs(command))),
            speed=float(np.max(np.abs(rows.speed))),
            drive_rms=float(np.sqrt(np.mean(record[_drive(design)] ** 2))),
            command=command,
            information=_information(design, record, rows, kept, noise),
        )
        for shape, cycles, command, record, rows in made
    ]
    values = np.array([default_value(design, name) for name in names])
    size = np.array([abs(v) if v else default_value(design, "dry") for v in values]) * within / COVERAGE
    there = []
    for part in () if measured is None else measured.records:
        place = [part.names.index(name) if name in part.names else -1 for name in names]
        wide = np.column_stack([part.w, np.zeros(len(part.w))])[:, place]
        there.append(information_of(wide, part.noise))
    chosen = _chosen(segments, there, size)
    command = np.concatenate([one.command for one in chosen] or [np.zeros(0)])
    covariance = covariance_of([*there, *(one.information for one in chosen)])
    return Plan(
        design=design,
        within=within,
        noise=noise,
        measured=len(there),
        segments=tuple(chosen),
        expected=Fit(names=names, values=values, covariance=covariance),
        half_widths=dict(zip(names, (within * np.sqrt(np.diag(covariance)) / size).tolist(), strict=True)),
        time_s=PERIOD_S * np.arange(len(command), dtype=np.float64),
        command=command,
    )


def _chosen(segments: Sequence[Segment], there: Sequence[Information], size: Floats) -> list[Segment]:
    """The best segment again and again, alike ones together; a first one tells all values alone."""
    chosen: list[Segment] = []
    parts = list(there)

    def spread(one: Segment) -> float:
        return float(np.sum(np.diag(covariance_of([*parts, one.information])) / size**2))

    while len(chosen) < MOST_SEGMENTS:
        if parts and np.all(np.diag(covariance_of(parts)) <= size**2):
            break
        chosen.append(min(segments, key=spread))
        parts.append(chosen[-1].information)
    return sorted(chosen, key=segments.index)


def _largest(design: Design, shape: str, cycles: int) -> tuple[Floats, Record]:
    """The motion as large as deflection, speed and every other limit allow, and its simulated record."""
    time = PERIOD_S * np.arange(round(SEGMENT_S / PERIOD_S), dtype=np.float64)
    edge = np.minimum(np.minimum(time, time[-1] - time) / RISE_S, 1.0)
    turn = 2.0 * np.pi * cycles / SEGMENT_S * time
    wave = sum(size * np.sin(k * turn) for k, size in SHAPES[shape]) * np.sin(0.5 * np.pi * edge) ** 2
    wave = wave / np.max(np.abs(wave))
    rate = float(np.max(np.abs(np.gradient(wave, PERIOD_S)))) * design.total_ratio
    amplitude = USED * min(design.validation.full_deflection_rad, reachable_speed(design) / rate)
    own, name = design.limits, _drive(design)
    wanted, place = REFERENCES[design.axis], "position" if design.axis == "linear" else "angle"
    blank = dict.fromkeys((place, name), np.zeros(len(time)))
    for _ in range(24):
        asked = {wanted: amplitude * wave, **blank}
        bare = Record(name="plan", time_s=time, signals=asked, units={}, counts=RowCounts())
        _, run, series = nearest_run(design, bare, blank)
        drive = series[name]
        cool = float(np.sqrt(np.mean(drive**2))) <= USED * own.continuous_current_A
        small = float(np.max(np.abs(drive))) <= USED * own.peak_current_A
        if (name != "current" or (cool and small)) and not any(one.fraction for one in run.limits.values()):
            return amplitude * wave, replace(bare, signals={**asked, **{one: series[one] for one in blank}})
        amplitude *= USED
    raise InputError(f"no motion of {cycles / SEGMENT_S:g} Hz stays off the drive's limits", design.name)


def _drive(design: Design) -> str:
    return "voltage" if design.effective_motor.torque_constant_Nm_A is None else "current"


def _information(
    design: Design, record: Record, rows: Rows, kept: Sequence[int], noise: float
) -> Information:
    """What the rows of a motion tell where its drive signal has white noise, which goes the rows' way."""
    name, rng = _drive(design), np.random.default_rng(0)
    rests = []
    for _ in range(DRAWS):
        noisy = {**record.signals, name: record[name] + noise * rng.standard_normal(len(record))}
        own = record_rows(design, replace(record, signals=noisy), "symmetric", None)
        rests.append(own.y - rows.y)
    return information_of(rows.w[:, list(kept)], np.concatenate(rests))
