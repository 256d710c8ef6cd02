"""Margins confirmed in time: gain and delay raised until oscillations no longer die out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from analyses.validation.confirm import Confirmation
from analyses.validation.release import AmplitudeMargin
from analyses.validation.result import Validation
from analyses.validation.tolerance import allowed
from reports import document as doc
from reports.document_schema import Block, Row, Section, Status
from reports.figures import confirmation as confirmation_figure
from reports.findings import Finding
from reports.numbers import significant

NEXT_TO_NOTHING = 0.01  # of the linear margin
SHORT = {
    "gain up": "gain up",
    "gain down": "gain down",
    "delay": "delay",
    "computing delay": "computing delay",
}


def sections(validation: Validation) -> list[Section]:
    """Make the section, if anything was confirmed."""
    items = [item for loop in validation.loops.values() for item in loop.confirmed]
    items += [item for point in validation.points.values() for item in point.confirmed]
    if not items:
        return []
    blocks = [_figure(items, validation.amplitude_margins), _table(items)]
    if validation.amplitude_margins:
        blocks += [doc.text(words) for words in _remarks(validation.amplitude_margins)]
        blocks.append(_released(validation.amplitude_margins))
    intro = (
        "In the simulator, gain is raised and lowered and delay is added until an oscillation no longer "
        "decays. "
        "At constant speed, with no limit acting, that is the linear margin. From rest, limits and dry "
        "friction "
        "change it."
    )
    good = sum(item.passed for item in items)
    worst = max((abs(item.difference) for item in items if item.difference is not None), default=0.0)
    result = (
        f"{good} of {len(items)} margins are confirmed in the time domain, within "
        f"{significant(100.0 * worst, 2)} % "
        "of the linear ones."
    )
    status: Status = "pass" if good == len(items) else "fail"
    outcome = [
        Finding(severity="warn", text=words, where="confirmation")
        for words in _remarks(validation.amplitude_margins)
    ]
    return [
        doc.section(
            "confirmation", "Margins confirmed in the time domain", blocks, result=result, intro=intro,
            status=status, findings=outcome,
        )
    ]  # fmt: skip


def _figure(items: Sequence[Confirmation], released: Sequence[AmplitudeMargin]) -> Block:
    data: confirmation_figure.Data = {
        "margins": [
            {"label": f"{item.loop}: {SHORT[item.kind]}", "difference": abs(item.difference)}
            for item in items
            if item.difference is not None
        ],
        "tolerance": _allowed(items),
        "released": _series(released),
    }
    worst = max((abs(item.difference) for item in items if item.difference is not None), default=0.0)
    caption = (
        "Left: margin found in time relative to the linear margin, largest difference "
        f"{significant(worst, 2)} (allowed up to {significant(_allowed(items), 2)}, from its own error). "
        "Right: the same margins after release from rest at small, medium and large deviations, limits "
        "active, with and without dry friction."
    )
    return doc.figure("confirmation", confirmation_figure.draw(doc.plain(data)), caption=caption, alt=caption)


def _allowed(items: Sequence[Confirmation]) -> float:
    """The widest tolerance of a margin that was found, relative."""
    errors = (item.error for item in items if item.difference is not None)
    return float(f"{allowed(max(errors, default=0.0), 1.0):.2g}")


def _remarks(released: Sequence[AmplitudeMargin]) -> list[str]:
    """Say where a limit takes more than a tenth of a margin, worst case of each loop and kind."""
    worst: dict[tuple[str, str], AmplitudeMargin] = {}
    for item in released:
        value, known = item.border.value, worst.get((item.loop, item.kind))
        if value is None or value > 0.9 * item.linear:
            continue
        if known is None or value < (known.border.value or value):
            worst[item.loop, item.kind] = item
    return [_remark(item) for item in worst.values()]


def _remark(item: AmplitudeMargin) -> str:
    """Say from where on a large motion keeps oscillating."""
    value = item.border.value or 0.0
    border, linear = _text(value, item), _text(item.linear, item)
    how = {
        "gain up": f"if its gain is raised by {border} or more",
        "gain down": f"if its gain is lowered by {border}",
    }
    cause = how.get(item.kind, f"if a delay of {border} or more is added")
    if _already(value, item):
        cause = "as designed"
    kind = "delay" if item.kind == "delay" else "gain"
    quiet = "" if item.friction_on else ", without dry friction,"
    acting = f" The {item.limiter} limit acts." if item.limiter else ""
    return (
        f"The {item.loop} loop{quiet} sustains an oscillation {cause} after release from "
        f"{100.0 * item.part:.0f} % of full range; the linear {kind} margin is {linear}.{acting}"
    )


def _already(value: float, item: AmplitudeMargin) -> bool:
    """Whether the border is the drive as designed: less than a hundredth of the linear margin away."""
    if item.kind == "delay":
        return value < NEXT_TO_NOTHING * item.linear
    return abs(math.log(value)) < NEXT_TO_NOTHING * abs(math.log(item.linear))


def _series(released: Sequence[AmplitudeMargin]) -> list[confirmation_figure.Released]:
    """Borders over linear borders, by loop and kind."""
    result: dict[str, tuple[list[str], list[float | None], list[float | None]]] = {}
    for item in released:
        label = f"{item.loop}: {SHORT[item.kind]}"
        sizes, with_friction, without = result.setdefault(label, ([], [], []))
        if item.size not in sizes:
            sizes.append(item.size)
            with_friction.append(None)
            without.append(None)
        values = with_friction if item.friction_on else without
        value = item.border.value
        values[sizes.index(item.size)] = None if value is None else value / item.linear
    return [
        {"label": label, "sizes": sizes, "with_friction": with_friction, "without": without}
        for label, (sizes, with_friction, without) in result.items()
    ]


def _table(items: Sequence[Confirmation]) -> Block:
    columns = [
        doc.column("where", "Loop or break point"),
        doc.column("kind", "Varied"),
        doc.column("linear", "Linear margin", format="sig:6"),
        doc.column("time", "In the time domain", format="sig:6"),
        doc.column("unit", "Unit"),
        doc.column("difference", "Difference", "%", format="sig:2"),
        doc.column("hertz", "Oscillation", "Hz", format="sig:4"),
        doc.column("instrument", "Error of the method", "%", format="sig:2"),
        doc.column("runs", "Runs", format="int"),
    ]
    note = (
        "Gains scale the controller in front of the point. Delays act behind it. A fraction of a sample is a "
        "Lagrange interpolation; its error at the border is stated. The computing delay is exact. Margins "
        "beyond "
        "50 dB count as none."
    )
    return doc.table(
        "Gain and delay margins in the time domain", columns, [_row(item) for item in items], note
    )


def _row(item: Confirmation) -> Row:
    delay = "delay" in item.kind
    values = [item.predicted, item.border.value]
    if delay:
        shown = [None if x is None else 1e3 * x * item.period_s for x in values]
    else:
        shown = [None if x is None else 20.0 * math.log10(x) for x in values]
    return {
        "where": item.loop,
        "kind": SHORT[item.kind],
        "linear": shown[0],
        "time": shown[1],
        "unit": "ms" if delay else "dB",
        "difference": None if item.difference is None else 100.0 * item.difference,
        "hertz": item.border.frequency_hz,
        "instrument": 100.0 * item.instrument_error if item.kind == "delay" else None,
        "runs": item.border.runs,
        "_status": "pass" if item.passed else "fail",
    }


def _released(items: Sequence[AmplitudeMargin]) -> Block:
    columns = [
        doc.column("loop", "Loop"),
        doc.column("kind", "Varied"),
        doc.column("size", "Released from"),
        doc.column("friction", "Dry friction"),
        doc.column("linear", "Linear margin", format="sig:4"),
        doc.column("border", "Sustained oscillation from", format="sig:3"),
        doc.column("unit", "Unit"),
        doc.column("limiter", "Limit acting"),
        doc.column("remark", ""),
    ]
    return doc.details(
        "Margins from small, medium and large deviations",
        [doc.table("Margins by amplitude", columns, [_released_row(item) for item in items])],
    )


def _released_row(item: AmplitudeMargin) -> Row:
    value, delay = item.border.value, item.kind == "delay"
    remark = ""
    if value is None:
        remark = "no sustained oscillation up to " + _text(max(item.border.bracket), item)
    elif item.border.bracket == (1.0, 1.0) and not delay:
        remark = "the nominal drive oscillates"
    return {
        "loop": item.loop,
        "kind": SHORT[item.kind],
        "size": f"{100.0 * item.part:.0f} % of full range",
        "friction": "on" if item.friction_on else "off",
        "linear": _shown(item.linear, item, delay),
        "border": None if value is None else _shown(value, item, delay),
        "unit": "ms" if delay else "dB",
        "limiter": item.limiter,
        "remark": remark,
    }


def _shown(value: float, item: AmplitudeMargin, delay: bool) -> float:
    return 1e3 * value * item.period_s if delay else 20.0 * math.log10(value)


def _text(value: float, item: AmplitudeMargin) -> str:
    delay = item.kind == "delay"
    return f"{_shown(value, item, delay):.3g} {'ms' if delay else 'dB'}"
