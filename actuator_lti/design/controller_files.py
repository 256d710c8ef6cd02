"""A controller's own settings file as the controller section of a design: one declaration a format.

Where a maker counts amperes as the peak of a phase (ODrive, VESC, SimpleFOC: field-oriented control with an
amplitude-invariant Clarke transform), i = sqrt(3)/2 I_peak and u = sqrt(3) U_peak of the equivalent DC motor
(model.md section 1), and a gain in V/A is doubled.

Periods: EPOS4 25 kHz and 2.5 kHz (EPOS4 50/5 Hardware Reference, maxon, 2023-07, rel11726, section 2.1).
ODrive 3: a clock of 168 MHz over 2 * 3500 counts and 3 repetitions, 8 kHz; its speed comes from a critically
damped tracking loop (1000 rad/s where the file names no bandwidth), its current gains from a bandwidth:
p = w L, i = w R (firmware: main.h, encoder.cpp, motor.cpp). Its position controller is a P alone
(controller.cpp). VESC and SimpleFOC fix no period here.

VESC: lo_current_max = l_current_max l_current_max_scale (mc_interface.c); the speed loop's output is taken
times that and the scale once more (foc_math.c, firmware 5.3 and later). SimpleFOC: U = R I of a phase where
the motor has its resistance, and with a KV the back-EMF besides, up to 2.3 by voltage (BLDCMotor.cpp), from
2.4 by estimated_current (FOCMotor.cpp). Its voltage_limit is the amplitude of a phase, 12 V where nothing is
set, as is the supply; the driver keeps each phase between 0 and its own limit (defaults.h, FOCMotor.cpp,
BLDCDriver3PWM.cpp). An output_ramp of 0 is none (pid.cpp); I and D of P_angle are 0 where nothing is set.

No object of an EPOS4's export is a filter of its D part: derivative_filter stays as it is.
"""

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial, reduce
from math import inf, isfinite, nan, pi, sqrt
from operator import mul
from pathlib import Path
from typing import Any, Literal

from actuator_lti.design.fields import FIELDS, parts_of
from actuator_lti.design.model import Design
from actuator_lti.design.objects import Imported
from actuator_lti.design.settings_file import parsed_xml, placed
from actuator_lti.design.spellings import split_quantity
from actuator_lti.design.units import si_text
from actuator_lti.design.writing import with_overrides
from actuator_lti.errors import InputError, Mistakes, as_one, in_file
from actuator_lti.files.reading import Tree, parse_json, read_text, shown, shown_path

Stage = Literal["velocity", "-velocity", "current", "-current"]
Value = float | Callable[..., float]
A_dc, V_dc, TURN, RPM = sqrt(3.0) / 2.0, sqrt(3.0), 2.0 * pi, 2.0 * pi / 60.0
_DCF = re.compile(
    r"(?im)^[ \t]*(?:\[([0-9A-F]{4})(?:sub([0-9A-F]{1,2}))?\]|(Parameter|Default)Value[ \t]*=[ \t]*(\S+))"
)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?(?:\*/|\Z)", re.S)
_ASSIGNED = re.compile(r"(?:^|(?<=;))[ \t]*(\w+)\.([\w.]+)\s*=\s*([^;\n]+);", re.M)
_BUILT = re.compile(r"\bBLDCMotor\s+(\w+)\s*(?:=\s*BLDCMotor\s*)?\(([^)]*)\)")
_ARGUMENTS = ("pole_pairs", "phase_resistance", "KV_rating", "phase_inductance")
_NO_FILTER = {"control.velocity.filter": None}  # no more than the measured speed's own
_PLAIN_POSITION = {"control.position.friction_feedforward": None, "control.position.derivative_filter": None}


class Setting:
    """One key of a design: a factor on one number of the file, or ``value`` of several, in the unit."""

    def __init__(
        self, key: str, unit: str, value: Value, *names: str, when: Stage | None = None, said: str = ""
    ) -> None:
        self.key, self.unit, self.names, self.when, self.said = key, unit, names, when, said
        self.of = value if callable(value) else partial(mul, value)


def _holds(when: Stage | None, design: Design) -> bool:
    """Whether a design has the stages that are asked for: ``"-velocity"`` is one without a velocity loop."""
    return not when or (when.strip("-") in design.controller.stages) != when.startswith("-")


