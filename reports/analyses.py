"""Every analysis of a design, declared once: what it asks, what answers, which section shows the answer.

Commands with their help, options and exit status, ``--json``, ``--out``, the report's ``--also`` and the page
of commands are loops over `ANALYSES`. Nothing is imported before it is asked for but the requests.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from importlib import import_module
from inspect import cleandoc
from typing import TYPE_CHECKING, Any

from actuator_lti.asked.verdict import Verdict
from actuator_lti.files.reading import Tree
from analyses.corners.asked import Asked as CornersAsked
from analyses.correlation.asked import Asked as CorrelationAsked
from analyses.duty.asked import Asked as DutyAsked
from analyses.failures.asked import Asked as FailuresAsked
from analyses.identification.asked import Asked as IdentificationAsked
from analyses.margins.asked import Asked as MarginsAsked
from analyses.monte_carlo.asked import Asked as MonteCarloAsked
from analyses.motion.asked import Asked as MotionAsked
from analyses.studies.study_asked import Asked as StudyAsked
from analyses.tuning.asked import Asked as TuningAsked
from analyses.validation.settings import Asked as ValidationAsked
from reports.design_files.asked import AskedKeys, AskedStart
from reports.export_requests import AskedC, AskedController, AskedFmu, AskedLinear
from reports.nightly.asked import Asked as NightlyAsked

if TYPE_CHECKING:
    from actuator_lti.design import Design
    from analyses.studies.study import Study
    from reports.document_schema import Section


@dataclass(frozen=True)
class Analysis:
    """A question to a design."""

    name: str  # of the command, and of the section's module where that has no name of its own
    group: str  # panel of the help in which the command stands
    request: type | None = None  # dataclass, fields annotated (`analyses.request`); None: nothing is asked
    _: KW_ONLY
    words: str = ""  # the command's help, its first paragraph stands in the list; docstring of the request
    # ``package.name`` of ``(design, request) -> result``; where empty that of the command's name beside the
    # request, in ``run`` or ``exports``. Where the result says ``passed``, that is the exit status.
    function: str = ""
    # The section's module in `reports.sections`, whose ``section(result)`` shows the result; without a page
    # that of a list
    shown: str = ""
    also: bool = False  # whether a report has the section where it is asked for (``--also``)
    doing: str = ""  # what the bar says while the function works, which then takes ``progress``
    alone: bool = False  # whether it is asked of no design
    study: bool = False  # whether it is asked of a study (a file, or a design with variants), not of a design
    keeps: bool = False  # whether the function takes the folder ``out``, too, and keeps what it finds there
    written: str = ""  # a flag of the request that is set where the answer is written as a page or as JSON
    stem: str = ""  # name of the page's files; that of the command where empty
    # Folder of the page where none is given; without it, a page is made only where ``--out`` says so
    out: str = ""
    example: str = ""  # module whose docstring holds a file to start from, behind ``::`` (``--example``)

    @property
    def help(self) -> str:
        return cleandoc(self.words or (self.request.__doc__ if self.request else "") or "")

    @property
    def page(self) -> bool:
        """Whether it has a page (``--out``): what is asked of a design, and is no file of another kind."""
        return not self.alone and self.group != EXPORTS

    @property
    def warns(self) -> bool:
        """Whether the result says what is suspicious about the design: where loops or runs are made of it."""
        return self.group in (LINEAR, NONLINEAR)

    def asked(self, design: Design | Study | None, chosen: Tree) -> tuple[Any, ...]:
        """What the function is given beside the design: nothing, or the request with what is chosen."""
        if self.request is None:
            return ()
        made = getattr(self.request, "of", None)
        values = {name: value for name, value in chosen.items() if value is not None}
        return (made(design, **values) if made else self.request(**values),)

    def run(self, design: Design | Study | None, *asked: Any, **more: Any) -> Any:
        beside = self.request.__module__.rpartition(".")[0] if self.request else ""
        usual = f"{beside}.{'exports' if self.group == EXPORTS else 'run'}.{self.name.replace(' ', '_')}"
        package, _, name = (self.function or usual).rpartition(".")
        of = () if self.alone else (design,)
        return getattr(import_module(package), name)(*of, *asked, **more)

    def sections(self, result: Any) -> list[Section]:
        """Show: ``section(result)`` of the section's module, one or several."""
        made = self.shows("section")(result)
        return made if isinstance(made, list) else [made]

    def of_report(self, design: Design) -> list[Section]:
        """The sections of a report of a design, as asked for by default; the first has the verdict."""
        from analyses.specification.asked_figures import answer_of

        result = answer_of(design, self.name)
        first, *more = self.sections(result)
        verdict = self.verdict(result)
        return [first if verdict is None else {**first, "verdict": verdict.value}, *more]

    @staticmethod
    def verdict(result: Any) -> Verdict | None:
        """What decides the exit status; None where nothing is judged."""
        passed = getattr(result, "passed", None)
        passed = passed or getattr(result, "verdict", passed)
        return None if passed is None else Verdict.of(passed)

    def shows(self, name: str, otherwise: Callable[..., Any] | None = None) -> Any:
        """A function of the section's module.

        ``section``; where the module has one, ``text`` of a result that is nothing but a text to print,
        ``brief`` of one whose sections are too long for a terminal, ``data``, the result as plain data,
        ``write``, files that go with it.
        """
        own = self.name if self.page else "listing"
        module = import_module(f"reports.sections.{self.shown or own}")
        return getattr(module, name, otherwise)


