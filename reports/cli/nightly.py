"""`actuator-lti nightly`: build a whole study, keep its history, publish a site; approve a baseline."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from actuator_lti.bounds import JOB_MEMORY
from actuator_lti.errors import InputError
from reports.cli.options import JsonOption, QuietOption, SchedulerOption, TlsOption, engine_of

if TYPE_CHECKING:
    from reports.nightly.view import Overview

Words = Annotated[
    list[str],
    typer.Argument(
        metavar="[approve] STUDY",
        help="Study file (compare --example prints one), design file or shipped design; first 'approve'"
        " to approve.",
    ),
]
SiteOption = Annotated[Path, typer.Option("--site", metavar="DIR", help="Folder of the site.")]
StateOption = Annotated[
    Path | None,
    typer.Option("--state", metavar="DIR", help="History and cache; DIR.state beside the site otherwise."),
]
WorkersOption = Annotated[
    int, typer.Option("--workers", min=1, max=256, metavar="N", help="Worker processes.")
]
LimitOption = Annotated[
    float,
    typer.Option("--time-limit", min=1.0, metavar="SECONDS", help="A design that takes longer is ended."),
]
MemoryOption = Annotated[
    int, typer.Option("--memory-limit", min=300, metavar="MB", help="A design that needs more is ended.")
]
WaitOption = Annotated[
    float,
    typer.Option("--wait", min=0.0, metavar="SECONDS", help="Wait for another nightly on the same site."),
]
KeepOption = Annotated[
    int, typer.Option("--keep", min=1, metavar="NIGHTS", help="Nights whose reports stay on the site.")
]
PdfOption = Annotated[bool, typer.Option("--pdf", help="A PDF beside each report.")]
PlainOption = Annotated[bool, typer.Option("--no-validation", help="Linear reports only, no simulation.")]
ByOption = Annotated[str, typer.Option("--by", metavar="NAME", help="Who approves.")]
ReasonOption = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why the night is approved.")]
LostOption = Annotated[
    bool,
    typer.Option("--accept-lost-history", help="Begin anew where the history knows less than the site."),
]
DesignsOption = Annotated[
    list[str] | None,
    typer.Option("--design", metavar="NAME", help="Approve only this design; may be repeated."),
]


def nightly(
    words: Words,
    site: SiteOption,
    state: StateOption = None,
    workers: WorkersOption = 2,
    scheduler: SchedulerOption = None,
    tls: TlsOption = None,
    time_limit: LimitOption = 900.0,
    memory_limit: MemoryOption = JOB_MEMORY.most // 1_000_000,
    wait: WaitOption = 0.0,
    keep: KeepOption = 60,
    pdf: PdfOption = False,
    no_validation: PlainOption = False,
    by: ByOption = "",
    reason: ReasonOption = "",
    design: DesignsOption = None,
    accept_lost_history: LostOption = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Build every design and variant of a study, keep every figure, and publish a site of it.

    What has not changed is not computed again. Exit status 1 where a requirement fails, a design has no
    result, or a figure is worse than the approved baseline. `nightly approve STUDY --site DIR --by NAME
    --reason TEXT` makes the last night the baseline.
    """
    from actuator_lti.start.extras import need

    need("filelock", "nightly", "a nightly build")
    need("ruptures", "nightly", "a nightly build")
    from reports.cli.errors import leave_with
    from reports.cli.progress import progress
    from reports.nightly.memory import HistoryLost
    from reports.nightly.night import Settings, approve, run_night
    from reports.nightly.source import read_study

    approving, path = _split(words)
    study = read_study(path, pdf=pdf, validation=False if no_validation else None)
    settings = Settings(
        workers=workers,
        time_limit_s=time_limit,
        wait_s=wait,
        keep_reports=keep,
        state=state,
        accept_lost_history=accept_lost_history,
        memory_limit_bytes=memory_limit * 1_000_000,
        engine=None if scheduler is None else engine_of(None, scheduler, tls),
    )
    try:
        if approving:
            night = approve(study, site, by=by, reason=reason, names=design or (), settings=settings)
        else:
            with progress(f"building {len(study.jobs)} reports", quiet=quiet) as report:
                night = run_night(study, site, settings, progress=report, say=_warn)
    except HistoryLost as lost:  # no bad input: the gate cannot judge, so it does not open
        _warn(str(lost))
        leave_with(False)
    _show(night, site, as_json)
    leave_with(night.exit_status == 0)


def _split(words: list[str]) -> tuple[bool, str]:
    """Tell ``STUDY`` from ``approve STUDY``."""

    if len(words) == 2 and words[0] == "approve":
        return True, words[1]
    if len(words) != 1:
        raise InputError(
            "write 'nightly STUDY --site DIR' or 'nightly approve STUDY --site DIR --by NAME --reason TEXT'"
        )
    return False, words[0]


def _warn(line: str) -> None:
    from reports.cli.output import print_note

    print_note(f"actuator-lti: {line}")


def _show(night: Overview, site: Path, as_json: bool) -> None:
    """Print the night: JSON, or the counts and every design that needs a look."""
    from reports.cli.output import print_json_text, print_line
    from reports.nightly.machines import STATE_WORDS, summary_text
    from reports.nightly.text import one_line
    from reports.terminal import print_verdict

    if as_json:
        print_json_text(summary_text(night).rstrip("\n"))
        return
    counts = ", ".join(f"{night.count(s)} {words}" for s, words in STATE_WORDS.items() if night.count(s))
    cached = sum(d.result.cached for d in night.designs)
    print_verdict(night.exit_status == 0, f"night {night.run.id}: {counts} ({cached} unchanged)")
    for design in night.designs:
        if design.state != "pass":
            why = design.result.message.partition("\n")[0] or design.result.worst_id
            if design.state == "regression":
                worst = design.regressions[0].figure
                why = f"{len(design.regressions)} figures worse than the baseline, {worst}"
            print_line(f"{STATE_WORDS[design.state]:>10}  {one_line(design.name, 60)}: {one_line(why, 300)}")
    print_line(str(site / "index.html"))
