"""Two masses and a spring: the published digits K1 to K4, closed forms, and the rigid limit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from loop_designs import controlled
from two_mass import drive_d, drive_e

from actuator_lti import assemble_loops, stability_margins
from actuator_lti.design import model
from actuator_lti.drive.blocks import biquad
from actuator_lti.drive.operating import Operating, slope_at

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


@pytest.mark.parametrize("form", ["sampled", "continuous", "ideal"])
def test_an_ever_stiffer_coupling_tends_to_the_rigid_drive(form: str) -> None:
    free = replace(drive_d(), load=replace(drive_d().load, friction=None))
    rigid = assemble_loops(replace(free, coupling=None), form)
    omega, gaps = np.geomspace(1, 2000, 12), []
    for k in (4e5, 4e7):
        # damping that keeps the mode's damping ratio, as it moves out
        stiff = model.Coupling(stiffness_Nm_rad=k, damping_Nms_rad=1e-3 * np.sqrt(k))
        loops, worst = assemble_loops(replace(free, coupling=stiff), form), 0.0
        for name, loop in rigid.present.items():
            points = np.exp(1j * omega * loop.period_s) if form == "sampled" else 1j * omega
            ratio = getattr(loops, name).open_loop(points) / loop.open_loop(points)
            worst = max(worst, float(np.max(np.abs(ratio - 1))))
        gaps.append(worst)
    assert gaps[0] / gaps[1] > 30
    assert gaps[1] < 1e-3


def test_output_sensor_sees_the_spring() -> None:
    """Below the resonance both sensors agree; above it the output lags the motor by half a turn."""
    drives = (drive_e(), controlled(drive_e(), position={"sensor": "output"}))
    motor, output = (assemble_loops(each, "ideal").position for each in drives)
    s = 1j * np.array([1.0, 3000.0])
    ratio = output.open_loop(s) / motor.open_loop(s)
    # phi N_c/th = (c s + k)/(J_l s^2 + (c + Cv_l) s + k)
    expected = (0.1 * s + 400) / (2e-3 * s**2 + 0.11 * s + 400)
    np.testing.assert_allclose(ratio, expected, rtol=1e-9)


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
