"""A night from beginning to end: lock, build what is new, write the history, publish the site."""

from __future__ import annotations

import os
import platform
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from actuator_lti.bounds import JOB_MEMORY
from actuator_lti.errors import InputError
from actuator_lti.files.reading import shown_path
from analyses.studies.engine import Engine
from reports.nightly import memory
from reports.nightly import site as site_files
from reports.nightly.apart import Done, Limits, Task, build_each
from reports.nightly.cache import Cache, CorruptEntry
from reports.nightly.code_version import CodeVersion, code_version, commit_of
from reports.nightly.figures import Figure
from reports.nightly.history import FILE, NIGHTS, History, Reported, open_history
from reports.nightly.job import BROKEN, Job, Outcome, check_jobs
from reports.nightly.lock import hold
from reports.nightly.records import Result
from reports.nightly.text import now, one_line
from reports.nightly.tolerance import Tolerances
from reports.nightly.view import Overview, overview
from reports.visible import visible

DESIGNS_A_LIMIT = 50  # of a comparison, within one time limit
Progress = Callable[[int, int], None]
Say = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Study:
    """What a team builds every night: designs and variants, and how far figures may move."""

    name: str
    jobs: tuple[Job, ...]
    title: str = ""
    origin: Path | None = None
    tolerances: Tolerances = field(default_factory=Tolerances)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a night is run.

    Parameters
    ----------
    workers : int
        Worker processes; 0 builds in this process, without a time limit.
    time_limit_s : float
        A design that takes longer is ended and named, in s.
    wait_s : float
        How long to wait for another nightly on the same site, in s.
    keep_reports : int
        Nights whose reports stay on the site; their figures stay in the history for good.
    build : str
        ``module:function`` that makes ``(meta, files)`` of a job's payload.
    state : pathlib.Path, optional
        Folder of history and cache; ``DIR.state`` beside the site where left out.
    accept_lost_history : bool
        Go on where the history knows less than the site: a new one, or an older copy.
    memory_limit_bytes : int
        Of a worker process; a design that needs more has no result.
    engine : Engine, optional
        A Dask cluster to build on in place of worker processes here.
    """

    workers: int = 2
    time_limit_s: float = 900.0
    wait_s: float = 0.0
    keep_reports: int = 60
    build: str = "reports.nightly.compute:build"
    state: Path | None = None
    accept_lost_history: bool = False
    memory_limit_bytes: int = JOB_MEMORY.most
    engine: Engine | None = None


def state_of(site: Path, settings: Settings) -> Path:
    """Return the folder of history, cache and lock: beside the site, so that none of it is published.

    Raises
    ------
    InputError
        For a state that is no folder, leads elsewhere or lies inside the site, or a site that has no folder
        beside it.
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
    progress: Progress | None = None,
    say: Say | None = None,
    code: CodeVersion | None = None,
    clock: Callable[[], str] = now,
) -> Overview:
    """Build all of a study, note it in the history and publish the site.

    Whatever ends this early leaves the site of the night before whole; what was built until then is in
    the cache and not built again.

    Parameters
    ----------
    study : Study
        What to build.
    site : pathlib.Path
        Folder of the site; made where it is missing, refused where it holds something else.
    progress : callable, optional
        Called with (jobs done, jobs in all).
    say : callable, optional
        Called with one line for whatever somebody should know (a corrupt cache entry, a migration).
    code : CodeVersion, optional
        Version of the code; found out where left out.

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
        outcomes = _outcomes(jobs, version, cache, use, progress, say or _silent)
        history.finish_run(run, clock(), [(_result(run.id, o), _reported(o)) for o in outcomes])
        return publish(study, site, history, cache, use, {o.key: o.meta for o in outcomes})


@contextmanager
def _held(study: Study, site: Path, use: Settings, *, begun: bool = False) -> Iterator[tuple[History, Cache]]:
    """Hold history and cache of a site, both as they should be; ``begun``: only where there is a history."""
    state = state_of(site, use)
    site_files.check_place(site)
    _unless_lost(site, state, use)
    if begun and not (state / FILE).exists():
        raise InputError("no night has been built here yet", where=str(site))
    with hold(state, use.wait_s), open_history(state) as history:
        if not use.accept_lost_history:
            memory.check(site, history.memory(), state)
        history.claim(study.name)
        yield history, Cache(state / "cache")


def _unless_lost(site: Path, state: Path, use: Settings) -> None:
    """Refuse a site whose history is not there, or of an earlier version, before one is begun."""
    if use.accept_lost_history or (state / FILE).exists():
        return
    if (state / "history.sqlite").exists():
        raise memory.HistoryLost(
            f"{state / 'history.sqlite'}: is the history of an earlier version, which this one does not read:"
            " go on with that version, or begin anew on purpose with --accept-lost-history"
        )
    memory.check(site, memory.Memory("", 0, 0), state)


def publish(
    study: Study,
    site: Path,
    history: History,
    cache: Cache,
    settings: Settings,
    metas: Mapping[str, Mapping[str, Any]] | None = None,
) -> Overview:
    """Make the site of the last finished night anew from history and cache.

    ``metas`` holds what is known already of the results, by content address; the rest is read.
    """
    view = overview(history, cache, study, metas or {})
    site_files.publish(site, view, history, cache, keep_reports=settings.keep_reports)
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

    Raises
    ------
    InputError
        Where name or reason is empty, there is no night yet, or a design has no result in it.
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
        return publish(study, site, history, cache, use)


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
    jobs: Sequence[Job],
    version: CodeVersion,
    cache: Cache,
    use: Settings,
    progress: Progress | None,
    tell: Say,
) -> list[Outcome]:
    """Take from the cache what is there, build the rest."""
    keys = {job.name: job.key(version.hash) for job in jobs}
    result: dict[str, Outcome] = {}
    for job in jobs:
        outcome = _from_cache(cache, job, keys[job.name], tell)
        if outcome is not None:
            result[job.name] = outcome
    todo = {keys[job.name]: job for job in jobs if job.name not in result}
    if progress is not None:
        progress(len(result), len(jobs))

    def take(done: Done) -> None:
        job = todo[done.key]
        result[job.name] = _built(cache, job, done)
        if progress is not None:
            progress(len(result), len(jobs))

    limits = Limits(build=use.build, time_limit_s=use.time_limit_s, memory_bytes=use.memory_limit_bytes)
    here = Engine(threads=use.workers) if use.workers else None
    build_each([_task(key, job) for key, job in todo.items()], limits, use.engine or here, cache, take)
    return [result[job.name] for job in jobs]


def _task(key: str, job: Job) -> Task:
    """What a job asks for; a comparison takes as long as the designs that it holds."""
    study = job.payload.get("study")
    designs = len(study["designs"]) if isinstance(study, Mapping) else 1
    return Task(key=key, payload=job.payload, limits=-(-designs // DESIGNS_A_LIMIT))


def _from_cache(cache: Cache, job: Job, key: str, tell: Say) -> Outcome | None:
    try:
        entry = cache.read(key)
    except CorruptEntry as error:
        tell(f"cache entry of {one_line(job.name, 60)!r} is corrupt ({error}): built again")
        cache.discard(key)
        return None
    if entry is None:
        return None
    return Outcome(job=job, key=key, status=_status(entry.meta), meta=entry.meta, cached=True)


def _built(cache: Cache, job: Job, done: Done) -> Outcome:
    if done.status == "disk":
        raise InputError(f"result of {one_line(job.name, 60)!r} cannot be kept: {done.message}")
    if done.status == "done":
        entry = cache.read(done.key)
        if entry is not None:
            return Outcome(
                job=job, key=done.key, status=_status(entry.meta), meta=entry.meta, seconds=done.seconds
            )
    status = done.status if done.status in ("error", "timeout", "crash") else "crash"
    message = visible(done.message + (f"\n{done.detail}" if done.detail else ""))
    return Outcome(job=job, key=done.key, status=status, seconds=done.seconds, message=message)  # type: ignore[arg-type]


def _status(meta: Mapping[str, Any]) -> Any:
    if meta.get("failed") or meta.get("failed_sections"):
        return "fail"
    return "unproven" if meta.get("unproven") else "pass"


def _message(outcome: Outcome) -> str:
    sections = outcome.meta.get("failed_sections", ())
    return outcome.message or (f"not passed: {', '.join(sections)}" if sections else "")


def _reported(outcome: Outcome) -> Reported | None:
    """Figures of an outcome and what is behind them; None where there is no result."""
    if outcome.status in BROKEN:
        return None
    job = outcome.job
    inputs = {
        "parameters": dict(job.parameters),
        "settings": _flat_settings(job.payload),
        "design_hash": job.design_hash,
        "revision": job.revision,
    }
    return [Figure(**f) for f in outcome.meta.get("figures", ())], inputs


def _result(run: int, outcome: Outcome) -> Result:
    """What the history keeps of an outcome."""
    meta = outcome.meta
    ranked = [v for v in meta.get("verdicts", ()) if v["relative"] is not None]
    worst = min(ranked, key=lambda v: v["relative"], default=None)
    return Result(
        run=run,
        name=outcome.job.name,
        kind=outcome.job.kind,
        status=outcome.status,
        key="" if outcome.status in BROKEN else outcome.key,
        seconds=outcome.seconds,
        cached=outcome.cached,
        failed=int(meta.get("failed", 0)),
        total=int(meta.get("total", 0)),
        worst=worst["relative"] if worst else None,
        worst_id=worst["id"] if worst else "",
        message=_message(outcome),
    )


def _flat_settings(payload: Mapping[str, Any]) -> dict[str, str]:
    settings = payload.get("settings")
    if not isinstance(settings, Mapping):
        return {}
    return {str(key): one_line(str(value), 200) for key, value in settings.items()}


def _silent(_line: str) -> None:
    return None
