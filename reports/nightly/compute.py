"""From the payload of a job to its report: what the worker processes run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from actuator_lti.errors import InputError
from actuator_lti.files.tree import Tree
from reports.document_schema import Document, Section
from reports.nightly.figures import digest

if TYPE_CHECKING:
    from actuator_lti.design.model import Design


def build(payload: Mapping[str, Any]) -> tuple[Tree, dict[str, bytes]]:
    """Compute a report: what `reports.nightly.figures.digest` keeps of it, and its files.

    The payload has ``name``, ``settings`` (``pdf``, ``validation``, ``monte_carlo``) and either ``design``,
    the text of a design file, or ``study``, all designs of a study as texts, which makes their comparison (no
    figures are kept of it, as they are those of its designs); ``refused`` in place of them says why there is
    no design.
    """
    from analyses.isolation import drain
    from reports import document as doc
    from reports.html import page

    drain()
    if "refused" in payload:
        raise InputError(str(payload["refused"]))
    comparison = "study" in payload
    plain = doc.loads(doc.dumps(comparison_document(payload) if comparison else design_document(payload)))
    files = {"report.html": page(plain).encode(), "report.json": doc.dumps(plain).encode()}
    if payload.get("settings", {}).get("pdf"):
        from reports.pdf import pdf_bytes

        files["report.pdf"] = pdf_bytes(plain)
    meta = digest({**plain, "sections": []} if comparison else plain)
    lacking = [one.part for one in drain() if one.part.startswith("figure ")]  # sections say so themselves
    meta["failed_sections"] = [*meta["failed_sections"], *(f"{part}, not drawn" for part in lacking)]
    return meta, files


def design_document(payload: Mapping[str, Any]) -> Document:
    """Compute the report of a design, with validation and Monte Carlo where the settings ask for them."""
    from reports.build import design_report, validation_sections

    design = _design(payload)
    settings: Mapping[str, Any] = payload.get("settings", {})
    sections: list[Section] = []
    if settings.get("validation"):
        sections += validation_sections(design)
    if settings.get("monte_carlo"):
        sections += _tolerances(design, settings["monte_carlo"])
    return design_report(design, validation=sections)


def _tolerances(design: Design, plan: Mapping[str, int]) -> list[Section]:
    """Sample the tolerances of a design; nothing where none of its values has one."""
    from analyses.monte_carlo.run import MonteCarloSettings, monte_carlo
    from analyses.studies.engine import Engine
    from reports.sections.monte_carlo import section

    if not any(p.tolerance is not None for p in design.parameters.values()):
        return []
    with TemporaryDirectory(prefix="nightly-") as folder:
        settings = MonteCarloSettings(samples=plan["samples"], seed=plan["seed"])
        return [section(monte_carlo(design, Path(folder), settings, engine=Engine(threads=1)))]


def comparison_document(payload: Mapping[str, Any]) -> Document:
    """Compare all designs of a study on one page."""
    from analyses.comparison.variants import compare
    from analyses.slugs import slug
    from analyses.studies.study import Study, Variant
    from reports.sections.compare import section as sections
    from reports.study_pages import study_document

    designs = [
        Variant(
            str(one["name"]),
            slug(str(one["name"])),
            _design(one) if "design" in one else None,
            dict(one.get("overrides", {})),
            str(one.get("refused", "")),
        )
        for one in payload["study"]["designs"]
    ]
    base = designs[0].design
    assert base is not None
    title = str(payload["study"]["title"])
    plan = Study(str(payload["name"]), title, "", title, designs[0], tuple(designs[1:]))
    subtitle = f"{designs[0].name} and {len(designs) - 1} variants"
    return study_document(base, sections(compare(plan)), title=title, subtitle=subtitle, kind="compare")


def _design(payload: Mapping[str, Any]) -> Design:
    from actuator_lti.design.loader import read_design_text

    return read_design_text(str(payload["design"]), str(payload["name"]))
