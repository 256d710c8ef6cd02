"""Physics across keys: what cannot be is refused; what is only suspicious is warned of (`suspicions`)."""

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from actuator_lti.asked.quantities import QUANTITIES, with_unit
from actuator_lti.design.checks_control import CONTROL_CHECKS
from actuator_lti.design.checks_plant import FIRST_RELATIONS, PLANT_CHECKS, with_stand_ins
from actuator_lti.design.field import Field, Structure
from actuator_lti.design.fields import FIELDS, TABLES, at_place, fields_in, parts_of, template_of
from actuator_lti.design.mistakes import UNREAD, Check, Findings, Refusal, UnreadError, printed, readable
from actuator_lti.design.model import Correlation, Design, Requirement
from actuator_lti.design.rule import value_of
from actuator_lti.files.reading import shown

_NUMBER = re.compile(r"[-+]?[0-9.]+(e[-+]?[0-9]+)?\Z")
CHECKS = "validation"  # what the ids of checks by simulation begin with


def check_design(design: Design, where: str) -> None:
    """Refuse what no file may hold, values out of range or that contradict: all at once, by an InputError."""
    Findings(where).refuse(misplaced(design))
    Findings(where).refuse(out_of_range(design))  # the relations ask for numbers that are some
    Findings(where).refuse(contradictions(design))


def misplaced(design: Design) -> Iterator[Refusal]:
    """Of a design made in Python: parts that are of another kind than what has to stand there."""
    wrong = set[str]()
    for section in TABLES:
        if section.parent in wrong:
            wrong.add(section.path)
            continue
        part, kind = at_place(design, section.place), section.kind.__name__
        absent = at_place(design, section.place.rpartition(".")[0]) is None if section.parent else False
        if absent or (part is None and section.optional and not section.many):
            continue
        several = part if isinstance(part, tuple | list) else (None,)
        if not all(isinstance(one, section.kind) for one in (several if section.many else (part,))):
            wrong.add(section.path)
            allowed = f"a tuple of {kind}" if section.many else f"{kind}{' or None' * section.optional}"
            yield section.path, shown(part), f"allowed: {allowed}"


def out_of_range(design: Design) -> Iterator[Refusal]:
    """Of a design made in Python: numbers outside their range, or that are none, and unknown words."""
    axis = FIELDS["design.axis"]
    if not axis.fits(design.axis):  # all units follow from it
        yield "design.axis", shown(design.axis), f"allowed: {axis.allowed('1')}"
        return
    structure = Structure.of(design)
    for section, path, part in parts_of(design):
        for field in fields_in(section.template):
            value = getattr(part, field.attribute)
            needed = field.required and getattr(part, "law", None) is None
            left_out = not needed and type(value) is type(field.default) and value == field.default
            if not (left_out or field.fits(value)):
                yield f"{path}.{field.key}", shown(value), f"allowed: {field.allowed(field.unit(structure))}"


def contradictions(design: Design) -> Iterator[Refusal]:
    """What the relations between keys refuse, of all those whose own keys are read; numbers with units."""
    for path, given, allowed in _contradictions(design):
        field = FIELDS.get(template_of(path))
        number = isinstance(given, float) or (isinstance(given, str) and _NUMBER.match(given))
        with suppress(UnreadError):
            if number and field is not None and (unit := field.unit(Structure.of(design))) != "1":
                given = f"{float(f'{given}'):g} {unit}"
        yield path, given, allowed


def _contradictions(design: Design) -> Iterator[Refusal]:
    for check in FIRST_RELATIONS:
        refused = tuple(readable(check(design)))
        yield from refused
        unsure = {path.partition(".")[0] for path, *_ in refused} - {"motor"}
        design = replace(design, **dict.fromkeys(unsure, UNREAD))
    with suppress(UnreadError):
        design = with_stand_ins(design)
    for check in (*RELATIONS, _cogging, _requirements, _waivers, _correlations):
        yield from readable(check(design))


def _most(design: Design) -> Iterator[Refusal]:
    """Keys that say themselves what bounds them."""
    for field in FIELDS.values():
        if field.most is not None:
            yield from readable(_bounded(field, field.most, design))


def _bounded(field: Field, bound: Callable[[Design], tuple[float, str]], design: Design) -> Iterator[Refusal]:
    value, unit = value_of(design, field.path), field.unit(Structure.of(design))
    (most, why), unit = bound(design), "" if unit == "1" else f" {unit}"
    if value > most:
        yield field.path, f"{value:g}{unit}", f"{why}; allowed: at most {most:.4g}{unit}"


RELATIONS: tuple[Check, ...] = (_most, *CONTROL_CHECKS, *PLANT_CHECKS)
"""Between the numbers of a drive; an exported one checks them again when they are changed."""


