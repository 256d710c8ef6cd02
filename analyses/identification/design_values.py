"""Every number of the design against the fit, the one cause of what is off, the constant that all hang on."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import exp, log
from typing import Any

import numpy as np
from scipy.stats import chi2

from actuator_lti.design import parameter_value
from actuator_lti.design.fields import FIELDS
from actuator_lti.design.model import Design
from actuator_lti.design.plant import DC_PER_A, MotorConstants
from actuator_lti.design.units import ampere_unit
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.least_squares import scaled_lstsq
from analyses.estimation.parameters import default_value, own_share, own_std, parameter
from analyses.identification.electrical import (
    ElectricalFit,
    electrical_slopes,
    fit_electrical,
    without_own_bias,
)
from analyses.identification.joint_model import JointModel
from analyses.identification.rows import drive_of, rows_under
from analyses.records.finding import NO_CHANCE, SURE
from analyses.records.rate import one_phase
from analyses.records.record import Record

EXPLAINED = 0.01  # level above which a cause explains what is off
LEAST_VALUES = 3
COSINE = 0.02
"""Relative standard deviation within which a cause has to explain: rough numbers of a design that are off
alike by chance are no cause."""
FEW = 2.0  # least factor of a cause that only two values tell

TORQUES = dict.fromkeys(("inertia", "dry", "viscous", "load", "gravity"), 1.0)
CAUSES: Mapping[str, Mapping[str, float]] = {
    "the scale of the current": {**TORQUES, "resistance": -1.0},
    "the torque constant (and back-EMF constant)": {**TORQUES, "back": -1.0},
    "the scale of angle and speed: counts, pole pairs, or the reduction": dict.fromkeys(
        ("inertia", "viscous", "back"), 1.0
    ),
    "the clock": {"inertia": 2.0, "viscous": 1.0, "back": 1.0},
}
"""What a factor in one of these does to the identified values: its powers."""


@dataclass(frozen=True)
class DesignValue:
    """One number of the design beside what the records say."""

    name: str
    design: float
    found: float
    ratio: float  # found over design's
    error: float  # standard error of that
    allowed: float  # relative standard deviation of the design's own number
    assumed: bool = False  # the design states none

    @property
    def agrees(self) -> bool:
        """Whether chance explains the difference, with the error of both."""
        return self.within(self.allowed)

    def within(self, own: float) -> bool:
        """The same, the design's own number known to this share."""
        size = (self.ratio - 1.0) / float(np.hypot(self.error, own))
        return bool(chi2.sf(size**2, 1) > NO_CHANCE)


def design_values(
    design: Design, model: JointModel, records: Sequence[Record], start: Design
) -> tuple[DesignValue, ...]:
    """Every number of a design that the records tell: friction, inertia, load friction, gravity, R, kE.

    ``start`` is the design with what was found of its motor first; its constants made torques of currents.
    """
    behind: dict[str, float] = {}
    friction, motor = design.load.friction, design.effective_motor
    if design.coupling is not None and friction is not None:  # taken off the torque that a wrong scale is in
        ratio = design.ratio_to_coupling
        behind = {"viscous": friction.viscous_Nms_rad / ratio**2, "dry": friction.dry_torque_Nm / ratio}
    names = [name for name in model.names if not name.startswith(("offset", "map_", "gravity"))]
    before = {name: default_value(design, name) for name in names}
    found = [design_value(design, model, n, before[n], behind.get(n.partition("_")[0], 0.0)) for n in names]
    found.append(_gravity_value(design, model))
    whole = [record for record in records if {"voltage", "current"} <= set(record.signals)]
    own = {"resistance": motor.resistance_ohm, "back_emf": motor.back_emf_constant_Vs_rad}
    known = start.effective_motor
    if whole and known.resistance_ohm is not None and known.back_emf_constant_Vs_rad:
        with suppress(InputError):  # R and kE are not told apart
            electrical = fit_electrical(start, whole, model.asked)
            likes = [like for like in model.simulated if {"voltage", "current"} <= set(like.signals)]
            cosine = replace(model, simulated=tuple(likes) if len(likes) == len(whole) else ())
            electrical = without_own_bias(electrical, start, whole, cosine, model.asked)
            if any(one_phase(start, record) for record in whole):  # R hangs on the voltage in between
                del own["resistance"]
            found += [design_value(design, electrical, name, value or 0.0) for name, value in own.items()]
    return tuple(one for one in found if one is not None)


