"""The inverse dynamic model of one or several records: inertia, friction, load, by joint least squares."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.least_squares import (
    Solution,
    by_record,
    covariance_of,
    identifiable,
    information_of,
    solve,
)
from analyses.estimation.parameters import default_value, own_std, parameter
from analyses.identification.joint_model import FrictionForm, JointModel, Recipe, RecordFit, Rows
from analyses.identification.rows import record_rows, rows_under
from analyses.records.record import Record

GRAVITY_ROUNDS = 6
FRICTION = ("viscous", "dry", "map_")
SIGNED = ("offset", "gravity_sin", "gravity_cos")


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

    Each record counts with the inverse of its own residual variance, or by its ``weights`` in a fit whose own
    bias is looked for (there no value is kept for being negative). What the records do not tell apart is kept
    at the design's value, and said; the design's constants make torques of currents or voltages. ``fixed``
    holds values by the names of the model, ``gravity`` looks for a moment ``m g l sin(output angle +
    offset)``, ``knots_rad_s`` (from 0) are speeds of a friction map in the place of dry and viscous friction.
    The recipe is by default that of each record's own period.

    Raises `InputError`: if a record lacks a signal, or nothing is left to fit. Raises `NumericalError`: if
    the rows are singular all the same.
    """
    knots = None if knots_rad_s is None else tuple(float(v) for v in knots_rad_s)
    moments: Sequence[Floats | None] = [None] * len(records)
    for _ in range(GRAVITY_ROUNDS if gravity else 1):
        blocks = [
            record_rows(design, record, form, recipe, gravity=gravity, moment=moment, knots_rad_s=knots)
            for record, moment in zip(records, moments, strict=True)
        ]
        model = _fitted(design, blocks, fixed or {}, weights)
        if gravity:
            a, b = model["gravity_sin"], model["gravity_cos"]
            moments = [a * block.sine + b * block.cosine for block in blocks]
    return replace(model, form=form, knots_rad_s=knots, asked=recipe)


@dataclass(frozen=True)
class _Problem:
    """The rows of records, the names that are free in them, and those that are held."""

    blocks: Sequence[Rows]
    free: Sequence[str]
    fixed: Mapping[str, Fixed]

    def columns(self, names: Sequence[str]) -> Floats:
        return np.concatenate([block.columns(names) for block in self.blocks])

    def targets(self) -> list[Floats]:
        """The drive signal of each record less what is held explains."""
        held = {name: one.value for name, one in self.fixed.items()}
        return [block.y - block.explained(held, list(held)) for block in self.blocks]

    def solved(self, weights: Floats) -> Solution:
        w = np.concatenate([g * one.columns(self.free) for g, one in zip(weights, self.blocks, strict=True)])
        y = np.concatenate([g * target for g, target in zip(weights, self.targets(), strict=True)])
        try:
            return solve(w, y, np.cumsum([block.rows_used for block in self.blocks]).tolist())
        except np.linalg.LinAlgError:
            raise NumericalError(f"the records do not tell {', '.join(self.free)} apart") from None


def _fitted(
    design: Design, blocks: Sequence[Rows], held: Mapping[str, float], given: Sequence[float] | None
) -> JointModel:
    names = blocks[0].names
    unknown = sorted(set(held) - set(names))
    if unknown:
        raise InputError(f"{unknown[0]}: no parameter of this model; there are: {', '.join(names)}")
    fixed = {name: Fixed(value=value, reason="fixed as asked") for name, value in held.items()}
    problem = _Problem(blocks, [name for name in names if name not in fixed], fixed)
    kept, left = identifiable(problem.columns(problem.free), problem.free)
    for one in left:
        moves = {name: -factor for name, factor in one.moves.items()}
        moved = " and ".join(f"{name} by {factor:.3g} times it" for name, factor in moves.items())
        why = f"{one}: the design's value kept" + (f"; an error of it moves {moved}" if moved else "")
        fixed[one.name] = Fixed(value=default_value(design, one.name), reason=why, moves=moves)
    problem = _Problem(blocks, [problem.free[k] for k in kept], fixed)
    if not problem.free:
        raise InputError("nothing is left to fit: all parameters are fixed", where=blocks[0].name)
    weights = np.ones(len(blocks)) if given is None else np.asarray(given, dtype=float)
    solution = problem.solved(weights)
    ends = np.cumsum([block.rows_used for block in blocks])[:-1]
    for _ in range(3 if len(blocks) > 1 and given is None else 0):
        # by the inverse residual of each record, against the median so that the size of things stays
        sizes = np.array([np.sqrt(np.mean(part**2)) for part in np.split(solution.residual, ends)]) / weights
        middle = float(np.median(sizes))
        weights = weights if middle == 0.0 else np.asarray(middle / np.maximum(sizes, 0.05 * middle))
        solution = problem.solved(weights)
    found = dict(zip(problem.free, solution.values.tolist(), strict=True))
    negative = {name: value for name, value in found.items() if value < 0.0 and name not in SIGNED}
    if negative and given is None:  # as no drive has them; of a simulated record the bias is as it is
        # what cannot be told from others still free stays kept: a value that is not known tells nothing apart
        same = {one.name: fixed[one.name] for one in left if not one.moves.keys() & negative.keys()}
        again = {name: default_value(design, name) for name in (*same, *negative)}
        model = _fitted(design, blocks, {**held, **again}, None)
        model = replace(model, fixed={**model.fixed, **same})
        model = replace(model, covariance=model.covariance + _of_fixed(design, model.names, same))
        return _said(design, problem, negative, model)
    return _model(design, problem, solution, weights)


