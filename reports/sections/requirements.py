"""Verdicts on the requirements of the design file."""

import math
from collections.abc import Sequence

from actuator_lti.asked.quantities import shown_unit
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.model import Requirement
from analyses.monte_carlo.result import Odds
from analyses.specification.requirements import RequirementVerdict, tally, words_of
from reports import document as doc
from reports.sections.names import in_shown
from reports.verdict_summary import worded


def section(verdicts: Sequence[RequirementVerdict]) -> doc.Section:
    id, title = "verdicts", "Requirements"
    if not verdicts:
        return doc.section(id, title, [], result="The design states no requirements.")
    intro = (
        "Requirements of the design file, judged on the sampled loops with sliding friction. "
        "Distance is what is left to the limit, negative where it is missed."
    )
    blocks, status = [doc.verdicts(map(item, verdicts))], tally(verdicts).role
    return doc.section(id, title, blocks, result=result(verdicts), intro=intro, status=status)


def result(verdicts: Sequence[RequirementVerdict]) -> str:
    """What is met and what is not; empty without any."""
    if not verdicts:
        return ""
    said = [f"{tally(verdicts).words('requirements')}."]
    for word in (Verdict.NOT_MET, Verdict.NOT_PROVEN):
        names = [label(one) + (" (waived)" if one.waiver else "") for one in verdicts if one.verdict == word]
        said += [f"{word.capitalize()}: {'; '.join(names)}."] if names else []
    return " ".join(said)


def table(verdicts: Sequence[RequirementVerdict], title: str = "Requirements") -> list[doc.Block]:
    """Requirements that are counted elsewhere too: as a table, if there are any."""
    columns = [
        doc.of("id", "id", "Requirement"),
        doc.of(label, "label", "What"),
        doc.of(lambda v: in_shown(v.value, v.requirement.unit), "value", "Found", format="sig:4"),
        doc.of(lambda v: limit_words(v.requirement), "limit", "Limit"),
        doc.of(lambda v: worded(item(v)), "verdict", "Verdict"),
    ]
    return [doc.listing(title, verdicts, columns, status=lambda v: v.role)] if verdicts else []


def item(verdict: RequirementVerdict) -> doc.VerdictItem:
    requirement = verdict.requirement
    limit, comparison = nearer_limit(verdict)
    unlimited = "unlimited" * (verdict.value is not None and math.isinf(verdict.value))
    source, note = requirement.source, requirement.note
    source += f" ({note})" if note and note != source else ""
    made = doc.verdict(
        verdict.id, label(verdict), passed=verdict.verdict, value=verdict.value, limit=limit,
        distance=verdict.distance, comparison=comparison, unit=requirement.unit, source=source,
        reason=verdict.reason or unlimited, waiver=verdict.waiver,
    )  # fmt: skip
    return {**made, "loop": verdict.loop, "quantity": requirement.quantity}


def label(verdict: RequirementVerdict) -> str:
    return words_of(verdict.requirement, verdict.loop, verdict.load_unit, verdict.rotor)


def limit_words(of: Requirement | Odds) -> str:
    """Write both limits of a requirement with the unit."""
    unit, factor = shown_unit(of.unit)
    limits = (("≥", of.minimum), ("≤", of.maximum))
    parts = [f"{sign} {factor * limit:g}" for sign, limit in limits if limit is not None]
    return f"{' and '.join(parts)} {unit}".rstrip()


def nearer_limit(verdict: RequirementVerdict) -> tuple[float | None, str]:
    of = verdict.requirement
    limit = of.bound if verdict.value is None else of.nearer(verdict.value)
    return limit, ">=" if limit == of.minimum else "<="
