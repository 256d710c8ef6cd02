"""Mass or inertia, friction and offset from a motion: columns of the inverse dynamic model, its recipe.

Source of the recipe and of the published figures: A. Janot, M. Gautier, M. Brunot, "Data Set and Reference
Models of EMPS", Workshop on Nonlinear System Identification Benchmarks, 2019.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from actuator_lti.errors import InputError
from analyses.records.differentiation import Motion

FloatArray = NDArray[np.float64]
FrictionForm = Literal["symmetric", "per-direction"]

NAMES: Mapping[FrictionForm, tuple[str, ...]] = {
    "symmetric": ("inertia", "viscous", "dry", "offset"),
    "per-direction": ("inertia", "viscous_forward", "dry_forward", "viscous_reverse", "dry_reverse"),
}


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """The choices of the identification; the defaults are the published ones for EMPS.

    ``skip_end_samples`` are left out at the end of a record that ends in motion: there the filter, which has
    no further samples, bends the position. The published recipe keeps them, and differentiates over three
    ``points``.
    """

    cutoff_hz: float = 100.0
    filter_order: int = 4
    skip_samples: int = 49
    decimation: int = 10
    skip_end_samples: int = 0
    points: int = 3

    def __post_init__(self) -> None:
        for name, low in (
            ("filter_order", 1),
            ("skip_samples", 0),
            ("skip_end_samples", 0),
            ("decimation", 1),
        ):
            if getattr(self, name) < low:
                raise InputError(f"{name} = {getattr(self, name)}: must be {low} or more")


def base_columns(motion: Motion, form: FrictionForm) -> FloatArray:
    """Columns of inertia and friction for a motion, in the order of ``NAMES[form]``."""
    velocity, direction = motion.velocity, np.sign(motion.velocity)
    if form == "symmetric":
        return np.column_stack([motion.acceleration, velocity, direction, np.ones_like(velocity)])
    ahead, back = velocity > 0.0, velocity < 0.0
    return np.column_stack(
        [motion.acceleration, velocity * ahead, direction * ahead, velocity * back, direction * back]
    )
