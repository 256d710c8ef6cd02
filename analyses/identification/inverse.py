"""The inverse dynamic model of one or several records: inertia, friction, load, by joint least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.least_squares import (
    NotTold,
    Solution,
    by_record,
    covariance_of,
    solve,
    told_apart,
)
from analyses.estimation.parameters import own_std, parameter
from analyses.identification.joint_model import FrictionForm, JointModel, Recipe, RecordFit, default_value
from analyses.identification.rows import Rows, record_rows, rows_under
from analyses.records.record import Record

GRAVITY_ROUNDS = 6


def fit_records(
    design: Design,
    records: Sequence[Record],
    *,
    form: FrictionForm = "symmetric",
    recipe: Recipe | None = None,
    fixed: Mapping[str, float] | None = None,
    gravity: bool = False,
    knots_rad_s: Sequence[float] | None = None,
    weights: Sequence[float] | None = None,
) -> JointModel:
    """Fit one inverse dynamic model to all records.

    Each record counts with the inverse of its own residual variance, or by its ``weights``. What the records
    do not tell apart is kept at the design's value, and said; the design's constants make torques of currents
    or voltages. ``fixed`` holds values by the names of the model, ``gravity`` looks for a moment ``m g l
    sin(output angle + offset)``, ``knots_rad_s`` (from 0) are speeds of a friction map in the place of dry
    and viscous friction. The recipe is by default that of each record's own period.

    Raises
    ------
    InputError
        If a record lacks a signal, or nothing is left to fit.
    NumericalError
        If the rows are singular all the same.
    """
    if not records:
        raise InputError("no record to identify from")
    held = dict(fixed or {})
    knots = None if knots_rad_s is None else tuple(float(v) for v in knots_rad_s)
    moments: Sequence[FloatArray | None] = [None] * len(records)
    model: JointModel | None = None
    for _ in range(GRAVITY_ROUNDS if gravity else 1):
        blocks = [
            record_rows(design, record, form, recipe, gravity=gravity, moment=moment, knots_rad_s=knots)
            for record, moment in zip(records, moments, strict=True)
        ]
        model = replace(_fitted(design, blocks, form, held, weights), knots_rad_s=knots)
        if gravity:
            moments = [
                model["gravity_sin"] * block.sine + model["gravity_cos"] * block.cosine for block in blocks
            ]
    assert model is not None
    return model


def _fitted(
    design: Design,
    blocks: Sequence[Rows],
    form: FrictionForm,
    held: Mapping[str, float],
    given: Sequence[float] | None = None,
) -> JointModel:
    names = blocks[0].names
    unknown = sorted(set(held) - set(names))
    if unknown:
        raise InputError(f"{unknown[0]}: no parameter of this model; there are: {', '.join(names)}")
    fixed = {name: Fixed(value=value, reason="fixed as asked") for name, value in held.items()}
    free = tuple(name for name in names if name not in fixed)
    w = np.concatenate([block.w for block in blocks])
    kept, left = told_apart(w[:, [names.index(name) for name in free]], free)
    for one in left:
        fixed[one.name] = Fixed(value=default_value(design, one.name), reason=_kept(one), moves=one.moves)
    free = tuple(free[k] for k in kept)
    if not free:
        raise InputError("nothing is left to fit: all parameters are fixed", where=blocks[0].record)
    weights = np.ones(len(blocks)) if given is None else np.asarray(given, dtype=float)
    solution = _joint(blocks, free, fixed, weights)
    for _ in range(3 if len(blocks) > 1 and given is None else 0):
        weights = _weights(blocks, solution, weights)
        solution = _joint(blocks, free, fixed, weights)
    negative = _negative(free, solution)
    if negative:
        again = {name: default_value(design, name) for name in negative}
        model = _fitted(design, blocks, form, {**held, **again}, given)
        others = w[:, [names.index(name) for name in model.names]]
        said: dict[str, Fixed] = {}
        for name, kept_at in again.items():
            moves = np.linalg.lstsq(others, w[:, names.index(name)], rcond=None)[0]
            said[name] = Fixed(
                value=kept_at,
                reason="would come out negative: not determined, the design's value kept",
                moves=dict(zip(model.names, moves.tolist(), strict=True)),
                std=abs(kept_at - float(solution.values[free.index(name)])),
            )
        covariance = model.covariance + _of_fixed(design, model.names, said)
        return replace(model, fixed={**model.fixed, **said}, covariance=covariance)
    return _model(design, blocks, free, fixed, form, solution, weights)


def _kept(one: NotTold) -> str:
    moved = " and ".join(f"{name} by {-factor:.3g} times it" for name, factor in one.moves.items())
    return f"{one}: the design's value kept" + (f"; an error of it moves {moved}" if moved else "")


def _of_fixed(design: Design, free: tuple[str, ...], fixed: Mapping[str, Fixed]) -> FloatArray:
    """What the errors of the values kept add to the covariance of those that were found."""
    added = np.zeros((len(free), len(free)))
    for name, one in fixed.items():
        moves = np.array([one.moves.get(other, 0.0) for other in free])
        variance = own_std(design, parameter(name).key) ** 2 + one.std**2
        added += variance * np.outer(moves, moves)
    return added


def _negative(names: tuple[str, ...], solution: Solution) -> list[str]:
    """Parameters that no drive has negative, where the records give them so."""
    signed = ("offset", "gravity_sin", "gravity_cos")
    return [
        name for name, value in zip(names, solution.values, strict=True) if value < 0.0 and name not in signed
    ]


def _target(block: Rows, fixed: Mapping[str, Fixed]) -> FloatArray:
    """The drive signal less what fixed parameters explain."""
    y = block.y
    for name, one in fixed.items():
        y = y - one.value * block.w[:, block.names.index(name)]
    return np.asarray(y)


def _joint(
    blocks: Sequence[Rows], free: tuple[str, ...], fixed: Mapping[str, Fixed], weights: FloatArray
) -> Solution:
    columns = [blocks[0].names.index(name) for name in free]
    w = np.concatenate([g * block.w[:, columns] for g, block in zip(weights, blocks, strict=True)])
    y = np.concatenate([g * _target(block, fixed) for g, block in zip(weights, blocks, strict=True)])
    ends = tuple(np.cumsum([len(block.y) for block in blocks]).tolist())
    try:
        return solve(w, y, ends)
    except np.linalg.LinAlgError:
        raise NumericalError(f"the records do not tell {', '.join(free)} apart") from None


def _weights(blocks: Sequence[Rows], solution: Solution, weights: FloatArray) -> FloatArray:
    """Inverse residual of each record, against the median so that the size of things stays."""
    ends = np.cumsum([len(block.y) for block in blocks])
    parts = np.split(solution.residual, ends[:-1])
    sizes = np.array([np.sqrt(np.mean(part**2)) for part in parts]) / weights
    middle = float(np.median(sizes))
    if middle == 0.0:
        return weights
    return np.asarray(middle / np.maximum(sizes, 0.05 * middle))


def _singles(
    blocks: Sequence[Rows], free: tuple[str, ...], fixed: Mapping[str, Fixed], values: FloatArray
) -> list[tuple[Fit, FloatArray]]:
    """Each record fitted alone, and its residual: what it tells, the rest held at ``values``."""
    out = []
    for block in blocks:
        columns = [block.names.index(name) for name in free]
        kept, _ = told_apart(block.w[:, columns], free)
        own = tuple(free[k] for k in kept)
        rest = {
            name: Fixed(value=float(value), reason="determined by other records")
            for name, value in zip(free, values, strict=True)
            if name not in own
        }
        result = _joint([block], own, {**fixed, **rest}, np.ones(1))
        fit = Fit(names=own, values=result.values, covariance=result.correlated)
        out.append((fit, result.residual))
    return out


def _model(
    design: Design,
    blocks: Sequence[Rows],
    free: tuple[str, ...],
    fixed: Mapping[str, Fixed],
    form: FrictionForm,
    solution: Solution,
    weights: FloatArray,
) -> JointModel:
    singles = _singles(blocks, free, fixed, solution.values) if len(blocks) > 1 else []
    columns = [blocks[0].names.index(name) for name in free]
    rests = [_target(block, fixed) - block.w[:, columns] @ solution.values for block in blocks]
    residual = np.concatenate(rests)
    drive = np.concatenate([block.y for block in blocks])
    own = [rest for _, rest in singles] or rests
    found = {name: one.value for name, one in fixed.items()}
    found |= dict(zip(free, solution.values.tolist(), strict=True))
    parts = tuple(
        _part(block, block.w[:, columns], found, *pair)
        for block, *pair in zip(blocks, rests, own, strict=True)
    )
    scaled = [(g * part.w, g * part.own_residual) for g, part in zip(weights, parts, strict=True)]
    model = JointModel(
        form=form,
        names=free,
        values=solution.values,
        white_errors=np.sqrt(np.diag(solution.white)),
        covariance=covariance_of(scaled),
        between=dict.fromkeys(free, 0.0),
        fixed=dict(fixed),
        relative_residual=float(np.linalg.norm(residual) / np.linalg.norm(drive)),
        records=parts,
        recipe=blocks[0].recipe,
        condition=solution.condition,
        weights=tuple(weights.tolist()),
        alone=tuple(fit for fit, _ in singles),
    )
    return with_scatter(design, model)


def with_scatter(design: Design, model: JointModel) -> JointModel:
    """The model with the scatter between its records, and the tolerances of what was kept, in its errors."""
    scatter = by_record(model.alone, model.names) if model.alone else {}
    between = {name: scatter[name][0] if scatter else 0.0 for name in model.names}
    extra = np.diag([scatter[name][1] ** 2 if scatter else 0.0 for name in model.names])
    kept = _of_fixed(design, model.names, model.fixed)
    return replace(model, between=between, covariance=model.covariance + extra + kept)


FRICTION = ("viscous", "dry", "map_")


def _part(
    block: Rows, w: FloatArray, found: Mapping[str, float], rest: FloatArray, own: FloatArray
) -> RecordFit:
    other = [0.0 if name.startswith(FRICTION) else found[name] for name in block.names]
    return RecordFit(
        name=block.record,
        rows_in=block.rows_in,
        rows_used=len(block.y),
        rows_at_rest=int(np.count_nonzero(~block.keep)),
        relative_residual=float(np.linalg.norm(rest) / np.linalg.norm(block.y)),
        used=block.used,
        notes=block.notes,
        w=w,
        residual=rest,
        own_residual=own,
        keep=block.keep,
        speed=block.speed,
        acceleration=block.w[:, block.names.index("inertia")],
        drive=block.y,
        friction=block.y - block.w @ np.array(other),
        step_s=block.step_s,
        noise=own,
        compared=np.ones(len(own), dtype=bool),
    )


def held_out_residual(design: Design, model: JointModel, record: Record) -> float:
    """Relative residual of a record that the model has not seen."""
    block = rows_under(design, record, model)
    rest = block.y - block.w @ np.array([model[name] for name in block.names])
    return float(np.linalg.norm(rest) / np.linalg.norm(block.y))
