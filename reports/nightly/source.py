"""From a study file, or a single design, to the jobs of a night, and which code builds them.

A study file may hold a table for the nightly beside what `analyses.studies.study` reads::

    [nightly]
    pdf = true
    tolerance = { "*phase margin*" = "0.5 deg", "*bandwidth*" = "1 %" }
"""

import json
import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from actuator_lti.bounds import JOB_BYTES, NIGHTLY_JOBS
from actuator_lti.design import design_hash, write_design
from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, shown_path
from analyses.comparison.variants import keys_of
from analyses.studies.proof import hash_of
from analyses.studies.study import Study as StudyFile
from analyses.studies.study import Variant, study_of, study_or_design
from analyses.toml_tables import Table
from reports.nightly.moves import Tolerances, read_tolerances
from reports.nightly.text import one_line, sha256
from reports.provenance import LIBRARIES, git, package_version

PACKAGES = ("actuator_lti", "nonlinear", "analyses", "reports")
COMMITS = 8  # named at most between two nights
MAX_NAME = 20_000
_SUFFIXES = (".py", ".toml", ".html", ".j2", ".css", ".js", ".typ", ".svg")


@dataclass(frozen=True, kw_only=True)
class Job:
    """One report to build: a design or variant (any text is a name), or the comparison of a whole study."""

    name: str
    kind: str = "design"
    payload: Mapping[str, Any] = field(default_factory=dict)  # all that the result depends on, but code
    design_hash: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)  # keys and texts as written
    keys: Mapping[str, str] = field(default_factory=dict)  # all others, as requirements and matrices
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


@dataclass(frozen=True, kw_only=True)
class CodeVersion:
    """Which code makes a result: hash of the sources, the libraries, and the commit if there is one."""

    sources: str
    libraries: dict[str, str]
    commit: str

    @property
    def hash(self) -> str:
        """What enters the address of a result; a commit that changes no source does not."""
        return sha256(canonical([self.sources, self.libraries, platform.python_version()]))


def code_version(root: Path | None = None) -> CodeVersion:
    """Version of the code as installed (or below ``root``)."""
    folder = Path(__file__).resolve().parents[2] if root is None else root
    return CodeVersion(
        sources=sha256(canonical([hash_of(folder / package, _SUFFIXES) for package in PACKAGES])),
        libraries={name: package_version(name, "absent") for name in (*LIBRARIES, "typst")},
        commit=commit_of(folder),
    )


def commit_of(path: Path) -> str:
    """Commit that is checked out where a path lies; empty where there is none."""
    return git(path, "rev-parse", "--verify", "HEAD^{commit}") or ""


@cache
def commits_between(path: Path, old: str, new: str) -> tuple[str, ...]:
    """First lines of the commits that lead from one commit to another, newest first."""
    if not old or not new or old == new:
        return ()
    text = git(path, "log", f"--max-count={COMMITS}", "--format=%h %s", f"{old}..{new}", "--")
    return tuple(one_line(line, 120) for line in (text or "").splitlines() if line.strip())


def canonical(value: Any) -> str:
    """JSON text that is the same for the same content."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def check_jobs(jobs: tuple[Job, ...], where: str) -> tuple[Job, ...]:
    """Refuse a study that is too large or names two designs alike."""
    if not jobs:
        raise InputError("nothing to build: no design and no variant", where=where)
    NIGHTLY_JOBS.check(len(jobs), where)
    counts = Counter(job.name for job in jobs)
    for job in jobs:
        name, shown, wrong = job.name, one_line(job.name, 80), ""
        if len(name) > MAX_NAME:
            wrong = f"{one_line(name, 40)!r} has {len(name)} characters: at most {MAX_NAME} allowed"
        elif not shown or any("\ud800" <= sign <= "\udfff" for sign in name):
            wrong = f"{name[:40]!a}: a name needs at least one sign, all in valid Unicode"
        elif counts[name] > 1:
            wrong = f"{shown!r} is used twice: names must differ"
        if wrong:
            raise InputError(f"name {wrong}", where=where)
        JOB_BYTES.check(len(canonical(job.payload)), where, name=repr(shown))
    return jobs


@dataclass(frozen=True, kw_only=True)
class _Nightly:
    pdf: bool = False


def read_study(path: str, *, pdf: bool = False, validation: bool | None = None) -> Study:
    """Read what is to be built every night: a study file, or a design, which is then a study of one.

    A variant that its design's checks refuse becomes a job that fails with their words; the others are built.
    ``pdf`` and ``validation`` are as the study says where left out. The comparison of several comes first, as
    it takes longest.
    """
    found = study_or_design(path, keep_going=True)
    file = found if isinstance(found, StudyFile) else replace(study_of(found), validation=True)
    table = Table(file.nightly, "nightly", shown_path(path))
    plan = table.read(_Nightly, beside=("tolerance",))
    check = file.validation if validation is None else validation
    settings: Tree = {"pdf": pdf or plan.pdf, "validation": check}
    if file.monte_carlo is not None:
        settings["monte_carlo"] = {"samples": file.monte_carlo.samples, "seed": file.monte_carlo.seed}
    jobs = [_design_job(variant, settings) for variant in file.all]
    first = [_comparison_job(file, jobs, settings)] if file.variants else []
    return Study(
        name=file.name,
        title=file.title or file.name,
        jobs=(*first, *jobs),
        origin=Path(path).resolve() if Path(path).is_file() else None,
        tolerances=read_tolerances(table.table("tolerance").data, table.origin),
    )


def _design_job(variant: Variant, settings: Mapping[str, Any]) -> Job:
    """The job of one design's report; one that was refused fails with the words of the refusal."""
    name, design = variant.name, variant.design
    if design is None:
        return Job(name=name, payload={"name": name, "refused": variant.error}, parameters=_texts(variant))
    payload = {"name": name, "design": write_design(design), "settings": dict(settings)}
    parameters = {path: parameter.text for path, parameter in design.parameters.items()}
    keys = {key: text for key, text in keys_of(design).items() if key not in parameters}
    about = {"design_hash": design_hash(design), "revision": design.revision}
    return Job(name=name, payload=payload, parameters=parameters, keys=keys, **about)


def _comparison_job(study: StudyFile, jobs: Sequence[Job], settings: Mapping[str, Any]) -> Job:
    name = "Comparison of all variants"
    while name in {job.name for job in jobs}:
        name += " (study)"
    designs = [
        {k: v for k, v in job.payload.items() if k != "settings"} | {"overrides": _texts(variant)}
        for job, variant in zip(jobs, study.all, strict=True)
    ]
    whole = {"title": study.title or study.name, "designs": designs}
    payload = {"name": name, "study": whole, "settings": {"pdf": settings["pdf"]}}
    return Job(name=name, kind="compare", payload=payload)


def _texts(variant: Variant) -> dict[str, str]:
    return {key: str(value) for key, value in variant.overrides.items()}
