"""The examples run, and show what they say."""

from __future__ import annotations

from pathlib import Path

import pytest

from actuator_lti import load_design
from nonlinear.export import fmu_bytes
from nonlinear.export.build import system_compiler

pytest.importorskip("fmpy", reason="FMPy is not installed (pip install 'actuator-lti[export]')")
pytestmark = pytest.mark.skipif(system_compiler() is None, reason="no C compiler on this machine")


def test_the_unit_confirms_the_gain_margin_of_the_autopilot(tmp_path: Path) -> None:
    """Linear loop on one side, the compiled drive in a flight on the other: the border lies between."""
    from examples.autopilot_loop import GAIN_S, fly, margins

    design = load_design("ilr33-amber")
    found = margins(design)
    assert found.stable
    limit = GAIN_S * found.gain_margins[0].ratio
    path = tmp_path / "drive.fmu"
    path.write_bytes(fmu_bytes(design, 2, ("linux64",)))
    assert fly(design, path, 0.97 * limit, 0.6).growth < 1.0 < fly(design, path, 1.03 * limit, 0.6).growth
