"""The friction surface M = C0 + Cv w + CM |M_ext| through the points of a campaign (paper, equation 9)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.systems.root import root
from actuator_lti.types import Floats
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.least_squares import identifiable
from analyses.estimation.parameters import parameter
from analyses.identification.points import SteadyPoint, half_widths, shared_errors, standardised
from analyses.records.campaign_file import Instruments

NAMES = ("C0", "Cv", "CM")
PATHS = tuple(parameter(name).key for name in NAMES)
ITERATIONS = 6


@dataclass(frozen=True, kw_only=True)
class Outlier:
    """A run whose residual is too large: in units of its standard deviation, with the limit."""

    run: str
    standardised: float
    limit: float
    set_aside: bool


@dataclass(frozen=True, kw_only=True)
class SurfaceFit(Fit):
    """The coefficients C0 (N m), Cv (N m s/rad), CM, and how sure they are; one that is fixed has no error.

    Their covariance is the random one and that of the instruments' shared errors.
    """

    points: tuple[SteadyPoint, ...]  # the runs used, in the order of the residuals
    random_covariance: Floats  # from the runs' scatter
    shared_shifts: dict[str, Floats]  # by which the bounds of the shared errors move the coefficients
    half_widths: Floats  # of the 95 % intervals, from propagated distributions
    shared_effects: Floats = field(repr=False)  # on the torques of the runs, a column each shared error
    residuals_Nm: Floats
    own_residuals_Nm: Floats  # less the most likely shared errors
    residual_stds_Nm: Floats
    run_scatter_Nm: float  # between runs, that their own noise does not explain
    birge_ratio: float  # of the scatter between runs to their own noise; 1: explained
    outliers: tuple[Outlier, ...]
    freedom: int

    @property
    def determined(self) -> tuple[int, ...]:
        """Positions of the coefficients that were fitted."""
        return tuple(k for k, name in enumerate(NAMES) if name not in self.fixed)

    @property
    def relative_residual(self) -> float:
        """Norm of the residuals over norm of the torques."""
        torque = np.array([p.torque_Nm for p in self.points])
        return float(np.linalg.norm(self.residuals_Nm) / np.linalg.norm(torque))

    def interval(self, name: str) -> tuple[float, float]:
        """95 % interval of one coefficient."""
        half = float(self.half_widths[NAMES.index(name)])
        return self[name] - half, self[name] + half

    def by_key(self) -> Fit:
        """Those of the coefficients that were fitted, by the keys of a design."""
        return self.renamed({name: parameter(name).key for name in NAMES if name not in self.fixed})

    def predict_Nm(self, speed_rad_s: Floats, load_Nm: Floats) -> Floats:
        """Friction torque at speeds and loads."""
        return np.asarray(self["C0"] + self["Cv"] * speed_rad_s + self["CM"] * np.abs(load_Nm))


def fit_surface(
    points: Sequence[SteadyPoint],
    instruments: Instruments,
    torque_constant_Nm_A: float,
    *,
    outliers: str = "keep",
    fixed: Mapping[str, float] | None = None,
    kept: Mapping[str, float] | None = None,
) -> SurfaceFit:
    """Fit the surface by generalised least squares with errors in all variables.

    The weight of a run comes from the covariance of its means of torque, speed and load, moved to the
    torque by the slopes of the surface (effective variance, iterated), plus the scatter between runs where
    they do not agree within their noise (Mandel and Paule). The shared errors of the instruments enter the
    covariance as they act: on all runs together. ``torque_constant_Nm_A`` made the torques; ``fixed``
    coefficients are held, ``kept`` are values that those keep which the runs do not tell apart.
    """
    runs = _Runs(points, fixed or {}, kept or {})
    theta = runs.ordinary()
    _, effects = shared_errors(runs.points, instruments, theta[2], torque_constant_Nm_A)
    size, limit = standardised(runs.free, runs.rest, runs.own_variance(theta), effects)
    aside, far = outliers == "set-aside", np.abs(size) > limit
    named = tuple(
        Outlier(run=points[k].run, standardised=float(size[k]), limit=limit, set_aside=aside)
        for k in np.flatnonzero(far).tolist()
    )
    if aside and named:
        runs = _Runs([points[k] for k in np.flatnonzero(~far).tolist()], fixed or {}, kept or {})
    return _fitted(runs, instruments, torque_constant_Nm_A, named)


class _Runs:
    """The points as a linear problem: the columns that are fitted, and the torques less what is held."""

    def __init__(
        self, points: Sequence[SteadyPoint], fixed: Mapping[str, float], kept: Mapping[str, float]
    ) -> None:
        self.points = tuple(points)
        self.x = np.array([[1.0, p.speed_rad_s, p.load_Nm] for p in points]).reshape(-1, len(NAMES))
        self.y = np.array([p.torque_Nm for p in points])
        self.held = self._held(fixed, kept)
        self.determined = [k for k, name in enumerate(NAMES) if name not in self.held]
        self._start = np.array([self.held[name].value if name in self.held else 0.0 for name in NAMES])
        self.free, self.rest = self.x[:, self.determined], np.asarray(self.y - self.x @ self._start)

    def _held(self, fixed: Mapping[str, float], kept: Mapping[str, float]) -> dict[str, Fixed]:
        """What was asked for, and what the runs do not tell apart; two runs more than coefficients."""
        held = {name: Fixed(value=value, reason="fixed as asked") for name, value in fixed.items()}
        names = [name for name in NAMES if name not in held]
        if not names:
            raise InputError("C0, Cv and CM are all fixed: nothing is left to identify")
        columns = [NAMES.index(name) for name in names]
        left = identifiable(self.x[:, columns], names)[1] if self.points else ()
        for one in left:
            why = "no run is loaded" if one.name == "CM" and not one.moves else str(one)
            held[one.name] = Fixed(value=kept.get(one.name, 0.0), reason=f"{why}: the design's value kept")
        coefficients = len(NAMES) - len(held)
        if not coefficients:
            raise InputError("what is not fixed is not told by the runs: nothing is left to identify")
        if len(self.points) < coefficients + 2:
            words = ("one coefficient", "two coefficients", "three coefficients")[coefficients - 1]
            said = f"{len(self.points)} usable runs: at least {coefficients + 2} are needed for {words}"
            raise InputError(said)
        if any(one.name not in kept for one in left):
            said = "the runs do not tell C0, Cv and CM apart: vary speed and load, not together only"
            raise NumericalError(said)
        return held

    def ordinary(self) -> Floats:
        """All coefficients, by ordinary least squares."""
        theta = self._start.copy()
        theta[self.determined] = np.linalg.lstsq(self.free, self.rest, rcond=None)[0]
        return theta

    def own_variance(self, theta: Floats) -> Floats:
        """Variance of each residual from the run's own noise: that of its means along (1, -Cv, -CM)."""
        along = np.array([1.0, -theta[1], -theta[2]])
        own = np.array([along @ p.covariance @ along for p in self.points])
        return np.maximum(own, 1e-8 * float(np.median(own)) + 1e-30)

    def gain(self, variance: Floats, effects: Floats) -> tuple[Floats, Floats]:
        """What makes coefficients of torques, (X' V^-1 X)^-1 X' V^-1, and V: each run's own, and the shared.

        An error that is shared has a third of its bound squared.
        """
        covariance = np.diag(variance) + effects @ effects.T / 3.0
        whitened = np.linalg.solve(covariance, self.free)
        return np.asarray(np.linalg.solve(self.free.T @ whitened, whitened.T)), covariance

    def scatter(self, own: Floats, effects: Floats) -> tuple[float, float]:
        """Variance between runs that makes chi-square equal its freedom, and the Birge ratio without it."""
        x, y, freedom = self.free, self.rest, len(self.y) - len(self.determined)

        def excess(extra: float) -> float:
            gain, covariance = self.gain(own + extra, effects)
            rest = y - x @ (gain @ y)
            return float(rest @ np.linalg.solve(covariance, rest)) - freedom

        first = excess(0.0)
        birge = float(np.sqrt(first / freedom + 1.0))
        if first <= 0.0:
            return 0.0, birge
        most = 10.0 * float(np.var(y - x @ np.linalg.lstsq(x, y, rcond=None)[0])) + float(np.max(own))
        return root(excess, 0.0, most, 1e-9 * most), birge


