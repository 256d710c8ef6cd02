"""How much a validation does beside its checks, which are always made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

Finding = Literal[
    "injected sweep", "margins by amplitude", "motion from rest", "large signals", "friction effects",
    "specification",
]  # fmt: skip
FINDINGS: tuple[Finding, ...] = get_args(Finding)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What a validation looks at beside its checks; the defaults are those of the report.

    ``own``: what the drive itself does: whether it comes to rest, and what large commands make of it.  The
    verdict is that of the checks and of these.
    ``findings``: of `FINDINGS`.
    ``rest_frequencies``: of the sweep from rest.
    ``map_counts``: amplitudes and frequencies of the large-signal map.
    """

    own: bool = True
    findings: tuple[Finding, ...] = FINDINGS
    rest_frequencies: int = 16
    map_counts: tuple[int, int] = (17, 28)


QUICK = Settings(findings=())
"""All that the verdict is made of, without findings."""
CHECKS = Settings(own=False, findings=())
"""The checks alone."""
