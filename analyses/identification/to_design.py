"""Identified values into a design, with their tolerances and correlations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from actuator_lti.design import with_values
from actuator_lti.design.model import Correlation, Design, Tolerance
from actuator_lti.errors import InputError
from analyses.identification.dynamic import DynamicModel
from analyses.identification.surface import PATHS, SurfaceFit

FloatArray = NDArray[np.float64]

LEAST_CORRELATION = 0.005


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Values for dotted keys of a design, with their covariance and where they came from."""

    paths: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    source: str
    grade: str = "D"


def surface_estimate(fit: SurfaceFit, source: str) -> Estimate:
    """C0, Cv and CM for ``[friction]``."""
    return Estimate(paths=PATHS, values=fit.values, covariance=fit.covariance, source=source)


def dynamic_estimate(model: DynamicModel, source: str) -> Estimate:
    """Inertia (all of it at the motor), friction and offset for a design without gears.

    With a friction per direction the offset lies in the difference of the two, and the offset becomes zero.
    """
    paths: tuple[str, ...]
    if model.form == "symmetric":
        paths = ("motor.rotor_inertia", "friction.viscous", "friction.dry_torque", "friction.offset_torque")
    else:
        paths = (
            "motor.rotor_inertia",
            "friction.viscous",
            "friction.dry_torque",
            "friction.viscous_reverse",
            "friction.dry_torque_reverse",
        )
    return Estimate(paths=paths, values=model.values, covariance=model.covariance, source=source)


def design_with_estimate(design: Design, estimate: Estimate, *, name: str | None = None) -> Design:
    """A design with identified values, normal tolerances of their standard errors, and correlations.

    Margins and Monte Carlo then inherit them. Correlations below 0.005 are left out; old ones between the
    same keys are replaced.

    Parameters
    ----------
    design : Design
        Everything else comes from it.
    estimate : Estimate
        In SI, as `surface_estimate` and `dynamic_estimate` give it.
    name : str, optional
        Of the new design; the old one's otherwise.

    Returns
    -------
    Design
        ``write_design`` makes a file of it.

    Raises
    ------
    InputError
        For an estimate that no drive can have: the record does not tell that parameter.
    """
    values = {p: _short(float(v)) for p, v in zip(estimate.paths, estimate.values, strict=True)}
    if "friction.viscous_reverse" in estimate.paths and design.friction.offset_torque_Nm:
        values["friction.offset_torque"] = 0.0
    try:
        changed = with_values(design, values)
    except InputError as error:
        raise InputError(
            f"identified {error.message}; the record does not tell it: it takes a longer motion,"
            " at several speeds in both directions"
        ) from error
    parameters = dict(changed.parameters)
    for path, std in zip(estimate.paths, np.sqrt(np.diag(estimate.covariance)), strict=True):
        parameters[path] = replace(
            parameters[path],
            source=estimate.source,
            grade=estimate.grade,
            tolerance=Tolerance(kind="normal", std=_short(float(std))),
        )
    kept = [c for c in design.correlations if not {c.first, c.second} <= set(estimate.paths)]
    return replace(
        changed,
        name=design.name if name is None else name,
        parameters=MappingProxyType(parameters),
        correlations=(*kept, *_correlations(estimate.paths, estimate.covariance)),
    )


def _correlations(paths: Sequence[str], covariance: FloatArray) -> list[Correlation]:
    std = np.sqrt(np.diag(covariance))
    return [
        Correlation(first=paths[i], second=paths[j], coefficient=round(float(c), 6))
        for i in range(len(paths))
        for j in range(i + 1, len(paths))
        if abs(c := covariance[i, j] / (std[i] * std[j])) >= LEAST_CORRELATION
    ]


def _short(value: float) -> float:
    """Seven significant digits, which is more than any bench gives."""
    return float(f"{value:.7g}")