def _fitted(
    runs: _Runs, instruments: Instruments, torque_constant: float, named: tuple[Outlier, ...]
) -> SurfaceFit:
    count, theta = len(runs.y), runs.ordinary()
    for _ in range(ITERATIONS):
        own = runs.own_variance(theta)
        shared, effects = shared_errors(runs.points, instruments, theta[2], torque_constant)
        scatter, birge = runs.scatter(own, effects)
        gain, change = np.zeros((len(NAMES), count)), np.zeros(len(NAMES))
        gain[runs.determined], _ = runs.gain(own + scatter, effects)
        change[runs.determined] = gain[runs.determined] @ runs.rest - theta[runs.determined]
        theta = theta + change
        if np.all(np.abs(change) <= 1e-12 * np.abs(theta)):
            break
    variance, residual = own + scatter, np.asarray(runs.y - runs.x @ theta)
    random_covariance, moved = (gain * variance) @ gain.T, (gain @ effects).T
    scaled = effects / variance[:, None]  # the most likely shared errors bend the residuals together
    likely = np.linalg.solve(3.0 * np.eye(effects.shape[1]) + effects.T @ scaled, scaled.T @ residual)
    freedom = count - len(runs.determined)
    return SurfaceFit(
        points=runs.points,
        names=NAMES,
        values=theta,
        covariance=random_covariance + moved.T @ moved / 3.0,
        random_covariance=random_covariance,
        shared_shifts=dict(zip(shared, moved, strict=True)),
        half_widths=half_widths(random_covariance, moved, freedom),
        shared_effects=effects,
        residuals_Nm=residual,
        own_residuals_Nm=np.asarray(residual - effects @ likely),
        residual_stds_Nm=np.sqrt(variance),
        run_scatter_Nm=float(np.sqrt(scatter)),
        birge_ratio=birge,
        outliers=named,
        freedom=freedom,
        fixed=runs.held,
    )


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """One term: its torque in N m, its share of the whole, and the standard error of the share."""

    name: str
    torque_Nm: float
    share: float
    share_std: float


