"""What the fit of an inverse model makes of a record whose truth is known: its own bias, taken off."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.fft import irfft, rfft

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.loops import assemble_loops
from actuator_lti.types import Floats
from analyses.correlation.closed_loop import AXIS_SIGNALS, model_signals
from analyses.correlation.driving import command_of
from analyses.estimation.fit import Fit
from analyses.estimation.least_squares import correlated_covariance, scaled_lstsq, solve, wider_covariance
from analyses.estimation.parameters import default_value
from analyses.identification.inverse import fit_records, with_scatter
from analyses.identification.joint_model import JointModel, RecordFit
from analyses.identification.output_error import simulated_part
from analyses.identification.rows import is_benchmark, motion_of, recipe_for
from analyses.records.record import SMOOTH, Record
from analyses.records.single_rows import ROUNDING, count_of

LARGEST_BIAS = 0.2
ROUNDS_BY_LOOPS, ROUNDS_BY_GAIN = 12, 6
ROUNDS = 3
PLACES = {"angle", "output_angle", "position"}
SETTLED = 0.1  # standard errors within which a bias that was found again is the one that was found before


def without_bias(
    start: Design, make: Callable[[JointModel], Design], model: JointModel, records: Sequence[Record]
) -> JointModel:
    """The model less what the same fit finds too much in records simulated with the design that came of it.

    Sampling between the controller's ticks, filtered speeds at reversals, play and rest are met by the
    simulated records as by the measured ones; what the fit makes of them is known there (bias correction by
    indirect inference; Gourieroux, Monfort, Renault, 1993). It is taken off, and found again with the
    design that then comes of it. What the simulated records leave of a residual has no chance in it: the
    errors are those of the difference of the two residuals, block by block (`events_of`). The simulated
    motion tells the regressors (`_with_noise`): noise of the recorded one takes nothing from the values. A
    record without a command is simulated with one that moves the drive as recorded; of a long one the first
    part is, and tells the values. That of the EMPS benchmark, with published figures, is left as it is.
    ``make`` gives the design that comes of a model.
    """
    less = model
    driven: tuple[Record, ...] = ()
    lacking = [record for record in records if command_of(start, record) is None]
    roughly = not all(holds_between(start, record) for record in lacking)
    fit = same_fit(start, model)
    for _ in range(ROUNDS):
        try:
            made = make(less)
            reason = "" if driven else _cannot(made, records)
            if reason:
                return replace(model, bias_note=reason)
            driven = driven or tuple(_driven(made, record) for record in records)
            less = replace(less, simulated=tuple(with_model_signals(made, record) for record in driven))
            pairs = zip(less.simulated, model.records, strict=True)
            # without an output's encoder (free of noise) that the measured one left out
            again = fit([one.without({"output_angle"} - part.used.keys()) for one, part in pairs])
        except (InputError, NumericalError) as error:
            return replace(less, bias_note=f"not taken off: {error}")
        found = _corrected(start, made, model, again, learnt=bool(lacking) and not roughly, roughly=roughly)
        before, less = less, replace(found, simulated=less.simulated)
        if not less.bias or np.all(np.abs(less.values - before.values) < SETTLED * less.standard_errors):
            break
    return less


def same_fit(start: Design, model: JointModel) -> Callable[[Sequence[Record]], JointModel]:
    """The fit of a model, of other records."""
    return partial(
        fit_records,
        start,
        form=model.form,
        recipe=model.asked,
        fixed={name: one.value for name, one in model.fixed.items()},
        gravity="gravity_sin" in model,
        knots_rad_s=model.knots_rad_s,
        weights=model.weights,
    )


def _corrected(
    start: Design, made: Design, model: JointModel, again: JointModel, *, learnt: bool, roughly: bool
) -> JointModel:  # fmt: skip
    parts = with_noise(model, again)
    triples = list(zip(model.weights, model.records, parts, strict=True))
    weighed = [(weight * part.w[part.compared], weight * part.noise) for weight, _, part in triples]
    rest = [weight * own.residual[part.compared] for weight, own, part in triples]
    more = scaled_lstsq(np.concatenate([slopes for slopes, _ in weighed]), np.concatenate(rest))
    less = replace(model, values=model.values + more, records=parts)
    found = {n: again[n] - default_value(made, n, start) for n in model.names if n in again.names}
    bias = np.array([found.get(name, 0.0) for name in model.names])
    table = np.concatenate([slopes for slopes, _ in weighed])
    whole = np.linalg.norm(table @ bias) > LARGEST_BIAS * np.linalg.norm(table @ model.values)
    large = _large(model, bias) if roughly else ["the drive"] if whole else []
    if large:
        why = f"not taken off: more than {100 * LARGEST_BIAS:g} % of {', '.join(large)}"
        return replace(less, bias_note=f"{why}; the intervals hold it").wider(bias)
    singles = zip(model.alone, again.alone, weighed, strict=False)
    less = replace(
        less,
        values=less.values - bias,
        covariance=wider_covariance(weighed),
        alone=tuple(_alone(*each, partial(default_value, made, start=start), model) for each in singles),
        bias=dict(zip(model.names, bias.tolist(), strict=True)),
        bias_note="found on records simulated with the result, and taken off",
    )
    less = less.wider(_not_shared(model, again) * bias) if learnt else less
    return with_scatter(start, less.wider(_by_direction(model, again)))


def _large(model: JointModel, bias: Floats) -> list[str]:
    """Values with a bias that is much of them or, where they may be zero, of their kind or error.

    Of a command that was learnt roughly: a drive that sticks moves otherwise between the rows.
    """
    gravity = float(np.hypot(model.get("gravity_sin", 0.0), model.get("gravity_cos", 0.0)))
    dry = next((abs(model[n]) for n in ("dry", "dry_forward", "map_0") if n in model), 0.0)
    like = [gravity if n.startswith("gravity") else dry if n == "offset" else 0.0 for n in model.names]
    sizes = np.maximum(np.maximum(np.abs(model.values), like), model.standard_errors / LARGEST_BIAS)
    return [n for n, b, s in zip(model.names, bias, sizes, strict=True) if abs(b) > LARGEST_BIAS * s]


def _not_shared(model: JointModel, again: JointModel) -> float:
    """By which part what the simulated records leave is not in what the measured ones leave, beyond chance.

    What is left and the bias come of one cause; behind a command that was learnt the simulated drive may do
    other things between the rows. The square is expected to be what was found less that of its error.
    """
    triples = zip(model.weights, model.records, again.records, strict=True)
    both = [(weight, own, other, own.shared(other)) for weight, own, other in triples]
    left = [weight * one.at(rows, one.own_residual) for weight, *pair, rows in both for one in pair]
    own, other = np.concatenate(left[::2]), np.concatenate(left[1::2])
    if len(own) < 2 or not np.any(other):
        return 0.0
    found = solve(other[:, None], own, np.cumsum([len(one) for one in left[::2]]).tolist())
    return float(np.sqrt(max((found.values[0] - 1.0) ** 2 - found.correlated[0, 0], 0.0)))


def with_noise(model: JointModel, again: JointModel) -> tuple[RecordFit, ...]:
    """The records of a model, with what those simulated leave of their noise."""
    return tuple(_with_noise(*pair) for pair in zip(model.records, again.records, strict=True))


def _with_noise(measured: RecordFit, simulated: RecordFit) -> RecordFit:
    """The record's part, its noise what is left where the simulated residual is taken off: rows of both.

    Its regressors are there what the simulated ones tell of them (two-stage least squares; as IDIM-IV, Janot,
    Vandanjon, Gautier, 2014): noise of the recorded motion is not in them.
    """
    both, more = measured.shared(simulated), len(measured.keep) - len(simulated.keep)
    if more < 0 or np.count_nonzero(both) < 2 * measured.w.shape[1]:
        return measured
    own, model = (part.at(both, part.own_residual) for part in (measured, simulated))
    table, seen = (measured.at(both, each) for each in (measured.w, measured.inputs))
    on = simulated.at(both, simulated.w)
    projected, free = (on @ scaled_lstsq(on, each) for each in (table, seen))
    compared = np.pad(both, (0, more))[measured.keep]
    w, inputs = measured.w.copy(), measured.inputs.copy()
    w[compared], inputs[compared] = projected, free
    noise = own - table @ scaled_lstsq(projected, own) - model
    return replace(measured, w=w, inputs=inputs, noise=noise, compared=compared)


def _by_direction(model: JointModel, again: JointModel) -> Floats:
    """What the values move by where the simulated records turn back at other instants than the measured."""
    tables, turned = [], []
    for weight, own, other in zip(model.weights, model.records, again.records, strict=True):
        both = own.shared(other)
        here, there = (part.at(both, model.turned(part)) for part in (own, other))
        tables.append(weight * own.at(both, own.w))
        turned.append(weight * (here - there))
    return scaled_lstsq(np.concatenate(tables), np.concatenate(turned))


def _alone(
    own: Fit, simulated: Fit, weighed: tuple[Floats, Floats], true: Callable[[str], float], model: JointModel
) -> Fit:
    """One record fitted alone, less its bias, with the errors of its noise; ``true``: what was simulated."""
    both = tuple(name for name in own.names if name in simulated.names)
    values = np.array([own[name] - simulated[name] + true(name) for name in both])
    slopes = weighed[0][:, [model.names.index(name) for name in both]]
    return Fit(names=both, values=values, covariance=correlated_covariance(slopes, weighed[1]))


def _cannot(design: Design, records: Sequence[Record]) -> str:
    """Why a bias cannot be found; empty where it can."""
    for record in records:
        if is_benchmark(record):
            return "published recipe: not looked for"
        if command_of(design, record) is None and design.controller.position is None:
            return f"{record.name} has no command: not looked for"
        if not {"force", "current", "voltage"} & set(record.signals):
            return f"{record.name} has no measured drive signal: not looked for"
    return ""


def _driven(design: Design, record: Record) -> Record:
    """The record, or its first part; without a command it gets one that moves the drive as recorded.

    It is learnt: what the simulated motion lacks is added over the response of the linear loops, as long as
    it comes nearer; where none holds what it asks for between the rows, over gain/(s + gain), about the
    position loop, which asks for less where a drive sticks.
    """
    record = simulated_part(design, record)
    if command_of(design, record) is not None:
        return record
    name = "position_reference" if design.axis == "linear" else "reference"

    def place(record: Record) -> Floats:  # as recorded, whatever cut-off the fit has
        return motion_of(design, record, recipe_for(record))[0].position

    wanted = command = place(record)
    holds = holds_between(design, record)
    step = (_by_loops if holds else _by_gain)(design, record.period_s, len(wanted))
    driven, nearest = record, np.inf
    for _ in range(ROUNDS_BY_LOOPS if holds else ROUNDS_BY_GAIN):
        signals = {**record.signals, name: command / design.total_ratio}
        tried = replace(record, signals=signals, between=record.between or SMOOTH)
        off = wanted - place(with_model_signals(design, tried))
        size = float(off @ off)
        if holds and not size < nearest:
            break
        driven, nearest = tried, size
        command = command + step(off)
    return driven


def holds_between(design: Design, record: Record) -> bool:
    """Whether a slower loop holds what it asks for over ticks that lie between the rows."""
    position, tick_s = design.controller.position, design.controller.period_s
    return position is not None and position.every > 1 and record.period_s > 1.5 * tick_s


def _by_gain(design: Design, period_s: float, count: int) -> Callable[[Floats], Floats]:
    gain = design.controller.position_loop.gain
    return lambda off: off + np.gradient(off, period_s) / gain


def _by_loops(design: Design, period_s: float, count: int) -> Callable[[Floats], Floats]:
    response = assemble_loops(design).plain_response
    assert response is not None  # the rotor is free
    turned = np.pi * np.arange(count + 1) / count  # lines of the motion to and back
    inverse = 1.0 / np.asarray(response(np.exp(1j * turned / period_s * response.dt)))
    return lambda off: np.asarray(irfft(inverse * rfft(np.append(off, off[::-1])))[:count])


def with_model_signals(design: Design, record: Record) -> Record:
    """The record as the design would have made it: every signal that the model has is the model's."""
    names = [name for name in AXIS_SIGNALS[design.axis] if name in record.signals]
    signals = model_signals(design, record, {name: record[name] for name in names})
    signals |= {n: in_counts(signals[n], record[n]) for n in PLACES & signals.keys()}
    return replace(record, signals={**record.signals, **signals})


def in_counts(values: Floats, recorded: Floats) -> Floats:
    """A position as the encoder of a recorded one shows it: at its counts, where all of it is at such.

    >>> in_counts(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.25, 0.5, 1.0])).tolist()
    [0.0, 0.0, 0.25]
    """
    count, least = count_of(recorded), np.min(recorded)
    return np.asarray(least + count * np.floor((values - least) / count + ROUNDING)) if count else values
