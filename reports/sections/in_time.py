"""Predictions shown in time: the injected sweep, one small step, runs beside each margin.

Margins from small, medium and large deviations: where an oscillation lasts, with and without friction.
"""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from actuator_lti.asked.verdict import Verdict
from analyses.large_signal.from_rest import AmplitudeMargin
from analyses.validation.in_time import BenchSweep, MarginShown, StepShown
from analyses.validation.result import Validation
from reports import document as doc
from reports.charts import style
from reports.numbers import gain_margin
from reports.sections.limits import words_of
from reports.sections.names import loop_words, output_unit

TESTED = "locked"  # how the rotor stands in the current loop that is put to the simulator


def sections(validation: Validation) -> list[doc.Section]:
    made = [_injection(list(validation.sweeps.values()))] if validation.sweeps else []
    return made + ([_in_time(validation)] if validation.steps or validation.margins else [])


def _injection(sweeps: Sequence[BenchSweep]) -> doc.Section:
    intro = (
        "A sine is added at the break point of the simulated drive, which starts in the steady state of that "
        "sine; fundamentals are correlated over whole periods."
    )
    words = f"Every open loop as an analyser sees it; {_difference(sweeps)}."
    title = "Frequency response by injection"
    return doc.section("injection", title, list(map(_sweep, sweeps)), result=words, intro=intro)


def _sweep(sweep: BenchSweep) -> doc.Block:
    chart, (top, bottom) = style.stack(400.0, 1.1, 1.0)
    phase = style.phases(sweep.linear)
    seen = phase + np.degrees(np.angle(sweep.open_loop / sweep.linear))
    size, size_simulated = style.decibels(sweep.linear), style.decibels(sweep.open_loop)
    for panel, linear, found in ((top, size, size_simulated), (bottom, phase, seen)):
        panel.curve(sweep.frequency_hz, linear, "linear loop", colour=style.BLUE)
        panel.points(sweep.frequency_hz, found, "simulated", size=5.0, hollow=True, colour=style.ORANGE)
    style.bode_axes(top, bottom, phase)
    caption = f"{loop_words(sweep.loop, TESTED)}, open: linear (line), simulated (circles); "
    caption += f"{_difference([sweep])}."
    return doc.figure("injected_sweep", chart, caption)


def _difference(sweeps: Sequence[BenchSweep]) -> str:
    parts = np.abs(np.concatenate([one.open_loop / one.linear - 1.0 for one in sweeps]))
    seen = parts[np.isfinite(parts)]
    if not seen.size:
        return "no sine passes without an event (a limit, a count, a standstill)"
    return f"largest difference of simulated and linear {seen.max():.1e}"


def _in_time(validation: Validation) -> doc.Section:
    steps, margins, amplitudes = validation.steps, validation.margins, validation.amplitude_margins
    blocks: list[doc.Block] = []
    for name in validation.figures:
        blocks += [_step(steps[name])] if name in steps else []
        blocks += [_margin(margins[name])] if name in margins else []
    said = remarks(amplitudes)
    if amplitudes:
        blocks += [_amplitudes(amplitudes), *map(doc.text, said), _amplitude_table(amplitudes)]
    rows = [shown.row for shown in steps.values()] + [row for one in margins.values() for row in one.rows]
    met = sum(row.verdict is Verdict.MET for row in rows)
    intro = (
        "On the operating motion: one small step, sample by sample, and the drive started on its critical "
        "mode 1 % inside and 1 % outside of the gain margin, where it dies out or grows by the predicted "
        "factor."
    )
    return doc.section(
        "confirmation", "Predictions in time", blocks, intro=intro,
        result=" ".join([f"{met} of {len(rows)} runs go as predicted.", *said[:1]]),
        status="pass" if met == len(rows) else "fail",
        findings=[doc.Finding(severity="warn", text=words, where="confirmation") for words in said],
    )  # fmt: skip


