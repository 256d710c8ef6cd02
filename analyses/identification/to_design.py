"""Identified values into a design, with their tolerances and correlations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from actuator_lti.design import with_values
from actuator_lti.design.fields import field_of
from actuator_lti.design.model import Correlation, Design, FrictionPoint, Gravity, Tolerance
from actuator_lti.design.parameters import FrozenMap
from actuator_lti.errors import InputError
from analyses.identification.joint_model import KEYS, JointModel
from analyses.identification.output_error import OutputErrorResult
from analyses.identification.surface_fit import PATHS, SurfaceFit

FloatArray = NDArray[np.float64]

LEAST_CORRELATION = 0.005
TRUNCATION_STD = 6.5
"""Standard deviations that a normal distribution is sampled to."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Values for dotted keys of a design, with their covariance and where they came from."""

    paths: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    source: str
    grade: str = "D"


def surface_estimate(fit: SurfaceFit, source: str) -> Estimate:
    """Those of C0, Cv and CM that were fitted, for ``[friction]``."""
    told = list(fit.told)
    return Estimate(
        paths=tuple(PATHS[k] for k in told),
        values=fit.values[told],
        covariance=fit.covariance[np.ix_(told, told)],
        source=source,
    )


PLAIN_KEYS = (
    "friction.viscous",
    "friction.dry_torque",
    "friction.viscous_reverse",
    "friction.dry_torque_reverse",
)
INERTIAS = ("motor.rotor_inertia", "load.inertia")


def joint_estimate(
    design: Design, model: JointModel, source: str, *, inertia_to: str = "motor.rotor_inertia"
) -> Estimate:
    """The values of an inverse model for the keys of a design.

    The model's inertia is all of it, at the motor. ``inertia_to`` gets what the design's other inertias
    leave of it: ``motor.rotor_inertia``, or ``load.inertia`` (at the output shaft).

    Raises
    ------
    InputError
        If the design's other inertias alone exceed the identified one.
    """
    result = dict(zip(model.names, model.values.tolist(), strict=True))
    paths: list[str] = []
    values: list[float] = []
    slopes = np.zeros((0, len(model.names)))

    def add(path: str, value: float, **slope: float) -> None:
        nonlocal slopes
        paths.append(path)
        values.append(value)
        row = [slope.get(name, 0.0) for name in model.names]
        slopes = np.vstack([slopes, row])

    for name, value in result.items():
        if name == "inertia":
            given, scale = inertia_share(design, value, inertia_to)
            add(inertia_to, given, inertia=scale)
        elif name in KEYS:
            add(KEYS[name], value, **{name: 1.0})
        elif name.startswith("map_"):
            add(f"friction.point.{int(name[4:]) + 1}.torque", value, **{name: 1.0})
    if {"gravity_sin", "gravity_cos"} <= set(result):
        _add_gravity(design, result["gravity_sin"], result["gravity_cos"], add)
    covariance = slopes @ model.covariance @ slopes.T
    return Estimate(paths=tuple(paths), values=np.array(values), covariance=covariance, source=source)


def _add_gravity(design: Design, a: float, b: float, add: Callable[..., None]) -> None:
    """Mass and offset of the pendulum of ``a sin(phi) + b cos(phi)``; the arm is the design's, or 1 m."""
    peak = float(np.hypot(a, b))
    arm = 1.0 if design.load.gravity is None else design.load.gravity.arm_m
    per_mass = Gravity(mass_kg=1.0, arm_m=arm).peak_Nm
    add(
        "load.gravity.mass",
        peak / per_mass,
        gravity_sin=a / peak / per_mass,
        gravity_cos=b / peak / per_mass,
    )
    add("load.gravity.offset", float(np.arctan2(b, a)), gravity_sin=-b / peak**2, gravity_cos=a / peak**2)


def with_structure(design: Design, model: JointModel) -> Design:
    """The design with the parts that a model's values need: a friction map, a pendulum."""
    friction, load = design.friction, design.load
    gone = [path for path in design.parameters if path.startswith("friction.point.")]
    if model.knots_rad_s is not None:
        points = tuple(
            FrictionPoint(speed_rad_s=_short(speed), torque_Nm=max(model[f"map_{k}"], 0.0))
            for k, speed in enumerate(model.knots_rad_s)
        )
        friction = replace(friction, points=points, dry_torque_Nm=0.0, viscous_Nms_rad=0.0)
        friction = replace(friction, dry_torque_reverse_Nm=None, viscous_reverse_Nms_rad=None)
        gone += [path for path in design.parameters if path in PLAIN_KEYS]
    elif friction.points and "dry" in model.names:
        friction = replace(friction, points=())
    if "gravity_sin" in model.names and load.gravity is None:
        load = replace(load, gravity=Gravity(mass_kg=1.0, arm_m=1.0))
    if friction is design.friction and load is design.load:
        return design
    kept = {path: one for path, one in design.parameters.items() if path not in gone}
    pairs = tuple(c for c in design.correlations if not {c.first, c.second} & set(gone))
    return replace(design, friction=friction, load=load, parameters=FrozenMap(kept), correlations=pairs)


