"""The friction surface that was found: coefficients, how sure they are, and the runs behind them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analyses.identification.points import SteadyPoint
from analyses.identification.systematic import ErrorDraws

FloatArray = NDArray[np.float64]

NAMES = ("C0", "Cv", "CM")
UNITS = ("N*m", "N*m*s/rad", "N*m/(N*m)")
PATHS = ("friction.dry_torque", "friction.viscous", "friction.load_coefficient")


@dataclass(frozen=True, kw_only=True)
class Outlier:
    """A run whose residual is too large: in units of its standard deviation, with the limit."""

    run: str
    standardised: float
    limit: float
    set_aside: bool


@dataclass(frozen=True, kw_only=True)
class SurfaceFit:
    """The coefficients C0 (N m), Cv (N m s/rad), CM, and how sure they are.

    ``covariance`` holds everything: ``random_covariance`` from the runs' scatter and the instruments' shared
    errors, whose bounds move the coefficients by ``shared_shifts[name]`` and the torques of the runs by the
    columns of ``shared_effects``. ``half_widths`` are those of the 95 % intervals, from propagated
    distributions. ``residuals_Nm`` (``own_residuals_Nm``: less the most likely shared errors) and
    ``residual_stds_Nm`` are those of the runs used, in the order of ``points``. ``run_scatter_Nm`` is the
    scatter between runs that their own noise does not explain, ``birge_ratio`` the ratio of the two (1:
    explained). ``held`` names the coefficients that were not fitted, with the reason; their errors are zero.
    """

    points: tuple[SteadyPoint, ...]
    values: FloatArray
    covariance: FloatArray
    random_covariance: FloatArray
    shared_shifts: dict[str, FloatArray]
    half_widths: FloatArray
    draws: ErrorDraws
    shared_effects: FloatArray
    residuals_Nm: FloatArray
    own_residuals_Nm: FloatArray
    residual_stds_Nm: FloatArray
    run_scatter_Nm: float
    birge_ratio: float
    outliers: tuple[Outlier, ...]
    freedom: int
    held: Mapping[str, str] = field(default_factory=dict)

    @property
    def told(self) -> tuple[int, ...]:
        """Positions of the coefficients that were fitted."""
        return tuple(k for k, name in enumerate(NAMES) if name not in self.held)

    @property
    def relative_residual(self) -> float:
        """Norm of the residuals over norm of the torques."""
        torque = np.array([p.torque_Nm for p in self.points])
        return float(np.linalg.norm(self.residuals_Nm) / np.linalg.norm(torque))

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors with the shared errors in them."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def intervals(self) -> FloatArray:
        """95 % intervals, shape (3, 2)."""
        return np.column_stack([self.values - self.half_widths, self.values + self.half_widths])

    @property
    def correlation(self) -> FloatArray:
        """Correlation matrix of the coefficients."""
        std = np.where(self.standard_errors > 0.0, self.standard_errors, 1.0)
        return np.asarray(self.covariance / np.outer(std, std))

    def predict_Nm(self, speed_rad_s: FloatArray, load_Nm: FloatArray) -> FloatArray:
        """Friction torque at speeds and loads."""
        return np.asarray(self.values[0] + self.values[1] * speed_rad_s + self.values[2] * np.abs(load_Nm))
