"""The delay budget: where the phase at each crossover goes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actuator_lti.delay_budget import DelayBudget
from reports import document as doc
from reports.sections.names import LOOPS, hertz

PARTS = {
    "controller": "controller",
    "plant": "motor, inner loops",
    "measurement": "speed measurement",
    "hold": "hold",
    "computing delay": "computing delay",
    "sampling": "sampling",
}


def section(budgets: Mapping[str, DelayBudget]) -> dict[str, Any]:
    """Make the section from the budget of each loop."""
    columns = [
        doc.column("loop", "Loop"),
        doc.column("crossover_hz", "Crossover", "Hz", format="sig:4"),
        *(doc.column(key, label.capitalize(), "deg", format="fix:2") for key, label in PARTS.items()),
        doc.column("total", "Phase in all", "deg", format="fix:2"),
        doc.column("margin", "Left to −180°", "deg", format="fix:2"),
        doc.column("one_more", "One more sample", "deg", format="fix:2"),
    ]
    rows = [_row(name, budget) for name, budget in budgets.items()]
    note = (
        "Measured by the same loop built up step by step, so that the parts add up to the phase of the exact "
        "sampled loop. One more sample: what one more period of computing delay costs, not in the total."
    )
    bars = [
        {
            "label": name,
            "parts": [
                {"name": label, "deg": -budget.items[key]}
                for key, label in PARTS.items()
                if abs(budget.items[key]) > 0.05
            ],
        }
        for name, budget in budgets.items()
    ]
    caption = "Lag at the gain crossover of each loop, part by part; the rest to 180° is phase margin."
    blocks = [
        doc.figure("delay_budget", {"bars": bars}, caption=caption, alt=f"Stacked bars. {caption}"),
        doc.table("Phase at the gain crossover", columns, rows, note),
    ]
    return doc.section("delays", "Delay budget", blocks, intro="Where the phase at each crossover is spent.")


def _row(name: str, budget: DelayBudget) -> dict[str, Any]:
    return {
        "loop": LOOPS[name],
        "crossover_hz": hertz(budget.frequency_rad_s),
        **budget.items,
        "total": budget.total_deg,
        "margin": 180.0 + budget.total_deg,
        "one_more": budget.one_more_sample_deg,
    }