def _said(design: Design, problem: _Problem, negative: Mapping[str, float], model: JointModel) -> JointModel:
    """The model that says why some values are the design's, and holds what their errors move."""
    said = {}
    for name, value in negative.items():
        moves = -np.linalg.lstsq(problem.columns(model.names), problem.columns([name])[:, 0], rcond=None)[0]
        said[name] = Fixed(
            value=model[name],
            reason="would come out negative: not determined, the design's value kept",
            moves=dict(zip(model.names, moves.tolist(), strict=True)),
            std=abs(model[name] - value),
        )
    covariance = model.covariance + _of_fixed(design, model.names, said)
    return replace(model, fixed={**model.fixed, **said}, covariance=covariance)


def _of_fixed(design: Design, free: tuple[str, ...], fixed: Mapping[str, Fixed]) -> Floats:
    """What the errors of the values kept add to the covariance of those that were found."""
    added = np.zeros((len(free), len(free)))
    for name, one in fixed.items():
        moves = np.array([one.moves.get(other, 0.0) for other in free])
        added += (own_std(design, parameter(name).key) ** 2 + one.std**2) * np.outer(moves, moves)
    return added


def _single(block: Rows, problem: _Problem, found: Mapping[str, float]) -> tuple[Fit, Floats]:
    """One record fitted alone, and its residual: what it tells, the rest held at what all gave."""
    kept, left = identifiable(block.columns(problem.free), problem.free)
    rest = {one.name: Fixed(value=found[one.name], reason="determined by other records") for one in left}
    own = tuple(problem.free[k] for k in kept)
    result = _Problem([block], own, {**problem.fixed, **rest}).solved(np.ones(1))
    return Fit(names=own, values=result.values, covariance=result.correlated), result.residual


def _model(design: Design, problem: _Problem, solution: Solution, weights: Floats) -> JointModel:
    blocks, free = problem.blocks, tuple(problem.free)
    found = {name: one.value for name, one in problem.fixed.items()}
    found |= dict(zip(free, solution.values.tolist(), strict=True))
    singles = [_single(block, problem, found) for block in blocks] if len(blocks) > 1 else []
    targets = zip(blocks, problem.targets(), strict=True)
    rests = [target - block.columns(free) @ solution.values for block, target in targets]
    parts = []
    for block, rest, own in zip(blocks, rests, [rest for _, rest in singles] or rests, strict=True):
        other = block.explained(found, [name for name in block.names if not name.startswith(FRICTION)])
        left: dict[str, Any] = {"residual": rest, "own_residual": own, "noise": own}
        left |= {"inputs": np.column_stack([block.speed, block.acceleration]), "friction": block.y - other}
        left |= {"names": free, "w": block.columns(free), "compared": np.ones(len(own), dtype=bool)}
        parts.append(RecordFit(**{**vars(block), **left}))
    each = [information_of(g * one.w, g * one.own_residual) for g, one in zip(weights, parts, strict=True)]
    drive = np.concatenate([block.y for block in blocks])
    model = JointModel(
        names=free,
        values=solution.values,
        white_errors=np.sqrt(np.diag(solution.white)),
        covariance=covariance_of(each),
        between={},
        fixed=dict(problem.fixed),
        relative_residual=float(np.linalg.norm(np.concatenate(rests)) / np.linalg.norm(drive)),
        records=tuple(parts),
        recipe=blocks[0].recipe,
        condition=solution.condition,
        weights=tuple(weights.tolist()),
        alone=tuple(fit for fit, _ in singles),
    )
    return with_scatter(design, model)


def with_scatter(design: Design, model: JointModel) -> JointModel:
    """The model with the scatter between its records, and the tolerances of what was kept, in its errors."""
    scatter = by_record(model.alone, model.names)
    extra = np.diag([joint**2 for _, joint in scatter.values()])
    kept = _of_fixed(design, model.names, model.fixed)
    between = {name: single for name, (single, _) in scatter.items()}
    return replace(model, between=between, covariance=model.covariance + extra + kept)


def held_out_residual(design: Design, model: JointModel, record: Record) -> float:
    """Relative residual of a record that the model has not seen."""
    block = rows_under(design, record, model)
    rest = block.y - block.explained(model, block.names)
    return float(np.linalg.norm(rest) / np.linalg.norm(block.y))
