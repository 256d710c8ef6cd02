"""The map compares the output with the output's own linear response, springs and limited jerk included."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Command, Design, Friction
from analyses.large_signal.classify import CAUSES
from analyses.large_signal.map import AmplitudeMap, amplitude_bode, amplitude_map
from tests.nonlinear.elastic_drive import drive_f


def without_friction(design: Design) -> Design:
    """A drive with its spring, and nothing that is not linear but its limits."""
    assert design.coupling is not None
    sharp = replace(design.encoder, counts_per_rev=None), replace(design.output_encoder, counts_per_rev=None)
    rubbing = {"dry_torque_Nm": 0.0, "points": (), "load_coefficient": 0.0, "offset_torque_Nm": 0.0}
    return replace(
        design,
        friction=replace(design.friction, **rubbing),
        load=replace(design.load, friction=None, gravity=None, path="back-drivable"),
        coupling=replace(design.coupling, play_rad=0.0),
        encoder=sharp[0],
        output_encoder=sharp[1],
    )


def small(design: Design, size: float = 1e-7) -> Design:
    asked = replace(design.validation, full_deflection_rad=size, amplitude_fractions=(1.0,))
    return replace(design, validation=asked)


def mapped(design: Design, counts: tuple[int, int] = (2, 9)) -> AmplitudeMap:
    return amplitude_map(design, assemble_loops(design), counts=counts)


def jerky(design: Design) -> Design:
    """With a command whose jerk is limited: n = 2 a/(j T) = 25 samples."""
    period = design.controller.position_loop.every * design.controller.period_s
    return replace(
        design,
        command=Command(acceleration_rad_s2=100.0, jerk_rad_s3=200.0 / (25.0 * period), filter_time_s=2e-3),
    )


SPRINGS = {
    **{
        name: without_friction(load_design(name))
        for name in ("ballscrew", "joint", "fin", "ilr33-amber-compliant")
    },
    "drive F": without_friction(drive_f()),
    "drive F behind a profile": jerky(without_friction(drive_f())),
}


@pytest.mark.parametrize("name", SPRINGS)
def test_small_sines_are_the_linear_curve_of_the_output(name: str) -> None:
    """Against the response of the loops, times the mean of n samples added up one by one."""
    design = small(SPRINGS[name])
    result, loops = mapped(design), assemble_loops(design)
    path, command = loops.reference_to_output, design.command
    z = np.exp(2j * np.pi * result.frequency_hz * path.dt)
    samples = 1
    if np.isfinite(command.jerk_rad_s3):
        samples = round(2.0 * command.acceleration_rad_s2 / (command.jerk_rad_s3 * path.dt))
    linear = path(z) * np.mean([z**-k for k in range(samples)], axis=0)
    np.testing.assert_allclose(result.response / result.linear[None, :], 1.0, atol=1e-6)
    # the loops see a slower position loop's updates only, where images of the tone lie as well
    every = design.controller.position_loop.every
    np.testing.assert_allclose(result.linear / (linear if every == 1 else 1.0),
                               1.0 if every == 1 else linear, atol=1e-6)  # fmt: skip
    assert {CAUSES[k] for k in result.cause.ravel()} == {"none"}


def test_the_bandwidth_of_the_map_is_that_of_the_output() -> None:
    """Behind a soft spring, where the motor's side has another."""
    soft = replace(drive_f().coupling, stiffness_Nm_rad=3.0)  # type: ignore[type-var]
    design = small(without_friction(replace(drive_f(), coupling=soft)))
    bode = amplitude_bode(design, assemble_loops(design), mapped(design, (2, 40)))
    np.testing.assert_allclose(bode.minus3db_hz, bode.linear_minus3db_hz, rtol=1e-5)


PLAY, TIGHT = drive_f().coupling, replace(drive_f().coupling, play_rad=0.0)  # type: ignore[type-var]


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"coupling": PLAY}, "other"),
        ({"coupling": TIGHT, "friction": Friction(dry_torque_Nm=5e-3)}, "friction"),
    ],
    ids=["play", "friction"],
)
def test_cells_are_named_after_friction_only_where_it_acts(change: dict[str, Any], cause: str) -> None:
    design = small(replace(drive_f(), **change), 0.02)
    causes = {CAUSES[k] for k in mapped(design, (6, 8)).cause.ravel()}
    assert cause in causes
    assert causes & {"friction", "other"} == {cause}
