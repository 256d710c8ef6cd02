"""What the validator says of large commands, confirmed by plain integration and closed forms."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from plain_drive import output_of_step

from actuator_lti import assemble_loops
from actuator_lti.design import model
from analyses.large_signal.conditional import Conditional, conditional_stability, step_rows, step_threshold
from analyses.large_signal.tones import settling_ticks_of
from analyses.motion.settling import settle
from tests.validation.random_drives import full_drive


def look(design: model.Design) -> tuple[Conditional, int]:
    loops = assemble_loops(design)
    place = design.controller.position_loop
    settle = settling_ticks_of(loops.present["position"].closed_loop, place.every, design.name, 400_000)
    return conditional_stability(design, loops, settle), settle


@pytest.mark.parametrize(
    ("seed", "ending", "limiter"),
    [
        (91, "keeps oscillating", "current"),
        (333, "diverges", "torque-command"),
        (3108, "keeps oscillating", "voltage"),  # 45 times as large a step was named: an irregular swing
    ],
)
def test_a_finding_on_a_random_drive_is_that_of_plain_integration(
    seed: int, ending: str, limiter: str
) -> None:
    """2 % below the threshold the error dies out, 2 % above it grows beyond the step itself."""
    design = full_drive(seed)
    design = replace(design, encoder=replace(design.encoder, counts_per_rev=None), supply=None)
    found, settle = look(design)
    assert (found.ending, found.limiter) == (ending, limiter)
    assert found.limiter_share > 0.9
    for factor, settles in ((0.98, True), (1.02, False)):
        size = factor * found.threshold_rad
        ticks = int(step_rows(design, np.array([size]), settle).value("ticks"))
        error = np.abs(output_of_step(design, size, ticks, parts=1) / size - 1.0)
        left = error[-ticks // 8 :].max()
        assert left < 1e-3 if settles else left > 2.0


def unstable(slope_Nm_rad: float, volts: float = 10.0, full_rad: float = 3.0) -> model.Design:
    """A torque source with P controllers on a load that pushes away from the middle."""
    return model.Design(
        name="inverted",
        title="A load that pushes away",
        motor=model.Motor(rotor_inertia_kgm2=1e-3, source_gain_Nm_V=0.5),
        gears=(model.Gear(name="g", ratio=10.0),),
        load=model.Load(inertia_kgm2=0.1, path="back-drivable", moment_slope_Nm_rad=slope_Nm_rad),
        axis="rotary",
        controller=model.Controller(
            period_s=2e-4,
            computing_delay_s=0.0,
            position=model.PositionLoop(gain=30.0),
            velocity=model.VelocityLoop(gain=1.6, integral_time_s=None),
        ),
        limits=model.Limits(voltage_V=volts),
        command=model.Command(rate_rad_s=0.2),
        friction=model.Friction(),
        validation=model.Validation(full_deflection_rad=full_rad),
    )


@pytest.mark.parametrize("slope", [20.0, 40.0])
def test_largest_deflection_that_an_unstable_load_lets_come_back(slope: float) -> None:
    """J th'' = c th + tau, |tau| <= tau_max: th + th'/l, l = sqrt(c/J), must stay within tau_max/c.

    The command creeps there by its profile; P controllers of stiffness K end at r K/(K - c).
    """
    found, _ = look(unstable(slope))
    N, k, J = 10.0, 0.5, 2e-3
    stiffness = k * 1.6 * 30.0 * N**2
    largest = k * 10.0 * N / slope * (1.0 - slope / stiffness)
    creeping = 0.2 / sqrt(slope / N**2 / J)
    assert found.ending == "diverges"
    assert found.limiter == "voltage"
    assert largest - creeping < found.threshold_rad < largest * (1.0 + 1e-3)


def test_a_load_that_pushes_back_holds_the_drive_and_nothing_diverges() -> None:
    """A spring: P controllers end at r K/(K + c), no divergence; the limit holds beyond tau_max/c."""
    damped = model.Friction(viscous_Nms_rad=0.02)
    settled, _ = look(replace(unstable(-40.0, full_rad=1.2), friction=damped))
    assert not settled.diverges
    found, _ = look(replace(unstable(-40.0), friction=damped))
    stiffness = 0.5 * 1.6 * 30.0 * 10.0**2
    assert found.ending == "is held by a limit"
    assert found.limiter == "voltage"
    assert found.threshold_rad == pytest.approx(0.5 * 10.0 * 10.0 / 40.0 * (1.0 + 40.0 / stiffness), rel=2e-3)


@pytest.mark.parametrize("seed", [361, 372])
def test_standing_beside_the_target_is_no_divergence(seed: int) -> None:
    """A spring against P controllers (361); a step below one count of the output's encoder (372)."""
    assert not look(full_drive(seed))[0].diverges


def test_hunting_is_no_conditional_stability() -> None:
    """A PI position controller against dry friction never rests; no limit does it, and no limit stops it."""
    design = full_drive(1020)
    assert design.controller.position_loop.integral_time_s is not None
    assert step_threshold(design, 20_000) == (None, None)
    assert settle(design, 0.0, design.validation.full_deflection_rad).hunting
