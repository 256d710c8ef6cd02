"""What is asked of `actuator-lti nightly`."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from actuator_lti.bounds import JOB_MEMORY, STUDY_SECONDS
from actuator_lti.errors import InputError
from analyses.request import OnMachines, Option, flag

if TYPE_CHECKING:
    from analyses.studies.engine import Engine

_ALLOWED = {
    "workers": (1, 256), "time_limit_s": (1, STUDY_SECONDS.most), "memory_limit": (300, inf),
    "wait_s": (0, inf), "keep": (1, inf),
}  # fmt: skip


JOB_MEMORY_MB = JOB_MEMORY.most // 1_000_000
STATE = Option("History and cache; DIR.state beside the site otherwise.", "DIR")
ANEW = Option("Begin anew where the history knows less than the site.")
STUDY = (
    "One study file (compare --example prints one), design file or shipped design; 'approve STUDY' approves."
)
WORDS = Option(STUDY, "STUDY", argument=True)
ONLY = Option("Approve only this design; may be repeated.", "NAME", flag="design")


@dataclass(frozen=True, kw_only=True)
class Settings(OnMachines):
    """How a night is run; without workers and scheduler in this process, without a time limit."""

    build: ClassVar[str] = "reports.nightly.compute:build"  # makes ``(meta, files)`` of a job's payload
    workers: Annotated[int | None, Option("Worker processes; 2.", "N")] = 2
    time_limit_s: Annotated[float, Option("A design that takes longer is ended; 900.", "s")] = 900.0
    memory_limit: Annotated[int, Option("A design that needs more has no result.", "MB")] = JOB_MEMORY_MB
    wait_s: Annotated[float, Option("Wait for another nightly on the same site; 0.", "s")] = 0.0
    keep: Annotated[int, Option("Nights whose reports stay on the site (of pages 4); 60.", "NIGHTS")] = 60
    state: Annotated[Path | None, STATE] = None
    accept_lost_history: Annotated[bool, ANEW] = False

    @property
    def engine(self) -> Engine:
        from analyses.studies.engine import Engine

        return Engine(None, self.scheduler, threads=self.workers or 1, tls=self.tls)


@dataclass(frozen=True, kw_only=True)
class Asked(Settings):
    """Build every design and variant of a study, keep every figure, and publish a site of it.

    What has not changed is not computed again. Exit status 1 where a requirement fails, a design has no
    result, or a figure is worse than the approved baseline (until one is approved,
    than the first night).

    Try: actuator-lti nightly study.toml --site site; to make the last night the baseline: actuator-lti
    nightly approve study.toml --site site --by NAME --reason TEXT
    """

    words: Annotated[list[str], WORDS]
    site: Annotated[Path | None, Option("Folder of the site; has to be given.", "DIR")] = None
    pdf: Annotated[bool, Option("A PDF beside each report.")] = False
    no_validation: Annotated[bool, Option("Linear reports only, no simulation.")] = False
    by: Annotated[str, Option("Who approves.", "NAME")] = ""
    reason: Annotated[str, Option("Why the night is approved.", "TEXT")] = ""
    only: Annotated[list[str] | None, ONLY] = None

    def __post_init__(self) -> None:
        for name, (least, most) in _ALLOWED.items():
            if not least <= getattr(self, name) <= most:
                to = "" if most == inf else f" to {most}"
                raise InputError(f"--{flag(name)} {getattr(self, name)}: allowed: {least}{to or ' or more'}")