@dataclass(frozen=True)
class Format:
    """A kind of file: how it is known and read, what its numbers are, and what every such controller does."""

    words: str
    known: re.Pattern[str]
    read: Callable[[str, str], Tree]
    settings: tuple[Setting, ...]
    fixed: Mapping[str, Any] = field(default_factory=dict)  # None: no such controller has it
    unfit: Callable[[Tree, Design], str] = lambda given, design: ""
    also: Mapping[str, tuple[Stage | None, str]] = field(default_factory=dict)
    """Names that are understood without a key, each with what there is to say of it, and when."""
    off: tuple[str, ...] = ()
    """Names without a key that are understood where they are 0: what they switch is off."""
    newer: Mapping[str, str] = field(default_factory=dict)
    """Parts of names of newer firmware, each with the older one that the settings are listed by."""
    assumed: Mapping[str, float] = field(default_factory=dict)  # numbers where the file has none


def _ratio(above: float, below: float) -> float:
    return above / below if below else above * inf


def _flat(tree: Any, prefix: str = "") -> Tree:
    result: Tree = {}
    for key, value in tree.items():
        result |= _flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return result


def _canopen(text: str, where: str) -> Tree:
    """Values, else defaults, of a device configuration by ``0x30A0.01``: CiA 306 (.dcf), CiA 311 (.xdc)."""
    if text.lstrip().startswith("<"):
        objects = ((place.label, one.get("actualValue") or one.get("defaultValue") or "")
                   for place, one in placed(parsed_xml(text)))  # fmt: skip
        return {label: _whole(value) for label, value in objects if value}
    found, label = {}, ""
    for index, sub, kind, value in _DCF.findall(text):
        label = f"0x{index.upper()}.{int(sub or '0', 16):02X}" if index else label
        if kind and label and (kind.lower() == "parameter" or label not in found):
            found[label] = _whole(value)
    return found


def _whole(value: str) -> Any:
    return int(value, 16) if re.fullmatch("0x[0-9A-Fa-f]{1,16}", value) else value


def _sketch(text: str, where: str) -> Tree:
    text = _COMMENT.sub("", text)
    built, assigned = dict(_BUILT.findall(text)), _ASSIGNED.findall(text)
    motors = sorted({*built, *(owner for owner, name, _ in assigned if "." in name)})
    if len(motors) > 1:
        raise InputError(f"sets several motors: {', '.join(motors)}; allowed: the lines of one of them")
    made = zip(_ARGUMENTS, ",".join(built.values()).split(","), strict=False)
    named = ((name if owner in motors or name != "voltage_limit" else f"driver.{name}", value)
             for owner, name, value in assigned)  # fmt: skip
    found = {name: value.strip().rstrip("fF") for name, value in [*made, *named]}
    return {name: value for name, value in found.items() if value not in ("", "NOT_SET")}


def _torque_mode(given: Tree, design: Design) -> str:
    by_current = str(given.get("torque_controller")).endswith(("foc_current", "dc_current"))
    if by_current == (design.controller.current is not None):
        return ""
    kind, there = ("current", "with") if by_current else ("voltage", "without")
    return f"its torque control is by {kind}; allowed: a design {there} [control.current]"


def _motor_type(given: Tree, design: Design) -> str:
    kind = given.get(_TYPE, 0)
    said = f"{_TYPE} = {shown(kind)}: allowed: 0, a motor whose torque is controlled by current"
    return said if kind else ""


