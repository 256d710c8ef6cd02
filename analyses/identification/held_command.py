"""Motor and motion found together where the drive's command is held between the rows: by simulation.

At each row the command jumps, the loops answer between the rows, and every row shows the same end of that
answer: current, voltage and speed there are their means plus shares of speed and acceleration that the loops
set. No equation of the rows tells these from kE and R, friction and inertia. The simulated drive, whose loops
are known, has the same rows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import truediv

import numpy as np

from actuator_lti.design import parameter_value, with_values
from actuator_lti.design.model import Design
from actuator_lti.errors import NumericalError
from actuator_lti.types import Floats
from analyses.correlation.between_ticks import places_s
from analyses.correlation.closed_loop import as_driven, later_s, measured_signals, model_signals, ticks_early
from analyses.estimation.fit import Fit
from analyses.estimation.least_squares import wider_covariance
from analyses.estimation.parameters import default_value, parameter
from analyses.identification import to_design
from analyses.identification.electrical import NAMES, SHOWN, ElectricalFit, kept_inductance
from analyses.identification.joint_model import JointModel
from analyses.identification.output_error import ITERATIONS, fit_output, simulated_part, values_of
from analyses.identification.own_bias import same_fit, with_model_signals, with_noise
from analyses.records.record import Record

Pair = tuple[Floats, Floats]
Records = Sequence[Record]
Nearest = Callable[[Records], bool]
INDUCTANCE = parameter("inductance").key
BACK, TORQUE = parameter("back_emf").key, parameter("torque_constant").key
NOT_SHOWN = "the records do not show it (they are as likely with none)"
NONE = 1e-6  # of the design's inductance: as good as none
ASIDE = 0.01  # of the time between which the rows may be
SETTLED = 0.05  # of what a signal leaves, within which its weight may still move


def found_together(
    design: Design, records: Records, model: JointModel, others: Sequence[Records], is_nearest: Nearest
) -> Fit | None:
    """Values of the motion and of the motor, by their names, with which the simulated drive has the records.

    ``design`` is where the search begins, and where it has no friction ``model``, which tells what is looked
    for of the motion. In a first search each signal counts by what the best of ``others``, records simulated
    with other commands, leaves of it. None where the records that are simulated behind it are not the
    nearest.
    """
    back = design.motor.back_emf_constant_Vs_rad or design.motor.torque_constant_Nm_A
    design = to_design.with_structure(with_values(design, {BACK: float(back or 0.0)}), model)
    motor = [one for one in NAMES if parameter(one).key and parameter_value(design, parameter(one).key)]
    whole = design.inertia_kgm2
    inertia = max(to_design.INERTIAS, key=lambda key: truediv(*to_design.inertia_share(design, whole, key)))
    keys = {name: parameter(name).key or inertia for name in (*model.names, *motor)}
    design = with_values(design, _first_friction(design, model))
    found = _Search(design, tuple(keys.values())).by_simulation(records, others, is_nearest)
    if found is None:
        return None
    made = with_values(design, dict(zip(found.names, found.values.tolist(), strict=True)), check=False)
    scale = to_design.inertia_share(design, made.inertia_kgm2, inertia)[1]
    known = {name: key for name, key in keys.items() if key in found}
    slopes = {name: {key: 1.0 / scale if name == "inertia" else 1.0} for name, key in known.items()}
    mapped = found.mapped(slopes, {"inertia": made.inertia_kgm2} if "inertia" in keys else {})
    return replace(mapped, fixed=found.fixed)


def _first_friction(design: Design, model: JointModel) -> dict[str, float]:
    """Dry friction and that of the reverse to begin with, not zero; by direction they hold the offset."""
    reverse = [name for name in model.names if name.endswith("_reverse")]
    names = {*reverse, *(name for name in model.names if name.startswith("dry"))}
    most = {name: max(abs(model[name]), model.std(name)) for name in names}
    first = {parameter(name).key: default_value(design, name) or most[name] for name in names}
    return first | {"friction.offset_torque": 0.0} if reverse else first


@dataclass(frozen=True)
class _Likeliest:
    """Where a search ended: its values are the design's."""

    design: Design
    keys: tuple[str, ...]
    parts: Sequence[Record]
    sizes: Floats  # of what is left of each signal
    unit: Sequence[Pair]  # slopes of each over the values, what is left, of size one
    unlikely: float  # twice the negative logarithm of the likelihood of white noise, but for a constant
    freed: _Likeliest | None = None  # where the inductance is found too, though the records do not show it

    def away(self, other: _Likeliest) -> Floats:
        """By what the values of another search are off these, as a covariance."""
        moved = values_of(other.design, self.keys) - values_of(self.design, self.keys)
        return np.outer(moved, moved)

    @property
    def fit(self) -> Fit:
        """The values; in error by what an inductance that is not shown, and was kept, moves them by too."""
        pairs = [
            (_side_by_side(w, z), _side_by_side(e, d))
            for (w, e), (z, d) in zip(self.unit[::2], self.unit[1::2], strict=True)
        ]
        covariance, fixed = wider_covariance(self.unit, pairs), {}
        if self.freed is not None:
            covariance = covariance + self.away(self.freed)
            fixed = {"inductance": kept_inductance(self.design, NOT_SHOWN)}
        values = values_of(self.design, self.keys)
        return Fit(names=self.keys, values=values, covariance=covariance, fixed=fixed)


