"""What an export says of the margins of its compiled code."""

from __future__ import annotations

from analyses.linear.code_check import CodeCheck
from analyses.validation.row import Row
from reports.sections.validation import loop_name, quantity_name

TITLE = "## Margins of the compiled code"
GROUPS = (
    ("response", "(relative)", ("response",)),
    ("gain margin", "(factor)", ("gain_margin", "gain_margin_up", "gain_margin_down")),
    ("phase margin", "deg", ("phase_margin",)),
    ("delay margin", "s", ("delay_margin",)),
)


def check_text(check: CodeCheck | None, *, single_precision: bool = False) -> str:
    """The section of a README, as Markdown.

    Parameters
    ----------
    check : CodeCheck or None
        ``None``: it was not asked for.
    single_precision : bool
        Whether the files are in single precision; what is measured is the double.
    """
    if check is None:
        return f"{TITLE}\n\nNot measured at this export (`--no-check`).\n"
    if check.reason:
        return f"{TITLE}\n\nNot measured: {check.reason}.\n"
    double = " Measured in double precision." if single_precision else ""
    rows = "\n".join(_row(entry) for entry in check.entries)
    return f"""{TITLE}

This code, compiled by `{check.compiler}`, took the simulator's place: its derivative over one base period
(central differences), a small step of each loop, and runs 1 % inside and outside of each gain margin, on a
constant speed. Beside it the linear loops.{double}

{summary(check)}

| loop | quantity | unit | linear | this code | error | allowed | |
|---|---|---|---|---|---|---|---|
{rows}
"""


def summary(check: CodeCheck) -> str:
    """One sentence: how many predictions are met, and the largest differences of the margins."""
    if check.reason:
        return f"margins of the compiled code: not measured ({check.reason})"
    words = []
    for name, unit, quantities in GROUPS:
        worst = check.largest(*quantities)
        if worst is not None:
            words.append(f"{name} {worst.error:.2g} {unit} ({loop_name(worst.loop)})")
    met = len(check.entries) - len(check.failed)
    ends = f"; largest difference: {', '.join(words)}" if words else ""
    return (
        f"{met} of {len(check.entries)} predictions of the linear loops are met by the compiled code{ends}."
    )


def _row(row: Row) -> str:
    words = [loop_name(row.loop), quantity_name(row), row.unit]
    numbers = [_number(row.predicted, ".6g"), _number(row.found, ".6g")]
    numbers += [f"{row.error:.1e}", f"{row.allowed:.2g}"]
    return "| " + " | ".join([*words, *numbers, str(row.verdict)]) + " |"


def _number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)
