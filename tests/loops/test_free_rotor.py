"""A rotor without friction or behind a weak spring: what the current loop shows at zero frequency."""

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from actuator_lti import assemble_loops, closed_loop_bandwidth, load_design, stability_margins
from actuator_lti.design import read_design_text

SERVO = """
[design]
name = "rc"
[motor]
resistance = "2.1 ohm"
inductance = "0.25 mH"
torque_constant = "6 mN*m/A"
back_emf_constant = "6 mV*s/rad"
rotor_inertia = "1.2 g*cm^2"
[friction]
dry_torque = "0.3 mN*m"
[[gear]]
name = "spur"
ratio = 200
[limits]
voltage = "7.4 V"
[control]
period = "500 us"
computing_delay = "100 us"
"""
WITH_CURRENT_LOOP = """
[control.current]
gain = "0.5 V/A"
integral_time = "1 ms"
[control.velocity]
gain = "0.02 A*s/rad"
[control.position]
gain = "30 1/s"
[validation]
full_deflection = "30 deg"
"""
WITHOUT = """
[control.velocity]
gain = "0.02 V*s/rad"
[control.position]
gain = "30 1/s"
[validation]
full_deflection = "30 deg"
"""


@pytest.mark.parametrize("form", ["sampled", "continuous", "ideal"])
@pytest.mark.parametrize("control", [WITH_CURRENT_LOOP, WITHOUT])
def test_a_servo_without_viscous_friction_is_stable_in_every_form(form: Any, control: str) -> None:
    """The pole of the PI at zero lies on the zero of the plant; neither overflows on the way."""
    loops = assemble_loops(read_design_text(SERVO + control, "rc"), form=form)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for loop in (loops.current, loops.velocity, loops.position):
            if loop is not None:
                result = stability_margins(loop.open_loop, certify=True)
                assert (result.stable, result.evidence) == (True, "certified")


@pytest.mark.parametrize("certify", [False, True])
def test_a_gain_of_one_at_rest_has_its_distances(certify: bool) -> None:
    """Velocity gain kE on a free rotor: L(0) = 1, where the disk margin's criterion has its pole.

    Whether |L| crosses one beside zero frequency is a question for exact arithmetic, asked or not.
    """
    text = SERVO + WITHOUT.replace("0.02 V*s/rad", "6 mV*s/rad")
    loop = assemble_loops(read_design_text(text, "rc"), form="continuous").velocity
    result = stability_margins(loop.open_loop, certify=certify)
    assert result.stable is True
    assert result.evidence == "certified"
    assert result.phase_margins == ()  # |L| starts at one and falls
    grid = 1j * np.geomspace(1.0, 1e5, 20_001)
    L = np.array([loop.open_loop(s) for s in grid]).ravel()
    assert result.modulus_margin == pytest.approx(np.abs(1.0 + L).min(), rel=1e-5)
    assert result.disk_margin.alpha == pytest.approx((2.0 * np.abs((1.0 + L) / (1.0 - L))).min(), rel=1e-5)


@pytest.mark.parametrize("slope", [-0.1, 0.1, 5.0, 50.0])
def test_a_weak_spring_is_told_from_none(slope: float) -> None:
    """Closed at the current only, the motor is held by the spring alone: unstable where that drives."""
    design = load_design("ilr33-amber")
    load = replace(design.load, path="back-drivable", moment_slope_Nm_rad=slope)
    loops = assemble_loops(replace(design, load=load), form="continuous")
    assert stability_margins(loops.current.open_loop).stable is (slope < 0.0)
    assert stability_margins(loops.velocity.open_loop).stable is True


def test_the_gain_at_rest_of_a_current_loop_on_a_free_rotor() -> None:
    """L(0) = Kp/Tn J/(kM kE): at constant current the ramp of the PI is one of the back-EMF."""
    design = read_design_text(SERVO + WITH_CURRENT_LOOP, "rc")
    loop = assemble_loops(design, form="continuous").current
    at_rest = 0.5 / 1e-3 * 1.2e-7 / 6e-3**2
    dc_gain = closed_loop_bandwidth(loop.closed_loop).dc_gain
    assert dc_gain == pytest.approx(at_rest / (1.0 + at_rest), rel=1e-9)


@pytest.mark.parametrize("slope", [-40.0, -0.1, 50.0])
def test_a_slow_pole_behind_two_integrators_is_no_turn_of_the_delay(slope: float) -> None:
    """Cut at the voltage L falls by 25 decades before it crosses one: by its factors or exactly."""
    design = load_design("ilr33-amber")
    load = replace(design.load, path="back-drivable", moment_slope_Nm_rad=slope)
    cuts = assemble_loops(replace(design, load=load), form="continuous").break_points
    result = stability_margins(cuts["u"].open_loop)
    assert result.evidence in ("checked", "certified")
    assert result.stable is stability_margins(cuts["w_ref"].open_loop).stable  # the same closed-loop poles
    w = np.concatenate((np.geomspace(1e-6, 99.0, 500), np.geomspace(1e2, 1e5, 3_001)))
    L = np.array([cuts["u"].open_loop(1j * x) for x in w]).ravel()
    gain = np.flatnonzero((np.abs(L[1:]) > 1.0) != (np.abs(L[:-1]) > 1.0))
    assert [p.frequency_rad_s for p in result.phase_margins] == pytest.approx(w[gain], rel=3e-3)
    assert result.phase_margin_deg == pytest.approx(np.degrees(np.angle(-L[gain[0]])), abs=0.2)
    real = np.flatnonzero(((L[1:].imag > 0.0) != (L[:-1].imag > 0.0)) & (L[1:].real < 0.0))
    listed = [g for g in result.gain_margins if 0.0 < g.frequency_rad_s < 1e5]
    assert [g.frequency_rad_s for g in listed] == pytest.approx(w[real][np.abs(L[real]) > 0.01], rel=3e-3)
    assert result.modulus_margin == pytest.approx(np.abs(1.0 + L).min(), rel=1e-4)
