"""From a design to the document of its report; drawing and writing come after."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from os import PathLike
from typing import Any

from actuator_lti.design import design_hash, warnings_of
from actuator_lti.design.loader import AnyDesign, as_design, design_text
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.files.reading import as_path
from actuator_lti.loops import assemble_loops
from actuator_lti.types import Progress
from analyses.corners.run import Corners
from analyses.isolation import attempt, isolated
from analyses.linear.loop_survey import LoopSurvey, survey_loops
from analyses.margins.run import measured_if_asked
from analyses.specification.asked_figures import answer_of
from analyses.specification.mending import mending
from analyses.specification.requirements import RequirementVerdict, evaluate_requirements
from analyses.specification.weakest import WeakPoint, spread, weakest
from analyses.validation import validate
from reports import document as doc
from reports.analyses import BY_NAME, FURTHER
from reports.document_schema import Document
from reports.html import write_report
from reports.live.model import live_model
from reports.provenance import provenance
from reports.sections import (
    answer,
    forms,
    limits,
    loop,
    margins,
    measured,
    parameters,
    requirements,
    stiffness,
    validation,
)
from reports.study_pages import design_head, in_amperes, notices

Step = Callable[[str], AbstractContextManager[Progress]]


def report(
    design: AnyDesign, out: str | PathLike[str] | None = None, *, validation: bool = True,
    also: Sequence[str] = (), added: Sequence[doc.Section] = (), response: Any = None, response_of: str = "",
    averages: int | None = None, source: str | None = None, step: Step = lambda _words: nullcontext(),
) -> Document:  # fmt: skip
    """Compute the whole report of a design, as the command of the same name does.

    What comes back is the document of `reports.document`, plain JSON. ``out``: folder of ``report.html`` and
    ``report.json``; nothing is written where it is left out. ``validation``: check every linear prediction by
    simulation, too. ``also``: further sections, of `reports.analyses.FURTHER`; ``added``: sections of other
    documents, put before these. ``response``, ``response_of``, ``averages``: a measured response, laid over
    the model, as `analyses.margins.run.measured_over` has it. ``source``: see `design_report`; the text of
    the file where ``design`` is a name or a path. ``step``: gives a context, and in it a function for (done,
    all), for each step named to it.

    Raises `InputError`: for a design, section or folder that cannot be taken.

    Examples
    --------
    >>> made = report("ctms-motor-position", validation=False)
    >>> made["verdict"]["verdict"]
    'met'
    """
    drive, folder = as_design(design), None if out is None else as_path(out)
    if source is None and not isinstance(design, Design):
        source = design_text(design)
    with step(f"further sections of {drive.name}"):
        laid = measured_if_asked(assemble_loops(drive), response, response_of, averages)
        parts = [] if laid is None else [measured.section(laid)]
        parts += [*added, *further_sections(drive, also)]
    if validation:
        with step(f"validating {drive.name}") as validating:
            parts = [*validation_sections(drive, validating), *parts]
    with step(f"computing {drive.name}") as computing:
        made = design_report(drive, parts, progress=computing, source=source)
    if folder is not None:
        with step("drawing figures") as drawing:
            write_report(made, folder, progress=drawing)
    return made


def design_report(
    design: Design,
    validation: Sequence[doc.Section] = (),
    progress: Progress = None,
    source: str | None = None,
) -> Document:
    """Compute the report of a design as a document of `reports.document`.

    Sections of the validator (or others) are put after those of the loops, the verdicts of the validator
    before them; their verdicts count. ``source``: the text that the design was read from; the page changes
    that, not one written anew.

    Raises `InputError`: from the computations. Whatever else fails leaves out its part only: a notice stands
    in its place, and `analyses.isolation.drain` gives it.
    """
    origin, head = provenance(design_hash(design)), design_head(design)
    with isolated() as missing:
        survey = attempt("linear loops", lambda: survey_loops(design, progress), None)
        figures, loops, bounds, point = {} if survey is None else survey.figures, [], None, None
        if survey is not None:
            verdicts = attempt("requirements", lambda: evaluate_requirements(design, figures), ())
            loops = loop_sections(survey, verdicts)
            bounds = attempt("corners", lambda: answer_of(design, "corners"), None)
            point = attempt("weakest point", lambda: weakest(survey, bounds), None)
    loops, validation = in_amperes(loops, design), in_amperes(validation, design)
    first = [part for part in validation if part["id"] == "validation"]
    others = (part for part in validation if part not in first)
    sources = parameters.section(design, warnings_of(design))
    sections = [*loops[:1], *first, *loops[1:], *others, sources]
    sections.append(parameters.provenance(head, origin, checked=bool(first)))
    doc.waived(sections, design)
    with isolated() as unanswered:
        items = doc.judged(doc.walk(loops[0])) if loops else []
        ranges = {} if survey is None else spread(survey.operating_points)

        def first_screen() -> list[doc.Section]:
            mend = _mend(point, survey, bounds)
            return [answer.section(figures, items, sections, point, ranges, bounds=bounds, mend=mend)]

        answered = attempt("first screen", first_screen, [])
    sections[:0] = [*(answered if figures else []), *notices([*missing, *unanswered], "linear")]
    made = doc.document(
        title=design.title or design.name, subtitle=design.description, design=head, provenance=origin,
        sections=sections,
    )  # fmt: skip
    live = attempt("sliders", lambda: live_model(design, source), None)
    if live and figures:
        made["live"] = live
    return made


def _mend(point: WeakPoint | None, survey: LoopSurvey | None, bounds: Corners | None) -> str:
    if point is None or survey is None or point.reserve >= 0.0:
        return ""
    move = attempt("move that mends the weakest point", lambda: mending(point, survey, bounds), None)
    return answer.NO_MOVE if move is None else answer.move_words(survey.design, move)


def further_sections(design: Design, names: Sequence[str]) -> list[doc.Section]:
    """Make the sections of `FURTHER` that are named; one that the drive cannot have says why.

    Raises `InputError`: for a name that is none.
    """
    for name in names:
        if name not in FURTHER:
            raise InputError(f"also = {name!r}: allowed: {', '.join(FURTHER)}, all")
    made: list[doc.Section] = []
    with isolated() as missing:
        for name in dict.fromkeys(names):
            try:
                made += attempt(f"section {name}", partial(BY_NAME[name].of_report, design), [])
            except InputError as error:
                why = f"Not for this drive: {error.message.removeprefix(f'{name}: ')}."
                made.append(doc.section(name, name.capitalize(), [], result=why))
    return [*made, *notices(missing, "further")]


def validation_sections(design: Design, progress: Progress = None) -> list[doc.Section]:
    """Put the predictions to the simulator; a design that cannot be tested says why."""
    title = "Predictions against simulation"
    with isolated() as missing:
        try:
            made = attempt(title, lambda: validation.section(validate(design, progress=progress)), [])
        except InputError as error:
            made = [doc.section("validation", title, [doc.text(f"Not tested: {error}")], status="warn")]
    return [*made, *notices(missing, "validation")]


def loop_sections(survey: LoopSurvey, verdicts: Sequence[RequirementVerdict]) -> list[doc.Section]:
    design, figures, onset = survey.design, survey.figures, survey.onset
    makers: dict[str, Callable[[], doc.Section]] = {
        "Requirements": lambda: requirements.section(verdicts),
        "Margins": lambda: margins.of_loops(figures, survey.operating_points),
    }
    for name, result in figures.items():
        makers[f"Loop {name}"] = partial(loop.section, name, design, result)
    if figures:
        makers["Forms"] = lambda: forms.section(survey.forms, survey.refused)
        makers["Break points"] = lambda: forms.break_points(survey.break_points, figures)
        makers["Operating points"] = lambda: forms.operating_points(survey.operating_points, design)
    if survey.budgets:
        makers["Delays"] = lambda: forms.delay_budget(survey.budgets)
    if design.coupling is not None or design.load.path == "back-drivable":
        makers["Stiffness"] = lambda: stiffness.of_design(design)
    if onset is not None:
        makers["Limits"] = lambda: limits.section(design, onset)
    made = (attempt(f"section {name}", make, None) for name, make in makers.items())
    return [part for part in made if part is not None]
