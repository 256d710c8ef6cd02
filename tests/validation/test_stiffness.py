"""Stiffness at the output: published digits, closed forms, and the same seen by the simulator."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.batch import Population
from actuator_lti.batch import drive_figures as many
from actuator_lti.design import load_design, with_overrides, write_design
from actuator_lti.design.model import Gravity, Load
from actuator_lti.drive.facts import resonance_rad_s
from actuator_lti.loops import assemble_loops
from actuator_lti.loops.stiffness import compliance, lost_motion_rad, stiffness_at
from analyses.stiffness import check_stiffness, stiffness, stiffness_at_rest, stiffness_curves
from analyses.stiffness.run import lost_motion_simulated
from nonlinear import commands, simulate
from nonlinear.loads import series
from reports.charts.svg import draw_svg
from reports.sections.stiffness import section
from tests.changed import changed
from tests.loops.loop_designs import drive_e
from tests.nonlinear.elastic_drive import stribeck

FIN, COMPLIANT = load_design("fin"), load_design("ilr33-amber-compliant")
K4 = [(1, 16.9017216631, -53.84128746), (20, 67.434351877, 146.7856309), (80, 729.024662292, 99.71033514)]


def test_k4_by_the_loops_and_by_the_simulator() -> None:
    checks = check_stiffness(drive_e(), [frequency for frequency, _, _ in K4])
    loops = assemble_loops(drive_e())
    for (frequency, size, angle), check in zip(K4, checks, strict=True):
        K = stiffness_at(compliance(drive_e()), frequency)[0]
        of_loops = 1 / loops.load_torque_to_output(np.exp(2j * np.pi * frequency * 2e-4))
        for found, within in ((K, 1e-10), (of_loops, 1e-10), (check.simulated_Nm_rad, 1e-9)):
            assert abs(found) == pytest.approx(size, rel=within)
            assert np.angle(found, deg=True) == pytest.approx(angle, abs=1e-7)


def test_the_fin_by_hand() -> None:
    """N^2 kM Kp Kv / (R (1 +- CM N)) less the slope: P controllers, the output's sensor; less is judged."""
    *powered, shorted, open_winding = stiffness_curves(FIN)
    by_hand = [60**2 * 0.03 * 0.12 * 110 / (1.0 * (1 + way * 1.7e-3 * 60)) + 30 for way in (1, -1)]
    assert [one.static_Nm_rad for one in powered] == pytest.approx(by_hand, rel=1e-6)
    assert [one.way for one in powered] == ["driving", "driven"]
    assert drive_figure(FIN, "static_stiffness") == pytest.approx(by_hand[0], rel=1e-6)
    assert [shorted.static_Nm_rad, open_winding.static_Nm_rad] == pytest.approx([30.0, 30.0], rel=1e-6)


@pytest.mark.parametrize("derivative", [0.0, 1e-3])
@pytest.mark.parametrize("efficiency", [0.4, 0.62])
def test_the_simulator_checks_the_stiffness_that_is_quoted(efficiency: float, derivative: float) -> None:
    """Behind a gear of this efficiency, CM N = 1/eta - 1: below one half no load moves the motor."""
    position = {"derivative_time_s": derivative, "derivative_filter_s": 2e-3}
    lossy = {"load_coefficient": (1.0 / efficiency - 1.0) / 60}
    design = changed(FIN, friction=lossy, controller={"position": position})
    ways = ["driving", "driven"][: 1 + (efficiency > 0.5)]
    powered = [one for one in stiffness_curves(design) if one.state == "powered"]
    checks = check_stiffness(design, [2.0, 50.0])
    assert [one.way for one in powered] == ways
    assert [check.way for check in checks] == [way for way in ways for _ in (2.0, 50.0)]
    for check in checks:
        curve = powered[ways.index(check.way)]
        at = np.interp(check.frequency_hz, curve.frequency_hz, abs(curve.stiffness_Nm_rad))
        assert abs(check.simulated_Nm_rad) == pytest.approx(at, rel=1e-3)  # the curve is drawn at points
        assert check.difference < 1e-8
    least = min(curve.least[0] for curve in powered)
    assert drive_figure(design, "least_stiffness") == pytest.approx(least, rel=1e-9)
    shares = np.array([0.9, 1.0, 1.1])  # of many at once, some of which a load moves
    values = shares * design.friction.load_coefficient
    found = many(Population(design, {"friction.load_coefficient": values}, 3), "least_stiffness")
    alone = [changed(design, friction={"load_coefficient": value}) for value in values]
    assert found == pytest.approx([drive_figure(one, "least_stiffness") for one in alone], rel=1e-9)


