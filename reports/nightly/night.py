"""A night from beginning to end: lock, build what is new, write the history, publish the site."""

from __future__ import annotations

import os
import platform
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown_path
from reports.nightly import memory
from reports.nightly import site as site_files
from reports.nightly.apart import Limits, Task, build_each
from reports.nightly.asked import Settings
from reports.nightly.cache import Cache, CorruptEntry
from reports.nightly.code_version import CodeVersion, code_version, commit_of
from reports.nightly.figures import Figure
from reports.nightly.history import FILE, NIGHTS, History, Reported, open_history
from reports.nightly.lock import hold
from reports.nightly.records import Result, Run
from reports.nightly.source import Job, Study, check_jobs
from reports.nightly.text import now, one_line
from reports.nightly.view import Overview, overview
from reports.nightly.worker import Answer
from reports.visible import visible

DESIGNS_A_LIMIT = 50  # of a comparison, within one time limit
Progress = Callable[[int, int], None]
Say = Callable[[str], None]


def _nobody(*_said: object) -> None:
    """Whom nothing is told."""


class Outcome(NamedTuple):
    """What came of a job, and what its report says where there is one."""

    job: Job
    result: Result
    meta: Mapping[str, Any]


def state_of(site: Path, settings: Settings) -> Path:
    """Return the folder of history, cache and lock: beside the site, so that none of it is published.

    Refused is what is no folder, leads elsewhere or lies inside the site.
    """
    state = _state_of(site, settings)
    folders = (state, state / "cache", state / NIGHTS)
    for folder in folders:
        if os.path.lexists(folder) and not folder.is_dir():
            raise InputError("is no folder; allowed: a folder, or none yet", where=shown_path(folder))
    inside = [path for folder in folders if folder.is_dir() for path in folder.iterdir()]
    for path in (state, *inside):
        if path.is_symlink():
            raise InputError(
                "is a symbolic link: history and cache are kept in the state folder itself",
                where=shown_path(path),
            )
    return state


def _state_of(site: Path, settings: Settings) -> Path:
    if settings.state is None:
        place = Path(os.path.abspath(site))  # "." and ".." have names, too
        if not place.name:
            raise InputError(
                "is the root of the disk: --site takes a folder below it", where=shown_path(site)
            )
        return place.with_name(place.name + ".state")
    inside = os.path.realpath(settings.state), os.path.realpath(site)
    if os.path.commonpath(inside) == inside[1]:
        raise InputError(
            "lies inside the site and would be published with it: --state takes a folder elsewhere",
            where=shown_path(settings.state),
        )
    return settings.state


def run_night(
    study: Study,
    site: Path,
    settings: Settings | None = None,
    *,
    progress: Progress = _nobody,
    say: Say = _nobody,
    code: CodeVersion | None = None,
    clock: Callable[[], str] = now,
) -> Overview:
    """Build all of a study, note it in the history and publish the site.

    Whatever ends this early leaves the site of the night before whole; what was built until then is in
    the cache and not built again. The site is made where it is missing, refused where it holds something
    else. ``say`` gets one line for whatever somebody should know (a corrupt cache entry).

    Raises
    ------
    InputError
        Where the lock is held, the site or its state cannot be written, or the history is of a newer version.
    HistoryLost
        Where the history knows less than the site.
    """
    use = settings or Settings()
    jobs = check_jobs(study.jobs, study.name)
    version = code or code_version()
    with _held(study, site, use) as (history, cache):
        site_files.remove_leftovers(site, history.state)
        site_files.mark(site)
        run = history.start_run(started=clock(), **_about(version, study))
        outcomes = _outcomes(run, jobs, cache, use, progress, say)
        history.finish_run(run, clock(), [(o.result, _reported(o)) for o in outcomes])
        return publish(study, site, history, cache, use, {o.result.key: o.meta for o in outcomes})


@contextmanager
def _held(study: Study, site: Path, use: Settings, *, begun: bool = False) -> Iterator[tuple[History, Cache]]:
    """Hold history and cache of a site, both as they should be; ``begun``: only where there is a history."""
    state = state_of(site, use)
    site_files.check_place(site)
    if not (use.accept_lost_history or (state / FILE).exists()):
        memory.check(site, memory.Memory(), state)  # before one is begun
    if begun and not (state / FILE).exists():
        raise InputError("no night has been built here yet", where=str(site))
    with hold(state, use.wait_s):
        history = open_history(state)
        if not use.accept_lost_history:
            memory.check(site, history.memory(), state)
        history.claim(study.name)
        yield history, Cache(state / "cache")


def publish(
    study: Study, site: Path, history: History, cache: Cache, settings: Settings,
    metas: Mapping[str, Mapping[str, Any]],
) -> Overview:  # fmt: skip
    """Make the site of the last finished night anew from history and cache.

    ``metas`` holds what is known already of the results, by content address; the rest is read.
    """
    view = overview(history, cache, study, metas, site)
    site_files.publish(site, view, history, cache, keep_reports=settings.keep)
    return view


