"""The recorded voltage against R i + kE w: signs, columns, and what R counts."""

from dataclasses import replace
from math import isfinite

import numpy as np

from actuator_lti.design.model import Design
from analyses.estimation.parameters import own_share
from analyses.records.compared import LEAST_ROWS, bounds, inner, place_of, ratio_of, smooth, thinned
from analyses.records.factors import with_factor
from analyses.records.finding import SURE, Finding
from analyses.records.rate import one_phase
from analyses.records.record import Record

ONE_PHASE = (
    "not told: every sample is at the same tick of a loop that runs every so many, or of a command held from "
    "row to row, where the voltage kicks; between them it is not known, nor whether R or the scale of the "
    "current is off"
)
COPPER_1_K = 3.93e-3
WINDING_K = (-75.0, 160.0)  # from 20 deg C, the coldest and hottest winding: -55 to 180 deg C, class H


def voltage_finding(doubt: float, design: Design, record: Record) -> Finding | None:
    """Voltage, current and motion through R, L and kE, at the accuracy of the signals and of the design.

    ``doubt`` is the share by which the clock may be off.
    """
    if not (finding := _voltage_says(design, record, doubt)):
        return None
    (passed, words), u, i = finding, record["voltage"], record["current"]
    for cause, changed in (
        ("the sign of the current is reversed", {"current": -i}),
        ("the sign of the voltage is reversed", {"voltage": -u}),
        ("the sign of the speed is reversed", {"voltage": -u, "current": -i}),
        ("the columns of current and voltage are swapped", {"voltage": i, "current": u}),
    ):
        other = replace(record, signals={**record.signals, **changed})
        if passed is False and (instead := _voltage_says(design, other, doubt)) and instead[0] is not False:
            return Finding("voltage against R i + kE w", False, f"{words}: {cause}")
    if passed is None and (stands := _standing_current(design, record)):
        passed, words = False, stands
    elif passed is not True and one_phase(design, record):
        return Finding("voltage against R i + kE w", None, f"{words}; {ONE_PHASE}", unproven=True)
    return Finding("voltage against R i + kE w", passed, words)


def _voltage_says(design: Design, record: Record, doubt: float) -> tuple[bool | None, str] | None:
    """Whether each part of the voltage counts once, and in words; None where nothing tells."""
    parts = _electrical_parts(design, record).items()
    findings = [_counted(design, name, *ends, doubt if name == "kE w" else 0.0) for name, ends in parts]
    each = [one for one, _ in findings]
    passed = False if False in each else None if None in each else True
    return (passed, "; ".join(words for _, words in findings)) if findings else None


def _electrical_parts(design: Design, record: Record) -> dict[str, tuple[float, float]]:
    """What R i and kE w count in a recorded voltage, each by its least and largest ratio to the design's.

    Where the record does not tell one from the other, their sum; empty without voltage, current and motion.
    """
    motor = design.effective_motor
    ohm, back = motor.resistance_ohm, motor.back_emf_constant_Vs_rad
    speed, place = record.signals.get("speed"), place_of(design, record)
    if speed is None and place is not None:
        speed = np.gradient(place[1], record.time_s)
    if ohm is None or back is None or speed is None or not {"voltage", "current"} <= record.signals.keys():
        return {}
    u, i, w = (smooth(record, values) for values in (record["voltage"], record["current"], speed))
    if motor.inductance_H is not None:  # of a direct drive as large as the rest
        u = u - motor.inductance_H * np.gradient(i, record.period_s)
    u, i, w, late = (thinned(record, one[inner(record)]) for one in (u, i, w, np.gradient(w)))
    parts = np.column_stack([ohm * i, back * w])
    size, total = np.linalg.norm(parts, axis=0), parts.sum(axis=1)
    if len(u) < LEAST_ROWS or not np.any(total):
        return {}
    if np.all(size > 0.03 * np.linalg.norm(u)) and np.linalg.cond(parts / size) < 100.0:
        r, e = parts.T
        moved = np.column_stack([e, late])  # a filtered speed lacks what goes with the current's torque
        return {"R i": bounds(u, r, moved, moved), "kE w": bounds(u, e, r, r)}
    return {"R i + kE w": bounds(u, total, np.gradient(total), np.gradient(u))}


def _counted(
    design: Design, name: str, low: float, high: float, doubt: float = 0.0
) -> tuple[bool | None, str]:
    """Whether a part of the voltage counts once, within what its data and the design's tolerance leave.

    ``doubt`` is the share by which the clock may be off.
    """
    if not isfinite(low):
        return None, f"{name} is not determined"
    key = "motor.back_emf_constant" if name == "kE w" else "motor.resistance"
    allowed, motor = SURE * own_share(design, key) + doubt, design.effective_motor
    if low <= 1.0 + allowed and high >= 1.0 - allowed:
        return True, f"{name} is {low:.3g} to {high:.3g} times as the design has it"
    ohm, back = motor.resistance_ohm or 0.0, motor.back_emf_constant_Vs_rad or 0.0
    held = {"R i": f" that of R = {ohm:.4g} ohm", "kE w": f" that of kE = {back:.4g} V s/rad"}
    text = f"{name} counts {low:.3g} to {high:.3g} times{held.get(name, '')}"
    ratio = 0.5 * (low + high)
    kelvin = (ratio - 1.0) / COPPER_1_K
    warm = name == "R i" and WINDING_K[0] < kelvin < WINDING_K[1]
    if warm:
        text += f": a winding {kelvin:+.0f} K from the design's, "
        text += f"or a current {1.0 / ratio:.3g} times the real"
    return (None if warm else False), with_factor(text, 1.0 / ratio if ratio > 0.0 else 0.0)


def _standing_current(design: Design, record: Record) -> str:
    """A current of one value throughout, where the voltage less kE w says that it moves as much; or empty."""
    at, speed = record["current"], record.signals.get("speed")
    if np.ptp(at) or not at[0] or speed is None or not np.any(speed) or design.motor.resistance_ohm is None:
        return ""
    u, w = (smooth(record, values - values.mean()) for values in (record["voltage"], speed))
    moves = float(np.std(u - ratio_of(u, w)[0] * w)) / design.motor.resistance_ohm
    why = f"the current is {at[0]:.4g} A throughout, the voltage says that it moves by {moves:.2g} A rms"
    return why if moves > 0.5 * abs(at[0]) else ""


def resistance_doubt(design: Design, record: Record) -> float:
    """The share by which a current may be too small, where R counts other than the design's tolerance allows.

    A warmer winding or a wrong scale of the current: the record cannot tell.
    """
    if one_phase(design, record):
        return 0.0
    low, high = _electrical_parts(design, record).get("R i", (1.0, 1.0))
    agrees = not isfinite(low) or _counted(design, "R i", low, high)[0] is True
    return 0.0 if agrees else 0.5 * (low + high) - 1.0
