"""Play of a coupling from a record of both its sides under a torque that reverses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_erosion

from actuator_lti.errors import InputError
from analyses.estimation.arrays import BoolArray, FloatArray
from analyses.estimation.least_squares import solve, told_apart

CONTACT = 0.25
"""Rows whose torque is above this share of its largest (95 % point) are taken as in contact."""
LEAST_ROWS = 50
BEYOND = 0.9
ROUNDS = 8


@dataclass(frozen=True, kw_only=True)
class Play:
    """Half of the play b (rad at the coupling), and what the same rows tell of the load's friction.

    ``half_std_rad`` holds the correlation of the rows in time, and the encoders' resolution, which repeats
    itself from cycle to cycle. ``viscous_Nms_rad`` and ``dry_Nm`` are the load's at the coupling's shaft,
    None where the rows do not tell them. ``rows`` were in contact.
    """

    half_rad: float
    half_std_rad: float
    middle_rad: float
    viscous_Nms_rad: float | None
    dry_Nm: float | None
    rows: int

    @property
    def told(self) -> bool:
        """Whether the play is beyond twice its own error."""
        return self.half_rad > 2.0 * self.half_std_rad


def find_play(
    twist_rad: FloatArray,
    inertial_Nm: FloatArray,
    load_speed_rad_s: FloatArray,
    *,
    stiffness_Nm_rad: float,
    viscous_Nms_rad: float = 0.0,
    guard_samples: int = 0,
    resolution_rad: float = 0.0,
    smooth_samples: float = 1.0,
) -> Play:
    """Fit ``twist = middle + b sgn(T) + T/k`` to the rows in contact, with ``T = inertial + friction``.

    The friction of the load, ``Cv_l W + C0_l sgn(W)``, is found along with the play where the rows tell it;
    which rows are in contact follows from the torque so found, in rounds.

    Parameters
    ----------
    twist_rad : array, shape (n,)
        Motor angle over the reduction, less the load's angle.
    inertial_Nm : array, shape (n,)
        What the load's inertia (less its outer load and the coupling's damping) needs.
    stiffness_Nm_rad : float
        From a frequency response on one flank.
    viscous_Nms_rad : float
        First value of the load's viscous friction.
    guard_samples : int
        Rows left out on both sides of a loss of contact: what a filter smears over it.
    smooth_samples : float
        Rows worth one independent one after filtering.
    """
    k = stiffness_Nm_rad
    friction = np.column_stack([load_speed_rad_s, np.sign(load_speed_rad_s)])
    names = ("middle", "play", "viscous", "dry")
    own = {"viscous": viscous_Nms_rad, "dry": 0.0}
    middle, half = _first_gap(twist_rad, inertial_Nm, k)
    for _ in range(ROUNDS):
        torque = inertial_Nm + friction @ np.array([own["viscous"], own["dry"]])
        touching = _in_contact(torque, twist_rad - middle, half, guard_samples)
        w = np.column_stack([np.ones_like(torque), np.sign(torque), friction / k])[touching]
        kept, _ = told_apart(w, names)
        result = solve(w[:, kept], (twist_rad - inertial_Nm / k)[touching])
        values = dict(zip((names[j] for j in kept), result.values.tolist(), strict=True))
        middle, half = values["middle"], values["play"]
        new = {name: max(values.get(name, own[name]), 0.0) for name in own}
        if all(abs(new[name] - own[name]) <= 1e-9 * abs(new[name]) for name in own):
            break
        own = new
    std = np.sqrt(result.correlated[kept.index(1), kept.index(1)])
    return Play(
        half_rad=half,
        half_std_rad=float(np.hypot(std, _coarse(resolution_rad, touching, smooth_samples))),
        middle_rad=middle,
        viscous_Nms_rad=values.get("viscous"),
        dry_Nm=values.get("dry"),
        rows=int(np.count_nonzero(touching)),
    )


def _coarse(resolution_rad: float, touching: BoolArray, smooth_samples: float) -> float:
    """Error from a resolution: uniform, averaged over the independent rows of one cycle (two contacts)."""
    visits = max(int(np.count_nonzero(np.diff(touching.astype(np.int8)) == 1)), 2)
    independent = np.count_nonzero(touching) / (0.5 * visits) / max(smooth_samples, 1.0)
    return float(resolution_rad / np.sqrt(12.0 * max(independent, 1.0)))


def _first_gap(twist: FloatArray, torque: FloatArray, stiffness: float) -> tuple[float, float]:
    """Middle and half width of the gap, from the ends of the twist less the elastic part there."""
    low, high = np.quantile(twist, [0.02, 0.98])
    elastic = float(np.quantile(np.abs(torque), 0.9)) / stiffness
    return float(0.5 * (low + high)), max(0.5 * float(high - low) - elastic, 0.0)


def _in_contact(torque_Nm: FloatArray, twist: FloatArray, half: float, guard_samples: int) -> BoolArray:
    """Rows beyond the gap on the side that the torque, well away from zero, pushes to."""
    side = np.sign(torque_Nm)
    pushed = np.abs(torque_Nm) > CONTACT * float(np.quantile(np.abs(torque_Nm), 0.95))
    touching = pushed & (side * twist > BEYOND * half)
    if guard_samples:
        touching = np.asarray(binary_erosion(touching, iterations=guard_samples))
    least = min(np.count_nonzero(side[touching] > 0.0), np.count_nonzero(side[touching] < 0.0))
    if least < LEAST_ROWS:
        raise InputError(
            f"{least} rows on the rarer flank, {LEAST_ROWS} wanted: the torque through the coupling must "
            "reverse and stay"
        )
    return np.asarray(touching)
