"""A night on the terminal: how many designs are well, and every one that needs a look."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from actuator_lti.files.tree import Tree
from reports import document as doc
from reports.nightly.machines import summary
from reports.nightly.text import one_line
from reports.nightly.view import STATES, DesignView

if TYPE_CHECKING:
    from reports.nightly.view import Overview


def section(night: Overview) -> doc.Section:
    columns = [
        doc.of(lambda design: STATES[design.state][1], "state", "State"),
        doc.of(lambda design: one_line(design.name, 60), "name", "Design"),
        doc.of(_why, "why", "Why"),
    ]
    bad = [design for design in night.designs if design.state != "pass"]
    cached = sum(design.result.cached for design in night.designs)
    words = f"night {night.run.id}: {night.counts} ({cached} unchanged)"
    blocks = [doc.listing("Designs that need a look", bad, columns)] if bad else []
    return doc.section("night", "Night", blocks, result=words)


def _why(design: DesignView) -> str:
    if design.state == "regression":
        worst = design.regressions[0].figure
        return one_line(f"{len(design.regressions)} figures worse than the baseline, {worst}", 300)
    return one_line(design.why or design.result.worst_id, 300)


def data(night: Overview) -> Tree:
    return summary(night)


def write(night: Overview, _folder: Path | None) -> list[str]:
    return [str(night.site / "index.html")]
