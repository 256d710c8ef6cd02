"""A record before it is believed: clipped, late, drifting; put right where it can be, and said."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats, Mask
from analyses.correlation.closed_loop import with_zero
from analyses.correlation.following import PLACES, Followed, followed
from analyses.estimation.least_squares import correlated_covariance, identifiable, solve
from analyses.estimation.parameters import Parameter, parameter
from analyses.estimation.series import correlation_time
from analyses.identification.friction_law import Bend, bend_of, kept_columns
from analyses.identification.inverse import fit_records
from analyses.identification.joint_model import TURNS, JointModel, Recipe, RecordFit, Rows
from analyses.identification.output_error import simulated_part
from analyses.identification.own_bias import with_model_signals
from analyses.identification.rows import (
    drive_of,
    driven_rows,
    is_benchmark,
    recipe_for,
    record_rows,
    rows_under,
)
from analyses.records.compared import COSINE
from analyses.records.finding import SURE, Finding
from analyses.records.naming import KNOWN_UNITS, RATES
from analyses.records.rate import clock_doubt
from analyses.records.record import Record, lasting
from analyses.records.voltage import resistance_doubt

Fitting = Callable[[Sequence[Record]], JointModel]
LEAST_RUN = 3  # samples in a row at the largest or smallest value of all: a flat top
ROUNDS = 8
SETTLED = 0.1
LARGEST_STEP_S = 0.01


@dataclass(frozen=True)
class Lag:
    """How much later than the motion a record's drive signal is, with its standard error, s."""

    seconds: float
    standard_error: float
    per_s: Floats  # what the values of the model come to by a shift, and by a filter's spread
    per_s2: Floats

    @property
    def is_sure(self) -> bool:
        return abs(self.seconds) > SURE * self.standard_error

    @property
    def within_s(self) -> float:
        """The lag, or how closely it is told, whichever is more."""
        return max(abs(self.seconds), self.standard_error)


@dataclass(frozen=True, kw_only=True)
class Diagnosed:
    """The model of records that were put right, how they follow their commands, and what was found."""

    model: JointModel
    records: tuple[Record, ...]
    late_s: float  # how much a drive signal was late, or how closely that is told, whichever is more
    followed: Mapping[str, Followed]
    bend: Bend | None  # of the friction over the speed; None of the benchmark, whose law is published
    findings: Mapping[str, tuple[Finding, ...]]


def diagnosed(
    design: Design, start: Design, records: Sequence[Record], fit: Fitting, recipe: Recipe | None
) -> Diagnosed:
    """Fit records, rows of clipped current left out and lags taken back where they are sure.

    ``start`` is the design with what the voltage equation gave; ``fit`` gives the model of records.
    """
    whole = [without_flat_tops(start, record, recipe) for record in records]
    used, found = [record for record, _ in whole], {record.name: clipped for record, clipped in whole}
    model = fit(used)
    late, sure, lags = 0.0, list[Lag](), list[tuple[Lag, float]]()
    for k, (record, like) in enumerate(zip(tuple(used), model.simulated, strict=False)):
        own, other = (lag_of(start, one, like, model) for one in (record, like))
        if own is not None and other is not None:  # the simulation has none, but what is found in it
            error = float(np.hypot(own.standard_error, other.standard_error))
            lag = replace(own, seconds=own.seconds - other.seconds, standard_error=error)
            lags.append((lag, record.period_s))
            found[record.name].append(_of_lag(drive_of(start, record)[1], lag, record.period_s))
            late = max(late, lag.within_s)
            if lag.is_sure:
                sure.append(lag)
                used[k] = in_time(start, record, like, lag.seconds)
    if sure:
        before, model = model, fit(used)
        if before.names == model.names:
            share = np.mean([(lag.standard_error / lag.seconds) ** 2 for lag in sure])
            model = model.wider(np.sqrt(share) * (model.values - before.values))
    model = _with_lags(model, lags)
    pairs = zip(used, model.simulated, strict=False)  # none where it cannot be simulated
    seen = {record.name: _followed(start, record, like.signals) for record, like in pairs}
    for record, part in zip(used, model.records, strict=True):
        model = _with_doubts(design, start, record, seen.get(record.name), model)
        if not is_benchmark(record):
            drifts, added = _drift(part, model, parameter("offset", design.axis))
            found[record.name] += drifts
            model = replace(model, covariance=model.covariance + added)
    bend = None if any(map(is_benchmark, used)) else bend_of(model)
    if bend is not None:
        model = model.wider(np.sqrt(1.0 - bend.chance) * bend.moved)
    return Diagnosed(
        model=model,
        bend=bend,
        records=tuple(used),
        late_s=late,
        followed={name: one for name, one in seen.items() if one is not None},
        findings={name: tuple(each) for name, each in found.items()},
    )