@dataclass(frozen=True)
class _Search:
    """A search for the values of keys beside those of a design, kM as kE."""

    design: Design
    keys: tuple[str, ...]

    def by_simulation(self, records: Records, others: Sequence[Records], is_nearest: Nearest) -> Fit | None:
        """Values with which the simulated drive has the currents and voltages of records."""
        parts = [simulated_part(self.design, record) for record in records]
        wanted = _drives(parts)
        lefts = [[left.std() for left in map(np.subtract, wanted, _drives(like))] for like in others]
        sizes = np.min([[one.std() for one in wanted], *lefts], axis=0)
        parts = [as_driven(self.design, part) for part in parts]
        first = self.first(parts, sizes, self.design)
        if not is_nearest([with_model_signals(first.design, part) for part in parts]):
            return None
        try:
            return self.at_its_ticks(self.with_inductance(first))
        except np.linalg.LinAlgError:
            raise NumericalError(f"the records do not tell {', '.join(self.keys)} apart") from None

    def with_inductance(self, first: _Likeliest, than: float = np.inf) -> _Likeliest:
        """The likeliest, the design's inductance kept where the records show none and do not deny it."""
        freed = self.likeliest(first.parts, first.sizes, first.design, than=than)
        if first.keys == self.keys or freed.unlikely > than + SHOWN**2:
            return freed
        denied, held = freed.unlikely + SHOWN**2, freed
        none = {INDUCTANCE: NONE * parameter_value(self.design, INDUCTANCE)}
        for design in (with_values(self.design, none), self.design):
            held = _Search(design, first.keys).likeliest(first.parts, freed.sizes, first.design)
            if held.unlikely > denied:
                return replace(freed, unlikely=denied)
        return replace(held, freed=freed)

    def first(self, parts: Sequence[Record], sizes: Floats, start: Design) -> _Likeliest:
        """One round with the inductance of the design.

        Without one the samples stand still over it: a search that comes to such from afar would stay there.
        """
        rest = tuple(key for key in self.keys if key != INDUCTANCE)
        return _Search(self.design, rest).likeliest(parts, sizes, start, rounds=1)

    def likeliest(
        self, parts: Records, sizes: Floats, start: Design, *, rounds: int = ITERATIONS, than: float = np.inf
    ) -> _Likeliest:
        """Search from ``start``, each signal weighed by what is left of it, until that settles.

        Given up where it lacks more of being as likely as another, ``than``, than its last round has gained.
        Rows moved to where the records are less likely go half the way back, as far as they are sure.
        """
        design, keys, here, parts = self.design, self.keys, parts, list(parts)
        measured = [measured_signals(design, part) for part in parts]
        wanted, before, moves = _drives(measured), np.inf, np.zeros(len(parts))
        found: _Likeliest | None = None
        rows = np.array([len(one) for one in wanted])

        def weighed(signals: Sequence[Floats]) -> Floats:
            return np.concatenate([one / size for one, size in zip(signals, sizes, strict=True)])

        def made(tried: Design) -> Floats:
            tried = _one_constant(design, tried)
            runs = [model_signals(tried, *each) for each in zip(parts, measured, strict=True)]
            return weighed(_drives(runs))

        for turn in range(rounds):
            moved = fit_output(design, keys, made, weighed(wanted), begin=values_of(start, keys))
            start = moved.design
            slopes, rests = (np.split(each, np.cumsum(rows)[:-1]) for each in (moved.slopes, moved.rest))
            left = np.array([np.std(rest) for rest in rests])
            sizes = sizes * left
            unlikely = float(2.0 * rows @ np.log(sizes))
            if found is not None and moves.max() >= SETTLED and unlikely > found.unlikely:
                found, moves = replace(found, parts=here), 0.5 * moves
                if moves.max() < SETTLED:
                    break
                parts = [_halfway(*pair) for pair in zip(here, parts, strict=True)]
                start, sizes = found.design, found.sizes
                continue
            here = list(parts)
            unit = [(w / size, e / size) for w, e, size in zip(slopes, rests, left, strict=True)]
            gram = np.sum([w.T @ w for w, _ in unit], axis=0)
            for k, part in enumerate(parts):
                pair, at = slice(2 * k, 2 * k + 2), (start, part)
                parts[k], unit[pair], moves[k] = _at_its_rows(*at, sizes[pair], unit[pair], gram, turn == 0)
            settled = np.all(np.abs(left - 1.0) < SETTLED) and moves.max() < SETTLED
            found = _Likeliest(_one_constant(design, start), keys, list(parts), sizes, unit, unlikely)
            if settled or before - unlikely < unlikely - than:
                break
            before = unlikely
        assert found is not None  # there is a first round
        return found

    def at_its_ticks(self, found: _Likeliest) -> Fit:
        """The fit with the steps of each command at the ticks with which the records are likeliest.

        A tick later or earlier is another minimum, as the inductance delays too: each is searched to its end,
        and counts in the covariance by how likely it is beside the likeliest.
        """
        tried = [found]
        for k in range(len(found.parts)):
            for turn in (1, -1):
                before = found
                while (other := _moved_steps(found, k, turn)) is not None:
                    first = self.first(other, found.sizes, found.design)
                    tried.append(self.with_inductance(first, found.unlikely))
                    if tried[-1].unlikely >= found.unlikely:
                        break
                    found = tried[-1]
                if found is not before:
                    break
        fit = found.fit
        others = sum(np.exp(-0.5 * abs(one.unlikely - found.unlikely)) * found.away(one) for one in tried)
        return replace(fit, covariance=fit.covariance + others)


