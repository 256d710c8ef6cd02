"""An identification of any kind: its section, and the design that it writes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from actuator_lti.files.atomic import write_text
from analyses.identification.bench import BenchResult
from analyses.identification.frequency_bench import FrequencyResult
from reports.document_schema import Section
from reports.sections import identify_campaign, identify_records, identify_response

if TYPE_CHECKING:
    from analyses.identification.run import CampaignAnswer
    from analyses.identification.verdict import Identified


def section(result: BenchResult | CampaignAnswer | FrequencyResult) -> Section:
    """Make the section."""
    if isinstance(result, BenchResult):
        return identify_records.section(result)
    if isinstance(result, FrequencyResult):
        return identify_response.section(result)
    return identify_campaign.section(result)


def write(result: Identified, folder: Path | None) -> list[str]:
    """Write the identified design, where all checks pass or it was accepted."""
    if folder is None or not (result.passed or result.accepted):
        return []
    path = folder / f"{result.design.name}-identified.toml"
    write_text(path, result.text)
    return [str(path)]
