"""Whether the friction law of a fit is that of its records: what the residual still tells of the speed."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from scipy.stats import t

from actuator_lti.types import Floats
from analyses.estimation.least_squares import event_blocks, scaled_lstsq, wider_covariance
from analyses.identification.friction_map import away_from_reversals, speeds_tried
from analyses.identification.joint_model import JointModel
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
        columns = np.column_stack([part.w[rows], *_columns(model, part.speed[rows], speed)])
        tables.append(weight * columns)
        rests.append(weight * part.noise[rows[part.compared]])
    table, rest, count = np.concatenate(tables), np.concatenate(rests), len(model.names)
    size = np.maximum(np.linalg.norm(table, axis=0), 1e-300)
    if len(rest) <= table.shape[1] or np.linalg.matrix_rank(table / size) < table.shape[1]:
        return Bend(speed_rad_s=speed, errors=0.0, moved=np.zeros(count), tries=tries, blocks=2)
    found = scaled_lstsq(table, rest)
    left = [(w, e - w @ found) for w, e in zip(tables, rests, strict=True)]
    error = float(np.sqrt(wider_covariance(left)[-1, -1]))
    errors = abs(float(found[-1])) / error if error > 0.0 else 0.0
    blocks = sum(event_blocks(len(one)) for one in rests)
    return Bend(speed_rad_s=speed, errors=errors, moved=found[:count], tries=tries, blocks=blocks)


def _columns(model: JointModel, speed: Floats, below: float) -> Iterator[Floats]:
    """The line over the speed as far as the model has none of it free, and the term that is tried."""
    kinds = {name.partition("_")[0] for name in model.names}
    if not kinds & {"viscous", "map"}:
        yield speed
    if not kinds & {"dry", "map"}:
        yield np.sign(speed)
    size = np.abs(speed)
    yield size if np.isinf(below) else np.sign(speed) * np.maximum(below - size, 0.0)
