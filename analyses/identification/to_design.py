"""Identified values into a design, with their tolerances and correlations."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from math import pi, remainder

import numpy as np

from actuator_lti.design import parameter_value, with_values
from actuator_lti.design.asked import FrozenMap
from actuator_lti.design.fields import field_of
from actuator_lti.design.model import Correlation, Design, FrictionPoint, Gravity, Tolerance
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.fit import Fit
from analyses.estimation.parameters import default_value, parameter
from analyses.identification.joint_model import JointModel
from analyses.records.finding import SURE

LEAST_CORRELATION = 0.005
TRUNCATION_STD = 6.5  # standard deviations that a normal distribution is sampled to
REVERSE = ("friction.viscous_reverse", "friction.dry_torque_reverse")
PLAIN_KEYS = ("friction.viscous", "friction.dry_torque", *REVERSE)
GRAVITY = ("gravity_sin", "gravity_cos")  # m g l times cosine and sine of the offset less the design's
INERTIAS = ("motor.rotor_inertia", "load.inertia")


def joint_values(design: Design, model: Fit, *, inertia_to: str = INERTIAS[0]) -> Fit:
    """The values of an inverse model for the keys of a design.

    The model's inertia is all of it, at the motor. ``inertia_to`` gets what the design's other inertias
    leave of it: ``motor.rotor_inertia``, or ``load.inertia`` (at the output shaft).
    """
    slopes: dict[str, dict[str, float]] = {}
    values: dict[str, float] = {}
    for name in model.names:
        if name == "inertia":
            values[inertia_to], scale = inertia_share(design, model[name], inertia_to)
            slopes[inertia_to] = {name: scale}
        elif parameter(name).key:
            slopes[parameter(name).key] = {name: 1.0}
    for key, value, slope in _pendulum_values(design, model):
        values[key], slopes[key] = value, slope
    return model.mapped(slopes, values)


def _pendulum(design: Design, model: Fit) -> Gravity | None:
    """The design's pendulum, or 1 kg at 1 m where terms of one were found; None where there is neither."""
    if design.load.gravity is not None or not set(GRAVITY) & set(model.names):
        return design.load.gravity
    return Gravity(mass_kg=1.0, arm_m=1.0, offset_rad=0.0)


def _pendulum_values(design: Design, model: Fit) -> Iterator[tuple[str, float, dict[str, float]]]:
    """Mass and offset of a pendulum from its terms, each with its slopes; of the first alone the mass."""
    gravity = _pendulum(design, model)
    if gravity is None or not set(GRAVITY) & set(model.names):
        return
    a, b = (model.get(name, default_value(design, name)) for name in GRAVITY)
    peak, per_mass = float(np.hypot(a, b)), gravity.peak_Nm / gravity.mass_kg
    size, turn = (dict(zip(GRAVITY, slopes, strict=True)) for slopes in ((a, b), (-b, a)))
    yield "load.gravity.mass", peak / per_mass, {n: one / peak / per_mass for n, one in size.items()}
    if GRAVITY[1] in model.names or a < 0.0:
        angle = remainder(gravity.offset_rad + float(np.arctan2(b, a)), 2.0 * pi)
        yield "load.gravity.offset", angle, {n: one / peak**2 for n, one in turn.items()}


def with_structure(design: Design, model: Fit) -> Design:
    """The design with the parts that a model's values need: a friction map, a pendulum."""
    friction, load = design.friction, design.load
    gone = [path for path in design.parameters if path.startswith("friction.point.")]
    if isinstance(model, JointModel) and model.knots_rad_s is not None:
        points = tuple(
            FrictionPoint(speed_rad_s=_short(speed), torque_Nm=max(model[f"map_{k}"], 0.0))
            for k, speed in enumerate(model.knots_rad_s)
        )
        friction = replace(friction, points=points, dry_torque_Nm=0.0, viscous_Nms_rad=0.0)
        friction = replace(friction, dry_torque_reverse_Nm=None, viscous_reverse_Nms_rad=None)
        gone += [path for path in design.parameters if path in PLAIN_KEYS]
    elif friction.points and {"dry", "dry_forward"} & set(model.names):
        friction = replace(friction, points=())
    gravity = _pendulum(design, model)
    if friction is design.friction and gravity is load.gravity:
        return design
    return _without(replace(design, friction=friction, load=replace(load, gravity=gravity)), gone)


def _without(design: Design, gone: Collection[str]) -> Design:
    """The design without the records of some keys, and their correlations."""
    kept = {path: one for path, one in design.parameters.items() if path not in gone}
    pairs = tuple(c for c in design.correlations if not {c.first, c.second} & set(gone))
    return replace(design, parameters=FrozenMap(kept), correlations=pairs)


