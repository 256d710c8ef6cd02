"""The rows of the regression that one record gives: motion, drive torque, load, rest left out."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.fft import rfft, rfftfreq
from scipy.ndimage import minimum_filter1d
from scipy.stats import chi2
from scipy.stats import f as variance_ratio

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats, Mask
from analyses.estimation.least_squares import solve
from analyses.estimation.parameters import default_value, pendulum_angle
from analyses.identification.joint_model import (
    NAMES,
    FrictionForm,
    JointModel,
    Recipe,
    Rows,
    friction_columns,
)
from analyses.identification.load_side import two_sides
from analyses.identification.sampled_current import acts_later_s, mean_current
from analyses.records.compared import place_of, ratio_of
from analyses.records.differentiation import Motion, decimated
from analyses.records.finding import NO_CHANCE
from analyses.records.inputs import lacking
from analyses.records.naming import LOADS, RATES
from analyses.records.record import Record, lasting, period_of, prepared

REST_SHARE = 0.005
REST_TIME_S = 0.03
SHORTEST_S = 0.2
BENCHMARK = "3c1f252c6d0fcbf617fbac4800b0a26dfc07ff79c5950944686879ef755aa37a"  # SHA-256 of m, then N


def recipe_for(record: Record, cutoff_hz: float | None = None, decimation: int | None = None) -> Recipe:
    """The published recipe, moved to another sampling period.

    100 Hz or a tenth of the sampling frequency, whichever is lower; decimated to the cut-off; 49 ms dropped
    at both ends; differences over seven points, as three would make the inertia too small by some tenths of a
    per cent; torques filtered as the position is. The EMPS benchmark itself has the published one.
    """
    period = period_of(record)
    usual = min(100.0, 0.1 / period)
    if cutoff_hz is None and decimation is None and is_benchmark(record) and usual == Recipe().cutoff_hz:
        return Recipe()
    cutoff = usual if cutoff_hz is None else cutoff_hz
    if not cutoff > 0.0:
        raise InputError(f"cutoff = {cutoff:g} Hz: must be between 0 and {0.5 / period:g} Hz")
    factor = max(1, round(1.0 / (cutoff * period))) if decimation is None else decimation
    if factor < 1:
        raise InputError(f"decimation = {factor}: must be 1 or more")
    skips = dict.fromkeys(("skip_samples", "skip_end_samples"), max(round(0.049 / period), 5))
    return Recipe(cutoff_hz=cutoff, decimation=factor, **skips, points=7, both_sides=True)


def is_benchmark(record: Record) -> bool:
    """Whether a record is that of the EMPS benchmark, to the last digit: no other has published figures."""
    if "gtau" not in record.constants:
        return False
    values = np.concatenate([record[name] for name in ("position", "force") if name in record.signals])
    return hashlib.sha256(values.tobytes()).hexdigest() == BENCHMARK


def is_loaded(record: Record) -> bool:
    """Whether a record holds the load."""
    return any(name in record.signals for name in LOADS.values())


def drive_of(design: Design, record: Record) -> tuple[Floats, str, str, bool]:
    """The drive torque (force) of a record: values, signal, words, and whether kE w is still to come off."""
    motor, signals = record.drive(design).effective_motor, record.signals
    constant, gain, ohm = motor.torque_constant_Nm_A, motor.source_gain_Nm_V, motor.resistance_ohm
    if "force" in signals and design.axis == "linear":
        return record["force"], "force", "recorded force", False
    for name in ("current", "current_reference"):
        if name in signals and constant is not None:
            origin = f"torque kM i, kM = {constant:g} N m/A"
            return np.asarray(constant * record[name]), name, origin, False
    name = "force_reference" if design.axis == "linear" else "torque_reference"
    if name in signals:
        return record[name], name, f"{name.replace('_reference', '')} as commanded", False
    for name in ("voltage", "voltage_reference"):
        words = name.replace("_", " ")
        if name in signals and gain is not None:
            return np.asarray(gain * record[name]), name, f"source gain {gain:g} times the {words}", False
        if name in signals and constant is not None and ohm is not None:
            origin = f"kM (u - kE w)/R of the {words}, without the inductance"
            return np.asarray(constant / ohm * record[name]), name, origin, True
    why = "no drive signal: force, current (kM), torque_reference, or voltage (a source gain, or kM and R)"
    why += "; of a motor that is switched off a column of current 0"
    raise lacking(record, why)


def motion_of(design: Design, record: Record, recipe: Recipe) -> tuple[Motion, str]:
    """Position, speed and acceleration at the motor, from the position or, without one, from the speed."""
    period = period_of(record)
    if (place := place_of(design, record)) is not None:
        return recipe.motion(place[1], period), place[0]
    rate = RATES[design.axis]
    if rate not in record.signals:
        wanted = "position or velocity" if design.axis == "linear" else "angle, output_angle or speed"
        raise lacking(record, f"no motion: {wanted} is needed")
    made = recipe.motion(record[rate], period)
    whole = np.concatenate([[0.0], np.cumsum(made.position[:-1] * period)])
    return Motion(position=whole, velocity=made.position, acceleration=made.velocity), rate


def stands(design: Design, record: Record, recipe: Recipe | None = None) -> bool:
    """Whether a record shows no motion: noise that is white, or that nothing of the drive's torque moves."""
    place, rate = place_of(design, record), RATES[design.axis]
    if too_short(record) or (place is None and rate not in record.signals):
        return False  # it is refused for that
    values = record[rate] if place is None else place[1] - place[1][0]  # exactly zero of a constant angle
    values = values if place is None else values - values.mean()
    recipe = recipe or recipe_for(record)
    own, before = values[1:], values[:-1]  # of noise behind a filter of first order the innovations are white
    innovations = own - ratio_of(own, before)[0] * before
    return is_white(values, record, recipe) or (
        is_white(innovations, record, recipe) and _is_unmoved(design, record, recipe)
    )


