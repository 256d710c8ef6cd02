"""A night from beginning to end: lock, build what is new, write the history, publish the site."""

import platform
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import inf
from pathlib import Path
from typing import Any

import typer

from actuator_lti.errors import InputError
from actuator_lti.start.extras import need
from reports.cli.errors import VERDICT_FAILED
from reports.cli.output import print_note
from reports.nightly import site as site_files
from reports.nightly.asked import Asked, Settings
from reports.nightly.cache import Cache, CorruptEntry
from reports.nightly.figures import Figure, left
from reports.nightly.history import History, Reported, open_history
from reports.nightly.processes import Answer, Limits, Task, build_each
from reports.nightly.records import Result, Run
from reports.nightly.source import CodeVersion, Job, Study, check_jobs, code_version, commit_of, read_study
from reports.nightly.state import CACHE, INDEX, HistoryLost, Memory, check_memory, hold, state_of
from reports.nightly.text import now, one_line
from reports.nightly.view import Overview
from reports.visible import visible

DESIGNS_A_LIMIT = 50  # of a comparison, within one time limit
Outcome = tuple[Result, Reported | None]  # of a job; what the history keeps of its report, where it has one


def _nobody(*_said: object) -> None:
    """Whom nothing is told."""


def nightly(asked: Asked, progress: Callable[[int, int], None]) -> Overview:
    """Build a night, or approve the last one, and publish the site."""

    def say(line: str) -> None:
        print_note(f"actuator-lti: {line}")

    for package in ("filelock", "ruptures"):
        need(package, "nightly", "a nightly build")
    approving = len(asked.words) == 2 and asked.words[0] == "approve"
    if len(asked.words) != 1 + approving or asked.site is None:
        raise InputError(
            "write 'nightly STUDY --site DIR' or 'nightly approve STUDY --site DIR --by NAME --reason TEXT'; "
            "several designs are one study, each a [[variant]] with base = its file"
        )
    study = read_study(asked.words[-1], pdf=asked.pdf, validation=False if asked.no_validation else None)
    try:
        if approving:
            names = asked.only or ()
            return approve(study, asked.site, by=asked.by, reason=asked.reason, names=names, settings=asked)
        return run_night(study, asked.site, asked, progress=progress, say=say)
    except HistoryLost as lost:  # no bad input: the gate cannot judge, so it does not open
        say(str(lost))
        raise typer.Exit(VERDICT_FAILED) from lost


def run_night(
    study: Study, site: Path, settings: Settings | None = None, *,
    progress: Callable[[int, int], None] = _nobody, say: Callable[[str], None] = _nobody,
    code: CodeVersion | None = None, clock: Callable[[], str] = now,
) -> Overview:  # fmt: skip
    """Build all of a study, note it in the history and publish the site.

    Whatever ends this early leaves the site of the night before whole; what was built until then is in
    the cache and not built again. The site is made where it is missing, refused where it holds something
    else. ``say`` gets one line for whatever somebody should know (a corrupt cache entry).

    Raises `InputError` where the lock is held, site or state cannot be written, or the history is newer;
    `HistoryLost` where the history knows less than the site.
    """
    use = settings or Settings()
    jobs = check_jobs(study.jobs, study.name)
    version = code or code_version()
    with _held(study, site, use) as (history, cache):
        for left_over in (path for folder in (site, history.state) for path in folder.rglob(".*.part")):
            left_over.unlink(missing_ok=True)
        site_files.mark(site)
        run = history.start_run(
            started=clock(), code=version.hash, code_commit=version.commit,
            study_commit=commit_of(study.origin) if study.origin is not None else "",
            libraries={**version.libraries, "python": platform.python_version()}, host=socket.gethostname(),
        )  # fmt: skip
        history.finish_run(run, clock(), _outcomes(run, jobs, cache, use, progress, say))
        return site_files.publish(site, study, history, cache, keep_reports=use.keep, built=True)


def approve(
    study: Study, site: Path, *, by: str, reason: str, names: Sequence[str] = (),
    settings: Settings | None = None, clock: Callable[[], str] = now,
) -> Overview:  # fmt: skip
    """Make the last night the baseline that later ones are held against, and publish the site anew.

    Refused without name or reason, without a night, and for a design that has no result in it.
    """
    use = settings or Settings()
    if not by.strip() or not reason.strip():
        raise InputError("--by and --reason: an approval needs a name and a reason", where="nightly approve")
    with _held(study, site, use, begun=True) as (history, cache):
        if not history.runs:
            raise InputError("no night has been finished here yet", where=str(site))
        last = history.runs[-1]
        for name in (name for name in names if history.first(name, [last]) is None):
            why = f"{one_line(name, 80)!r} has no result in the last night: nothing to approve"
            raise InputError(why, study.name)
        about = {"by": one_line(by, 200), "reason": one_line(reason, 2000)}
        history.approve(last.id, list(names) or None, at=clock(), **about)
        return site_files.publish(site, study, history, cache, keep_reports=use.keep)