@pytest.mark.parametrize("integral_s", [None, 0.6])
@pytest.mark.parametrize("loss", [0.0, 1.5e-3])
@pytest.mark.parametrize(
    "slopes",
    [{"points": stribeck((0.0, 0.06), (5.0, 0.045), (300.0, 0.13))}, {"viscous_reverse_Nms_rad": 2e-3}],
)
def test_friction_of_several_slopes_is_checked_on_its_first(
    slopes: dict[str, Any], loss: float, integral_s: float | None
) -> None:
    """A link under gravity creeps, the twist of its pressed spring in the angle that is commanded."""
    friction, position = {"load_coefficient": loss, **slopes}, {"integral_time_s": integral_s}
    design = changed(load_design("joint"), friction=friction, controller={"position": position})
    assert max(check.difference for check in check_stiffness(design, [2.0, 10.0])) < 1e-8


@pytest.mark.parametrize("name", ["ballscrew", "ilr33-amber", "ilr33-amber-multirate"])
def test_a_speed_drive_holds_by_the_integral_of_its_speed(name: str) -> None:
    """kM Kp/Tn at the motor, the spring behind it; a sum of differences is the angle itself."""
    open_position = {"controller": {"position": None}, "load": {"path": "back-drivable"}, "requirements": ()}
    encoder = {"speed": "difference", "counts_per_rev": 4096}
    design = changed(load_design(name), encoder=encoder, friction={"load_coefficient": 0.0}, **open_position)
    velocity, kM = design.controller.velocity, design.effective_motor.torque_constant_Nm_A
    compliance_rad_Nm = velocity.integral_time_s / (kM * velocity.gain * design.total_ratio**2)
    spring = 0.0 if design.coupling is None else 1.0 / design.coupling.stiffness_Nm_rad
    found = drive_figure(design, "static_stiffness")
    assert found == pytest.approx(1.0 / (compliance_rad_Nm + spring), rel=1e-9)


def test_an_integral_on_the_output_comes_back_and_a_self_locking_gear_does_not_move() -> None:
    assert stiffness_curves(load_design("joint"))[0].static_Nm_rad == float("inf")
    rigid = stiffness(load_design("ilr33-amber"))
    assert all(curve.static_Nm_rad == float("inf") for curve in rigid.curves)
    assert rigid.lost_motion is None
    # pushed, and not moved
    assert [check.simulated_Nm_rad for check in rigid.checks] == 3 * [complex(np.inf)]
    assert rigid.verdict == "met"
    moved = replace(rigid.checks[0], simulated_Nm_rad=1e9 + 0j)
    assert replace(rigid, checks=(moved,)).verdict == "not met"
    compliant = stiffness_curves(COMPLIANT)[0]
    assert compliant.static_Nm_rad == pytest.approx(1500.0, rel=1e-6)  # the shaft behind the worm


@pytest.mark.parametrize("name", ["joint", "ballscrew", "fin", "ilr33-amber-compliant", "emps"])
def test_the_simulator_confirms_every_shipped_design(name: str) -> None:
    result = stiffness(load_design(name))
    assert len(result.checks) == 3 * len({one.way for one in result.curves if one.state == "powered"})
    assert max(check.difference for check in result.checks) < 1e-6
    assert result.passed
    wrong = replace(result.checks[0], predicted_Nm_rad=1.00001 * result.checks[0].predicted_Nm_rad)
    assert not replace(result, checks=(wrong,)).passed