def _step(shown: StepShown) -> doc.Block:
    chart, panel = style.plot(240.0, y="response to a unit step", width=style.HALF)
    time = shown.time_s * style.time_axis(panel, float(shown.time_s[-1]))
    some, few = (slice(None, None, max(1, time.size // most)) for most in (400, 40))
    panel.curve(time[some], shown.linear[some], "linear", colour=style.BLUE)
    look: style.Style = {"size": 4.5, "hollow": True, "colour": style.ORANGE}
    panel.points(time[few], shown.simulated[few], "simulated", **look)
    caption = (
        f"{loop_words(shown.place, TESTED)}: small step on the operating motion; largest difference "
        f"{shown.row.error:.1e} of its height, {shown.row.because.split(', of ')[-1]}."
    )
    return doc.figure("small_step", chart, caption, layout="half")


def _margin(shown: MarginShown) -> doc.Block:
    chart, panel = style.plot(240.0, y="amplitude of the critical mode", width=style.HALF)
    scale = style.time_axis(panel, max(float(run.time_s[-1]) for run in (shown.inside, shown.outside)))
    for run, words, k in ((shown.inside, "1 % inside", 0), (shown.outside, "1 % outside", 3)):
        look = style.series(k)
        panel.curve(scale * run.time_s, run.factor ** (run.time_s / run.time_s[-1]), words, **look)
        panel.points(scale * run.time_s, run.amplitude, f"{words}, simulated", **look | {"size": 4.0})
    decibel = gain_margin(20.0 * math.log10(shown.ratio), 2)
    caption = (
        f"{loop_words(shown.place, TESTED)}: gain margin on the operating motion {decibel} dB at "
        f"{shown.frequency_hz:.4g} Hz. The run inside dies out, the run outside grows (circles), each by the "
        "predicted factor (lines)."
    )
    return doc.figure("margin_runs", chart, caption, layout="half")


FRICTION: dict[bool, style.Style] = {False: {"marker": "o"}, True: {"marker": "s", "hollow": True, "dash": 1}}
KINDS = {"gain": "loop gain, up", "delay": "delay at the loop"}
NEXT_TO_NOTHING = 0.01  # of the linear margin
WORTH_SAYING = 0.9  # of the linear margin: what takes less is not said
LOWEST = 0.02  # of the linear margin: what lies below is drawn here


def remarks(items: Sequence[AmplitudeMargin]) -> list[str]:
    """Say where large motion takes more than a tenth of a margin, worst case of each loop and kind."""
    worst: dict[tuple[str, str], tuple[float, AmplitudeMargin]] = {}
    for item in items:
        if item.value is not None and item.value <= WORTH_SAYING * item.linear:
            key = item.loop, "" if _already(item) else item.kind  # as designed: whatever is varied
            worst[key] = min(worst.get(key, (item.value, item)), (item.value, item), key=lambda one: one[0])
    return [remark(item) for _, item in worst.values()]


def remark(item: AmplitudeMargin) -> str:
    value, linear = _text(item.value or 0.0, item), _text(item.linear, item)
    varied = {"gain": f"With its gain {value} higher", "delay": f"With {value} more delay"}[item.kind]
    size = f" by {output_unit(item.axis).of(item.output, 2)} at the output" if item.output > 0.0 else ""
    quiet = "" if item.friction_on else ", without dry friction"
    acting = f" The {words_of(item.limiter)} acts." if item.limiter else ""
    return (
        f"{'As designed' if _already(item) else varied}{quiet}, the {item.loop} loop keeps oscillating{size} "
        f"once let go from {100.0 * item.part:.0f} % of full range.{acting} Its linear {item.kind} margin, "
        f"as validated, is {linear}."
    )


def _already(item: AmplitudeMargin) -> bool:
    """Whether it is the drive as designed: less than a hundredth of the linear margin away."""
    value, linear = item.value or 0.0, item.linear
    if item.kind == "gain":
        value, linear = abs(math.log(value)), abs(math.log(linear))
    return value < NEXT_TO_NOTHING * linear


def _amplitudes(items: Sequence[AmplitudeMargin]) -> doc.Block:
    chart = style.Chart(width=style.HALF, height=300.0)
    panel = chart.panel("initial deviation", "margin over linear margin", "y", by_point=True)
    sizes = list(dict.fromkeys(item.size for item in items))
    keys = list(dict.fromkeys((item.loop, item.kind) for item in items))
    for (k, (loop, kind)), (friction_on, rough) in product(enumerate(keys), FRICTION.items()):
        own = [x for x in items if (x.loop, x.kind, x.friction_on) == (loop, kind, friction_on)]
        x = [sizes.index(item.size) + 0.06 * (k - len(keys) / 2) for item in own]
        y = [None if item.value is None else max(item.value / item.linear, LOWEST) for item in own]
        look: style.Style = {"colour": style.SERIES[k % 7], "size": 6.5, "width": 1.4, **rough}
        panel.curve(x, y, f"{loop}: {KINDS[kind]}", **look)
    panel.rule_y(1.0)
    panel.x.ticks = [(float(k), words) for k, words in enumerate(sizes)]
    panel.x.limits(-0.4, len(sizes) - 0.6)
    values = [1.0, *(max(item.value / item.linear, LOWEST) for item in items if item.value)]
    panel.y.limits(min(values) / 1.3, max(values) * 1.5)
    panel.y.ticks = [(t, f"{t:g}") for t in (LOWEST, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)]
    caption = (
        "Margins by the initial deviation from which the drive is let go: small, medium and large, limits "
        "active; hollow and dashed: with dry friction."
    )
    return doc.figure("margins_by_amplitude", chart, caption, layout="half")


def _amplitude_table(items: Sequence[AmplitudeMargin]) -> doc.Block:
    columns = [
        doc.of("loop", "loop", "Loop"),
        doc.of(lambda item: KINDS[item.kind], "kind", "Varied"),
        doc.of(lambda item: f"{100.0 * item.part:.0f} % of full range", "size", "Initial deviation"),
        doc.of(lambda item: "on" if item.friction_on else "off", "friction", "Dry friction"),
        doc.of(lambda item: _shown(item.linear, item), "linear", "Linear margin", format="sig:4"),
        doc.of(lambda item: _shown(item.value, item), "value", "Oscillation lasts from", format="sig:3"),
        doc.of(_unit, "unit", "Unit"),
        doc.of(lambda item: words_of(item.limiter) if item.limiter else "", "limiter", "Limit acting"),
        doc.of(_remark, "remark", "Remark"),
    ]
    title = "Margins from small, medium and large deviations"
    return doc.details(title, [doc.listing("Margins by amplitude", items, columns)])


def _remark(item: AmplitudeMargin) -> str:
    if item.too_long:
        return "not asked: the way back takes too long"
    if item.value is None:
        return f"no oscillation lasts up to {_text(item.furthest, item)}"
    if item.value == (0.0 if item.kind == "delay" else 1.0):
        return "the nominal drive oscillates"
    return "fewer values asked: its runs are long" if item.coarser else ""


def _unit(item: AmplitudeMargin) -> str:
    return "ms" if item.kind == "delay" else "dB"


def _shown(value: float | None, item: AmplitudeMargin) -> float | None:
    if value is None:
        return None
    return 1e3 * value * item.period_s if item.kind == "delay" else 20.0 * math.log10(value)


def _text(value: float, item: AmplitudeMargin) -> str:
    return f"{_shown(value, item):.3g} {_unit(item)}"
