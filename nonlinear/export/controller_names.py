"""Names, units and words of what the controller for firmware remembers, is given and gives."""

from actuator_lti.design.law import LAW_INPUTS
from actuator_lti.design.model import Design
from nonlinear._kernels import layout
from nonlinear.export.program import said_of

_COMMANDED = {"position": "rad", "velocity": "rad/s", "current": "A", "voltage": "V"}  # unit of each stage's
_INSIDE = {  # numbers in the unit of the command of the next stage inside
    "S_VELOCITY_INTEGRATOR": "velocity", "S_TORQUE_FEEDFORWARD": "velocity", "S_TORQUE_CHAIN": "velocity",
    "S_POSITION_INTEGRATOR": "position",
}  # fmt: skip
_OUTERMOST = {"S_PROFILE", "S_PROFILE_COMMAND", "S_COMMAND_CHAIN", "S_AVERAGE_SUM"}
_OUTERMOST |= {"AT_AVERAGE", "IN_COMMAND"}
_UNITS = {
    "AT_ANGLES": "rad", "LAW_ANGLE": "rad", "LAW_OUTPUT_ANGLE": "rad", "LAW_SPEED": "rad/s",
    "LAW_OUTPUT_SPEED": "rad/s", "LAW_CURRENT": "A",
}  # fmt: skip
_WORDS = {
    "S_SPEED_REFERENCE": "w_ref", "S_OVERLOADED": "1: the overload limit acts",
    "LAW_STATES": "states of the law of one's own", "LAW_NEXT": "work space of the law: its next states",
    "AT_ANGLES": "the last angles, oldest first", "AT_AVERAGE": "the last commands of the profile",
    **{f"LAW_{name.upper()}": "input of the law of one's own" for name in LAW_INPUTS},
}  # fmt: skip
_SIGNALS = {
    "IN_COMMAND": "command", "IN_CURRENT": "motor_current", "IN_SPEED": "motor_speed",
    "IN_ANGLE": "motor_angle", "ANGLE_START": "motor_angle", "IN_OUTPUT": "output_angle",
    "OUTPUT_START": "output_angle", "IN_OUTPUT_SPEED": "output_speed", "IN_BUS": "bus_voltage",
    "IO_VOLTAGE": "voltage", "IO_CURRENT_COMMAND": "current_command", "IO_SPEED_COMMAND": "speed_command",
    "IO_FLAGS": "flags",
}  # fmt: skip
SIGNAL_AT = {getattr(layout, name): name for name in _SIGNALS}
"""Name in the layout of each input and output, by its place."""


def member_name(design: Design, name: str, *, counts: bool = False) -> str:
    """Member of a structure for a part of the state, an input or an output, its unit behind it."""
    text = _SIGNALS.get(name) or name.removeprefix("S_").removeprefix("AT_").lower()
    unit = "counts" if counts else _unit(design, name)
    if design.axis == "linear":
        unit = unit.replace("rad", "m")
    return f"{text}_{unit.replace('/', '_')}" if unit else text


def _unit(design: Design, name: str) -> str:
    control, order = design.controller, [*_COMMANDED]
    stages = (*control.stages, "voltage")
    if name in _OUTERMOST:
        return _COMMANDED[stages[0]]
    if control.own_law is not None and name in ("LAW_COMMAND", "LAW_ERROR"):
        return _COMMANDED[control.own_law[0]]
    if name == "S_PROFILE_SPEED":
        return f"{_COMMANDED[stages[0]]}/s".replace("/s/s", "/s2")
    if name in _INSIDE:
        return next(_COMMANDED[each] for each in stages if order.index(each) > order.index(_INSIDE[name]))
    return _UNITS.get(name) or said_of(name)[1]


def member_words(name: str) -> str:
    """What a part of the state, an input or an output is, where its name does not say it all."""
    return _WORDS.get(name) or said_of(name)[0]
