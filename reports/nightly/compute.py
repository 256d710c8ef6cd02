"""From the payload of a job to its report: what the worker processes run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actuator_lti.errors import InputError
from reports.nightly.figures import digest


def build(payload: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Compute the report of a design and write it out.

    Parameters
    ----------
    payload : mapping
        ``name``, ``design`` (the text of a design file) and ``settings`` (``pdf``, ``validation``).

    Returns
    -------
    meta : dict
        Figures and verdicts (see `reports.nightly.figures.digest`).
    files : dict
        ``report.html``, ``report.json`` and, where asked for, ``report.pdf``.

    Raises
    ------
    InputError, NumericalError
        From reading the design and from the computations.
    """
    from reports import document as doc
    from reports.html import page

    made = design_document(payload)
    content = doc.dumps(made)
    plain = doc.loads(content)
    files = {"report.html": page(plain).encode(), "report.json": content.encode()}
    if payload.get("settings", {}).get("pdf"):
        from reports.pdf import pdf_bytes

        files["report.pdf"] = pdf_bytes(plain)
    return digest(plain), files


def design_document(payload: Mapping[str, Any]) -> dict[str, Any]:
    """Compute the document of a design, with its validation where the settings ask for it."""
    from actuator_lti.design.loader import read_design_text
    from reports.build import design_report

    if "refused" in payload:
        raise InputError(str(payload["refused"]))
    design = read_design_text(str(payload["design"]), str(payload["name"]))
    return design_report(design)