def _cogging(design: Design) -> Iterator[Refusal]:
    """The order of the cogging has no usual value per metre; that is a period of 6.28 m."""
    periods, given = design.motor.cogging_periods, "motor.cogging_periods" in design.parameters
    if design.axis == "linear" and design.motor.cogging_Nm > 0.0 and periods == 1.0 and not given:
        allowed = 'a magnet pitch, as "24 mm", or with a [screw] periods of a revolution, as 20'
        yield "motor.cogging_periods", "", f"missing; motor.cogging needs it; allowed: {allowed}"


def _requirements(design: Design) -> Iterator[Refusal]:
    known: list[str] = []
    for number, item in enumerate(design.requirements, 1):
        named = item.id is not UNREAD and item.id not in known
        path = f"requirement.{item.id}" if named else f"requirement[{number}]"
        if not named and item.id is not UNREAD:
            yield f"{path}.id", shown(item.id), "allowed: each id once"
        known += [item.id] if named else []
        for check in (_limits, _of_loop, _of_rotor, _of_response):
            yield from readable(check(design, path, item))


def _limits(_: Design, path: str, item: Requirement) -> Iterator[Refusal]:
    if item.minimum is None and item.maximum is None:
        yield path, "", "missing limit; allowed: minimum, maximum or both"
    signed = QUANTITIES[item.quantity].signed  # no limit is read of a quantity that is none
    for key, limit in (("minimum", item.minimum), ("maximum", item.maximum)):
        if limit is not None and limit is not UNREAD and limit < 0.0 and not signed:
            allowed = f"allowed: at least {with_unit(0.0, item.unit)}"
            yield f"{path}.{key}", with_unit(limit, item.unit), allowed
    if item.minimum is not None and item.maximum is not None and item.minimum > item.maximum:
        least, most = with_unit(item.minimum, item.unit), with_unit(item.maximum, item.unit)
        yield f"{path}.minimum", least, f"allowed: at most maximum = {most}"


def _of_loop(design: Design, path: str, item: Requirement) -> Iterator[Refusal]:
    present = {"every", *design.controller.stages}
    unsaid = item.quantity is UNREAD  # a loop that is named is one all the same
    of_loop = item.loop is not None if unsaid else QUANTITIES[item.quantity].scope == "loop"
    if of_loop and item.loop not in present:
        given = "missing" if item.loop is None else shown(item.loop)
        yield f"{path}.loop", given, f"allowed: {', '.join(sorted(present))}"
    elif not of_loop and item.loop is not None:
        yield f"{path}.loop", printed(item.loop), f"{item.quantity} is of the drive, no loop"


def _of_rotor(design: Design, path: str, item: Requirement) -> Iterator[Refusal]:
    there = "current" in design.controller.stages
    if item.rotor is not None and not (there and item.loop in ("current", "every")):
        yield f"{path}.rotor", printed(item.rotor), "allowed: of the current loop only"


def _of_response(design: Design, path: str, item: Requirement) -> Iterator[Refusal]:
    there = "position" in design.controller.stages and item.loop in ("position", "every")
    if item.to is not None and not (there and QUANTITIES[item.quantity].of_response):
        allowed = "allowed: of bandwidth, resonance and step of the position loop only"
        yield f"{path}.to", printed(item.to), allowed


def _waivers(design: Design) -> Iterator[Refusal]:
    known = {item.id for item in design.requirements}
    seen: set[str] = set()
    for id in (item.requirement for item in design.waivers):
        if id in seen or not ({id, id.rpartition("/")[0]} & known or id.startswith(CHECKS)):
            allowed = f"each once: a requirement's id, id/loop, or the id of a check ({CHECKS}...)"
            yield f"waiver.{id}.requirement", shown(id), f"allowed: {allowed}"
        seen.add(id)


def _correlations(design: Design) -> Iterator[Refusal]:
    known = [path for path, item in design.parameters.items() if item is UNREAD or item.tolerance]
    matrix = np.eye(len(known))
    seen: set[frozenset[str]] = set()
    for number, item in enumerate(design.correlations, 1):
        yield from readable(_pair(item, f"correlation.{number}", known, seen, matrix))
    if known and np.linalg.eigvalsh(matrix)[0] < -1e-12:
        allowed = "the coefficients contradict each other; allowed: a positive semidefinite matrix"
        yield "correlation", "", allowed


def _pair(
    item: Correlation, path: str, known: list[str], seen: set[frozenset[str]], matrix: np.ndarray
) -> Iterator[Refusal]:
    """One correlation, which is put into the matrix of all."""
    named = {"first": item.first, "second": item.second}
    unknown = {key: one for key, one in named.items() if one is not UNREAD and one not in known}
    for key, one in unknown.items():
        allowed = f"keys with a tolerance ({', '.join(known) or 'none, no value has a tolerance'})"
        yield f"{path}.{key}", shown(one), f"allowed: {allowed}"
    pair = frozenset((item.first, item.second))
    if len(pair) == 1 or pair in seen:
        yield path, f'"{item.first}", "{item.second}"', "allowed: each pair once"
    elif not unknown:
        i, j = known.index(item.first), known.index(item.second)
        matrix[i, j] = matrix[j, i] = float(item.coefficient)
    seen.add(pair)
