"""The motion of a record beside what its command and its current make of a design, without a simulation."""

import numpy as np

from actuator_lti.design.control import FEED_FORWARD
from actuator_lti.design.model import Design
from actuator_lti.types import Floats
from analyses.estimation.least_squares import scaled_lstsq
from analyses.records.factors import NEAR, named_factor
from analyses.records.naming import LOADS, RATES
from analyses.records.record import Record

COSINE = 0.9  # cosine above which one signal is taken to be a multiple of the other
TIMES = (60.0, 1e3, 1e6)  # min, ms and us read as s


def ratio_of(y: Floats, x: Floats) -> tuple[float, float]:
    """Slope of y over x through zero, and how alike they are (cosine); zeros for a flat signal."""
    xx, yy = float(x @ x), float(y @ y)
    if xx == 0.0 or yy == 0.0:
        return 0.0, 0.0
    return float(x @ y) / xx, float(x @ y) / np.sqrt(xx * yy)


def wrong_time(design: Design, record: Record, place: Floats) -> str:
    """A time in another unit, by the lag of the motion behind its command; empty where nothing tells.

    Behind a position loop over a velocity loop the motion is later by 1/Kv, whatever the motor; ``place``
    is at the motor.
    """
    control, command = design.controller, "position_reference" if design.axis == "linear" else "reference"
    loop = control.position
    if loop is None or control.velocity is None or command not in record.signals:
        return ""
    if loop.integral_time_s is not None or any(getattr(loop, name) for name in FEED_FORWARD):
        return ""
    error = design.total_ratio * record[command] - place
    lag, cosine = ratio_of(error - error.mean(), np.gradient(place, record.time_s))
    ratio = lag * loop.gain
    size = max(ratio, 1.0 / ratio) if ratio > 0.0 else 1.0
    if cosine < COSINE or not any(abs(size / factor - 1.0) < NEAR for factor in TIMES):
        return ""
    why = f"the motion lags its command by {lag:.3g} s, {ratio:.4g} times what the loop's gain makes"
    return f"{why}: factor {named_factor(ratio)}, in the unit of the time"


def wrong_time_of_speed(design: Design, record: Record) -> str:
    """The same of a speed that follows its command: by what the current accelerates beside its friction.

    The unit of the time is in the inertia alone, and no other factor is; that is known to a factor of two.
    Noise of the speed makes it too small, and too large where it is regressed the other way: both say it.
    """
    rate, kM = RATES[design.axis], design.effective_motor.torque_constant_Nm_A
    if not {rate, f"{rate}_reference", "current"} <= record.signals.keys() or kM is None:
        return ""
    speed, torque = record[rate], kM * record["current"]
    followed, _ = ratio_of(speed, record[f"{rate}_reference"])
    if _is_loaded(design, record) or not 0.5 < followed < 2.0:
        return ""
    own, resisting = _own_torques(design, speed, record)
    parts = np.column_stack([own, resisting])
    inertia, friction = shares = scaled_lstsq(parts, torque)
    inverse = scaled_lstsq(np.column_stack([torque, resisting]), own)[0]
    _, cosine = ratio_of(torque, parts @ shares)
    units = (factor**side for factor in TIMES[1:] for side in (1, -1))
    factor = next((one for one in units if 0.5 < inertia / one < 2.0 and 0.5 < one * inverse < 2.0), None)
    if cosine < COSINE or not 0.5 < friction < 2.0 or factor is None:
        return ""
    why = f"by the current the inertia is {inertia:.4g} times the design's, the friction {friction:.4g}"
    return f"{why} times: factor {named_factor(factor)}, in the unit of the time"


def _is_loaded(design: Design, record: Record) -> bool:
    return bool(design.load.acting() or np.any(record.signals.get(LOADS[design.axis], 0.0)))


def _own_torques(design: Design, speed: Floats, record: Record) -> tuple[Floats, Floats]:
    """What the design's inertia and its friction take at a speed, at the motor, N m (N)."""
    friction = design.friction.viscous_Nms_rad * speed + design.friction.dry_torque_Nm * np.sign(speed)
    return design.inertia_kgm2 * np.gradient(speed, record.time_s), friction


def turned_current(design: Design, record: Record, current: Floats, speed: Floats) -> str:
    """A current against the torque that the design needs for the motion; empty where nothing says so.

    Current and speed, at the motor, are through the same filter. A load that acts could need a torque against
    that of inertia and friction: none is told then.
    """
    if _is_loaded(design, record) or record.signals.keys() & {"force", "force_reference", "torque_reference"}:
        return ""
    torque = np.add(*_own_torques(design, speed, record))
    _, cosine = ratio_of(current - current.mean(), torque - torque.mean())
    if cosine > -COSINE:
        return ""
    why = "the sign of the current is turned, or that of the motion: the current drives against the torque"
    return f"{why} that the design needs for it (cosine {cosine:.2f})"
