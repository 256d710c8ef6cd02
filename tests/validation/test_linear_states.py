"""Analyses that look states of the linear drive up by name: an unknown one is refused, not skipped."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.design import shipped_designs
from actuator_lti.design.model import Filter
from actuator_lti.errors import NumericalError
from analyses.large_signal.tones import LEFT_AT_REST, PLACES, linear_steady_state, without_value
from analyses.limit_cycles.stick_slip import _slip
from tests.changed import changed


@pytest.mark.parametrize("name", shipped_designs())
def test_every_state_of_a_shipped_drive_is_known(name: str) -> None:
    assert not without_value(assemble_loops(name).tick_system.states, PLACES, LEFT_AT_REST)


def test_a_start_refuses_a_state_that_it_does_not_know() -> None:
    loops = assemble_loops("ilr33-amber")
    system = loops.tick_system
    kept = {name: getattr(system, name) for name in ("outputs", "ticks", "matrices")}
    strange = SimpleNamespace(states=("flux", *system.states[1:]), **kept)
    with pytest.raises(NumericalError, match="state flux of the linear drive"):
        linear_steady_state(replace(loops, tick_system=strange), np.array([10.0]))


def test_a_stick_slip_cycle_is_not_foreseen_where_a_filter_holds_what_is_not_known() -> None:
    """A torque filter holds the breakaway torque before the slip, not zero, as it was taken."""
    design = load_design("ilr33-amber")
    assert _slip(design, 1.0, assemble_loops(design)) is not None
    low_pass = Filter(on="torque", kind="lowpass", frequency_rad_s=2000.0)
    filtered = changed(design, controller={"velocity": {"filters": (low_pass,)}})
    assert any(name.startswith("torque1") for name in assemble_loops(filtered).tick_system.states)
    assert _slip(filtered, 1.0, assemble_loops(filtered)) is None
