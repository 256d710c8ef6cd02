"""Documents of studies (tolerances, variants, tuning), and what those of one design have as well."""

from collections.abc import Sequence

from actuator_lti.design import design_hash
from actuator_lti.design.model import Design
from actuator_lti.files.tree import Tree
from analyses.isolation import Missing
from reports import document as doc
from reports.document_schema import Document
from reports.provenance import provenance
from reports.sections import parameters


def study_document(
    design: Design, sections: Sequence[doc.Section], *, title: str, subtitle: str, kind: str
) -> Document:
    head, origin = design_head(design), provenance(design_hash(design))
    parts = [*sections, parameters.provenance(head, origin)]
    return doc.document(
        title=title, subtitle=subtitle, design=head, provenance=origin, sections=parts, kind=kind
    )


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
