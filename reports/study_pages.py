"""Pages: one document, its page and its JSON, both or neither; documents of studies (tolerances, tuning)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_lti.design import design_hash
from actuator_lti.files.atomic import write_together
from actuator_lti.files.tree import Tree
from reports import document as doc
from reports.document_schema import Document

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from reports.drawing import Progress


def design_head(design: Design) -> Tree:
    """Give what a document says of its design."""
    return {name: getattr(design, name) for name in ("name", "title", "revision", "origin", "axis")}


def study_document(
    design: Design, sections: Sequence[doc.Section], *, title: str, subtitle: str, kind: str
) -> Document:
    """Put a document of a study of a design together."""
    from reports.provenance import provenance
    from reports.sections import provenance as provenance_section

    head, origin = design_head(design), provenance(design_hash(design))
    parts = [*sections, provenance_section.section(head, origin)]
    return doc.document(
        title=title, subtitle=subtitle, design=head, provenance=origin, sections=parts, kind=kind
    )


def write_pages(
    made: Mapping[str, Any], folder: Path, stem: str, *, progress: Progress | None = None
) -> tuple[Path, Path]:
    """Write ``<stem>.html`` and ``<stem>.json``; both or neither.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    from reports.html import page

    content = doc.dumps(made)
    html = page(doc.loads(content), progress=progress)
    paths = (folder / f"{stem}.html", folder / f"{stem}.json")
    write_together({paths[0]: html.encode(), paths[1]: content.encode()})
    return paths
