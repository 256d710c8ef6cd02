"""What is asked of a Monte Carlo study."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from actuator_lti.errors import InputError
from analyses.request import LOAD, POINT, OnMachines, Option

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from actuator_lti.types import Progress
    from analyses.monte_carlo.result import MonteCarloResult


@dataclass(frozen=True, kw_only=True)
class Asked(OnMachines):
    """Sample the tolerances: distributions, odds of every requirement, worst cases.

    Up to 1000000 samples, each is kept as Parquet under --out; of more, only what they come to. An
    interrupted run goes on where it stopped.

    Try: actuator-lti montecarlo fin --samples 2000 --seed 7
    """

    samples: Annotated[int, Option("Number of samples; 10000.", "N")] = 10_000
    seed: Annotated[int, Option("Seed, 0 or more; 0.", "N")] = 0
    from_samples: Annotated[Path | None, Option("CSV or Parquet of identified parameters, SI.", "FILE")] = (
        None
    )
    step: Annotated[
        float | None,
        Option(
            'Nonlinear step of every sample, such as "1 deg"; "20 deg/s" of a speed drive, "2 A", "5 V".',
            "STEP",
            kind="step",
        ),
    ] = None
    duration_s: Annotated[
        float | None, Option("Duration of that step; what travel and slowest mode take.", "s")
    ] = None
    load_Nm: Annotated[float, LOAD] = 0.0
    operating_point: Annotated[str, POINT] = "sliding"
    at_least: Annotated[
        float | None,
        Option(
            "Probability that is enough, if its one-sided 95 % lower bound shows it; else every sample must "
            "pass, and the worst case (with --no-worst: at least 59 samples, which show 95 %)."
        ),
    ] = None
    worst: Annotated[bool, Option("Seek the worst case of each requirement.", flag="worst/--no-worst")] = True
    sample: Annotated[int | None, Option("Only print sample number K as a design file.", "K")] = None

    def __post_init__(self) -> None:
        if self.at_least is not None and not 0.0 <= self.at_least <= 1.0:
            raise InputError(f"--at-least {self.at_least:g}: allowed: a probability from 0 to 1")
        if self.duration_s is not None and self.step is None:
            raise InputError(f"--duration {self.duration_s:g}: allowed with --step")


def study(design: Design, asked: Asked, *, out: Path, progress: Progress = None) -> MonteCarloResult | Design:
    """The study, kept in a folder under ``out``, or the sample that is asked; `InputError`: no tolerance."""
    from actuator_lti.batch import variable_paths
    from analyses.monte_carlo.run import MonteCarloSettings, monte_carlo, sample_folder
    from analyses.monte_carlo.task import StepCheck, replay
    from analyses.studies.sampling import read_table, sampler_of

    table = None if asked.from_samples is None else read_table(asked.from_samples, variable_paths(design))
    settings = MonteCarloSettings(
        samples=asked.samples,
        seed=asked.seed,
        operating_point=asked.operating_point,  # type: ignore[arg-type]
        load_Nm=asked.load_Nm,
        step=None if asked.step is None else StepCheck(asked.step, asked.duration_s, asked.load_Nm),
        table=table,
        worst_cases=asked.worst,
    )
    if asked.sample is not None:
        return replay(design, sampler_of(design, seed=settings.seed, table=table), asked.sample)
    folder = sample_folder(design, settings, out)
    result = monte_carlo(design, folder, settings, engine=asked.engine, progress=progress)
    return replace(result, at_least=asked.at_least)
