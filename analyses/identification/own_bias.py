"""What the fit of an inverse model makes of a record whose truth is known: its own bias, taken off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.correlation.closed_loop import AXIS_SIGNALS, model_signals
from analyses.correlation.driving import command_of
from analyses.identification.inverse import fit_records
from analyses.identification.joint_model import JointModel, Recipe, default_value
from analyses.identification.rows import is_benchmark
from analyses.records.record import Record

MOST_TICKS = 2_000_000
LARGEST_BIAS = 0.2
UNSURE_SHARE = 0.5
"""Share of a bias that stays as an error: it is that of the simulated drive and of samples at its ticks."""


def without_bias(
    start: Design, made: Design, model: JointModel, records: Sequence[Record], recipe: Recipe | None
) -> tuple[JointModel, tuple[Record, ...]]:
    """The model less what the same fit finds too much in records simulated with the design that came of it.

    Sampling between the controller's ticks, filtered speeds at reversals, play and rest are met by the
    simulated records as by the measured ones; what the fit makes of them is known there (bias correction by
    indirect inference; Gourieroux, Monfort, Renault, 1993). It is taken off, and half of it added to the
    errors. Records without a command, and that of the EMPS benchmark, whose figures are published, are left
    as they are.

    Parameters
    ----------
    start : Design
        That the model was fitted with.
    made : Design
        That came of it; it is simulated.
    recipe : Recipe or None
        Of the fit.

    Returns
    -------
    JointModel, tuple of Record
        With the records as they were simulated; none where they could not be.
    """
    reason = _cannot(made, records)
    if reason:
        return replace(model, bias_told=reason), ()
    try:
        simulated = tuple(_simulated(made, record) for record in records)
    except (InputError, NumericalError) as error:
        return replace(model, bias_told=f"not taken off: {error}"), ()
    return _corrected(start, made, model, simulated, recipe), simulated


def _corrected(
    start: Design, made: Design, model: JointModel, simulated: Sequence[Record], recipe: Recipe | None
) -> JointModel:
    """The model less what the same fit finds too much in the simulated records."""
    try:
        again = fit_records(
            start,
            simulated,
            form=model.form,
            recipe=recipe,
            fixed={name: one.value for name, one in model.fixed.items()},
            gravity="gravity_sin" in model,
            knots_rad_s=model.knots_rad_s,
            weights=model.weights,
        )
    except (InputError, NumericalError) as error:
        return replace(model, bias_told=f"not taken off: {error}")
    found = {name: again[name] - default_value(made, name) for name in model.names if name in again.names}
    bias = np.array([found.get(name, 0.0) for name in model.names])
    values = model.values - bias
    size = _sizes(model)
    wild = [n for n, b, s in zip(model.names, bias, size, strict=True) if abs(b) > LARGEST_BIAS * s]
    if wild:
        return replace(
            model, bias_told=f"not taken off: more than {100 * LARGEST_BIAS:g} % of {', '.join(wild)}"
        )
    return replace(
        model,
        values=values,
        covariance=model.covariance + UNSURE_SHARE**2 * np.outer(bias, bias),
        bias={name: float(b) for name, b in zip(model.names, bias, strict=True)},
        bias_told="found on records simulated with the result, taken off; half of it is in the errors",
    )


def _cannot(design: Design, records: Sequence[Record]) -> str:
    """Why a bias cannot be found; empty where it can."""
    for record in records:
        command = command_of(design, record)
        if is_benchmark(record):
            return "published recipe: not looked for"
        if command is None:
            return f"{record.name} has no command: not looked for"
        if not {"force", "current", "voltage"} & set(record.signals):
            return f"{record.name} has no measured drive signal: not looked for"
        if len(record) * record.period_s > MOST_TICKS * design.controller.period_s:
            return f"{record.name} is too long to simulate: not looked for"
    return ""


def _simulated(design: Design, record: Record) -> Record:
    """The record as the design would have made it: every signal that the model has is the model's."""
    names = [name for name in AXIS_SIGNALS[design.axis] if name in record.signals]
    signals, _ = model_signals(design, record, {name: record[name] for name in names})
    return replace(record, signals={**record.signals, **signals})


def _sizes(model: JointModel) -> np.ndarray:
    """What a bias is held against: the value or, where it may be zero, that of its kind or its error."""
    gravity = math.hypot(model["gravity_sin"], model["gravity_cos"]) if "gravity_sin" in model else 0.0
    dry = next((abs(model[n]) for n in ("dry", "dry_forward", "map_0") if n in model), 0.0)
    errors = np.sqrt(np.diag(model.covariance)) / LARGEST_BIAS
    like = [gravity if n.startswith("gravity") else dry if n == "offset" else 0.0 for n in model.names]
    return np.maximum(np.maximum(np.abs(model.values), like), errors)
