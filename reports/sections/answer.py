"""The first screen: is the drive fit for use, what is its weakest point, and what is to be watched."""

import math
from collections.abc import Mapping, Sequence
from typing import cast

from actuator_lti.asked.quantities import AT_A_GLANCE, QUANTITIES, reserve, shown_unit
from actuator_lti.design.model import Design
from actuator_lti.design.writing import value_as_stated
from analyses.corners.run import Corners
from analyses.linear.loop_figures import HELD, LoopFigures
from analyses.linear.responses import frequency_grid
from analyses.specification.mending import Move
from analyses.specification.weakest import Spread, View, WeakPoint
from analyses.tuning.problem import SPAN
from reports import document as doc
from reports.document_schema import Bar, GlanceBlock, GlanceFigure, GlanceLoop, Weakest
from reports.numbers import capital, power_of_ten, prose, short
from reports.sections import loop as loop_section
from reports.sections import loop_charts
from reports.sections.margins import margin_row, range_words, shown, worst_status
from reports.sections.names import LOOPS, POINTS, loop_words
from reports.verdict_summary import gathered, tally

SHOWN = 3
MOST_BARS = 12
NO_MOVE = (
    f"No gain alone, up to {SPAN:g} times larger or smaller, mends it without losing a requirement or "
    "another margin"
)


def section(
    figures: Mapping[str, LoopFigures], items: Sequence[doc.VerdictItem], sections: Sequence[doc.Section],
    point: WeakPoint | None = None, ranges: Mapping[str, Mapping[str, Spread]] | None = None, *,
    bounds: Corners | None = None, mend: str = "",
) -> doc.Section:  # fmt: skip
    """Make the first screen from the loops, the verdicts on the requirements and all other sections.

    ``point`` is the weakest of all views and ``mend`` the words of the move that mends it; ``ranges`` are the
    margins over the operating points, ``bounds`` the corners, between which each requirement's figure lies.
    """
    linear = next((part.get("result", "") for part in sections if part["id"] == "limits"), "")
    found = [item for item in gathered(sections) if item["text"] != linear]
    apart: dict[str, doc.Finding] = {}  # the same seen by two margins stands once on the first screen
    for item in found:
        apart.setdefault(item["text"].partition(";")[0], item)
    bars = _bars(items, bounds)
    glance: GlanceBlock = {
        "kind": "glance",
        "loops": [_loop(name, one, items, (ranges or {}).get(name, {})) for name, one in figures.items()],
        "weakest": {**weakest(point), "move": mend} if point else None,
        "believed": believed(sections),
        "linear": linear,
        "bars": bars[:MOST_BARS],
        "more_bars": max(len(bars) - MOST_BARS, 0),
        "findings": [*apart.values()][:SHOWN],
        "more": len(found) - min(len(apart), SHOWN),
    }
    failed = "not met" in [item["verdict"] for item in items] or "fail" in [one["severity"] for one in found]
    status = "fail" if failed else worst_status([one.is_stable for one in figures.values()])
    return doc.section("answer", "At a glance", [glance, *_pictures(figures, point)], status=status)


def believed(sections: Sequence[doc.Section]) -> str:
    """Say in one line how far linear and simulated agree, and what is not proven."""
    blocks = [block for part in sections for block in doc.walk(part)]
    checks = doc.judged(block for block in blocks if block.get("what") == "checks")
    if not checks:
        return "Not checked by simulation."
    tested = [block for part in sections if part["id"] == "validation" for block in doc.walk(part)]
    rows = [row for block in tested if block["kind"] == "table" for row in block["rows"]]
    relative = [row.get("error") for row in rows if row.get("predicted") is None and not row.get("unit")]
    errors, count = [error for error in relative if isinstance(error, float)], tally(checks)
    words = [f"Linear equals simulated to {power_above(max(errors))}"] if errors and max(errors) > 0.0 else []
    words += [f"{count.met} of {count.total} checks by simulation met"]
    words += [f"{count.not_met} not met"] if count.not_met else []
    open_ones = sum(item["verdict"] == "not proven" for item in checks)
    words += [f"{open_ones} not proven" if open_ones else "nothing unproven"]
    return capital("; ".join(words)) + "."


def power_above(value: float) -> str:
    """The power of ten that a value does not pass.

    >>> power_above(2.3e-9), power_above(1e-9), power_above(2.3e-4)
    ('10⁻⁸', '10⁻⁹', '10⁻³')
    """
    return power_of_ten(math.ceil(math.log10(value) - 1e-9))


