"""Documents that go into an exported unit: margin report, margins of its code, design file, licence."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from analyses.linear.code_check import CodeCheck


def export_documents(design: Design, check: CodeCheck | None = None) -> dict[str, bytes]:
    """Files of the documentation folder by name.

    index.html (the margin report), compiled_code.md (margins measured on the code), the design as TOML, the
    licence.
    """
    from reports.build import design_report
    from reports.export_check import check_text
    from reports.html import page

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