def _at_its_rows(
    design: Design, part: Record, sizes: Floats, unit: Sequence[Pair], gram: Floats, anywhere: bool
) -> tuple[Record, Sequence[Pair], float]:
    """A record with its rows where they likeliest are between the ticks, and the slopes without that.

    ``unit``: slopes over the values and what is left, of size one. Also the move, in its standard errors;
    beforehand every time at which the rows show the same jumps is as likely. ``anywhere``: not only from
    where they are.
    """
    if (ends := later_s(design, part)) is None:
        return part, unit, 0.0
    measured, w = measured_signals(design, part), np.concatenate([slopes for slopes, _ in unit])

    def left(more: float) -> Floats:
        moved = replace(part, early_s=np.asarray(part.early_s) + more)
        made = _drives([model_signals(design, moved, measured)])
        triples = zip(_drives([measured]), made, sizes, strict=True)
        return np.concatenate([(own - other) / size for own, other, size in triples])

    def alone(values: Floats) -> Floats:
        return np.asarray(values - w @ np.linalg.solve(gram, w.T @ values))

    wide, places = ends[1] - ends[0], [0.0, *(places_s(ends) if anywhere else ())]
    rests = [left(place) for place in places]
    more = places[int(np.argmin([rest @ alone(rest) for rest in rests]))]
    column, known = (left(-ASIDE * wide) - left(ASIDE * wide)) / (2.0 * ASIDE * wide), 12.0 / wide**2
    sure = column @ alone(column) + known
    if abs(more) <= wide / len(places):
        more = float(column @ alone(rests[0]) + known * np.mean(ends)) / sure
        more = float(np.clip(more, ends[0] - 0.5 * wide, ends[1] + 0.5 * wide))
    w = w - np.outer(column, column @ w / (column @ column + known))
    own = list(zip(np.split(w, 2), (rest for _, rest in unit), strict=True))
    return replace(part, early_s=np.asarray(part.early_s) + more), own, abs(more) * float(np.sqrt(sure))


