"""The first screen: is the drive fit for use, what is its weakest point, and what is to be watched."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from actuator_lti.asked.quantities import AT_A_GLANCE, QUANTITIES, reserve
from analyses.linear.held_loops import HELD
from analyses.linear.loop_figures import LoopFigures
from analyses.linear.responses import frequency_grid
from analyses.specification.weakest import Spread, WeakPoint
from reports import document as doc
from reports.document_schema import (
    Block,
    GlanceBlock,
    GlanceFigure,
    GlanceLoop,
    Section,
    Status,
    VerdictItem,
    Weakest,
)
from reports.findings import Finding, gathered, plain
from reports.numbers import capital, short
from reports.sections import loop as loop_section
from reports.sections.margins import margin_row, range_words, shown, worst_status
from reports.sections.names import LOOPS, POINTS, loop_words

SHOWN = 5


def section(
    figures: Mapping[str, LoopFigures],
    items: Sequence[VerdictItem],
    sections: Sequence[Section],
    point: WeakPoint | None = None,
    ranges: Mapping[str, Mapping[str, Spread]] | None = None,
) -> Section:
    """Make the first screen from the loops, the verdicts on the requirements and all other sections.

    ``point`` is the weakest of all views, ``ranges`` the margins over the operating points.
    """
    result = gathered(sections)
    glance: GlanceBlock = {
        "kind": "glance",
        "loops": [_loop(name, one, items, (ranges or {}).get(name, {})) for name, one in figures.items()],
        "weakest": weakest(point) if point else None,
        "findings": plain(result[:SHOWN]),
        "more": max(len(result) - SHOWN, 0),
    }
    status = worst_status([one.sound for one in figures.values()])
    if any(item["verdict"] == "not met" for item in items) or any(item.severity == "fail" for item in result):
        status = "fail"
    return doc.section("answer", "At a glance", [glance, *_pictures(figures)], status=status)


def _loop(
    name: str, figures: LoopFigures, items: Sequence[VerdictItem], ranges: Mapping[str, Spread]
) -> GlanceLoop:
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
                "spread": range_words(ranges[quantity.name]) if quantity.name in ranges else "",
            }
        )
    stable = margin_row(figures.judged)["stable"]
    if figures.held is not None:
        stable = {**stable, "text": f"{stable['text']}, {HELD[name]}"}
    return {
        "loop": loop_words(name, figures.rotor),
        "anchor": f"loop-{name}",
        "stable": stable,
        "figures": cells,
    }


def weakest(point: WeakPoint) -> Weakest:
    """Say which margin of which view has least left to its limit, or lies furthest beyond it."""
    view = point.view
    loop = loop_words(view.loop, view.rotor) if view.loop else ""
    cut = f"cut at the {POINTS.get(view.cut, view.cut)}" if view.cut else ""
    label = ", ".join(filter(None, (loop, view.place, cut)))
    label = capital(label)
    if not point.quantity:
        return {"label": label, "words": "not stable", "status": "warn" if view.place else "fail"}
    quantity = QUANTITIES[point.quantity]
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    kind, left = "required" if point.required else "customary", point.value - point.limit
    side = "inside" if left >= 0.0 else "beyond"
    words = (
        f"{quantity.words} {short(point.value, 3)}{unit}, {kind} {short(point.limit, 6)}{unit}: "
        f"{short(abs(left), 3)}{unit} {side}"
    )
    status: Status = "pass" if left >= 0.0 else "fail" if point.required else "warn"
    return {"label": label, "words": words, "status": status}


def _nearness(item: VerdictItem) -> float:
    """What is left to the limit; without a distance the requirement is as good as far away."""
    if item["distance"] is None or item["value"] is None or item["limit"] is None:
        return math.inf
    return reserve(item.get("quantity", ""), item["value"], item["limit"], item["distance"])


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
