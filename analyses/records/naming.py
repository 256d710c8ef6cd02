"""The signals that the analyses know: one table of names, SI units, meanings, and other names for them."""

import re
from dataclasses import dataclass
from difflib import get_close_matches

from actuator_lti.design.units import compatible, parse_unit
from actuator_lti.errors import InputError


@dataclass(frozen=True)
class Signal:
    """One signal: its name, SI unit, meaning, and other names for it (small letters, words by ``_``)."""

    name: str
    unit: str
    meaning: str
    also: tuple[str, ...] = ()


COMMAND = ("reference", "cmd", "command", "setpoint", "target")
SIGNALS = (
    Signal("reference", "rad", "commanded output angle",
           ("ref", "cmd", "command", "setpoint", "target", "demand", "position_reference", "position_command",
            "angle_reference", "output_angle_reference", "qg", "target_position", "goal", "goal_position",
            "desired_position", "goal_angle")),
    Signal("position_reference", "m", "commanded position",
           ("reference", "ref", "cmd", "command", "setpoint", "target", "demand", "position_command", "qg")),
    Signal("speed_reference", "rad/s", "commanded motor speed",
           (*COMMAND, "speed_command", "motor_speed_reference", "target_speed", "velocity_reference",
            "velocity_command")),
    Signal("output_speed_reference", "rad/s", "commanded output speed", ("output_speed_command",)),
    Signal("velocity_reference", "m/s", "commanded velocity",
           (*COMMAND, "speed_command", "speed_reference", "velocity_command")),
    Signal("current_reference", "A", "commanded current", (*COMMAND, "current_command", "iq_ref", "i_ref")),
    Signal("torque_reference", "N*m", "commanded motor torque",
           (*COMMAND, "torque_command", "torque_setpoint", "target_torque", "motor_torque_reference")),
    Signal("force_reference", "N", "commanded drive force", (*COMMAND, "force_command", "target_force")),
    Signal("voltage_reference", "V", "commanded voltage", (*COMMAND, "voltage_command", "u_ref")),
    Signal("output_angle", "rad", "output angle",
           ("output_position", "load_angle", "fin_angle", "joint_angle", "joint_position", "deflection",
            "present_position")),
    Signal("angle", "rad", "motor angle", ("motor_angle", "motor_position", "position", "pos", "encoder")),
    Signal("position", "m", "position", ("output_angle", "output_position", "pos", "qm")),
    Signal("speed", "rad/s", "motor speed", ("motor_speed", "n", "rpm", "velocity", "omega", "w", "vel")),
    Signal("velocity", "m/s", "velocity", ("output_speed", "speed", "motor_speed", "v", "vel")),
    Signal("current", "A", "motor current", ("motor_current", "i", "iq", "i_q", "i_motor")),
    Signal("voltage", "V", "motor voltage", ("motor_voltage", "u", "v", "uq", "u_q", "vir")),
    Signal("supply", "V", "supply voltage",
           ("supply_voltage", "bus", "bus_voltage", "udc", "u_dc", "vbus", "dc_link")),
    Signal("torque", "N*m", "load torque at the output",
           ("load", "moment", "hinge_moment", "load_torque", "output_torque", "m", "torque_sensor")),
    Signal("load_force", "N", "load force", ("load", "moment", "torque", "external_force")),
    Signal("force", "N", "drive force", ("drive_force",)),
    Signal("enable", "1", "torque enable (0: off)", ("torque_enable", "enabled", "servo_on", "power_on")),
)  # fmt: skip
"""In the order in which a name with a unit is looked up."""

KNOWN_UNITS = {"time": "s"} | {signal.name: signal.unit for signal in SIGNALS}
MEANINGS = {signal.name: signal.meaning for signal in SIGNALS}
PLACES = ("angle", "output_angle", "position")
RATES = {"rotary": "speed", "linear": "velocity"}  # of the motor, by the axis
LOADS = {"rotary": "torque", "linear": "load_force"}
REFERENCES = {"rotary": "reference", "linear": "position_reference"}  # of the output's place
TIME_NAMES = ("time", "t", "timestamp", "elapsed", "time_stamp")
NOT_NEEDED = {"motor_angle": "m", "motor_position": "m"}
"""A trajectory of a linear axis holds its position twice."""

SUFFIXES = {
    "rad": "rad", "deg": "deg", "rev": "rev", "turn": "turn", "m": "m", "mm": "mm", "um": "um",
    "A": "A", "mA": "mA", "Arms": "Arms", "V": "V", "mV": "mV", "N": "N", "kN": "kN", "Nm": "N*m",
    "mNm": "mN*m", "rad_s": "rad/s", "deg_s": "deg/s", "rpm": "rpm", "krpm": "krpm", "rev_s": "rev/s",
    "m_s": "m/s", "mm_s": "mm/s", "s": "s", "ms": "ms", "us": "us",
}  # fmt: skip
_BRACKETS = re.compile(r"^(?P<base>.*?)\s*[\[({](?P<unit>[^\])}]*)[\])}]\s*$")
_SLASH = re.compile(r"^(?P<base>[^/]*[^/\s])\s*/\s*(?P<unit>\S.*)$")
_IN = re.compile(r"^(?P<base>.*\S)\s+in\s+(?P<unit>\S+)$")


