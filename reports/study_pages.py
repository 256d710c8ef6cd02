"""Documents of studies (tolerances, variants, tuning)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from reports import document as doc
from reports.document_schema import Document

if TYPE_CHECKING:
    from actuator_lti.design.model import Design


def study_document(
    design: Design, sections: Sequence[doc.Section], *, title: str, subtitle: str, kind: str
) -> Document:
    """Put a document of a study of a design together."""
    from actuator_lti.design import design_hash
    from reports.build import design_head
    from reports.provenance import provenance
    from reports.sections import parameters

    head, origin = design_head(design), provenance(design_hash(design))
    parts = [*sections, parameters.provenance(head, origin)]
    return doc.document(
        title=title, subtitle=subtitle, design=head, provenance=origin, sections=parts, kind=kind
    )