def inertia_share(design: Design, total_kgm2: float, key: str) -> tuple[float, float]:
    """The value of an inertia key that makes a total at the motor, and its slope over that total."""
    if key not in INERTIAS:
        raise InputError(f'"{key}": the inertia can be written to {" or ".join(INERTIAS)}')
    scale = 1.0 if key == INERTIAS[0] else design.total_ratio**2
    own = design.motor.rotor_inertia_kgm2 if key == INERTIAS[0] else design.load.inertia_kgm2
    rest = design.inertia_kgm2 - own / scale
    left = (total_kgm2 - rest) * scale
    if not left > 0.0:
        other, unit = INERTIAS[1 - INERTIAS.index(key)], "kg" if design.axis == "linear" else "kg m^2"
        raise InputError(
            f"identified inertia {total_kgm2:.4g} {unit} at the motor in all, but the design's inertias "
            f"beside {key} alone make {rest:.4g} {unit}: correct them, or use --inertia-to {other}",
            where=design.origin or design.name,
        )
    return left, scale


def design_with_fit(design: Design, fit: Fit, source: str) -> Design:
    """A design with identified values, normal tolerances of their standard errors, and correlations.

    Margins and Monte Carlo then inherit them. Correlations below 0.005 are left out; old ones between the
    same keys are replaced.
    """
    fit = _possible(design, fit)
    values = {p: _short(float(v)) for p, v in zip(fit.names, fit.values, strict=True)}
    if "friction.viscous_reverse" in fit.names and design.friction.offset_torque_Nm:
        values["friction.offset_torque"] = 0.0
    if "friction.viscous" in fit.names and not set(REVERSE) & set(fit.names):  # one law for both directions
        friction = replace(design.friction, dry_torque_reverse_Nm=None, viscous_reverse_Nms_rad=None)
        design = _without(replace(design, friction=friction), REVERSE)
    try:
        changed = with_values(design, values)
    except InputError as error:
        if not error.message.startswith(fit.names):
            raise
        name = max((name for name in fit.names if error.message.startswith(name)), key=len)
        why = "the record does not tell it: it takes a longer motion, at several speeds in both directions"
        if name.startswith("motor.") and fit[name] < -SURE * fit.std(name):
            why = "a column has the other sign, or is another signal"
        raise InputError(f"identified {error.message}; {why}") from error
    parameters = dict(changed.parameters)
    for path, std in zip(fit.names, fit.standard_errors, strict=True):
        tolerance = _tolerance(path, parameters[path].value, _short(float(std)))
        parameters[path] = replace(parameters[path], source=source, grade="D", tolerance=tolerance)
    return with_correlations(replace(changed, parameters=FrozenMap(parameters)), fit)


def _possible(design: Design, fit: Fit) -> Fit:
    """Without what came out below zero within its error and cannot be: there the design keeps its own.

    The others are what the fit expects of them beside that (conditional mean), where they can be.
    """
    gone = [p for p in fit.names if fit[p] < 0.0 <= fit[p] + 2.0 * fit.std(p) and not _accepts(p, fit[p])]
    own = {path: parameter_value(design, path) for path in gone if path in design.parameters}
    rest = {path: path for path in fit.names if path not in gone}
    moved = fit.renamed(rest | {path: path for path in own}).at(own)
    return moved if all(_accepts(path, moved[path]) for path in rest) else fit.renamed(rest)


def _accepts(path: str, value: float) -> bool:
    allowed = field_of(path)
    return allowed is None or allowed.accepts(value)


def with_correlations(design: Design, fit: Fit) -> Design:
    """The design with the correlations of a fit in the place of those between the same keys.

    A value that the design did not take (`_possible`) has no tolerance, and none of them.
    """
    fit = fit.renamed({n: n for n in fit.names if n in design.parameters and design.parameters[n].tolerance})
    kept = [c for c in design.correlations if not {c.first, c.second} <= set(fit.names)]
    return replace(design, correlations=(*kept, *_correlations(fit.names, fit.correlation)))


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


def _correlations(paths: Sequence[str], correlation: Floats) -> list[Correlation]:
    if not paths:
        return []
    matrix = np.clip(correlation, -1.0, 1.0)
    matrix = np.where(np.abs(matrix) < LEAST_CORRELATION, 0.0, np.round(matrix, 6))
    np.fill_diagonal(matrix, 1.0)
    lowest = float(np.linalg.eigvalsh(matrix)[0])
    if lowest < 0.0:  # rounding and leaving out may have made it indefinite by as much
        keep = 1.0 / (1.0 - 1.01 * lowest + 1e-9)
        matrix = np.where(np.eye(len(paths)) > 0.0, 1.0, keep * matrix)
    pairs = ((i, j) for i, j in combinations(range(len(paths)), 2) if matrix[i, j] != 0.0)
    return [Correlation(first=paths[i], second=paths[j], coefficient=float(matrix[i, j])) for i, j in pairs]


def _short(value: float) -> float:
    """Seven significant digits, which is more than any bench gives."""
    return float(f"{value:.7g}")