@dataclass(frozen=True)
class ColumnName:
    """A column's name taken apart: words, unit (None: none is written), and whether it says rms."""

    base: str
    unit: str | None
    rms: bool


def taken_apart(column: str) -> ColumnName:
    """Words and unit of a column name; a signal without a unit needs none in its name.

    >>> taken_apart("Motor speed [rpm]").base, taken_apart("Motor speed [rpm]").unit
    ('motor_speed', 'rpm')
    >>> taken_apart("t/ms").unit, taken_apart("current_A").unit, taken_apart("Irms (A)").rms
    ('ms', 'A', True)
    >>> taken_apart("current_Arms").rms, taken_apart("speed_krpm").unit, taken_apart("enable").unit
    (True, 'krpm', '1')
    """
    for pattern in (_BRACKETS, _IN, _SLASH):
        match = pattern.match(column.strip())
        if match is not None and is_unit(match["unit"]):
            return _words(match["base"], match["unit"].strip())
    for suffix in sorted(SUFFIXES, key=len, reverse=True):
        base = column.strip().removesuffix(f"_{suffix}")
        if base != column.strip() and base:
            return _words(base, SUFFIXES[suffix])
    return _words(column, None)


def is_unit(text: str) -> bool:
    """Whether a text is a unit, as recorders spell them; a plain number is none."""
    try:
        parse_unit(spelled(text))
    except ValueError:
        return False
    return bool(text.strip())


def spelled(unit: str) -> str:
    """Units as recorders spell them: 1/min, U/min, Ncm, Arms."""
    known = dict.fromkeys(("1/min", "U/min", "min-1", "min^-1", "r/min"), "rpm")
    known |= {"Ncm": "N*cm", "mNm": "mN*m", "kNm": "kN*m", "Arms": "A", "Vrms": "V", "Aeff": "A"}
    return known.get(unit.strip(), unit.strip())


def _words(base: str, unit: str | None) -> ColumnName:
    words = [word for word in re.split(r"[^a-z0-9]+", base.lower()) if word]
    rms = any(word in ("rms", "eff") for word in words) or (unit or "").endswith(("rms", "eff"))
    if words and words[-1] not in ("rms", "eff") and words[-1].endswith("rms"):
        rms, words[-1] = True, words[-1].removesuffix("rms")
    name = "_".join(word for word in words if word not in ("rms", "eff", "", "actual", "measured"))
    unit = "1" if unit is None and signal_of(name, "1") is not None else unit
    return ColumnName(name, None if unit is None else spelled(unit), rms)


def is_time(column: str) -> bool:
    """Whether a column name means the time, in a unit of time."""
    result = taken_apart(column)
    return result.base in TIME_NAMES and result.unit is not None and fits(result.unit, "s")


def fits(unit: str, known: str) -> bool:
    """Whether a unit has the dimension of another."""
    try:
        return compatible(parse_unit(unit), parse_unit(known))
    except ValueError:
        return False


def signal_of(base: str, unit: str) -> Signal | None:
    """The signal that words and a unit mean together, such as ``("reference", "deg")``."""
    by_name = [signal for signal in SIGNALS if signal.name == base]
    others = [signal for signal in SIGNALS if base in signal.also]
    return next((signal for signal in (*by_name, *others) if fits(unit, signal.unit)), None)


def canonical(name: str, unit: str) -> str:
    """The name by which the analyses know a signal of a record file.

    Raises `InputError`: for a name that nothing reads, or one whose unit does not fit.
    """
    base = "_".join(word for word in re.split(r"[^a-z0-9]+", name.lower()) if word)
    result = signal_of(base, unit)
    if result is not None:
        return result.name
    by_name = [signal for signal in SIGNALS if base == signal.name or base in signal.also]
    if by_name:
        wanted = " or ".join(dict.fromkeys(signal.unit for signal in by_name))
        raise InputError(f'signals.{name}.unit = "{unit}": must be a unit like {wanted}')
    names = [signal.name for signal in SIGNALS]
    near = get_close_matches(base, [*names, *(a for s in SIGNALS for a in s.also)], 1, 0.6)
    hint = f'; did you mean "{near[0]}"? There are' if near else "; there are"
    raise InputError(f"signals.{name}: no signal that is known{hint}: {', '.join(names)}")
