"""From the payload of a job to its report: what the worker processes run."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from actuator_lti.design.loader import read_design_text
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree
from analyses.comparison.variants import compare
from analyses.isolation import drain
from analyses.monte_carlo.run import MonteCarloSettings, monte_carlo
from analyses.slugs import slug
from analyses.studies.engine import Engine
from analyses.studies.study import Study, Variant
from reports import document as doc
from reports.build import design_report, validation_sections
from reports.document_schema import Document
from reports.html import page
from reports.nightly.figures import digest
from reports.pdf import pdf_bytes
from reports.sections import compare as compare_section
from reports.sections import monte_carlo as monte_carlo_section
from reports.study_pages import study_document


def build(payload: Mapping[str, Any]) -> tuple[Tree, dict[str, bytes]]:
    """Compute a report: what `reports.nightly.figures.digest` keeps of it, and its files.

    The payload has ``name``, ``settings`` (``pdf``, ``validation``, ``monte_carlo``) and either ``design``, a
    design file's text, or ``study``, all designs of a study, for their comparison (figures are kept of the
    designs alone), or ``refused``, why there is none.
    """
    drain()
    if "refused" in payload:
        raise InputError(str(payload["refused"]))
    settings, comparison = payload.get("settings", {}), "study" in payload
    made = _comparison(payload) if comparison else _report(_design(payload), settings)
    plain = doc.loads(doc.dumps(made))
    html, data = page(plain, beside="report.json").encode(), doc.dumps(plain).encode()
    files = {"report.html": html, "report.json": data}
    files |= {"report.pdf": pdf_bytes(plain)} if settings.get("pdf") else {}
    meta = digest({**plain, "sections": []} if comparison else plain)
    lacking = [one.part for one in drain() if one.part.startswith("figure ")]  # sections say so themselves
    meta["failed_sections"] = [*meta["failed_sections"], *(f"{part}, not drawn" for part in lacking)]
    return meta, files


def _design(payload: Mapping[str, Any]) -> Design:
    return read_design_text(str(payload["design"]), str(payload["name"]))


def _report(design: Design, settings: Mapping[str, Any]) -> Document:
    sections = validation_sections(design) if settings.get("validation") else []
    plan = settings.get("monte_carlo")
    if plan and any(one.tolerance is not None for one in design.parameters.values()):
        sampled = MonteCarloSettings(samples=plan["samples"], seed=plan["seed"])
        with TemporaryDirectory(prefix="nightly-") as folder:
            found = monte_carlo(design, Path(folder), sampled, engine=Engine(threads=1))
            sections = [*sections, monte_carlo_section.section(found)]
    return design_report(design, validation=sections)


def _comparison(payload: Mapping[str, Any]) -> Document:
    def variant(one: Mapping[str, Any]) -> Variant:
        design = _design(one) if "design" in one else None
        return Variant(one["name"], slug(one["name"]), design, one["overrides"], one.get("refused", ""))

    base, *others = map(variant, payload["study"]["designs"])
    assert base.design is not None
    title = payload["study"]["title"]
    parts = compare_section.section(compare(Study(payload["name"], title, "", title, base, tuple(others))))
    subtitle = f"{base.name} and {len(others)} variants"
    return study_document(base.design, parts, title=title, subtitle=subtitle, kind="compare")
