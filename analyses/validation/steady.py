"""What a constant speed costs: the current (of an ideal source, its drive signal) that friction asks for.

No small signal sees dry friction, which is a constant torque on the motion that it is measured on.  The
steady state does: ``kM i = T_f(w) + offset + what the load takes`` (equations 2 and 9).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.errors import InputError
from analyses.validation.ledger import Entry, entry, not_judged
from analyses.validation.reading import Reading
from analyses.validation.release import full_range
from analyses.validation.sweep import settling_ticks_of
from nonlinear.loop_setup import LoopSetup, stages_of
from nonlinear.operating_motion import has_to_stand, operating_motion, operating_motion_at

ROUNDING = 1e-9  # of the largest current: a drive without friction takes none
WINDOW = 400  # samples of the slowest loop
CONDITION = "steady state at a constant speed, with friction"
LEVEL = "steady state at a constant speed, with friction, the load's slope and gravity left out on both sides"


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

    Notes
    -----
    A load that changes with the angle allows no constant speed: its slope and its gravity are left out of the
    bench and of the model then, so that friction is seen on such drives too.
    """
    condition = CONDITION
    if has_to_stand(design):
        design, model, condition = level(design), level(model), LEVEL
    source = not design.motor.has_electrical_dynamics
    quantity, unit = ("steady_voltage", "V") if source else ("steady_current", "A")
    name = design.controller.outermost
    try:
        motion = operating_motion(design)
    except InputError as error:
        if condition == CONDITION:
            raise
        return not_judged(name, quantity, unit, None, None, str(error), condition)
    if not motion.speed_rad_s:
        why = "the drive has no steady motion within its limits"
        return not_judged(name, quantity, unit, None, None, why, condition)
    rigs = [LoopSetup(design, stage, motion) for stage in reversed(stages_of(design))]
    setup = next((one for one in rigs if one.steady_start), None)
    if setup is None:
        why = "the position controller remembers: no run begins in its steady state"
        return not_judged(name, quantity, unit, None, None, why, condition)
    if condition == LEVEL:
        try:
            settle_ticks = max(settle_ticks, _settling_ticks(setup))
        except InputError:
            why = "without the load's slope or gravity the loop is not stable"
            return not_judged(name, quantity, unit, None, None, why, condition)
    row = setup.row()
    window = WINDOW * setup.base_ticks
    row["ticks"] = settle_ticks + 2 * window
    row.window(window, 1, 0)
    result = row.run()
    if not result.ok[0]:
        raise InputError("a run at constant speed stopped", where=design.name)
    acting = [item.words for key, item in LIMITERS.items() if result.window_limit_fraction(key)[0] > 0.0]
    if acting:
        return not_judged(name, quantity, unit, None, None, f"{acting[0]} acts", condition)
    signal = "voltage_V" if source else "current_A"
    last, before = (float(result.mean(signal, k)[0]) for k in (0, 1))
    speed = float(result.mean("motor_speed_rad_s")[0])
    wanted = operating_motion_at(model, speed, motion.load_Nm)
    predicted = wanted.voltage_V if source else wanted.current_A
    full = design.limits.voltage_V if source else full_range(design)["current"]
    seen = Reading(last, 3.0 * abs(last - before))
    least = max(ROUNDING * full, _resolution(design, speed))
    return entry(name, quantity, unit, predicted, seen, condition, least)


def _settling_ticks(setup: LoopSetup) -> int:
    """Ticks after which the slowest pole of the loops of a bench is forgotten."""
    from actuator_lti.loops import assemble_loops

    point = setup.bias.operating(setup.design)
    loops = assemble_loops(setup.design, operating_point=point.point, speed_rad_s=point.speed_rad_s)
    closed = loops.present[setup.outer].plain_closed
    return settling_ticks_of(closed, setup.hold_ticks, setup.design.name)


def _resolution(design: Design, speed_rad_s: float) -> float:
    """The current or voltage that moves the speed by one unit in its last place in a tick.

    A smaller one is lost in the sum ``w + kM i T/J`` of a heavy drive with short ticks.
    """
    motor = design.effective_motor
    gain = motor.torque_constant_Nm_A if motor.source_gain_Nm_V is None else motor.source_gain_Nm_V
    assert gain is not None
    return float(np.spacing(speed_rad_s)) * design.inertia_kgm2 / (design.controller.period_s * gain)


def level(design: Design) -> Design:
    """A drive without what its load adds over the angle: no slope, no gravity."""
    return replace(design, load=replace(design.load, moment_slope_Nm_rad=0.0, gravity=None))
