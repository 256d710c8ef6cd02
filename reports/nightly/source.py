"""From a study file, or a single design, to the jobs of a night.

A study file may hold a table for the nightly beside what `analyses.studies.study` reads::

    [nightly]
    pdf = true
    tolerance = { "*phase margin*" = "0.5 deg", "*bandwidth*" = "1 %" }
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from actuator_lti.design import design_hash, load_design, write_design
from actuator_lti.design.model import Design
from actuator_lti.files.reading import read_toml, shown_path
from actuator_lti.files.tree import Tree
from analyses.studies.study import Study as StudyFile
from analyses.studies.study import Variant, is_study, study_from_tree, study_of
from analyses.toml_tables import Table
from reports.nightly.job import Job
from reports.nightly.night import Study
from reports.nightly.tolerance import read_tolerances


@dataclass(frozen=True, kw_only=True)
class _Nightly:
    """The table ``[nightly]``; beside it stands ``tolerance``."""

    pdf: bool = False


def read_study(path: str, *, pdf: bool = False, validation: bool | None = None) -> Study:
    """Read what is to be built every night.

    A variant that its design's checks refuse becomes a job that fails with their words; the others are built.

    Parameters
    ----------
    path : str
        A study file, or a design (by path or shipped name), which is then a study of one.
    pdf : bool
        Whether a PDF is made beside each report; the study file may ask for it, too.
    validation : bool, optional
        Whether reports hold the nonlinear validation; as the study says where left out.

    Raises
    ------
    InputError
        From the file: one line with place, key and what is allowed.
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
