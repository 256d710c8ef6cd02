"""Whether the friction law of a fit is that of its records: what the residual still tells of the speed."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.stats import t

from actuator_lti.types import Floats
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
    blocks: int  # behind the standard error
    share: float = 0.0  # of the drive, that is this term
    own: Floats = field(repr=False)  # of the term: what the values of the fit leave of it, of size 1 (or 0)
    chance: float = 1.0  # of a term as sure as this among all that were tried, the law being right

    @property
    def is_sure(self) -> bool:
        """Whether no chance explains it, and it is more than simulated records err by."""
        return self.chance < NO_CHANCE and self.share > RESOLVED


def bend_of(model: JointModel) -> Bend:
    """The surest of the terms that a richer law has: a slope of its own below some speed, or by direction.

    Score tests (C. R. Rao, 1948): each term alone beside those of the model, in what the simulated records
    leave of the residual; where none are, in rows away from reversals, which the filter mixes. By Student's
    distribution for the blocks behind the error (Bell and McCaffrey, 2002), as few may hold all events; of
    all speeds together by the length of the curve that their terms make on the sphere (Hotelling, 1939).
    """
    top = max(float(np.max(np.abs(part.speed))) for part in model.records)
    terms = bends = [_term(model, speed) for speed in speeds_tried(top).tolist()]
    if model.form == "symmetric" and model.knots_rad_s is None:
        terms = [*bends, _term(model, np.inf)]
    surest = max(terms, key=lambda one: one.errors)
    told = [one.own for one in bends if len(one.own)]
    turned = [np.arccos(np.clip(one @ other, -1.0, 1.0)) for one, other in pairwise(told)]
    freedom, ends = surest.blocks - 1, 1 + len(terms) - len(bends)
    chance = 2.0 * ends * t.sf(surest.errors, freedom)
    chance += sum(turned) / np.pi * (1.0 + surest.errors**2 / freedom) ** (0.5 * (1 - freedom))
    return replace(surest, chance=min(float(chance), 1.0))


def _term(model: JointModel, speed: float) -> Bend:
    """One term; no standard errors from zero where the rows do not tell it."""
    tables, rests, fitted, drive = [], [], [], 0.0
    for weight, part in zip(model.weights, model.records, strict=True):
        rows = part.compared if model.simulated else away_from_reversals(part)
        fast, used = np.abs(part.speed), part.compared
        bent = fast if np.isinf(speed) else np.sign(part.speed) * np.maximum(speed - fast, 0.0)
        term = part.answered(bent)
        tables.append(weight * np.column_stack([part.w, *kept_columns(model, part), term])[rows])
        rests.append(weight * part.noise[rows[used]])
        drive = float(np.hypot(drive, weight * np.linalg.norm(part.y[rows])))
        fitted.append(weight * np.column_stack([part.w, term])[used])
    term, rest = np.concatenate(tables)[:, -1], np.concatenate(rests)
    # where the motion turns back is most of what a bend makes of the values
    moved = -scaled_lstsq((every := np.concatenate(fitted))[:, :-1], every[:, -1])
    # of the others all that differ: what a kept value is off by is no term
    others = independent(np.concatenate(tables)[:, :-1], least=RESOLVED)
    tables = [each[:, [*others, -1]] for each in tables]
    table = np.concatenate(tables)
    own = term - table[:, :-1] @ scaled_lstsq(table[:, :-1], term)
    size = float(np.linalg.norm(own))
    if len(rest) <= table.shape[1] or not size > LEAST_OWN_SHARE * np.linalg.norm(term):
        return Bend(speed_rad_s=speed, errors=0.0, moved=np.zeros_like(moved), blocks=2, own=np.zeros(0))
    found = scaled_lstsq(table, rest)
    left = [(w, e - w @ found) for w, e in zip(tables, rests, strict=True)]
    error = float(np.sqrt(wider_covariance(left)[-1, -1]))
    errors = abs(float(found[-1])) / error if error > 0.0 else 0.0
    blocks = sum(event_blocks(len(one)) for one in rests)
    moved, share = found[-1] * moved, abs(float(found[-1])) * size / drive
    return Bend(speed_rad_s=speed, errors=errors, moved=moved, blocks=blocks, own=own / size, share=share)


def kept_columns(model: JointModel, part: RecordFit) -> Iterator[Floats]:
    """Acceleration, speed and direction as far as none of it is free: what a model keeps may be off."""
    kinds = {name.partition("_")[0] for name in model.names}
    if "inertia" not in kinds:
        yield part.answered(part.acceleration)
    if not kinds & {"viscous", "map"}:
        yield part.answered(part.speed)
    if not kinds & {"dry", "map"}:
        yield part.answered(np.sign(part.speed))
