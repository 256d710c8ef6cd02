"""Friction as a map over the speed: break points found, and judged against the plain law."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from actuator_lti.types import Floats, Mask
from analyses.estimation.series import correlation_time
from analyses.identification.joint_model import JointModel, LawChoice, RecordFit, linear_basis

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