def is_white(values: Floats, record: Record, recipe: Recipe) -> bool:
    """Whether a signal has as much power above the cut-off as below it, line by line.

    By the F-test of the two mean powers, of which each line of white noise is chi-square of two degrees.
    """
    power = np.abs(rfft(values)) ** 2
    below = rfftfreq(len(values), period_of(record)) <= recipe.cutoff_hz
    count, rest = np.count_nonzero(below), np.count_nonzero(~below)
    if not rest:
        return not np.any(values)
    most = float(variance_ratio.isf(NO_CHANCE, 2 * count, 2 * rest))
    return bool(power[below].mean() <= most * power[~below].mean())


def _is_unmoved(design: Design, record: Record, recipe: Recipe) -> bool:
    """Whether a drive that is more than noise moves nothing: its torque has no inertia and no friction.

    By Wald's test of all three, with the correlation in time of what they leave: a load that is not known,
    of which that is full, may hide the torque of a motion as well.
    """
    try:
        drive = drive_of(design, record)[0]
        if is_white(drive, record, recipe):
            return False
        rows = record_rows(design, record, "symmetric", recipe)
        found = solve(rows.columns(NAMES["symmetric"]), rows.y)
    except (InputError, np.linalg.LinAlgError):
        return False
    values, covariance = found.values[:-1], found.correlated[:-1, :-1]
    return bool(chi2.sf(values @ np.linalg.solve(covariance, values), len(values)) > NO_CHANCE)


def moment_of(
    design: Design, record: Record, output_angle: Floats, *, gravity: bool = True
) -> tuple[Floats, str]:
    """The moment at the output and the signal that it comes from.

    Without a recorded one, that of the design's own load torques and (with ``gravity``) pendulum at the
    recorded angle; the signal is then empty.
    """
    name = LOADS[design.axis]
    if name in record.signals:
        return record[name], name
    load = design.load if gravity else replace(design.load, gravity=None)
    rate = np.gradient(output_angle, period_of(record))
    return np.asarray(load.moment_Nm(output_angle, rate)), ""


