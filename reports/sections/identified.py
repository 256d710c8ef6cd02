"""What sections of records share: parameters, verdict, columns that went in, whether a record is sound."""

from collections.abc import Sequence

from actuator_lti.design import design_hash
from analyses.estimation.fit import Fit
from analyses.estimation.parameters import parameter
from analyses.identification.design_values import given_constant
from analyses.identification.verdict import Identified, Item
from analyses.records.finding import Finding
from analyses.records.inputs import InputUse
from reports import document as doc
from reports.numbers import show
from reports.verdict_summary import BENCH_CHECKS

HANGS = 0.5  # relative change of a value over that of what is kept: it hangs on that more than on the record


def judged(
    id: str, title: str, found: Identified, blocks: Sequence[doc.Block], *, result: str, intro: str
) -> doc.Section:
    """Put the section of one kind together: its verdict first, in words and item by item."""
    status: doc.Status = "pass" if found.passed else "fail"
    first = [doc.verdicts(map(_verdict, found.items), BENCH_CHECKS)]
    if open_ones := [item.label for item in found.items if item.passed is None]:
        first.append(doc.remark(f"Not proven, which alone does not fail: {'; '.join(open_ones)}"))
    if not found.unmade:
        first.append(doc.remark(f"Design found, SHA-256 {design_hash(found.design)}"))
    if not found.passed:
        said = "The design is written as it was accepted, a check failed"
        otherwise = "No design is written, as a check fails"
        otherwise += "" if found.unmade else "; --accept writes it all the same"
        first.append(doc.remark(said if found.accepted else otherwise))
    if wrong := [item for item in found.items if item.passed is False]:
        why = f" ({wrong[0].reason})" if wrong[0].reason else ""
        more = f"; {len(wrong) - 1} more of {len(found.items)} checks fail" if len(wrong) > 1 else ""
        result = f"Not met: {wrong[0].label}{why}{more}. {result}"
    return doc.section(id, title, [*first, *blocks], result=result, intro=intro, status=status)


def _verdict(item: Item) -> doc.VerdictItem:
    value, limit = (None if share is None else 100.0 * share for share in (item.value, item.limit))
    return doc.verdict(
        item.id, item.label, value=value, limit=limit, unit="" if value is None else "%",
        comparison="" if limit is None else "<=", passed=item.passed, reason=item.reason,
    )  # fmt: skip


def value_words(fit: Fit, name: str, axis: str = "rotary") -> str:
    """A value with its standard error and unit; 95.11 ± 0.28 kg."""
    one = parameter(name, axis)
    value, std = show(one.scale * fit[name], "sig:4"), show(one.scale * fit.std(name), "sig:2")
    return f"{value} {one.unit} (fixed)" if name in fit.fixed else f"{value} ± {std} {one.unit}"


def constant_words(fit: Fit, axis: str = "rotary") -> str:
    """What is kept of the design and all values hang on, after them; empty where there is nothing.

    The constant that makes torques; of a run-down, whose motor makes none, the friction that is kept.
    """

    def share(name: str) -> float:
        """The largest relative change of a value over that of what is kept."""
        one = fit.fixed[name]
        return max((abs(move * one.value / fit[n]) for n, move in one.moves.items() if fit[n]), default=0.0)

    hang = [name for name in fit.fixed if share(name) > HANGS]
    if not hang and (given := given_constant(fit)) is not None:
        hang = [given]
    constants = []
    for one, name in ((parameter(name, axis), name) for name in hang):
        label = one.label[:1].lower() + one.label[1:]
        constants.append(f"{label}, {show(one.scale * fit[name], 'sig:4')} {one.unit}")
    return f", all at the design's {' and '.join(constants)}" if constants else ""


def parameter_table(
    caption: str, fit: Fit, note: str = "", *, axis: str = "rotary", more: Sequence[doc.Shown] = ()
) -> doc.Block:
    """Every value with standard error and 95 % interval; below it what was fixed, and why.

    ``more`` are further columns, each with what it shows of a name that was fitted.
    """
    columns = [
        doc.column("name", "Parameter"),
        doc.column("value", "Value", format="sig:7"),
        doc.column("std", "Standard error", format="sig:3"),
        doc.column("low", "95 % from", format="sig:5"),
        doc.column("high", "to", format="sig:5"),
        doc.column("unit", "Unit"),
        *(column for column, _ in more),
    ]
    rows: list[doc.Row] = []
    kept: list[str] = []
    for name, one in fit.parameters.items():
        known = parameter(name, axis)
        row: doc.Row = {"name": known.label, "value": known.scale * one.value, "unit": known.unit}
        if one.interval_95 is None:
            kept.append(f"{known.label}, fixed: {fit.fixed[name].reason}.")
        else:
            low, high = (known.scale * end for end in one.interval_95)
            row |= {"std": known.scale * (one.standard_error or 0.0), "low": low, "high": high}
            row |= {column["key"]: read(name) for column, read in more}
        rows.append(row)
    return doc.table(caption, columns, rows, " ".join([*kept, note]).strip())


def input_table(caption: str, inputs: Sequence[InputUse]) -> doc.Block:
    columns = [
        *([doc.of("file", "file", "File")] if any(one.file for one in inputs) else []),
        doc.of("column", "column", "Column"),
        doc.of("meaning", "meaning", "Meaning"),
        doc.of("unit", "unit", "Unit read"),
        doc.of("low", "low", "From", format="sig:4"),
        doc.of("high", "high", "to", format="sig:4"),
        doc.of("si", "si", "in"),
        doc.of("use", "use", "Used"),
    ]
    return doc.listing(caption, inputs, columns, status=lambda one: None if one.is_used else "warn")


def finding_table(record: str, findings: Sequence[Finding]) -> doc.Block:
    words = {True: "yes", False: "NO", None: "not told"}
    columns = [
        doc.of("subject", "subject", "Looked at"),
        doc.of(lambda one: one.done or words[one.passed], "state", "Agrees"),
        doc.of("text", "text", "Found"),
    ]
    return doc.listing(
        f"Does {record} agree with itself and the design?", findings, columns,
        status=lambda one: "info" if one.passed is None else "pass" if one.passed else "fail",
    )  # fmt: skip
