"""Every analysis of a design, declared once: what it asks, what answers, which section shows the answer.

Commands with their help, options and exit status, ``--json``, ``--out``, the report's ``--also`` and the page
of commands are loops over `ANALYSES`. Nothing is imported before it is asked for but the requests.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from actuator_lti.files.tree import Tree
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
from analyses.validation.asked import Asked as ValidationAsked
from reports.design_files.keys import Asked as KeysAsked
from reports.design_files.start import Asked as StartAsked
from reports.exports.asked import AskedC, AskedController, AskedFmu, AskedLinear
from reports.nightly.asked import Asked as NightlyAsked

if TYPE_CHECKING:
    from actuator_lti.design import Design
    from analyses.studies.study import Study
    from reports.document_schema import Section
    from reports.terminal import Brief


@dataclass(frozen=True, kw_only=True)
class Analysis:
    """A question to a design."""

    name: str  # of the command, and of the section's module where that has no name of its own
    group: str  # panel of the help in which the command stands
    words: str  # the command's help; its first paragraph stands in the list
    # Dataclass of what is asked, its fields annotated (`analyses.request`); None: nothing
    request: type | None = None
    # ``package.name`` of ``(design, request) -> result``; ``analyses.NAME.NAME`` where empty. Where the
    # result says ``passed``, that is the exit status.
    function: str = ""
    # The section's module in `reports.sections`, whose ``section(result)`` shows the result; without a page
    # that of a list
    shown: str = ""
    also: bool = False  # whether a report has the section where it is asked for (``--also``)
    doing: str = ""  # what the bar says while the function works, which then takes ``progress``
    alone: bool = False  # whether it is asked of no design; it has no page then
    page: bool = True  # whether it has a page (``--out``)
    study: bool = False  # whether it is asked of a study (a file, or a design with variants), not of a design
    # Whether the function takes ``out`` as well, the folder, and keeps there what it finds
    keeps: bool = False
    written: str = ""  # a flag of the request that is set where the answer is written as a page or as JSON
    warns: bool = False  # whether what is suspicious about the design is said first
    stem: str = ""  # name of the page's files; that of the command where empty
    # Folder of the page where none is given; without it, a page is made only where ``--out`` says so
    out: str = ""
    # Module whose docstring holds a file to start from, behind ``::``; ``--example`` prints it
    example: str = ""

    def asked(self, design: Design | Study | None, chosen: Tree) -> tuple[Any, ...]:
        """What the function is given beside the design: nothing, or the request with what is chosen."""
        if self.request is None:
            return ()
        made = getattr(self.request, "of", None)
        values = {name: value for name, value in chosen.items() if value is not None}
        return (made(design, **values) if made else self.request(**values),)

    def run(self, design: Design | Study | None, *asked: Any, **more: Any) -> Any:
        """Ask."""
        package, _, name = (self.function or f"analyses.{self.name}.{self.name}").rpartition(".")
        of = () if self.alone else (design,)
        return getattr(import_module(package), name)(*of, *asked, **more)

    def sections(self, result: Any) -> list[Section]:
        """Show: ``section(result)`` of the section's module, one or several."""
        made = self._shown.section(result)
        return made if isinstance(made, list) else [made]

    def text(self, result: Any) -> str | None:
        """The result where it is nothing but a text to print (``text`` of the section's module)."""
        made: str | None = getattr(self._shown, "text", lambda _result: None)(result)
        return made

    def brief(self, result: Any) -> Brief | None:
        """What the terminal prints where the sections are too long (``brief`` of their module)."""
        made: Brief | None = getattr(self._shown, "brief", lambda _result: None)(result)
        return made

    def data(self, result: Any) -> Any:
        """The result as plain data: what the section's module says (``data``), else by its names."""
        from reports.as_json import as_json

        return getattr(self._shown, "data", as_json)(result)

    def write(self, result: Any, folder: Path | None) -> list[str]:
        """Write what goes with the result (``write`` of the section's module); the files."""
        written: list[str] = getattr(self._shown, "write", lambda _result, _folder: [])(result, folder)
        return written

    @property
    def _shown(self) -> ModuleType:
        own = self.name if self.page and not self.alone else "listing"
        return import_module(f"reports.sections.{self.shown or own}")


