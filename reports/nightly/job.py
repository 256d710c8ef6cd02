"""What a night has to do: jobs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from actuator_lti.bounds import JOB_BYTES, NIGHTLY_JOBS
from actuator_lti.errors import InputError
from reports.nightly.text import one_line, sha256

BROKEN = ("error", "timeout", "crash")  # how a job ends without a result

MAX_NAME = 20_000


@dataclass(frozen=True, kw_only=True)
class Job:
    """One report to build.

    Parameters
    ----------
    name : str
        Name of the design or variant; any text.
    kind : str
        ``design``, or a page of the whole study (``compare``, ``monte-carlo``).
    payload : mapping
        Plain JSON that the compute function gets; all that the result depends on, except the code.
    design_hash : str
        Hash of the design's content.
    parameters : mapping
        Dotted key to text as written: what is shown when a figure has moved.
    revision : str
        Of the design.
    """

    name: str
    kind: str = "design"
    payload: Mapping[str, Any] = field(default_factory=dict)
    design_hash: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)
    revision: str = ""

    def key(self, code: str) -> str:
        """Content address of the result: design, settings and code version."""
        return sha256(canonical([self.name, self.kind, self.design_hash, self.payload, code]))


def canonical(value: Any) -> str:
    """JSON text that is the same for the same content."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def _is_unicode(text: str) -> bool:
    return not any("\ud800" <= sign <= "\udfff" for sign in text)


def check_jobs(jobs: tuple[Job, ...], where: str) -> tuple[Job, ...]:
    """Refuse a study that is too large or names two designs alike.

    Raises
    ------
    InputError
        With the limit in one line.
    """
    if not jobs:
        raise InputError("nothing to build: no design and no variant", where=where)
    NIGHTLY_JOBS.check(len(jobs), where)
    seen: set[str] = set()
    for job in jobs:
        if len(job.name) > MAX_NAME:
            raise InputError(
                f"name {one_line(job.name, 40)!r} has {len(job.name)} characters: at most {MAX_NAME} allowed",
                where=where,
            )
        if not one_line(job.name) or not _is_unicode(job.name):
            raise InputError(
                f"name {job.name[:40]!a}: a name needs at least one sign, all in valid Unicode",
                where=where,
            )
        if job.name in seen:
            raise InputError(f"name {one_line(job.name, 80)!r} is used twice: names must differ", where=where)
        seen.add(job.name)
        JOB_BYTES.check(len(canonical(job.payload)), where, name=repr(one_line(job.name, 80)))
    return jobs
