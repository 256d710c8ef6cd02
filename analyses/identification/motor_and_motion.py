"""The motor by its voltage, the motion by its current, in turn; and how the drive took its command."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.stats import wilcoxon

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Floats
from analyses.correlation.closed_loop import AXIS_SIGNALS
from analyses.correlation.driving import Driven, command_of, readings
from analyses.correlation.following import moved_by_clock
from analyses.estimation.fit import Fit
from analyses.identification import to_design
from analyses.identification.asked import Settings, fixed_values, held_by_name
from analyses.identification.diagnosis import Diagnosed, diagnosed
from analyses.identification.electrical import (
    ElectricalFit,
    electrical_slopes,
    fit_electrical,
    without_own_bias,
)
from analyses.identification.friction_law import fit_map
from analyses.identification.held_command import found_together, motion_of, motor_of
from analyses.identification.inverse import fit_records
from analyses.identification.joint_model import NAMES, FrictionForm, JointModel, Recipe
from analyses.identification.motion_noise import with_noise_of_motion
from analyses.identification.own_bias import holds_between, without_bias
from analyses.identification.run_down import fit_run_downs, runs_down
from analyses.records.record import HELD, SMOOTH, STRAIGHT, Record
from analyses.records.voltage import resistance_doubt

Both = tuple[Sequence[Record], Sequence[Record]]  # records as taken, and simulated
ROUNDS = 4
SETTLED = 0.1  # standard errors by which the motor may still move
AGREES = 1e-9  # of a signal: as closely as a simulated drive is its linear loop, and no miss


@dataclass(frozen=True, kw_only=True)
class Found:
    """The design with what the voltage told of its motor, that fit where it was asked for, and the motion."""

    start: Design
    electrical: ElectricalFit | None
    right: Diagnosed


@dataclass(frozen=True)
class Sought:
    """What is looked for in records: beside a design as it came, and with what is fixed."""

    design: Design
    plain: Design
    settings: Settings
    recipe: Recipe | None

    @cached_property
    def held(self) -> dict[str, float]:
        """What is held, by the names of the model; a fixed rotor or load inertia fixes the whole."""
        form: FrictionForm = "symmetric" if self.settings.friction == "map" else self.settings.friction
        names = (*NAMES[form], "load_coefficient")
        whole = dict.fromkeys(to_design.INERTIAS, "inertia")
        held = held_by_name(fixed_values(self.design, self.settings.fix), names, whole)
        return held | {"inertia": self.plain.inertia_kgm2} if "inertia" in held else held

    @property
    def gravity(self) -> bool:
        """Whether a pendulum is looked for."""
        return self.settings.gravity or self.plain.load.gravity is not None

    def motor_and_motion(self, records: Sequence[Record]) -> Found:
        """What records tell, in each way in which the drive may have taken its commands between the rows.

        The own bias of the fits hangs on it, and where it is taken off the wrong way, that way meets the
        records better than the right one does: so each is followed to its end, and what then meets the
        records best is taken; where that is a simulated drive whose command is held, the other ways are
        simulated as well. In the covariances every other counts by the probability that it is nearer.
        """
        plain, settings = self.plain, self.settings
        commands = [(command_of(plain, record), record) for record in records]
        read = {between for own, record in commands for between in self._ways(own, record)}
        betweens = sorted(read, key=(SMOOTH, STRAIGHT, HELD).index)  # of equals the first is taken
        ways = [[replace(one, between=way) for one in records] for way in betweens]
        moves = {own.stage for own, _ in commands if own} <= {"position", "velocity"}
        simulated = moves and settings.electrical and settings.friction != "map" and not self.gravity
        tried: list[Found] = []
        for taken in ways:
            found = self._together(tried, taken) if simulated and taken[0].between == HELD else None
            tried += [self._in_turn(taken)] if found is None else found
            if not tried[0].right.model.simulated:  # no bias is taken off
                return tried[0]
        if tried[-1].electrical is not None and tried[-1].electrical.with_motion is not None:
            for taken in ways[:-1]:
                with suppress(InputError, NumericalError):
                    tried += self._together(tried, taken) or []
        tried = [one for one in tried if one.right.model.simulated]  # of no drive that can be, none is nearer
        if not (recorded := all(own is not None for own, _ in commands)):
            tried = [one for one in tried if one.right.model.bias] or tried
        misses = _misses(plain, [_both_ways(one) for one in tried]) if recorded else _left(tried)
        best = int(np.argmin(np.sum(misses, axis=1)))
        best_one = tried[best]
        for other, more in zip(tried, misses - misses[best], strict=True):
            if np.any(more):  # by ranks (Wilcoxon 1945), as one event may outweigh all other blocks
                share = float(wilcoxon(more, alternative="greater").pvalue)
                best_one = _widened(plain, best_one, other, share)
        return best_one

    def _ways(self, own: Driven | None, record: Record) -> set[str]:
        """How a command may go on between the rows; one not recorded smooth or, by a slow loop, held."""
        if own is not None:
            return {one.between for one in readings(own, record)}
        return {SMOOTH, HELD} if holds_between(self.plain, record) else {SMOOTH}

    def _with_scale_of_current(self, motor: ElectricalFit, right: Diagnosed) -> Found:
        """What was found; what the current may be too small by is in R and L as it is in all torques."""
        doubt = max((resistance_doubt(self.design, record) for record in right.records), key=abs)
        by_current = np.isin(motor.names, ("resistance", "inductance"))
        motor = motor.wider(doubt / (1.0 + doubt) * by_current * motor.values)
        return Found(start=_with_motor(self.plain, motor, right.records), electrical=motor, right=right)

    def _together(self, others: Sequence[Found], records: Sequence[Record]) -> list[Found] | None:
        """Motor and motion by simulation; again where a lag of the current was taken back.

        Empty where others are nearer; None where the records do not tell all of it, or cannot be simulated.
        """
        plain, (_, raw) = self.plain, self.by_voltage(records)
        model = self._raw(plain, records, [1.0] * len(records))
        likes = [one.right.model.simulated for one in others]

        def is_nearest(simulated: Sequence[Record]) -> bool:
            misses = _misses(plain, [*map(_both_ways, others), (records, simulated)])
            return int(np.argmin(np.sum(misses, axis=1))) == len(others)

        first: Diagnosed | None = None
        while True:
            try:
                both = found_together(plain, records, model, likes, is_nearest)
            except (InputError, NumericalError):
                return None
            if both is None:
                return []
            motor = motor_of(both, raw)
            start = _with_motor(plain, motor, records)
            right = self._diagnosed(start, records, both)
            if first or all(one is own for one, own in zip(right.records, records, strict=True)):
                break
            first, records = right, right.records
        bounds = first or right
        right = replace(right, late_s=bounds.late_s, findings=bounds.findings)
        return [self._with_scale_of_current(motor, right)]

    def _in_turn(self, records: Sequence[Record]) -> Found:
        """The motor and the motion in turn.

        The motion needs kM; the motor is found less its own bias on records that are simulated with both.
        """
        if not self.settings.electrical:
            return Found(start=self.plain, electrical=None, right=self._diagnosed(self.plain, records))
        start, found = self.by_voltage(records)
        right = self._diagnosed(start, records)
        for _ in range(ROUNDS):
            before, model = found, right.model
            start, found = self.by_voltage(records, (start, right))
            right = self._diagnosed(start, records)
            if _settled(before, found) and _settled(model, right.model):
                break
        return self._with_scale_of_current(found, right)

    def by_voltage(
        self, records: Sequence[Record], simulated: tuple[Design, Diagnosed] | None = None
    ) -> tuple[Design, ElectricalFit]:
        """The design with what the voltage equation tells of its motor, and that fit.

        Less its own bias where the records were simulated, with the motor of the design given beside them.
        """
        late_s = 0.0 if simulated is None else simulated[1].late_s
        found = fit_electrical(self.plain, records, self.recipe, late_s)
        if simulated is not None:
            start, right = simulated
            found = without_own_bias(found, start, records, right.model, self.recipe)
        return _with_motor(self.plain, found, records), found

    def _diagnosed(self, start: Design, records: Sequence[Record], both: Fit | None = None) -> Diagnosed:
        return diagnosed(self.design, start, records, partial(self._fitted, start, both=both), self.recipe)

    def _raw(
        self, start: Design, records: Sequence[Record], weights: Sequence[float] | None = None
    ) -> JointModel:
        """The joint model as the settings ask; with weights of the records, see `fit_records`."""
        fit, form = partial(fit_records, start, records, gravity=self.gravity), self.settings.friction
        fit = partial(fit, recipe=self.recipe, fixed=self.held)
        return fit_map(fit) if form == "map" else fit(form=form, weights=weights)

    def _fitted(self, start: Design, records: Sequence[Record], both: Fit | None) -> JointModel:
        """That, less its own bias, or with what was found with the motor."""
        if down := [record for record in records if runs_down(start, record)]:
            if len(down) < len(records):
                raise InputError("nothing drives it: a run-down is identified by itself", where=down[0].name)
            return fit_run_downs(start, records, self.settings, self.held)
        model = self._raw(start, records, None if both is None else [1.0] * len(records))
        parts = []
        for part, record in zip(model.records, records, strict=True):
            command = command_of(start, record)
            origin = "command of the simulated drive" + f", {record.between}" * (record.between != SMOOTH)
            more = {} if command is None else {command.signal: origin}
            parts.append(replace(part, used={**more, **part.used}))

        def made(model: JointModel) -> Design:
            values = to_design.joint_values(start, model, inertia_to=self.settings.inertia_to)
            return to_design.design_with_fit(to_design.with_structure(start, model), values, "")

        model = replace(model, records=tuple(parts))
        if both is not None:
            return motion_of(both, start, made, model, records)
        return with_noise_of_motion(start, without_bias(start, made, model, records), records)


def _both_ways(found: Found) -> Both:
    return found.right.records, found.right.model.simulated


def _misses(design: Design, tried: Sequence[Both]) -> Floats:
    """What simulated records miss those taken by, shape (ways, blocks): the less, the likelier.

    Half the squares over the mean square of the way that meets a signal best, summed over the signals and
    over root n blocks of root n rows each. A command that is held is late, which a clock that is off feigns:
    what that would explain of a motion is no miss.
    """
    sums = []
    pairs = [zip(*both, strict=False) for both in tried]
    for ways in zip(*pairs, strict=False):
        names = [name for name in AXIS_SIGNALS[design.axis] if name in ways[0][0].signals]
        off = np.array([[_missed(design, own, like, name) for name in names] for own, like in ways])
        least = [AGREES**2 * np.mean(ways[0][0][name] ** 2) for name in names]
        size = np.maximum(np.min(np.mean(off**2, axis=2), axis=0), least)
        rows = np.sum(0.5 * off**2 / np.maximum(size, 1e-300)[:, None], axis=1)
        sums.append(_in_blocks(rows))
    return np.concatenate(sums, axis=1)


def _left(tried: Sequence[Found]) -> Floats:
    """The same of what simulated records leave of the fit's rows, where a command was learnt from the motion.

    Such a motion is that of the record in any way: how the loops had the current between the rows is not.
    """
    rows = []
    for model in (one.right.model for one in tried):
        whole = [np.zeros(len(part.keep)) for part in model.records]
        for weight, part, values in zip(model.weights, model.records, whole, strict=True):
            values[np.flatnonzero(part.keep)[part.compared]] = weight * part.noise
        rows.append(np.concatenate(whole) ** 2)
    return _in_blocks(0.5 * np.array(rows) / max(np.min(np.mean(rows, axis=1)), 1e-300))


def _in_blocks(rows: Floats) -> Floats:
    """The sums of n rows over root n blocks, shape (ways, blocks)."""
    blocks = np.array_split(rows, int(np.sqrt(rows.shape[1])), axis=1)
    return np.transpose([np.sum(block, axis=1) for block in blocks])


def _missed(design: Design, own: Record, like: Record, name: str) -> Floats:
    off, driven = own[name][: len(like)] - like[name], command_of(design, own)
    column = moved_by_clock(driven, own, name, like[name]) if driven else None
    return off if column is None or not np.any(column) else off - column * (column @ off) / (column @ column)


def _widened(plain: Design, taken: Found, other: Found, share: float) -> Found:
    """What was taken, with another's difference in its covariances at the probability that it is right."""

    def wider(fit: Fit, than: Fit) -> Floats:
        moved = np.array([than[name] - fit[name] if name in than.names else 0.0 for name in fit.names])
        return np.asarray(fit.covariance + share * np.outer(moved, moved))

    model = taken.right.model
    right = replace(taken.right, model=replace(model, covariance=wider(model, other.right.model)))
    start, motor = taken.start, taken.electrical
    if motor is not None and other.electrical is not None:
        motor = replace(motor, covariance=wider(motor, other.electrical))
        start = _with_motor(plain, motor, right.records)
    return Found(start=start, electrical=motor, right=right)


def _settled(before: Fit, found: Fit) -> bool:
    off = [abs(found[name] - before[name]) < SETTLED * found.std(name) for name in found.names]
    return found.names == before.names and all(off)


def _with_motor(plain: Design, found: ElectricalFit, records: Sequence[Record]) -> Design:
    source = f"voltage equation of {names_of(records)}"
    return to_design.design_with_fit(plain, found.mapped(electrical_slopes(plain, found)), source)


def names_of(records: Sequence[Record]) -> str:
    """The names of records, in a list."""
    return ", ".join(record.name for record in records)
