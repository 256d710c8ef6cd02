"""What a reader has to know of a drive beside its verdicts: findings, the gravest first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from reports.document_schema import FindingItem, Severity

ORDER: tuple[Severity, ...] = ("fail", "warn", "info")


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One sentence that the reader of a drive must know.

    Attributes
    ----------
    severity : str
        ``"fail"``: unfit as it is; ``"warn"``: to be watched; ``"info"``: good to know.
    text : str
        A whole sentence, with the figure that it is about.
    where : str
        The id of the section of the report that shows it.
    """

    severity: Severity
    text: str
    where: str


def plain(findings: Iterable[Finding]) -> list[FindingItem]:
    """Give findings as a section carries them."""
    return [{"severity": item.severity, "text": item.text, "where": item.where} for item in findings]


def gathered(sections: Iterable[Mapping[str, Any]]) -> list[Finding]:
    """Collect what the sections of a report carry, the gravest first, each once."""
    result = [Finding(**item) for part in sections for item in part.get("findings", ())]
    return sorted(dict.fromkeys(result), key=lambda item: ORDER.index(item.severity))
