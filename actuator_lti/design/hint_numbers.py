"""What a hint about an unknown key ends with: the number that the right key would have in this file."""

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from math import pi
from typing import Any

from actuator_lti.design.field import Field, unit_on
from actuator_lti.design.fields import FIELDS
from actuator_lti.design.sheet_words import key_for
from actuator_lti.design.spellings import split_quantity
from actuator_lti.design.stated import CONVENTION, Frame
from actuator_lti.design.units import parse_quantity, parse_unit
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, shown

_TAKES = re.compile(r', which takes "([^"]*)"( too)?')
_MOTOR = re.compile(r"(motor|friction|limits)\.|control\.(velocity|position)\.gain|instruments\.angle_noise")
_TICKS = re.compile(r"\s*([0-9.]+)\s*(?:ticks?|samples?|cycles?|periods?|Ts)\s*")
BARE = re.compile(r"\s*[0-9.]+\s*\Z")
_ROOT_OF_WATTS = re.compile(r" */ *(?:sqrt *\( *W *\)|√ *\(? *W\)?|W *(?:\^ *\(?(?:0?\.5|1/2)\)?|½))")
Takes = Callable[[str, str], bool]
_COUNT = re.compile(r"\b(?:counts?|cnts?|cts|inc|increments?)\b")
_PER_COUNT = re.compile(rf"\s*(?:/|\bper\b)\s*{_COUNT.pattern}\s*\Z")


def with_numbers(word: str, path: str, key: str, table: Tree, tree: Tree, frame: Frame, takes: Takes) -> str:
    """The words of a hint with numbers of the file; ``takes``: whether a key reads a text as it stands."""
    if path == "motor" and _ROOT_OF_WATTS.search(f"{_plain(table[key])}"):
        return _motor_constant(_plain(table[key]), tree, frame)
    if word.startswith("counts_per_rev") and ", which takes" not in word:
        return word + _lines(_plain(table[key]), word, takes) + _over_step(_plain(table[key]), path, frame)
    if example := _TAKES.search(word):
        to = f"{path}.{word.partition(',')[0]}"
        own = next((one for one in (_with_unit(table[key]), example[1]) if one and takes(to, one)), "")
        too = f", which takes {shown(own)}{example[2] or ''}" if own else ""
        pitch_m = _si(_plain(table[key]), "m") if word.startswith("cogging_periods") and own else 0.0
        order = f": {2.0 * pi / pitch_m:.6g} rad/m" if pitch_m > 0.0 else ""
        word = f"{word[: example.start()]}{too}{order}{word[example.end() :]}"
    if word.startswith(("integral_time =", "derivative_time =")):
        return word + _time(word, table, key)
    if word.startswith("every,"):
        if f"{path}.every" not in FIELDS:
            return "not needed: it runs every tick of control.period" if path == "control.current" else ""
        ticks = ticks_of(path, table[key], tree)
        return f"{word}; here {ticks}" if ticks else word
    if path == "control.current" and key == "bandwidth":
        time_s = _si(_of(tree, "motor", "inductance"), "H") / _si(_of(tree, "motor", "resistance"), "ohm")
        here = f", here {time_s:.4g} s" if time_s > 0.0 else ""
        return f"{word}; a drive that is set so has integral_time = L/R{here}"
    if word.startswith("back_emf_constant, times the pole pairs"):
        pairs = [_of(tree, "motor", name) for name in ("pole_pairs", "poles")]
        p = next((one / k for k, one in enumerate(pairs, 1) if isinstance(one, int) and one < 1000), 0.0)
        flux = p * _si(f"{_plain(table[key])}".replace("Wb", "V*s"), "V*s")
        return f"{word}: {flux:.4g} V*s/rad and {1.5 * flux:.4g} N*m/A" if flux > 0.0 else word
    return word


def hint_of(text: Any, field: Field, path: str, frame: Frame, tree: Tree) -> str:
    """What a refused value of a key is in this file: ticks of a time or a time of ticks, counts, a step."""
    if field.key == "every":
        ticks = ticks_of(path.removesuffix(".every"), text, tree)
        here = f", here {ticks}" if ticks else ""
        return f"; write the ticks of control.period{here}" if _period_s(text) > 0.0 else ""
    if field.key == "counts_per_rev":
        whole = "metre" if frame.per_metre(field.section) else "revolution"
        over = _over_step(text, field.section, frame).replace("here", f"a {whole} over it is")
        return over or ("; those of a metre" if whole == "metre" else "")
    if field.path == "motor.torque_constant" and _ROOT_OF_WATTS.search(f"{text}"):
        return f"; it is {_motor_constant(text, tree, frame)}"
    period_s, said = _period_s(_of(tree, "control", "period")), _TICKS.fullmatch(f"{text}")
    if said and period_s > 0.0:
        return f"; here {float(said[1]) * period_s:.6g} s"
    return _per_count(text, field, frame, tree)


