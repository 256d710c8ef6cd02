"""Resistance, back-EMF constant and, only where the record shows it, inductance: from u, i and w."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import butter, filtfilt

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.least_squares import identifiable, scaled_lstsq, solve, wider_covariance
from analyses.estimation.parameters import parameter
from analyses.identification.joint_model import JointModel, Recipe
from analyses.identification.rows import motion_of, recipe_for, stands
from analyses.identification.sampled_current import acts_later_s
from analyses.records.differentiation import central_difference
from analyses.records.inputs import lacking
from analyses.records.record import Record, period_of

NAMES = ("resistance", "back_emf", "inductance", "voltage_offset")
NOT_SHOWN = "the records do not show it ({:.2g} H with a standard error of {:.2g} H)"
SHOWN = 5.0  # a value counts as shown where it exceeds its standard error so many times
LARGEST_BIAS = 0.5


@dataclass(frozen=True, kw_only=True)
class ElectricalFit(Fit):
    """``u = R i + kE w + L di/dt + offset`` (equation 1); fixed is what the records do not show."""

    relative_residual: float
    columns: tuple[str, ...]  # of the fit; an inductance that is not shown is not among the names
    at_once: Floats  # what a voltage that acts at once would change of the values
    bias: Mapping[str, float] = field(default_factory=dict)  # taken off each value as the fit's own
    # covariance with the values of the motion, where both were found together: shape (those, these)
    with_motion: Floats | None = field(default=None, repr=False)


def fit_electrical(
    design: Design, records: Sequence[Record], recipe: Recipe | None = None, late_s: float = 0.0
) -> ElectricalFit:
    """Fit the voltage equation to records of voltage, current and motion.

    All signals pass the same filter without phase, by default that of each record's period. The recorded
    voltage is the drive's own, which acts later (`acts_later_s`); what this shift does to the values is an
    error of theirs. The inductance is not told where it is not five times its standard error (a record
    sampled too slowly, or too calm, does not show it) or what a current that is late by ``late_s`` (a filter,
    another clock) makes of it, R times that; the others are found beside it.
    """
    late, early = (
        [_rows(design, record, recipe, later=later) for record in records] for later in (True, False)
    )
    whole = _fitted(late, early, NAMES)
    if "inductance" not in whole.names:
        return whole
    value, std = whole["inductance"], whole.std("inductance")
    of_lag = whole["resistance"] * late_s
    if value > SHOWN * np.hypot(std, of_lag):
        return whole
    why = NOT_SHOWN.format(value, std)
    if value > SHOWN * std:
        why = f"a current {1e3 * late_s:.2g} ms late makes {of_lag:.2g} H of the {value:.2g} H found"
    rest = [name for name in whole.names if name != "inductance"]
    fit, others = whole.renamed({name: name for name in rest}), [whole.names.index(name) for name in rest]
    fixed = {**whole.fixed, "inductance": kept_inductance(design, why)}
    return replace(whole, **{**vars(fit), "at_once": whole.at_once[others], "fixed": fixed})


def kept_inductance(design: Design, why: str) -> Fixed:
    """The design's own, where records do not tell it, for a reason."""
    return Fixed(value=design.motor.inductance_H or 0.0, reason=f"{why}: the design's value kept")


def _fitted(late: Sequence[Floats], early: Sequence[Floats], only: tuple[str, ...]) -> ElectricalFit:
    """The fit of some parameters, in error by what a voltage that acts at once would make of them."""
    w, u = _columns(late, only)
    kept, left = identifiable(w, only)
    for one in left:
        if one.name in ("resistance", "back_emf"):
            raise InputError(f"{parameter(one.name).key}: {one}; {_instead(one.moves, w, u, only)}")
    result = solve(w[:, kept], u)
    names = tuple(only[k] for k in kept)
    moved = result.values - scaled_lstsq(*_columns(early, names))
    residuals = [_residual(table, names, result.values) for table in late]
    return ElectricalFit(
        names=names,
        values=result.values,
        covariance=wider_covariance(residuals) + np.outer(moved, moved) / 3.0,
        fixed={one.name: Fixed(value=0.0, reason=str(one)) for one in left},
        relative_residual=float(np.linalg.norm(result.residual) / np.linalg.norm(u)),
        columns=names,
        at_once=moved,
    )


def _residual(table: Floats, names: Sequence[str], values: Floats) -> tuple[Floats, Floats]:
    """The columns of some names of one record, and what their values leave of u."""
    w, u = _columns([table], names)
    return w, np.asarray(u - w @ values)