ANALYSES = (
    Analysis(
        name="designs",
        group="Designs",
        alone=True,
        function="reports.design_files.catalogue.catalogue",
        words="""
        List the shipped designs: name, title, and the stages that each drive has.

        Try: actuator-lti designs
        """,
    ),
    Analysis(
        name="init",
        group="Designs",
        alone=True,
        request=StartAsked,
        function="reports.design_files.start.start",
        words="""
        Write a commented design file to start one's own drive from.

        Try: actuator-lti init arm.toml --kind joint, or with values of data sheets:
        actuator-lti init arm.toml --motor maxon-ec-i-40-100w-48v --gear harmonic-drive-csf-17-30
        """,
    ),
    Analysis(
        name="keys",
        group="Designs",
        alone=True,
        request=KeysAsked,
        function="reports.design_files.keys.keys",
        words="""
        List the keys of a design file: unit, default, allowed range, meaning, example.

        A repeated table stands as gear.* (by name), friction.point.* and control.velocity.filter.* (by
        number). Try: actuator-lti keys notch, or actuator-lti keys --explain my.toml
        """,
    ),
    Analysis(
        name="margins",
        group="Linear loops",
        request=MarginsAsked,
        warns=True,
        words="""
        Print margins, bandwidths and verdicts of every loop; the margins are certified.

        Requirements are judged on the sampled loops with sliding friction, whatever form is printed.

        Try: actuator-lti margins joint --set control.position.gain="12 1/s", or
        actuator-lti margins joint --operating-point rest --load "60 N*m"
        """,
    ),
    Analysis(
        name="stiffness",
        group="Linear loops",
        words="""
        Dynamic and static stiffness and lost motion, checked by the simulator.

        Met where the simulator agrees; not proven where no position loop holds the
        output. The exit status is 1 where it is not met, or not proven.

        Try: actuator-lti stiffness joint
        """,
    ),
    Analysis(
        name="corners",
        group="Linear loops",
        also=True,
        request=CornersAsked,
        words="""
        Judge the linear loops at the corners of the drive: hot, cold, low supply, worst tolerances.

        Resistance and torque constant follow \\[temperature] of the design, or copper and NdFeB. The
        exit status is 1 where a requirement is not met, or a loop not stable, at any corner.

        Try: actuator-lti corners fin --hot 85 --cold -54 --supply 22
        """,
    ),
    Analysis(
        name="simulate",
        group="Nonlinear checks",
        request=MotionAsked,
        function="analyses.motion.motion",
        doing="simulating",
        words="""
        Move the drive in the nonlinear simulator: every limit, stick and slip, exact between the ticks.

        Try: actuator-lti simulate joint --amplitude "5 deg" --duration 0.5 --load "20 N*m" --csv step.csv, or
        actuator-lti simulate fin --command chirp --amplitude 0.5 --frequency 1 --to 50 --duration 4
        """,
    ),
    Analysis(
        name="failures",
        group="Nonlinear checks",
        also=True,
        request=FailuresAsked,
        words="""
        Simulate jam, hard-over, open phase, frozen and lost sensor and an oscillatory command.

        Prints for each failure the time to a stated deflection and to the mechanical stop, the
        deflection until the failure is detected, the largest current and the largest torque in the
        train. What is not given comes from \\[failure] of the design.

        Try: actuator-lti failures joint --stop "25 deg" --deflection "2 deg" --detection 0.05
        """,
    ),
    Analysis(
        name="duty",
        group="Nonlinear checks",
        also=True,
        request=DutyAsked,
        words="""
        Hold a duty cycle against continuous current, overload protection (I2t) and winding
        temperature.

        The duty is a sine under a load, for a share of the time; what is not given comes from
        \\[duty]. The temperature needs thermal_resistance and thermal_time in \\[temperature], the
        protection limits.peak_time. The exit status is 1 where the duty is beyond the continuous rating, or
        where none is stated.

        Try: actuator-lti duty joint --amplitude "10 deg" --load "40 N*m" --share 0.3 --cycle 20
        """,
    ),
    Analysis(
        name="cycles",
        group="Nonlinear checks",
        also=True,
        function="analyses.limit_cycles.limit_cycles",
        words="""
        Predict limit cycles of play and of a quantised output sensor, and seek them in the simulator.

        Each is predicted by describing function in the exact sampled loop, then the simulator is
        started in its shape at sizes from 0.4 to 2.5 of it. Last, steps of the drive as it is are simulated
        until they settle. The exit status is 1 where such a step ends in a cycle.

        Try: actuator-lti cycles fin --set coupling.play="0.2 deg"
        """,
    ),
    Analysis(
        name="validate",
        group="Nonlinear checks",
        request=ValidationAsked,
        function="analyses.validation.validate",
        shown="validation",
        doing="validating",
        written="large",
        stem="validation",
        words="""
        Check every prediction against the derivative of the nonlinear simulator, and show where it ends.

        Each row is met, not met or not proven. Exit status 1 if one is not met, or not proven and not waived,
        if the drive does not come to rest, or if a command within full deflection makes it diverge. The page
        (--out), --json and --large also show what is large, starts from rest, or is shaken by counts.

        Try: actuator-lti validate joint --quick, or actuator-lti validate fin --out out/fin
        """,
    ),
    Analysis(
        name="identify",
        group="Bench records",
        request=IdentificationAsked,
        function="analyses.identification.run.identify",
        doing="identifying",
        stem="identification",
        example="analyses.records.campaign_file",
        words="""
        Identify a drive from bench records, and write the result as a design with
        tolerances.

        Five ways to call it:

        identify campaign.toml --out result: C0, Cv and CM from the steady parts
        of many runs. A bad run is set aside and named, the others go on.
        --example prints a campaign file.

        identify A.csv B.csv --validate C.csv --design my.toml: inertia, friction
        and offset from records of a motion together, by the inverse dynamic
        model; --refine simulates the drive as well. The EMPS benchmark's file is
        known as it is.

        identify --frequency-response chirp.csv --play reversal.csv --design my.toml:
        inertias, stiffness, damping and play of a two-mass drive.

        identify --response loop.csv --of T --design my.toml: inertias, stiffness,
        damping and delay from a measured frequency response of any loop.

        identify --plan my.toml --within 2 --out result: motions that make the
        intervals as small as asked; with records after it, what to measure next.

        Every column of every file is accounted for. Each record is held against
        itself and against the design's limits, and the written design against the
        record that it came from. Where a check fails the status is 1, and no
        design is written without --accept; with --out, page and JSON are.

        Try: actuator-lti identify DATA_EMPS.mat --design emps --out result
        """,
    ),
    Analysis(
        name="correlate",
        group="Bench records",
        request=CorrelationAsked,
        function="analyses.correlation.run.correlate",
        shown="correlation",
        doing="simulating",
        stem="correlation",
        words="""
        Run the model with each record's own command, load and supply, and say how
        far off it is.

        For every signal that both have: relative error, fit, mean, rms and largest
        error, delay; over several records also all together, and the worst; with
        --out pictures of both and the difference. Where a record contradicts
        itself or the design's limits (a wrong unit, swapped columns, a clock that
        is off), a motion fits no better than its mean, or a signal is off by
        more than --error-limit, the status is 1.

        The outermost command that is recorded drives the model: reference of the
        output angle, speed, current (or torque), or voltage; loops outside it do
        not act. A recorded supply limits the voltage over time, and scales it
        where a loop sets the voltage itself.

        A CSV, Parquet or MATLAB file with columns such as time_s, reference_deg,
        Output angle \\[deg], motor_speed_rpm, current_A, load_Nm is read as it is,
        with commas, semicolons or tabs; so is what simulate writes, and the EMPS
        benchmark's file. Any other layout is told by a
        record file in TOML, a line for each: file = "log.csv", separator = ";",
        decimal = ",", time = { column = "t", unit = "ms" }, signals.reference = {
        column = "cmd", unit = "deg" }.

        Try: actuator-lti correlate emps DATA_EMPS.mat
        """,
    ),
    Analysis(
        name="compare",
        group="Variants and history",
        request=StudyAsked,
        function="analyses.studies.study_asked.compared",
        doing="comparing",
        study=True,
        keeps=True,
        out="out/compare",
        words="""
        Compare variants with their base: margins, bandwidths, verdicts, large signals, cause of each change.

        What is found of each design is kept under --out; an interrupted comparison goes on where it stopped.

        Try: actuator-lti compare joint --set control.position.gain="12 1/s" --set gear.harmonic.ratio=120
        """,
    ),
    Analysis(
        name="montecarlo",
        group="Variants and history",
        request=MonteCarloAsked,
        function="analyses.monte_carlo.asked.study",
        shown="monte_carlo",
        doing="sampling",
        keeps=True,
        out="out/montecarlo",
        words="""
        Sample the tolerances: distributions, odds of every requirement, worst cases.

        Up to 1000000 samples, each is kept as Parquet under --out; of more, only what they come to. An
        interrupted run goes on where it stopped.

        Try: actuator-lti montecarlo fin --samples 2000 --seed 7
        """,
    ),
    Analysis(
        name="tune",
        group="Variants and history",
        request=TuningAsked,
        function="analyses.tuning.tune",
        doing="tuning",
        out="out/tune",
        words="""
        Find gains that meet the requirements at every corner of the tolerances, or say by how much none can.

        By default the least change of the design. With --place also a notch, a low-pass, feed-forward
        where gains alone do not do.

        The result is confirmed by certified margins, nominal and at each requirement's worst corner.

        Writes tuned.toml (a design), tune.html and tune.json. Exit status 1 where the requirements
        cannot be met.

        Try: actuator-lti tune joint --require "position.bandwidth>=60 Hz" --place notch,feedforward
        """,
    ),
    Analysis(
        name="nightly",
        group="Variants and history",
        alone=True,
        request=NightlyAsked,
        function="reports.nightly.night.nightly",
        shown="nightly",
        doing="building",
        words="""
        Build every design and variant of a study, keep every figure, and publish a site of it.

        What has not changed is not computed again. Exit status 1 where a requirement fails, a design has no
        result, or a figure is worse than the approved baseline.

        Try: actuator-lti nightly study.toml --site site; to make the last night the baseline: actuator-lti
        nightly approve study.toml --site site --by NAME --reason TEXT
        """,
    ),
    Analysis(
        name="export c",
        group="Out of Python",
        page=False,
        request=AskedC,
        function="reports.exports.run.export_c",
        words="""
        Write the drive as C99: drive.h, drive.c, the design's parameters, an example and a README.

        Try: actuator-lti export c fin --out fin-c --prefix fin_
        """,
    ),
    Analysis(
        name="export controller",
        group="Out of Python",
        page=False,
        request=AskedController,
        function="reports.exports.run.export_controller",
        shown="listing",
        words="""
        Write the controller alone as C99 for firmware, with test vectors and a class for C++.

        Try: actuator-lti export controller joint --type float --prefix joint_ --out joint-controller
        """,
    ),
    Analysis(
        name="export fmu",
        group="Out of Python",
        page=False,
        request=AskedFmu,
        function="reports.exports.run.export_fmu",
        words="""
        Write the drive as a co-simulation FMU: binaries, sources, every key of the design as a parameter.

        Try: actuator-lti export fmu joint --platform linux64
        """,
    ),
    Analysis(
        name="export linear",
        group="Out of Python",
        page=False,
        request=AskedLinear,
        function="reports.exports.run.export_linear",
        words="""
        Write every loop, break point, command and load response as state space, with units and margins.

        Try: actuator-lti export linear joint --to mat
        """,
    ),
)
COMMANDS_IN = {"export": "The drive outside of Python: C99, FMU, controller for firmware, linear models."}
"""Words of a name that stands before others."""
BY_NAME = {one.name: one for one in ANALYSES}
FURTHER = tuple(one.name for one in ANALYSES if one.also)
"""Sections that a report has only where they are asked for, as they take their time."""
