"""Forms of the loop for rigid drives of three plain loops: the parts that they lack cost nothing."""

from __future__ import annotations

from actuator_lti.compiled.form import Form
from nonlinear._kernels import layout as at
from nonlinear._kernels.probes import PROBE_I, PROBE_U, PROBE_W, PROBE_Y

_ABSENT = (
    at.RARE_LOAD, at.RARE_SENSE, at.RARE_COMMAND, at.RARE_SPEED, at.RARE_VELOCITY, at.RARE_CURRENT,
    at.PROBING, PROBE_U, PROBE_I, PROBE_W, PROBE_Y, at.OVERLOAD, at.SUPPLY, at.WITH_ENERGY, at.WINDOW,
    at.WITH_EXTREMES, at.STEP_TARGET, at.ELASTIC_DRIVE, at.NOTING, at.OWN_STAGE, at.OWN_MEASURES,
)  # fmt: skip
_PRESENT = (at.HAS_POSITION, at.HAS_VELOCITY, at.HAS_CURRENT)
_FRICTION = {
    "dry": {at.LAW: 0.0, at.LOOK: 0.0},
    "tanh": {at.LAW: 1.0, at.LOOK: 1.0},
}


def forms() -> tuple[Form, ...]:
    """For each law of friction, with a delay of less than one tick and of one to two."""
    plain = dict.fromkeys(_ABSENT, 0.0) | dict.fromkeys(_PRESENT, 1.0)
    return tuple(
        Form("run_block", f"{name}_{line}", "p", plain | law | {at.DELAY_LINE: float(line)})
        for name, law in _FRICTION.items()
        for line in (2, 3)
    )
