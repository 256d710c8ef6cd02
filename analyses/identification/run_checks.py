"""Does each run of a campaign agree with what is said of it: its speed, its load, its files?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from actuator_lti.design.model import Design
from analyses.identification.points import SteadyPoint
from analyses.records.campaign_file import Instruments
from analyses.records.campaign_import import ImportedRun, SetAside
from analyses.records.consistency import Finding, check_record
from analyses.records.factors import named_factor

SPEED_TOLERANCE = 0.05
LOAD_TOLERANCE = 0.10


@dataclass(frozen=True, kw_only=True)
class CheckedRuns:
    """Points that agree with what is said of their runs, and the runs that do not, with the reason."""

    points: tuple[SteadyPoint, ...]
    contradicting: tuple[SetAside, ...]
    findings: dict[str, tuple[Finding, ...]]


def check_runs(
    design: Design,
    runs: Sequence[ImportedRun],
    points: Sequence[SteadyPoint],
    instruments: Instruments,
) -> CheckedRuns:
    """Hold every run against its set speed and load, itself, and the design's limits.

    The speed may be off by 5 % of its setting, the load by 10 % and twice the sensor's accuracy.
    """
    by_id = {run.id: run for run in runs}
    shared = _shared_files(runs)
    good, bad, findings = [], [], {}
    for point in points:
        run = by_id[point.run]
        result = (*_settings(run, point, instruments), *check_record(design, run.record))
        if run.id in shared:
            text = f"the sensor's file is that of run {shared[run.id]} as well"
            result = (*result, Finding(subject="sensor file", passed=False, text=text))
        findings[run.id] = result
        wrong = [one for one in result if one.passed is False]
        if wrong:
            bad.append(SetAside(id=run.id, reason="; ".join(f"{w.subject}: {w.text}" for w in wrong)))
        else:
            good.append(point)
    return CheckedRuns(points=tuple(good), contradicting=tuple(bad), findings=findings)


def _shared_files(runs: Sequence[ImportedRun]) -> dict[str, str]:
    """Runs whose sensor's file is that of another run, and that other run."""
    seen: dict[str, str] = {}
    out: dict[str, str] = {}
    for run in runs:
        if not run.sensor_sha256 or run.load_is_zero:
            continue
        if run.sensor_sha256 in seen:
            out[run.id] = seen[run.sensor_sha256]
            out[seen[run.sensor_sha256]] = run.id
        seen.setdefault(run.sensor_sha256, run.id)
    return out


def _settings(run: ImportedRun, point: SteadyPoint, instruments: Instruments) -> tuple[Finding, ...]:
    result = []
    if run.speed_rad_s:
        result.append(
            _against("set speed", "speed", "rad/s", point.speed_rad_s, abs(run.speed_rad_s), SPEED_TOLERANCE)
        )
    if run.load_Nm and not run.load_is_zero:
        sensor = 2.0 * instruments.torque_accuracy * instruments.torque_full_scale_Nm / abs(run.load_Nm)
        allowed = LOAD_TOLERANCE + sensor
        result.append(_against("set load", "load", "N m", point.load_Nm, abs(run.load_Nm), allowed))
    return tuple(result)


def _against(subject: str, what: str, unit: str, measured: float, wanted: float, allowed: float) -> Finding:
    ratio = measured / wanted
    text = f"{what} {measured:.4g} {unit}, set {wanted:.4g} {unit}"
    if abs(ratio - 1.0) <= allowed:
        return Finding(subject=subject, passed=True, text=text)
    factor = named_factor(ratio)
    told = f": {ratio:.4g} times" + (f", factor {factor}" if factor else "")
    return Finding(subject=subject, passed=False, text=text + told)
