"""Is a richer friction law warranted? Asked of runs that the law has not seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan

import numpy as np

from analyses.estimation.arrays import BoolArray, FloatArray, IntArray
from analyses.identification.shared_errors import with_shared
from analyses.identification.surface_fit import SurfaceFit

Terms = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]

FOLDS = 9
STRIBECK_SPEEDS = 12


@dataclass(frozen=True, kw_only=True)
class LawScore:
    """How well one law predicts runs that it was not fitted to.

    ``error_Nm`` is the root of the mean weighted squared prediction error, in N m; ``gain`` the relative
    reduction of the squared error against the plain law with its standard error ``gain_std`` (paired over the
    runs). ``warranted``: the gain exceeds twice its standard error and 5 %.
    """

    name: str
    formula: str
    parameters: int = 0
    error_Nm: float = nan
    gain: float = nan
    gain_std: float = nan
    warranted: bool = False
    possible: bool = True
    reason: str = ""


@dataclass(frozen=True, kw_only=True)
class RicherLaws:
    """All laws that were tried; ``best`` is the plain one unless another is warranted."""

    scores: tuple[LawScore, ...]
    best: str
    folds: int


def compare_laws(fit: SurfaceFit) -> RicherLaws:
    """Score richer laws by cross-validation over the runs of a fit.

    The runs are ordered by load and speed and dealt to nine folds; each law is fitted to eight of them, with
    the weights of the fit, and predicts the ninth. The speed of the Stribeck term is chosen inside each fit.
    """
    points = fit.points
    speed = np.array([p.speed_rad_s for p in points])
    load = np.array([p.load_Nm for p in points])
    side = np.array([float(p.direction) for p in points])
    torque = np.array([p.torque_Nm for p in points])
    weight = 1.0 / fit.residual_stds_Nm
    folds = _folds(speed, load, side)
    data = _Data(speed, load, side, torque, weight, fit.shared_effects * weight[:, None])
    unit = 1.0 / float(np.sqrt(np.mean(weight**2)))
    base = unit * _errors(data, folds, _plain(data))
    scores = [_score("plain", "C0 + Cv w + CM |M|", 3, base, base)]
    for name, formula, terms in _LAWS:
        extra = terms(speed, load, side)
        if name == "per direction" and len(set(side)) < 2:
            scores.append(_impossible(name, formula, "one direction only"))
        elif len(points) < 2 * (3 + extra.shape[1]):
            scores.append(_impossible(name, formula, "too few runs"))
        else:
            table = np.column_stack([_plain(data), extra])
            errors = unit * _errors(data, folds, table)
            scores.append(_score(name, formula, table.shape[1], base, errors))
    scores.append(_score("Stribeck", "+ CS exp(-w/ws)", 5, base, unit * _stribeck_errors(data, folds)))
    good = [score for score in scores if score.warranted]
    best = min(good, key=lambda score: score.error_Nm).name if good else "plain"
    return RicherLaws(scores=tuple(scores), best=best, folds=int(folds.max()) + 1)


_LAWS: tuple[tuple[str, str, Terms], ...] = (
    ("quadratic", "+ C2 w^2", lambda w, m, s: (w**2)[:, None]),
    ("load-dependent viscous", "+ CvM w |M|", lambda w, m, s: (w * m)[:, None]),
    ("load squared", "+ CM2 M^2", lambda w, m, s: (m**2)[:, None]),
    ("per direction", "+ s (CS0 + CS1 w)", lambda w, m, s: np.column_stack([s, s * w])),
)


@dataclass(frozen=True)
class _Data:
    speed: FloatArray
    load: FloatArray
    side: FloatArray
    torque: FloatArray
    weight: FloatArray
    shared: FloatArray


def _plain(data: _Data) -> FloatArray:
    return np.column_stack([np.ones_like(data.speed), data.speed, data.load])


def _folds(speed: FloatArray, load: FloatArray, side: FloatArray) -> IntArray:
    """Fold of each run; neighbours in load and speed fall into different folds."""
    count = min(FOLDS, len(speed))
    order = np.lexsort((speed, np.round(load, 1), side))
    folds = np.empty(len(speed), dtype=np.int64)
    folds[order] = (np.arange(len(speed)) + np.arange(len(speed)) // count) % count
    return folds


def _errors(data: _Data, folds: IntArray, table: FloatArray) -> FloatArray:
    """Weighted prediction error of each run by the law that has not seen it."""
    out = np.empty(len(folds))
    for fold in range(int(folds.max()) + 1):
        seen, unseen = folds != fold, folds == fold
        out[unseen] = _predicted(data, table, seen, unseen)[0]
    return out


def _predicted(
    data: _Data, table: FloatArray, seen: BoolArray, unseen: BoolArray
) -> tuple[FloatArray, float]:
    """Weighted errors at the unseen runs of a law fitted to the seen ones, and what is left at those.

    The shared errors are estimated along, within their bounds: a law must not be credited with what an
    instrument may have done.
    """
    rows = table * data.weight[:, None]
    torque = data.torque * data.weight
    scale = np.maximum(np.linalg.norm(rows[seen], axis=0), 1e-300)
    a = with_shared(rows[seen] / scale, data.shared[seen])
    b = np.concatenate([torque[seen], np.zeros(data.shared.shape[1])])
    result = np.linalg.lstsq(a, b, rcond=None)[0]
    errors = torque[unseen] - np.column_stack([rows[unseen] / scale, data.shared[unseen]]) @ result
    return errors, float(np.sum((b - a @ result) ** 2))


def _stribeck_errors(data: _Data, folds: IntArray) -> FloatArray:
    speeds = np.geomspace(0.2 * data.speed.min(), data.speed.max(), STRIBECK_SPEEDS)
    tables = [np.column_stack([_plain(data), np.exp(-data.speed / ws)]) for ws in speeds]
    out = np.empty(len(folds))
    for fold in range(int(folds.max()) + 1):
        seen, unseen = folds != fold, folds == fold
        tried = [_predicted(data, table, seen, unseen) for table in tables]
        out[unseen] = min(tried, key=lambda one: one[1])[0]
    return out


def _score(name: str, formula: str, parameters: int, base: FloatArray, errors: FloatArray) -> LawScore:
    level = float(np.mean(base**2))
    saved = (base**2 - errors**2) / level if level > 0.0 else np.zeros(len(base))
    gain, std = float(np.mean(saved)), float(np.std(saved, ddof=1) / np.sqrt(len(saved)))
    return LawScore(
        name=name,
        formula=formula,
        parameters=parameters,
        error_Nm=float(np.sqrt(np.mean(errors**2))),
        gain=gain,
        gain_std=std,
        warranted=gain > max(2.0 * std, 0.05),
    )


def _impossible(name: str, formula: str, reason: str) -> LawScore:
    return LawScore(name=name, formula=formula, possible=False, reason=reason)
