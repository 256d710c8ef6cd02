"""Dynamic identification straight from a record: which signals it takes, and refinement by simulation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.identification.differentiation import FloatArray
from analyses.identification.dynamic import DynamicModel, FrictionForm, Recipe, identify_dynamics
from analyses.identification.output_error import OutputErrorResult, refine_by_output_error
from analyses.identification.to_design import design_with_estimate, dynamic_estimate
from analyses.records.record import Record


def identify_record(
    design: Design, record: Record, *, form: FrictionForm = "symmetric", recipe: Recipe | None = None
) -> tuple[DynamicModel, tuple[str, ...]]:
    """Identify inertia and friction of a drive from a record of its motion.

    A linear axis gives position (m) and force (N); a rotary one motor angle (rad) and the torque kM i.
    Without a recorded force the drive signal is the source's gain times the voltage. The period is rounded to
    a whole number of ns, past the rounding of the record's times.

    Returns
    -------
    DynamicModel, tuple of str
        The model, and notes on what was used.

    Raises
    ------
    InputError
        If the record lacks a signal.
    """
    notes = list(record.notes)
    if not record.is_regular:
        record = record.resampled()
        notes.append(record.notes[-1])
    place, drive, told = position_and_drive(design, record)
    period = float(round(float(np.mean(np.diff(record.time_s))) * 1e9) * 1e-9)
    notes.append(told)
    return identify_dynamics(place, drive, period, form=form, recipe=recipe), tuple(notes)


def position_and_drive(design: Design, record: Record) -> tuple[FloatArray, FloatArray, str]:
    """Position and drive force or torque of a record, at the motor, and which signals they came from."""
    linear = design.axis == "linear"
    if linear:
        place, told = record["position"], "position"
    elif "angle" in record.signals:
        place, told = record["angle"], "motor angle"
    else:
        place, told = design.total_ratio * record["output_angle"], "output angle times the reduction"
    gain, constant = design.motor.source_gain_Nm_V, design.motor.torque_constant_Nm_A
    if "force" in record.signals:
        return place, record["force"], f"{told} and recorded force"
    if "current" in record.signals and constant is not None:
        return (
            place,
            np.asarray(constant * record["current"]),
            f"{told} and torque kM i, kM = {constant:g} N m/A",
        )
    if "voltage" in record.signals and gain is not None:
        return (
            place,
            np.asarray(gain * record["voltage"]),
            f"{told} and source gain {gain:g} times the voltage",
        )
    raise InputError(
        "no drive signal: force, current (with kM) or voltage (with a source gain)", where=record.name
    )


def refine_record(
    design: Design,
    record: Record,
    model: DynamicModel,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> OutputErrorResult:
    """Refine an inverse-model estimate by simulating the closed loop over the record (output error on the
    drive signal).

    Raises
    ------
    InputError
        If the record holds no command.
    """
    from analyses.correlation.closed_loop import model_signals

    record = record if record.is_regular else record.resampled()
    estimate = dynamic_estimate(model, "inverse model")
    start = design_with_estimate(design, estimate)
    if design.axis == "linear":
        name, place = "force", "position"
        wanted = record["force"] if "force" in record.signals else position_and_drive(design, record)[1]
    else:
        name, place, wanted = "current", "angle", record["current"]
    measured = {name: wanted, place: record[place]}

    def output(tried: Design) -> FloatArray:
        return model_signals(tried, record, measured)[0][name]

    return refine_by_output_error(start, estimate.paths, output, wanted, progress=progress)
