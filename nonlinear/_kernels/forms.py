"""Forms of the loop: the parts that a drive lacks cost nothing.

Two for any drive that is run without instruments, energies or a law of its own, rigid and elastic; two for
an elastic drive whose output is measured and whose load depends on it; the others for three plain loops.
"""

from actuator_lti.compiled.form import Form
from nonlinear._kernels import layout as at
from nonlinear._kernels.blocks import PROBE_I, PROBE_U, PROBE_W, PROBE_Y

_UNSEEN = (at.PROBING, PROBE_U, PROBE_I, PROBE_W, PROBE_Y, at.WITH_ENERGY, at.OWN_STAGE, at.OWN_MEASURES)
_ABSENT = (
    *_UNSEEN, at.LOAD_VARIES, at.HAS_INSTRUMENTS, at.HAS_FULL_COMMAND, at.HAS_MEASURED_SPEED, at.OVERLOAD,
    at.HAS_FULL_VELOCITY, at.HAS_FULL_CURRENT, at.SUPPLY, at.WINDOW, at.WITH_EXTREMES, at.STEP_TARGET,
)  # fmt: skip
_ORDINARY = (at.SUPPLY, at.WINDOW, at.WITH_EXTREMES, at.STEP_TARGET, at.JITTER, at.RIGID)
_MEASURED = (at.LOAD_VARIES, at.HAS_INSTRUMENTS, at.HAS_FULL_COMMAND, at.HAS_POSITION, at.HAS_VELOCITY)
# a voltage set by the velocity loop, with nothing around it; or a current loop, and all that may be around it
_INNER = (at.HAS_CURRENT, at.HAS_MEASURED_SPEED, at.HAS_FULL_VELOCITY, at.HAS_FULL_CURRENT, at.OVERLOAD)
_PRESENT = (at.HAS_POSITION, at.HAS_VELOCITY, at.HAS_CURRENT)
_PLANTS = {
    "dry": {at.LAW: 0.0, at.LOOK: 0.0, at.ELASTIC_DRIVE: 0.0, at.NOTING: 0.0},
    "tanh": {at.LAW: 1.0, at.LOOK: 1.0, at.ELASTIC_DRIVE: 0.0, at.NOTING: 0.0, at.TANH_LEVEL: -1.0},
    "elastic": {at.LAW: 0.0, at.LOOK: 1.0, at.ELASTIC_DRIVE: 1.0, at.NOTING: 1.0},
}


def forms() -> tuple[Form, ...]:
    """Of each kind of plant, and plain loops with a delay of up to two ticks; the last that fits is taken."""
    unseen = dict.fromkeys(_UNSEEN, 0.0)
    plain = dict.fromkeys(_ABSENT, 0.0) | dict.fromkeys(_PRESENT, 1.0)
    common = dict.fromkeys((*_UNSEEN, *_ORDINARY), 0.0) | dict.fromkeys(_MEASURED, 1.0) | _PLANTS["elastic"]
    measured = {
        name: common | dict.fromkeys(_INNER, there)
        for name, there in (("measured_voltage", 0.0), ("measured_current", 1.0))
    }
    wide = {"rigid": {at.ELASTIC_DRIVE: 0.0}, "two_sided": _PLANTS["elastic"]}
    return (
        *(Form("run_block", name, "p", unseen | known) for name, known in wide.items()),
        *(Form("run_block", name, "p", known) for name, known in measured.items()),
        *(
            Form("run_block", f"{name}_{line}", "p", plain | plant | {at.DELAY_LINE: float(line)})
            for name, plant in _PLANTS.items()
            for line in (2, 3)
        ),
    )