_AXIS, _MOTOR, _LOOP = "axis0.encoder.config.", "axis0.motor.config.", "axis0.controller.config."
_TYPE = _MOTOR + "motor_type"
FORMATS = (
    Format(
        "ODrive configuration", re.compile(r"\A\s*\{.*axis0", re.S),
        lambda text, where: _flat(parse_json(text, where, float)),
        (
            Setting("control.position.gain", "1/s", 1.0, _LOOP + "pos_gain"),
            Setting("control.velocity.gain", "A*s/rad", lambda gain, kM: A_dc * _ratio(gain, TURN * kM),
                  _LOOP + "vel_gain", _MOTOR + "torque_constant"),
            Setting("control.velocity.integral_time", "s", _ratio, _LOOP + "vel_gain",
                  _LOOP + "vel_integrator_gain"),
            Setting("control.current.gain", "V/A", lambda bandwidth, L: 2.0 * bandwidth * L,
                  _MOTOR + "current_control_bandwidth", _MOTOR + "phase_inductance"),
            Setting("control.current.integral_time", "s", _ratio, _MOTOR + "phase_inductance",
                  _MOTOR + "phase_resistance"),
            Setting("limits.peak_current", "A", A_dc, _MOTOR + "current_lim"),
            Setting("limits.speed", "rad/s", TURN, _LOOP + "vel_limit"),
            Setting("encoder.counts_per_rev", "1", 1.0, _AXIS + "cpr"),
            Setting("encoder.bandwidth", "rad/s", 1.0, _AXIS + "bandwidth"),
        ),
        {"control.period": "125 us", "control.velocity.every": 1, "control.position.every": 1,
         "encoder.speed": "tracking", "encoder.bandwidth": "1000 rad/s",
         "encoder.filter_time": None, "control.position.integral_time": None,
         "control.position.derivative_time": None, **_PLAIN_POSITION, **_NO_FILTER},
        _motor_type, {_TYPE: (None, "")},
        newer={"axis0.config.motor.": _MOTOR, "current_soft_max": "current_lim",
               "axis0.config.encoder_bandwidth": _AXIS + "bandwidth",
               "inc_encoder0.config.cpr": _AXIS + "cpr"},
    ),
    Format(
        "VESC motor configuration", re.compile(r"<MCConfiguration"),
        lambda text, where: {str(item.tag): item.text for item in parsed_xml(text).iter() if not len(item)},
        (
            Setting("control.current.gain", "V/A", 2.0, "foc_current_kp"),
            Setting("control.current.integral_time", "s", _ratio, "foc_current_kp", "foc_current_ki"),
            Setting("control.velocity.gain", "A*s/rad",
                  lambda gain, peak, scale, poles: A_dc * peak * scale**2 * gain / 20.0 * (poles / 2.0) / RPM,
                  "s_pid_kp", "l_current_max", "l_current_max_scale", "si_motor_poles"),
            Setting("control.velocity.integral_time", "s", _ratio, "s_pid_kp", "s_pid_ki"),
            Setting("limits.peak_current", "A", lambda peak, scale: A_dc * peak * scale, "l_current_max",
                  "l_current_max_scale"),
            Setting("limits.speed", "rad/s", lambda rpm, poles: _ratio(rpm * RPM, poles / 2.0),
                  "l_max_erpm", "si_motor_poles"),
        ),
        _NO_FILTER, assumed={"l_current_max_scale": 1.0},
    ),
    Format(
        "EPOS4 object export", re.compile(r'^\s*\[30A0sub1\]|index="(0x)?30A0"', re.I | re.M), _canopen,
        (
            Setting("control.current.gain", "V/A", 1e-6, "0x30A0.01"),
            Setting("control.current.integral_time", "s", lambda above, below: 1e-3 * _ratio(above, below),
                  "0x30A0.01", "0x30A0.02"),
            Setting("control.velocity.gain", "A*s/rad", 1e-6, "0x30A2.01", when="velocity"),
            Setting("control.velocity.integral_time", "s", _ratio, "0x30A2.01", "0x30A2.02", when="velocity"),
            Setting("control.position.gain", "A/rad", 1e-6, "0x30A1.01", when="-velocity"),
            Setting("control.position.integral_time", "s", _ratio, "0x30A1.01", "0x30A1.02",
                    when="-velocity"),
            Setting("control.position.derivative_time", "s", _ratio, "0x30A1.03", "0x30A1.01",
                    when="-velocity", said="the export has no filter of it: "
                    "control.position.derivative_filter stays as it is"),
            Setting("limits.continuous_current", "A", 1e-3, "0x3001.01"),
            Setting("limits.peak_current", "A", 1e-3, "0x3001.02"),
            Setting("limits.speed", "rad/s", RPM, "0x6080.00"),
        ),
        {"control.period": "40 us", "control.velocity.every": 10, "control.position.every": 10},
        lambda given, design: "" if {"velocity", "position"} - {*design.controller.stages} else
        "an EPOS4 has no velocity loop inside its position loop; allowed: a design without one of the two",
        off=("0x30A1.04", "0x30A1.05", "0x30A2.03", "0x30A2.04"),  # feed-forward of speed and acceleration
    ),
    Format(
        "SimpleFOC settings", re.compile(r"\.(PID_velocity|P_angle|PID_current_q)\."), _sketch,
        (
            Setting("control.position.gain", "1/s", 1.0, "P_angle.P"),
            Setting("control.position.integral_time", "s", _ratio, "P_angle.P", "P_angle.I"),
            Setting("control.position.derivative_time", "s", _ratio, "P_angle.D", "P_angle.P"),
            Setting("control.velocity.gain", "A*s/rad", A_dc, "PID_velocity.P", when="current"),
            Setting("control.velocity.gain", "V*s/rad", lambda gain, R: V_dc * gain * R, "PID_velocity.P",
                  "phase_resistance", when="-current"),
            Setting("control.velocity.integral_time", "s", _ratio, "PID_velocity.P", "PID_velocity.I"),
            Setting("control.current.gain", "V/A", 2.0, "PID_current_q.P", when="current"),
            Setting("control.current.integral_time", "s", _ratio, "PID_current_q.P", "PID_current_q.I",
                  when="current"),
            Setting("encoder.filter_time", "s", 1.0, "LPF_velocity.Tf"),
            Setting("limits.peak_current", "A", A_dc, "current_limit", when="current"),
            Setting("limits.current_rate", "A/s", lambda ramp: A_dc * ramp or inf,
                  "PID_velocity.output_ramp", when="current"),
            Setting("limits.voltage", "V", lambda phase, *line: min(V_dc * phase, *line), "voltage_limit",
                  "voltage_power_supply", "driver.voltage_limit"),
            Setting("limits.speed", "rad/s", 1.0, "velocity_limit"),
        ),
        {**_PLAIN_POSITION, **_NO_FILTER}, _torque_mode,
        {"torque_controller": (None, ""), "pole_pairs": (None, ""),
         "phase_resistance": ("-current", "by voltage the gain is taken times it, as by the library up to "
         "2.3; from 2.4 on that is right by estimated_current only"),
         "KV_rating": ("-current", "by voltage the library adds the back-EMF, which a design without "
         "[control.current] has no key for: not carried over"),
         "LPF_current_q.Tf": ("current", "the filter of the measured current has no key in a design: not "
         "carried over")},
        assumed={"P_angle.I": 0.0, "P_angle.D": 0.0, "phase_resistance": 1.0, "voltage_limit": 12.0,
                 "voltage_power_supply": 12.0, "driver.voltage_limit": inf},
        off=("PID_velocity.D", "PID_current_q.D", "PID_current_q.output_ramp"),
    ),
)  # fmt: skip


