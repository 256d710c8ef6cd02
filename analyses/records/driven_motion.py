"""The motion of a record beside what its command and its current make of a design, without a simulation."""

import numpy as np

from actuator_lti.design.control import FEED_FORWARD
from actuator_lti.design.model import Design
from actuator_lti.types import Floats
from analyses.records.factors import NEAR, named_factor
from analyses.records.naming import LOADS
from analyses.records.record import Record

ALIKE = 0.9  # cosine above which one signal is taken to be a multiple of the other
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
    lag, alike = ratio_of(error - error.mean(), np.gradient(place, record.time_s))
    ratio = lag * loop.gain
    size = max(ratio, 1.0 / ratio) if ratio > 0.0 else 1.0
    if alike < ALIKE or not any(abs(size / factor - 1.0) < NEAR for factor in TIMES):
        return ""
    told = f"the motion lags its command by {lag:.3g} s, {ratio:.4g} times what the loop's gain makes"
    return f"{told}: factor {named_factor(ratio)}, in the unit of the time"


def turned_current(design: Design, record: Record, current: Floats, speed: Floats) -> str:
    """A current against the torque that the design needs for the motion; empty where nothing says so.

    Current and speed, at the motor, are through the same filter. A load that acts could need a torque against
    that of inertia and friction: none is told then.
    """
    loaded = design.load.acting() or np.any(record.signals.get(LOADS[design.axis], 0.0))
    if loaded or record.signals.keys() & {"force", "force_reference", "torque_reference"}:
        return ""
    friction = design.friction.viscous_Nms_rad * speed + design.friction.dry_torque_Nm * np.sign(speed)
    torque = design.inertia_kgm2 * np.gradient(speed, record.time_s) + friction
    _, alike = ratio_of(current - current.mean(), torque - torque.mean())
    if alike > -ALIKE:
        return ""
    told = "the sign of the current is turned, or that of the motion: the current drives against the torque"
    return f"{told} that the design needs for it (cosine {alike:.2f})"
