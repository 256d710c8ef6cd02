"""The examples run, and show what they say."""

from pathlib import Path

import numpy as np
import pytest
from programs import needs_compiler

from actuator_lti import load_design
from examples import firmware_controller as firmware

pytestmark = needs_compiler
LAW_OF_JOINT = [("joint", stage) for stage in ("current", "velocity", "position")]


def test_the_unit_confirms_the_gain_margin_of_the_autopilot(tmp_path: Path) -> None:
    """Linear loop on one side, the compiled drive in a flight on the other: the border lies between."""
    from fmu_host import written  # or skip, where there is no FMPy

    from examples.autopilot_loop import GAIN_S, fly, margins

    design = load_design("ilr33-amber")
    result = margins(design)
    assert result.stable
    limit, path = GAIN_S * result.gain_margins[0].ratio, written(tmp_path, design)
    assert fly(design, path, 0.97 * limit, 0.6).growth < 1.0 < fly(design, path, 1.03 * limit, 0.6).growth


def test_a_host_with_an_integrator_of_its_own_flies_the_same(tmp_path: Path) -> None:
    """solve_ivp with the C inside, FMPy with the unit: 1e-7, a fourth at half the step; held: 2.6e-3."""
    from fmu_host import written

    from examples.autopilot_loop import fly, fly_inside, smooth

    design = load_design("ilr33-amber")
    path = written(tmp_path, design)
    inside = fly_inside(smooth(design), tmp_path, 2.0, 0.006).roll_rate_rad_s
    held = (fly(design, path, 2.0, 0.006, parts=parts).roll_rate_rad_s for parts in (1, 10, 20))
    far = [np.abs(each - inside).max() / np.abs(inside).max() for each in held]
    assert far[1] < 2e-7
    assert far[1] / far[2] == pytest.approx(4.0, rel=0.02)
    assert far[0] > 1e-3


@pytest.mark.filterwarnings("ignore")  # those of RocketPy and its libraries are not ours
def test_the_lag_misses_what_friction_and_play_do_to_the_roll(tmp_path: Path) -> None:
    """With friction and play the roll hunts, tenfold; without them, and with the lag, it does not."""
    pytest.importorskip("rocketpy", reason="RocketPy is not installed (pip install 'actuator-lti[examples]')")
    from examples.canard_roll import LARGEST_RAD, SETTLED_S, drive_design, fly, lag, real, smooth_design

    actuators = (lag(drive_design()), real(drive_design(), tmp_path), real(smooth_design(), tmp_path))
    rms = []
    for actuator in actuators:
        flight = fly(actuator, SETTLED_S + 0.8)
        assert np.abs(flight.after(SETTLED_S).command_rad).max() < LARGEST_RAD
        rms.append(float(np.std(flight.after(SETTLED_S).rate_rad_s)))
    alone, with_drive, smooth = rms
    assert with_drive > 10.0 * max(alone, smooth)
    assert min(alone, smooth) > 0.0


@pytest.mark.parametrize(
    ("name", "law"),
    [*((name, "") for name in ("ilr33-amber", "fin", "joint", "ballscrew", "emps")), *LAW_OF_JOINT],
)
def test_the_controller_for_firmware_closes_the_loop_as_the_simulator_does(name: str, law: str) -> None:
    """With friction, play and limits: double to the bit but for differences of counts; float to one count."""
    design = load_design(name)
    if law:  # PI with a little of both angles as they are counted
        loop = getattr(design.controller, law)
        every, gain = getattr(loop, "every", 1), getattr(loop, "gain", 1.2)
        D = gain * np.array([[1.0, -1e-4, 1e-4]])
        system = ([[1.0]], [[1.0, 0.0, 0.0]], [[1e-3 * gain]], D, every * design.controller.period_s)
        design = design.with_law(law, system, ["error", "angle", "output_angle"], L=[0.5 / gain])
    commands = firmware.random_commands(design, 800, 0.5 * design.validation.full_deflection_rad)
    exact = firmware.closed(design, commands, "double").difference_rad
    assert exact <= 1e-12 * design.validation.full_deflection_rad
    single = firmware.closed(design, commands, "float").difference_rad
    count = max(design.output_quantum_rad or 0.0, (design.angle_quantum_rad or 0.0) / design.total_ratio)
    assert 0.0 < single < max(count, 1e-6 * design.validation.full_deflection_rad)


def test_float_stays_within_the_bound_that_is_computed() -> None:
    """Where the loop is linear; the bound is no more than a hundred times what is seen."""
    design = firmware.smooth(load_design("ilr33-amber"))
    commands = firmware.random_commands(design, 4000, 2e-3)
    found = firmware.closed(design, commands, "float")
    bound = firmware.bound_rad(design, commands, found)
    assert found.difference_rad <= bound < 100.0 * found.difference_rad
