"""The constant that makes torques of a recorded current or voltage, where no record tells it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from analyses.estimation.fit import Fixed
from analyses.estimation.parameters import own_share
from analyses.identification.joint_model import JointModel, Recipe
from analyses.identification.rows import drive_of, rows_under
from analyses.records.consistency import SURE, electrical_parts
from analyses.records.record import Record

STEP = 0.1
FIELDS = {"torque_constant": "torque_constant_Nm_A", "source_gain": "source_gain_Nm_V"}
"""Of a motor, by the names of `analyses.estimation.parameters`."""


def given_constant(model: JointModel) -> str | None:
    """The constant of the design that the values of a model hang on, by name."""
    return next((name for name in FIELDS if name in model.fixed), None)


def with_given_constant(
    start: Design, model: JointModel, records: Sequence[Record], recipe: Recipe | None
) -> JointModel:
    """The model and, among what is kept, the design's constant that all its values hang on; none if told.

    A motion and a current tell ratios to kM alone: with another kM, or a current of another scale, the same
    record has other values. Values and intervals are then those at the design's constant, and ``moves`` says
    by how much an error of it moves each of them, with known loads and held values where there are such.
    """
    names = {_constant(start, record) for record in records}
    name = names.pop() if len(names) == 1 else None
    if name is None:
        return model
    value = float(getattr(start.motor, FIELDS[name]))
    changed: dict[str, Any] = {FIELDS[name]: (1.0 + STEP) * value}
    more = replace(start, motor=replace(start.motor, **changed))
    share = _shares(start, more, model, records, recipe)
    each = [f"{100.0 * STEP * part:+.2g} %" for part in share]
    words = f"{each[0]} of every value"
    if len(set(each)) > 1:
        words = " and ".join(f"{part} of {one}" for part, one in zip(each, model.names, strict=True))
    scale = "" if name == "source_gain" else ", nor the scale of the current (rms read as DC: 0.82 times)"
    kept = Fixed(
        value=value,
        reason=f"these records do not tell it{scale}: values and intervals are those at the design's; "
        f"{100.0 * STEP:+.2g} % of it is {words}",
        moves={n: -part * model[n] / value for n, part in zip(model.names, share.tolist(), strict=True)},
    )
    return replace(model, fixed={**model.fixed, name: kept})


def _constant(design: Design, record: Record) -> str | None:
    """What makes a torque of this record's drive signal, where nothing else in the record tells it."""
    driven_by = drive_of(design, record)[1]
    if {"force", "force_reference", "torque_reference"} & record.signals.keys():
        return None
    if driven_by.startswith("voltage"):
        return None if design.effective_motor.source_gain_Nm_V is None else "source_gain"
    low, high = electrical_parts(record.drive(design), record).get("kE w", (-inf, inf))
    closely = 0.5 * (high - low) <= SURE * own_share(design, "motor.back_emf_constant")
    return None if closely else "torque_constant"


def _shares(
    start: Design, more: Design, model: JointModel, records: Sequence[Record], recipe: Recipe | None
) -> np.ndarray:
    """Relative change of each fitted value over that of the constant; exact, as the fit is linear in it."""
    tables, drives, changes = [], [], []
    for weight, record in zip(model.weights, records, strict=True):
        one, other = (rows_under(design, record, model, recipe) for design in (start, more))
        columns = [one.names.index(name) for name in model.names]
        kept = [one.names.index(name) for name in one.names if name not in model.names]
        held = one.w[:, kept] @ np.array([model[one.names[k]] for k in kept])
        tables.append(weight * one.w[:, columns])
        drives.append(weight * (one.y - held))
        changes.append(weight * (other.y - one.y) / STEP)
    table = np.concatenate(tables)
    size = np.linalg.norm(table, axis=0)
    both = np.column_stack([np.concatenate(drives), np.concatenate(changes)])
    value, change = np.linalg.lstsq(table / size, both, rcond=None)[0].T
    return np.divide(change, value, out=np.zeros_like(change), where=value != 0.0)
