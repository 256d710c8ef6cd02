"""Every number of the design against the fit, and the one cause that explains what is off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np
from scipy.stats import chi2

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.estimation.arrays import FloatArray
from analyses.estimation.fit import Fit
from analyses.estimation.parameters import own_share, parameter
from analyses.identification.electrical import fit_electrical
from analyses.identification.joint_model import JointModel, default_value
from analyses.records.factors import named_factor
from analyses.records.record import Record

NO_CHANCE = 1e-3
"""Level at which the design's numbers as a whole are rejected, and one of them is."""
EXPLAINED = 0.01
"""Level above which a cause explains what is off."""
LEAST_VALUES = 3
ALIKE = 0.02
"""Relative standard deviation within which a cause has to explain: rough numbers of a design that are off
alike by chance are no cause."""
FEW = 2.0
"""Least factor of a cause that only two values tell."""

CAUSES: Mapping[str, Mapping[str, float]] = {
    "the scale of the current": {
        "inertia": 1, "dry": 1, "viscous": 1, "load": 1, "gravity": 1, "resistance": -1
    },
    "the torque constant (and back-EMF constant)": {
        "inertia": 1, "dry": 1, "viscous": 1, "load": 1, "gravity": 1, "back": -1
    },
    "the scale of angle and speed: counts, pole pairs, or the reduction": {
        "inertia": 1, "viscous": 1, "back": 1
    },
    "the clock": {"inertia": 2, "viscous": 1, "back": 1},
}  # fmt: skip
"""What a factor in one of these does to the identified values: its powers."""


@dataclass(frozen=True, kw_only=True)
class DesignValue:
    """One number of the design beside what the records say; ``ratio`` is found over design's.

    ``error`` is the standard error of that ratio, ``allowed`` the relative standard deviation of the design's
    own number.
    """

    name: str
    design: float
    found: float
    ratio: float
    error: float
    allowed: float

    @property
    def agrees(self) -> bool:
        """Whether chance explains the difference, with the error of both."""
        size = log(self.ratio) / float(np.hypot(self.error / self.ratio, self.allowed))
        return bool(chi2.sf(size**2, 1) > NO_CHANCE)


def design_values(
    design: Design, model: JointModel, records: Sequence[Record], start: Design
) -> tuple[DesignValue, ...]:
    """Every number of a design that the records tell: friction, inertia, load friction, R, kE.

    ``start`` is the design with what was found of its motor first; its constants made torques of currents.
    """
    behind = friction_behind(design)
    found = [
        design_value(
            design, model, name, default_value(design, name), behind.get(name.partition("_")[0], 0.0)
        )
        for name in model.names
        if name != "offset" and not name.startswith(("map_", "gravity"))
    ]
    electrical = _electrical(start, records)
    motor = design.effective_motor
    if electrical is not None:
        found += [
            design_value(design, electrical, "resistance", motor.resistance_ohm or 0.0),
            design_value(design, electrical, "back_emf", motor.back_emf_constant_Vs_rad or 0.0),
        ]
    return tuple(one for one in found if one is not None)


def friction_behind(design: Design) -> dict[str, float]:
    """Friction behind the coupling, at the motor: it was taken off the torque that a wrong scale is in."""
    ratio, friction = design.ratio_to_coupling, design.load.friction
    if design.coupling is None or friction is None:
        return {}
    return {"viscous": friction.viscous_Nms_rad / ratio**2, "dry": friction.dry_torque_Nm / ratio}


def _electrical(design: Design, records: Sequence[Record]) -> Fit | None:
    """The voltage equation of the records that hold voltage, current and motion."""
    motor = design.effective_motor
    whole = [record for record in records if {"voltage", "current"} <= set(record.signals)]
    if not whole or motor.resistance_ohm is None or not motor.back_emf_constant_Vs_rad:
        return None
    try:
        return fit_electrical(design, whole)
    except InputError:
        return None  # R and kE are not told apart


def design_value(
    design: Design, fit: Fit, name: str, before: float, behind: float = 0.0
) -> DesignValue | None:
    """One number, with what stands ``behind`` the coupling beside both; None where either is not positive."""
    before, found = before + behind, fit[name] + behind
    if before <= 0.0 or found <= 0.0:
        return None
    return DesignValue(
        name=name,
        design=before,
        found=found,
        ratio=found / before,
        error=fit.std(name) / before,
        allowed=own_share(design, parameter(name).key, before),
    )


def cause(values: Sequence[DesignValue]) -> tuple[str, float, float] | None:
    """The one cause that explains what is off: in words, its factor, and its standard error.

    Each cause moves the logarithms of the values along a line; weighted least squares finds its factor, and
    chi-square says whether the rest is chance. None where chance explains all, or no one cause does.

    Examples
    --------
    >>> names = ("inertia", "dry", "viscous")
    >>> off = [
    ...     DesignValue(name=n, design=1.0, found=0.8, ratio=0.8, error=0.01, allowed=0.05) for n in names
    ... ]
    >>> words, factor, _ = cause(off)
    >>> words, round(factor, 2)
    ('the scale of the current or the torque constant (and back-EMF constant)', 0.8)
    """
    x = np.log([one.ratio for one in values])
    close = np.array([float(np.hypot(one.error / one.ratio, ALIKE)) for one in values])
    std = np.array([float(np.hypot(one.error / one.ratio, one.allowed)) for one in values])
    if len(values) < LEAST_VALUES or chi2.sf(float(np.sum((x / std) ** 2)), len(x)) > NO_CHANCE:
        return None
    fitting: list[tuple[float, str, float, float]] = []
    for words, powers in CAUSES.items():
        g = np.array([powers.get(one.name.partition("_")[0], 0.0) for one in values])
        told = [one for one, power in zip(values, g, strict=True) if power]
        if len(told) < 2 or not np.any(g):
            continue
        factor, rest = _along(x, g, close)
        if len(told) < LEAST_VALUES and abs(factor) < log(FEW):
            continue
        level = float(chi2.sf(rest, len(x) - 1))
        if level > EXPLAINED:
            fitting.append((level, words, factor, float(1.0 / np.linalg.norm(g / close))))
    if not fitting:
        return None
    level, _, factor, error = max(fitting)
    alike = " or ".join(words for other, words, *_ in fitting if other > level - 1e-9)
    return alike, exp(factor), error * exp(factor)


def _along(x: FloatArray, g: FloatArray, std: FloatArray) -> tuple[float, float]:
    """The logarithm of a factor that moves ``x`` by ``g`` times it, and the chi-square of what is left."""
    a, b = g / std, x / std
    factor = float(a @ b) / float(a @ a)
    return factor, float(np.sum((b - factor * a) ** 2))


def told(words: str, factor: float, error: float) -> str:
    """A cause in words."""
    named = named_factor(factor)
    known = f": factor {named}" if named else ""
    found = f"a factor {factor:.3g} (standard error {error:.1g})"
    return f"identified values are off as by {found} in {words}{known}"
