"""Documents that go into an exported unit: margin report, margins of its code, design file, licence."""

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from analyses.linear.code_check import CodeCheck
from analyses.validation.row import Row
from reports.html import page
from reports.sections.validation import loop_name, quantity_name


def export_documents(design: Design, check: CodeCheck | None = None) -> dict[str, bytes]:
    """Files by name: the margin report, the margins measured on the code, the design as TOML, the licence."""
    from reports.build import design_report

    return {
        "index.html": page(design_report(design)).encode(),
        "compiled_code.md": check_text(check).encode(),
        f"{design.name}.toml": write_design(design).encode(),
        "licenses/license.txt": licence_text().encode(),
    }


def licence_text() -> str:
    """The licence of this package, under which the exported sources stand too."""
    beside = Path(__file__).resolve().parent.parent / "LICENSE"
    if beside.is_file():
        return beside.read_text(encoding="utf-8")
    try:
        return distribution("actuator-lti").read_text("licenses/LICENSE") or "MIT"
    except PackageNotFoundError:
        return "MIT"


TITLE = "## Margins of the compiled code"
GROUPS = (
    ("response", "(relative)", ("response",)),
    ("gain margin", "(factor)", ("gain_margin", "gain_margin_up", "gain_margin_down")),
    ("phase margin", "deg", ("phase_margin",)),
    ("delay margin", "s", ("delay_margin",)),
)


def check_text(check: CodeCheck | None, *, single_precision: bool = False) -> str:
    """The section of a README, as Markdown; without a check it was not asked for.

    What is measured is the code in double precision, also where the files are in single.
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
    worst = [(name, unit, check.largest(*quantities)) for name, unit, quantities in GROUPS]
    words = [f"{name} {of.error:.2g} {unit} ({loop_name(of.loop)})" for name, unit, of in worst if of]
    ends = f"; largest difference: {', '.join(words)}" if words else ""
    met = f"{len(check.entries) - len(check.failed)} of {len(check.entries)}"
    return f"{met} predictions of the linear loops are met by the compiled code{ends}."


def _row(row: Row) -> str:
    words = [loop_name(row.loop), quantity_name(row), row.unit]
    numbers = ["" if value is None else f"{value:.6g}" for value in (row.predicted, row.found)]
    numbers += [f"{row.error:.1e}", f"{row.allowed:.2g}"]
    return "| " + " | ".join([*words, *numbers, str(row.verdict)]) + " |"
