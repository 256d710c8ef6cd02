"""The verdict of a whole document: how many of each kind are met, in numbers and in words."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any, cast

from actuator_lti.asked.verdict import Role, Tally, Verdict
from reports.document_schema import Block, Counts, Finding
from reports.document_schema import Verdict as Overall

WORDS = {
    "requirements": "requirements",
    "checks": "checks by simulation",
    "odds": "requirements under tolerances",
}
BENCH_CHECKS = "bench checks"
ROLES: tuple[Role, ...] = ("fail", "warn", "pass", "info")
SEVERITIES = ("fail", "warn", "info")
_SECTIONS: tuple[tuple[str, str, Role], ...] = (
    ("failed_sections", "failed", "fail"),
    ("unproven_sections", "not proven", "warn"),
    ("met_sections", "met", "pass"),
)


def tally(items: Iterable[Mapping[str, Any]]) -> Tally:
    """Count items of `reports.document.verdicts`, of some the checks that they gather."""
    count = Tally()
    for item in items:
        gathered = item.get("gathers")
        one = Tally.of([Verdict(item["verdict"])], [bool(item["waiver"])])
        count += one if gathered is None else Tally(**gathered)
    return count


def role(item: Mapping[str, Any]) -> Role:
    return Verdict(item["verdict"]).role(waived=bool(item["waiver"]))


def why(item: Mapping[str, Any]) -> str:
    """What stands beside the word of one item: its reason, and how it is waived."""
    return "; ".join(filter(None, (item["reason"], item["waiver"])))


def worded(item: Mapping[str, Any]) -> str:
    """Write the word of one item, in brackets what stands beside it."""
    return f"{item['verdict']} ({why(item)})" if why(item) else item["verdict"]


def judged(blocks: Iterable[Mapping[str, Any]]) -> list[Any]:
    return [item for block in blocks if block["kind"] == "verdicts" for item in block["items"]]


def counted(blocks: Iterable[Mapping[str, Any]]) -> dict[str, Tally]:
    kinds: dict[str, Tally] = {}
    for block in blocks:
        if block["kind"] == "verdicts" and block["items"]:
            what = block.get("what", "requirements")
            kinds[what] = kinds.get(what, Tally()) + tally(block["items"])
    return kinds


def verdict_of(sections: Sequence[Mapping[str, Any]], kind: str) -> Overall:
    """Count the verdicts of a document; it is also judged by sections that say so without one.

    Such a section of a report says that a loop is unstable, say, or that its stability is not known; that of
    one analysis has the analysis' own verdict.
    """

    def own(part: Mapping[str, Any]) -> Tally:
        return sum(counted(walk(part)).values(), Tally())

    def named(verdict: Verdict) -> list[str]:
        """Sections of this verdict whose own items do not tell it."""
        said = [(part["title"], own(part)) for part in sections if part.get("verdict") == verdict]
        more = Tally.of([verdict])
        return [title for title, items in said if not items.total or (items + more).verdict != items.verdict]

    report = kind == "report"
    parts = {"requirements": Tally()} if report else {}
    parts |= counted(block for part in sections for block in walk(part))
    whole = sum(parts.values(), Tally())
    unsaid = [part for part in sections if report and "verdict" not in part]
    silent = [part for part in unsaid if part["status"] == "fail" and not own(part).not_met]
    failed = [part["title"] for part in silent if part["id"] != "answer"]  # which gathers what they say
    if not failed and not whole.not_met:
        failed = [part["title"] for part in silent]
    failed, open_ones = failed + named(Verdict.NOT_MET), named(Verdict.NOT_PROVEN)
    sections_too = Tally(not_met=len(failed), not_proven=len(open_ones))
    made: Overall = {
        "verdict": (whole + sections_too).verdict.value,
        # what records of a bench do not tell lets a command end with status 0
        "passed": sections_too.passes
        and all(one.passes or (what == BENCH_CHECKS and not one.not_met) for what, one in parts.items()),
        "parts": {what: cast(Counts, asdict(count)) for what, count in parts.items()},
    }
    more = {"failed_sections": failed, "unproven_sections": open_ones, "met_sections": named(Verdict.MET)}
    return cast(Overall, {**made, **{key: titles for key, titles in more.items() if titles}})


def walk(part: Mapping[str, Any]) -> Iterable[Block]:
    for block in part.get("blocks", ()):
        yield block
        yield from walk(block)


def open_items(sections: Iterable[Mapping[str, Any]]) -> list[str]:
    """Name what is not met, or not proven and not waived, with the reason or with value and limit."""
    every = judged(block for part in sections for block in walk(part))
    items = [one for colour in ("fail", "warn") for one in every if role(one) == colour]
    return list(dict.fromkeys(f"{item['verdict']}: {item['label']}{_found(item)}" for item in items))


def _found(item: Mapping[str, Any]) -> str:
    if item["value"] is None or item["limit"] is None:
        return f": {item['reason']}" if item["reason"] else ""
    return f": {item['value']:.4g}, limit {item['comparison']} {item['limit']:g} {item['unit']}".rstrip()


def gathered(sections: Iterable[Mapping[str, Any]]) -> list[Finding]:
    """Collect the findings that sections carry, each once: the gravest first, of every section in turn."""
    every = [item for part in sections for item in part.get("findings", ())]
    before: Counter[tuple[str, str]] = Counter()
    turns: list[tuple[int, int, Finding]] = []
    for item in {(one["severity"], one["text"], one["where"]): one for one in every}.values():
        turns.append((SEVERITIES.index(item["severity"]), before[item["severity"], item["where"]], item))
        before[item["severity"], item["where"]] += 1
    return [item for *_, item in sorted(turns, key=lambda one: one[:2])]


def verdict_words(verdict: Mapping[str, Any]) -> list[str]:
    """Say a document's verdict in words, a line for each kind.

    >>> verdict_words({"parts": {"requirements": {"met": 11, "not_met": 1, "not_proven": 0, "waived": 0}}})
    ['11 of 12 requirements met, 1 not met']
    """
    return [words for words, _ in verdict_lines(verdict)]


def verdict_lines(verdict: Mapping[str, Any]) -> list[tuple[str, Role]]:
    """Say a document's verdict in words, each with its colour: what decides it first.

    >>> verdict_lines({"parts": {}, "failed_sections": ["Missing parts"]})
    [('failed: Missing parts', 'fail')]
    >>> verdict_lines({"parts": {"requirements": {}}})
    [('the design states no requirements', 'info')]
    """
    lines: list[tuple[str, Role]] = []
    for what, counts in verdict["parts"].items():
        count = Tally(**counts)
        words = count.words(WORDS.get(what, what))
        lines.append((words if count.total else f"the design states {words}", count.role))
    for key, word, colour in _SECTIONS:
        lines += [(f"{word}: {'; '.join(verdict[key])}", colour)] if verdict.get(key) else []
    return sorted(lines, key=lambda line: ROLES.index(line[1]))