def _with_lags(model: JointModel, lags: Sequence[tuple[Lag, float]]) -> JointModel:
    """The model with what lags that are not sure move, and filters that were taken back as delays.

    Of a filter of first order that is sampled every T the impulse response has the variance L (L + T), L its
    lag; of a delay none. The square of a lag that is not sure is expected to be what was found less that of
    its error: of records without one next to nothing. All records may come from one recorder, whose lags move
    the values as one does.
    """
    moved = [
        abs(lag.seconds) * (abs(lag.seconds) + period_s) * lag.per_s2
        if lag.is_sure
        else np.sqrt(max(lag.seconds**2 - lag.standard_error**2, 0.0)) * lag.per_s
        for lag, period_s in lags
        if len(lag.per_s) == len(model.names)
    ]
    return model.wider(np.mean(moved, axis=0)) if moved else model


def _followed(start: Design, record: Record, simulated: Mapping[str, Floats]) -> Followed | None:
    """As `followed`; where what was found does not even move as the record, by the design's own motion."""
    one = followed(start, record, simulated)
    if one is not None and one.cosine < COSINE:
        simulated = with_model_signals(start, simulated_part(start, record)).signals
        one = followed(start, record, simulated)
    return with_zero(start, simulated_part(start, record), one)


def _with_doubts(
    design: Design, start: Design, record: Record, follow: Followed | None, model: JointModel
) -> JointModel:
    """The model with what clock and scales of a record may be off by: each value by a power of that."""
    clock, off = (0.0, 0.0) if follow is None or follow.fails else (follow.clock, follow.off)
    if follow is None or record.signals.keys() & {"speed", "velocity"}:
        clock = max(clock, clock_doubt(start, record), key=abs)
    kinds = [name.partition("_")[0] for name in model.names]
    for share, powers in ((clock, {"inertia": 2.0, "viscous": 1.0}), (off, {"inertia": 1.0, "viscous": 1.0})):
        model = model.wider(share * np.array([powers.get(kind, 0.0) for kind in kinds]) * model.values)
    return model.wider(resistance_doubt(design, record) * model.values)


def _of_lag(signal: str, lag: Lag, period_s: float) -> Finding:
    subject = f"{signal.replace('_', ' ')} and motion at one time"
    late, error = 1e3 * lag.seconds, 1e3 * lag.standard_error
    if not lag.is_sure:
        passed = lag.within_s <= period_s or None
        return Finding(subject, passed, f"within {max(abs(late), 2.0 * error):.2g} ms")
    which = "later" if late > 0.0 else "earlier"
    text = f"the {signal} is {abs(late):.3g} ms (standard error {error:.1g} ms) {which} than the motion"
    return Finding(subject, None, f"{text}: taken back by as much before the fit", done="taken back")


def _drift(part: RecordFit, model: JointModel, offset: Parameter) -> tuple[list[Finding], Floats]:
    """Whether scale or offset of all torques drifts (-1 to 1) along a record, and adds to the covariance."""
    moved = np.zeros_like(model.covariance)
    time, w = np.linspace(-1.0, 1.0, len(part.keep))[part.keep][part.compared], part.w[part.compared]
    every = np.column_stack([w, *(each[part.compared] for each in kept_columns(model, part))])
    every = every[:, identifiable(every)[0]]
    table = np.column_stack([every, time * (w @ model.values), time])
    if len(table) <= table.shape[1] or len(identifiable(table)[0]) < table.shape[1]:
        return [], moved
    found, changes = solve(table, part.noise), []
    scale, shift = found.values[-2:]
    sure = np.abs(found.values[-2:]) > SURE * np.sqrt(np.diag(found.correlated))[-2:]
    if sure[0]:
        changes.append(f"all torques change by {200.0 * scale:+.2g} % from begin to end")
        moved = np.outer(model.values, model.values) * scale**2 / 3.0
    if sure[1]:
        changes.append(f"the offset by {2.0 * offset.scale * shift:+.2g} {offset.unit}")
        if "offset" in model.names:
            moved[model.names.index("offset"), model.names.index("offset")] += shift**2 / 3.0
    text = f"{' and '.join(changes)}: the intervals hold it"
    return [Finding("drift along the record", None, text, done="widened")] * bool(changes), moved


