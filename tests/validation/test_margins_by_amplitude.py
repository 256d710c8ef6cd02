"""Margins by amplitude and other findings: what is not asked is said; a friction map is dry friction."""

from dataclasses import replace

import numpy as np

from actuator_lti import load_design
from actuator_lti.design.model import FrictionPoint
from actuator_lti.drive.operating import rubs
from analyses.large_signal import large_signals
from analyses.large_signal.by_amplitude import TOO_MANY, margins_by_amplitude
from analyses.validation.places import Bench
from tests.validation.random_drives import full_drive


def test_a_way_back_of_hours_is_not_simulated() -> None:
    """114 kg that 0.18 N speeds up for an hour, at 47 kHz; the table says so of each margin."""
    drive = full_drive(1_600_015)
    found = list(margins_by_amplitude(Bench(drive, drive)))
    assert len(found) == 24  # its friction is a map: with it and without
    assert all(one.too_long and one.value is None for one in found)
    assert TOO_MANY * drive.controller.period_s < 900.0  # 12 values and more


def test_a_flat_friction_map_is_dry_friction() -> None:
    """The same torque at every speed: a limit acts from the same amplitudes on."""
    drive = load_design("ilr33-amber")
    dry = drive.friction.dry_torque_Nm
    points = tuple(FrictionPoint(speed_rad_s=speed, torque_Nm=dry) for speed in (0.0, 2000.0))
    plain = replace(drive.friction, viscous_Nms_rad=0.0)
    flat = replace(plain, dry_torque_Nm=0.0, points=points)
    found = []
    for friction in (plain, flat):
        one = replace(drive, friction=friction)
        assert rubs(one)
        found.append(large_signals(one, counts=(2, 2)).shift.simulated_rad)
    assert np.isfinite(found[0]).any()
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)
    assert not rubs(replace(drive, friction=replace(plain, dry_torque_Nm=0.0)))