def _gravity_value(design: Design, model: JointModel) -> DesignValue | None:
    """The pendulum's moment, by what was found of it along the design's own offset; None without."""
    gravity = design.load.gravity
    if gravity is None or "gravity_sin" not in model.names:
        return None
    along = model.mapped({"gravity": {"gravity_sin": 1.0}})
    one = design_value(design, along, "gravity", gravity.peak_Nm)
    key = "load.gravity.mass"
    return one and replace(one, allowed=own_share(design, key), assumed=not own_std(design, key))


def design_value(
    design: Design, fit: Fit, name: str, before: float, behind: float = 0.0
) -> DesignValue | None:
    """One number, with what stands ``behind`` the coupling beside both; None where either is not positive."""
    before, found = before + behind, fit[name] + behind
    if before <= 0.0 or found <= 0.0:
        return None
    key, ratio, error = parameter(name).key, found / before, fit.std(name) / before
    allowed = own_share(design, key, before)
    return DesignValue(name, before, found, ratio, error, allowed, assumed=not own_std(design, key))


def cause(values: Sequence[DesignValue]) -> tuple[str, float, float] | None:
    """The one cause that explains what is off: in words, its factor, and its standard error.

    Each cause moves the logarithms of the values along a line; weighted least squares finds its factor, and
    chi-square says whether the rest is chance. None where chance explains all, no one cause does, or fewer
    than two of the values that it moves are off by themselves.

    >>> names = ("inertia", "dry", "viscous")
    >>> off = [
    ...     DesignValue(name=n, design=1.0, found=0.8, ratio=0.8, error=0.01, allowed=0.05) for n in names
    ... ]
    >>> words, factor, _ = cause(off)
    >>> words, round(factor, 2)
    ('the scale of the current or the torque constant (and back-EMF constant)', 0.8)
    """
    x = np.log([one.ratio for one in values])
    close = np.array([float(np.hypot(one.error / one.ratio, COSINE)) for one in values])
    std = np.array([float(np.hypot(one.error / one.ratio, one.allowed)) for one in values])
    if len(values) < LEAST_VALUES or chi2.sf(float(np.sum((x / std) ** 2)), len(x)) > NO_CHANCE:
        return None
    off = np.array([not one.within(COSINE) for one in values])
    fitting: list[tuple[float, str, float, float]] = []
    for words, powers in CAUSES.items():
        g = np.array([powers.get(one.name.partition("_")[0], 0.0) for one in values])
        a, b = g / close, x / close
        count = np.count_nonzero(g)
        if np.count_nonzero(off[g != 0.0]) < 2:
            continue  # one value that is off says that this value is off, no more
        factor = float(a @ b) / float(a @ a)
        if count < LEAST_VALUES and abs(factor) < log(FEW):
            continue
        level = float(chi2.sf(float(np.sum((b - factor * a) ** 2)), len(x) - 1))
        if level > EXPLAINED:
            fitting.append((level, words, factor, float(1.0 / np.linalg.norm(a))))
    if not fitting:
        return None
    level, _, factor, error = max(fitting)
    cosine = " or ".join(words for other, words, *_ in fitting if other > level - 1e-9)
    return cosine, exp(factor), error * exp(factor)


STEP = 0.1
LEAST_SHARE = 5e-3
CONSTANTS = {"torque_constant": "torque_constant_Nm_A", "source_gain": "source_gain_Nm_V"}
"""What makes torques of a current or a voltage: fields of a motor, by the names of the parameters."""


def given_constant(fit: Fit) -> str | None:
    """The constant of the design that the values of a fit hang on, by name."""
    return next((name for name in CONSTANTS if name in fit.fixed), None)


def at_constant(fit: Fit, design: Design) -> str:
    """That constant for the source of a written value: `` at kM = value unit``; empty without one."""
    if (name := given_constant(fit)) is None:
        return ""
    one = parameter(name, design.axis)
    unit = ampere_unit("limits.", one.unit, design.motor.constants)  # not those of the data sheet
    return f" at {FIELDS[one.key].symbol} = {fit[name]:g} {unit}"


