"""An identification of any kind: its section, and the design that it writes."""

from __future__ import annotations

from pathlib import Path

from actuator_lti.files.atomic import write_text
from analyses.identification.bench import BenchResult
from analyses.identification.frequency_bench import FrequencyResult
from analyses.identification.plan import Plan
from analyses.identification.run import CampaignAnswer
from analyses.identification.verdict import Identified
from reports.document_schema import Section
from reports.sections import identify_campaign, identify_plan, identify_records, identify_response


def section(result: BenchResult | CampaignAnswer | FrequencyResult | Plan) -> Section:
    """Make the section."""
    if isinstance(result, Plan):
        return identify_plan.section(result)
    if isinstance(result, BenchResult):
        return identify_records.section(result)
    if isinstance(result, FrequencyResult):
        return identify_response.section(result)
    return identify_campaign.section(result)


def write(result: Identified | Plan, folder: Path | None) -> list[str]:
    """Write the identified design, where all checks pass or it was accepted; of a plan the command."""
    if isinstance(result, Plan):
        return [] if folder is None else [_command(result, folder / f"{result.design.name}-plan.csv")]
    if folder is None or not (result.passed or result.accepted):
        return []
    path = folder / f"{result.design.name}-identified.toml"
    write_text(path, result.text)
    return [str(path)]


def _command(plan: Plan, path: Path) -> str:
    """The command as a file for the drive, under the name by which a record has it."""
    name = "position_reference_m" if plan.design.axis == "linear" else "reference_rad"
    rows = zip(plan.time_s.tolist(), plan.command.tolist(), strict=True)
    write_text(path, f"time_s,{name}\n" + "".join(f"{t:.3f},{value:.9g}\n" for t, value in rows))
    return str(path)
