"""Which further runs would shrink the uncertainty of the margins most."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from actuator_lti import assemble_loops, stability_margins
from actuator_lti.design import with_values
from actuator_lti.design.model import Design
from actuator_lti.design.plant import reachable_speed
from actuator_lti.errors import InputError
from actuator_lti.types import Floats, Progress
from analyses.identification.surface import PATHS, SurfaceFit

LOOPS = ("velocity", "position")
STEP = 0.02


@dataclass(frozen=True, kw_only=True)
class MarginSpread:
    """One margin of the design, and what the friction's uncertainty makes of it."""

    label: str
    unit: str
    value: float
    slopes: Floats  # per unit of C0, Cv and CM
    std: float
    floor_std: float  # what remains however many runs are made: the instruments' shared errors


@dataclass(frozen=True, kw_only=True)
class SuggestedRun:
    """One further run, and the relative mean variance of the margins once it and those before it are made."""

    order: int
    speed_rad_s: float
    load_Nm: float
    remaining: float


@dataclass(frozen=True, kw_only=True)
class CampaignSuggestion:
    """Suggested runs in the order of their worth, and the margins that they serve."""

    criterion: str
    margins: tuple[MarginSpread, ...]
    runs: tuple[SuggestedRun, ...]  # ``remaining`` counts only what runs can reduce, the random part
    shared_part: float  # share of the margins' variance that comes from errors which all runs share
    largest_shared: str | None  # of these


def suggest_runs(
    design: Design, fit: SurfaceFit, *, count: int = 6, criterion: str = "margins", progress: Progress = None
) -> CampaignSuggestion:
    """Suggest further (speed, load) points, one after the other, each the best after those before it.

    They lie in the range of the runs so far, in steps of an eighth. By ``margins`` the mean relative
    variance of the gain and phase margins of the velocity and position loop counts (c-optimal), with the
    friction of a slow motion (describing function), at no load and at the largest one; by ``D`` the
    determinant of the covariance of the coefficients.
    """
    if criterion not in ("margins", "D"):
        raise InputError(f'criterion = "{criterion}": "margins" or "D"')
    fitted = with_values(design, dict(zip(PATHS, (float(v) for v in fit.values), strict=True)))
    margins = margin_spreads(fitted, fit, progress=progress)
    slopes = np.array([m.slopes / m.std for m in margins if m.std > 0.0])
    if criterion == "margins" and not len(slopes):
        raise InputError("no margin depends on the friction: use the criterion D")
    weight = slopes.T @ slopes / max(len(slopes), 1)
    shared = {name: float(shift @ weight @ shift) / 3.0 for name, shift in fit.shared_shifts.items()}
    whole = float(np.sum(weight * fit.covariance))
    return CampaignSuggestion(
        criterion=criterion,
        margins=margins,
        runs=tuple(_greedy(fit, count, None if criterion == "D" else weight)),
        shared_part=sum(shared.values()) / whole if whole > 0.0 else 0.0,
        largest_shared=max(shared, key=lambda name: shared[name], default=None),
    )


def margin_spreads(design: Design, fit: SurfaceFit, *, progress: Progress = None) -> tuple[MarginSpread, ...]:
    """Margins, their slopes to C0, Cv, CM (central differences), and their spread from a fit's covariance."""
    middle = _margins(design)
    slopes = {key: np.zeros(3) for key in middle}
    for k, path in enumerate(PATHS):
        step = STEP * abs(fit.values[k])
        moved = (with_values(design, {path: float(fit.values[k] + s * step)}, check=False) for s in (-1, 1))
        low, high = map(_margins, moved)
        for key in middle.keys() & low.keys() & high.keys():
            slopes[key][k] = (high[key] - low[key]) / (2.0 * step)
        if progress is not None:
            progress(k + 1, 3)
    made = []
    for (label, unit), s in slopes.items():
        parts = (fit.covariance, fit.covariance - fit.random_covariance)
        std, floor = (float(np.sqrt(np.maximum(s @ covariance @ s, 0.0))) for covariance in parts)
        value = middle[label, unit]
        made.append(MarginSpread(label=label, unit=unit, value=value, slopes=s, std=std, floor_std=floor))
    return tuple(made)


def _margins(design: Design) -> dict[tuple[str, str], float]:
    """Gain (dB) and phase margins (deg) of the outer loops where friction matters most: in slow motion."""
    result: dict[tuple[str, str], float] = {}
    slow = 0.02 * min(reachable_speed(design), 1e3)
    for load in sorted({0.0, design.load.moment_max_Nm}):
        loops = assemble_loops(
            design, operating_point="describing-function", load_Nm=load, speed_amplitude_rad_s=slow
        )
        for name in LOOPS:
            loop = getattr(loops, name)
            if loop is None:
                continue
            margins = stability_margins(loop.plain_open)
            gain, phase = margins.gain_margin_db, margins.phase_margin_deg
            for what, unit, value in (("gain margin", "dB", gain), ("phase margin", "deg", phase)):
                if value is not None and np.isfinite(value):
                    result[f"{name} {what}, {load:g} N m", unit] = float(value)
    return result


def _greedy(fit: SurfaceFit, count: int, weight: Floats | None) -> Iterator[SuggestedRun]:
    """The run of the least weighed sum (or determinant) of the covariance, again and again."""
    own = float(np.median(fit.residual_stds_Nm**2))
    points = np.array([[1.0, p.speed_rad_s, p.load_Nm] for p in fit.points])
    rows, (_, speed, load) = points / fit.residual_stds_Nm[:, None], points.T
    loaded = load[load > 0.0]
    levels = np.linspace(loaded.min(), loaded.max(), 8) if len(loaded) else np.zeros(0)
    speeds = np.linspace(speed.min(), speed.max(), 9)
    candidates = np.array([[1.0, w, m] for m in (0.0, *levels) for w in speeds])
    information = rows.T @ rows

    def spread(matrix: Floats) -> float:
        covariance = np.linalg.inv(matrix)
        return float(np.linalg.det(covariance) if weight is None else np.sum(weight * covariance))

    start = spread(information)
    for order in range(1, count + 1):
        tried = [spread(information + np.outer(x, x) / own) for x in candidates]
        best = int(np.argmin(tried))
        _, w, m = candidates[best].tolist()
        information = information + np.outer(candidates[best], candidates[best]) / own
        yield SuggestedRun(order=order, speed_rad_s=w, load_Nm=m, remaining=tried[best] / start)
