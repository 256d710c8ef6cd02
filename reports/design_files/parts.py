"""A design file from a motor and a gear of the catalogue, ``reports/templates/parts.toml``."""

from __future__ import annotations

import json
import re
from functools import cache
from math import pi, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_lti.design import read_design_text
from actuator_lti.design.mistakes import nearest
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, read_toml

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

_FILE = Path(__file__).parents[1] / "templates" / "parts.toml"
_WORDS = ("title", "source", "grade", "constants")
_PLACES = {
    **dict.fromkeys(("voltage", "continuous_current"), "[limits]"),
    **dict.fromkeys(("stiffness", "torque_1", "stiffness_2", "torque_2", "stiffness_3"), "[coupling]"),
}
"""Where a key of a part stands in a design file, if not in the part's own table."""


@cache
def parts() -> Tree:
    return read_toml(_FILE, "catalogue")


def part(kind: str, name: str) -> Tree:
    """A motor or a gear; an InputError has the nearest name and all that there are."""
    known = parts()[kind]
    if name not in known:
        plain = "-".join(name.lower().split())
        near = [one for one in known if plain in one] or known
        raise InputError(f'--{kind} = "{name}"{nearest(plain, known)}: allowed: {", ".join(near)}')
    found: Tree = known[name]
    return found


def with_parts(text: str, motor: str | None, gear: str | None) -> str:
    """A design file's text with a motor, a gear or both, and with limits, load and gains that suit them.

    The load has the motor's inertia, seen through the gear. The current loop crosses at 2000 rad/s, the
    velocity loop at 240 rad/s or an eighth of the spring's frequency, the position loop at a quarter of that.
    """
    chosen = {kind: part(kind, name) for kind, name in (("motor", motor), ("gear", gear)) if name is not None}
    if motor is not None:
        entry = dict(chosen["motor"])
        speed = _derived(0.9 * float(entry["no_load_speed"].split()[0]), "rpm", "0.9 of that without a load")
        if "no_load_current" not in entry:
            del entry["no_load_speed"]
        chosen["motor"] = entry
        text = _put(_put(text, "[friction]", dry_torque=None, viscous=None), "[limits]", speed=speed)
    if gear is not None:
        text = _put(text, "[[gear]]", name=json.dumps(gear), input_inertia=None, output_inertia=None)
        text = _put(text, "[friction]", load_coefficient=None)
        if "stiffness" in chosen["gear"]:
            text = text.replace("\n[load]\n", "\n[coupling]\n\n[load]\n", 1)
    for kind, entry in chosen.items():
        for key in reversed(entry):
            if key == "play":
                said = "".join(f"{word} = {json.dumps(entry[word])}\n" for word in ("source", "grade"))
                text += f'\n[[fact]]\nlabel = "play of the gear"\nvalue = "{entry[key]}"\n{said}'
            elif key not in _WORDS:
                table = _PLACES.get(key, "[[gear]]" if kind == "gear" else "[motor]")
                text = _put(text, table, **{key: _said(entry[key], entry["source"], entry["grade"])})
    if "constants" in chosen.get("motor", {}):  # an AC motor: which amperes is to be said
        text = _put(text, "[motor]", constants=json.dumps(chosen["motor"]["constants"]))
        text = re.sub(r'(?m)^((?:gain|peak_current) = "[^"]*\bA)\b', r"\1 dc", text)
    titles = ", ".join(entry["title"] for entry in chosen.values())
    said = "Values of the data sheets; the load is assumed, limits and gains follow: change them to your own."
    text = _put(text, "[design]", title=json.dumps(titles), description=json.dumps(said))
    return _suited(text, read_design_text(text, "design"))