def _per_count(text: Any, field: Field, frame: Frame, tree: Tree) -> str:
    """What a value in counts of the encoder is in rad or m, where the file says how many there are."""
    if not isinstance(text, str) or not _COUNT.search(text) or not _MOTOR.match(field.path):
        return ""
    loop = tree.get("control", {}).get(field.section.rpartition(".")[2]) if field.key == "gain" else {}
    if isinstance(loop, dict) and loop.get("sensor", "motor") != "motor":  # it counts at the output
        return ""
    linear, unit = frame.motor_axis == "linear", field.unit(replace(frame.structure, axis=frame.motor_axis))
    with suppress(InputError, ValueError, TypeError, ArithmeticError):
        counts = frame.quantity(_of(tree, "encoder", "counts_per_rev"), FIELDS["encoder.counts_per_rev"])
        plain = CONVENTION.sub("", text)
        power = dict(parse_unit(split_quantity(plain)[1]).dimension).get("[count]", 0)
        one_rad = (1.0 if linear else 2.0 * pi) / counts
        size = parse_quantity(_COUNT.sub("m" if linear else "rad", plain), unit) * one_rad**power
        kind = "".join(f" {one}" for one in CONVENTION.findall(text))
        return f"; of {counts:g} counts {size:.4g} {re.sub(r'(?<=A)(?=[*/ ]|$)', kind, unit)}"
    return ""


def _over_step(text: Any, section: str, frame: Frame) -> str:
    """A revolution, or a metre of a linear axis, over the step of an encoder."""
    turns = {"m": 1.0} if frame.per_metre(section) else {"rad": 2.0 * pi}
    if frame.travel_m_rad is not None and section == "encoder":
        turns["m"] = 2.0 * pi * frame.travel_m_rad
    step = _PER_COUNT.sub("", text) if isinstance(text, str) else text
    over = next((turn / size for unit, turn in turns.items() if (size := _si(step, unit)) > 0.0), 0.0)
    return f"; here {over:.10g} counts" if over else ""


def _lines(value: Any, word: str, takes: Takes) -> str:
    number = re.match(r"\s*[0-9]+", f"{value}")
    if "some makers" not in word or number is None:
        return ""
    if isinstance(value, str) and not BARE.match(value) and takes("encoder.counts_per_rev", value):
        return f", which takes {shown(value)} too"
    n = int(number[0])
    return f': "{n} lines" ({4 * n} counts) or "{n} counts"'


def _motor_constant(text: str, tree: Tree, frame: Frame) -> str:
    """Km in N m/sqrt(W): losses of one winding (dc), or of three with R line-line or of a phase."""
    factor = 1.0 if frame.constants == "dc" else 1.5
    torque = unit_on(frame.motor_axis, "{torque}")
    Km = _si(_ROOT_OF_WATTS.sub("", text), torque)
    kM = Km * (factor * _si(_of(tree, "motor", "resistance"), "ohm")) ** 0.5
    here = f": {kM:.4g} {torque}/A" if kM > 0.0 else ""
    return f"the motor constant Km: torque_constant is Km sqrt({'' if factor == 1.0 else '1.5 '}R){here}"


def _plain(value: Any) -> Any:
    return value.get("value") if isinstance(value, dict) else value


def _of(tree: Tree, table: str, key: str) -> Any:
    found = tree.get(table)
    return _plain(found.get(key)) if isinstance(found, dict) else None


def _si(text: Any, unit: str) -> float:
    with suppress(InputError):
        return parse_quantity(text, unit) or float("nan") if isinstance(text, str) else float("nan")
    return float("nan")


def _period_s(text: Any) -> float:
    period_s = _si(_plain(text), "s")
    return period_s if period_s > 0.0 else 2.0 * pi / _si(_plain(text), "rad/s")


def _with_unit(value: Any) -> str:
    with suppress(ValueError):
        return value if isinstance(value := _plain(value), str) and split_quantity(value)[1] else ""
    return ""


def ticks_of(path: str, period: Any, tree: Tree) -> int:
    """The ticks of a loop's own period; 0 where they are no whole number that its `every` takes."""
    field, ticks = FIELDS.get(f"{path}.every"), _period_s(period) / _period_s(_of(tree, "control", "period"))
    whole = round(ticks) if field is not None and 0.5 < ticks < 2.0 * field.high else 0
    return whole if field is not None and field.accepts(whole) and abs(ticks - whole) <= 1e-6 * whole else 0


def _time(word: str, table: Tree, key: str) -> str:
    named = next((one for one in table if "gain" in (one, key_for("control.", one))), "")
    texts = [f"{table.get(one)}" for one in (named, key)]
    if CONVENTION.findall(texts[0]) != CONVENTION.findall(texts[1]):  # amperes of two kinds
        texts[0] = ""
    gain, own = (CONVENTION.sub("", text) for text in texts)
    for quotient in [(gain, own), ("1", own)] if word.startswith("integral") else [(own, gain)]:
        with suppress(ValueError, ZeroDivisionError):
            (a, of), (b, per) = map(split_quantity, quotient)
            time_s = parse_quantity(f"{a / b!r} ({of or 1})/({per})", "s/rad")
            return f"; here {time_s:.4g} s" if time_s > 0.0 else ""
    return ""
