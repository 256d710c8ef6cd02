"""The motion of a record beside what its command and its current make of a design, without a simulation."""

import numpy as np

from actuator_lti.design.control import FEED_FORWARD
from actuator_lti.design.model import Design
from actuator_lti.types import Floats
from analyses.estimation.least_squares import scaled_lstsq
from analyses.estimation.parameters import own_share
from analyses.records.compared import COSINE, place_of, ratio_of, smooth
from analyses.records.factors import NEAR, named_factor
from analyses.records.finding import SURE, Finding
from analyses.records.naming import LOADS, RATES, REFERENCES
from analyses.records.record import Record

TIMES = (60.0, 1e3, 1e6)  # min, ms and us read as s


def time_finding(design: Design, record: Record) -> Finding | None:
    """A unit of the time that the lag behind the command tells, or what a current accelerates."""
    return _by_lag(design, record) or _by_inertia(design, record)


def _by_lag(design: Design, record: Record) -> Finding | None:
    """A time in another unit, by the lag of the motion behind its command; None where nothing tells.

    Behind a position loop over a velocity loop the motion is later by 1/Kv, whatever the motor.
    """
    control, command = design.controller, REFERENCES[design.axis]
    loop, place = control.position, place_of(design, record)
    if place is None or loop is None or control.velocity is None or command not in record.signals:
        return None
    if loop.integral_time_s is not None or any(getattr(loop, name) for name in FEED_FORWARD):
        return None
    error = design.total_ratio * record[command] - place[1]
    lag, cosine = ratio_of(error - error.mean(), np.gradient(place[1], record.time_s))
    ratio = lag * loop.gain
    size = max(ratio, 1.0 / ratio) if ratio > 0.0 else 1.0
    if cosine < COSINE or not any(abs(size / factor - 1.0) < NEAR for factor in TIMES):
        return None
    why = f"the motion lags its command by {lag:.3g} s, {ratio:.4g} times what the loop's gain makes"
    why += f": factor {named_factor(ratio)}, in the unit of the time"
    return Finding("time against the lag behind the command", False, why)


def _by_inertia(design: Design, record: Record) -> Finding | None:
    """The same of a speed that follows its command: by what the current accelerates beside its friction.

    The unit of the time is in the inertia alone, and no other factor is; that is known to a factor of two.
    Noise of the speed makes it too small, and too large where it is regressed the other way: both say it.
    """
    rate, kM = RATES[design.axis], design.effective_motor.torque_constant_Nm_A
    if not {rate, f"{rate}_reference", "current"} <= record.signals.keys() or kM is None:
        return None
    speed, torque = record[rate], kM * record["current"]
    followed, _ = ratio_of(speed, record[f"{rate}_reference"])
    if _is_loaded(design, record) or not 0.5 < followed < 2.0:
        return None
    own, resisting = _own_torques(design, speed, record)
    parts = np.column_stack([own, resisting])
    inertia, friction = shares = scaled_lstsq(parts, torque)
    inverse = scaled_lstsq(np.column_stack([torque, resisting]), own)[0]
    _, cosine = ratio_of(torque, parts @ shares)
    units = (factor**side for factor in TIMES[1:] for side in (1, -1))
    factor = next((one for one in units if 0.5 < inertia / one < 2.0 and 0.5 < one * inverse < 2.0), None)
    if cosine < COSINE or not 0.5 < friction < 2.0 or factor is None:
        return None
    why = f"by the current the inertia is {inertia:.4g} times the design's, the friction {friction:.4g}"
    why += f" times: factor {named_factor(factor)}, in the unit of the time"
    return Finding("time against the current", False, why)


def _is_loaded(design: Design, record: Record) -> bool:
    return bool(design.load.acting() or np.any(record.signals.get(LOADS[design.axis], 0.0)))


def _own_torques(design: Design, speed: Floats, record: Record) -> tuple[Floats, Floats]:
    """What the design's inertia and its friction take at a speed, at the motor, N m (N)."""
    friction = design.friction.viscous_Nms_rad * speed + design.friction.dry_torque_Nm * np.sign(speed)
    return design.inertia_kgm2 * np.gradient(speed, record.time_s), friction


def sign_finding(design: Design, record: Record) -> Finding | None:
    """A current against the torque that the design needs for the motion; None where nothing says so.

    With a voltage, that says of which signal the sign is. A load that acts could need a torque against that
    of inertia and friction: none is told then.
    """
    place, speed = place_of(design, record), record.signals.get(RATES[design.axis])
    if place is not None:
        speed = np.gradient(place[1], record.time_s)
    others = {"voltage", "force", "force_reference", "torque_reference"} & record.signals.keys()
    if speed is None or "current" not in record.signals or others or _is_loaded(design, record):
        return None
    current, speed = (smooth(record, one) for one in (record["current"], speed))
    torque = np.add(*_own_torques(design, speed, record))
    _, cosine = ratio_of(current - current.mean(), torque - torque.mean())
    if cosine > -COSINE:
        return None
    why = "the sign of the current is turned, or that of the motion: the current drives against the torque"
    why += f" that the design needs for it (cosine {cosine:.2f})"
    return Finding("current against the motion", False, why)


def load_finding(design: Design, record: Record) -> Finding | None:
    """A recorded load that goes with the current as its own torque: what the drive moves is against it."""
    name, constant = LOADS[design.axis], design.effective_motor.torque_constant_Nm_A
    if not {name, "current"} <= record.signals.keys() or not constant or not np.ptp(record[name]):
        return None
    load, torque = (smooth(record, values) for values in (record[name], constant * record["current"]))
    for ratio in {1.0, design.total_ratio}:
        share, cosine = ratio_of(load, ratio * torque)
        if cosine > COSINE and abs(share - 1.0) <= SURE * own_share(design, "motor.torque_constant"):
            words = "kM i" if ratio == 1.0 else "kM i and the reduction"
            why = f"the {name} is {share:.4g} times {words}: the drive's own (leave the column out), "
            why += "or a load of turned sign: positive drives forward"
            return Finding("load against the current", False, why)
    return None