def _suited(text: str, design: Design) -> str:
    ratio, spring, current = design.total_ratio, design.coupling, design.limits.continuous_current_A
    motor: Any = design.effective_motor  # of the catalogue: with R, L and kM
    k, resistance, inductance = motor.torque_constant_Nm_A, motor.resistance_ohm, motor.inductance_H
    ampere = "A" if design.motor.constants == "dc" else "A dc"
    turning = design.motor_side_inertia_kgm2
    integral = max(inductance / resistance, design.controller.period_s)
    load, moment = turning * ratio**2, 0.4 * k * current * ratio
    crossing = 240.0
    if spring is not None:
        crossing = min(crossing, sqrt(spring.stiffness_Nm_rad / load) / 8.0)
        damping = 2.0 * 0.05 * sqrt(spring.stiffness_Nm_rad * load)
        text = _put(text, "[coupling]", damping=_derived(damping, "N*m*s/rad", "5 % of critical", "X"))
    if not design.friction.dry_torque_Nm:
        dry = _derived(20.0 * k * current, "mN*m", "assumed: 2 % of the continuous torque", "X")
        text = _put(text, "[friction]", dry_torque=dry)
    if not design.friction.load_coefficient:
        lost = _derived(100.0 / ratio, "mN*m/(N*m)", "assumed: a tenth is lost under load", "X")
        text = _put(text, "[friction]", load_coefficient=lost)
    rate, crosses = 0.4 * design.limits.speed_rad_s / ratio, f"crosses at {crossing:.3g} rad/s"
    made = {
        "[load]": {
            "inertia": _derived(load, "kg*m^2", "assumed: as much as the motor's, through the gear", "X"),
            "moment_max": _derived(moment, "N*m", "0.4 of the continuous torque, through the gear"),
        },
        "[limits]": {
            "acceleration": _derived(k * current / (2.0 * turning), "rad/s^2", "at continuous current"),
            "peak_current": _derived(2.0 * current, ampere, "twice the continuous current"),
        },
        "[control.current]": {
            "gain": _derived(2000.0 * resistance * integral, f"V/{ampere}", "crosses at 2000 rad/s: w R Ti"),
            "integral_time": _derived(1e3 * integral, "ms", "L/R, and a period at least"),
        },
        "[control.velocity]": {
            "gain": _derived(2.0 * crossing * turning / k, f"{ampere}*s/rad", crosses),
            "integral_time": _derived(5e3 / crossing, "ms", "five over the crossing"),
        },
        "[control.position]": {"gain": _derived(crossing / 4.0, "1/s", "a quarter of the velocity loop")},
        "[validation]": {"loads": f'["0 N*m", "{moment:.3g} N*m"]'},
        'id = "position-bandwidth"': {"minimum": f'"{0.2 * crossing / (2.0 * pi):.3g} Hz"'},
        'id = "output-rate"': {"minimum": f'"{rate:.3g} rad/s"', "load": f'"{moment:.3g} N*m"'},
    }
    for table, values in made.items():
        text = _put(text, table, **values)
    return text


def _put(text: str, table: str, **values: str | None) -> str:
    """The text with keys of a table (or behind a line of it) written anew, put in, or (None) left out."""
    head, found, rest = text.partition(f"\n{table}\n")
    body, gap, tail = rest.partition("\n[")
    for key, value in values.items():
        line = re.compile(rf'(?m)^{key} = (?:"[^"\n]*"|\{{[^}}\n]*\}}|\[[^\]\n]*\]|[^\s#]+)')
        if value is None:
            body = re.sub(rf"(?m)^{key} = .*\n?", "", body)
        elif line.search(body):
            body = line.sub(lambda _, new=f"{key} = {value}": new, body, count=1)  # type: ignore[misc]
        else:
            body = f"{key} = {value}\n{body}"
    return head + found + body + gap + tail


def _said(value: object, source: str, grade: str) -> str:
    width = ', tolerance = "30 %"' if grade == "X" else ""
    return f'{{ value = {json.dumps(value)}, source = {json.dumps(source)}, grade = "{grade}"{width} }}'


def _derived(value: float, unit: str, source: str, grade: str = "D") -> str:
    return _said(f"{float(f'{value:.3g}'):g} {unit}", source, grade)