@pytest.mark.parametrize(
    ("play", "dry"), [*((play, dry) for play in (0.0, 2e-4, 3e-3) for dry in (0.02, 0.5))]
)
def test_lost_motion_is_read_at_3_percent_of_the_rated_moment(play: float, dry: float) -> None:
    """0.36 N m of 12: play and 2 m/k, whatever the load's friction, so never below the play."""
    assert FIN.load.moment_max_Nm == 12.0
    friction = {"dry_torque_Nm": dry, "breakaway_ratio": 1.5, "offset_torque_Nm": 0.1}
    design = changed(FIN, coupling={"play_rad": play}, load={"friction": friction})
    expected = play + 2 * 0.36 / 800.0
    assert lost_motion_rad(design) == pytest.approx(expected, rel=1e-12)
    assert drive_figure(design, "lost_motion") == pytest.approx(np.degrees(expected), rel=1e-12)
    assert lost_motion_simulated(design) == pytest.approx(expected, rel=1e-6)
    heavy = changed(COMPLIANT, load={"friction": {"dry_torque_Nm": 40.0 * dry}})  # the worm's, 0.8 to 20 N m
    expected = 1e-3 + 2 * 0.03 * heavy.load.moment_max_Nm / heavy.coupling.stiffness_Nm_rad
    assert lost_motion_simulated(heavy) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("moment", [0.5, 2.0, 8.0])
def test_at_rest_play_softens_small_moments(moment: float) -> None:
    """A held motor, no friction: deflection b sgn(M) + M/k, so 1/K = 1/k + 4 b/(pi M) of the fundamental."""
    (result,) = stiffness_at_rest(changed(COMPLIANT, load={"friction": None}), [(0.5, moment)])
    by_hand = 1.0 / (1.0 / 1500.0 + 4 * 0.5e-3 / (np.pi * moment))
    assert abs(result.simulated_Nm_rad) == pytest.approx(by_hand, rel=0.01)


def test_at_rest_a_slow_integral_is_waited_for() -> None:
    """Without friction and counts it is the linear stiffness; 6 periods of 20 Hz are 0.3 s of 4."""
    bare, uncounted = {"friction": None, "gravity": None}, {"counts_per_rev": None}
    smooth = {"dry_torque_Nm": 0.0, "load_coefficient": 0.0}
    design = changed(
        load_design("joint"), friction=smooth, load=bare, encoder=uncounted, output_encoder=uncounted
    )
    (result,), (check,) = stiffness_at_rest(design, [(20.0, 1.0)]), check_stiffness(design, (20.0,))
    assert result.simulated_Nm_rad == pytest.approx(check.predicted_Nm_rad, rel=1e-4)


def test_at_rest_a_drive_that_hunts_has_no_stiffness_of_its_own() -> None:
    """A second integral makes the joint stick and slip: under 6 N m each period of the load is another."""
    design = changed(load_design("joint"), controller={"velocity": {"integral_time_s": 0.02}})
    (hunts,), (moves,) = (stiffness_at_rest(design, [(2.0, moment)]) for moment in (6.0, 20.0))
    t = np.arange(0.0, 10.0, design.controller.period_s)
    for moment, found in ((6.0, hunts), (20.0, moves)):
        load = series(t, moment * np.sin(4.0 * np.pi * t))
        y = simulate(design, commands.hold(), t.size * design.controller.period_s, load).output_angle_rad
        seen = np.abs((y.reshape(20, -1) @ np.exp(-2j * np.pi * np.arange(8000) / 8000))[-4:])
        assert np.isnan(found.simulated_Nm_rad) == (np.ptp(seen) > 0.02 * seen.max())
    assert np.isnan(hunts.simulated_Nm_rad)


@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_at_rest_dry_friction_holds_a_small_moment(mass: float) -> None:
    """Less than the load's dry friction, 0.05 N m, moves it neither in the gap nor bent by a weight."""
    weight = Gravity(mass_kg=mass, arm_m=0.3, offset_rad=np.pi / 2) if mass else None
    (result,) = stiffness_at_rest(changed(COMPLIANT, load={"gravity": weight}), [(2.0, 0.04)])
    assert result.simulated_Nm_rad == complex(np.inf)


