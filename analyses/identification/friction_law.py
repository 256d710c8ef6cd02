"""Friction over the speed: a map where it is clearly better, and whether the law of a fit is its records'."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t

from actuator_lti.types import Floats, Mask
from analyses.estimation.least_squares import (
    LEAST_OWN_SHARE,
    RESOLVED,
    event_blocks,
    identifiable,
    scaled_lstsq,
    wider_covariance,
)
from analyses.estimation.series import correlation_time
from analyses.identification.joint_model import JointModel, LawChoice, RecordFit, linear_basis
from analyses.records.finding import NO_CHANCE

MOST_BREAKS = 4
GRID = 24
LEAST_SHARE = 0.005
CLEARLY_BETTER = 6.0  # of the criterion, for a law to be taken (strong evidence; Kass and Raftery 1995)


def fit_map(fit: Callable[..., JointModel]) -> JointModel:
    """Fit friction maps with one to four break points, and take one only where it is clearly better.

    The break points are found one after the other, each where it lowers the residual most among
    `speeds_tried`, and then moved in turn. ``fit`` is `fit_records` of some records.
    """
    plain = fit()
    clear = [(part, away_from_reversals(part)) for part in plain.records]
    speed = np.concatenate([part.speed[rows] for part, rows in clear])
    rest = np.concatenate([part.friction[rows] for part, rows in clear])
    top, n = float(np.max(np.abs(speed))), len(rest) / correlation_time(plain.residual)
    breaks: tuple[float, ...] = ()
    models, laws = [plain], [_law((), plain, n)]
    for count in range(1, MOST_BREAKS + 1):
        breaks = _one_more(speed, rest, top, breaks)
        if len(breaks) < count:
            break
        models.append(fit(knots_rad_s=(0.0, *breaks, top)))
        laws.append(_law(breaks, models[-1], n))
    laws = [replace(law, criterion=law.criterion - laws[0].criterion) for law in laws]
    best = min(range(len(laws)), key=lambda k: laws[k].criterion + (CLEARLY_BETTER if k else 0.0))
    laws[best] = replace(laws[best], taken=True)
    return replace(models[best], laws=tuple(laws))


def _law(breaks: tuple[float, ...], model: JointModel, independent: float) -> LawChoice:
    """A law and its Bayesian criterion; break points count as parameters."""
    square, count = float(np.mean(model.residual**2)), len(model.names)
    counted = count + max(sum(name.startswith("map_") for name in model.names) - 2, 0)
    return LawChoice(
        name=f"map, {len(breaks)} break points" if breaks else "plain, C0 + Cv |w|",
        breaks_rad_s=breaks,
        parameters=count + len(breaks),
        relative_residual=model.relative_residual,
        criterion=independent * float(np.log(square)) + counted * float(np.log(independent)),
        taken=False,
    )


def away_from_reversals(part: RecordFit) -> Mask:
    """Rows with no reversal beside: the decimation's filter mixes both sides."""
    side = np.sign(part.speed)
    turns = np.concatenate([[False], side[1:] != side[:-1], [False]])
    clear = ~(turns[1:] | turns[:-1])
    clear[1:-1] &= clear[2:] & clear[:-2]
    return clear


def speeds_tried(top: float) -> Floats:
    """Where a friction law may bend, evenly spaced in the logarithm, up to near the largest speed."""
    return np.geomspace(LEAST_SHARE * top, 0.95 * top, GRID)


def _one_more(speed: Floats, rest: Floats, top: float, result: tuple[float, ...]) -> tuple[float, ...]:
    """The break points with the best one more, then each moved in turn."""
    grid = speeds_tried(top)
    size, side = np.abs(speed), np.sign(speed)

    def misfit(breaks: Sequence[float]) -> float:
        w = linear_basis(size, (0.0, *sorted(breaks), top)) * side[:, None]
        w = np.column_stack([w, np.ones(len(w))])
        left = rest - w @ np.linalg.lstsq(w, rest, rcond=None)[0]
        return float(left @ left)

    def apart(one: float, others: Sequence[float]) -> bool:
        return all(abs(np.log(one / other)) > 0.1 for other in others)

    free = [v for v in grid.tolist() if apart(v, result)]
    if not free:
        return result
    chosen = [*result, min(free, key=lambda v: misfit([*result, v]))]
    step = np.log(0.95 / LEAST_SHARE) / (GRID - 1)
    for k, here in enumerate(chosen):  # between the grid's neighbours
        others = chosen[:k] + chosen[k + 1 :]
        ends = np.log(here) - step, min(np.log(here) + step, np.log(0.97 * top))
        moved = minimize_scalar(lambda x, o=others: misfit([*o, np.exp(x)]), bounds=ends, method="bounded")
        if apart(np.exp(moved.x), others) and moved.fun < misfit(chosen):
            chosen[k] = np.exp(moved.x)
    return tuple(float(v) for v in sorted(chosen))


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
    directions = [one.own for one in bends if len(one.own)]
    turned = [np.arccos(np.clip(one @ other, -1.0, 1.0)) for one, other in pairwise(directions)]
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
    others, _ = identifiable(np.concatenate(tables)[:, :-1], least=RESOLVED)
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
