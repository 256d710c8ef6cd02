"""The branch of a drawn phase: 90 deg for each decade a decade of the gain at low frequency."""

import control
import numpy as np
import pytest

from analyses.linear.responses import curve

OMEGA = np.geomspace(1e-2, 1e3, 60)
PERIOD_S = 1e-3


@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-12, 1e-9, -1e-9])
def test_speed_against_a_spring_begins_at_90_deg_whatever_rounding_does_to_its_zero(off: float) -> None:
    """A zero at 1 + off: outside of the circle its phase begins at 180 deg, below any frequency drawn."""
    loop = control.tf([1.0, -1.0 - off], [1.0, -1.7, 0.72], PERIOD_S)
    phase = curve(loop, OMEGA).phase_deg
    assert phase[0] == pytest.approx(90.0, abs=1.0)
    assert (np.abs(np.diff(phase)) < 180.0).all()


@pytest.mark.parametrize(
    ("num", "den", "begin"),
    [
        ([1.0], [1.0, 1.0], 0.0),
        ([-1.0], [1.0, 1.0], -180.0),
        ([1.0], [1.0, 0.0], -90.0),
        ([-1.0], [1.0, 1.0, 0.0], -270.0),
        ([1.0], [1.0, 1.0, 0.0, 0.0], -180.0),
        ([1.0], [1.0, 1.0, 0.0, 0.0, 0.0], -270.0),
    ],
)
def test_integrators_and_signs_keep_their_branch(num: list[float], den: list[float], begin: float) -> None:
    assert curve(control.tf(num, den), OMEGA * 1e-2).phase_deg[0] == pytest.approx(begin, abs=1.0)
