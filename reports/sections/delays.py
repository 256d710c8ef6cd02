"""The delay budget: where the phase at each crossover goes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from actuator_lti.delay_budget import DelayBudget
from reports import document as doc
from reports.document_schema import Row, Section
from reports.sections.names import hertz, loop_words

if TYPE_CHECKING:
    from reports.figures import delay_budget as delay_budget_figure

PARTS = {
    "controller": "controller",
    "plant": "motor, inner loops",
    "measurement": "speed measurement",
    "hold": "hold",
    "computing delay": "computing delay",
    "sampling": "sampling",
}


def section(budgets: Mapping[str, DelayBudget]) -> Section:
    """Make the section from the budget of each loop."""
    parts = _parts(budgets)
    columns = [
        doc.column("loop", "Loop"),
        doc.column("crossover_hz", "Crossover", "Hz", format="sig:4"),
        *(doc.column(key, label.capitalize(), "deg", format="fix:2") for key, label in parts.items()),
        doc.column("total", "Phase in all", "deg", format="fix:2"),
        doc.column("margin", "Left to −180°", "deg", format="fix:2", better=1),
        doc.column("one_more", "One more sample", "deg", format="fix:2"),
    ]
    nothing: Row = dict.fromkeys(parts, 0.0)
    rows = [nothing | _row(name, budget) for name, budget in budgets.items()]
    note = (
        "The loop is built up cause by cause, so the parts add up to the phase of the exact sampled loop. "
        "One more "
        "sample: cost of one more period of computing delay, not included in the total."
    )
    bars: list[delay_budget_figure.Bar] = [
        {
            "label": name,
            "parts": [
                {"name": label, "deg": -budget.items[key]}
                for key, label in parts.items()
                if abs(budget.items.get(key, 0.0)) > 0.05
            ],
        }
        for name, budget in budgets.items()
    ]
    caption = "Lag at the gain crossover of each loop, by cause. The rest to 180° is phase margin."
    blocks = [
        doc.figure("delay_budget", {"bars": bars}, caption=caption, alt=f"Stacked bars. {caption}"),
        doc.table("Phase at the gain crossover", columns, rows, note),
    ]
    intro = "The phase at the gain crossover of each loop, divided into its causes."
    return doc.section("delays", "Delay budget", blocks, result=_result(budgets), intro=intro)


def _result(budgets: Mapping[str, DelayBudget]) -> str:
    """Say which loop loses most phase to sampling, hold and computing delay."""
    digital = ("measurement", "hold", "computing delay", "sampling")
    lost = {name: -sum(budget.items[key] for key in digital) for name, budget in budgets.items()}
    name = max(lost, key=lambda key: lost[key])
    return (
        f"Sampling, hold and computing delay cost the {name} loop {lost[name]:.1f} deg of phase margin, more "
        "than "
        f"any other loop; it has {180.0 + budgets[name].total_deg:.1f} deg left."
    )


def _parts(budgets: Mapping[str, DelayBudget]) -> dict[str, str]:
    """Every item that occurs, with its words: the filters between the plant and the measurement."""
    filters = dict.fromkeys(name for budget in budgets.values() for name in budget.filters_deg)
    parts = dict(PARTS)
    after = {key: parts.pop(key) for key in list(parts) if key not in ("controller", "plant")}
    return parts | {name: name for name in filters} | after


def _row(name: str, budget: DelayBudget) -> Row:
    return {
        "loop": loop_words(name),
        "crossover_hz": hertz(budget.frequency_rad_s),
        **budget.items,
        "total": budget.total_deg,
        "margin": 180.0 + budget.total_deg,
        "one_more": budget.one_more_sample_deg,
    }