def record_rows(
    design: Design,
    record: Record,
    form: FrictionForm,
    recipe: Recipe | None,
    *,
    gravity: bool = False,
    moment: Floats | None = None,
    knots_rad_s: Sequence[float] | None = None,
) -> Rows:
    """Make the rows of one record, less what its own settings add (an inertia at the output).

    ``gravity`` adds columns for a moment ``a sin(phi) + b cos(phi)`` at the output, phi from where the
    design's pendulum stands upright: where b is not told, the design's offset is kept. ``moment`` is that
    moment after decimation as found so far, for the load's share of the friction. Speeds of a friction map
    take the place of the form's dry and viscous friction.
    """
    record, shared = prepared(record), design
    design, period = record.drive(shared), period_of(record)
    if too_short(record):
        lasts = f"lasts {len(record) * period:.3g} s in {len(record)} rows"
        why = f"{lasts}: {SHORTEST_S:g} s and more are needed; is the unit of the time right?"
        raise InputError(why, where=record.name)
    if gravity and design.load.path != "back-drivable":
        why = 'load.path = "self-locking": gravity does not turn the motor; "back-drivable" is meant'
        raise InputError(why)
    recipe = recipe_for(record) if recipe is None else recipe
    own = _balance(design, record, recipe, gravity=gravity)
    motion, angle = own.motion, own.angle
    filtered = partial(recipe.other_side, period_s=period)
    names, columns = friction_columns(motion, form, knots_rad_s, filtered)
    turned = angle + pendulum_angle(shared)
    turns = [np.sin(turned), np.cos(turned), motion.velocity, filtered(np.sign(motion.velocity))]
    part = recipe.part(len(motion.velocity))
    rows = decimated(np.column_stack([columns, *turns, own.known, own.drive])[part], recipe.decimation)
    sine, cosine, speed, side, known, y = rows[:, columns.shape[1] :].T
    w = [*rows[:, : columns.shape[1]].T, np.abs(known if moment is None else known + moment) * side]
    names.append("load_coefficient")
    if gravity:
        names += ["gravity_sin", "gravity_cos"]
        w += [-1.0 / design.total_ratio * sine, -1.0 / design.total_ratio * cosine]
    table = np.column_stack(w)
    if record.settings:  # the values looked for are those of the shared design
        y = y - table @ [default_value(design, n, shared) - default_value(shared, n) for n in names]
    keep = _kept(record, motion, part, recipe)
    return Rows(
        name=record.name,
        rows_in=record.counts.rows_in,
        used=own.used,
        notes=(*record.notes, own.note),
        names=tuple(names),
        w=table[keep],
        y=y[keep],
        sine=sine,
        cosine=cosine,
        speed=speed[keep],
        acceleration=rows[keep, 0],
        step_s=period * recipe.decimation,
        keep=keep,
        recipe=recipe,
    )


@dataclass(frozen=True)
class _Balance:
    """The torques of a record's drive at every sample, less what the design knows of them."""

    motion: Motion  # at the motor
    angle: Floats  # of the output
    drive: Floats  # at the motor
    known: Floats  # moment at the output that the gears' friction takes a share of
    used: Mapping[str, str]
    note: str


