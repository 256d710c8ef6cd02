"""Margins of the compiled code: the exported code meets the loops, and a wrong one would be seen."""

import zipfile

import pytest
from programs import needs_compiler

import actuator_lti.compiled.compiler as build_module
import reports.exports as exports
from actuator_lti import load_design
from actuator_lti.compiled.library import Library
from analyses.linear.code_check import CodeCheck, check_code
from nonlinear.native import LIBRARY
from reports.export_documents import check_text, summary


@needs_compiler
@pytest.mark.parametrize("name", ["ilr33-amber", "ctms-motor-position"])
def test_the_compiled_code_has_the_margins_of_the_loops(name: str) -> None:
    result = check_code(load_design(name))
    assert not result.reason
    assert not result.failed
    gain = result.largest("gain_margin")
    assert 0.0 < gain.error < 1e-6 * (gain.predicted or 0.0)
    assert {"response", "gain_margin", "phase_margin", "delay_margin"} <= {row.name for row in result.entries}


@needs_compiler
def test_a_wrong_code_is_seen(monkeypatch) -> None:
    """The current controller's gain two per cent too high in the C file alone."""
    text = LIBRARY.text()
    wrong = text.replace("p[CURRENT_GAIN]", "(1.02 * p[CURRENT_GAIN])")
    assert wrong != text
    monkeypatch.setattr(Library, "text", lambda _: wrong)
    result = check_code(load_design("ilr33-amber"))
    assert {entry.loop for entry in result.failed} >= {"current", "u"}
    assert "| not met |" in check_text(result)


def test_without_a_compiler_it_says_so(monkeypatch) -> None:
    monkeypatch.setattr(build_module, "system_compiler", lambda: None)
    result = check_code(load_design("ilr33-amber"))
    assert result.reason.startswith("no C compiler")
    assert not result.entries
    assert "Not measured: no C compiler" in check_text(result)
    assert "not measured" in summary(result)


@needs_compiler
def test_exports_say_what_was_measured(tmp_path, monkeypatch, cli) -> None:
    name, unit = "ctms-motor-position", tmp_path / "u.fmu"
    said = cli.text("export", "c", name, "--out", tmp_path / "c")
    assert "predictions of the linear loops are met by the compiled code" in said
    words = (tmp_path / "c/README.md").read_text()
    assert "## Margins of the compiled code" in words
    assert "| Position loop | phase margin | deg |" in words
    cli.text("export", "c", name, "--no-check", "--out", tmp_path / "d")
    assert "Not measured at this export" in (tmp_path / "d/README.md").read_text()
    monkeypatch.setattr(exports, "check_code", lambda _: CodeCheck(reason="said here"))
    cli.text("export", "fmu", name, "--platform", "linux64", "--out", unit)
    with zipfile.ZipFile(unit) as archive:
        assert b"Not measured: said here" in archive.read("documentation/compiled_code.md")