def import_controller_file(path: Path, base: Design) -> Imported | None:
    """A design with the settings of such a file; None where it is of none of these formats."""
    where, text = shown_path(path), read_text(path, "settings file")
    found = next((one for one in FORMATS if one.known.search(text)), None)
    if found is None:
        return None
    with in_file(where):
        raw = found.read(text, where)
        spelled: dict[str, str] = {}  # by the names that the settings of the format have
        for name in raw:
            older = reduce(lambda known, each: known.replace(*each), found.newer.items(), name)
            spelled[older] = name
        given = {older: raw[name] for older, name in spelled.items()}
        if unfit := found.unfit(given, base):
            raise InputError(unfit)
    overrides, used, notes = _overrides(found, given, spelled, base, path.name)
    tables = {key.rpartition(".")[0] for key in overrides} | {table for _, table, _ in parts_of(base)}
    fixed = {key: value if value in (None, "tracking") else {"value": value, "source": found.words}
             for key, value in found.fixed.items() if key.rpartition(".")[0] in tables}  # fmt: skip
    known = {*used, *found.also, *(name for name in found.off if _number(given.get(name)) == 0.0)}
    left = ", ".join(name for older, name in spelled.items() if older not in known) or "none"
    notes += [f"{key} is left out: no such controller has it" for key, value in fixed.items()
              if value is None and _says(base, key)]  # fmt: skip
    overrides |= (lowered := _lowered(base, overrides))
    notes += [f"{key}: {base.limits.continuous_current_A:g} A dc is lowered to limits.peak_current"
              for key in lowered]  # fmt: skip
    design = _onto(base, changes := {**fixed, **overrides})
    notes = [f"read as {found.words}", *notes, *_kept_delay(base, design)]
    notes += [f"not understood, of {len(given)} settings: {left}"]
    changed = tuple(key for key in changes if key in design.parameters)
    return Imported(design=design, changed=changed, kept=(), notes=tuple(notes))


