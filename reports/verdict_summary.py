"""The verdict of a whole document: how many of each kind passed, in numbers and in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from reports.document_schema import Block, Counts, Verdict

WORDS = {
    "requirements": ("requirements", "met", "not met"),
    "checks": ("checks by simulation", "passed", "failed"),
    "odds": ("requirements under tolerances", "met", "not met"),
}


def summary(blocks: Iterable[Mapping[str, Any]]) -> Verdict:
    """Count the verdicts, of each kind too: passed if none failed; those not judged are counted apart."""
    outcomes: dict[str, list[bool | None]] = {}
    for block in blocks:
        if block["kind"] == "verdicts":
            kind = outcomes.setdefault(block.get("what", "requirements"), [])
            kind += [item["passed"] for item in block["items"]]
    whole = _counts([outcome for kind in outcomes.values() for outcome in kind])
    parts = {what: _counts(kind) for what, kind in outcomes.items()}
    return {
        "passed": whole["failed"] == 0,
        "failed": whole["failed"],
        "not_judged": whole["not_judged"],
        "total": whole["total"],
        "parts": parts,
    }


def verdict_of(sections: Sequence[Mapping[str, Any]], kind: str) -> Verdict:
    """Count the verdicts of a document; a report fails by a section that failed without one, too.

    Such a section says that a loop is unstable, say, or that a part could not be computed.
    """
    made = summary(block for part in sections for block in walk(part))
    parts = [part for part in sections if part["status"] == "fail" and not summary(walk(part))["failed"]]
    first = [part["title"] for part in parts if part["id"] == "answer"]  # it gathers what the others say
    failed = [part["title"] for part in parts if part["id"] != "answer"]
    if not failed and made["passed"]:
        failed = first
    if kind != "report" or not failed:
        return made
    return {**made, "passed": False, "failed_sections": failed}


def walk(part: Mapping[str, Any]) -> Iterable[Block]:
    """Give every block of a section or block, those inside details too."""
    for block in part.get("blocks", ()):
        yield block
        yield from walk(block)


def _counts(outcomes: Sequence[bool | None]) -> Counts:
    return {
        "failed": sum(outcome is False for outcome in outcomes),
        "not_judged": sum(outcome is None for outcome in outcomes),
        "total": len(outcomes),
    }


def verdict_words(verdict: Mapping[str, Any]) -> list[str]:
    """Say a document's verdict in words, a line for each kind.

    Examples
    --------
    >>> verdict_words({"parts": {"requirements": {"failed": 1, "not_judged": 0, "total": 12}}})
    ['1 of 12 requirements not met']
    """
    return [words for words, _ in verdict_lines(verdict)]


def verdict_lines(verdict: Mapping[str, Any]) -> list[tuple[str, bool]]:
    """Say a document's verdict in words, with whether it is good: failed sections, then each kind of verdict.

    Examples
    --------
    >>> verdict_lines({"total": 0, "failed_sections": ["Missing parts"]})
    [('failed: Missing parts', False)]
    """
    parts = verdict.get("parts") or {"requirements": verdict}
    failed = verdict.get("failed_sections")
    first = [(f"failed: {'; '.join(failed)}", False)] if failed else []
    return first + [(_words(what, n), not n["failed"]) for what, n in parts.items() if n["total"]]


def _words(what: str, counts: Counts) -> str:
    name, good, bad = WORDS.get(what, (what, "passed", "failed"))
    total, failed, unjudged = counts["total"], counts["failed"], counts["not_judged"]
    words = f"{failed} of {total} {name} {bad}" if failed else f"{total - unjudged} of {total} {name} {good}"
    return words + (f", {unjudged} not judged" if unjudged else "")
