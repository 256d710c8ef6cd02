"""Physics across keys: what cannot be is refused; what is only suspicious is warned of (`suspicions`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import inf, log

import numpy as np

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.design.checks_control import CONTROL_CHECKS
from actuator_lti.design.checks_elastic import check_elastic, check_place
from actuator_lti.design.fields import Structure, fields_in
from actuator_lti.design.mistakes import Findings, Refusal
from actuator_lti.design.model import Design
from actuator_lti.design.plant import no_load_speed
from actuator_lti.design.sections import parts_of
from actuator_lti.files.reading import shown

CHECKS = "validation"  # what the ids of checks by simulation begin with
_ELECTRICAL = {
    "resistance": "resistance_ohm",
    "inductance": "inductance_H",
    "torque_constant": "torque_constant_Nm_A",
    "back_emf_constant": "back_emf_constant_Vs_rad",
}


def check_design(design: Design, where: str, lines: Mapping[str, int] | None = None) -> None:
    """Refuse a design whose values contradict each other.

    Parameters
    ----------
    design : Design
    where : str
        Its file, for errors.
    lines : mapping, optional
        The line of each dotted key.

    Raises
    ------
    InputError
        All at once: line, key, value and what is allowed.
    """
    findings = Findings(where, lines)
    for checks in (FIRST_RELATIONS, (*RELATIONS, _requirements, _waivers, _correlations)):
        for check in checks:
            findings.extend(check(design))
        findings.refuse()


def _most(design: Design) -> Iterator[Refusal]:
    """Keys that say themselves what bounds them."""
    structure = Structure.of(design)
    for section, path, part in parts_of(design):
        for field in fields_in(section.template):
            most, why = (inf, "") if field.most is None else field.most(design)
            value, unit = getattr(part, field.attribute), field.unit(structure)
            if field.most is not None and value > most:
                yield f"{path}.{field.key}", f"{value:g} {unit}", f"{why}; allowed: at most {most:.4g} {unit}"


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
            yield f"motor.{key}", "", "missing; allowed: R, L, kM and kE together, or motor.source_gain alone"
    same = design.effective_motor
    kM, kE = same.torque_constant_Nm_A, same.back_emf_constant_Vs_rad
    if kM is not None and kE is not None and abs(kE - kM) > 0.1 * kM * (1 + 1e-12):
        wanted, torque = given["back_emf_constant"] * kM / kE, given["torque_constant"]
        yield (
            "motor.back_emf_constant",
            f"{given['back_emf_constant']:g}",
            f"allowed: within 10 % of {wanted:g}, as motor.torque_constant = {torque:g} has it "
            f"(in SI the two are one constant){_factor_named(kE / kM)}",
        )


_FACTORS = {
    "sqrt(2), rms against peak": 2**0.5,
    "sqrt(3), phase against line-line": 3**0.5,
    "sqrt(3/2), rms line-line against N m/A rms": 1.5**0.5,
    "sqrt(3) and sqrt(2) together, V rms of a phase against N m/A peak": 6**0.5,
    "3/2, dq against phase": 1.5,
    "60/(2 pi), per rpm against per rad/s": 9.549296585513721,
    "1000": 1e3,
    "9.549 V/krpm": 1e3 / 9.549296585513721,
}


def _factor_named(ratio: float) -> str:
    """The usual factor between data-sheet conventions that explains a ratio kE/kM, or nothing."""
    off, words = min((abs(abs(log(ratio)) - log(factor)), words) for words, factor in _FACTORS.items())
    return f"; the ratio is {words}: see motor.constants" if off < 0.08 else ""


def _stages(design: Design) -> Iterator[Refusal]:
    control = design.controller
    if control.current is not None and not design.motor.has_electrical_dynamics:
        yield "control.current", "a table", "not allowed with motor.source_gain, which has no current"
    n_v = control.velocity.every if control.velocity else 1
    n_p = control.position.every if control.position else n_v
    if n_p % n_v:
        yield "control.position.every", n_p, f"allowed: a multiple of control.velocity.every = {n_v}"
    delay, period = control.computing_delay_s, control.period_s
    if delay > 100 * period:
        yield "control.computing_delay", f"{delay:g} s", f"allowed: at most 100 ticks of {period:g} s"


def _limits(design: Design) -> Iterator[Refusal]:
    limits, top = design.limits, no_load_speed(design)
    peak, continuous = limits.peak_current_A, limits.continuous_current_A
    if top < limits.speed_rad_s < inf:
        unit = "m/s" if design.axis == "linear" else "rad/s"
        allowed = f"the supply cannot reach it; allowed: at most U/kE = {top:.4g} {unit}"
        yield "limits.speed", f"{limits.speed_rad_s:.4g} {unit}", allowed
    if peak < continuous < inf:
        allowed = f"allowed: at most limits.peak_current = {peak:g} A"
        yield "limits.continuous_current", f"{continuous:g} A", allowed


FIRST_RELATIONS = (check_place, _motor)  # the others ask for an inertia and for constants
RELATIONS = (_stages, _most, *CONTROL_CHECKS, check_elastic, _limits)
"""Between the numbers of a drive; an exported one checks them again when they are changed."""


def _requirements(design: Design) -> Iterator[Refusal]:
    seen: set[str] = set()
    present = {"every", *design.controller.stages}
    for item in design.requirements:
        path, quantity = f"requirement.{item.id}", QUANTITIES[item.quantity]
        if item.id in seen:
            yield f"{path}.id", shown(item.id), "allowed: each id once"
        seen.add(item.id)
        if item.minimum is None and item.maximum is None:
            yield path, "", "missing limit; allowed: minimum, maximum or both"
        elif item.minimum is not None and item.maximum is not None and item.minimum > item.maximum:
            yield f"{path}.minimum", item.minimum, f"allowed: at most maximum = {item.maximum}"
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
    index = {path: i for i, path in enumerate(p for p, item in design.parameters.items() if item.tolerance)}
    seen: set[frozenset[str]] = set()
    matrix = np.eye(len(index))
    for number, item in enumerate(design.correlations, 1):
        pair = frozenset((item.first, item.second))
        allowed = ", ".join(index) or "none, no value has a tolerance"
        unknown = [key for key in ("first", "second") if getattr(item, key) not in index]
        for key in unknown:
            path = f"correlation.{number}.{key}"
            yield path, shown(getattr(item, key)), f"allowed: keys with a tolerance ({allowed})"
        if len(pair) == 1 or pair in seen:
            yield f"correlation.{number}", f'"{item.first}", "{item.second}"', "allowed: each pair once"
        elif not unknown:
            i, j = index[item.first], index[item.second]
            matrix[i, j] = matrix[j, i] = item.coefficient
        seen.add(pair)
    if design.correlations and np.linalg.eigvalsh(matrix)[0] < -1e-12:
        yield (
            "correlation",
            "",
            "the coefficients contradict each other; allowed: a positive semidefinite matrix",
        )
