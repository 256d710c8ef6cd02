"""Physics across keys: what cannot be is refused; what is only suspicious is warned of (`suspicions`)."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from math import inf, isclose, log, pi

import numpy as np

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.design.checks_control import CONTROL_CHECKS, check_temperature
from actuator_lti.design.checks_elastic import ELASTIC_CHECKS, check_place
from actuator_lti.design.checks_own import out_of_range
from actuator_lti.design.fields import ALL_FIELDS, Field, Structure
from actuator_lti.design.mistakes import Findings, Refusal
from actuator_lti.design.model import Correlation, Design, Requirement
from actuator_lti.design.plant import no_load_speed
from actuator_lti.design.sections import part_at
from actuator_lti.design.spellings import split_quantity
from actuator_lti.design.unread import UNREAD, readable
from actuator_lti.files.reading import shown

CHECKS = "validation"  # what the ids of checks by simulation begin with
_ELECTRICAL = {
    "resistance": "resistance_ohm",
    "inductance": "inductance_H",
    "torque_constant": "torque_constant_Nm_A",
    "back_emf_constant": "back_emf_constant_Vs_rad",
}


def check_design(design: Design, where: str) -> None:
    """Refuse a design that no file may hold: values out of range, or that contradict each other.

    ``where`` names its file.

    Raises
    ------
    InputError
        All at once: key, value and what is allowed.
    """
    findings = Findings(where)
    findings.extend(out_of_range(design))
    findings.refuse()  # the relations ask for numbers that are some
    check_relations(design, where)


def check_relations(design: Design, where: str) -> None:
    """Refuse a design whose values, each in its range, contradict each other.

    Raises
    ------
    InputError
        All at once: key, value and what is allowed.
    """
    findings = Findings(where)
    findings.extend(contradictions(design))
    findings.refuse()


def contradictions(design: Design) -> Iterator[Refusal]:
    """What the relations between keys refuse, of all those whose own keys are read."""
    for check in FIRST_RELATIONS:
        refused = tuple(readable(check(design)))
        yield from refused
        unsure = {path.partition(".")[0] for path, *_ in refused}
        design = replace(design, **dict.fromkeys(unsure, UNREAD))
    for check in (*RELATIONS, _requirements, _waivers, _correlations):
        yield from readable(check(design))


def _most(design: Design) -> Iterator[Refusal]:
    """Keys that say themselves what bounds them."""
    for field in ALL_FIELDS:
        if field.most is not None:
            yield from readable(_bounded(field, field.most, design))


def _bounded(field: Field, bound: Callable[[Design], tuple[float, str]], design: Design) -> Iterator[Refusal]:
    value, unit = getattr(part_at(design, field.section), field.attribute), field.unit(Structure.of(design))
    most, why = bound(design)
    if value > most:
        yield field.path, f"{value:g} {unit}", f"{why}; allowed: at most {most:.4g} {unit}"


def _motor(design: Design) -> Iterator[Refusal]:
    motor = design.motor
    given = {key: getattr(motor, attribute) for key, attribute in _ELECTRICAL.items()}
    if motor.source_gain_Nm_V is not None:
        for key, value in given.items():
            if value is not None:
                yield f"motor.{key}", value, "not allowed beside motor.source_gain"
        return
    for key, value in given.items():
        if value is None:
            words = "R, L, kM and kE together, or motor.source_gain alone"
            yield f"motor.{key}", "", f"missing; allowed: {words}{_without(key, design)}"
    same = design.effective_motor
    kM, kE = same.torque_constant_Nm_A, same.back_emf_constant_Vs_rad
    if kM is not None and kE is not None and abs(kE - kM) > 0.1 * kM * (1 + 1e-12):
        wanted = given["back_emf_constant"] * kM / kE
        as_written = _as_written(design, "back_emf_constant", kM / kE)
        yield (
            "motor.back_emf_constant",
            _stated(design, "back_emf_constant"),
            f"allowed: within 10 % of {wanted:g}{as_written}, as motor.torque_constant = "
            f"{_stated(design, 'torque_constant')} has it "
            f"(in SI the two are one constant){_factor_named(kE / kM)}",
        )


def _stated(design: Design, key: str) -> str:
    """A constant of the motor in SI, and as the file has it."""
    return f"{getattr(design.motor, _ELECTRICAL[key]):g}{_as_written(design, key, 1.0)}"


def _as_written(design: Design, key: str, times: float) -> str:
    """So many times a constant in the unit of its file, in brackets; nothing where that is the SI one."""
    item = design.parameters.get(f"motor.{key}")
    if item is None or item.value != getattr(design.motor, _ELECTRICAL[key]):
        return ""
    number, unit = split_quantity(item.text)
    if isclose(number, item.value, rel_tol=1e-4):
        return ""
    upside_down = _PER_VOLT.search(unit) is not None
    return f" ({number * (1.0 / times if upside_down else times):.4g} {unit})"


def _without(key: str, design: Design) -> str:
    """What to write where the sheet does not have it."""
    other = {"torque_constant": "back_emf_constant", "back_emf_constant": "torque_constant"}.get(key, "")
    held = getattr(design.motor, _ELECTRICAL[other]) if other else None
    if held is not None and design.motor.constants == "dc":
        return f"; of a DC motor it is the number of motor.{other} in SI, {held:g}"
    if held is not None:
        ratio, words = _TORQUE_OVER_VOLTAGE[design.motor.constants]
        number, sign = (held * ratio, "times") if key == "torque_constant" else (held / ratio, "over")
        return f"; with these motor.constants it is motor.{other} {sign} {words} in SI, {number:g}"
    usual = "; where the sheet has none, R times the electrical time constant, 0.1 to 1 ms of a small motor"
    return usual if key == "inductance" else ""


_TORQUE_OVER_VOLTAGE = {"rms-line": (3**0.5, "sqrt(3)"), "peak-phase": (1.5, "3/2")}
_PER_VOLT = re.compile(r"/ ?V|\bV\^?-1|V⁻¹|KV\b")  # a speed constant, kE upside down
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


def _factor_named(ratio: float) -> str:
    """The usual factor between data-sheet conventions that explains a ratio kE/kM, or nothing."""
    off, words = min((abs(abs(log(ratio)) - log(factor)), words) for words, factor in _FACTORS.items())
    return f"; the ratio is {words}" if off < 0.08 else ""


def _current_loop(design: Design) -> Iterator[Refusal]:
    if design.controller.current is not None and not design.motor.has_electrical_dynamics:
        yield "control.current", "a table", "not allowed with motor.source_gain, which has no current"


def _multiples(design: Design) -> Iterator[Refusal]:
    control = design.controller
    n_v = control.velocity.every if control.velocity else 1
    n_p = control.position.every if control.position else n_v
    if n_p % n_v:
        yield "control.position.every", n_p, f"allowed: a multiple of control.velocity.every = {n_v}"


def _delay(design: Design) -> Iterator[Refusal]:
    delay, period = design.controller.computing_delay_s, design.controller.period_s
    if delay > 100 * period:
        yield "control.computing_delay", f"{delay:g} s", f"allowed: at most 100 ticks of {period:g} s"


def _top_speed(design: Design) -> Iterator[Refusal]:
    speed, top = design.limits.speed_rad_s, no_load_speed(design)
    if top < speed < inf:
        unit = "m/s" if design.axis == "linear" else "rad/s"
        turns = "" if design.axis == "linear" else f" ({top * 30.0 / pi:.4g} rpm)"
        allowed = f"the supply cannot reach it; allowed: at most U/kE = {top:.4g} {unit}{turns}"
        yield "limits.speed", f"{speed:.4g} {unit}", allowed


def _currents(design: Design) -> Iterator[Refusal]:
    peak, continuous = design.limits.peak_current_A, design.limits.continuous_current_A
    if peak < continuous < inf:
        allowed = f"allowed: at most limits.peak_current = {peak:g} A"
        yield "limits.continuous_current", f"{continuous:g} A", allowed


FIRST_RELATIONS = (check_place, check_temperature, _motor)  # the others ask for an inertia and constants
RELATIONS = (
    _current_loop, _multiples, _delay, _most, *CONTROL_CHECKS, *ELASTIC_CHECKS, _top_speed, _currents,
)  # fmt: skip
"""Between the numbers of a drive; an exported one checks them again when they are changed."""


def _requirements(design: Design) -> Iterator[Refusal]:
    for number, item in enumerate(design.requirements):
        for check in (_named_once, _limit, _asked_of):
            yield from readable(check(item, design, number))


def _named_once(item: Requirement, design: Design, number: int) -> Iterator[Refusal]:
    if any(item.id == other.id for other in design.requirements[:number]):
        yield f"requirement.{item.id}.id", shown(item.id), "allowed: each id once"


def _limit(item: Requirement, *_: object) -> Iterator[Refusal]:
    path = f"requirement.{item.id}"
    if item.minimum is None and item.maximum is None:
        yield path, "", "missing limit; allowed: minimum, maximum or both"
    elif item.minimum is not None and item.maximum is not None and item.minimum > item.maximum:
        yield f"{path}.minimum", item.minimum, f"allowed: at most maximum = {item.maximum}"


def _asked_of(item: Requirement, design: Design, *_: object) -> Iterator[Refusal]:
    """The loop, the rotor and the response that it is of."""
    path, quantity = f"requirement.{item.id}", QUANTITIES[item.quantity]
    present = {"every", *design.controller.stages}
    if quantity.scope == "loop" and item.loop not in present:
        given = "missing" if item.loop is None else shown(item.loop)
        yield f"{path}.loop", given, f"allowed: {', '.join(sorted(present))}"
    elif quantity.scope != "loop" and item.loop is not None:
        yield f"{path}.loop", shown(item.loop), f"{item.quantity} is of the drive, no loop"
    current = "current" in present and item.loop in ("current", "every")
    if item.rotor is not None and not current:
        yield f"{path}.rotor", shown(item.rotor), "allowed: of the current loop only"
    answers = item.loop in ("position", "every") and quantity.of_response
    if item.to is not None and not (answers and "position" in present):
        allowed = "allowed: of bandwidth, resonance and step of the position loop only"
        yield f"{path}.to", shown(item.to), allowed


def _waivers(design: Design) -> Iterator[Refusal]:
    """Each for a requirement of the file, on one loop or on all, or for a check by simulation."""
    known = {item.id for item in design.requirements}
    seen: set[str] = set()
    for item in design.waivers:
        named = item.requirement in known or item.requirement.rpartition("/")[0] in known
        if item.requirement in seen or not (named or item.requirement.startswith(CHECKS)):
            allowed = f"each once: a requirement's id, id/loop, or the id of a check ({CHECKS}...)"
            path = f"waiver.{item.requirement}.requirement"
            yield path, shown(item.requirement), f"allowed: {allowed}"
        seen.add(item.requirement)


def _correlations(design: Design) -> Iterator[Refusal]:
    known = {path: item for path, item in design.parameters.items() if item is UNREAD or item.tolerance}
    matrix = np.eye(len(known))
    seen: set[frozenset[str]] = set()
    for number, item in enumerate(design.correlations, 1):
        yield from readable(_pair(item, f"correlation.{number}", tuple(known), seen, matrix))
    if known and np.linalg.eigvalsh(matrix)[0] < -1e-12:
        allowed = "the coefficients contradict each other; allowed: a positive semidefinite matrix"
        yield "correlation", "", allowed


def _pair(
    item: Correlation, path: str, known: tuple[str, ...], seen: set[frozenset[str]], matrix: np.ndarray
) -> Iterator[Refusal]:
    """One correlation, which is put into the matrix of all."""
    unknown = [key for key in ("first", "second") if getattr(item, key) not in known]
    for key in unknown:
        allowed = f"keys with a tolerance ({', '.join(known) or 'none, no value has a tolerance'})"
        yield f"{path}.{key}", shown(getattr(item, key)), f"allowed: {allowed}"
    pair = frozenset((item.first, item.second))
    if len(pair) == 1 or pair in seen:
        yield path, f'"{item.first}", "{item.second}"', "allowed: each pair once"
    elif not unknown:
        i, j = known.index(item.first), known.index(item.second)
        matrix[i, j] = matrix[j, i] = float(item.coefficient)
    seen.add(pair)