def flat_tops(values: Floats) -> Mask:
    """Where a signal stands at its largest or smallest value for three samples or more.

    >>> flat_tops(np.array([0.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 0.0])).astype(int).tolist()
    [0, 1, 1, 1, 0, 0, 0, 0]
    """
    ends, near = (np.max(values), np.min(values)), 1e-9 * np.ptp(values)
    return np.any([lasting(np.abs(values - level) <= near, LEAST_RUN) for level in ends], axis=0)


def without_flat_tops(start: Design, record: Record, recipe: Recipe | None) -> tuple[Record, list[Finding]]:
    """The record without the rows of a flat top, where all others say that the drive signal was larger."""
    name = drive_of(start, record)[1]
    flat = flat_tops(record[name])
    if is_benchmark(record) or not np.any(flat) or np.all(flat):
        return record, []
    reach = 2 * (recipe or recipe_for(record)).decimation  # of the filter before the decimation
    without = replace(record, left_out=np.convolve(flat, np.ones(2 * reach + 1), mode="same") > 0.5)
    try:
        fit = fit_records(start, [without], recipe=recipe)
        whole = record_rows(start, record, "symmetric", recipe)
    except (InputError, NumericalError):
        return record, []
    rows = (whole.keep & ~fit.records[0].keep)[whole.keep]
    count = int(np.count_nonzero(rows))
    more = np.sign(whole.y) * (whole.explained(fit, whole.names) - whole.y)
    error = float(np.std(fit.residual)) * np.sqrt(correlation_time(fit.residual) / max(count, 1))
    if not count or not float(np.mean(more[rows])) > SURE * error:
        return record, []
    share = 100.0 * np.count_nonzero(flat) / len(flat)
    largest = f"{np.max(np.abs(record[name])):.4g} {KNOWN_UNITS.get(name, '')}".rstrip()
    text = f"{share:.2g} % of its samples stand at the largest value, {largest}, where "
    text += "the other rows say that it was larger: clipped; these rows are left out"
    return without, [Finding(subject=f"{name} without flat tops", passed=None, text=text, done="left out")]


def shifted(design: Design, record: Record, seconds: float) -> Record:
    """A record with its drive signal taken ``seconds`` later in the file, as if it came so much earlier."""
    name = drive_of(design, record)[1]
    moved = np.interp(record.time_s + seconds, record.time_s, record[name])
    return replace(record, signals={**record.signals, name: moved})


def moved(design: Design, record: Record, seconds: float) -> Record:
    """A record with its motion taken ``seconds`` later in the file."""
    times, motions = record.time_s + seconds, (*PLACES, RATES[design.axis])
    taken = {n: np.interp(times, record.time_s, record[n]) for n in motions if n in record.signals}
    return replace(record, signals={**record.signals, **taken})


def in_time(design: Design, record: Record, like: Record, late_s: float) -> Record:
    """A record with its drive signal earlier by so much, or its motion later: as a simulated one has both."""
    ways = shifted(design, record, late_s), moved(design, record, -late_s)
    names_of_all = (*PLACES, RATES[design.axis], drive_of(design, record)[1])

    def off(one: Record) -> float:
        names = [n for n in names_of_all if n in one.signals and n in like.signals]
        misses = {name: one[name][: len(like)] - like[name] for name in names}
        return sum(float(np.var(each)) / max(float(np.var(like[n])), 1e-300) for n, each in misses.items())

    return min(ways, key=off)


