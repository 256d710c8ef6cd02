"""A chart as SVG: each column a picture on a page, all in one picture on paper; all figures of a document.

What stands here is all that ``templates/page`` needs to zoom, read out and redraw: every panel carries
its axes (``data-x``, ``data-y``: kind, ends, pixels), every curve its key.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import accumulate
from typing import Any

from actuator_lti.errors import InputError
from actuator_lti.types import Progress
from analyses.isolation import caught, note
from reports.charts.chart import Band, Chart, Column, Curve, Item, Note, Panel, Shape
from reports.charts.data import chart_of
from reports.charts.labels import LINE_EM, text_width
from reports.charts.panel_svg import LABEL, TICK, TITLE, panel_svg, room_y
from reports.charts.pen import Frame, Pen
from reports.visible import escape

FONT = "DejaVu Sans"
GAP = 10.0
KEY_ROW, KEY_GAP, SWATCH = 18.0, 18.0, 26.0
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
            why = missing.why.removeprefix("unexpected ") if missing else ""
        except InputError as error:
            why = error.message
        if why:
            raise InputError(f"figure {k} ({block['figure']}): its data cannot be drawn ({why})", origin)


def page_svg(chart: Chart, prefix: str, alt: str) -> str:
    """Write a chart for a page: a picture a column, and the legend as a list that can be worked."""
    plots = []
    for k, (column, width, pen) in enumerate(_columns(chart, prefix, page=True)):
        label = alt if k == 0 else f"{column.title or column.panels[0].title or 'continued'}, part {k + 1}"
        bounds = f"flex:{width:.0f} 1 {min(0.74 * width, 640):.0f}px;max-width:{1.4 * width:.0f}px"
        if width > 560:
            bounds += f";min-width:{0.72 * width:.0f}px"
        plots.append(
            f'<svg class="plot" xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{escape(label)}" '
            f'viewBox="0 0 {width:.0f} {chart.height:.0f}" style="{bounds}">'
            f"{_column(column, width, chart.height, pen)}</svg>"
        )
    title = f'<p class="chart-title">{escape(chart.title)}</p>' if chart.title else ""
    loop = f' data-loop="{escape(chart.loop)}"' if chart.loop else ""
    body = f'{title}<div class="plots">{"".join(plots)}</div>{_legend(chart, prefix)}'
    return f'<div class="chart"{loop}>{body}</div>'


def paper_svg(chart: Chart, prefix: str) -> str:
    """Write a chart as one picture with plain colours and its legend below."""
    rows = _key_rows(chart)
    head = 18.0 if chart.title else 0.0
    foot = KEY_ROW * len(rows) + (6.0 if rows else 0.0)
    parts, left = [], 0.0
    for column, width, pen in _columns(chart, prefix, page=False):
        body = _column(column, width, chart.height, pen)
        parts.append(f'<g transform="translate({left:.1f} {head:g})">{body}</g>')
        left += width
    if chart.title:
        pen = Pen(prefix="", page=False, keys={})
        parts.append(pen.words(chart.title, 4.0, 13.0, size=TITLE, bold=True))
    for r, row in enumerate(rows):
        y = head + chart.height + 14.0 + KEY_ROW * r
        for k, (label, item, x) in enumerate(row):
            own = Pen(prefix=f"{prefix}k{r}x{k}", page=False, keys={})
            parts.append(f'<g transform="translate({x:.1f} {y - 9:.1f})">{_swatch(item, own)}</g>')
            parts.append(own.words(label, x + SWATCH + 5.0, y, size=TICK))
    height = head + chart.height + foot
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{0.75 * chart.width:.1f}pt" '
        f'height="{0.75 * height:.1f}pt" viewBox="0 0 {chart.width:.0f} {height:.0f}" '
        f'font-family="{FONT}">{"".join(parts)}</svg>'
    )


def _columns(chart: Chart, prefix: str, page: bool) -> Iterator[tuple[Column, float, Pen]]:
    """Each column with its width and the pen that draws it."""
    total, keys = sum(column.width for column in chart.columns), _keys(chart)
    for k, column in enumerate(chart.columns):
        yield column, chart.width * column.width / total, Pen(f"{prefix}{chr(97 + k)}", page, keys)


def _column(column: Column, width: float, height: float, pen: Pen) -> str:
    above = [22.0 if panel.title else 8.0 for panel in column.panels]
    hidden = [True] * (len(column.panels) - 1) + [False]  # x ticks, which stand at the last panel
    below = [_below(panel, hides) for panel, hides in zip(column.panels, hidden, strict=True)]
    head = 16.0 if column.title else 0.0
    free = height - head - sum(above) - sum(below)
    tall = [free * share / sum(column.heights) for share in column.heights]
    left = max((_left(panel, high) for panel, high in zip(column.panels, tall, strict=True)), default=30.0)
    parts = [pen.words(column.title, left, 12.0, size=TITLE, bold=True)] if column.title else []
    tops = accumulate((a + t + b for a, t, b in zip(above, tall, below, strict=True)), initial=head)
    for k, (panel, top) in enumerate(zip(column.panels, tops, strict=False)):
        frame = Frame(left, top + above[k], width - GAP, top + above[k] + tall[k])
        if panel.equal:
            _make_equal(panel, frame)
        parts.append(panel_svg(panel, frame, pen.within(k), hide_x=hidden[k]))
    return "".join(parts)


def _left(panel: Panel, height: float) -> float:
    ticks = panel.y.named_ticks(room_y(panel, height))
    widest = max((text_width(words, TICK) for _, words in ticks), default=0.0)
    lines = panel.y.label.count("\n") + 1 if panel.y.label else 0
    return 8.0 + widest + lines * LINE_EM * LABEL + (4.0 if lines else 0.0)


def _below(panel: Panel, hidden: bool) -> float:
    if hidden:
        return 4.0
    return (17.0 if panel.x.named_ticks() else 3.0) + (LABEL * LINE_EM + 3.0 if panel.x.label else 3.0)


def _make_equal(panel: Panel, frame: Frame) -> None:
    (x0, x1), (y0, y1) = panel.x.span(), panel.y.span()
    scale = min(frame.width / (x1 - x0), frame.height / (y1 - y0))
    for axis, size, (low, high) in ((panel.x, frame.width, (x0, x1)), (panel.y, frame.height, (y0, y1))):
        middle, half = (low + high) / 2.0, size / scale / 2.0
        axis.low, axis.high = middle - half, middle + half


def _keys(chart: Chart) -> dict[str, int]:
    return {label: k for k, (label, _) in enumerate(chart.labels())}


def _shown(chart: Chart) -> list[tuple[str, Item]]:
    labels = chart.labels()
    return labels if (len(labels) > 1 if chart.legend is None else chart.legend) else []


def _legend(chart: Chart, prefix: str) -> str:
    items = _shown(chart)
    if not items:
        return ""
    keys = _keys(chart)
    title = f'<span class="keys-title">{escape(chart.legend_title)}</span>' if chart.legend_title else ""
    rows = "".join(
        f'<li data-k="{keys[label]}"><svg class="swatch" aria-hidden="true" viewBox="0 0 {SWATCH:.0f} 12">'
        f"{_swatch(item, Pen(prefix=f'{prefix}k{k}', page=True, keys={}))}</svg>{escape(label)}</li>"
        for k, (label, item) in enumerate(items)
    )
    return f'<div class="keys">{title}<ul>{rows}</ul></div>'


def _key_rows(chart: Chart) -> list[list[tuple[str, Item, float]]]:
    rows, x = list[list[tuple[str, Item, float]]](), math.inf
    for label, item in _shown(chart):
        size = SWATCH + 6.0 + text_width(label, TICK) + KEY_GAP
        if x + size > chart.width:
            rows.append([])
            x = 4.0
        rows[-1].append((label, item, x))
        x += size
    return rows


def _swatch(item: Item, pen: Pen) -> str:
    """Draw the sample of a legend entry, 26 by 12."""
    if isinstance(item, Note):
        return ""
    if isinstance(item, Curve):
        line = pen.line("M1 6H25", item.look) if item.line else ""
        return line + (pen.marker(item.look, 13.0, 6.0) if item.look.marker else "")
    if isinstance(item, Shape | Band):
        return pen.filled("M3 1H23V11H3z", item.look)
    return pen.line("M13 0V12" if item.across == "x" else "M1 6H25", item.look)