def inertia_share(design: Design, total_kgm2: float, key: str) -> tuple[float, float]:
    """The value of an inertia key that makes a total at the motor, and its slope over that total."""
    if key not in INERTIAS:
        raise InputError(f'"{key}": the inertia can be written to {" or ".join(INERTIAS)}')
    scale = 1.0 if key == INERTIAS[0] else design.total_ratio**2
    own = design.motor.rotor_inertia_kgm2 if key == INERTIAS[0] else design.load.inertia_kgm2
    rest = design.inertia_kgm2 - own / scale
    left = (total_kgm2 - rest) * scale
    if not left > 0.0:
        other = INERTIAS[1 - INERTIAS.index(key)]
        raise InputError(
            f"identified inertia {total_kgm2:.4g} at the motor in all, but the design's inertias "
            f"beside {key} alone make {rest:.4g}: correct them, or write it to {other}",
            where=design.origin or design.name,
        )
    return left, scale


def refined_estimate(refined: OutputErrorResult, source: str) -> Estimate:
    """The values of a refinement by simulation, with their covariance."""
    paths = tuple(refined.values)
    values = np.array([refined.values[path] for path in paths])
    return Estimate(paths=paths, values=values, covariance=refined.covariance, source=source)


def with_fixed(design: Design, asked: Mapping[str, float]) -> Design:
    """The design with the values that were asked to be held, by key."""
    return with_values(design, dict(asked)) if asked else design


def design_with_estimate(design: Design, estimate: Estimate) -> Design:
    """A design with identified values, normal tolerances of their standard errors, and correlations.

    Margins and Monte Carlo then inherit them. Correlations below 0.005 are left out; old ones between the
    same keys are replaced.

    Parameters
    ----------
    design : Design
        Everything else comes from it.
    estimate : Estimate
        In SI, as `surface_estimate`, `joint_estimate` and `refined_estimate` give it.

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
    design = _one_law(design, estimate.paths)
    try:
        changed = with_values(design, values)
    except InputError as error:
        if not error.message.startswith(estimate.paths):
            raise
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
            tolerance=_tolerance(path, parameters[path].value, _short(float(std))),
        )
    kept = [c for c in design.correlations if not {c.first, c.second} <= set(estimate.paths)]
    return replace(
        changed,
        parameters=FrozenMap(parameters),
        correlations=(*kept, *_correlations(estimate.paths, estimate.covariance)),
    )


def _one_law(design: Design, paths: Sequence[str]) -> Design:
    """The design without friction values backward that a law for both directions takes the place of."""
    reverse = ("friction.viscous_reverse", "friction.dry_torque_reverse")
    if "friction.viscous" not in paths or set(reverse) & set(paths):
        return design
    friction = replace(design.friction, dry_torque_reverse_Nm=None, viscous_reverse_Nms_rad=None)
    parameters = {path: one for path, one in design.parameters.items() if path not in reverse}
    kept = tuple(c for c in design.correlations if not {c.first, c.second} & set(reverse))
    return replace(design, friction=friction, parameters=FrozenMap(parameters), correlations=kept)


def _tolerance(path: str, value: float, std: float) -> Tolerance | None:
    """A normal tolerance, cut off where it would reach values that the key does not allow."""
    if not std > 0.0:
        return None
    allowed = field_of(path)
    if allowed is None or allowed.accepts(value - TRUNCATION_STD * std):
        return Tolerance(kind="normal", std=std)
    lower = max(allowed.low, 1e-6 * value) if value > 0.0 else allowed.low
    upper = min(value + TRUNCATION_STD * std, allowed.high)
    return Tolerance(kind="truncated-normal", std=std, lower=lower, upper=upper)


def _correlations(paths: Sequence[str], covariance: FloatArray) -> list[Correlation]:
    std = np.sqrt(np.diag(covariance))
    matrix = np.eye(len(paths))
    for i in range(len(paths)):
        for j in range(i):
            size = std[i] * std[j]
            c = float(np.clip(covariance[i, j] / size, -1.0, 1.0)) if size > 0.0 else 0.0
            matrix[i, j] = matrix[j, i] = round(c, 6) if abs(c) >= LEAST_CORRELATION else 0.0
    lowest = float(np.linalg.eigvalsh(matrix)[0])
    if lowest < 0.0:  # rounding and leaving out may have made it indefinite by as much
        keep = 1.0 / (1.0 - 1.01 * lowest + 1e-9)
        matrix = np.where(np.eye(len(paths)) > 0.0, 1.0, keep * matrix)
    return [
        Correlation(first=paths[i], second=paths[j], coefficient=float(matrix[i, j]))
        for i in range(len(paths))
        for j in range(i + 1, len(paths))
        if matrix[i, j] != 0.0
    ]


def _short(value: float) -> float:
    """Seven significant digits, which is more than any bench gives."""
    return float(f"{value:.7g}")
