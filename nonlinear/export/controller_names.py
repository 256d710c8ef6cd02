"""Names, units and words of what the controller for firmware remembers, is given and gives."""

from __future__ import annotations

from actuator_lti.design.law import LAW_INPUTS
from actuator_lti.design.model import Design
from nonlinear._kernels import layout
from nonlinear.export.c_files import stage_words
from nonlinear.export.rows import UNIT_OF, words

_STAGES = ("position", "velocity", "current", "voltage")
_UNITS = dict(zip(_STAGES, ("rad", "rad/s", "A", "V"), strict=True))
_BEHIND = {  # numbers in the unit of what a stage commands
    "velocity": ("S_VELOCITY_INTEGRATOR", "S_TORQUE_FEEDFORWARD", "S_TORQUE_CHAIN"),
    "position": ("S_POSITION_INTEGRATOR",),
}
_COMMAND = ("S_PROFILE", "S_PROFILE_COMMAND", "AT_AVERAGE", "S_AVERAGE_SUM", "S_COMMAND_CHAIN", "IN_COMMAND")
_OTHERS = {
    "rad": "S_REFERENCE S_REFERENCE_BEFORE S_ERROR AT_ANGLES ANGLE_START LAW_ANGLE LAW_OUTPUT_ANGLE",
    "rad/s": "S_ERROR_RATE S_SPEED_CHAIN IN_OUTPUT_SPEED LAW_SPEED LAW_OUTPUT_SPEED",
    "A": "LAW_CURRENT",
}
_UNIT_OF = UNIT_OF | {name: unit for unit, names in _OTHERS.items() for name in names.split()}
_WORDS = {
    "S_SPEED_REFERENCE": "w_ref", "S_OVERLOADED": "1: the overload limit acts",
    "LAW_STATES": "states of the law of one's own", "LAW_NEXT": "work space of the law: its next states",
    "AT_ANGLES": "the last angles, oldest first", "AT_AVERAGE": "the last commands of the profile",
    **{f"LAW_{name.upper()}": "input of the law of one's own" for name in LAW_INPUTS},
}  # fmt: skip
_SIGNALS = {
    "IN_COMMAND": "command", "IN_CURRENT": "motor_current", "IN_SPEED": "motor_speed",
    "IN_ANGLE": "motor_angle", "ANGLE_START": "motor_angle", "IN_OUTPUT": "output_angle",
    "IN_OUTPUT_SPEED": "output_speed", "IN_BUS": "bus_voltage", "IO_VOLTAGE": "voltage",
    "IO_CURRENT_COMMAND": "current_command", "IO_SPEED_COMMAND": "speed_command", "IO_FLAGS": "flags",
}  # fmt: skip
_PLACES = {getattr(layout, name): name for name in _SIGNALS}


def signal_name(design: Design, place: int) -> str:
    """Member of an input or output."""
    name = _PLACES[place]
    return _with_unit(design, _SIGNALS[name], _unit(design, name))


def state_name(design: Design, name: str, *, counts: bool = False) -> str:
    """Member of a part of the state."""
    text = name.removeprefix("S_").removeprefix("AT_").lower()
    return _with_unit(design, text, "counts" if counts else _unit(design, name))


def _with_unit(design: Design, text: str, unit: str) -> str:
    if design.axis == "linear":
        unit = unit.replace("rad", "m")
    return f"{text}_{unit.replace('/', '_')}" if unit else text


def _unit(design: Design, name: str) -> str:
    stages = [
        stage for stage in _STAGES if stage == "voltage" or getattr(design.controller, stage) is not None
    ]
    if name in _COMMAND:
        return stage_words(design)[1]
    own = design.controller.own_law
    if own is not None and name in ("LAW_COMMAND", "LAW_ERROR"):
        return _UNITS[own[0]]
    if name == "S_PROFILE_SPEED":
        return f"{_UNITS[stages[0]]}/s".replace("/s/s", "/s2")
    for stage, names in _BEHIND.items():
        if name in names:
            return next(_UNITS[each] for each in stages if _STAGES.index(each) > _STAGES.index(stage))
    return _UNIT_OF.get(name, "")


def state_words(name: str) -> str:
    """What a part of the state is, where its name does not say it all."""
    return _WORDS.get(name) or _said(name)


def signal_words(place: int) -> str:
    """What an input or output is, where its name does not say it all."""
    name = _PLACES.get(place)
    return _said(name) if name else "count of the encoder; it may go round at 2**32"


def _said(name: str) -> str:
    said = words().get(name, "").partition(" [")[0]
    return "" if said == name.removeprefix("S_").lower().replace("_", " ") else said
