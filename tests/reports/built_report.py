"""What the tests of the report share."""

from pathlib import Path
from typing import Any, NamedTuple

from actuator_lti import load_design
from analyses.validation import Settings, validate
from reports.sections.validation import section


def validated() -> list[dict[str, Any]]:
    """Give the sections of a coarse validation of ilr33-amber."""
    findings = ("injected sweep", "motion from rest", "large signals")
    coarse = Settings(findings=findings, rest_frequencies=10, map_counts=(10, 16))
    return section(validate(load_design("ilr33-amber"), coarse))


class Built(NamedTuple):
    document: dict[str, Any]
    page: Path
    data: Path


HOSTILE = "<script>alert(1)</script> \"quoted\" 'single' & $x^2$ ]]> \u202e {{ 7*7 }}"
SEEN = HOSTILE.replace("\u202e", "⟨U+202E⟩")  # a page shows marks of direction, and does not obey them
