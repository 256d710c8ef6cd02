"""The friction surface that was found: coefficients, how sure they are, and the runs behind them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from analyses.estimation.arrays import FloatArray
from analyses.estimation.fit import Fit
from analyses.estimation.parameters import parameter
from analyses.identification.points import SteadyPoint

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
