"""Relations between the keys of motor, gears, coupling, load, friction, supply and limits."""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from math import inf, isclose, log
from typing import Any

from actuator_lti.design.fields import FIELDS, axis_unit, part_at
from actuator_lti.design.mistakes import UNREAD, Check, Refusal, printed, readable
from actuator_lti.design.model import Design
from actuator_lti.design.plant import MotorConstants
from actuator_lti.design.rule import Rule, value_of
from actuator_lti.design.spellings import split_quantity

MAX_MAP_POINTS = 16  # of each direction
_KEYS = ("resistance", "inductance", "torque_constant", "back_emf_constant")
_ELECTRICAL = {key: FIELDS[f"motor.{key}"].attribute for key in _KEYS}
_TORQUE_OVER_VOLTAGE: dict[MotorConstants, tuple[float, str]] = {
    "dc": (1.0, "1"), "rms-line": (3**0.5, "sqrt(3)"), "peak-phase": (1.5, "3/2"),
}  # fmt: skip
_PER_VOLT = re.compile(r"/ ?V|\bV\^?-1|V⁻¹|KV\b")  # a speed constant, kE upside down
_NEAR = 0.025  # of the logarithm of a ratio: that convention is meant
_AC = ": see motor.constants, if it is an AC motor"
_FACTORS = {
    f"sqrt(2), rms against peak{_AC}": 2**0.5,
    f"sqrt(3), phase against line-line{_AC}": 3**0.5,
    f"sqrt(3/2), rms line-line against N m/A rms{_AC}": 1.5**0.5,
    f"sqrt(3) and sqrt(2) together, V rms of a phase against N m/A peak{_AC}": 6**0.5,
    f"3/2, dq against phase{_AC}": 1.5,
    "60/(2 pi), per rpm against per rad/s": 9.549296585513721,
    "1000, rpm against krpm or mN*m against N*m": 1e3,
    "9.549 V/krpm": 1e3 / 9.549296585513721,
}
"""The usual factors between conventions of data sheets."""
_BOTH_PEAK = 'rms-line", kM in A peak and kE in V peak'
_SHEETS: dict[str, float] = {
    **{constants: ratio for constants, (ratio, _) in _TORQUE_OVER_VOLTAGE.items()},
    'rms-line", kM in A peak or kE in V peak': 1.5**0.5,
    _BOTH_PEAK: 0.75**0.5,
}
"""kM over kE in SI, by what motor.constants and units say of amperes and volts."""


def check_motor(design: Design) -> Iterator[Refusal]:
    """R, L, kM and kE together or none of them, and kE as kM has it."""
    motor = design.motor
    given = {key: getattr(motor, attribute) for key, attribute in _ELECTRICAL.items()}
    if motor.source_gain_Nm_V is not None:
        for key, value in given.items():
            if value is not None:
                yield f"motor.{key}", value, "not allowed beside motor.source_gain"
        return
    for key, value in given.items():
        taken = key == "back_emf_constant" and "motor.constants" in design.written
        if value is None and not (taken and given["torque_constant"] is not None):
            words = "R, L, kM and kE together, or motor.source_gain alone"
            yield f"motor.{key}", "", f"missing; allowed: {words}{_without(key, design)}"
    kM, kE = _constants(design)
    if given["back_emf_constant"] is not None and kM is not None and _apart(kM, kE):
        key, wanted = "back_emf_constant", given["back_emf_constant"] * kM / kE
        over = _TORQUE_OVER_VOLTAGE[design.motor.constants][1]
        same = f'with motor.constants = "{design.motor.constants}" kE is kM over {over} in SI'
        same = "in SI the two are one constant" if over == "1" else same
        wanted = f"{wanted:g} {axis_unit(design.axis, f'motor.{key}')}{_as_written(design, key, kM / kE)}"
        held = f"motor.torque_constant = {_stated(design, 'torque_constant')}"
        allowed = f"allowed: within 10 % of {wanted}, as {held} has it ({same})"
        causes = f"{_ratio(design, kE / kM)}{_warm(design, kM / kE)}"
        yield f"motor.{key}", _stated(design, key), f"{allowed}{causes}"


