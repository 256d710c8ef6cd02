"""Two masses and a spring: digits K1 to K4, closed forms, the rigid limit, compliance, stiffness."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from loop_designs import controlled, drive_d

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.batch import Population
from actuator_lti.batch import drive_figures as many
from actuator_lti.design import model
from actuator_lti.drive.blocks import biquad
from actuator_lti.drive.operating import Operating, slope_at
from actuator_lti.loops.stiffness import compliance
from nonlinear import commands, simulate
from tests.changed import changed

NOTCH = model.Filter(kind="notch", frequency_rad_s=640.0, width_rad_s=320.0, depth=0.1)


PUBLISHED = {  # loop, filters, phase margins (deg, rad/s), gain margin (ratio, rad/s)
    "K1, current loop, rotor free": (
        "current", (),
        [(77.98855712, 610.7379071), (166.4429489, 645.4654402), (77.45285893, 1612.214119)],
        (6.503072809, 10479.30493),
    ),
    "K2, velocity loop": (
        "velocity", (),
        [(74.46418674, 245.4593817), (-129.7195634, 541.7421541), (62.39378704, 872.8623258)],
        (7.624731944, 2860.527035),
    ),
    "K3, with a notch": ("velocity", (NOTCH,), [(63.34614837, 241.6147984)], (8.849712773, 3101.308198)),
}  # fmt: skip


@pytest.mark.parametrize("case", PUBLISHED)
def test_published_margins(case: str) -> None:
    name, filters, phases, gain = PUBLISHED[case]
    margins = stability_margins(getattr(assemble_loops(drive_d(*filters)), name).open_loop)
    for have, want in (
        (sorted((m.deg, m.frequency_rad_s) for m in margins.phase_margins), sorted(phases)),
        ([(m.ratio, m.frequency_rad_s) for m in margins.gain_margins], [gain]),
    ):
        assert [each for pair in have for each in pair] == pytest.approx(
            [each for pair in want for each in pair], rel=1e-8
        )


def test_coefficients_of_the_notch_of_k3() -> None:
    found = biquad(NOTCH, 2e-4).sampled
    a1, a2 = -found.A[0][0], -found.A[1][0]
    b = [found.D, found.B[0] + found.D * a1, found.B[1] + found.D * a2]
    np.testing.assert_allclose(b, [0.9721668107471211, -1.922292822062545, 0.9659816575798147], rtol=1e-13)
    np.testing.assert_allclose([a1, a2], [-1.922292822062545, 0.9381484683269357], rtol=1e-13)


def test_slope_and_describing_function_of_a_friction_map() -> None:
    points = tuple(
        model.FrictionPoint(speed_rad_s=w, torque_Nm=T) for w, T in ((0.0, 0.02), (10.0, 0.01), (50.0, 0.03))
    )
    design = replace(drive_d(), friction=model.Friction(points=points))
    assert slope_at(design, Operating()) == pytest.approx(-1e-3)
    assert slope_at(design, Operating(speed_rad_s=-80.0)) == pytest.approx(5e-4)
    # fundamental of the torque of a sinusoidal speed, by quadrature over a quarter turn
    W = 40.0
    edges = np.arcsin(np.array([0.0, 10.0, W]) / W)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    whole = 0.0
    for low, high in pairwise(edges):
        x = low + (high - low) * (nodes + 1) / 2
        speed = W * np.sin(x)
        torque = np.where(speed < 10, 0.02 - 1e-3 * speed, 0.01 + 5e-4 * (speed - 10))
        whole += float(np.sum(weights * torque * np.sin(x)) * (high - low) / 2)
    expected = 4 / np.pi * whole / W
    result = slope_at(design, Operating(point="describing-function", speed_amplitude_rad_s=W))
    assert result == pytest.approx(expected, rel=1e-12)


SLOW = {  # the textbook motor, heavy, on almost no gain
    "motor.rotor_inertia": 1e-3, "motor.resistance": 0.6, "motor.inductance": 5e-3, "load.inertia": 1e-4,
    "motor.torque_constant": 0.75, "motor.back_emf_constant": 0.75, "friction.viscous": 0.0,
    "control.position.gain": 1e-5,
}  # fmt: skip
AMBER = load_design("ilr33-amber").with_values({"friction.breakaway_ratio": 1.3})


@pytest.mark.parametrize("name", ["joint", "ballscrew", "fin", "ilr33-amber-compliant", "emps"])
def test_the_periodic_response_is_that_of_the_time_invariant_system(name: str) -> None:
    """Two derivations: M ticks followed one after the other, and one system of M n states."""
    loops, result = assemble_loops(load_design(name)), compliance(load_design(name))
    z = np.exp(2j * np.pi * np.geomspace(0.1, 1000.0, 30) * result.period_s)
    lifted = loops.moment_to_output
    assert np.abs(result(z) / lifted(z) - 1.0).max() < 1e-9
    assert result.slowest == pytest.approx(np.abs(lifted.poles()).max(), rel=1e-9)


@pytest.mark.parametrize(("name", "values", "quantities"), [
    ("ballscrew", {"coupling.stiffness": [4e7, 1e8, 3e8], "control.position.gain": [20.0, 60.0, 90.0]},
     ("static_stiffness", "least_stiffness", "lost_motion")),
    # delays of whole and broken ticks, damping of zero: other states, other zeros, taken group by group
    ("fin",
     {"control.computing_delay": [0.0, 1e-4, 2e-4, 5e-4], "coupling.damping": [0.0, 0.05, 0.05, 0.0]},
     ("least_stiffness",)),
])  # fmt: skip
def test_stacked_designs_have_the_figures_of_each_alone(name, values, quantities):
    design, count = load_design(name), len(next(iter(values.values())))
    stacked = {path: np.array(each) for path, each in values.items()}
    for quantity in quantities:
        together = many(Population(design, stacked, count), quantity)
        for k in range(count):
            alone = Population(design, {path: each[k : k + 1] for path, each in stacked.items()}, 1)
            assert together[k] == pytest.approx(many(alone, quantity)[0], rel=1e-9)


def test_a_drive_that_creeps_for_hours_has_a_stiffness_and_one_without_position_loop_none() -> None:
    """P on voltage: Kp kM N^2/R, here with a time constant kE kM/R over that of a day."""
    slow = load_design("ctms-motor-position").with_values(SLOW)
    assert drive_figure(slow, "static_stiffness") == pytest.approx(1e-5 * 0.75 / 0.6, rel=1e-6)
    free = controlled(slow, position=None, velocity=model.VelocityLoop(gain=1e-2))
    assert drive_figure(free, "static_stiffness") == 0.0


@pytest.mark.parametrize("load_Nm", [0.0, 1.0, 6.0])
@pytest.mark.parametrize(("margin", "moves"), [(0.98, False), (1.02, True)])
def test_the_simulator_starts_above_one(load_Nm: float, margin: float, moves: bool) -> None:
    """A current limit gives the margin; a large step either way, within a voltage that is no limit."""
    peak_A = margin / drive_figure(changed(AMBER, limits={"peak_current_A": 1.0}), "torque_margin", load_Nm)
    design = changed(AMBER, limits={"peak_current_A": float(peak_A)})
    assert drive_figure(design, "torque_margin", load_Nm) == pytest.approx(margin, rel=1e-9)
    runs = [
        simulate(design, commands.step(sign * 0.2), duration_s=0.3, load_Nm=-sign * load_Nm)
        for sign in (1.0, -1.0)
    ]
    assert all(np.abs(run.motor_speed_rad_s).max() > 1e-6 for run in runs) is moves
