"""Margins from small, medium and large deviations: where an oscillation lasts, with and without friction."""

from __future__ import annotations

import math
from collections.abc import Sequence

from analyses.large_signal.by_amplitude import AmplitudeMargin
from reports import document as doc
from reports.charts import style
from reports.charts.style import Chart
from reports.document_schema import Block
from reports.sections.limits import words_of
from reports.sections.names import output_unit

KINDS = {"gain": "loop gain, up", "delay": "delay at the loop"}
NEXT_TO_NOTHING = 0.01  # of the linear margin
WORTH_SAYING = 0.9  # of the linear margin: what takes less is not said
LOWEST = 0.02  # of the linear margin: what lies below is drawn here


def blocks(items: Sequence[AmplitudeMargin]) -> list[Block]:
    """Make figure, remarks and table, if there are any."""
    if not items:
        return []
    return [_figure(items), *(doc.text(words) for words in remarks(items)), _table(items)]


def remarks(items: Sequence[AmplitudeMargin]) -> list[str]:
    """Say where large motion takes more than a tenth of a margin, worst case of each loop and kind."""
    worst: dict[tuple[str, str], AmplitudeMargin] = {}
    for item in items:
        if item.value is None or item.value > WORTH_SAYING * item.linear:
            continue
        key = item.loop, "" if _already(item) else item.kind  # as designed: whatever is varied
        known = worst.get(key)
        if known is None or item.value < (known.value or item.value):
            worst[key] = item
    return [remark(item) for item in worst.values()]


def remark(item: AmplitudeMargin) -> str:
    """Say from where on a large motion keeps oscillating."""
    value, linear = _text(item.value or 0.0, item), _text(item.linear, item)
    if _already(item):
        cause = "as designed"
    elif item.kind == "gain":
        cause = f"if its gain is raised by {value} or more"
    else:
        cause = f"if a delay of {value} or more is added"
    quiet = "" if item.friction_on else ", without dry friction,"
    acting = f" The {words_of(item.limiter)} acts." if item.limiter else ""
    return (
        f"The {item.loop} loop{quiet} sustains an oscillation{_of(item)} {cause} after release from "
        f"{100.0 * item.part:.0f} % of full range; the linear {item.kind} margin on the validation's "
        f"operating motion is {linear}.{acting}"
    )


def _of(item: AmplitudeMargin) -> str:
    """How large the oscillation is at the output, where it moves."""
    scale, unit = output_unit(item.axis)
    return f" of {scale * item.output:.2g} {unit} at the output" if item.output > 0.0 else ""


def _already(item: AmplitudeMargin) -> bool:
    """Whether it is the drive as designed: less than a hundredth of the linear margin away."""
    value = item.value or 0.0
    if item.kind == "delay":
        return value < NEXT_TO_NOTHING * item.linear
    return abs(math.log(value)) < NEXT_TO_NOTHING * abs(math.log(item.linear))


def _figure(items: Sequence[AmplitudeMargin]) -> Block:
    chart = Chart(width=style.HALF, height=300.0)
    panel = chart.panel("initial deviation", "margin over linear margin", "y", by_point=True)
    sizes = list(dict.fromkeys(item.size for item in items))
    keys = list(dict.fromkeys((item.loop, item.kind) for item in items))
    for k, (loop, kind) in enumerate(keys):
        for friction_on in (False, True):
            own = [x for x in items if (x.loop, x.kind, x.friction_on) == (loop, kind, friction_on)]
            x = [sizes.index(item.size) + 0.06 * (k - len(keys) / 2) for item in own]
            y = [None if item.value is None else max(item.value / item.linear, LOWEST) for item in own]
            look: style.Style = {"colour": style.SERIES[k % 7], "size": 6.5, "width": 1.4}
            if friction_on:
                look |= {"hollow": True, "dash": 1, "marker": "s"}
            panel.curve(x, y, f"{loop}: {KINDS[kind]}", **({"marker": "o"} | look))
    panel.rule_y(1.0)
    panel.x.ticks = [(float(k), words) for k, words in enumerate(sizes)]
    panel.x.limits(-0.4, len(sizes) - 0.6)
    values = [max(item.value / item.linear, LOWEST) for item in items if item.value]
    panel.y.limits(min([*values, 1.0]) / 1.3, max([*values, 1.0]) * 1.5)
    panel.y.ticks = [(t, f"{t:g}") for t in (LOWEST, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)]
    caption = (
        "Margins after release from rest at small, medium and large deviations, limits active; hollow and "
        "dashed: with dry friction."
    )
    return doc.figure("margins_by_amplitude", chart, caption, layout="half")


def _table(items: Sequence[AmplitudeMargin]) -> Block:
    columns = [
        doc.of("loop", "loop", "Loop"),
        doc.of(lambda item: KINDS[item.kind], "kind", "Varied"),
        doc.of(lambda item: f"{100.0 * item.part:.0f} % of full range", "size", "Released from"),
        doc.of(lambda item: "on" if item.friction_on else "off", "friction", "Dry friction"),
        doc.of(lambda item: _shown(item.linear, item), "linear", "Linear margin", format="sig:4"),
        doc.of(lambda item: _shown(item.value, item), "value", "Oscillation lasts from", format="sig:3"),
        doc.of(_unit, "unit", "Unit"),
        doc.of(lambda item: words_of(item.limiter) if item.limiter else "", "limiter", "Limit acting"),
        doc.of(_remark, "remark", ""),
    ]
    made = doc.listing("Margins by amplitude", items, columns)
    return doc.details("Margins from small, medium and large deviations", [made])


def _remark(item: AmplitudeMargin) -> str:
    if item.value is None:
        return f"no oscillation lasts up to {_text(item.furthest, item)}"
    nominal = 0.0 if item.kind == "delay" else 1.0
    return "the nominal drive oscillates" if item.value == nominal else ""


def _unit(item: AmplitudeMargin) -> str:
    return "ms" if item.kind == "delay" else "dB"


def _shown(value: float | None, item: AmplitudeMargin) -> float | None:
    if value is None:
        return None
    return 1e3 * value * item.period_s if item.kind == "delay" else 20.0 * math.log10(value)


def _text(value: float, item: AmplitudeMargin) -> str:
    return f"{_shown(value, item):.3g} {_unit(item)}"