DESIGNS, LINEAR, NONLINEAR = "Designs", "Linear loops", "Nonlinear checks"
RECORDS, STUDIES, EXPORTS = "Bench records", "Variants and history", "Out of Python"
ANALYSES = (
    Analysis(
        "designs", DESIGNS, alone=True, function="reports.design_files.run.designs", words="""
        List the shipped designs: name, title, and the stages that each drive has.

        Try: actuator-lti designs
        """,
    ),
    Analysis("init", DESIGNS, AskedStart, alone=True),
    Analysis("keys", DESIGNS, AskedKeys, alone=True),
    Analysis("margins", LINEAR, MarginsAsked),
    Analysis(
        "stiffness", LINEAR, function="analyses.stiffness.stiffness", words="""
        Dynamic and static stiffness and lost motion, checked by the simulator.

        Met where the simulator agrees and the requirements on them are met; not proven where no
        position loop holds the output. The exit status is 1 where it is not met, or not proven.

        Try: actuator-lti stiffness joint
        """,
    ),
    Analysis("corners", LINEAR, CornersAsked, also=True, doing="judging"),
    Analysis("simulate", NONLINEAR, MotionAsked, function="analyses.motion.motion", doing="simulating"),
    Analysis("failures", NONLINEAR, FailuresAsked, also=True),
    Analysis("duty", NONLINEAR, DutyAsked, also=True),
    Analysis(
        "cycles", NONLINEAR, also=True, function="analyses.limit_cycles.limit_cycles", words="""
        Predict limit cycles of play and of a quantised output sensor, and seek them in the simulator.

        Each is predicted by describing function in the exact sampled loop, then the simulator is
        started in its shape at sizes from 0.4 to 2.5 of it. Last, step responses are simulated until they
        settle. The exit status is 1 where such a step ends in a cycle.

        Try: actuator-lti cycles fin --set coupling.play="0.2 deg"
        """,
    ),
    Analysis(
        "validate", NONLINEAR, ValidationAsked, function="analyses.validation.validate", shown="validation",
        doing="validating", written="large", stem="validation",
    ),
    Analysis(
        "identify", RECORDS, IdentificationAsked, doing="identifying", stem="identification",
        example="analyses.records.campaign_file",
    ),
    Analysis(
        "correlate", RECORDS, CorrelationAsked, shown="correlation", doing="simulating", stem="correlation",
    ),
    Analysis(
        "compare", STUDIES, StudyAsked, function="analyses.studies.study_asked.compared", doing="comparing",
        study=True, keeps=True, out="out/compare", example="analyses.studies.study",
    ),
    Analysis(
        "montecarlo", STUDIES, MonteCarloAsked, function="analyses.monte_carlo.asked.study",
        shown="monte_carlo", doing="sampling", keeps=True, out="out/montecarlo",
    ),
    Analysis("tune", STUDIES, TuningAsked, doing="tuning", out="out/tune"),
    Analysis(
        "nightly", STUDIES, NightlyAsked, alone=True, function="reports.nightly.night.nightly",
        shown="nightly", doing="building",
    ),
    Analysis("export c", EXPORTS, AskedC),
    Analysis("export controller", EXPORTS, AskedController),
    Analysis("export fmu", EXPORTS, AskedFmu),
    Analysis("export linear", EXPORTS, AskedLinear),
)  # fmt: skip
COMMANDS_IN = {"export": "The drive outside of Python: C99, FMU, controller for firmware, linear models."}
"""Words of a name that stands before others."""
BY_NAME = {one.name: one for one in ANALYSES}
FURTHER = tuple(one.name for one in ANALYSES if one.also)
"""Sections that a report has only where they are asked for, as they take their time."""