def test_command_section_and_figure(cli) -> None:
    told = cli.data("stiffness", "fin")
    assert told["passed"] is True
    assert [curve["state"] for curve in told["curves"]] == ["powered", "powered", "shorted", "open"]
    assert told["lost_motion"]["play_rad"] == 1.5e-3
    assert "infinite" in cli.text("stiffness")
    figure = next(block for block in section(stiffness(FIN))["blocks"] if block["kind"] == "figure")
    assert "<svg" in draw_svg(figure, page=False)
    locked = section(stiffness(load_design("ilr33-amber"), simulated=False))
    assert locked["result"].startswith("A load torque")


def test_without_a_position_loop_nothing_is_proven_and_that_is_no_pass(tmp_path, cli) -> None:
    bare = changed(FIN, controller={"position": None}, requirements=())
    (tmp_path / "speed.toml").write_text(write_design(bare), encoding="utf-8")
    first = cli.text("stiffness", tmp_path / "speed.toml", status=1).splitlines()[0]
    assert first.startswith("NOT PROVEN  ")
    assert first.endswith("nothing is compared: no position loop holds the output.")
    first = cli.text("stiffness", "fin").splitlines()[0]
    assert re.search(r"small loads at 3 frequencies agree to \S+, allowed 10⁻⁶, the lost motion to", first)


def test_the_least_stiffness_is_never_above_the_static_one() -> None:
    """A shorted winding damps a spring of 40 N m/rad: stiffer at every frequency than at rest."""
    *_, shorted, _ = stiffness_curves(FIN)
    assert abs(FIN.load.moment_slope_Nm_rad) == pytest.approx(shorted.static_Nm_rad, rel=1e-3)
    assert shorted.least == (shorted.static_Nm_rad, 0.0)
    curves = stiffness_curves(drive_e())  # a velocity integral holds the motor, or nothing does
    assert [curve.static_Nm_rad for curve in curves] == [pytest.approx(400.0, rel=1e-6), 0.0, 0.0]
    assert all(curve.least[0] <= curve.static_Nm_rad for curve in curves)


@pytest.mark.parametrize("phase", [0.0, np.pi])
@pytest.mark.parametrize("slope", [-5.0, 0.0, 5.0])
def test_unpowered_cogging_and_the_moment_push_away_or_hold(phase: float, slope: float) -> None:
    """At angle 0: -N^2 tau Z cos(phase) - slope of a rigid drive, shorted and open."""
    motor = {"cogging_Nm": 0.02, "cogging_periods": 12.0, "cogging_phase_rad": phase}
    load = Load(inertia_kgm2=1e-3, path="back-drivable", moment_slope_Nm_rad=slope)
    design = changed(drive_e(), motor=motor, load=load, coupling=None)
    by_hand = -(10.0**2) * 0.02 * 12 * np.cos(phase) - slope
    _, shorted, open_winding = stiffness_curves(design)
    assert [shorted.static_Nm_rad, open_winding.static_Nm_rad] == pytest.approx(2 * [by_hand], rel=1e-6)
    if by_hand < 0.0:
        assert open_winding.least == (open_winding.static_Nm_rad, 0.0)
        (table,) = [one for one in section(stiffness(design, simulated=False))["blocks"] if "rows" in one]
        assert "Below 0" in table["note"]


@pytest.mark.parametrize("spring", [30.0, 2000.0])
def test_the_least_stiffness_of_a_weakly_damped_mass_is_no_number_of_a_grid(spring: float) -> None:
    """A held moment on J, B and a spring that acts at every instant: nothing samples where no loop runs."""
    load = Load(inertia_kgm2=1e-3, path="back-drivable", moment_slope_Nm_rad=-spring)
    design = changed(drive_e(), load=load, coupling=None, friction={"viscous_Nms_rad": 2e-6})
    J, T = 1e-3 + 10.0**2 * design.motor.rotor_inertia_kgm2, design.controller.period_s
    B = 10.0**2 * 2e-6
    Phi = expm(np.array([[0.0, T, 0.0], [-spring / J * T, -B / J * T, T / J], [0.0, 0.0, 0.0]]))

    def size(w: float) -> float:
        z = np.exp(1j * w * T)
        return float(1.0 / abs(np.linalg.solve(z * np.eye(2) - Phi[:2, :2], Phi[:2, 2])[0]))

    w = np.sqrt(spring / J)
    truth = minimize_scalar(size, bounds=(0.95 * w, 1.05 * w), method="bounded", options={"xatol": 1e-9 * w})
    assert truth.fun == pytest.approx(B * w, rel=(w * T) ** 2)  # of an instant: sqrt(1 - zeta^2) of this
    least, hertz = stiffness_curves(design)[2].least
    assert least == pytest.approx(truth.fun, rel=1e-6)
    assert hertz == pytest.approx(truth.x / (2.0 * np.pi), rel=1e-6)


