"""A record before it is believed: clipped, late, drifting; put right where it can be, and said."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import BoolArray, FloatArray, stretches
from analyses.estimation.least_squares import covariance_of, told_apart
from analyses.estimation.means import correlation_time
from analyses.identification.inverse import fit_records
from analyses.identification.joint_model import JointModel, Recipe, RecordFit
from analyses.identification.rows import drive_of, is_benchmark, recipe_for, record_rows
from analyses.identification.simultaneous import Followed, Lag, followed, lag_of, shifted
from analyses.records.consistency import SURE, Finding, clock_doubt, resistance_doubt
from analyses.records.record import Record

LEAST_RUN = 3
"""Samples in a row at the largest or smallest value of all: a flat top."""

Fitted = tuple[JointModel, tuple[Record, ...]]


@dataclass(frozen=True, kw_only=True)
class Diagnosed:
    """The model of records that were put right, how they follow their commands, and what was found."""

    model: JointModel
    records: tuple[Record, ...]
    followed: Mapping[str, Followed]
    findings: Mapping[str, tuple[Finding, ...]]


def diagnosed(
    design: Design,
    start: Design,
    records: Sequence[Record],
    fit: Callable[[Sequence[Record]], Fitted],
    recipe: Recipe | None,
) -> Diagnosed:
    """Fit records, rows of clipped current left out and lags taken back where they are sure.

    ``start`` is the design with what the voltage equation gave; ``fit`` gives the model of records, and
    these as the design that comes of it simulates them (none: it cannot).
    """
    found: dict[str, list[Finding]] = {record.name: [] for record in records}
    used = tuple(_without_flat_tops(start, record, recipe, found[record.name]) for record in records)
    model, simulated = fit(used)
    lags = [_lag(start, *pair, model, recipe) for pair in zip(used, simulated, strict=bool(simulated))]
    for record, lag in zip(used, lags, strict=False):
        if lag is not None:
            found[record.name].append(_of_lag(drive_of(start, record)[1], lag))
    sure = [lag for lag in lags if lag is not None and lag.is_sure]
    if sure:
        pairs = zip(used, lags, strict=True)
        used = tuple(
            shifted(start, record, lag.seconds) if lag is not None and lag.is_sure else record
            for record, lag in pairs
        )
        before = model
        model, simulated = fit(used)
        model = _with_error_of(sure, before, model)
    seen = {
        one.name: followed(start, one, like)
        for one, like in zip(used, simulated, strict=bool(simulated))
        if not is_benchmark(one)
    }
    follow = {name: one for name, one in seen.items() if one is not None}
    for record, part in zip(used, model.records, strict=True):
        one = follow.get(record.name)
        clock, off = (0.0, 0.0) if one is None or one.fails else (one.clock, one.off)
        if one is None or record.signals.keys() & {"speed", "velocity"}:
            clock = max(clock, clock_doubt(start, record), key=abs)
        for share, powers in (
            (clock, {"inertia": 2.0, "viscous": 1.0}),
            (off, {"inertia": 1.0, "viscous": 1.0}),
            (resistance_doubt(design, record), {"": 1.0}),
        ):
            model = _stretched(model, share, powers)
        drift = None if is_benchmark(record) else _drift(part, model)
        if drift is not None:
            found[record.name].append(drift[0])
            model = replace(model, covariance=model.covariance + drift[1])
    return Diagnosed(
        model=model,
        records=used,
        followed=follow,
        findings={name: tuple(each) for name, each in found.items()},
    )


def _lag(
    start: Design, record: Record, simulated: Record, model: JointModel, recipe: Recipe | None
) -> Lag | None:
    """The lag of a record, less what the same analysis finds in its simulation, which has none."""
    if is_benchmark(record):
        return None
    lag, own = (lag_of(start, one, simulated, model, recipe) for one in (record, simulated))
    return None if lag is None or own is None else lag.less(own)


def _of_lag(signal: str, lag: Lag) -> Finding:
    subject = f"{signal.replace('_', ' ')} and motion at one time"
    late, error = 1e3 * lag.seconds, 1e3 * lag.standard_error
    if not lag.is_sure:
        text = f"within {max(abs(late), 2.0 * error):.2g} ms"
        return Finding(subject=subject, passed=True, text=text)
    which = "later" if late > 0.0 else "earlier"
    text = f"the {signal} is {abs(late):.3g} ms (standard error {error:.1g} ms) {which} than the motion"
    return Finding(subject=subject, passed=None, text=f"{text}: taken back by as much before the fit")


def _with_error_of(lags: Sequence[Lag], before: JointModel, model: JointModel) -> JointModel:
    """The model with what the error of the lags adds to its covariance."""
    if before.names != model.names:
        return model
    moved = model.values - before.values
    share = float(np.mean([(lag.standard_error / lag.seconds) ** 2 for lag in lags]))
    return replace(model, covariance=model.covariance + share * np.outer(moved, moved))


def _stretched(model: JointModel, share: float, powers: Mapping[str, float]) -> JointModel:
    """The model with what a clock or a scale off by a share moves: each value by that power of it."""
    power = np.array([powers.get(name.partition("_")[0], powers.get("", 0.0)) for name in model.names])
    moved = share * power * model.values
    return replace(model, covariance=model.covariance + np.outer(moved, moved))


def _drift(part: RecordFit, model: JointModel) -> tuple[Finding, FloatArray] | None:
    """Whether all torques change their scale along a record, and what that adds to the covariance.

    The noise (what the simulated record leaves is taken off) over the modelled torque times the time (-1 at
    the begin, 1 at the end) and over that time alone, beside the model's own columns. A value that drifts by
    +-d about its mean is uniform in that.
    """
    time, w = np.linspace(-1.0, 1.0, len(part.keep))[part.keep][part.compared], part.w[part.compared]
    table = np.column_stack([w, time * (w @ model.values), time])
    size = np.linalg.norm(table, axis=0)
    names = (*model.names, "scale", "shift")
    if len(told_apart(table, names)[0]) < len(names):
        return None
    found = np.linalg.lstsq(table / size, part.noise, rcond=None)[0] / size
    rest = part.noise - table @ found
    errors = np.sqrt(np.diag(covariance_of([(table / size, rest)]))) / size
    scale, shift = found[-2:]
    sure = np.abs(found[-2:]) > SURE * errors[-2:]
    if not np.any(sure):
        return None
    moved = sure[0] * np.outer(model.values, model.values) * scale**2 / 3.0
    text = f"all torques change by {200.0 * scale:+.2g} % from begin to end" if sure[0] else ""
    if sure[1]:
        text += f"{' and ' if text else ''}the offset by {2.0 * shift:+.2g}"
        if "offset" in model.names:
            moved[model.names.index("offset"), model.names.index("offset")] += shift**2 / 3.0
    finding = Finding(subject="drift along the record", passed=None, text=f"{text}: the intervals hold it")
    return finding, moved


def flat_tops(values: FloatArray) -> BoolArray:
    """Where a signal stands at its largest or smallest value for three samples or more.

    Examples
    --------
    >>> flat_tops(np.array([0.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 0.0])).astype(int).tolist()
    [0, 1, 1, 1, 0, 0, 0, 0]
    """
    out = np.zeros(len(values), dtype=bool)
    for level in (np.max(values), np.min(values)):
        at = np.abs(values - level) <= 1e-9 * np.ptp(values)
        for start, stop in stretches(at):
            out[start:stop] |= stop - start >= LEAST_RUN
    return out


def _without_flat_tops(start: Design, record: Record, recipe: Recipe | None, found: list[Finding]) -> Record:
    """The record without the rows of a flat top, where all others say that the drive signal was larger."""
    name = drive_of(start, record)[1]
    flat = flat_tops(record[name])
    if is_benchmark(record) or not np.any(flat) or np.all(flat):
        return record
    reach = 2 * (recipe or recipe_for(record)).decimation  # of the filter before the decimation
    near = np.convolve(flat, np.ones(2 * reach + 1), mode="same") > 0.5
    without = replace(record, left_out=near)
    try:
        fit = fit_records(start, [without], recipe=recipe)
        whole = record_rows(start, record, "symmetric", recipe)
    except (InputError, NumericalError):
        return record
    rows = (whole.keep & ~fit.records[0].keep)[whole.keep]
    if not np.any(rows):
        return record
    modelled = whole.w[rows] @ np.array([fit[name] for name in whole.names])
    more = np.sign(whole.y[rows]) * (modelled - whole.y[rows])
    rest = fit.residual
    error = float(np.std(rest)) * np.sqrt(correlation_time(rest) / len(more))
    subject = f"{name} without flat tops"
    share = 100.0 * np.count_nonzero(flat) / len(flat)
    if not float(np.mean(more)) > SURE * error:
        return record
    text = (
        f"{share:.2g} % of its samples stand at the largest value, {np.max(np.abs(record[name])):.4g}, where "
        "the other rows say that it was larger: clipped; these rows are left out"
    )
    found.append(Finding(subject=subject, passed=None, text=text))
    return without