def _bars(items: Sequence[doc.VerdictItem], bounds: Corners | None) -> list[Bar]:
    limited = [item for item in items if item["limit"] is not None]
    known = [item for item in limited if item["value"] is not None or _lost(item)]
    found: dict[tuple[str, str | None], list[float]] = {}
    for corner in bounds.corners if bounds else ():
        for one in corner.verdicts:
            if one.value is not None and math.isfinite(one.value):
                factor = shown_unit(one.requirement.unit)[1]
                found.setdefault((one.id, one.loop), []).append(factor * one.value)
    bars = []
    for item in sorted(known, key=lambda item: -math.inf if _lost(item) else _nearness(item)):
        values = found.get((item["id"], item.get("loop")), [])
        kept = {name: value for name, value in item.items() if name in Bar.__annotations__}
        bars.append(cast(Bar, {**kept, "band": [min(values), max(values)] if values else None}))
    return bars


def _lost(item: doc.VerdictItem) -> bool:
    """Whether it is not met and has no figure, as of a loop that is not stable."""
    return item["value"] is None and item["verdict"] == "not met"


def move_words(design: Design, move: Move) -> str:
    """Say a move in the unit in which the design file has the gain.

    >>> from actuator_lti import load_design
    >>> move_words(load_design("ilr33-amber"), Move("control.velocity.integral_time", 0.015, 0.0286))
    'control.velocity.integral_time 15 ms to 28.6 ms mends it'
    """
    was, value = (value_as_stated(design, move.path, value) for value in (move.was, move.value))
    return prose(f"{move.path} {was} to {value} mends it")


def _loop(
    name: str, figures: LoopFigures, items: Sequence[doc.VerdictItem], ranges: Mapping[str, Spread]
) -> GlanceLoop:
    cells: list[GlanceFigure] = []
    for quantity in AT_A_GLANCE:
        own = [item for item in items if item.get("quantity") == quantity.name and item.get("loop") == name]
        # with the rotor locked, or to the reference, it is another figure than that of the cell
        own = [item for item in own if item["value"] in (None, quantity.read(figures.judged))]
        nearest = min(own, key=_nearness, default=None)
        over = ranges.get(quantity.name)
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
                "spread": range_words(over, quantity.name) if over else "",
            }
        )
    stable = margin_row(figures.judged)["stable"]
    if figures.held is not None:
        stable = {**stable, "text": f"{stable['text']}, {HELD[name]}"}
    words = loop_words(name, figures.rotor)
    return {"loop": words, "anchor": f"loop-{name}", "stable": stable, "figures": cells}


def weakest(point: WeakPoint) -> Weakest:
    """Say which margin of which view has least left to its limit, or lies furthest beyond it."""
    view, label = point.view, weakest_label(point.view)
    if not point.quantity:
        return {"label": label, "words": "not stable", "status": "warn" if view.place else "fail"}
    quantity = QUANTITIES[point.quantity]
    unit = "" if quantity.unit == "1" else f" {quantity.unit}"
    kind, left = "required" if point.required else "customary", point.value - point.limit
    side = "above" if left >= 0.0 else "below"
    words = (
        f"{quantity.words} {short(point.value, 3)}{unit}, {kind} {short(point.limit, 6)}{unit}: "
        f"{short(abs(left), 3)}{unit} {side}"
    )
    status: doc.Status = "pass" if left >= 0.0 else "fail" if point.required else "warn"
    return {"label": label, "words": words, "status": status}


def weakest_label(view: View) -> str:
    loop = loop_words(view.loop, view.rotor) if view.loop else ""
    cut = f"cut at the {POINTS.get(view.cut, view.cut)}" if view.cut else ""
    return capital(", ".join(filter(None, (loop, view.place, cut))))


def _nearness(item: doc.VerdictItem) -> float:
    """What is left to the limit; without a distance the requirement is as good as far away."""
    if item["distance"] is None or item["value"] is None or item["limit"] is None:
        return math.inf
    return reserve(item.get("quantity", ""), item["value"], item["limit"], item["distance"])


def _pictures(figures: Mapping[str, LoopFigures], point: WeakPoint | None) -> list[doc.Block]:
    """Make the Bode figure of the weakest view and the step of its loop; none of a drive without loops."""
    if not figures:
        return []
    view = point.view if point else None
    name = view.loop if view and view.loop else list(figures)[-1]
    result, there = figures[name], view.found if view else None
    # drawn where it crosses: in a gap nothing comes back at all
    seen = there if there and (there.margins.gain_margins or there.margins.phase_margins) else result
    own = seen is result
    title = LOOPS[name] if own or view is None else weakest_label(view)
    bode = loop_charts.open_bode(title, seen, frequency_grid(seen), name=name if own else "", small=True)
    if result.step is None:
        return [bode]
    return [bode, loop_section.step(LOOPS[name], result, None, name=name, small=True)]
