"""The site on disk: everything new is laid beside the old, then one file is put in place.

Layout: ``index.html`` (the only page that is ever replaced), ``nights/<night>/`` (the pages of one night),
``reports/<design>/<content>/`` (reports, the same ones for as long as nothing changes), and
``summary.json``, ``junit.xml``, ``summary.md`` for machines.  What ``index.html`` refers to is complete
before it is put in place, and is removed only when no page of a kept night refers to it.
"""

import json
import os
import re
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_text, write_together
from reports.nightly import machines, pages
from reports.nightly.cache import Cache
from reports.nightly.history import History
from reports.nightly.source import Study
from reports.nightly.text import sha256
from reports.nightly.view import DesignView, Overview, overview, report_folder, vanished

MARKER = ".nightly-site"
KEPT_NIGHTS = 3
KEPT_CACHE_DAYS = 30.0
_FOR_MACHINES: dict[str, Callable[[Overview], str]] = {
    "summary.json": lambda night: json.dumps(machines.summary(night), allow_nan=False, indent=1) + "\n",
    "junit.xml": machines.junit,
    "summary.md": machines.markdown,
}
_NIGHT = re.compile(r"\d{6,}-[0-9a-f]{8}\Z")
_CONTENT = re.compile(r"[0-9a-f]{16}\Z")


def check_place(site: Path) -> None:
    """Refuse, by name, a folder that holds something else, or that cannot be written."""
    for name in ("", "nights", "reports", "index.html", *_FOR_MACHINES, MARKER):
        if (site / name).is_symlink():
            raise InputError("is a symbolic link: a site is a folder of its own", where=str(site / name))
    if site.exists() and not site.is_dir():
        raise InputError("is a file: --site takes a folder", where=str(site))
    if site.is_dir() and not (site / MARKER).exists() and any(site.iterdir()):
        raise InputError("is not empty and no site of a nightly: use an empty folder", where=str(site))
    if (site / MARKER).exists():
        mark(site)
    there = next(folder for folder in (site, *site.absolute().parents) if folder.exists())
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError("cannot be written", where=str(there))


def mark(site: Path) -> None:
    """Make a folder a site; one that is a site already stays it."""
    write_text(site / MARKER, "actuator-lti nightly site 1\n")


def publish(
    site: Path, study: Study, history: History, cache: Cache, *, keep_reports: int, built: bool = False
) -> Overview:
    """Lay out the last finished night (``built`` just now) and switch to it.

    Where the site cannot be written it stays as it was.
    """
    night = overview(history, cache, study, site, built=built)
    folder = f"nights/{night.run.id:06d}-{secrets.token_hex(4)}"
    wanted = {run.id for run in night.runs[-max(1, keep_reports) :]}  # the last nights, and the approved ones
    wanted |= {d.approval.run for d in night.designs if d.approval is not None}
    results = (result for run in wanted for result in history.night(run).results)
    kept = {report_folder(result) for result in results if result.key}
    write_together(file for design in night.designs for file in _lacking(site, design, cache))
    available = {path for path in kept if (site / path / "report.html").exists()}
    laid_out = pages.of_night(night, history, available)
    try:
        write_together((site / folder / name, text.encode()) for name, text in laid_out)
        write_text(site / "index.html", pages.index(night, folder))
    except InputError:
        shutil.rmtree(site / folder, ignore_errors=True)
        raise
    write_together((site / name, text(night).encode()) for name, text in _FOR_MACHINES.items())
    nights = sorted(path for path in (site / "nights").iterdir() if _NIGHT.match(path.name))
    old = [path for path in nights if path != site / folder][:-KEPT_NIGHTS]
    reports = [path for path in (site / "reports").glob("*/*") if _CONTENT.match(path.name)]
    for path in (*old, *(p for p in reports if p.relative_to(site).as_posix() not in kept)):
        shutil.rmtree(path, ignore_errors=True)
    cache.collect_garbage({d.result.key for d in night.designs}, KEPT_CACHE_DAYS)
    return night


def _lacking(site: Path, design: DesignView, cache: Cache) -> Iterator[tuple[Path, bytes]]:
    """The files of a report that the site has not, or not whole; out of the cache."""
    folder = site / design.report
    wanted: Mapping[str, str] = {} if design.broken else design.meta.get("files", {})
    for part in (folder, folder.parent) if wanted else ():
        if part.is_symlink():
            raise InputError("is a symbolic link: a site holds its reports itself", where=str(part))
    for path in map(folder.joinpath, wanted):
        if os.path.lexists(path) and (path.is_symlink() or not path.is_file()):
            raise InputError("is no regular file: a site holds its reports itself", where=str(path))
    missing = [name for name, digest in wanted.items() if not _is_there(folder / name, digest)]
    entry = cache.whole(design.result.key) if missing else None
    for name in missing:
        if entry is None:
            raise vanished(design.name, site)
        yield folder / name, entry.file(name)


def _is_there(path: Path, digest: str) -> bool:
    try:
        return sha256(path.read_bytes()) == digest
    except OSError:  # one that cannot be read is written anew
        return False
