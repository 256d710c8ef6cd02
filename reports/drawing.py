"""All figures of a document as SVG; what of a document that somebody gives can be drawn."""

import json
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from actuator_lti.errors import InputError
from actuator_lti.types import Progress
from analyses.isolation import caught, note
from reports.charts.data import chart_of
from reports.charts.svg import page_svg, paper_svg

PLACEHOLDER = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 420 60"><text x="10" y="36" font-size="12"'
    ' fill="currentColor">This figure could not be drawn; the exit status was 3.</text></svg>'
)


def draw_all(
    blocks: Sequence[Mapping[str, Any]], progress: Progress = None, page: bool = True
) -> dict[int, str]:
    """Draw figure blocks: SVG by the block's ``id()``; one that fails is a notice in its place, and is noted.

    For a page: a picture a column, colours as CSS variables with the light ones as fallback, the legend as a
    list. Otherwise one picture with plain colours.
    """
    drawn: dict[int, str] = {}
    for k, block in enumerate(blocks, 1):
        svg, missing = caught(f"figure {k} ({block['figure']})", partial(draw_svg, block, f"f{k}", page))
        drawn[id(block)] = svg or PLACEHOLDER
        note([missing] if missing else [])
        if progress is not None:
            progress(k, len(blocks))
    return drawn


def draw_svg(block: Mapping[str, Any], prefix: str = "f", page: bool = True) -> str:
    """Draw one figure; its chart passes through JSON, so that a page equals one made of report.json."""
    chart = chart_of(json.loads(json.dumps(block["chart"], allow_nan=False)))
    return page_svg(chart, prefix, block["alt"]) if page else paper_svg(chart, prefix)


def refuse_undrawable(blocks: Sequence[Mapping[str, Any]], origin: str) -> None:
    """Refuse a document of somebody in which a figure's chart cannot be drawn: which, and what is wrong."""
    for k, block in enumerate(blocks, 1):
        try:
            _, missing = caught(block["figure"], partial(draw_svg, block, "f", False))
            why = missing.why.removeprefix("unforeseen ") if missing else ""
        except InputError as error:
            why = error.message
        if why:
            raise InputError(f"figure {k} ({block['figure']}): its data cannot be drawn ({why})", origin)
