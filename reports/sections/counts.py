"""What the counts of the encoders do, which the small signals leave out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from analyses.limit_cycles import Confirmation
from analyses.limit_cycles.counts import WITHIN, Counts
from reports import document as doc
from reports.document_schema import Block, FactItem, Section
from reports.findings import Finding
from reports.sections.names import output_unit

NAMES = {"motor": "Motor encoder", "output": "Output encoder"}


def section(found: Sequence[Counts], axis: str = "rotary") -> Section:
    """Make the section: standing error, ripple, limit cycles, and from where the loop is linear."""
    intro = (
        "A counted angle is a staircase. About the edge of a count it is a relay (gain 2 q/(pi A)); for "
        "large amplitudes its gain tends to 1. The motor's counts are seen in the speed made of them, the "
        "output's in its position."
    )
    blocks: list[Block] = [doc.facts(_facts(one, axis)) for one in found]
    cycles = [(one, cycle) for one in found for cycle in one.cycles]
    if cycles:
        blocks.append(_cycles(cycles, axis))
    words = [sentence(one, axis) for one in found]
    findings = [Finding(severity="info", text=text, where="counts") for text in words]
    return doc.section(
        "counts", "Counts of the encoders", blocks, result=" ".join(words), intro=intro, status="info",
        findings=findings,
    )  # fmt: skip


def sentence(one: Counts, axis: str) -> str:
    """Say in one sentence what the counts do."""
    scale, unit, speed = _units(axis)
    words = [f"{one.ripple_rad_s:.2g} {speed} of ripple at {one.ripple_at_rad_s:.3g} {speed} (motor side)"]
    if one.speed_step_rad_s is not None:
        words.append(f"steps of {one.speed_step_rad_s:.3g} {speed} in the speed estimate")
    if one.standing_rad:
        words.append(f"up to {one.standing_rad * scale:.2g} {unit} of standing error")
    return f"{NAMES[one.sensor]}: counts add {', '.join(words)}."


def _facts(one: Counts, axis: str) -> list[FactItem]:
    scale, unit, speed = _units(axis)
    name = NAMES[one.sensor]
    linear = (
        f"Linear within {100 * WITHIN:.0f} % from this amplitude at the sensor on, by describing function"
    )
    items = [
        doc.fact(f"{name}: one count", one.quantum_rad * scale, unit),
        doc.fact("Ripple of the motor's speed, largest", one.ripple_rad_s, speed),
        doc.fact("at a motor speed of", one.ripple_at_rad_s, speed),
        doc.fact("Standing error, one count", one.standing_rad * scale, unit, better=-1),
        doc.fact("Standing error after a step, simulated", one.standing_seen_rad * scale, unit, better=-1),
        doc.fact(linear, one.linear_rad * scale, unit),
    ]
    if one.linear_seen_rad is not None:
        label = "Linear from this amplitude on, simulated at the bandwidth"
        items.append(doc.fact(label, one.linear_seen_rad * scale, unit))
    if one.speed_step_rad_s is not None:
        items.append(doc.fact("Steps of the speed estimate", one.speed_step_rad_s, speed))
    return items


def _cycles(cycles: Sequence[tuple[Counts, Confirmation]], axis: str) -> Block:
    """Predicted limit cycles beside what the simulator says of them."""
    scale, unit, _ = _units(axis)
    size: dict[str, Any] = {"unit": unit, "scale": scale, "format": "sig:3"}
    columns = [
        doc.of(lambda pair: NAMES[pair[0].sensor], "sensor", "Sensor"),
        doc.of(lambda pair: pair[1].cycle.inner_rad, "amplitude", "Amplitude at the sensor", **size),
        doc.of(lambda pair: pair[1].cycle.output_rad, "output", "At the output", **size),
        doc.of(lambda pair: pair[1].cycle.frequency_hz, "hertz", "Frequency", "Hz", format="sig:3"),
        doc.of(lambda pair: pair[1].ratio, "ratio", "Simulated over predicted", format="sig:3"),
        doc.of(lambda pair: pair[1].verdict, "verdict", "Verdict"),
    ]
    note = "Without dry friction, which quiets most of them."
    return doc.listing("Limit cycles of the counts", cycles, columns, note)


def _units(axis: str) -> tuple[float, str, str]:
    """Scale and unit of an angle, unit of a speed."""
    return (*output_unit(axis), "m/s" if axis == "linear" else "rad/s")