@pytest.mark.parametrize("arm", np.linspace(0.1, 3.0, 30))
def test_the_least_stiffness_of_an_undamped_mass_is_none(arm: float) -> None:
    """An unpowered pendulum without friction swings by itself; some meet the pole to the last bit."""
    load = Load(
        inertia_kgm2=1e-3, path="back-drivable", gravity=Gravity(mass_kg=0.1, arm_m=arm, offset_rad=np.pi)
    )
    design = changed(drive_e(), load=load, coupling=None, friction={"viscous_Nms_rad": 0.0})
    J = 1e-3 + 10.0**2 * design.motor.rotor_inertia_kgm2
    least, hertz = stiffness_curves(design)[2].least
    assert least < 1e-9 * 0.1 * 9.80665 * arm
    assert hertz == pytest.approx(np.sqrt(0.1 * 9.80665 * arm / J) / (2.0 * np.pi), rel=1e-6)


def test_a_load_chooses_the_piece_of_a_spring_that_bends() -> None:
    """A velocity integral holds the motor: K1 at rest, K3 beyond torque_2, less the slope of the moment."""
    bends = {"torque_1_Nm": 2.0, "stiffness_2_Nm_rad": 600.0, "torque_2_Nm": 5.0, "stiffness_3_Nm_rad": 900.0}
    validation, load = {"loads_Nm": (0.0, 1.0, -8.0)}, {"moment_slope_Nm_rad": 30.0}
    design = changed(drive_e(), coupling=bends, validation=validation, load=load)
    powered = [curve for curve in stiffness_curves(design) if curve.state == "powered"]
    assert [curve.load_Nm for curve in powered] == [0.0, -8.0]
    assert [curve.static_Nm_rad for curve in powered] == pytest.approx([370.0, 870.0], rel=1e-6)
    rising = resonance_rad_s(design, -8.0) / resonance_rad_s(design)
    assert rising == pytest.approx(np.sqrt(900.0 / 400.0), rel=1e-12)
    made = section(stiffness(design, simulated=False))
    assert made["result"].startswith("Powered, 0 N m, the static stiffness is 370")
    for load_Nm, value in ((0.0, 370.0), (8.0, 870.0)):
        assert drive_figure(design, "static_stiffness", load_Nm) == pytest.approx(value, rel=1e-6)
        K = np.array([300.0, 420.0])  # of many at once
        path = {0.0: "coupling.stiffness", 8.0: "coupling.stiffness_3"}[load_Nm]
        found = many(Population(design, {path: K}, 2), "static_stiffness", load_Nm)
        assert found == pytest.approx(K - 30.0, rel=1e-6)


def test_a_slow_tick_ends_the_curve_below_nyquist() -> None:
    """A free mass under a held moment has its sampled zero at z = -1: an infinite stiffness there is none."""
    free = Load(inertia_kgm2=1e-3, path="back-drivable")
    slow = with_overrides(FIN, {"control.period": "3 ms"})
    design = changed(slow, load=free, coupling=None, friction={"viscous_Nms_rad": 0.0})
    rate = 1.0 / design.controller.period_s
    for curve in stiffness_curves(design):
        assert curve.frequency_hz[-1] == pytest.approx(0.45 * rate)
    open_winding = stiffness_curves(design)[2]
    w = 2 * np.pi * open_winding.frequency_hz[0]
    inertia = 1e-3 + design.total_ratio**2 * design.motor_side_inertia_kgm2
    assert abs(open_winding.stiffness_Nm_rad[0]) == pytest.approx(inertia * w**2, rel=1e-3)
    made = section(stiffness(design))
    (figure,) = [block for block in made["blocks"] if block["kind"] == "figure"]
    assert "unpowered" in draw_svg(figure, page=False)
