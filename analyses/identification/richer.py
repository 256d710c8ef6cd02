"""Is a richer friction law warranted? Asked of runs that the law has not seen."""

from dataclasses import dataclass
from math import nan

import numpy as np

from actuator_lti.types import Floats, Mask
from analyses.identification.points import with_shared
from analyses.identification.surface import SurfaceFit

FOLDS = 9
STRIBECK_SPEEDS = 12


@dataclass(frozen=True)
class LawScore:
    """How well one law predicts runs that it was not fitted to."""

    name: str
    formula: str
    parameters: int = 0
    error_Nm: float = nan  # root of the mean weighted squared prediction error
    gain: float = nan  # relative reduction of the squared error against the plain law
    gain_std: float = nan  # its standard error, paired over the runs
    warranted: bool = False  # the gain exceeds twice that and 5 %
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
    points, weight = fit.points, 1.0 / fit.residual_stds_Nm
    w, m, s = np.array([(p.speed_rad_s, p.load_Nm, float(p.direction)) for p in points]).T
    torque = weight * np.array([p.torque_Nm for p in points])
    shared = fit.shared_effects * weight[:, None]
    count = min(FOLDS, len(points))
    fold = np.empty(len(points), dtype=np.int64)  # neighbours in load and speed fall into different ones
    fold[np.lexsort((w, np.round(m, 1), s))] = (np.arange(len(w)) + np.arange(len(w)) // count) % count
    plain = np.column_stack([np.ones_like(w), w, m])

    def errors(*terms: Floats) -> Floats:
        """Weighted prediction error of each run by the law that has not seen it, the best of its terms."""
        tables = [weight[:, None] * np.column_stack([plain, term]) for term in terms]
        out = np.empty(len(w))
        for k in range(count):
            tried = [_predicted(table, shared, torque, fold != k) for table in tables]
            out[fold == k] = min(tried, key=lambda one: one[1])[0]
        return out / float(np.sqrt(np.mean(weight**2)))

    stribeck = [np.exp(-w / speed) for speed in np.geomspace(0.2 * w.min(), w.max(), STRIBECK_SPEEDS)]
    laws = (
        ("quadratic", "+ C2 w^2", 4, [w**2]),
        ("load-dependent viscous", "+ CvM w |M|", 4, [w * m]),
        ("load squared", "+ CM2 M^2", 4, [m**2]),
        ("per direction", "+ s (CS0 + CS1 w)", 5, [np.column_stack([s, s * w])]),
        ("Stribeck", "+ CS exp(-w/ws)", 5, stribeck),
    )
    base = errors(np.empty((len(w), 0)))
    scores = [_score("plain", "C0 + Cv w + CM |M|", 3, base, base)]
    for name, formula, parameters, terms in laws:
        one_way = name == "per direction" and len(set(s)) < 2
        if one_way or (len(points) < 2 * parameters and name != "Stribeck"):
            reason = "one direction only" if one_way else "too few runs"
            scores.append(LawScore(name=name, formula=formula, possible=False, reason=reason))
        else:
            scores.append(_score(name, formula, parameters, base, errors(*terms)))
    good = [score for score in scores if score.warranted]
    best = min(good, key=lambda score: score.error_Nm).name if good else "plain"
    return RicherLaws(scores=tuple(scores), best=best, folds=int(fold.max()) + 1)


def _predicted(rows: Floats, shared: Floats, torque: Floats, seen: Mask) -> tuple[Floats, float]:
    """Weighted errors of a law (shared errors along) at unseen runs, and what is left at those it saw."""
    rows = rows / np.maximum(np.linalg.norm(rows[seen], axis=0), 1e-300)
    a = with_shared(rows[seen], shared[seen])
    b = np.concatenate([torque[seen], np.zeros(shared.shape[1])])
    result = np.linalg.lstsq(a, b, rcond=None)[0]
    errors = torque[~seen] - np.column_stack([rows[~seen], shared[~seen]]) @ result
    return errors, float(np.sum((b - a @ result) ** 2))


def _score(name: str, formula: str, parameters: int, base: Floats, errors: Floats) -> LawScore:
    level = float(np.mean(base**2))
    saved = (base**2 - errors**2) / level if level > 0.0 else np.zeros(len(base))
    gain, std = float(np.mean(saved)), float(np.std(saved, ddof=1) / np.sqrt(len(saved)))
    error, warranted = float(np.sqrt(np.mean(errors**2))), gain > max(2.0 * std, 0.05)
    return LawScore(name, formula, parameters, error, gain, std, warranted)
