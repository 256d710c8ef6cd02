"""Compliance and stiffness, the torque margin: figures that a requirement names, of one and of many."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.batch import Population
from actuator_lti.batch import drive_figures as many
from actuator_lti.design import load_design
from actuator_lti.design.model import Design, Requirement
from actuator_lti.loops import assemble_loops
from actuator_lti.loops.stiffness import StiffnessFigures, compliance
from analyses.specification.requirements import evaluate_requirements
from nonlinear import commands, simulate
from tests.loops.two_mass import drive_e


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
def test_stacked_designs_have_the_figures_of_each_alone(
    name: str, values: dict[str, list[float]], quantities: tuple[str, ...]
) -> None:
    design, count = load_design(name), len(next(iter(values.values())))
    stacked = {path: np.array(each) for path, each in values.items()}
    for quantity in quantities:
        together = many(Population(design, stacked, count), quantity)
        for k in range(count):
            alone = Population(design, {path: each[k : k + 1] for path, each in stacked.items()}, 1)
            assert together[k] == pytest.approx(many(alone, quantity)[0], rel=1e-9)


def test_static_stiffness_by_hand() -> None:
    """P on the motor's sensor with an integral in the velocity loop: the spring alone, 400 N m/rad; a rigid
    one comes back."""
    assert drive_figure(drive_e(), "static_stiffness") == pytest.approx(400.0, rel=1e-6)
    assert StiffnessFigures(replace(drive_e(), coupling=None)).static_stiffness_Nm_rad == np.inf


def test_requirements_on_stiffness_and_lost_motion() -> None:
    """K of drive E is 400 N m/rad; the fin has 1.5 mrad of play and 2 * 0.36/800 rad of twist."""
    stiff = [
        Requirement(id="soft", quantity="static_stiffness", unit="N*m/rad", minimum=399.0),
        Requirement(id="stiff", quantity="static_stiffness", unit="N*m/rad", minimum=401.0),
    ]
    verdicts = evaluate_requirements(replace(drive_e(), requirements=tuple(stiff)))
    assert [one.verdict for one in verdicts] == ["met", "not met"]
    lost = Requirement(id="lost", quantity="lost_motion", unit="deg", maximum=0.2, load_Nm=8.0)
    (result,) = evaluate_requirements(replace(load_design("fin"), requirements=(lost,)))
    assert result.value == pytest.approx(np.degrees(1.5e-3 + 2 * 0.36 / 800.0), rel=1e-12)
    assert result.verdict == "met"


AMBER = load_design("ilr33-amber").with_values({"friction.breakaway_ratio": 1.3})


def test_by_hand() -> None:
    """kM i_peak (or kM U/R) over CM |M| passed to the motor, breakaway on the dry part alone."""
    friction, motor, limits = AMBER.friction, AMBER.motor, AMBER.limits
    torque = motor.torque_constant_Nm_A * min(limits.peak_current_A, limits.voltage_V / motor.resistance_ohm)
    dry = friction.dry_torque_Nm + friction.load_coefficient * 4.0
    held = dry * friction.breakaway_ratio + abs(friction.offset_torque_Nm)
    if AMBER.load.path == "back-drivable":
        held += 4.0 / AMBER.total_ratio
    assert drive_figure(AMBER, "torque_margin", 4.0) == pytest.approx(torque / held, rel=1e-12)


def weak(design: Design, load_Nm: float, margin: float) -> Design:
    """The same drive with a current limit that gives it this margin."""
    torque = drive_figure(design, "torque_margin", load_Nm)
    peak = design.limits.peak_current_A * margin / torque
    return replace(design, limits=replace(design.limits, peak_current_A=float(peak)))


@pytest.mark.parametrize("load_Nm", [0.0, 1.0, 6.0])
@pytest.mark.parametrize(("margin", "moves"), [(0.98, False), (1.02, True)])
def test_the_simulator_starts_above_one(load_Nm: float, margin: float, moves: bool) -> None:
    """A large step in the worse direction, within a voltage that is no limit."""
    base = replace(AMBER, limits=replace(AMBER.limits, peak_current_A=1.0))
    design = weak(base, load_Nm, margin)
    assert drive_figure(design, "torque_margin", load_Nm) == pytest.approx(margin, rel=1e-9)
    starts = []
    for sign in (1.0, -1.0):
        run = simulate(design, commands.step(sign * 0.2), duration_s=0.3, load_Nm=-sign * load_Nm)
        starts.append(bool(np.abs(run.motor_speed_rad_s).max() > 1e-6))
    assert all(starts) is moves
