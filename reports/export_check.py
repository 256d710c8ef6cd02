"""What an export says of the margins of its compiled code."""

from __future__ import annotations

from analyses.code_check import CodeCheck
from analyses.validation.ledger import Entry
from reports.sections.names import LOOPS, POINTS, QUANTITIES
from reports.sections.validation import MORE

TITLE = "## Margins of the compiled code"
GROUPS = (
    ("gain margin", "dB", ("gain_margin_up", "gain_margin_down")),
    ("phase margin", "deg", ("phase_margin",)),
    ("delay margin", "s", ("delay_margin", "computing_delay_margin")),
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

This code, compiled by `{check.compiler}`, took the simulator's place in the injected sweep
(stepped sine, each loop) and in the margins in time (gain and delay raised until an oscillation stays), small
signals on a constant speed. Beside it the linear loops.{double}

{summary(check)}

| loop | quantity | unit | linear | this code | difference | allowed | |
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
            words.append(f"{name} {abs(worst.difference or 0.0):.2g} {unit} ({_loop(worst)})")
    met = len(check.entries) - len(check.failed)
    ends = f"; largest difference: {', '.join(words)}" if words else ""
    return (
        f"{met} of {len(check.entries)} predictions of the linear loops are met by the compiled code{ends}."
    )


def _loop(entry: Entry) -> str:
    return LOOPS.get(entry.loop) or POINTS.get(entry.loop, entry.loop)


def _row(entry: Entry) -> str:
    what = MORE.get(entry.quantity) or QUANTITIES.get(entry.quantity, entry.quantity)
    words = [_loop(entry), what, entry.unit]
    numbers = [_number(entry.predicted, ".6g"), _number(entry.measured, ".6g"),
               _number(entry.difference, "+.1e"), f"{entry.tolerance:.2g}"]  # fmt: skip
    return "| " + " | ".join([*words, *numbers, "met" if entry.passed else "NOT MET"]) + " |"


def _number(value: float | None, form: str) -> str:
    return "none" if value is None else format(value, form)
