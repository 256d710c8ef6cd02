"""Motor and motion found together where the drive's command is held between the rows: by simulation.

At each row the command jumps, the loops answer between the rows, and every row shows the same end of that
answer: current, voltage and speed there are their means plus shares of speed and acceleration that the loops
set. No equation of the rows tells these from kE and R, friction and inertia. The simulated drive, whose loops
are known, has the same rows.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from actuator_lti.design import parameter_value, with_values
from actuator_lti.design.model import Design
from actuator_lti.errors import NumericalError
from actuator_lti.types import Floats
from analyses.correlation.closed_loop import measured_signals, model_signals
from analyses.estimation.fit import Fit
from analyses.estimation.least_squares import wider_covariance
from analyses.estimation.parameters import default_value, parameter
from analyses.identification import to_design
from analyses.identification.electrical import NAMES, NOT_SHOWN, SHOWN, ElectricalFit, kept_inductance
from analyses.identification.joint_model import JointModel
from analyses.identification.output_error import LEAST_GAIN, fit_output, simulated_part
from analyses.identification.own_bias import same_fit, with_model_signals, with_noise
from analyses.records.record import Record

BACK, TORQUE = parameter("back_emf").key, parameter("torque_constant").key
FIRST_GAIN = 0.03  # part of the squares that a step takes, with which a first search goes on


def found_together(
    design: Design,
    records: Sequence[Record],
    model: JointModel,
    others: Sequence[Sequence[Record]],
    is_nearest: Callable[[Sequence[Record]], bool],
) -> Fit | None:
    """Values of the motion and of the motor, by their names, with which the simulated drive has the records.

    ``design`` is where the search begins, and where it has no friction ``model``, which tells what is looked
    for of the motion. In a first search each signal
    counts by what the best of ``others``, records simulated with other commands, leaves of it. None where the
    records that are simulated behind it are not the nearest.
    """
    back = design.motor.back_emf_constant_Vs_rad or design.motor.torque_constant_Nm_A
    design = to_design.with_structure(with_values(design, {BACK: float(back or 0.0)}), model)
    motor = [one for one in NAMES if parameter(one).key and parameter_value(design, parameter(one).key)]
    inertia = max(to_design.INERTIAS, key=lambda key: _part_of_inertia(design, key))
    keys = {name: parameter(name).key or inertia for name in (*model.names, *motor)}
    design = with_values(design, _first_friction(design, model))
    found = _by_simulation(design, records, tuple(keys.values()), others, is_nearest)
    if found is None:
        return None
    made = with_values(design, dict(zip(found.names, found.values.tolist(), strict=True)), check=False)
    scale = to_design.inertia_share(design, made.inertia_kgm2, inertia)[1]
    slopes = {name: {key: 1.0 / scale if name == "inertia" else 1.0} for name, key in keys.items()}
    return found.mapped(slopes, {"inertia": made.inertia_kgm2} if "inertia" in keys else {})


def _first_friction(design: Design, model: JointModel) -> dict[str, float]:
    """Dry friction and that of the reverse to begin with, not zero; by direction they hold the offset."""
    reverse = [name for name in model.names if name.endswith("_reverse")]
    names = {*reverse, *(name for name in model.names if name.startswith("dry"))}
    most = {name: max(abs(model[name]), model.std(name)) for name in names}
    first = {parameter(name).key: default_value(design, name) or most[name] for name in names}
    return first | {"friction.offset_torque": 0.0} if reverse else first


def _part_of_inertia(design: Design, key: str) -> float:
    value, scale = to_design.inertia_share(design, design.inertia_kgm2, key)
    return value / scale


def _by_simulation(
    design: Design,
    records: Sequence[Record],
    keys: tuple[str, ...],
    others: Sequence[Sequence[Record]],
    is_nearest: Callable[[Sequence[Record]], bool],
) -> Fit | None:
    """Values of keys with which the simulated drive has the currents and voltages of records; kM as kE."""
    parts = [simulated_part(design, record) for record in records]
    measured = [measured_signals(design, part) for part in parts]
    wanted = _drives(measured)

    def made(sizes: Sequence[float], tried: Design) -> Floats:
        tried = _one_constant(design, tried)
        runs = [model_signals(tried, *each)[0] for each in zip(parts, measured, strict=True)]
        return _weighed(_drives(runs), sizes)

    start, ends = design, np.cumsum([len(one) for one in wanted])[:-1]
    lefts = [[left.std() for left in map(np.subtract, wanted, _drives(like))] for like in others]
    sizes = np.min([[one.std() for one in wanted], *lefts], axis=0).tolist()
    for gain in (FIRST_GAIN, LEAST_GAIN):
        found = fit_output(start, keys, partial(made, sizes), _weighed(wanted, sizes), least_gain=gain)
        start = with_values(start, dict(zip(keys, found.values.tolist(), strict=True)), check=False)
        if gain == FIRST_GAIN and not is_nearest(
            [with_model_signals(_one_constant(design, start), part) for part in parts]
        ):
            return None
        rests = np.split(found.rest, ends)
        sizes = [size * float(np.std(rest)) for size, rest in zip(sizes, rests, strict=True)]
    told = list(zip(np.split(found.slopes, ends), rests, strict=True))
    pairs = [
        (_side_by_side(w, z), _side_by_side(e, d))
        for (w, e), (z, d) in zip(told[::2], told[1::2], strict=True)
    ]
    try:
        return Fit(names=keys, values=found.values, covariance=wider_covariance(told, pairs))
    except np.linalg.LinAlgError:
        raise NumericalError(f"the records do not tell {', '.join(keys)} apart") from None


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


def _weighed(signals: Sequence[Floats], sizes: Sequence[float]) -> Floats:
    return np.concatenate([one / size for one, size in zip(signals, sizes, strict=True)])


def motor_of(both: Fit, raw: ElectricalFit, design: Design) -> ElectricalFit:
    """What was found of the motor, in the place of what the voltage equation makes of the rows."""
    value, std = both.get("inductance", 0.0), both.std("inductance")
    hidden = (
        {"inductance": kept_inductance(design, NOT_SHOWN.format(value, std))} if value < SHOWN * std else {}
    )
    names = tuple(name for name in NAMES if name in both.names and name not in hidden)
    motion, motor = ([k for k, n in enumerate(both.names) if (n in NAMES) is own] for own in (False, True))
    motor = [k for k in motor if both.names[k] in names]
    return replace(
        raw,
        names=names,
        values=both.values[motor],
        covariance=both.covariance[np.ix_(motor, motor)],
        fixed=hidden,
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
        bias_told="found with the motor, on records simulated with a command that is held",
    )
