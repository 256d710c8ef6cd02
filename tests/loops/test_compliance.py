"""Compliance and stiffness, the torque margin: figures that a requirement names, of one and of many."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design, read_design_text
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.batch import Population
from actuator_lti.batch import drive_figures as many
from actuator_lti.design.model import Requirement
from actuator_lti.loops.stiffness import StiffnessFigures, compliance
from analyses import evaluate_requirements
from nonlinear import commands, simulate
from tests.changed import changed
from tests.loops.two_mass import drive_e

SLOW = """
[design]
name = "slow"
[motor]
rotor_inertia = "1e-3 kg*m^2"
resistance = "0.6 ohm"
inductance = "5 mH"
torque_constant = "0.75 N*m/A"
back_emf_constant = "0.75 V*s/rad"
[[gear]]
name = "g"
ratio = 1.0
[load]
inertia = "1e-4 kg*m^2"
path = "back-drivable"
[friction]
law = "coulomb"
[encoder]
speed = "ideal"
[limits]
voltage = "24 V"
[control]
period = "1 ms"
computing_delay = "0 s"
[control.position]
gain = "1e-5 V/rad"
"""
AMBER = load_design("ilr33-amber").with_values({"friction.breakaway_ratio": 1.3})


@pytest.mark.parametrize("name", ["joint", "ballscrew", "fin", "ilr33-amber-compliant", "emps"])
def test_the_periodic_response_is_that_of_the_time_invariant_system(name: str) -> None:
    """Two derivations: M ticks followed one after the other, and one system of M n states."""
    loops, result = assemble_loops(load_design(name)), compliance(load_design(name))
    z = np.exp(2j * np.pi * np.geomspace(0.1, 1000.0, 30) * result.period_s)
    lifted = loops.moment_to_output
    assert np.abs(result(z) / lifted(z) - 1.0).max() < 1e-9
    assert result.slowest == pytest.approx(np.abs(lifted.poles()).max(), rel=1e-9)


@pytest.mark.parametrize(
    ("name", "values", "quantities"),
    [
        ("ballscrew", {"coupling.stiffness": [4e7, 1e8, 3e8], "control.position.gain": [20.0, 60.0, 90.0]},
         ("static_stiffness", "least_stiffness", "lost_motion")),
        # delays of whole and broken ticks, damping of zero: other states, other zeros, taken group by group
        ("fin",
         {"control.computing_delay": [0.0, 1e-4, 2e-4, 5e-4], "coupling.damping": [0.0, 0.05, 0.05, 0.0]},
         ("least_stiffness",)),
    ],
)  # fmt: skip
def test_stacked_designs_have_the_figures_of_each_alone(name, values, quantities):
    design, count = load_design(name), len(next(iter(values.values())))
    stacked = {path: np.array(each) for path, each in values.items()}
    for quantity in quantities:
        together = many(Population(design, stacked, count), quantity)
        for k in range(count):
            alone = Population(design, {path: each[k : k + 1] for path, each in stacked.items()}, 1)
            assert together[k] == pytest.approx(many(alone, quantity)[0], rel=1e-9)


def test_static_stiffness_by_hand() -> None:
    """P on the motor's sensor, a velocity integral: the spring alone, 400 N m/rad; a rigid one comes back."""
    assert drive_figure(drive_e(), "static_stiffness") == pytest.approx(400.0, rel=1e-6)
    assert StiffnessFigures(replace(drive_e(), coupling=None)).static_stiffness_Nm_rad == np.inf
    stiff = [
        Requirement(id=str(limit), quantity="static_stiffness", unit="N*m/rad", minimum=limit)
        for limit in (399.0, 401.0)
    ]
    verdicts = evaluate_requirements(replace(drive_e(), requirements=tuple(stiff)))
    assert [one.verdict for one in verdicts] == ["met", "not met"]


def test_a_drive_that_creeps_for_hours_has_a_stiffness_and_one_without_position_loop_none() -> None:
    """P on voltage: Kp kM N^2/R, here with a time constant kE kM/R over that of a day."""
    slow = read_design_text(SLOW)
    assert drive_figure(slow, "static_stiffness") == pytest.approx(1e-5 * 0.75 / 0.6, rel=1e-6)
    velocity = SLOW.replace("[control.position]", "[control.velocity]").replace("1e-5 V/", "1e-2 V*s/")
    free = read_design_text(velocity)
    assert drive_figure(free, "static_stiffness") == 0.0


def test_lost_motion_is_a_requirement() -> None:
    """The fin has 1.5 mrad of play and 2 * 0.36/800 rad of twist."""
    lost = Requirement(id="lost", quantity="lost_motion", unit="deg", maximum=0.2, load_Nm=8.0)
    (result,) = evaluate_requirements(replace(load_design("fin"), requirements=(lost,)))
    assert result.value == pytest.approx(np.degrees(1.5e-3 + 2 * 0.36 / 800.0), rel=1e-12)
    assert result.verdict == "met"


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
