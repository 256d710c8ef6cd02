"""Physics across keys: what cannot be is refused, what is only suspicious is warned of."""

from __future__ import annotations

from datetime import date
from math import inf, log

import numpy as np

from actuator_lti.design.checks_control import check_control
from actuator_lti.design.checks_elastic import check_elastic, check_place
from actuator_lti.design.fields import Structure, fields_in
from actuator_lti.design.model import Design
from actuator_lti.design.plant import no_load_speed
from actuator_lti.design.sections import parts_of
from actuator_lti.errors import InputError
from actuator_lti.reading import shown

CHECKS = "validation"  # what the ids of checks by simulation begin with
_ELECTRICAL = {
    "resistance": "resistance_ohm",
    "inductance": "inductance_H",
    "torque_constant": "torque_constant_Nm_A",
    "back_emf_constant": "back_emf_constant_Vs_rad",
}


def check_design(design: Design, where: str) -> None:
    """Refuse a design whose values contradict each other.

    Raises
    ------
    InputError
        One line: key, value and what is allowed.
    """
    for check in (*RELATIONS, _requirements, _waivers, _correlations):
        check(design, where)


def _refuse(where: str, key: str, value: object, allowed: str) -> InputError:
    return InputError(f"{key} = {value}: {allowed}", where=where)


def _most(design: Design, where: str) -> None:
    """Keys that say themselves what bounds them."""
    structure = Structure.of(design)
    for section, path, part in parts_of(design):
        for field in fields_in(section.template):
            most, why = (inf, "") if field.most is None else field.most(design)
            value, unit = getattr(part, field.attribute), field.unit(structure)
            if field.most is not None and value > most:
                allowed = f"{why}; allowed: at most {most:.4g} {unit}"
                raise _refuse(where, f"{path}.{field.key}", f"{value:g} {unit}", allowed)


