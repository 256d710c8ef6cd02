"""The identification that the files ask for: of a campaign, of records of a motion, or of two masses."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from actuator_lti.design import read_design_text, with_values, write_design
from actuator_lti.design.model import Design
from actuator_lti.design.plant import reachable_speed
from actuator_lti.types import Progress
from analyses.identification.asked import Asked, fixed_values, held_by_name
from analyses.identification.bench import BenchResult, identify_bench
from analyses.identification.campaign import CampaignResult, campaign_items, identify_campaign, steady_error
from analyses.identification.campaign_design import CampaignSuggestion, suggest_runs
from analyses.identification.design_values import at_constant
from analyses.identification.frequency_bench import FrequencyResult, identify_frequency
from analyses.identification.measured_response import ResponseResult, identify_response
from analyses.identification.plan import Plan, plan_motions
from analyses.identification.surface import NAMES, Contribution, contributions
from analyses.identification.to_design import design_with_fit
from analyses.identification.verdict import Identified
from analyses.records.campaign_file import load_campaign
from analyses.records.campaign_import import import_campaign
from analyses.records.open_record import open_record, open_records
from analyses.records.record import Record, named_apart


@dataclass(frozen=True, kw_only=True)
class CampaignAnswer(Identified):
    """A campaign's result, the shares of its coefficients at a load and speed, and what to measure next."""

    result: CampaignResult
    shares: tuple[Contribution, ...]
    load_Nm: float
    speed_rad_s: float
    suggestion: CampaignSuggestion | None = None


def identify(
    design: Design, asked: Asked, *, progress: Progress = None
) -> BenchResult | CampaignAnswer | FrequencyResult | ResponseResult | Plan:
    """Identify a drive from its records, and hold the design that comes of it against them."""
    limit, first, *others = asked.residual_limit / 100.0, *asked.files
    if asked.plan:
        records = _opened(others)
        measured = identify_bench(design, records, settings=asked).model if records else None
        noise = asked.noise if asked.noise is not None else design.instruments.current_noise_A
        within = asked.within / 100.0
        return plan_motions(design, within=within, noise=noise, measured=measured, progress=progress)
    made: BenchResult | CampaignAnswer | FrequencyResult | ResponseResult
    fixed = fixed_values(design, asked.fix)
    if asked.response:
        made = identify_response(
            design,
            first,
            loop=asked.loop,
            of=asked.response_of,
            averages=asked.averages,
            fixed=fixed,
            limit=limit,
            progress=progress,
        )
    elif asked.is_campaign:
        made = _of_campaign(design, asked, progress)
    elif asked.frequency_response:
        play = None if asked.play is None else open_record(asked.play)
        record = open_record(first)
        made = identify_frequency(design, record, play_record=play, period_s=asked.period_s, fixed=fixed)
    else:
        records = _opened(asked.files)
        unseen = _opened(asked.validate or (), [record.name for record in records])
        made = identify_bench(design, records, validation=unseen, settings=asked, progress=progress)
    return replace(made, accepted=asked.accept and not made.unmade)


def _opened(paths: Sequence[Path], taken: Sequence[str] = ()) -> list[Record]:
    return named_apart([record for path in paths for record in open_records(path)], taken)


def _of_campaign(design: Design, asked: Asked, progress: Progress) -> CampaignAnswer:
    listed, fixed = load_campaign(asked.files[0]), fixed_values(design, asked.fix)
    held, imported = held_by_name(fixed, NAMES), import_campaign(listed, progress=progress)
    result = identify_campaign(imported, design, fixed=held)
    fit, count = result.fit, asked.suggest
    source = f"identified from {len(fit.points)} runs, {listed.name}{at_constant(fit, design)}"
    made = design_with_fit(with_values(design, fixed), fit.by_key(), source)
    written = read_design_text(write_design(made))
    simulated = steady_error(written, fit.points, progress=progress)
    load, speed = design.load.moment_max_Nm, reachable_speed(design)
    load = load if load > 0.0 else max(p.load_Nm for p in fit.points)
    speed = speed if math.isfinite(speed) else max(p.speed_rad_s for p in fit.points)
    suggestion = None
    if count and len(fit.determined) == len(NAMES):
        suggestion = suggest_runs(design, fit, count=count, criterion=asked.criterion, progress=progress)
    return CampaignAnswer(
        design=written,
        items=campaign_items(design, result, simulated, asked.residual_limit / 100.0, held),
        result=result,
        shares=contributions(fit.values, fit.covariance, load_Nm=load, speed_rad_s=speed),
        load_Nm=load,
        speed_rad_s=speed,
        suggestion=suggestion,
    )
