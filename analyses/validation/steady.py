"""What a constant speed costs: the current (of an ideal source, its drive signal) that friction asks for.

No small signal sees dry friction, which is a constant torque on the motion that it is measured on.  The
steady state does: ``kM i = T_f(w) + offset + what the load takes`` (equations 2 and 9).
"""

from __future__ import annotations

from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from analyses.validation.bias_motion import bias_motion, bias_motion_at
from analyses.validation.ledger import Entry, entry, not_judged
from analyses.validation.reading import Reading
from analyses.validation.release import full_range
from analyses.validation.rig import Rig, stages_of

ROUNDING = 1e-9  # of the largest current: a drive without friction takes none
WINDOW = 400  # samples of the slowest loop
CONDITION = "steady state at a constant speed, with friction"


def steady_entry(design: Design, model: Design, settle_ticks: int) -> Entry:
    """The current at a constant speed that the friction of ``model`` asks for, beside the simulated one.

    Parameters
    ----------
    design : Design
        The drive on the bench.
    model : Design
        What the prediction is made of.
    settle_ticks : int
        Waited for before the two windows.
    """
    source = not design.motor.has_electrical_dynamics
    quantity, unit = ("steady_voltage", "V") if source else ("steady_current", "A")
    name = design.controller.outermost
    motion = bias_motion(design)
    if not motion.speed_rad_s:
        why = "the drive has no steady motion within its limits, or its load changes with the angle"
        return not_judged(name, quantity, unit, None, None, why, CONDITION)
    rigs = [Rig(design, stage, motion) for stage in reversed(stages_of(design))]
    setup = next((one for one in rigs if one.steady_start), None)
    if setup is None:
        why = "the position controller remembers: no run begins in its steady state"
        return not_judged(name, quantity, unit, None, None, why, CONDITION)
    row = setup.row()
    window = WINDOW * setup.base_ticks
    row["ticks"] = settle_ticks + 2 * window
    row.window(window, 1, 0)
    result = row.run()
    if not result.ok[0]:
        raise InputError("a run at constant speed stopped", where=design.name)
    signal = "voltage_V" if source else "current_A"
    last, before = (float(result.mean(signal, k)[0]) for k in (0, 1))
    speed = float(result.mean("motor_speed_rad_s")[0])
    wanted = bias_motion_at(model, speed, motion.load_Nm)
    predicted = wanted.voltage_V if source else wanted.current_A
    full = design.limits.voltage_V if source else full_range(design)["current"]
    seen = Reading(last, 3.0 * abs(last - before))
    return entry(name, quantity, unit, predicted, seen, CONDITION, ROUNDING * full)