def _motor(design: Design, where: str) -> None:
    motor = design.motor
    given = {key: getattr(motor, attribute) for key, attribute in _ELECTRICAL.items()}
    if motor.source_gain_Nm_V is not None:
        for key, value in given.items():
            if value is not None:
                raise _refuse(where, f"motor.{key}", value, "not allowed beside motor.source_gain")
        return
    for key, value in given.items():
        if value is None:
            raise InputError(
                f"motor.{key}: missing; allowed: R, L, kM and kE together, or motor.source_gain alone",
                where=where,
            )
    same = design.effective_motor
    kM, kE = same.torque_constant_Nm_A or 0.0, same.back_emf_constant_Vs_rad or 0.0
    if abs(kE - kM) > 0.1 * kM * (1 + 1e-12):
        raise _refuse(
            where,
            "motor.back_emf_constant",
            f"{given['back_emf_constant']:g}",
            f"allowed: within 10 % of {given['back_emf_constant'] * kM / kE:g}, as motor.torque_constant = "
            f"{given['torque_constant']:g} has it (in SI the two are one constant){_factor_named(kE / kM)}",
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


def _cascade(design: Design, where: str) -> None:
    if design.controller.current is not None and not design.motor.has_electrical_dynamics:
        raise _refuse(
            where, "control.current", "a table", "not allowed with motor.source_gain, which has no current"
        )


def _sampling(design: Design, where: str) -> None:
    control = design.controller
    n_v = control.velocity.every if control.velocity else 1
    n_p = control.position.every if control.position else n_v
    if n_p % n_v:
        raise _refuse(
            where, "control.position.every", n_p, f"allowed: a multiple of control.velocity.every = {n_v}"
        )
    if control.computing_delay_s > 100 * control.period_s:
        raise _refuse(
            where,
            "control.computing_delay",
            f"{control.computing_delay_s:g} s",
            f"allowed: at most 100 ticks of {control.period_s:g} s",
        )


def _limits(design: Design, where: str) -> None:
    limits = design.limits
    top = no_load_speed(design)
    if top < limits.speed_rad_s < inf:
        unit = "m/s" if design.axis == "linear" else "rad/s"
        raise _refuse(
            where,
            "limits.speed",
            f"{limits.speed_rad_s:.4g} {unit}",
            f"the supply cannot reach it; allowed: at most U/kE = {top:.4g} {unit}",
        )
    if limits.peak_current_A < limits.continuous_current_A < inf:
        raise _refuse(
            where,
            "limits.continuous_current",
            f"{limits.continuous_current_A:g} A",
            f"allowed: at most limits.peak_current = {limits.peak_current_A:g} A",
        )


# between the numbers of a drive; the exported one checks them again when they are changed
RELATIONS = (
    check_place, _motor, _cascade, _sampling, _most, check_control, check_elastic, _limits,
)  # fmt: skip


def _requirements(design: Design, where: str) -> None:
    from actuator_lti.design.quantities import QUANTITIES

    seen: set[str] = set()
    present = {"every", *design.controller.stages}
    for item in design.requirements:
        path = f"requirement.{shown(item.id)[1:-1]}"
        if item.id in seen:
            raise _refuse(where, "requirement.id", shown(item.id), "allowed: each id once")
        seen.add(item.id)
        if item.minimum is None and item.maximum is None:
            raise InputError(f"{path}: missing limit; allowed: minimum, maximum or both", where=where)
        if item.minimum is not None and item.maximum is not None and item.minimum > item.maximum:
            raise _refuse(
                where, f"{path}.minimum", item.minimum, f"allowed: at most maximum = {item.maximum}"
            )
        if QUANTITIES[item.quantity].scope == "loop":
            if item.loop not in present:
                given = "missing" if item.loop is None else shown(item.loop)
                raise _refuse(where, f"{path}.loop", given, f"allowed: {', '.join(sorted(present))}")
        elif item.loop is not None:
            raise _refuse(
                where, f"{path}.loop", shown(item.loop), f"{item.quantity} is of the drive, no loop"
            )
        current = "current" in present and item.loop in ("current", "every")
        if item.rotor is not None and not current:
            raise _refuse(where, f"{path}.rotor", shown(item.rotor), "allowed: of the current loop only")
        answers = item.loop in ("position", "every") and QUANTITIES[item.quantity].of_response
        if item.to is not None and not (answers and "position" in present):
            allowed = "allowed: of bandwidth, resonance and step of the position loop only"
            raise _refuse(where, f"{path}.to", shown(item.to), allowed)


def _waivers(design: Design, where: str) -> None:
    """Each for a requirement of the file, on one loop or on all, or for a check by simulation; dated."""
    known = {item.id for item in design.requirements}
    seen: set[str] = set()
    for item in design.waivers:
        path = f"waiver.{shown(item.requirement)[1:-1]}"
        named = item.requirement in known or item.requirement.rpartition("/")[0] in known
        if item.requirement in seen or not (named or item.requirement.startswith(CHECKS)):
            allowed = f"each once: a requirement's id, id/loop, or the id of a check ({CHECKS}...)"
            raise _refuse(where, "waiver.requirement", shown(item.requirement), f"allowed: {allowed}")
        seen.add(item.requirement)
        if not item.reason.strip():
            raise _refuse(where, f"{path}.reason", shown(item.reason), "allowed: a text")
        try:
            date.fromisoformat(item.date)
        except ValueError:
            raise _refuse(where, f"{path}.date", shown(item.date), "allowed: a day, YYYY-MM-DD") from None


def _correlations(design: Design, where: str) -> None:
    index = {path: i for i, path in enumerate(_toleranced(design))}
    seen: set[frozenset[str]] = set()
    for item in design.correlations:
        pair = frozenset((item.first, item.second))
        for path in (item.first, item.second):
            if path not in index:
                allowed = ", ".join(index) or "none, no value has a tolerance"
                raise _refuse(
                    where, "correlation", shown(path), f"allowed: keys with a tolerance ({allowed})"
                )
        if len(pair) == 1 or pair in seen:
            raise _refuse(where, "correlation", f'"{item.first}", "{item.second}"', "allowed: each pair once")
        if not abs(item.coefficient) <= 1.0:
            raise _refuse(where, "correlation.coefficient", item.coefficient, "allowed: -1 to 1")
        seen.add(pair)
    if design.correlations:
        _check_definite(design, index, where)


def _toleranced(design: Design) -> list[str]:
    return [path for path, item in design.parameters.items() if item.tolerance is not None]


def _check_definite(design: Design, index: dict[str, int], where: str) -> None:
    matrix = np.eye(len(index))
    for item in design.correlations:
        i, j = index[item.first], index[item.second]
        matrix[i, j] = matrix[j, i] = item.coefficient
    if np.linalg.eigvalsh(matrix)[0] < -1e-12:
        raise InputError(
            "correlation: the coefficients contradict each other; allowed: a positive semidefinite matrix",
            where=where,
        )
