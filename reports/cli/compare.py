"""`actuator-lti compare`: variants of a design on one page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli.options import (
    JsonOption,
    OutOption,
    QuietOption,
    SchedulerOption,
    TlsOption,
    WorkersOption,
    engine_of,
)

if TYPE_CHECKING:
    from analyses.study import Study
    from analyses.variants import Comparison

_MOST_NAMES = 12

StudyArgument = Annotated[
    str | None, typer.Argument(metavar="STUDY", help="Study file (--example prints one), or a design.")
]
VariantOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help='A variant more: "gear.worm.ratio=50"; repeatable.'),
]

ValidateOption = Annotated[
    bool | None,
    typer.Option("--validate/--no-validate", help="The nonlinear check of every design; as the study says."),
]
ExampleOption = Annotated[bool, typer.Option("--example", help="Print a study file to start from, and stop.")]


def compare(
    study: StudyArgument = None,
    change: VariantOption = None,
    validation: ValidateOption = None,
    out: OutOption = Path("out/compare"),
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    tls: TlsOption = None,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
    example: ExampleOption = False,
) -> None:
    """Compare variants with their base: margins, bandwidths, verdicts, large signals, cause of each change.

    What is found of each design is kept under --out; an interrupted comparison goes on where it stopped.
    """
    from actuator_lti.errors import InputError

    if example:
        _print_example()
        return
    if study is None:
        raise InputError("compare: give a study file or a design; --example prints a study file")

    from actuator_lti.verdict import Verdict
    from analyses.variants import compare as compared
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json, print_line
    from reports.cli.progress import progress
    from reports.sections.compare import overview, sections
    from reports.sections.compare_many import TABLE, table_text
    from reports.study_pages import study_document, write_pages
    from reports.terminal import print_blocks, print_verdict

    plan = _study(study, change or [])
    assert plan.base.design is not None
    with progress(f"comparing {plan.name}", quiet=quiet) as computing:
        result = compared(
            plan,
            validation=validation,
            progress=computing,
            engine=engine_of(workers, scheduler, tls) if workers or scheduler else None,
            folder=out / "designs",
        )
    made = study_document(
        plan.base.design,
        sections(result),
        title=f"{plan.title or plan.name}: variants",
        subtitle=f"{plan.base.name} and {len(plan.variants)} variants",
        kind="compare",
    )
    with progress("drawing figures", quiet=quiet) as drawing:
        page, data = write_pages(made, out, "compare", progress=drawing, beside={TABLE: table_text(result)})
    untrue = any(row.verdict is Verdict.NOT_MET for one in result.all for row in one.checks)
    passed = bool(made["verdict"]["passed"] and not result.refused and not untrue)
    if as_json:
        print_json(made)
    else:
        worst = Verdict(made["verdict"]["verdict"])
        print_verdict(worst if worst != "met" else passed, _verdict(result, untrue))
        print_blocks([overview(result)])
        print_line(f"{page}\n{data}\n{out / TABLE}")
    leave_with(passed)


def _verdict(comparison: Comparison, untrue: bool) -> str:
    """Which designs meet their requirements, in one sentence."""
    from actuator_lti.verdict import Tally, Verdict
    from analyses.requirements import tally

    counts = {one.variant.name: tally(one.verdicts) for one in comparison.all}
    said = f"{sum(counts.values(), Tally()).words('requirements')}, over {len(counts)} designs"
    for word in (Verdict.NOT_MET, Verdict.NOT_PROVEN):
        names = [name for name, count in counts.items() if count.verdict == word]
        said += f"; {word}: {_listed(names)}" if names else ""
    refused = [variant.name for variant in comparison.refused]
    said += f"; no design: {_listed(refused)}" if refused else ""
    return said + ("; a prediction is not confirmed by the simulator" if untrue else "")


def _listed(names: list[str]) -> str:
    """Names in one sentence, the first few of many."""
    more = len(names) - _MOST_NAMES
    return ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def _print_example() -> None:
    import textwrap

    import analyses.study
    from reports.cli.output import print_line

    text = (analyses.study.__doc__ or "").split("::", 1)[1]
    print_line(textwrap.dedent(text).strip())


def _study(path: str, changes: list[str]) -> Study:
    """A study file, or a study of a design with the variants of the command line."""
    from dataclasses import replace

    from actuator_lti.design import load_design, with_overrides
    from analyses.slugs import slug
    from analyses.study import Variant, is_study, load_study, study_of
    from reports.cli.drive import read_changes

    plan = load_study(path) if is_study(path) else study_of(load_design(path))
    assert plan.base.design is not None
    extra = []
    for words in dict.fromkeys(changes):
        overrides = read_changes([words])
        extra.append(Variant(words, slug(words), with_overrides(plan.base.design, overrides), overrides))
    return replace(plan, variants=(*plan.variants, *extra))