def kept_constant(design: Design, name: str, fit: Fit, shares: Floats, why: str = "") -> dict[str, Fixed]:
    """A constant (or load friction) kept at the design's, by its name; none where no value hangs on it.

    ``shares``: relative change of each value of the fit over that of the constant; ``why``: what a record
    says of it.
    """
    each: dict[str, list[str]] = {}
    for one, share in zip(fit.names, shares.tolist(), strict=True):
        known, part = parameter(one), f"{100.0 * STEP * share:+.2g} %"
        if abs(STEP * share) > 1.0:  # of more than the value itself: it is about zero
            part = f"{STEP * share * known.scale * fit[one]:+.2g} {known.unit}"
        if abs(share) > LEAST_SHARE:
            each.setdefault(part, []).append(one)
    if not each:
        return {}
    words = " and ".join(f"{part} of {', '.join(of)}" for part, of in each.items())
    if len(each) == 1 and sum(map(len, each.values())) == len(fit.names) > 1:
        words = f"{next(iter(each))} of every value"
    constants: MotorConstants = "peak-phase" if design.motor.constants == "peak-phase" else "rms-line"
    read = f"{constants.partition('-')[0]} read as DC: {1.0 / DC_PER_A[constants]:.2f} times"
    scale = f", nor the scale of the current ({read})" * (name == "torque_constant")
    value = parameter_value(design, parameter(name).key)
    reason = why or f"these records do not tell it{scale}: values and intervals are those at the design's"
    moves = {n: part * fit[n] / value for n, part in zip(fit.names, shares.tolist(), strict=True)}
    in_model = getattr(design.effective_motor, CONSTANTS.get(name, ""), value)  # an AC motor's: A dc
    reason = f"{reason}; {100.0 * STEP:+.2g} % of it is {words}"
    return {name: Fixed(value=in_model, reason=reason, moves=moves)}


def with_given_constant(
    start: Design, model: JointModel, records: Sequence[Record], compared: Sequence[DesignValue]
) -> JointModel:
    """The model and, among what is kept, the design's constant that all its values hang on; none if told.

    A motion and a current tell ratios to kM alone: with another kM, or a current of another scale, the same
    record has other values. Values and intervals are then those at the design's constant, and ``moves`` says
    by how much an error of it moves each of them, with known loads and held values where there are such.
    Where a voltage tells kE (among the values ``compared``) closely, the intervals hold by how much the
    design's is off from it, and the error of that.
    """
    name, *others = {constant_of(start, record) for record in records}
    if name is None or others:
        return model
    shares = _shares(start, name, model, records)
    words = ""
    for one in compared:
        if one.name == "back_emf" and name == "torque_constant" and one.error <= one.allowed:
            off = one.ratio - 1.0
            model = model.wider(shares * float(np.hypot(off, one.error)) * model.values)
            if abs(off) <= SURE * one.error:
                return model
            words = (
                f"by the voltage kE, and so kM, is {one.ratio:.4g} times the design's (standard error "
                f"{one.error:.1g}): values are those at the design's, the intervals hold the difference; "
                "--electrical takes kM from the record"
            )
    return replace(model, fixed={**model.fixed, **kept_constant(start, name, model, shares, words)})


def with_found_constant(
    start: Design, model: JointModel, records: Sequence[Record], motor: ElectricalFit
) -> tuple[JointModel, Fit]:
    """The model with the error of kM in its intervals, and its values beside the motor's, by a design's keys.

    Where both were found together the model has that error.
    """
    slopes = electrical_slopes(start, motor)
    if motor.with_motion is not None:
        return model, model.joined(motor, motor.with_motion).mapped(
            {name: {name: 1.0} for name in model.names} | slopes
        )
    found, key, moves = motor.mapped(slopes), parameter("torque_constant").key, np.zeros(len(model.names))
    if {constant_of(start, record) for record in records} == {"torque_constant"}:
        moves = _shares(start, "torque_constant", model, records) * model.values / found[key]
    model = model.wider(found.std(key) * moves)
    return model, model.joined(found, np.outer(moves, found.covariance[found.names.index(key)]))


def constant_of(design: Design, record: Record) -> str | None:
    """What makes a torque of this record's drive signal, by the name of the constant."""
    if {"force", "force_reference", "torque_reference"} & record.signals.keys():
        return None
    if drive_of(design, record)[1].startswith("voltage"):
        return None if design.effective_motor.source_gain_Nm_V is None else "source_gain"
    return "torque_constant"


def _shares(start: Design, name: str, model: JointModel, records: Sequence[Record]) -> Floats:
    """Relative change of each fitted value over that of the constant; exact, as the fit is linear in it."""
    changed: dict[str, Any] = {CONSTANTS[name]: (1.0 + STEP) * float(getattr(start.motor, CONSTANTS[name]))}
    more = replace(start, motor=replace(start.motor, **changed))
    tables, targets = [], []
    for weight, record in zip(model.weights, records, strict=True):
        one, other = (rows_under(design, record, model) for design in (start, more))
        tables.append(weight * one.columns(model.names))
        targets.append(weight * np.column_stack([one.y - model.kept(one), (other.y - one.y) / STEP]))
    value, change = scaled_lstsq(np.concatenate(tables), np.concatenate(targets)).T
    return np.divide(change, value, out=np.zeros_like(change), where=value != 0.0)
