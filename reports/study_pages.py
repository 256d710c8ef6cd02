"""Documents of studies; what those of one design have as well: its head, missing parts, which amperes."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from actuator_lti.design import design_hash
from actuator_lti.design.model import Design
from actuator_lti.design.plant import DC_PER_A
from actuator_lti.files.reading import Tree
from analyses.isolation import Missing
from reports import document as doc
from reports.document_schema import Document
from reports.provenance import provenance
from reports.sections import parameters


def study_document(design: Design, sections: Sequence[doc.Section], **about: str) -> Document:
    """Put the document together; ``about``: title, subtitle and kind, as of `reports.document.document`."""
    head, origin = design_head(design), provenance(design_hash(design))
    parts = [*sections, parameters.provenance(head, origin)]
    return doc.document(design=head, provenance=origin, sections=parts, **about)


def notices(missing: Sequence[Missing], id: str) -> list[doc.Section]:
    """Make the section that says what is missing and why; none where nothing is."""
    if not missing:
        return []
    columns = [doc.column("part", "Part"), doc.column("why", "Why it is missing")]
    rows = [{"part": one.part, "why": one.why, "_status": "fail"} for one in missing]
    note = "The rest of the report does not depend on these parts; the exit status is 3."
    what = doc.table("Parts of this report that could not be computed", columns, rows, note)
    return [doc.section(f"missing-{id}", "Missing parts", [what], status="fail")]


def design_head(design: Design) -> Tree:
    return {name: getattr(design, name) for name in ("name", "title", "revision", "origin", "axis")}


# The simulated current of an AC motor is that of its DC equivalent, not the data sheet's.
_OTHER = r"\bA\b(?! ?(?:dc|rms|pe?a?k|phase)|\()"
_BEFORE = r"(?:(?<=\d )|(?<=[Nm]/))"  # a number or a torque per
_WHERE = {
    "unit": "",
    "label": "(?<=, )",
    **dict.fromkeys(("result", "intro", "text", "reason", "note"), _BEFORE),
}
_SHEETS = {"rms-line": "rms", "peak-phase": "peak of a phase"}
_WORDS = {key: re.compile(before + _OTHER) for key, before in _WHERE.items()}


def in_amperes(value: Any, design: Design | None, key: str = "") -> Any:
    """Plain data of a design's results with ``A dc`` for A, where its file has several amperes.

    >>> from actuator_lti import load_design
    >>> in_amperes({"result": "A limit of 2 A, 3 A rms, kM 4 N/A", "unit": "A"}, load_design("ballscrew"))
    {'result': 'A limit of 2 A dc, 3 A rms, kM 4 N/A dc', 'unit': 'A dc'}
    """
    if design is None or design.motor.constants == "dc":
        return value
    if isinstance(value, str):
        return _WORDS[key].sub("A dc", value) if key in _WORDS else value
    if isinstance(value, Mapping):
        made = {name: in_amperes(one, design, name) for name, one in value.items()}
        if made.get("kind") == "table" and made != value:
            constants = design.motor.constants
            same = f"1 A {_SHEETS[constants]} is {DC_PER_A[constants]:#.4g} A dc."
            made["note"] = f"{made['note']} {same}".strip()
        return made
    return [in_amperes(one, design, key) for one in value] if isinstance(value, list | tuple) else value