def _constants(design: Design) -> tuple[Any, Any]:
    same = design.effective_motor
    return same.torque_constant_Nm_A, same.back_emf_constant_Vs_rad


def _apart(kM: Any, kE: Any) -> Any:
    return abs(kE - kM) > 0.1 * kM * (1 + 1e-12)


def _warm(design: Design, ratio: Any) -> str:
    if not 0.8 <= ratio <= 0.95:
        return ""
    key = "torque_constant"
    kM = f"{design.motor.torque_constant_Nm_A / ratio:g} {axis_unit(design.axis, f'motor.{key}')}"
    kM += _as_written(design, key, 1.0 / ratio)
    taken = f"take one and write the other as it follows, kE as said or kM = {kM}"
    return f"; sheets give kM warm or saturated and kE cold (0.8 to 0.95 of it, here {ratio:.3g}): {taken}"


def _ratio(design: Design, off: Any) -> str:
    """What would explain the ratio of kM to kE: a convention that is not the stated one, or a factor."""
    sheets = dict(_SHEETS)
    motor: Any = design.motor
    stated = motor.torque_constant_Nm_A / motor.back_emf_constant_Vs_rad
    if _PER_VOLT.search(_number_written(design, "back_emf_constant")[1]):  # KV is line-line, whatever else
        sheets["peak-phase"] = sheets.pop(_BOTH_PEAK)
        stated /= 3**0.5 if motor.constants == "peak-phase" else 1.0
    near = {words: abs(log(stated / ratio)) for words, ratio in sheets.items() if words != motor.constants}
    words = min(near, key=near.__getitem__)
    if near[words] < _NEAR:
        constants, _, how = words.partition('", ')
        named = f'motor.constants = "{constants}"' if constants != motor.constants else ""
        return f"; the ratio is that of {', '.join(filter(None, (named, how)))}"
    factors = {words: abs(abs(log(off)) - log(factor)) for words, factor in _FACTORS.items()}
    words = min(factors, key=factors.__getitem__)
    return f"; the ratio is {words}" if factors[words] < (0.05 if _AC in words else 0.08) else ""


def with_stand_ins(design: Design) -> Design:
    """The design past what `check_motor` refuses: kE as kM has it, under constants by which both agree."""
    motor, given = design.motor, {name: getattr(design.motor, name) for name in _ELECTRICAL.values()}
    if motor.source_gain_Nm_V is not None:
        return design if all(value is None for value in given.values()) else replace(design, motor=UNREAD)
    motor = replace(motor, **{name: UNREAD for name, value in given.items() if value is None})
    kM: Any = motor.torque_constant_Nm_A
    kE: Any = motor.back_emf_constant_Vs_rad
    ways = [] if kE is UNREAD else [motor, *(replace(motor, constants=one) for one in _TORQUE_OVER_VOLTAGE)]
    for way in (replace(design, motor=one) for one in ways):
        if kM is UNREAD or not _apart(*_constants(way)):
            return way
    usual = kM / _TORQUE_OVER_VOLTAGE[motor.constants][0]
    least = usual if kE is UNREAD else min(kE, usual)  # kM may be the wrong one: no speed is refused for it
    return replace(design, motor=replace(motor, back_emf_constant_Vs_rad=least))


def _stated(design: Design, key: str) -> str:
    value = getattr(design.motor, _ELECTRICAL[key])
    return f"{value:g} {axis_unit(design.axis, f'motor.{key}')}{_as_written(design, key, 1.0)}"


def _as_written(design: Design, key: str, times: float) -> str:
    """So many times a constant in the unit of its file, in brackets; nothing where that is the SI one."""
    number, unit = _number_written(design, key)
    if not unit or isclose(number, getattr(design.motor, _ELECTRICAL[key]), rel_tol=1e-4):
        return ""
    return f" ({number * (1.0 / times if _PER_VOLT.search(unit) else times):.4g} {unit})"


def _number_written(design: Design, key: str) -> tuple[float, str]:
    """Number and unit of a constant in the file; no unit where it has none."""
    item = design.parameters.get(f"motor.{key}")
    same = item is not None and item.value == getattr(design.motor, _ELECTRICAL[key])
    return split_quantity(item.text) if item is not None and same else (0.0, "")


