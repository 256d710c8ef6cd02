"""The variables of a co-simulation unit: inputs, outputs, parameters, constants, with all that FMI asks."""

import math
import re
from dataclasses import dataclass
from typing import Any, Literal

from actuator_lti.design.field import BIG, unit_on
from actuator_lti.design.fields import fields_in, parts_of
from actuator_lti.design.model import Design
from actuator_lti.design.plant import reachable_speed
from actuator_lti.design.units import ampere_unit
from nonlinear._kernels import layout as at
from nonlinear.export.c_files import stage_words
from nonlinear.export.trace import Key, KeyTrace

COMMAND, MOMENT, SUPPLY = 1, 2, 3
FIRST_OUTPUT, FIRST_FLAG, INITIAL_ANGLE = 10, 30, 90
FIRST_KEY, FIRST_CONSTANT, FIRST_TEXT = 100, 1000, 2000

FLAG_BITS = (*at.LIMITER_BITS, at.FLAG_STICK)  # of each Boolean output, in order
OF_DC = ", of the equivalent DC motor"  # amperes and volts of an AC motor
SHOWN = {"rad": "deg", "rad/s": "deg/s", "m": "mm"}  # unit that a host shows a value in

Causality = Literal["input", "output", "parameter", "local", "independent"]


@dataclass(frozen=True, kw_only=True)
class Variable:
    name: str
    reference: int
    causality: Causality
    variability: str
    description: str
    kind: Literal["real", "integer", "boolean", "string"] = "real"
    unit: str = "1"  # where there is none
    shown: str = ""  # unit that a host shows it in, where that is said
    nominal: float | None = None  # its size in use, where that is known
    start: float | str | None = None  # None where it is calculated
    low: float = -math.inf
    high: float = math.inf


def variables_of(design: Design, trace: KeyTrace) -> tuple[Variable, ...]:
    """All variables of a design's unit, in the order of the model description."""
    texts = (
        Variable(name=structured(path), reference=FIRST_TEXT + n, causality="local", variability="constant",
                 description=f"{text} (decided at the export)", kind="string", start=value)
        for n, (path, value, text) in enumerate(texts_of(design))
    )  # fmt: skip
    return (*_inputs(design), *_outputs(design), *_flags(), *_parameters(design, trace), *texts)


def supply_voltage(design: Design) -> float:
    """Start value of the supply: the design's limit, or more than any drive has where there is none."""
    return min(design.limits.voltage_V, BIG)


def sizes(design: Design) -> dict[str, float]:
    """Size in use of each quantity, on the output shaft and on the motor; ``inf`` where nothing bounds it."""
    ratio, angle, motor = design.total_ratio, design.validation.full_deflection_rad, design.effective_motor
    speed, voltage = reachable_speed(design), design.limits.voltage_V
    current = min(design.limits.peak_current_A, design.limits.continuous_current_A)
    if motor.resistance_ohm is not None:
        current = min(current, voltage / motor.resistance_ohm)
    kM, kV = motor.torque_constant_Nm_A, motor.source_gain_Nm_V
    commands = {"position": angle, "velocity": speed / ratio, "current": current, "voltage": voltage}
    return {
        "output.angle": angle,
        "output.rate": speed / ratio,
        "motor.current": current,
        "motor.voltage": voltage,
        "motor.torque": kM * current if kM else (kV or 0.0) * voltage,
        "motor.angle": angle * ratio,
        "motor.speed": speed,
        "control.current_command": current,
        "control.speed_command": speed,
        "supply_voltage": voltage,
        "command": commands[design.controller.outermost],
        "hinge_moment": design.load.moment_max_Nm,
    }


def _signal(design: Design, number: int, text: tuple[str, str, str], **more: Any) -> Variable:
    """An input or output: name, words and unit, with its size where that is known."""
    name, words, unit = text
    size = sizes(design)[name]
    words += OF_DC * (unit in ("A", "V") and design.motor.constants != "dc")
    turns = unit == "rad/s" and name in ("motor.speed", "control.speed_command")
    return Variable(
        name=name, reference=number, variability="continuous", description=words, unit=unit,
        shown="rpm" if turns else SHOWN.get(unit, ""),
        nominal=size if 0.0 < size < BIG else None, **more,
    )  # fmt: skip


