"""Whether the friction law of a fit is that of its records: what the residual still tells of the speed."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import t

from actuator_lti.types import Floats, Mask
from analyses.estimation.least_squares import (
    LEAST_OWN_SHARE,
    RESOLVED,
    event_blocks,
    independent,
    scaled_lstsq,
    wider_covariance,
)
from analyses.identification.friction_map import away_from_reversals, speeds_tried
from analyses.identification.joint_model import JointModel, RecordFit
from analyses.records.consistency import NO_CHANCE


@dataclass(frozen=True, kw_only=True)
class Bend:
    """A term that the friction law lacks."""

    speed_rad_s: float  # below which the friction leaves its line over the speed; inf: it does by direction
    errors: float  # standard errors that the term is from zero
    moved: Floats = field(repr=False)  # what each value of the fit changes by beside it
    tries: int
    blocks: int  # behind the standard error

    @property
    def chance(self) -> float:
        """Probability of a term as sure as this among all that were tried, where the law is right."""
        return min(self.tries * 2.0 * float(t.sf(self.errors, self.blocks - 1)), 1.0)

    @property
    def is_sure(self) -> bool:
        """Whether no chance explains it."""
        return self.chance < NO_CHANCE


def bend_of(model: JointModel) -> Bend:
    """The surest of the terms that a richer law has: a slope of its own below some speed, or by direction.

    Score tests (C. R. Rao, 1948): each term alone beside those of the model, in what the simulated records
    leave of the residual; where none are, in rows away from reversals, which the filter mixes. By Student's
    distribution for the blocks behind the error (Bell and McCaffrey, 2002), as few may hold all events.
    """
    tried = speeds_tried(max(float(np.max(np.abs(part.speed))) for part in model.records)).tolist()
    if model.form == "symmetric" and model.knots_rad_s is None:
        tried.append(np.inf)
    terms = [_term(model, speed, len(tried)) for speed in tried]
    return max(terms, key=lambda one: one.errors)


def _term(model: JointModel, speed: float, tries: int) -> Bend:
    """One term; no standard errors from zero where the rows do not tell it."""
    tables, rests = [], []
    for weight, part in zip(model.weights, model.records, strict=True):
        rows = part.compared if model.simulated else away_from_reversals(part)
        term = _bent(part.speed[rows], speed)
        tables.append(weight * np.column_stack([part.w[rows], *kept_columns(model, part, rows), term]))
        rests.append(weight * part.noise[rows[part.compared]])
    count, term, rest = len(model.names), np.concatenate(tables)[:, -1], np.concatenate(rests)
    moved = -scaled_lstsq(np.concatenate(tables)[:, :count], term)
    # of the others all that differ: what a kept value is off by is no term
    others = independent(np.concatenate(tables)[:, :-1], least=RESOLVED)
    tables = [each[:, [*others, -1]] for each in tables]
    table = np.concatenate(tables)
    own = term - table[:, :-1] @ scaled_lstsq(table[:, :-1], term)
    if len(rest) <= table.shape[1] or not np.linalg.norm(own) > LEAST_OWN_SHARE * np.linalg.norm(term):
        return Bend(speed_rad_s=speed, errors=0.0, moved=np.zeros(count), tries=tries, blocks=2)
    found = scaled_lstsq(table, rest)
    left = [(w, e - w @ found) for w, e in zip(tables, rests, strict=True)]
    error = float(np.sqrt(wider_covariance(left)[-1, -1]))
    errors = abs(float(found[-1])) / error if error > 0.0 else 0.0
    blocks = sum(event_blocks(len(one)) for one in rests)
    return Bend(speed_rad_s=speed, errors=errors, moved=found[-1] * moved, tries=tries, blocks=blocks)


def kept_columns(model: JointModel, part: RecordFit, rows: Mask) -> Iterator[Floats]:
    """Acceleration, speed and direction as far as none of it is free: what a model keeps may be off."""
    kinds = {name.partition("_")[0] for name in model.names}
    if "inertia" not in kinds:
        yield part.acceleration[rows]
    if not kinds & {"viscous", "map"}:
        yield part.speed[rows]
    if not kinds & {"dry", "map"}:
        yield np.sign(part.speed[rows])


def _bent(speed: Floats, below: float) -> Floats:
    """The term that is tried."""
    size = np.abs(speed)
    return size if np.isinf(below) else np.sign(speed) * np.maximum(below - size, 0.0)
