"""What each coefficient contributes to the friction torque at one load and speed (Table 1 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import InputError
from analyses.estimation.arrays import FloatArray

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
    """Shares of C0, Cv w and CM |M_ext| in the friction torque.

    Parameters
    ----------
    values : array, shape (3,)
        C0 (N m), Cv (N m s/rad), CM.
    covariance : array, shape (3, 3), optional
        For the standard errors of the shares (first order).
    load_Nm, speed_rad_s : float
        Where; the paper's largest load and speed by default.

    Examples
    --------
    >>> import numpy as np
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
