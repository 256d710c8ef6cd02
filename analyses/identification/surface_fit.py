"""The friction surface that was found: coefficients, how sure they are, and the runs behind them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from actuator_lti.errors import InputError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.fit import Fit
from analyses.estimation.parameters import parameter
from analyses.identification.steady import SteadyPoint

NAMES = ("C0", "Cv", "CM")
PATHS = tuple(parameter(name).key for name in NAMES)


@dataclass(frozen=True, kw_only=True)
class Outlier:
    """A run whose residual is too large: in units of its standard deviation, with the limit."""

    run: str
    standardised: float
    limit: float
    set_aside: bool


@dataclass(frozen=True, kw_only=True)
class SurfaceFit(Fit):
    """The coefficients C0 (N m), Cv (N m s/rad), CM, and how sure they are.

    ``covariance`` holds everything: ``random_covariance`` from the runs' scatter and the instruments' shared
    errors, whose bounds move the coefficients by ``shared_shifts[name]`` and the torques of the runs by the
    columns of ``shared_effects``. ``half_widths`` are those of the 95 % intervals, from propagated
    distributions. ``residuals_Nm`` (``own_residuals_Nm``: less the most likely shared errors) and
    ``residual_stds_Nm`` are those of the runs used, in the order of ``points``. ``run_scatter_Nm`` is the
    scatter between runs that their own noise does not explain, ``birge_ratio`` the ratio of the two (1:
    explained). ``fixed`` holds the coefficients that were not fitted, with the reason; their errors are zero.
    """

    points: tuple[SteadyPoint, ...]
    random_covariance: FloatArray
    shared_shifts: dict[str, FloatArray]
    half_widths: FloatArray
    shared_effects: FloatArray = field(repr=False)
    residuals_Nm: FloatArray
    own_residuals_Nm: FloatArray
    residual_stds_Nm: FloatArray
    run_scatter_Nm: float
    birge_ratio: float
    outliers: tuple[Outlier, ...]
    freedom: int

    @property
    def told(self) -> tuple[int, ...]:
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

    def predict_Nm(self, speed_rad_s: FloatArray, load_Nm: FloatArray) -> FloatArray:
        """Friction torque at speeds and loads."""
        return np.asarray(self["C0"] + self["Cv"] * speed_rad_s + self["CM"] * np.abs(load_Nm))


PAPER_LOAD_NM = 8.0
PAPER_SPEED_RAD_S = 942.5


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """One term: its torque in N m, its share of the whole, and the standard error of the share."""

    name: str
    torque_Nm: float
    share: float
    share_std: float


def contributions(
    values: FloatArray,
    covariance: FloatArray | None = None,
    *,
    load_Nm: float = PAPER_LOAD_NM,
    speed_rad_s: float = PAPER_SPEED_RAD_S,
) -> tuple[Contribution, ...]:
    """Shares of C0, Cv w and CM |M_ext| in the friction torque, with first-order standard errors.

    By default at the paper's largest load and speed; ``values`` are C0 (N m), Cv (N m s/rad), CM.

    Examples
    --------
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
    return tuple(
        Contribution(name=name, torque_Nm=float(t), share=float(s), share_std=float(np.sqrt(v)))
        for name, t, s, v in zip(("C0", "Cv", "CM"), terms, share, np.diag(spread), strict=True)
    )
