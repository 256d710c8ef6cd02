"""What the instruments of the virtual bench make of what happened: noise, shared errors, counts, clocks."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from scipy.signal import lfilter

from actuator_lti.types import Floats
from analyses.records.campaign_file import Instruments
from analyses.records.record import Record, RowCounts
from examples.virtual_bench.campaign import TrueRun

PAPER_BOUNDS = Instruments(
    torque_full_scale_Nm=10.0, torque_accuracy=0.005, current_gain=0.005, current_offset_A=0.002
)


@dataclass(frozen=True, kw_only=True)
class BenchInstruments:
    """The bench's instruments: bounds of their shared errors (``bounds``), noise (rms) and resolution.

    The torque sensor is the paper's: 10 N m, 0.5 %. The drive's current measurement is assumed to be good for
    0.5 % and 2 mA; the encoder has 1024 counts per turn (IE3-256), and the drive logs the speed as the
    difference of counts over the log's period. Noise of the torque sensor is correlated over
    ``torque_noise_time_s``.
    """

    bounds: Instruments = field(default_factory=lambda: PAPER_BOUNDS)
    current_noise_A: float = 0.03
    current_step_A: float = 1e-3
    torque_noise_Nm: float = 0.01
    torque_noise_time_s: float = 0.01
    torque_step_Nm: float = 1e-3
    counts_per_rev: int = 1024
    sensor_period_s: float = 2e-3
    clock_offset_s: float = 0.3
    clock_rate: float = 1e-4


@dataclass(frozen=True, kw_only=True)
class DrawnErrors:
    """The shared errors of one seed: what an instrument's maker would not tell."""

    torque_at_zero_Nm: float
    torque_at_full_scale_Nm: float
    current_gain: float
    current_offset_A: float
    torque_constant_gain: float
    clock_rate: float


@dataclass(frozen=True, kw_only=True)
class RunLogs:
    """The two logs of one run; the sensor's clock is its own."""

    id: str
    speed_setting_rad_s: float
    load_setting_Nm: float
    drive: Record
    sensor: Record
    sensor_offset_s: float


def measure_bench(
    runs: tuple[TrueRun, ...], seed: int, instruments: BenchInstruments | None = None
) -> tuple[tuple[RunLogs, ...], DrawnErrors]:
    """The logs of a campaign as recorded with one set of instruments, and their shared errors.

    ``seed`` decides these, one child of it a run decides its noise and its sensor's clock.
    """
    instruments = BenchInstruments() if instruments is None else instruments
    first, *children = np.random.default_rng(seed).spawn(len(runs) + 1)
    errors = _draw(instruments, first)
    logs = [_logs(run, instruments, errors, rng) for run, rng in zip(runs, children, strict=True)]
    return tuple(logs), errors


def _draw(instruments: BenchInstruments, rng: np.random.Generator) -> DrawnErrors:
    bounds = instruments.bounds
    torque = bounds.torque_accuracy * bounds.torque_full_scale_Nm
    zero, full, gain, offset, constant, rate = rng.uniform(-1.0, 1.0, 6)
    return DrawnErrors(
        torque_at_zero_Nm=float(torque * zero),
        torque_at_full_scale_Nm=float(torque * full),
        current_gain=float(bounds.current_gain * gain),
        current_offset_A=float(bounds.current_offset_A * offset),
        torque_constant_gain=float(bounds.torque_constant * constant),
        clock_rate=float(instruments.clock_rate * rate),
    )


def _logs(
    run: TrueRun, instruments: BenchInstruments, errors: DrawnErrors, rng: np.random.Generator
) -> RunLogs:
    offset = float(rng.uniform(0.0, 1.0) * instruments.clock_offset_s)
    return RunLogs(
        id=run.id,
        speed_setting_rad_s=run.speed_setting_rad_s,
        load_setting_Nm=run.load_setting_Nm,
        drive=_drive_log(run, instruments, errors, rng),
        sensor=_sensor_log(run, instruments, errors, offset, rng),
        sensor_offset_s=offset,
    )


def _drive_log(
    run: TrueRun, instruments: BenchInstruments, errors: DrawnErrors, rng: np.random.Generator
) -> Record:
    gain = (1.0 + errors.current_gain) * (1.0 + errors.torque_constant_gain)
    current = gain * run.current_A + errors.current_offset_A
    current = current + instruments.current_noise_A * rng.standard_normal(len(current))
    count = 2.0 * np.pi / instruments.counts_per_rev
    start = float(rng.uniform(0.0, count))
    angle = np.floor((run.angle_rad + start) / count) * count
    speed = np.diff(angle, prepend=angle[0]) / np.diff(
        run.time_s, prepend=2.0 * run.time_s[0] - run.time_s[1]
    )
    signals = {"current": _rounded(current, instruments.current_step_A), "speed": speed, "angle": angle}
    return _record(f"run{run.id}_drive", run.time_s, signals)


def _sensor_log(
    run: TrueRun, instruments: BenchInstruments, errors: DrawnErrors, offset: float, rng: np.random.Generator
) -> Record:
    """The sensor's clock starts ``offset`` after the drive's and runs ``1 + clock_rate`` times as fast."""
    period = instruments.sensor_period_s
    rate = 1.0 + errors.clock_rate
    own = np.arange(0.0, (run.time_s[-1] - offset) * rate, period)
    true = np.interp(offset + own / rate, run.time_s, run.torque_Nm)
    share = true / instruments.bounds.torque_full_scale_Nm
    line = errors.torque_at_zero_Nm * (1.0 - share) + errors.torque_at_full_scale_Nm * share
    keep = float(np.exp(-period / instruments.torque_noise_time_s))
    white = rng.standard_normal(len(own)) * np.sqrt(1.0 - keep**2) * instruments.torque_noise_Nm
    noise = np.asarray(lfilter([1.0], [1.0, -keep], white))
    return _record(
        f"run{run.id}_torque", own, {"torque": _rounded(true + line + noise, instruments.torque_step_Nm)}
    )


def _rounded(values: Floats, step: float) -> Floats:
    return np.round(values / step) * step if step > 0.0 else values


def _record(name: str, time_s: Floats, signals: dict[str, Floats]) -> Record:
    units = {"current": "A", "speed": "rad/s", "angle": "rad", "torque": "N*m"}
    return Record(
        name=name,
        time_s=time_s,
        signals=MappingProxyType(signals),
        units=MappingProxyType({key: units[key] for key in signals}),
        counts=RowCounts(rows_in=len(time_s), rows_out=len(time_s)),
    )
