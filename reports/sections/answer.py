"""The first screen: is the drive fit for use, what is its weakest point, and what is to be watched."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from actuator_lti.quantities import AT_A_GLANCE
from analyses.held_loops import HELD
from analyses.loop_figures import LoopFigures
from analyses.responses import frequency_grid
from reports import document as doc
from reports.document_schema import (
    Block,
    GlanceBlock,
    GlanceFigure,
    GlanceLoop,
    Section,
    VerdictItem,
    Weakest,
)
from reports.findings import Finding, gathered, plain
from reports.numbers import short
from reports.sections import loop as loop_section
from reports.sections.margins import margin_row, shown, worst_status
from reports.sections.names import LOOPS
from reports.verdict_summary import role

SHOWN = 5


def section(
    figures: Mapping[str, LoopFigures],
    items: Sequence[VerdictItem],
    sections: Sequence[Section],
) -> Section:
    """Make the first screen from the loops, the verdicts on the requirements and all other sections."""
    result = gathered(sections)
    glance: GlanceBlock = {
        "kind": "glance",
        "loops": [_loop(name, one, items) for name, one in figures.items()],
        "weakest": weakest(items),
        "findings": plain(result[:SHOWN]),
        "more": max(len(result) - SHOWN, 0),
    }
    status = worst_status([one.sound for one in figures.values()])
    if any(item["verdict"] == "not met" for item in items) or any(item.severity == "fail" for item in result):
        status = "fail"
    return doc.section("answer", "At a glance", [glance, *_pictures(figures)], status=status)


def _loop(name: str, figures: LoopFigures, items: Sequence[VerdictItem]) -> GlanceLoop:
    """Give the chosen figures of a loop, each with the requirement that is nearest to it."""
    cells: list[GlanceFigure] = []
    for quantity in AT_A_GLANCE:
        own = [item for item in items if item.get("quantity") == quantity.name and item.get("loop") == name]
        nearest = min(own, key=_nearness, default=None)
        cells.append(
            {
                "label": quantity.label,
                "value": shown(quantity, figures.judged),
                "unit": quantity.shown[0],
                "format": quantity.at_a_glance,
                "limit": nearest["limit"] if nearest else None,
                "comparison": nearest["comparison"] if nearest else "",
                "distance": nearest["distance"] if nearest else None,
                "verdict": nearest["verdict"] if nearest else None,
            }
        )
    stable = margin_row(figures.judged)["stable"]
    if figures.held is not None:
        stable = {**stable, "text": f"{stable['text']}, {HELD[name]}"}
    return {"loop": LOOPS[name], "anchor": f"loop-{name}", "stable": stable, "figures": cells}


def weakest(items: Sequence[VerdictItem]) -> Weakest | None:
    """Give the requirement that is nearest to its limit, or furthest beyond it, as part of the limit."""
    ranked = [item for item in items if item.get("distance") is not None and item.get("limit")]
    item = min(ranked, key=_nearness, default=None)
    if item is None:
        return None
    distance, found, bound, unit = item["distance"], item["value"], item["limit"], item["unit"]
    assert distance is not None
    assert found is not None
    assert bound is not None
    share = 100.0 * abs(_nearness(item))
    side, value = "inside" if distance >= 0.0 else "beyond", short(found, 4)
    limit = f"{item['comparison']} {short(bound, 6)}".strip()
    words = f"{value} {unit}, limit {limit} {unit}: {share:.0f} % {side} its limit"
    return {"label": item["label"], "words": " ".join(words.split()), "status": role(item)}


def _nearness(item: VerdictItem) -> float:
    """Distance to the limit over the limit; without a distance the requirement is as good as far away."""
    if item["distance"] is None or not item["limit"]:
        return 1e9
    return float(item["distance"]) / abs(float(item["limit"]))


def _pictures(figures: Mapping[str, LoopFigures]) -> list[Block]:
    """Make one Bode and one step figure, of the outermost loop; none of a drive without loops."""
    if not figures:
        return []
    name, result = list(figures.items())[-1]
    blocks = [loop_section.open_bode(LOOPS[name], result, frequency_grid(result), name=name, small=True)]
    if result.step is not None:
        blocks.append(loop_section.step(LOOPS[name], result, None, name=name, small=True))
    return blocks


def unchecked() -> Finding:
    """Give the finding of a report that no simulation stands behind."""
    text = "No simulation stands behind this report: friction, limits and large commands are not checked."
    return Finding(severity="warn", text=text, where="provenance")
