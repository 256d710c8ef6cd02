"""The torque at which a standing drive breaks away: a ramp of torque at the motor, its controllers silent.

No other check sees the breakaway ratio, which acts at rest alone (model.md section 6).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.facts import breakaway_torque_Nm
from analyses.validation.ledger import Entry, entry, not_judged
from analyses.validation.reading import Reading
from nonlinear import Rows
from nonlinear.loop_setup import GAINS

TICKS = 2000  # of a ramp
WIDE, NEAR = (0.0, 4.0), (0.99, 1.01)  # of the design's own torque, then of what was found
CONDITION = "at rest, torque ramp at the motor"


def breakaway_entry(design: Design, model: Design) -> Entry | None:
    """The static friction that ``model`` foresees, beside the torque at which the simulated drive starts.

    Returns
    -------
    Entry or None
        ``None``: no dry friction, nothing to break away from.
    """
    friction, name = design.friction, design.controller.outermost
    if friction.dry_Nm(0.0) == 0.0 and not friction.points:
        return None
    condition = CONDITION
    if design.load.gravity is not None:  # which pulls at rest: friction is what is asked for
        condition = f"{CONDITION}, without the load's weight"
        design, model = (replace(one, load=replace(one.load, gravity=None)) for one in (design, model))
    reason = _not_comparable(design)
    if reason:
        return not_judged(name, "breakaway_torque", "N*m", None, None, reason, condition)
    scale = float(breakaway_torque_Nm(_relaxed(design), 0.0, 1))
    low, high = _started(design, WIDE[0] * scale, WIDE[1] * scale)
    if high is not None:
        middle = 0.5 * (low + high)
        low, high = _started(design, NEAR[0] * middle, NEAR[1] * middle)
    predicted = float(breakaway_torque_Nm(_relaxed(model), 0.0, 1))
    found = Reading(None) if high is None else Reading(0.5 * (low + high), 0.5 * (high - low))
    return entry(name, "breakaway_torque", "N*m", predicted, found, condition)


def _not_comparable(design: Design) -> str:
    """Why a ramp of torque does not show the static friction; empty where it does."""
    if design.friction.law == "tanh":
        return "the tanh law has no friction at rest"
    behind = design.load.friction if design.coupling is not None else None
    free = behind is not None and abs(behind.offset_torque_Nm) > behind.dry_torque_Nm
    motor = _relaxed(design)
    if free or breakaway_torque_Nm(motor, 0.0, 1) == 0.0 or breakaway_torque_Nm(motor, 0.0, -1) == 0.0:
        return "the offset torque moves the drive by itself"
    return ""


def _relaxed(design: Design) -> Design:
    """What a motor at rest at zero feels: before a coupling that is not wound up, itself alone."""
    if design.coupling is None:
        return design
    return replace(design, coupling=None, load=replace(design.load, friction=None, gravity=None))


def _started(design: Design, low: float, high: float) -> tuple[float, float | None]:
    """Torques of the last tick at rest and the first in motion; None: it never starts."""
    row = Rows.of(design)
    for places in GAINS.values():
        for place in places:
            row[place] = 0.0
    ramp = np.linspace(low, high, TICKS)
    row["torque_table"], row["torque_table_length"] = row.tables.add(ramp)
    row["ticks"] = TICKS
    moved = np.flatnonzero(row.trajectory().motor_speed_rad_s)
    if not moved.size:
        return high, None
    k = int(moved[0])  # the speed at a tick's start: it was the torque of the one before
    return float(ramp[max(k - 2, 0)]), float(ramp[max(k - 1, 0)])