def _without(key: str, design: Design) -> str:
    if key == "inductance":
        small = "0.1 to 1 ms of a small motor"
        return f"; where the sheet has none, R times the electrical time constant, {small}"
    if same := as_one_constant(key, design):
        return f"; {'taken if motor.constants is stated: ' * (key == 'back_emf_constant')}{same}"
    return ""


def as_one_constant(key: str, design: Design) -> str:
    """What kM or kE has to be by the other one; empty where that is not given."""
    other = {"torque_constant": "back_emf_constant", "back_emf_constant": "torque_constant"}.get(key)
    held = getattr(design.motor, _ELECTRICAL[other]) if other else None
    if held is None or held is UNREAD:
        return ""
    torque, (ratio, words) = key == "torque_constant", _TORQUE_OVER_VOLTAGE[design.motor.constants]
    same = f"with these motor.constants it is motor.{other} {'times' if torque else 'over'} {words}"
    same = f"of a DC motor it is the number of motor.{other}" if words == "1" else same
    p, axis = 1.0, design.axis
    if design.screw is not None:  # constants of the motor's own shaft
        p, axis = design.screw.travel_m_rad, "rotary"
    number = held * p * (ratio if torque else 1.0 / ratio)
    return f"{same} in SI, {number:g} {axis_unit(axis, f'motor.{key}')}"


def check_temperature(design: Design) -> Iterator[Refusal]:
    if (heat := design.temperature) is not None:
        yield from readable(_hot(heat, "winding", "resistance_per_K"))
        yield from readable(_hot(heat, "magnet", "magnet_per_K"))


def _hot(heat: Any, key: str, per_K: str) -> Iterator[Refusal]:
    value = getattr(heat, f"{key}_degC")
    if 1.0 + getattr(heat, per_K) * (value - heat.reference_degC) < 0.05:
        yield f"temperature.{key}", f"{value:g} degC", "R, kM and kE must keep 5 % of their value"


def check_place(design: Design) -> Iterator[Refusal]:
    """Names of gears that are none; whatever asks for an inertia needs the coupling's place."""
    for path, attribute in (("coupling", "after"), ("load", "locking_gear")):
        yield from readable(_no_gear(design, path, attribute))


def _no_gear(design: Design, path: str, attribute: str) -> Iterator[Refusal]:
    name, names = getattr(part_at(design, path), attribute, None), [gear.name for gear in design.gears]
    if name is not None and name not in names:
        known = ", ".join(names) or "none, as there are no gears; leave it out"
        yield f"{path}.{attribute}", printed(name), f"is no gear; allowed: {known}"


def _locking(design: Design) -> Iterator[Refusal]:
    """A self-locking stage behind the coupling, or whose friction would give energy."""
    coupling, locking = design.coupling, design.load.locking_gear
    if coupling is None or design.load.path != "self-locking":
        return
    names = [gear.name for gear in design.gears]
    locks = names.index(locking) + 1 if locking else len(names)
    least, coefficient = 1.0 / design.total_ratio, design.friction.load_coefficient
    drivable = 'or load.path = "back-drivable"'  # the default locks itself
    if design.gears_before_coupling < locks:
        behind = ", ".join(f"{name}" for name in names[locks - 1 :])  # stops at one that could not be read
        ways = f"{behind}, load.locking_gear with a gear before the coupling, {drivable}"
        given = f'"{coupling.after or ""}"'
        yield "coupling.after", given, f"lies before the self-locking stage; allowed: {ways}"
    elif coefficient < least * (1 - 1e-12):
        reason = "a self-locking stage with less than 1/N gives energy"
        allowed = f"{reason}; allowed: at least {least:g}, {drivable}"
        yield "friction.load_coefficient", f"{coefficient:g}", allowed


_BENDS = (("torque_1", "stiffness_2"), ("torque_2", "stiffness_3"))


def _unsaid(path: str, design: Design) -> bool:
    return value_of(design, path) is None


