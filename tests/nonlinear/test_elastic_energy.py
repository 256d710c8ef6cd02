"""Energy of the event-driven plant: balanced to 1e-9, each place with its own line, no loss ever falling."""

import numpy as np
import pytest

from actuator_lti.design.model import Design
from nonlinear import commands, simulate
from nonlinear._kernels import layout
from tests.nonlinear.elastic_drive import drive_f, random_drive, run_plant

LOSSES = [
    layout.ENERGY_COPPER,
    layout.ENERGY_DRY,
    layout.ENERGY_VISCOUS,
    layout.ENERGY_DAMPING,
    layout.ENERGY_PARTING,
    layout.ENERGY_LOAD_DRY,
    layout.ENERGY_LOAD_VISCOUS,
]
SPENT = [
    *LOSSES,
    layout.ENERGY_OFFSET,
    layout.ENERGY_LOAD,
    layout.ENERGY_CONVERSION,
    layout.ENERGY_LOAD_OFFSET,
]


def stored(design: Design, x: np.ndarray) -> float:
    """Energy in the inductance, both inertias and the spring, of (i, w, W, th, phi)."""
    i, w, W, th, phi = x
    coupling, L = design.coupling, design.motor.inductance_H or 0.0
    stretch = max(0.0, abs(th / design.ratio_to_coupling - phi) - coupling.play_rad / 2)
    kinetic = design.motor_side_inertia_kgm2 * w * w + design.load_side_inertia_kgm2 * W * W
    return 0.5 * (L * i * i + kinetic + coupling.stiffness_Nm_rad * stretch * stretch)


@pytest.mark.parametrize("seed", range(60))
def test_balance_and_passivity(seed: int) -> None:
    design, voltages, moments, fraction = random_drive(seed)
    run = run_plant(design, voltages, moments, fraction_s=fraction, WITH_ENERGY=1.0)
    assert run.status == layout.OK
    e = run.ledgers
    change = np.array([stored(design, x) for x in run.states])
    largest = max(np.abs(e).max(), change.max())
    error = e[:, layout.ENERGY_INPUT] - change - e[:, SPENT].sum(axis=1)
    assert np.abs(error).max() < 1e-11 * largest
    assert np.diff(e[:, LOSSES], axis=0).min() >= -1e-15 * largest


@pytest.mark.parametrize("seed", range(20))
def test_energies_do_not_change_the_motion(seed: int) -> None:
    """The short way and the ledger's way walk the same segments differently."""
    design, voltages, moments, fraction = random_drive(seed)
    with_energy = run_plant(design, voltages, moments, fraction_s=fraction, WITH_ENERGY=1.0)
    without = run_plant(design, voltages, moments, fraction_s=fraction)
    scale = np.abs(without.states).max(axis=0)
    assert np.all(np.abs(with_energy.states - without.states) <= 1e-10 * scale)
    assert with_energy.events == without.events


def test_trajectory_names_each_share() -> None:
    energy = simulate(drive_f(), commands.step(0.1), 0.1, energy=True).energy
    assert energy.relative_error < 1e-9
    assert energy.coupling_damping_J > 1e-5
    assert energy.parting_J > 1e-7
    assert energy.load_dry_friction_J == 0.0