def _instead(moves: Mapping[str, float], w: Floats, u: Floats, names: Sequence[str]) -> str:
    """What to record where R or kE is not told; of a rotor held fast, what it tells all the same."""
    speed = names.index("back_emf")
    if moves or np.any(w[:, speed]):
        return "vary speed and load, not together only"
    rest = [k for k, name in enumerate(names) if name != "back_emf" and np.any(w[:, k])]
    kept = [rest[k] for k in identifiable(w[:, rest], [names[k] for k in rest])[0]]
    result, parts = solve(w[:, kept], u), []
    for k, value, std in zip(kept, result.values, np.sqrt(np.diag(result.correlated)), strict=True):
        one = parameter(names[k])
        if one.key:
            parts.append(f"{one.key} = {value:.4g} {one.unit} (standard error {std:.2g})")
    why = f"of the motor held fast the record tells {', '.join(parts)}, " if parts else ""
    return f"{why}and neither kE nor inertia and friction: these take a record that moves"


def _columns(tables: Sequence[Floats], names: Sequence[str]) -> tuple[Floats, Floats]:
    """The columns of some names of all records, and u."""
    table = np.concatenate(tables)
    return table[:, [NAMES.index(name) for name in names]], table[:, -1]


def without_own_bias(
    fit: ElectricalFit, start: Design, records: Sequence[Record], model: JointModel, recipe: Recipe | None
) -> ElectricalFit:
    """The fit less what the same fit finds too much in records simulated with the motor of ``start``.

    Between the rows the voltage goes on in steps of the controller's tick, of which a row shows one: at a
    jump of the command it is far from the mean over its interval, and the same way each time, which no
    residual tells. The simulated rows (of the ``model`` of the motion; see `own_bias.without_bias`) miss it
    alike; as instruments they also keep out the noise of the current. The errors are those of what the two
    residuals do not share. A bias as large as half a value, or beside one of the motion that was not taken
    off, stays in the value, and in its error.
    """
    simulated = model.simulated
    if not simulated:
        return fit
    columns, motor = fit.columns, start.effective_motor
    own, other = ([_rows(start, one, recipe) for one in these] for these in (records, simulated))
    own = [table[: len(like)] for table, like in zip(own, other, strict=True)]  # the part that is simulated
    truth = motor.resistance_ohm, motor.back_emf_constant_Vs_rad, motor.inductance_H, 0.0
    known = {name: value or 0.0 for name, value in zip(NAMES, truth, strict=True)}
    z, again = _columns(other, columns)[0], scaled_lstsq(*_columns(other, columns))
    w, u = _columns(own, columns)
    values = scaled_lstsq(z.T @ w, z.T @ u)
    picked = [columns.index(name) for name in fit.names]
    bias = again[picked] - np.array([known[name] for name in fit.names])
    if not model.bias or np.any(np.abs(bias) > LARGEST_BIAS * np.abs(fit.values) + fit.standard_errors):
        return replace(fit, covariance=fit.covariance + np.outer(bias, bias))
    parts = []
    for measured, modelled in zip(own, other, strict=True):
        (_, rest), (z, like) = _residual(measured, columns, values), _residual(modelled, columns, again)
        parts.append((z, rest - like))
    return replace(
        fit,
        values=values[picked] - bias,
        covariance=wider_covariance(parts)[np.ix_(picked, picked)] + np.outer(fit.at_once, fit.at_once) / 3.0,
        bias=dict(zip(fit.names, bias.tolist(), strict=True)),
    )


def _rows(design: Design, record: Record, recipe: Recipe | None, *, later: bool = True) -> Floats:
    """Columns i, w, di/dt, 1 and u of one record, filtered alike; u as it acts, later than its row."""
    for name in ("voltage", "current"):
        if name not in record.signals or not record[name] @ record[name] > 0.0:
            raise lacking(record, f"no {name}: voltage, current and motion are needed")
    recipe, period, drive = recipe or recipe_for(record), period_of(record), record.drive(design)
    speed = motion_of(drive, record, recipe)[0].velocity
    if stands(design, record, recipe):  # as a regressor its noise would make kE about 0
        speed = np.zeros_like(speed)
    b, a = butter(recipe.filter_order, 2.0 * recipe.cutoff_hz * period)
    current, voltage = (np.asarray(filtfilt(b, a, record[name])) for name in ("current", "voltage"))
    if later:
        voltage = np.interp(record.time_s - acts_later_s(drive, record), record.time_s, voltage)
    rate = central_difference(current, period)
    table = np.column_stack([current, speed, rate, np.ones_like(current), voltage])
    skip = recipe.skip_samples
    return table[skip : len(table) - skip]


def electrical_slopes(design: Design, fit: ElectricalFit) -> dict[str, dict[str, float]]:
    """Keys of R, kE, L where it is shown, and kM with kE (one constant), by their slopes over the values."""
    motor = design.motor
    if motor.constants != "dc" or motor.torque_constant_Nm_A is None:
        raise InputError('the voltage equation is identified for motors with "dc" constants', design.name)
    before = motor.back_emf_constant_Vs_rad or motor.torque_constant_Nm_A
    slopes = {parameter(name).key: {name: 1.0} for name in fit.names if parameter(name).key}
    slopes["motor.torque_constant"] = {"back_emf": motor.torque_constant_Nm_A / before}
    return slopes