def _lowered(base: Design, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """The continuous current as the file's peak current, where the base has more than the drive gives."""
    peak, key = overrides.get("limits.peak_current"), "limits.continuous_current"
    if peak is None or key in overrides:
        return {}
    above = split_quantity(peak["value"])[0] < base.limits.continuous_current_A < inf
    return {key: {**peak, "source": f"limits.peak_current, of {peak['source']}"}} if above else {}


def _onto(base: Design, changes: Mapping[str, Any]) -> Design:
    """The design that the file makes; a refusal tells which values are the file's."""
    try:
        return with_overrides(base, changes)
    except InputError as error:
        mistakes = error.mistakes if isinstance(error, Mistakes) else (error,)
        raise as_one([InputError(f"{one.message}{_brought(one.message, base, changes)}", one.where)
                      for one in mistakes]) from None  # fmt: skip


def _brought(message: str, base: Design, changes: Mapping[str, Any]) -> str:
    """What the file has to do with a refusal: the keys that this names, else the stages that are new."""
    there = {table for _, table, _ in parts_of(base)}
    sources = {key: value["source"] for key, value in changes.items() if isinstance(value, dict)}
    named = [key for key in sources if key in message]
    named = named or [key for key in sources if key.rpartition(".")[0] not in there]
    return "".join(f"; {key} is of {sources[key]}" for key in named)


def _says(design: Design, key: str) -> bool:
    return any(f"{path}.".startswith(f"{key}.") for path in design.parameters)


def _kept_delay(base: Design, design: Design) -> list[str]:
    """What becomes of the computing delay, which no file states, where the period changes."""
    before, after = base.controller, design.controller
    if before.period_s == after.period_s:
        return []
    text, ticks = si_text(after.computing_delay_s, "s"), after.computing_delay_s / after.period_s
    return [f"control.computing_delay = {text} stays as it is: {ticks:.4g} ticks of the new period, "
            f"{before.computing_delay_s / before.period_s:.4g} of the old"]  # fmt: skip


def _overrides(
    found: Format, given: Tree, spelled: Mapping[str, str], base: Design, file: str
) -> tuple[dict[str, Any], set[str], list[str]]:
    """What the file sets, with its sources; the names that were understood; remarks."""
    overrides: dict[str, Any] = {}
    used: set[str] = set()
    notes = [f"{spelled[name]} = {given[name]}: {said}" for name, (when, said) in found.also.items()
             if said and name in given and _holds(when, base)]  # fmt: skip
    for item in (one for one in found.settings if _holds(one.when, base) and given.keys() & {*one.names}):
        raw = {name: _number(given.get(name, found.assumed.get(name))) for name in item.names}
        numbers = {name: number for name, number in raw.items() if number is not None}
        lacking = [name for name in item.names if name not in numbers]
        if lacking:
            said = f"{item.names[0]}: needs {', '.join(lacking)} for {item.key}"
            notes += [said] if item.names[0] in numbers else []
            continue
        used |= {*item.names}
        value = float(item.of(*numbers.values()))
        stated = ", ".join(
            f"{spelled[name]} = {given[name]}" if name in given else f"{name} = {number:g}, not in the file"
            for name, number in numbers.items()
            if number != inf or name in given
        )
        if value == _none(item.key):
            overrides[item.key] = None
            notes += [f"{stated}: none, {item.key} is left out"] if _says(base, item.key) else []
        elif value > 0.0 and isfinite(value):
            text = value if item.unit == "1" else si_text(value, item.unit.replace("A", "A dc"))
            overrides[item.key] = {"value": text, "source": f"{file}: {stated}"}
            notes += [f"{stated}: {item.said}"] if item.said else []
        else:
            notes.append(f"{stated}: not taken, {item.key} stays as it is")
    return overrides, used, notes


def _none(key: str) -> float:
    """The value of a limit or of a time that says that there is none; no number for what has to be there."""
    known = FIELDS[key]
    unsaid: float = inf if known.default is None else known.default
    return nan if known.required else unsaid


def _number(raw: object) -> float | None:
    with suppress(TypeError, ValueError, OverflowError):
        return None if isinstance(raw, bool) else float(raw)  # type: ignore[arg-type]
    return None