def _balance(design: Design, record: Record, recipe: Recipe, *, gravity: bool) -> _Balance:
    """The drive torque less known torques, cogging and what the load side takes.

    ``gravity``: the pendulum is looked for, and not known.
    """
    free = design.load.path == "back-drivable"
    motion, place = motion_of(design, record, recipe)
    angle, sides = np.asarray(motion.position / design.total_ratio), None
    if design.coupling is not None:
        sides = two_sides(design, record, place, motion, moment_of(design, record, angle)[0], recipe)
        motion, angle = sides.motor, np.asarray(sides.load.position / design.ratio_behind_coupling)
    drive, driven_by, origin = _torque(design, record, motion, recipe)
    known, source = moment_of(design, record, angle, gravity=not gravity)
    known = recipe.other_side(known, period_of(record)) if source else known
    used = {place: "motion", driven_by: f"drive: {origin}"}
    if source:
        used[source] = "load" + (", its friction and its torque M/N" if free else ", its friction")
    if design.motor.over_angle.bends:
        origin = f"{origin} with the design's cogging"
        drive = drive + design.motor.over_angle.at(motion.position)
    if free:
        drive = drive + known / design.total_ratio
    if sides is not None:
        known = known - design.ratio_behind_coupling * sides.torque
        ratio = design.ratio_to_coupling
        # what the load side takes but for its inertia at the motor's own pace
        own = design.load_side_inertia_kgm2 / ratio * sides.motor.acceleration / ratio
        drive = drive - (np.asarray(sides.torque / ratio - own) if free else 0.0)
        origin, used = f"{origin}, {sides.note}", {**sides.used, **used}
    return _Balance(motion, angle, drive, known, used, note=f"{place} and {origin}")


def _kept(record: Record, motion: Motion, part: slice, recipe: Recipe) -> Mask:
    """Which decimated rows are used: no sample at rest, or left out, lies close by.

    At rest, 30 ms or more below 0.5 % of the largest speed, the friction is not that of sliding.
    """
    slow = np.abs(motion.velocity) < REST_SHARE * float(np.max(np.abs(motion.velocity), initial=0.0))
    moving = ~lasting(slow, max(round(REST_TIME_S / period_of(record)), 6))
    if record.left_out is not None:
        moving &= ~record.left_out
    near = 2 * recipe.decimation + 1
    apart = minimum_filter1d(moving[part].astype(np.uint8), near, mode="constant", cval=1) > 0
    return apart[(len(apart) - 1) % recipe.decimation :: recipe.decimation]


def too_short(record: Record) -> bool:
    """Whether a record is refused for how long it lasts."""
    return len(record) * period_of(record) < SHORTEST_S and not is_benchmark(record)


def _torque(design: Design, record: Record, motion: Motion, recipe: Recipe) -> tuple[Floats, str, str]:
    """The drive torque as it acts: a voltage later by the computing delay and half of what it is held for."""
    motor = design.effective_motor
    constant = motor.torque_constant_Nm_A or 0.0
    drive, driven_by, origin, back_emf = drive_of(design, record)
    if driven_by.startswith("voltage") and not is_benchmark(record):
        drive = np.interp(record.time_s - acts_later_s(design, record), record.time_s, drive)
    if driven_by == "current":
        drive = constant * mean_current(design, record, record["current"], motion.acceleration)
    drive = recipe.other_side(drive, period_of(record))
    if back_emf and motor.resistance_ohm is not None:
        back = constant if motor.back_emf_constant_Vs_rad is None else motor.back_emf_constant_Vs_rad
        drive = drive - constant * back / motor.resistance_ohm * motion.velocity
    return drive, driven_by, origin


def driven_rows(design: Design, record: Record, rows: Rows) -> Callable[[Record], Floats]:
    """The drive torque at the rows of a record, of others that differ from it in the drive signal alone."""
    design, recipe = record.drive(design), rows.recipe
    motion = _balance(design, prepared(record), recipe, gravity=False).motion

    def driven(other: Record) -> Floats:
        drive = _torque(design, prepared(other), motion, recipe)[0]
        return decimated(drive[recipe.part(len(drive))], recipe.decimation)[rows.keep]

    return driven


def rows_under(design: Design, record: Record, model: JointModel) -> Rows:
    """The rows of one record as a model has them, its pendulum in the load's share of the friction."""
    gravity, knots = "gravity_sin" in model, model.knots_rad_s
    made = partial(record_rows, design, record, model.form, model.asked, gravity=gravity, knots_rad_s=knots)
    rows = made()
    if not gravity:
        return rows
    return made(moment=model["gravity_sin"] * rows.sine + model["gravity_cos"] * rows.cosine)