def approve(
    study: Study,
    site: Path,
    *,
    by: str,
    reason: str,
    names: Sequence[str] = (),
    settings: Settings | None = None,
    clock: Callable[[], str] = now,
) -> Overview:
    """Make the last night the baseline that later ones are held against, and publish the site anew.

    Refused without name or reason, without a night, and for a design that has no result in it.
    """
    use = settings or Settings()
    if not by.strip() or not reason.strip():
        raise InputError("--by and --reason: an approval needs a name and a reason", where="nightly approve")
    with _held(study, site, use, begun=True) as (history, cache):
        if not history.runs:
            raise InputError("no night has been finished here yet", where=str(site))
        last = history.runs[-1].id
        there = {r.name for r in history.night(last).results if r.home is not None}
        for name in names:
            if name not in there:
                raise InputError(
                    f"{one_line(name, 80)!r} has no result in the last night: nothing to approve",
                    where=study.name,
                )
        limits = {"by": one_line(by, 200), "reason": one_line(reason, 2000)}
        history.approve(last, list(names) or None, at=clock(), **limits)
        return publish(study, site, history, cache, use, {})


def _about(version: CodeVersion, study: Study) -> dict[str, Any]:
    """What is known of a night as it begins."""
    return {
        "code": version.hash,
        "code_commit": version.commit,
        "study_commit": commit_of(study.origin) if study.origin is not None else "",
        "libraries": {**version.libraries, "python": platform.python_version()},
        "host": socket.gethostname(),
    }


def _outcomes(
    run: Run, jobs: Sequence[Job], cache: Cache, use: Settings, progress: Progress, say: Say
) -> list[Outcome]:
    """Take from the cache what is there, build the rest."""
    done: dict[str, Outcome] = {}
    todo: dict[str, Job] = {}
    for job in jobs:
        key = job.key(run.code)
        corrupt = f"cache entry of {one_line(job.name, 60)!r} is corrupt (%s): built again"
        entry = cache.whole(key, lambda why, words=corrupt: say(words % why))  # type: ignore[misc]
        if entry is None:
            todo[key] = job
        else:
            done[job.name] = _outcome(run, job, key, entry.meta, cached=True)

    def take(task: Task, answer: Answer) -> None:
        job = todo[task.key]
        done[job.name] = _built(run, job, task.key, answer, cache)
        progress(len(done), len(jobs))

    progress(len(done), len(jobs))
    limits = Limits(use.build, use.time_limit_s, use.memory_limit * 1_000_000)
    engine = use.engine if use.workers or use.scheduler else None
    build_each([_task(key, job) for key, job in todo.items()], limits, engine, take)
    return [done[job.name] for job in jobs]


def _task(key: str, job: Job) -> Task:
    """What a job asks for; a comparison takes as long as the designs that it holds."""
    study = job.payload.get("study")
    designs = len(study["designs"]) if isinstance(study, Mapping) else 1
    return Task(key=key, payload=job.payload, limits=-(-designs // DESIGNS_A_LIMIT))


def _built(run: Run, job: Job, key: str, answer: Answer, cache: Cache) -> Outcome:
    """Keep what was built; an error of the disk is none of its design."""
    status, message = answer.status, "\n".join(filter(None, (answer.message, answer.detail)))
    if status == "done":
        try:
            meta = cache.take(key, answer.entry).meta
            return _outcome(run, job, key, meta, seconds=answer.seconds)
        except CorruptEntry as error:
            status, message = "crash", f"its result came damaged ({error})"
        except InputError as error:
            raise InputError(f"result of {one_line(job.name, 60)!r} cannot be kept: {error}") from error
    return Outcome(job, _result(run, job, status, seconds=answer.seconds, message=visible(message)), {})


def _outcome(run: Run, job: Job, key: str, meta: Mapping[str, Any], **more: Any) -> Outcome:
    """What came of a job that has a result."""
    failing = meta["failed"] or meta["failed_sections"]
    status = "fail" if failing else "unproven" if meta["unproven"] else "pass"
    ranked = [v for v in meta["verdicts"] if v["relative"] is not None]
    worst = min(ranked, key=lambda v: v["relative"], default={"relative": None, "id": ""})
    sections = ", ".join(meta["failed_sections"])
    more |= {"failed": meta["failed"], "total": meta["total"], "key": key}
    more |= {"worst": worst["relative"], "worst_id": worst["id"]}
    message = f"not passed: {sections}" if sections else ""
    return Outcome(job, _result(run, job, status, message=message, **more), meta)


def _result(run: Run, job: Job, status: str, **more: Any) -> Result:
    return Result(run=run.id, name=job.name, kind=job.kind, status=status, **more)


def _reported(outcome: Outcome) -> Reported | None:
    """Figures of an outcome and what is behind them; None where there is no result."""
    job = outcome.job
    if not outcome.result.key:
        return None
    settings = job.payload.get("settings") or {}
    inputs = {
        "parameters": dict(job.parameters),
        "settings": {str(key): one_line(str(value), 200) for key, value in settings.items()},
        "design_hash": job.design_hash,
        "revision": job.revision,
    }
    return [Figure(**f) for f in outcome.meta["figures"]], inputs