def contributions(
    values: Floats, covariance: Floats | None = None, *, load_Nm: float = 8.0, speed_rad_s: float = 942.5
) -> tuple[Contribution, ...]:
    """Shares of C0, Cv w and CM |M_ext| in the friction torque, with first-order standard errors.

    By default at the paper's largest load and speed; ``values`` are C0 (N m), Cv (N m s/rad), CM.

    >>> table = contributions(np.array([2.25e-3, 5.25e-6, 1.34e-3]))
    >>> [round(100.0 * term.share, 1) for term in table]
    [12.6, 27.6, 59.8]
    """
    point = np.array([1.0, abs(speed_rad_s), abs(load_Nm)])
    terms = np.asarray(values) * point
    total = float(terms.sum())
    if not total > 0.0:
        raise InputError(f"the friction torque at {load_Nm} N m and {speed_rad_s} rad/s is {total:.3g} N m")
    share = terms / total
    gradient = (np.eye(3) - share[:, None]) * point[None, :] / total
    spread = np.zeros((3, 3)) if covariance is None else gradient @ covariance @ gradient.T
    rows = zip(NAMES, terms.tolist(), share.tolist(), np.sqrt(np.diag(spread)).tolist(), strict=True)
    return tuple(Contribution(name=n, torque_Nm=t, share=s, share_std=std) for n, t, s, std in rows)
