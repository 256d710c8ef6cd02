"""Pages of studies (tolerances, variants, tuning): one document, one page and its JSON, both or neither."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_lti.files.atomic import write_together
from reports import document as doc
from reports.document_schema import Document

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from reports.drawing import Progress


def study_document(
    design: Design, sections: Sequence[doc.Section], *, title: str, subtitle: str, kind: str
) -> Document:
    """Put a document of a study of a design together."""
    from actuator_lti.design import design_hash
    from reports.build import design_head
    from reports.provenance import provenance
    from reports.sections import provenance as provenance_section

    head, origin = design_head(design), provenance(design_hash(design))
    return doc.document(
        title=title,
        subtitle=subtitle,
        design=head,
        provenance=origin,
        sections=[*sections, provenance_section.section(head, origin)],
        kind=kind,
    )


def write_pages(
    made: Mapping[str, Any],
    folder: Path,
    stem: str,
    *,
    progress: Progress | None = None,
    beside: Mapping[str, str] | None = None,
) -> tuple[Path, Path]:
    """Write ``<stem>.html`` and ``<stem>.json``, and the texts that go with them by file name."""
    from reports.html import page

    content = doc.dumps(made)
    html = page(doc.loads(content), progress=progress)
    paths = (folder / f"{stem}.html", folder / f"{stem}.json")
    texts = {paths[0]: html, paths[1]: content}
    texts |= {folder / name: text for name, text in (beside or {}).items()}
    write_together({path: text.encode() for path, text in texts.items()})
    return paths
