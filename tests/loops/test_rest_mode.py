"""A spring under a velocity PI: the pole of the PI is cancelled by the zero of the plant, and known so."""

from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest

from actuator_lti import assemble_loops, closed_loop_bandwidth, load_design, stability_margins, step_figures
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import wire
from actuator_lti.loops import exact_margins
from actuator_lti.loops.periodic import fundamental
from actuator_lti.loops.sampled import stage_blocks
from actuator_lti.systems.rest_mode import without_rest_mode

SLOPES = (-6000.0, -100.0, -0.1, 50.0)


def sprung(name: str, slope_Nm_rad: float) -> Any:
    """A shipped drive whose load follows the angle through a back-drivable path."""
    design = load_design(name)
    load = replace(design.load, path="back-drivable", moment_slope_Nm_rad=slope_Nm_rad)
    return replace(design, load=load)


def at_rest(design: Any) -> float:
    """L(0) of the velocity loop, Kp/Tn kM/k: a ramp of the PI's torque is a ramp of the spring's angle."""
    law, motor = design.controller.velocity, design.effective_motor
    stiffness = -design.load.moment_slope_Nm_rad / design.total_ratio**2
    return law.gain / law.integral_time_s * motor.torque_constant_Nm_A / stiffness


@pytest.mark.parametrize(
    ("form", "slope"),
    [(form, slope) for form in ("sampled", "ideal") for slope in SLOPES]
    + [("continuous", slope) for slope in SLOPES],
)
def test_the_velocity_loop_has_the_gain_at_zero_that_the_spring_gives(form: Any, slope: float) -> None:
    design = sprung("ilr33-amber", slope)
    loop = assemble_loops(design, form=form).velocity
    L0 = at_rest(design)
    m = stability_margins(loop.open_loop)
    assert m.evidence in ("checked", "certified")
    assert m.stable is True
    # of the loop without a spring; its crossover lies far above the spring's frequency
    bare = stability_margins(assemble_loops("ilr33-amber", form=form).velocity.open_loop)
    assert m.phase_margin_deg == pytest.approx(bare.phase_margin_deg, abs=0.02)
    upper = [g.db for g in m.gain_margins if g.frequency_rad_s > 0.0]
    assert upper == pytest.approx([g.db for g in bare.gain_margins if g.frequency_rad_s > 0.0], abs=0.01)
    lower = [g.ratio for g in m.gain_margins if g.frequency_rad_s == 0.0]
    assert lower == pytest.approx([-1.0 / L0] if L0 < 0.0 else [])
    width = closed_loop_bandwidth(loop.closed_loop)
    assert width.dc_gain == pytest.approx(L0 / (1.0 + L0), rel=1e-6)
    assert 0.0 < width.resonance_peak_db < 2.0
    if form != "continuous":
        assert step_figures(loop.closed_loop).final_value == pytest.approx(L0 / (1.0 + L0), rel=1e-6)


@pytest.mark.parametrize("name", ["ilr33-amber", "ballscrew", "ilr33-amber-multirate"])
@pytest.mark.parametrize("slope", SLOPES)
def test_what_is_taken_out_leaves_the_response_as_it_is(name: str, slope: float) -> None:
    design = sprung(name, slope)
    whole = fundamental(stage_blocks(wire(design, Operating()), "velocity"))
    shown = whole.shown()
    assert len(shown.states) == len(whole.states) - 1
    for x in np.exp(1j * np.array([1e-3, 0.03, 0.5, 3.0])):
        before, after = (b.C @ np.linalg.solve(x * np.eye(len(b.A)) - b.A, b.B) for b in (whole, shown))
        assert after[0, 0] == pytest.approx(before[0, 0], rel=1e-9)


@pytest.mark.parametrize("slope", [-6000.0, -100.0])
def test_a_users_own_loop_of_that_kind_has_its_bandwidth(slope: float) -> None:
    """Closed by hand from the matrices with the hidden mode in them: no resonance of 6000 dB at 0 Hz."""
    design = sprung("ilr33-amber", slope)
    block = fundamental(stage_blocks(wire(design, Operating()), "velocity")).feedback()
    T = control.StateSpace(block.A, block.B, block.C, block.D, 1e-4, remove_useless_states=False)
    width = closed_loop_bandwidth(T)
    expected = closed_loop_bandwidth(assemble_loops(design).velocity.closed_loop)
    assert width.minus3db_rad_s == pytest.approx(expected.minus3db_rad_s, rel=1e-9)
    assert width.resonance_peak_db == pytest.approx(expected.resonance_peak_db, rel=1e-9)
    grid = np.geomspace(1.0, 1e4, 4000)
    gain = np.abs(T(np.exp(1j * grid * 1e-4)))
    L0 = at_rest(design)
    assert width.resonance_peak_db == pytest.approx(20 * np.log10(gain.max() * (1 + L0) / L0), abs=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_nothing_else_is_taken_out(seed: int) -> None:
    """Random loops with an integrator that the output sees, by as little as 1e-9, keep every state."""
    rng = np.random.default_rng([seed, 3])
    n = int(rng.integers(2, 7))
    A = rng.normal(size=(n, n)) * 0.2
    A[0] = 0.0
    A[0, 0] = 1.0
    B, C = rng.normal(size=(n, 1)), rng.normal(size=(1, n))
    C[0, 0] += 10.0 ** -rng.uniform(0, 9)
    assert without_rest_mode(A, B, C, 1.0)[3].all()
    hidden = np.linalg.solve(np.eye(n - 1) - A[1:, 1:], A[1:, 0])
    C[0, 0] = -C[0, 1:] @ hidden  # now it does not
    assert not without_rest_mode(A, B, C, 1.0)[3].all()


def test_both_sides_and_values_that_are_not_finite() -> None:
    A = np.array([[1.0, 0.0, 0.5], [0.0, 0.3, 0.2], [0.0, 0.1, 0.4]])  # fed by the third state: the dual
    B = np.array([[0.0], [1.0], [0.0]])
    B[0, 0] = -0.5 * np.linalg.solve(np.eye(2) - A[1:, 1:], B[1:])[1, 0]
    C = np.array([[1.0, 0.7, 0.0]])
    a, b, c, kept = without_rest_mode(A, B, C, 1.0)
    assert kept.tolist() == [False, True, True]
    z = 0.3 + 0.9j
    before = (C @ np.linalg.solve(z * np.eye(3) - A, B))[0, 0]
    assert (c @ np.linalg.solve(z * np.eye(2) - a, b))[0, 0] == pytest.approx(before, rel=1e-12)
    assert without_rest_mode(A * np.nan, B, C, 1.0)[3].all()


@pytest.mark.parametrize("slope", SLOPES)
def test_the_mode_at_rest_is_no_border_of_stability(slope: float) -> None:
    """Eigenvalues at 1 + 1e-16 whatever the gain; certified margins of the loop say where the border is."""
    design = sprung("ilr33-amber", slope)
    design = replace(design, controller=replace(design.controller, position=None))
    loops = assemble_loops(design)
    exact = exact_margins(loops, "u")
    certified = stability_margins(loops.break_points["u"].open_loop, certify=True)
    assert exact.stable is certified.stable
    if not exact.stable:
        return
    above = [one.ratio for one in certified.gain_margins if one.ratio > 1.0]
    below = [one.ratio for one in certified.gain_margins if 1e-4 < one.ratio < 1.0]  # so far it looks
    assert exact.gain_upper == pytest.approx(min(above, default=np.inf), rel=1e-9)
    assert exact.gain_lower == pytest.approx(max(below, default=0.0), rel=1e-9)
