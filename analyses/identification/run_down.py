"""A run-down: nothing drives, friction alone stops the drive, and its decay is fitted over time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import least_squares
from scipy.signal import lfilter
from scipy.stats import f as variance_ratio

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.least_squares import identifiable, scaled_lstsq, wider_covariance
from analyses.estimation.parameters import default_value
from analyses.identification.asked import Settings
from analyses.identification.joint_model import NAMES, FrictionForm, JointModel, RecordFit, Rows
from analyses.identification.rows import (
    REST_SHARE,
    REST_TIME_S,
    drive_of,
    is_loaded,
    is_white,
    motion_of,
    recipe_for,
    record_rows,
    stands,
    too_short,
)
from analyses.records.compared import place_of
from analyses.records.finding import NO_CHANCE, SURE
from analyses.records.naming import RATES
from analyses.records.record import Record, lasting, period_of

NO_LOAD = "no load is recorded: the design's value kept"
SLOW = 0.1  # of the largest speed: the decay down to it is where a search begins


def runs_down(design: Design, record: Record) -> bool:
    """Whether nothing that is known drives a record: no current, force or voltage, and no load."""
    acts = design.load.acting() or design.coupling is not None or design.motor.over_angle.bends
    drive, *_, braked = drive_of(design, record)  # by its own voltage, where it is shorted
    return not (acts or braked or is_loaded(record) or np.any(drive))


def switched_off(design: Design, record: Record) -> Record:
    """The record; of a motion whose current is white noise that moves nothing (F-test), with none.

    Where the drive comes down to rest, also of noise about a level: a constant torque and the acceleration
    do not tell inertia from friction, so that it is no more than an offset of either.
    """
    if not np.any(current := record.signals.get("current", np.zeros(1))):
        return record
    none = replace(record, signals={**record.signals, "current": np.zeros_like(current)})
    if too_short(record) or stands(design, none):
        return record
    recipe = recipe_for(record)
    motion = motion_of(design, record, recipe)[0]
    last = np.abs(motion.velocity)[-max(round(REST_TIME_S / period_of(record)), 6) :]
    level, most = 0.0, float(np.max(np.abs(motion.velocity)))
    if runs_down(design, none) and np.mean(last) < SLOW * most:
        level = float(np.clip(np.mean(current), np.min(current), np.max(current)))  # of a constant itself
    table = np.column_stack([motion.acceleration, motion.velocity, np.sign(motion.velocity)])
    noise = current - level
    rest = noise - table @ scaled_lstsq(table, noise)
    least, free = float(rest @ rest), len(rest) - table.shape[1]
    ratio = (float(noise @ noise) - least) / table.shape[1] / (least / free) if least else 0.0
    if not is_white(noise, record, recipe) or variance_ratio.sf(ratio, table.shape[1], free) < NO_CHANCE:
        return record
    note = "the current is noise about zero, and moves nothing: taken as none, a run-down"
    if abs(level) > SURE * np.sqrt(np.mean(noise**2) / len(noise)):
        note = f"the current is {level:.3g} A, at rest as well: taken as an offset of its sensor, a run-down"
        if (gain := design.motor.torque_constant_Nm_A) is not None:
            note += f"; as a torque, {gain * level:.3g} N m, it would be in the friction as an offset"
    return replace(none, notes=(*record.notes, note))


@dataclass(frozen=True, kw_only=True)
class Decay:
    """``w = (w0 + q/p) exp(-p t) - q/p`` until it stands, p = b/J and q = T/J, fitted to a record."""

    ratios: Floats  # p, 1/s, and q, rad/s2 (m/s2)
    covariance: Floats
    side: int  # of the motion
    speed: Floats  # at the motor, as the acceleration: those of the decay
    acceleration: Floats
    rest: Floats  # what is recorded less the decay
    begin: Floats  # its slopes over the values at the begin, shape (n, 1 or 2)
    at_place: bool  # whether a position is fitted, and no speed
    step_s: float

    def answer(self, torque: Floats) -> Floats:
        """What a torque over the inertia, against the motion, makes of what is fitted, but for the begin."""
        fall = np.exp(-self.ratios[0] * self.step_s)
        of_speed = lfilter([0.0, -self.step_s], [1.0, -fall], np.where(self.speed, torque, 0.0))
        made = self.step_s * np.cumsum(of_speed) if self.at_place else of_speed * (self.speed != 0.0)
        return np.asarray(made - self.begin @ scaled_lstsq(self.begin, made))

    def part(self, rows: Rows, names: tuple[str, ...], values: Floats, inertia: float) -> RecordFit:
        """The rows of its record: what each torque makes of what is recorded, times inertia over time."""
        speed, acceleration, count = self.speed, self.acceleration, len(self.speed)
        scale = (self.step_s * count) ** -(2.0 if self.at_place else 1.0)
        shapes = {"inertia": acceleration, "viscous": speed, "offset": np.ones(count)}
        shapes["dry"] = np.full(count, float(self.side))
        table = scale * np.column_stack([self.answer(shapes[name.partition("_")[0]]) for name in names])
        rest, inputs = scale * inertia * self.rest, np.column_stack([speed, acceleration])
        more = {"residual": rest, "own_residual": rest, "noise": rest, "inputs": inputs}
        more |= {"friction": rest - inertia * acceleration, "names": names, "w": table}
        more |= {"y": table @ values + rest, "speed": speed, "acceleration": acceleration}
        more |= {"step_s": self.step_s, "answer": lambda torque: scale * self.answer(torque)}
        more |= dict.fromkeys(("keep", "compared"), np.ones(count, dtype=bool))
        return RecordFit(**{**vars(rows), **more})

    @property
    def relative_error(self) -> float:
        """Norm of what is left over that of what friction takes."""
        known = self.rest + self.answer(-self.acceleration)
        return float(np.linalg.norm(self.rest) / np.linalg.norm(known))


def decay_of(design: Design, record: Record, *, found: bool = True) -> Decay:
    """Fit the decay to a record's position or, without one, speed; with given ratios its begin alone.

    Least squares of the output, of which no derivative is taken; errors respect the correlation in time of
    what is left.
    """
    period, place = period_of(record), place_of(design, record)
    seen = record[RATES[design.axis]] if place is None else place[1]
    speed = motion_of(design, record, recipe_for(record))[0].velocity
    side = 1 if float(np.sum(speed)) >= 0.0 else -1
    time, speed, most = period * np.arange(len(seen)), side * speed, float(np.max(np.abs(speed)))
    first = [] if place is None else [side * seen[0]]
    # what moves, for 30 ms or more at a tenth of the largest speed, has not stood or turned back before
    far = lasting(np.abs(speed) > SLOW * most, max(round(REST_TIME_S / period), 6))
    since, until = (np.logical_or.accumulate(far[::step])[::step] for step in (1, -1))
    if np.any(speed[since & until] < REST_SHARE * most):
        why = "it moves again after it stood: a run-down is one decay, each a file of its own"
        raise InputError(why, where=record.name)
    moves = speed > SLOW * np.max(speed)
    table = np.column_stack([np.ones_like(time), -period * np.cumsum(speed), -time])
    about = scaled_lstsq(table[moves], speed[moves])
    law, begin, given = design.friction, np.array([*first, about[0]]), about[1:]
    if not found:
        torque = law.dry_Nm(0.0, side) + side * law.offset_torque_Nm
        given = np.array([law.viscous(side), torque]) / design.inertia_kgm2

    def decay(x: Floats) -> tuple[Floats, Floats]:
        """Speed, and what is recorded."""
        w0, (p, q) = x[len(first)], x[len(begin) :] if len(x) > len(begin) else given
        p = p or 1e-12
        stop = np.log1p(w0 * p / q) / p if q * w0 > 0.0 < q + w0 * p else np.inf
        held = -np.expm1(-p * np.minimum(time, stop)) / p
        w = np.where(time < stop, w0 - (p * w0 + q) * held, 0.0)
        return w, w if place is None else x[0] + w0 * held - q * (np.minimum(time, stop) - held) / p

    def off(x: Floats) -> Floats:
        return goes * (decay(x)[1] - side * seen)

    # at rest a position errs by one part of a count
    goes = moves | (decay(np.append(begin, about[1:]))[0] > 0.0)
    start = np.append(begin, given) if found else begin
    slope = np.array([float(np.mean(speed[moves])), 1.0])  # of the deceleration over both ratios
    with np.errstate(over="ignore", invalid="ignore"):  # where nothing tells them they grow without bound
        solved = least_squares(off, start, method="lm", x_scale="jac")
        p, q = ratios = np.asarray(solved.x[len(begin) :] if found else given)
        w = decay(solved.x)[0]
        covariance = _covariance(solved.jac[goes], solved.fun[goes], len(begin))
        slows = not found or abs(slope @ ratios) > SURE * np.sqrt(slope @ covariance @ slope)
    if not slows:
        raise InputError("nothing slows it beyond noise: the record tells no friction", where=record.name)
    return Decay(
        ratios=ratios,
        covariance=covariance,
        side=side,
        speed=side * w,
        acceleration=-side * (p * w + q) * (w > 0.0),
        rest=-side * solved.fun,
        begin=solved.jac[:, : len(begin)],
        at_place=place is not None,
        step_s=period,
    )


def _covariance(slopes: Floats, rest: Floats, begin: int) -> Floats:
    """Of the ratios, behind ``begin`` values; of what the record does not tell without bound."""
    try:
        covariance = wider_covariance([(slopes, rest)])[begin:, begin:]
        np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        return np.full((2, 2), np.inf)
    return covariance


def fit_run_downs(
    design: Design, records: Sequence[Record], settings: Settings, held: Mapping[str, float]
) -> JointModel:
    """Friction of records that nothing drives, at the design's inertia; or that, at friction ``held``.

    They show friction over inertia, and no torque: what is kept says so, and the ratios.

    Raises `InputError`: for a friction map, a pendulum, or a record that nothing slows, or that moves again.
    """
    if settings.gravity:
        raise InputError("--gravity: a run-down shows no torque, and no pendulum", where=records[0].name)
    if (form := settings.friction) == "map":
        said = "--friction map: of a run-down are allowed symmetric and per-direction"
        raise InputError(said, where=records[0].name)
    decays, names = [decay_of(design, record) for record in records], NAMES[form]
    table = _balance(decays, form)
    own = {name: held.get(name, default_value(design, name)) for name in names}
    known = [name for name in names[1:] if held.get(name)]
    inertia = "inertia" in held or not known
    free = [name for name in names if name not in held and not (inertia and name == "inertia")]
    picked, left = identifiable(table[:, [names.index(name) for name in free]], free)
    found = tuple(free[k] for k in picked)
    values, covariance, condition = _solved(decays, table, found, own)
    total = own["inertia"] if inertia else float(values[found.index("inertia")])
    # friction below zero within its error is none, and the others as expected beside that
    fit = Fit(names=found, values=values, covariance=total**2 * covariance)
    none = {name: 0.0 for name in found if name != "offset" and -2.0 * fit.std(name) <= fit[name] < 0.0}
    expected = fit.at(none)
    values = np.array([none[name] if name in none else expected[name] for name in found])
    fixed = {"load_coefficient": Fixed(value=design.friction.load_coefficient, reason=NO_LOAD)}
    fixed |= {name: Fixed(value=value, reason="fixed as asked") for name, value in held.items()}
    for each in left:
        moves = {name: -one for name, one in each.moves.items()}
        fixed[each.name] = Fixed(value=own[each.name], reason=f"{each}: the design's value kept", moves=moves)
    why = "fixed as asked" if known or "inertia" in held else "the design's value kept"
    why = f"{_said(decays, design.axis)}: {why}, all others grow with it"
    for name in ["inertia"] if inertia else known:
        moves = dict(zip(found, (values / own[name]).tolist(), strict=True))
        fixed[name] = Fixed(value=own[name], reason=why, moves=moves)
    rows = [record_rows(design, record, form, None) for record in records]
    parts = tuple(one.part(own, found, values, total) for one, own in zip(decays, rows, strict=True))
    drive, rest = (np.concatenate([getattr(part, name) for part in parts]) for name in ("y", "residual"))
    return JointModel(
        names=found,
        values=values,
        white_errors=fit.standard_errors,
        covariance=fit.covariance,
        between={},
        fixed=fixed,
        relative_residual=float(np.linalg.norm(rest) / np.linalg.norm(drive)),
        records=parts,
        recipe=parts[0].recipe,
        condition=condition,
        weights=(1.0,) * len(parts),
        form=form,
        bias_note="no derivative is taken of what is recorded: none",
    )


def _solved(
    decays: Sequence[Decay], table: Floats, found: Sequence[str], own: Mapping[str, float]
) -> tuple[Floats, Floats, float]:
    """Values of what is found beside ``own`` of the others; covariance for an inertia of 1; condition."""
    columns = table[:, [k for name in found for k, each in enumerate(own) if each == name]]
    target = -sum(value * table[:, k] for k, (name, value) in enumerate(own.items()) if name not in found)
    spread = block_diag(*(np.linalg.cholesky(one.covariance) for one in decays))
    weighed = np.linalg.solve(spread, np.column_stack([columns, target]))
    values, weighed = scaled_lstsq(weighed[:, :-1], weighed[:, -1]), weighed[:, :-1]
    condition = np.linalg.cond(columns / np.linalg.norm(columns, axis=0))
    return values, np.linalg.inv(weighed.T @ weighed), float(condition)


def _balance(decays: Sequence[Decay], form: FrictionForm) -> Floats:
    """Coefficients of every name in ``p J - b = 0`` and ``q J - T = 0`` of each decay, two rows for each."""
    names = NAMES[form]
    laws = {1: names[1:3], -1: names[-2:] if form == "per-direction" else names[1:3]}
    table = np.zeros((2 * len(decays), len(names)))
    for k, one in enumerate(decays):
        table[2 * k : 2 * k + 2, 0] = one.ratios
        table[[2 * k, 2 * k + 1], [names.index(name) for name in laws[one.side]]] = -1.0
        table[2 * k + 1] -= [one.side * (name == "offset") for name in names]
    return table


def _said(decays: Sequence[Decay], axis: str) -> str:
    """What run-downs show: the ratios of each record, with their standard errors."""
    unit = "m/s2" if axis == "linear" else "rad/s2"
    errors = [np.sqrt(np.diag(one.covariance)) for one in decays]
    each = [
        f"b/J = {one.ratios[0]:.4g} ± {p:.2g} 1/s and T/J = {one.ratios[1]:.4g} ± {q:.2g} {unit}"
        for one, (p, q) in zip(decays, errors, strict=True)
    ]
    return f"a run-down shows friction over inertia alone, {'; '.join(each)}"
