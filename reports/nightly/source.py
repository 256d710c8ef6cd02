"""From a study file, or a single design, to the jobs of a night.

A study file may hold a table for the nightly beside what `analyses.studies.study` reads::

    [nightly]
    pdf = true
    tolerance = { "*phase margin*" = "0.5 deg", "*bandwidth*" = "1 %" }
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from actuator_lti.bounds import JOB_BYTES, NIGHTLY_JOBS
from actuator_lti.design import design_hash, load_design, write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.files.reading import read_toml, shown_path
from actuator_lti.files.tree import Tree
from analyses.studies.study import Study as StudyFile
from analyses.studies.study import Variant, is_study, study_from_tree, study_of
from analyses.toml_tables import Table
from reports.nightly.text import one_line, sha256
from reports.nightly.tolerance import Tolerances, read_tolerances

BROKEN = ("error", "timeout", "crash")  # how a job ends without a result

MAX_NAME = 20_000


@dataclass(frozen=True, kw_only=True)
class Job:
    """One report to build: a design or variant (any text is a name), or the comparison of a whole study.

    ``payload`` is plain JSON and all that the result depends on, except the code; ``parameters`` are dotted
    keys with texts as written: what is shown when a figure has moved.
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


@dataclass(frozen=True, kw_only=True)
class Study:
    """What a team builds every night: designs and variants, and how far figures may move."""

    name: str
    jobs: tuple[Job, ...]
    title: str = ""
    origin: Path | None = None
    tolerances: Tolerances = field(default_factory=Tolerances)


def canonical(value: Any) -> str:
    """JSON text that is the same for the same content."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def check_jobs(jobs: tuple[Job, ...], where: str) -> tuple[Job, ...]:
    """Refuse a study that is too large or names two designs alike."""
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
        if not one_line(job.name) or any("\ud800" <= sign <= "\udfff" for sign in job.name):
            raise InputError(
                f"name {job.name[:40]!a}: a name needs at least one sign, all in valid Unicode",
                where=where,
            )
        if job.name in seen:
            raise InputError(f"name {one_line(job.name, 80)!r} is used twice: names must differ", where=where)
        seen.add(job.name)
        JOB_BYTES.check(len(canonical(job.payload)), where, name=repr(one_line(job.name, 80)))
    return jobs


@dataclass(frozen=True, kw_only=True)
class _Nightly:
    """The table ``[nightly]``; beside it stands ``tolerance``."""

    pdf: bool = False


def read_study(path: str, *, pdf: bool = False, validation: bool | None = None) -> Study:
    """Read what is to be built every night: a study file, or a design, which is then a study of one.

    A variant that its design's checks refuse becomes a job that fails with their words; the others are built.
    ``pdf`` and ``validation`` are as the study says where left out.
    """
    table = Table({}, "nightly", shown_path(path))
    if is_study(path):
        tree = read_toml(path, "study file")
        table = replace(table, data=tree.pop("nightly", {}))
        file = study_from_tree(tree, table.origin, Path(path).parent, keep_going=True)
    else:
        file = replace(study_of(load_design(path)), validation=True)
    plan = table.read(_Nightly, beside=("tolerance",))
    tolerances = read_tolerances(table.table("tolerance").data, table.origin)
    check = file.validation if validation is None else validation
    settings: Tree = {"pdf": pdf or plan.pdf, "validation": check}
    if file.monte_carlo is not None:
        settings["monte_carlo"] = {"samples": file.monte_carlo.samples, "seed": file.monte_carlo.seed}
    return Study(
        name=file.name,
        title=file.title or file.name,
        jobs=tuple(_jobs(file, settings)),
        origin=Path(path).resolve() if Path(path).is_file() else None,
        tolerances=tolerances,
    )


def _jobs(study: StudyFile, settings: Mapping[str, Any]) -> Iterator[Job]:
    """Give the comparison first, as it takes longest, then every design."""
    jobs = [
        refused_job(variant) if variant.design is None else design_job(variant.design, settings, variant.name)
        for variant in study.all
    ]
    if study.variants:
        yield comparison_job(study, jobs, settings)
    yield from jobs


def comparison_job(study: StudyFile, jobs: Sequence[Job], settings: Mapping[str, Any]) -> Job:
    """Make the job that compares all designs of a study on one page."""
    names = {job.name for job in jobs}
    name = "Comparison of all variants"
    while name in names:
        name += " (study)"
    kept = ("name", "design", "refused")
    designs = [{k: job.payload[k] for k in kept if k in job.payload} for job in jobs]
    for one, variant in zip(designs, study.all, strict=True):
        one["overrides"] = {key: str(value) for key, value in variant.overrides.items()}
    payload = {
        "name": name,
        "study": {"title": study.title or study.name, "designs": designs},
        "settings": {"pdf": settings["pdf"]},
    }
    return Job(name=name, kind="compare", payload=payload)


def refused_job(variant: Variant) -> Job:
    """Make the job of a variant that cannot be a design: it fails with the words of the refusal."""
    parameters = {key: str(value) for key, value in variant.overrides.items()}
    return Job(
        name=variant.name, payload={"name": variant.name, "refused": variant.error}, parameters=parameters
    )


def design_job(design: Design, settings: Mapping[str, Any], name: str) -> Job:
    """Make the job that builds one design's report."""
    return Job(
        name=name,
        payload={"name": name, "design": write_design(design), "settings": dict(settings)},
        design_hash=design_hash(design),
        parameters={path: parameter.text for path, parameter in design.parameters.items()},
        revision=design.revision,
    )