def _inputs(design: Design) -> tuple[Variable, ...]:
    (words, unit), torque = stage_words(design), unit_on(design.axis, "{torque}")
    moment = "moment of the load on the output shaft, beside that of the design"
    texts = (
        ("command", words, unit, 0.0, -math.inf),
        ("hinge_moment", moment, torque, 0.0, -math.inf),
        ("supply_voltage", "limits.voltage of the design, from outside", "V", supply_voltage(design), 0.0),
    )
    return tuple(
        _signal(design, COMMAND + n, (name, f"{text}; taken at the beginning of each tick", unit),
                causality="input", start=start, low=low)
        for n, (name, text, unit, start, low) in enumerate(texts)
    )  # fmt: skip


def _outputs(design: Design) -> tuple[Variable, ...]:
    angle, torque = unit_on(design.axis, "{angle}"), unit_on(design.axis, "{torque}")
    texts = (
        ("output.angle", "output position" if angle == "m" else "output angle", angle),
        ("output.rate", "rate of the output", f"{angle}/s"),
        ("motor.current", "motor current", "A"),
        ("motor.voltage", "voltage commanded at the last tick", "V"),
        ("motor.torque", "torque of the motor", torque),
        ("motor.angle", "angle of the motor", angle),
        ("motor.speed", "speed of the motor", f"{angle}/s"),
        ("control.current_command", "current command of the last tick", "A"),
        ("control.speed_command", "speed command of the last tick", f"{angle}/s"),
    )
    return tuple(_signal(design, FIRST_OUTPUT + n, text, causality="output") for n, text in enumerate(texts))


def _flags() -> tuple[Variable, ...]:
    acted = [(f"limiter.{n.replace('-', '_')}", f"the {n} limit acted at the last tick") for n in at.LIMITERS]
    names = [*acted, ("at_rest", "the rotor was held by friction at the last tick")]
    return tuple(
        Variable(name=name, reference=FIRST_FLAG + n, causality="output", variability="discrete",
                 description=text, kind="boolean")
        for n, (name, text) in enumerate(names)
    )  # fmt: skip


def _parameters(design: Design, trace: KeyTrace) -> tuple[Variable, ...]:
    angle = unit_on(design.axis, "{angle}")
    start = Variable(
        name="initial.angle", reference=INITIAL_ANGLE, causality="parameter", variability="fixed",
        description="output angle at the start, everything at rest", unit=angle, start=0.0,
        shown=SHOWN[angle],
    )  # fmt: skip
    of, rest, keys = design.motor.constants, enumerate(trace.constants, FIRST_CONSTANT), trace.keys
    ours = [_of_key(key, n, of, "fixed" if key.fixed else "tunable") for n, key in enumerate(keys, FIRST_KEY)]
    return (start, *ours, *(_of_key(key, n, of, "constant") for n, key in rest))


def _of_key(key: Key, reference: int, constants: str, variability: str) -> Variable:
    causality: Causality = "local" if variability == "constant" else "parameter"
    words = key.description + OF_DC * (ampere_unit(key.path, key.unit, constants) != key.unit)
    return Variable(
        name=structured(key.path), reference=reference, causality=causality, variability=variability,
        description=words, unit=key.unit, start=key.value, low=key.low, high=key.high,
        kind="integer" if key.whole else "real", shown=SHOWN.get(key.unit, ""),
    )  # fmt: skip


def structured(path: str) -> str:
    """A dotted path in FMI's structured naming: numbers as indices, other names quoted.

    >>> structured("control.velocity.filter.1.depth"), structured("gear.my stage.ratio")
    ('control.velocity.filter[1].depth', "gear.'my stage'.ratio")
    """
    indexed = re.sub(r"\.(\d+)(?=\.|$)", r"[\1]", path)
    parts = [
        part
        if re.fullmatch(r"[A-Za-z_]\w*(\[\d+\])?", part)
        else "'" + re.sub(r"[^A-Za-z0-9_ !#$%&()*+,\-/:;<>=?@\[\]^{}|~]", "_", part) + "'"
        for part in indexed.split(".")
    ]
    return ".".join(parts)


def texts_of(design: Design) -> tuple[tuple[str, str, str], ...]:
    """Keys that are no numbers: path, value, description."""
    about = (("design.name", design.name, "short name"), ("design.title", design.title, "title"),
             ("design.axis", design.axis, "rotary or linear"))  # fmt: skip
    result = [
        (f"{path}.{field.key}", str(getattr(part, field.attribute)), field.description)
        for section, path, part in parts_of(design)
        for field in fields_in(section.template)
        if field.kind in ("choice", "flag")
    ]
    return (*about, *result)
