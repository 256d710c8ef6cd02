"""What the report was made of and with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from reports import document as doc
from reports.document_schema import Section
from reports.findings import Finding


def section(
    design: Mapping[str, Any], provenance: Mapping[str, Any], findings: Sequence[Finding] = ()
) -> Section:
    """Make the section from the document's own head."""
    rows = [
        ("design", f"{design['name']}, revision {design['revision'] or 'none'}"),
        ("design file", design["origin"] or "none"),
        ("hash of the design (SHA-256)", provenance["design_hash"]),
        ("actuator-lti", provenance["version"]),
        ("commit", provenance["commit"] or "not built from a git tree"),
        ("built", provenance["time"]),
        ("Python", f"{provenance['python']}, {provenance['platform']}"),
        *provenance["libraries"].items(),
    ]
    columns = [doc.column("what", "What"), doc.column("value", "Value")]
    blocks = [
        doc.details("To build this report again", [doc.table("Design, program and libraries", columns, rows)])
    ]
    result = (
        f"Computed by actuator-lti {provenance['version']} from the design with hash "
        f"{provenance['design_hash'][:12]}."
    )
    return doc.section("provenance", "Provenance", blocks, result=result, findings=findings)
