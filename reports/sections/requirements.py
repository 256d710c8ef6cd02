"""Verdicts on the requirements of the design file."""

from __future__ import annotations

import math
from collections.abc import Sequence

from analyses.requirements import RequirementVerdict, all_pass
from reports import document as doc
from reports.document_schema import Section, Status, VerdictItem
from reports.sections.names import QUANTITIES


def section(verdicts: Sequence[RequirementVerdict], load_unit: str = "N m") -> Section:
    """Make the section from the verdicts; ``load_unit`` is N for a linear axis."""
    if not verdicts:
        none = "The design file states no requirement."
        return doc.section("verdicts", "Requirements", [], result=none, status="info")
    intro = (
        "Requirements of the design file, judged on the sampled loops with sliding friction. "
        "Distance is what is left to the limit, negative where it is missed."
    )
    items = [item(verdict, load_unit) for verdict in verdicts]
    status: Status = "pass" if all_pass(tuple(verdicts)) else "fail"
    return doc.section(
        "verdicts", "Requirements", [doc.verdicts(items)], result=result(items), intro=intro, status=status
    )


def result(items: Sequence[VerdictItem]) -> str:
    """Say how many requirements are met, and which are not."""
    failed = [item["label"] for item in items if item["passed"] is False]
    unjudged = sum(item["passed"] is None for item in items)
    rest = f" {unjudged} cannot be judged." if unjudged else ""
    if failed:
        return f"{counted(len(failed), len(items))} not met: {'; '.join(failed)}.{rest}"
    met = len(items) - unjudged
    if not unjudged and met > 1:
        return f"All {met} requirements are met."
    return f"{counted(met, len(items))} met.{rest}"


def counted(count: int, total: int) -> str:
    """Say "1 of 9 requirements is", "2 of 9 requirements are", "The requirement is" (of one).

    Examples
    --------
    >>> counted(1, 9), counted(2, 9), counted(1, 1)
    ('1 of 9 requirements is', '2 of 9 requirements are', 'The requirement is')
    """
    if count == total == 1:
        return "The requirement is"
    return f"{count} of {total} requirement{'s' if total != 1 else ''} {'is' if count == 1 else 'are'}"


def item(verdict: RequirementVerdict, load_unit: str = "N m") -> VerdictItem:
    """Make one line of the verdicts."""
    requirement = verdict.requirement
    limit, comparison = _limit(verdict)
    reason = verdict.reason
    if verdict.value is not None and math.isinf(verdict.value):
        reason = reason or "unlimited"
    source = requirement.source + (
        f" ({requirement.note})" if requirement.note and requirement.note != requirement.source else ""
    )
    made = doc.verdict(
        verdict.id,
        label(verdict, load_unit),
        value=verdict.value,
        limit=limit,
        comparison=comparison,
        unit="" if requirement.unit == "1" else requirement.unit,
        distance=verdict.distance,
        passed=verdict.passed,
        source=source,
        reason=reason,
    )
    return {**made, "loop": verdict.loop, "quantity": requirement.quantity}


def label(verdict: RequirementVerdict, load_unit: str = "N m") -> str:
    """Say what is required of what, in words."""
    requirement = verdict.requirement
    what = QUANTITIES.get(requirement.quantity, requirement.quantity)
    if verdict.loop is not None:
        return f"{verdict.loop.capitalize()} loop: {what}"
    load = "" if requirement.load_Nm is None else f" at {requirement.load_Nm:g} {load_unit}"
    return f"Drive: {what}{load}"


def _limit(verdict: RequirementVerdict) -> tuple[float | None, str]:
    """Give the limit that is nearer, and the side that is good."""
    low, high = verdict.requirement.minimum, verdict.requirement.maximum
    if low is None:
        return high, "<="
    if high is None or verdict.value is None:
        return low, ">="
    return (low, ">=") if verdict.value - low <= high - verdict.value else (high, "<=")
