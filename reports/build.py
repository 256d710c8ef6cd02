"""From a design to the document of its report; drawing and writing come after."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_lti.atomic import write_together
from actuator_lti.design.model import Design
from reports import document as doc

if TYPE_CHECKING:
    from analyses.loop_survey import LoopSurvey
    from analyses.requirements import RequirementVerdict

Progress = Callable[[int, int], None]


def design_report(
    design: Design, validation: Sequence[doc.Section] = (), progress: Progress | None = None
) -> dict[str, Any]:
    """Compute the report of a design as a document.

    Parameters
    ----------
    design : Design
    validation : sequence of section, optional
        Sections of the validator (or others), put after those of the loops, the verdicts of the validator
        before them; their verdicts count.
    progress : callable, optional
        Called with (steps done, steps in all).

    Returns
    -------
    dict
        The document of `reports.document`: plain JSON.

    Raises
    ------
    InputError, NumericalError
        From the computations.
    """
    from actuator_lti.design import design_hash, warnings_of
    from analyses.loop_survey import survey_loops
    from analyses.requirements import evaluate_requirements
    from reports.provenance import provenance
    from reports.sections import answer

    survey = survey_loops(design, progress)
    verdicts = evaluate_requirements(design, survey.figures)
    origin, head = provenance(design_hash(design)), design_head(design)
    requirements, *loops = loop_sections(survey, verdicts)
    first = [part for part in validation if part["id"] == "validation"]
    sections = [
        requirements,
        *first,
        *loops,
        *(part for part in validation if part not in first),
        *closing_sections(design, head, origin, warnings_of(design), checked=bool(first)),
    ]
    items = [item for block in doc.walk(requirements) for item in block.get("items", ())]
    sections.insert(0, answer.section(survey.figures, items, sections))
    return doc.document(
        title=design.title or design.name,
        subtitle=design.description,
        design=head,
        provenance=origin,
        sections=sections,
    )


def loop_sections(survey: LoopSurvey, verdicts: Sequence[RequirementVerdict]) -> list[doc.Section]:
    """Make the sections about the linear loops, verdicts first."""
    from reports.sections import (
        break_points,
        delays,
        forms,
        limits,
        loop,
        margins,
        operating_points,
        requirements,
    )
    from reports.sections.names import load_unit

    design, figures = survey.design, survey.figures
    sections = [requirements.section(verdicts, load_unit(design)), margins.section(figures, survey.locked)]
    for name, found in figures.items():
        locked = survey.locked if name == "current" else None
        sections.append(loop.section(name, design, found, locked))
    sections.append(forms.section(survey.forms, survey.refused))
    sections.append(break_points.section(survey.break_points, figures))
    sections.append(operating_points.section(survey.operating_points, design))
    if survey.budgets:
        sections.append(delays.section(survey.budgets))
    if survey.onset is not None:
        sections.append(limits.section(design, survey.onset))
    return sections


def closing_sections(
    design: Design,
    head: Mapping[str, Any],
    origin: Mapping[str, Any],
    warnings: Sequence[str],
    *,
    checked: bool = True,
) -> list[doc.Section]:
    """Make the sections that every report of a design ends with; ``checked``: by simulation too."""
    from reports.sections import answer, parameters, provenance

    findings = () if checked else (answer.unchecked(),)
    return [parameters.section(design, warnings), provenance.section(head, origin, findings)]


def design_head(design: Design) -> dict[str, Any]:
    """Give what a document says of its design."""
    return {
        "name": design.name,
        "title": design.title,
        "revision": design.revision,
        "origin": design.origin,
        "axis": design.axis,
    }


def write_report(
    made: Mapping[str, Any], folder: str | Path, *, progress: Progress | None = None
) -> tuple[Path, Path]:
    """Write ``report.html`` and ``report.json``; both or neither.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    from reports.html import page

    content = doc.dumps(made)
    html = page(doc.loads(content), progress=progress)
    paths = (Path(folder) / "report.html", Path(folder) / "report.json")
    write_together({paths[0]: html.encode(), paths[1]: content.encode()})
    return paths