@contextmanager
def _held(study: Study, site: Path, use: Settings, *, begun: bool = False) -> Iterator[tuple[History, Cache]]:
    """Hold history and cache of a site, both as they should be; ``begun``: only where there is a history."""
    state = state_of(site, use.state)
    site_files.check_place(site)
    there, checked = (state / INDEX).exists(), not use.accept_lost_history
    if checked and not there:
        check_memory(site, Memory(), state)  # before one is begun
    if begun and not there:
        raise InputError("no night has been built here yet", where=str(site))
    with hold(state, use.wait_s):
        history = open_history(state)
        if checked:
            check_memory(site, history.memory(), state)
        history.claim(study.name)
        yield history, Cache(state / CACHE)


def _outcomes(
    run: Run, jobs: Sequence[Job], cache: Cache, use: Settings, progress: Callable[[int, int], None],
    say: Callable[[str], None],
) -> list[Outcome]:  # fmt: skip
    """What came of each job; in the cache is then what the pages need of it."""
    done: dict[str, Outcome] = {}
    todo: dict[str, Job] = {}
    tasks: list[Task] = []
    for job in jobs:
        key, corrupt = job.key(run.code), list[str]()
        entry = cache.whole(key, corrupt.append)
        for why in corrupt:
            say(f"cache entry of {one_line(job.name, 60)!r} is corrupt ({why}): built again")
        if entry is not None:
            done[job.name] = _reported(run, job, key, entry.meta, cached=True)
        else:
            todo[key] = job
            designs = len(job.payload["study"]["designs"]) if "study" in job.payload else 1
            tasks.append(Task(key, job.payload, limits=-(-designs // DESIGNS_A_LIMIT)))

    def take(task: Task, answer: Answer) -> None:
        job = todo[task.key]
        done[job.name] = _built(run, job, task.key, answer, cache)
        progress(len(done), len(jobs))

    progress(len(done), len(jobs))
    limits = Limits(use.build, use.time_limit_s, use.memory_limit * 1_000_000)
    build_each(tasks, limits, use.engine if use.workers or use.scheduler else None, take)
    return [done[job.name] for job in jobs]


def _built(run: Run, job: Job, key: str, answer: Answer, cache: Cache) -> Outcome:
    """Keep what was built; an error of the disk is none of its design."""
    status, message = answer.status, "\n".join(filter(None, (answer.message, answer.detail)))
    if status == "done":
        try:
            return _reported(run, job, key, cache.take(key, answer.entry).meta, seconds=answer.seconds)
        except CorruptEntry as error:
            status, message = "crash", f"its result came damaged ({error})"
        except InputError as error:
            raise InputError(f"result of {one_line(job.name, 60)!r} cannot be kept: {error}") from error
    said: dict[str, Any] = {"status": status, "seconds": answer.seconds, "message": visible(message)}
    return Result(run=run.id, name=job.name, kind=job.kind, **said), None


def _reported(run: Run, job: Job, key: str, meta: Mapping[str, Any], **more: Any) -> Outcome:
    """What came of a job that has a report: its result, its figures and what is behind them."""
    failing, sections = meta["failed"] or meta["failed_sections"], ", ".join(meta["failed_sections"])
    ranked = [v for v in meta["verdicts"] if left(v) < inf]
    worst: Mapping[str, Any] = min(ranked, key=left, default={"relative": None, "id": ""})
    result = Result(
        run=run.id, name=job.name, kind=job.kind,
        status="fail" if failing else "unproven" if meta["unproven"] else "pass", key=key,
        failed=meta["failed"], total=meta["total"], worst=worst["relative"], worst_id=worst["id"],
        message=f"not passed: {sections}" if sections else "", **more,
    )  # fmt: skip
    settings = job.payload.get("settings") or {}
    inputs = {
        "parameters": dict(job.parameters),
        "keys": dict(job.keys),
        "settings": {str(key): one_line(str(value), 200) for key, value in settings.items()},
        "design_hash": job.design_hash,
        "revision": job.revision,
    }
    return result, ([Figure(**f) for f in meta["figures"]], inputs)