def _friction_points(design: Design) -> Iterator[Refusal]:
    for name, direction in (("forward", 1), ("reverse", -1)) if design.friction.points else ():
        points = design.friction.map(direction)
        speeds, torques = [point.speed_rad_s for point in points], [point.torque_Nm for point in points]
        if not speeds or speeds[0] != 0.0:
            yield "friction.point", name, "allowed: the first point at speed 0"
        if any(speed in speeds[:k] for k, speed in enumerate(speeds)):
            yield "friction.point", name, "allowed: each speed once"
        if len(speeds) > MAX_MAP_POINTS:
            yield "friction.point", f"{len(speeds)} points", f"allowed: at most {MAX_MAP_POINTS}"
        if len(torques) > 1 and torques[-1] < torques[-2]:
            yield "friction.point", name, "allowed: not falling at the end, as the last slope continues"


FIRST_RELATIONS: tuple[Check, ...] = (check_place, check_temperature, check_motor)
"""Those whose refusals leave an inertia or the motor's constants open."""
_SOURCE = "not allowed with motor.source_gain, which "
PLANT_CHECKS: tuple[Check, ...] = (
    Rule("control.current", f"{_SOURCE}has no current", lambda d: not d.motor.has_electrical_dynamics),
    Rule("supply", f"{_SOURCE}draws no current", lambda d: not d.motor.has_electrical_dynamics),
    Rule("temperature", f"{_SOURCE}has no winding", lambda d: not d.motor.has_electrical_dynamics),
    Rule("limits.peak_time", "needs a current loop, [control.current]",
         lambda d: d.controller.current is None),
    Rule("limits.peak_time", "needs limits.peak_current and limits.continuous_current",
         lambda d: inf in (d.limits.peak_current_A, d.limits.continuous_current_A)),
    Rule("limits.peak_time", "allowed: with peak_current above continuous_current",
         lambda d: d.limits.peak_current_A <= d.limits.continuous_current_A < inf),
    Rule("supply.brake_voltage", "allowed: at least limits.voltage = {d.limits.voltage_V:g} V",
         lambda d: d.supply.brake_voltage_V < d.limits.voltage_V),
    Rule("supply.capacitance", "allowed with regenerative = false", lambda d: d.supply.regenerative),
    Rule("supply.brake_voltage", "allowed with regenerative = false", lambda d: d.supply.regenerative),
    Rule("supply.regenerative", "needs supply.capacitance, which takes the energy",
         lambda d: d.supply.capacitance_F is None),
    Rule("load.gravity", "allowed on a rotary axis; a linear one takes a constant load",
         lambda d: d.axis == "linear"),
    Rule("friction.dry_torque", "not allowed beside friction.point", lambda d: d.friction.points),
    Rule("friction.viscous", "not allowed beside friction.point", lambda d: d.friction.points),
    Rule("friction.law", 'allowed with friction.point: "coulomb"', lambda d: d.friction.points),
    _friction_points,
    Rule("load.friction", "allowed behind a coupling; a rigid drive has friction alone",
         lambda d: d.coupling is None),
    Rule("coupling.stiffness",
         "allowed with an inertia behind it; load.inertia, or that of a gear behind it, is missing",
         lambda d: d.load_side_inertia_kgm2 <= 0.0),
    *(Rule(f"coupling.{one}", f"allowed with coupling.{other} beside it",
           partial(_unsaid, f"coupling.{other}")) for pair in _BENDS for one, other in (pair, pair[::-1])),
    Rule("coupling.torque_2", "allowed: with coupling.torque_1", partial(_unsaid, "coupling.torque_1")),
    Rule("coupling.torque_2", "allowed: above coupling.torque_1",
         lambda d: d.coupling.torque_1_Nm is not None and d.coupling.torque_1_Nm >= d.coupling.torque_2_Nm),
    Rule("friction.law", 'allowed with a coupling: "coulomb"', lambda d: d.coupling is not None),
    Rule("load.locking_gear", 'allowed with load.path = "self-locking"',
         lambda d: d.coupling is not None and d.load.path != "self-locking"),
    _locking,
    Rule("limits.continuous_current", "allowed: at most limits.peak_current = {d.limits.peak_current_A:g} A",
         lambda d: d.limits.peak_current_A < d.limits.continuous_current_A < inf),
)  # fmt: skip
"""Each gives the settings that contradict each other: key, value, what is allowed."""
