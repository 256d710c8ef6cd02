"""The delay budget: where the phase at each crossover goes."""

from collections.abc import Mapping
from typing import Any

from actuator_lti.loops.delay_budget import DelayBudget
from reports import document as doc
from reports.charts import style
from reports.charts.paint import HATCHES
from reports.sections.names import hertz, loop_words

DEG: dict[str, Any] = {"unit": "deg", "format": "fix:2"}
PARTS = {
    "controller": "controller",
    "plant": "motor, inner loops",
    "measurement": "speed measurement",
    "hold": "hold",
    "computing delay": "computing delay",
    "sampling": "sampling",
}


def section(budgets: Mapping[str, DelayBudget]) -> doc.Section:
    def part(key: str, label: str) -> doc.Shown:
        return doc.of(lambda one: one[1].items.get(key, 0.0), key, label, **DEG)

    parts = _parts(budgets)
    columns = [
        doc.of(lambda one: loop_words(one[0], one[1].rotor), "loop", "Loop"),
        doc.of(lambda one: hertz(one[1].frequency_rad_s), "crossover_hz", "Crossover", "Hz", format="sig:4"),
        *(part(key, label.capitalize()) for key, label in parts.items()),
        doc.of(lambda one: one[1].total_deg, "total", "Phase in all", **DEG),
        doc.of(lambda one: 180.0 + one[1].total_deg, "margin", "Left to −180°", **DEG, better=1),
        doc.of(lambda one: one[1].one_more_sample_deg, "one_more", "One more sample", **DEG),
    ]
    note = (
        "The loop is built up cause by cause, so the parts add up to the phase of the exact sampled loop. "
        "One more sample: cost of one more period of computing delay, not included in the total."
    )
    caption = "Lag at the gain crossover of each loop, by cause. The rest to 180° is phase margin."
    blocks = [
        doc.figure("delay_budget", chart(budgets), caption),
        doc.listing("Phase at the gain crossover", budgets.items(), columns, note),
    ]
    digital = ("measurement", "hold", "computing delay", "sampling")
    lost = {name: -sum(budget.items[key] for key in digital) for name, budget in budgets.items()}
    name = max(lost, key=lambda key: lost[key])
    loop = loop_words(name, budgets[name].rotor).lower()
    words = (
        f"Speed measurement, hold, computing delay and sampling take {lost[name]:.1f} deg at the crossover "
        f"of the {loop}{', more than at any other' * (len(lost) > 1)}; "
        f"{180.0 + budgets[name].total_deg:.1f} deg are left."
    )
    intro = "The phase at the gain crossover of each loop, divided into its causes."
    return doc.section("delays", "Delay budget", blocks, result=words, intro=intro)


def _parts(budgets: Mapping[str, DelayBudget]) -> dict[str, str]:
    """Every item that occurs, with its words: the filters between the plant and the measurement."""
    filters = dict.fromkeys(name for budget in budgets.values() for name in budget.filters_deg)
    before = {key: PARTS[key] for key in ("controller", "plant")}
    return before | {name: name for name in filters} | PARTS


def chart(budgets: Mapping[str, DelayBudget]) -> style.Chart:
    """Draw lag to the right and lead to the left of zero; what is left to 180 deg is phase margin."""
    made = style.Chart(width=style.WIDE, height=70.0 + 48.0 * len(budgets), legend=True)
    panel = made.panel(
        "lag at the gain crossover, deg (lead left of zero; at 180 deg no phase margin is left)"
    )
    parts = _parts(budgets)
    bars = [
        {words: -one.items[key] for key, words in parts.items() if abs(one.items.get(key, 0.0)) > 0.05}
        for one in budgets.values()
    ]
    names = list(dict.fromkeys(name for bar in bars for name in bar))
    for row, bar in enumerate(bars):
        ends = {1: 0.0, -1: 0.0}
        for name, deg in bar.items():
            side, k = (1 if deg >= 0 else -1), names.index(name)
            start, stop = ends[side], ends[side] + deg
            panel.bar(float(row), start, stop, name, colour=style.SERIES[k % 7], hatch=HATCHES[k % 7])
            if abs(deg) > 8:
                panel.note(style.to_minus(f"{deg:.0f}°"), ((start + stop) / 2, float(row)), pinned=True)
            ends[side] = stop
        panel.note(f"{sum(ends.values()):.1f}° in all", (ends[1], float(row)))
    panel.rule_x(180.0, colour=style.INK, width=1.2)
    panel.rule_x(0.0, colour=style.INK)
    style.rows(panel, list(budgets))
    low, high = panel.x.span()
    panel.x.limits(high=max(high * 1.13, 186.0))
    panel.x.ticks = style.multiples(30.0, low, panel.x.span()[1])
    return made
