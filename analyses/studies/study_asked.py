"""What is asked of a comparison of variants, and the study that it is asked of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree
from analyses.request import OnMachines, Option

if TYPE_CHECKING:
    from actuator_lti.types import Progress
    from analyses.comparison.variants import Comparison
    from analyses.studies.study import Study


@dataclass(frozen=True, kw_only=True)
class Asked(OnMachines):
    """Compare variants with their base: margins, bandwidths, verdicts, large signals, cause of each change.

    What is found of each design is kept under --out; an interrupted comparison goes on where it stopped.

    Try: actuator-lti compare joint --set control.position.gain="12 1/s" --set gear.harmonic.ratio=120
    """

    validate: Annotated[
        bool | None,
        Option("The nonlinear check of every design; as the study says.", flag="validate/--no-validate"),
    ] = None


def compared(study: Study | None, asked: Asked, *, out: Path, progress: Progress = None) -> Comparison:
    """Compare the variants of a study, what is found kept under ``out``; `InputError` without a study."""
    if study is None:
        raise InputError("compare: give a study file or a design; --example prints a study file")
    from analyses.comparison.variants import compare

    engine = asked.engine if asked.workers or asked.scheduler else None  # else one after the other
    if engine and not study.variants:
        given = f"--workers {asked.workers}" if asked.scheduler is None else f"--scheduler {asked.scheduler}"
        raise InputError(f"{given}: computes variants, and {study.name} has none; allowed: a study, or --set")
    return compare(study, validation=asked.validate, progress=progress, engine=engine, folder=out / "designs")


def study_with(path: str, variants: dict[str, Tree]) -> Study:
    """A study file, or a study of a design; with more variants, by name."""
    from actuator_lti.design import with_overrides
    from analyses.slugs import slug
    from analyses.studies.study import Study, Variant, study_of, study_or_design

    found = study_or_design(path)
    plan = found if isinstance(found, Study) else study_of(found)
    base = plan.base.design
    assert base is not None
    extra = [Variant(words, slug(words), with_overrides(base, own), own) for words, own in variants.items()]
    return replace(plan, variants=(*plan.variants, *extra))