def lag_of(design: Design, record: Record, simulated: Record, model: JointModel) -> Lag | None:
    """The lag with which the inverse model leaves the least, the model's values being found anew.

    Gauss-Newton on the shift of the drive signal, its derivative by a difference over the record's period.
    The rows of the simulated record are the instruments (IDIM-IV; Janot, Vandanjon, Gautier, 2014), so that
    noise of motion and current does not bias the steps. None where the motion does not tell a lag from
    inertia and friction.
    """

    def slopes(record: Record, rows: Rows, driven: Callable[[Record], Floats]) -> Floats:
        """Columns of the model, and by how much the drive of each row falls with a shift, N m/s."""
        half = 0.5 * record.period_s
        late, early = (driven(shifted(design, record, s)) for s in (half, -half))
        return np.column_stack([rows.columns(model.names), (early - late) / (2.0 * half)])

    try:
        own, other = (rows_under(design, one, model) for one in (record, simulated))
        if len(other.keep) > len(own.keep):
            return None
        both = own.shared(other)
        z = other.at(both, slopes(simulated, other, driven_rows(design, simulated, other)))
        if len(z) <= z.shape[1] or len(identifiable(z, (*model.names, "lag"))[0]) < z.shape[1]:
            return None
        lag, error, driven = 0.0, np.inf, driven_rows(design, record, own)
        known = driven(record) - own.y + model.kept(own)
        for _ in range(ROUNDS):
            late = shifted(design, record, lag)
            y, table = (own.at(both, one) for one in (driven(late) - known, slopes(late, own, driven)))
            step, error = _step(z, table, y)
            lag += float(np.clip(step, -LARGEST_STEP_S, LARGEST_STEP_S))
            if abs(step) < SETTLED * error:
                break
        # the lag that other instants of reversal feign, of the motion as it is and taken back
        feigned = [_step(z, table, own.at(both, model.turned(own)) - other.at(both, model.turned(other)))[0]]
        back = rows_under(design, in_time(design, record, simulated, lag), model)
        shared = both & back.keep[: len(both)]
        seen = shared[both]
        turned = back.at(shared, model.turned(back)) - other.at(shared, model.turned(other))
        feigned.append(_step(z[seen], table[seen], turned)[0])
        per_s, per_s2 = _per_lag(z, table, both, *_bend(design, record, model, own))
    except (InputError, NumericalError, np.linalg.LinAlgError):
        return None
    return Lag(lag, float(np.hypot(error, min(feigned, key=abs))), per_s, per_s2)


def _bend(design: Design, record: Record, model: JointModel, own: Rows) -> tuple[Mask, Floats]:
    """Rows of a record, and by how much its drive falls there with a filter's spread, half its curvature.

    Of what does not turn with the direction: the instants of reversal are those of the lag.
    """
    step = record.period_s
    late, early = (rows_under(design, moved(design, record, s), model) for s in (step, -step))
    shared, names = own.keep & late.keep & early.keep, [n for n in model.names if not n.startswith(TURNS)]
    after, before, here = (one.at(shared, one.explained(model, names)) for one in (late, early, own))
    return shared, 0.5 * (2.0 * here - before - after) / step**2


def _per_lag(z: Floats, table: Floats, rows: Mask, there: Mask, bend: Floats) -> tuple[Floats, Floats]:
    """What the values come to by a shift, and by a spread, rows ``z`` being the instruments."""
    seen, own = there[: len(rows)][rows], rows[: len(there)][there[: len(rows)]]
    z, table = z[seen], table[seen]
    on = np.linalg.solve(z[:, :-1].T @ table[:, :-1], z[:, :-1].T)
    return on @ table[:, -1], on @ bend[: len(own)][own]


def _step(z: Floats, table: Floats, y: Floats) -> tuple[float, float]:
    """The last value of ``z' (y - table p) = 0``, and its standard error."""
    size = np.linalg.norm(z, axis=0)
    z, table = z / size, table / size
    slopes = z.T @ table
    found = np.linalg.solve(slopes, z.T @ y)
    # with rows z and the noise of the residual, the covariance of z'e, turned back by the slopes
    gram, back = z.T @ z, np.linalg.inv(slopes)
    noise = gram @ correlated_covariance(z, y - table @ found) @ gram
    return float(found[-1] / size[-1]), float(np.sqrt((back @ noise @ back.T)[-1, -1]) / size[-1])