def _halfway(one: Record, other: Record) -> Record:
    """A record with its rows in the middle between two places."""
    return replace(one, early_s=0.5 * (np.asarray(one.early_s) + np.asarray(other.early_s)))


def _moved_steps(found: _Likeliest, k: int, turn: int) -> Sequence[Record] | None:
    """The records with the steps of one of them a tick earlier, or later; None where its rows refuse it."""
    part, tick = found.parts[k], found.design.controller.period_s
    early = np.asarray(part.early_s) + turn * tick
    (least, most), ticks = ticks_early(found.design, part.time_s), np.round(early[np.isfinite(early)] / tick)
    if not len(ticks) or ticks.min() < least or ticks.max() > most:
        return None
    return [*found.parts[:k], replace(part, early_s=early), *found.parts[k + 1 :]]


def _one_constant(design: Design, tried: Design) -> Design:
    """kM as much larger than the design's as kE."""
    ratio = parameter_value(tried, BACK) / parameter_value(design, BACK)
    return with_values(tried, {TORQUE: ratio * parameter_value(design, TORQUE)}, check=False)


def _side_by_side(current: Floats, voltage: Floats) -> Floats:
    """The rows of two signals, those of one time one after the other."""
    return np.stack([current, voltage], axis=1).reshape(-1, *current.shape[1:])


def _drives(records: Sequence[Mapping[str, Floats]] | Sequence[Record]) -> list[Floats]:
    """The current of each and its voltage less the mean, which an offset of the sensor adds to."""
    each = [(one["current"], one["voltage"] - one["voltage"].mean()) for one in records]
    return [signal for pair in each for signal in pair]


def motor_of(both: Fit, raw: ElectricalFit) -> ElectricalFit:
    """What was found of the motor, in the place of what the voltage equation makes of the rows."""
    names = tuple(name for name in NAMES if name in both.names)
    motion, motor = ([k for k, n in enumerate(both.names) if (n in NAMES) is own] for own in (False, True))
    return replace(
        raw,
        names=names,
        values=both.values[motor],
        covariance=both.covariance[np.ix_(motor, motor)],
        fixed=both.fixed,
        at_once=np.zeros(len(names)),
        bias={name: raw[name] - both[name] for name in names if name in raw.names},
        with_motion=both.covariance[np.ix_(motion, motor)],
    )


def motion_of(
    both: Fit, start: Design, make: Callable[[JointModel], Design], raw: JointModel, records: Sequence[Record]
) -> JointModel:
    """What was found of the motion, in the place of what the inverse model makes of the rows."""
    here = [both.names.index(name) for name in raw.names]
    values, covariance = both.values[here], both.covariance[np.ix_(here, here)]
    model = replace(raw, values=values, covariance=covariance)
    design = make(model)
    simulated = tuple(with_model_signals(design, simulated_part(design, record)) for record in records)
    return replace(
        model,
        simulated=simulated,
        records=with_noise(raw, same_fit(start, raw)(simulated)),
        bias=dict(zip(raw.names, (raw.values - values).tolist(), strict=True)),
        bias_note="found with the motor, on records simulated with a command that is held",
    )
