"""A night on the terminal: how many designs are well, and every one that needs a look."""

from pathlib import Path

from reports import document as doc
from reports.nightly.changes import change_words
from reports.nightly.machines import summary as data
from reports.nightly.text import one_line
from reports.nightly.view import STATES, Overview

__all__ = ["data", "section", "write"]


def section(night: Overview) -> doc.Section:
    rows = []
    for design in (one for one in night.designs if one.state != "pass"):
        why = design.why or design.result.worst_id or "; ".join(design.meta.get("words", ()))
        if design.state == "regression":
            worst = design.baseline.regressions
            first = change_words(worst[0], design.baseline, design.verdicts)
            why = f"{len(worst)} figures worse than {design.held_against}; first {first}"
        rows.append((STATES[design.state][1], one_line(design.name, 60), one_line(why, 300)))
    columns = [doc.column("state", "State"), doc.column("name", "Design"), doc.column("why", "Why")]
    blocks = [doc.table("Designs that need a look", columns, rows)] if rows else []
    cached = sum(design.result.cached for design in night.designs)
    words = f"night {night.run.id}: {night.counts} ({cached} unchanged)"
    words += f". {night.left_out}" * bool(night.gone)
    return doc.section("night", "Night", blocks, result=words)


def write(night: Overview, _folder: Path | None) -> list[str]:
    return [str(night.site / "index.html")]
