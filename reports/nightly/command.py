"""`actuator-lti nightly`: a night of a study, or the approval of its last one."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from actuator_lti.errors import InputError
from reports.nightly.asked import Asked

if TYPE_CHECKING:
    from reports.nightly.view import Overview


def nightly(asked: Asked, progress: Callable[[int, int], None]) -> Overview:
    """Build a night, or approve the last one, and publish the site."""
    from actuator_lti.start.extras import need

    need("filelock", "nightly", "a nightly build")
    need("ruptures", "nightly", "a nightly build")
    import typer

    from reports.cli.errors import VERDICT_FAILED
    from reports.cli.output import print_note
    from reports.nightly.memory import HistoryLost
    from reports.nightly.night import approve, run_night
    from reports.nightly.source import read_study

    approving = len(asked.words) == 2 and asked.words[0] == "approve"
    if len(asked.words) != 1 + approving or asked.site is None:
        raise InputError(
            "write 'nightly STUDY --site DIR' or 'nightly approve STUDY --site DIR --by NAME --reason TEXT'"
        )
    study = read_study(asked.words[-1], pdf=asked.pdf, validation=False if asked.no_validation else None)

    def say(line: str) -> None:
        print_note(f"actuator-lti: {line}")

    try:
        if approving:
            names = asked.only or ()
            return approve(study, asked.site, by=asked.by, reason=asked.reason, names=names, settings=asked)
        return run_night(study, asked.site, asked, progress=progress, say=say)
    except HistoryLost as lost:  # no bad input: the gate cannot judge, so it does not open
        say(str(lost))
        raise typer.Exit(VERDICT_FAILED) from lost
