"""From a study file, or a single design, to the jobs of a night."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from actuator_lti.design import design_hash, load_design, write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from reports.nightly.job import Job
from reports.nightly.night import Study
from reports.nightly.text import one_line


def read_study(path: str, *, pdf: bool = False, validation: bool = True) -> Study:
    """Read what is to be built every night.

    Parameters
    ----------
    path : str
        A study file, or a design (by path or shipped name), which is then a study of one.
    pdf : bool
        Whether a PDF is made beside each report.
    validation : bool
        Whether reports hold the nonlinear validation.

    Raises
    ------
    InputError
        From the file: one line with place, key and what is allowed.
    """
    design = load_design(path)
    settings = {"pdf": pdf, "validation": validation}
    origin = Path(path) if Path(path).exists() else None
    return Study(name=design.name, title=design.title, jobs=(design_job(design, settings),), origin=origin)


def design_job(design: Design, settings: Mapping[str, Any], name: str | None = None) -> Job:
    """Make the job that builds one design's report."""
    label = name or design.name
    if not label.strip():
        raise InputError(f"{one_line(design.origin, 80)}: the design has no name")
    return Job(
        name=label,
        payload={"name": label, "design": write_design(design), "settings": dict(settings)},
        design_hash=design_hash(design),
        parameters={path: parameter.text for path, parameter in design.parameters.items()},
        title=design.title,
        revision=design.revision,
    )
