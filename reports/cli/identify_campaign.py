"""`actuator-lti identify campaign.toml`: friction from the steady parts of many runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from reports.cli.drive import load_drive
from reports.cli.identify_common import Common, finish, fixed_values, say

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.identification.campaign import CampaignResult

KEYS = {"friction.dry_torque": "C0", "friction.viscous": "Cv", "friction.load_coefficient": "CM"}


def is_campaign(paths: Sequence[Path]) -> bool:
    """Whether a single TOML file is given that lists runs, and is no record file."""
    if len(paths) != 1 or paths[0].suffix.lower() != ".toml":
        return False
    from analyses.records.toml_tables import read_toml

    return "file" not in read_toml(paths[0])


def run(path: Path, common: Common, count: int, criterion: str) -> None:
    """Identify from a campaign, print or write the result, and end with the verdict's status."""
    from actuator_lti.design import read_design_text, write_design
    from analyses.campaign_design import suggest_runs
    from analyses.identification.campaign import campaign_items, identify_campaign
    from analyses.identification.campaign_resimulation import steady_current_error
    from analyses.identification.contributions import contributions
    from analyses.identification.to_design import design_with_estimate, surface_estimate, with_fixed
    from analyses.identification.verdict import passed
    from analyses.records import import_campaign, load_campaign
    from reports.cli.errors import leave_with
    from reports.cli.output import print_json
    from reports.cli.progress import progress
    from reports.identification_json import campaign_json
    from reports.sections import identification as pages

    listed = load_campaign(path)
    name = _beside(listed.design, path) if common.design is None else common.design
    drive = load_drive(name, common.changes)
    asked = fixed_values(drive, common.fixed)
    with progress("reading records", quiet=common.quiet) as bar:
        imported = import_campaign(listed, progress=bar)
    with progress("identifying", quiet=common.quiet) as bar:
        result = identify_campaign(imported, drive, fixed=_coefficients(asked), progress=bar)
    at = _where(drive, result)
    shares = contributions(result.fit.values, result.fit.covariance, **at)
    suggestion = None
    if count and not result.fit.held:
        with progress("slopes of the margins", quiet=common.quiet) as bar:
            suggestion = suggest_runs(drive, result.fit, count=count, criterion=criterion, progress=bar)
    source = f"identified from {len(result.fit.points)} runs, {listed.name}"
    made = design_with_estimate(with_fixed(drive, asked), surface_estimate(result.fit, source))
    text = write_design(made)
    with progress("simulating the written design", quiet=common.quiet) as bar:
        simulated = steady_current_error(read_design_text(text), result.fit.points, progress=bar)
    items = campaign_items(drive, result, simulated, common.residual_limit)
    section = pages.section(result, shares, suggestion, items, **at)
    written = finish(common, drive, made, text, section, items)
    if common.as_json:
        print_json(campaign_json(result, shares, suggestion, at, items, written))
    else:
        say(section, written, items)
    leave_with(passed(items))


def _coefficients(asked: dict[str, float]) -> dict[str, float]:
    """Fixed keys by the names of the coefficients."""
    from actuator_lti.errors import InputError

    for key in asked:
        if key not in KEYS:
            raise InputError(f"--fix {key}: a campaign can fix {', '.join(KEYS)}")
    return {KEYS[key]: value for key, value in asked.items()}


def _beside(design: str, campaign: Path) -> str:
    """A design named by a path is looked for beside the campaign file."""
    near = campaign.parent / design
    return str(near) if near.suffix == ".toml" and near.exists() else design


def _where(drive: Design, result: CampaignResult) -> dict[str, float]:
    """Load and speed for the contributions: the design's largest ones, else those of the runs."""
    import math

    load, speed = drive.load.moment_max_Nm, drive.limits.speed_rad_s
    points = result.fit.points
    return {
        "load_Nm": load if load > 0.0 else max(p.load_Nm for p in points),
        "speed_rad_s": speed if math.isfinite(speed) else max(p.speed_rad_s for p in points),
    }
