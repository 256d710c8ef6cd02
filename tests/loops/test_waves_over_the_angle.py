"""Torques that bend with the angle or go with the speed of the load: closed forms of both writings."""

import re
from dataclasses import dataclass, replace
from math import asin, cos, pi, sin, sqrt

import numpy as np
import pytest
from loop_designs import controlled, source_drive

from actuator_lti import InputError, assemble_loops, load_design, write_design
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import model, read_design_text
from actuator_lti.design.plant import reachable_speed
from actuator_lti.drive.facts import breakaway_torque_Nm, capability
from actuator_lti.drive.operating import Operating, follows_angle, level, straight
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.assemble import loops_at
from actuator_lti.loops.tick import Tick, TickProgram
from analyses.linear.loop_survey import operating_points
from analyses.specification.requirements import evaluate_requirements
from analyses.validation.places import Bench
from analyses.validation.small_signal import small_signal
from nonlinear import State, commands, simulate
from nonlinear.bench.operating_motion import operating_motion
from tests.changed import changed

J, N, Ts, A, PHASE = 2e-5, 8.0, 1e-4, 4e-3, 2.5
HELD = r" = .*: held over a tick,? .*; allowed: at most"
D = 3.0  # N m s/rad


@dataclass(frozen=True)
class Case:
    """An effect of peak A at the motor; ``order`` periods in a turn of the motor."""

    name: str
    order: float

    def torque(self, angle: float) -> float:
        return A * sin(self.order * angle + PHASE)

    @property
    def stable(self) -> float:
        """The angle of the motor nearest to zero at which it holds the rotor."""
        return (pi - PHASE) / self.order

    def put(self, design: model.Design) -> model.Design:
        part, key, N_ = ("motor", "cogging", 1.0) if self.name == "cogging" else ("load", "gear_error", N)
        waves = {f"{key}_Nm": A * N_, f"{key}_periods": self.order * N_, f"{key}_phase_rad": PHASE}
        return changed(design, **{part: waves})


CASES = [Case("gear error", 24.0 / N), Case("cogging", 12.0)]
each = pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)


def rotor(viscous=0.0, load_coefficient=0.0, path="back-drivable", damping=0.0) -> model.Design:
    """A torque source without a controller, so that the rotor coasts."""
    load, gears = {"path": path, "moment_damping_Nms_rad": damping}, (model.Gear(name="one", ratio=N),)
    friction = {"viscous_Nms_rad": viscous, "load_coefficient": load_coefficient}
    return source_drive(J, 1.0, Ts, 10.0, gears=gears, load=load, friction=friction)


def tick(design: model.Design, **at: object) -> Tick:
    """The linear map of a tick of a drive without a controller."""
    return TickProgram(wire(design, Operating(**at)), "voltage").tick(0)


@each
def test_at_every_instant_it_is_a_spring_that_keeps_its_energy(case: Case) -> None:
    """As in the motor: poles exp(+-j omega Ts), omega = sqrt(A Z/J)."""
    poles = np.linalg.eigvals(tick(case.put(rotor()), angle_rad=case.stable / N, torques_at_once=True).A)
    assert np.abs(poles) == pytest.approx(1.0, abs=1e-12)
    assert np.max(np.angle(poles)) == pytest.approx(sqrt(A * case.order / J) * Ts, rel=1e-9)


@each
def test_a_speed_drive_is_one_in_motion_but_at_rest(case: Case) -> None:
    """A P loop against viscous friction has Kp/(Kp + Cv) at DC as it runs, none in a notch."""
    plain = rotor(viscous=1e-3)
    design = case.put(controlled(plain, velocity=model.VelocityLoop(gain=4e-3), position=None))
    z = np.exp(1j * 1e-9)
    sliding, rest = (assemble_loops(design, operating_point=at).velocity for at in ("sliding", "rest"))
    assert abs(sliding.closed_loop(z)) == pytest.approx(0.8, rel=1e-6)
    assert abs(rest.closed_loop(z)) < 1e-3
    speed = simulate(design, commands.step(100.0 / N), 2.0).motor_speed_rad_s
    assert np.mean(speed[10000:]) == pytest.approx(0.8 * 100.0, rel=1e-3)
    assert {row.verdict for row in small_signal(Bench(design, design).place("velocity"))} == {Verdict.MET}


@each
def test_it_is_asked_without_its_name(case: Case) -> None:
    plain = rotor()
    design = case.put(plain)
    assert follows_angle(design)
    for other in (plain, level(design), straight(design)):
        assert not follows_angle(other)
    assert np.array_equal(tick(design, torques_held=True).A, tick(plain).A)


@each
def test_the_drive_must_get_over_its_peak(case: Case) -> None:
    dry = replace(rotor(), friction=model.Friction(dry_torque_Nm=3e-3))
    design = case.put(dry)
    assert breakaway_torque_Nm(design, 0.0, 1) == pytest.approx(3e-3 + A, rel=1e-12)
    assert capability(design).torque_margin == pytest.approx(10.0 / (3e-3 + A), rel=1e-12)
    assert capability(design).output_rate_rad_s == capability(dry).output_rate_rad_s


@pytest.mark.parametrize("name", ["load.gear_error", "motor.cogging"])
def test_keys_of_a_wave(name: str) -> None:
    fin, part, peak = load_design("fin"), name.partition(".")[0], 0.1 if name.startswith("load") else 5e-3
    values = {name: f"{peak} N*m", f"{name}_periods": 3, f"{name}_phase": "90 deg"}
    design = fin.with_values(values)
    other, own = (getattr(each, part).over_angle.at(0.2) for each in (fin, design))
    assert own - other == pytest.approx(peak * cos(0.6), rel=1e-12)
    assert getattr(read_design_text(write_design(design)), part) == getattr(design, part)
    fastest = reachable_speed(fin) / (fin.total_ratio if part == "load" else 1.0)
    most = 0.5 / (fastest * fin.controller.period_s)
    for factor in (1e3, 1.25):
        values |= {f"{name}_periods": f"{factor * most} rad/rad"}
        with pytest.raises(InputError, match=f"{name}_periods{HELD}") as refused:
            fin.with_values(values)
        assert f"passes {0.5 * factor:.3g} rad at" in str(refused.value)  # in the measure of model.md
        assert ", more than 0.5;" in str(refused.value)
    takes = dict(re.findall(r"(control\.period|limits\.speed) = (\S+ \S+)", str(refused.value)))
    for key in ("control.period", "limits.speed"):  # either takes it
        fin.with_values({**values, key: takes[key]})


def test_keys_of_a_moment() -> None:
    fin = load_design("fin")
    for key, value in (("load.gear_error", "0.1 N*m"), ("load.moment_damping", "0.01 N*m*s/rad")):
        load = fin.with_values({key: value}).load
        assert key in load.acting()
        assert not load.bare().acting()
    with pytest.raises(InputError, match=f"load.moment_damping{HELD}"):
        fin.with_values({"load.moment_damping": "1e6 N*m*s/rad"})
    with pytest.raises(InputError, match=r"load\.gear_error_periods = .* limits\.speed; allowed"):
        load_design("emps").with_values({"load.gear_error": "1 N", "load.gear_error_periods": "600 rad/m"})


def test_cogging_of_a_screw_is_over_the_angle_of_its_motor() -> None:
    cogging = {"motor.cogging": "5 mN*m", "motor.cogging_periods": "5 rad/rad"}
    screw = load_design("ballscrew").with_values(cogging)
    travel = screw.screw.travel_m_rad
    assert screw.motor.over_angle.at(0.3 * travel) == pytest.approx(5e-3 / travel * sin(5 * 0.3), rel=1e-9)


def test_a_self_locking_drive_feels_its_cogging() -> None:
    """It holds the rotor against a torque below its peak, whatever the load path."""
    plain = replace(load_design("ilr33-amber"), friction=model.Friction(viscous_Nms_rad=2e-4))
    design = CASES[1].put(plain)
    assert design.load.path == "self-locking"
    assert follows_angle(design)
    assert not follows_angle(CASES[0].put(plain))
    start = State(motor_angle_rad=CASES[1].stable)
    open_loop = controlled(design, position=None, velocity=None, current=None)
    volts = 0.5 * A * plain.motor.resistance_ohm / plain.motor.torque_constant_Nm_A
    run = simulate(open_loop, commands.step(volts), 1.0, initial=start)
    assert run.motor_angle_rad[-1] == pytest.approx(CASES[1].stable + asin(0.5) / 12.0, rel=1e-6)


@each
@pytest.mark.parametrize("name", ["joint", "ilr33-amber-compliant", "fin"])
def test_a_drive_that_stands_stays_and_takes_the_slope_of_where_it_stands(case: Case, name: str) -> None:
    """Nothing moves; the loops are those of the operating angle, and a small push grows as they say."""
    shipped = load_design(name)
    back = replace(shipped.load, path="back-drivable", friction=None)
    design = case.put(replace(shipped, load=back, friction=model.Friction(viscous_Nms_rad=1e-5)))
    motion = operating_motion(design)
    assert motion.speed_rad_s == 0.0
    start = State(motor_angle_rad=0.0, output_angle_rad=motion.output_rad(design))
    free = replace(controlled(design, position=None, velocity=None, current=None), command=model.Command())
    at = {"disturbance_Nm": motion.extra_Nm, "initial": start, "friction_on": False, "limits_on": False}
    turned = [
        simulate(free, commands.step(volts), 0.01, motion.load_Nm, **at).motor_angle_rad
        for volts in (0.0, 1e-4, -1e-4)
    ]
    assert np.max(np.abs(turned[0] - start.motor_angle_rad)) < 1e-9
    linear = TickProgram(wire(free, motion.operating(free)), "voltage").tick(0)
    x, expected = np.zeros(len(linear.A)), []
    for _ in turned[0]:
        expected.append(linear.signals["th"][: x.size] @ x)
        x = linear.A @ x + linear.B[:, 0] * 1e-4
    seen = 0.5 * (turned[1] - turned[2])
    assert np.max(np.abs(seen - expected)) < 1e-6 * np.max(np.abs(expected))


def test_a_self_locking_path_feels_it_as_friction_alone() -> None:
    """T_f = CM |M_ext| = CM D w/N while the load is that moment only."""
    design = rotor(0.0, 2.0 / N, "self-locking", D)
    run = simulate(design, commands.hold(), 50 * Ts, initial=State(motor_speed_rad_s=80.0))
    w = run.motor_speed_rad_s
    assert w == pytest.approx(80.0 * (1.0 - 2.0 * D / N**2 * Ts / J) ** np.arange(w.size), rel=1e-12)
    assert wire(design).plant.load_torque == {}


def test_energy_of_the_moment_is_work_on_the_load() -> None:
    design = rotor(damping=D)
    run = simulate(design, commands.hold(), 50 * Ts, initial=State(motor_speed_rad_s=80.0), energy=True)
    w, energy = run.motor_speed_rad_s, run.energy
    after = np.append(w, run.final.motor_speed_rad_s)
    assert energy.output_work_J == pytest.approx(0.5 * J * (80.0**2 - after[-1] ** 2), rel=1e-12)
    travel = 0.5 * (after[1:] + after[:-1]) * Ts  # under a constant torque
    assert energy.output_work_J == pytest.approx(float(np.sum(D * w / N**2 * travel)), rel=1e-9)


def test_cogging_is_blamed_for_the_loops_alone_that_are_stable_without_it(cli) -> None:
    """A position gain of 6000/s is unstable with and without; what cogging drives away is the others."""
    cogging = ("--set", "motor.cogging=0.1 N*m", "--set", "motor.cogging_periods=12")
    fast = ("--set", "control.position.gain=6000 1/s")
    blamed = cli.text("margins", "joint", *cogging, status=1)
    assert "(current loop, velocity loop, position loop: by cogging alone" in " ".join(blamed.split())
    both = cli.text("margins", "joint", *cogging, *fast, status=1)
    assert "(current loop, velocity loop: by cogging alone" in " ".join(both.split())
    assert "by cogging" not in cli.text("margins", "joint", *fast, status=1)


def test_a_loop_that_only_the_hold_of_a_slope_makes_unstable_is_told_so(cli) -> None:
    """A spring without friction: held over a tick it makes the pole larger by K Ts^2/(4 J N^2), nearly.

    The drive itself, whose outer loops damp it, is stable, so the loop is judged as the winding alone; at a
    gain of 6000/s the drive is not.
    """
    settings = {"load.path": "back-drivable", "load.moment_slope": "-1000 N*m/rad",
                "friction.viscous": "0 N*m*s/rad", "control.current.back_emf_feedforward": "0.5"}  # fmt: skip
    design = load_design("ilr33-amber").with_values(settings)
    radius = [
        np.abs(loops_at(design, Operating(torques_at_once=once)).current.plain_closed.poles()).max()
        for once in (False, True)
    ]
    grown = 1000.0 * design.controller.period_s**2 / (4.0 * design.inertia_kgm2 * design.total_ratio**2)
    assert radius[0] > 1.0 > radius[1]
    assert radius[0] - radius[1] == pytest.approx(grown, rel=0.2)  # back-EMF adds to the inertia
    asked = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    told = " ".join(cli.text("margins", "ilr33-amber", *asked).split())
    assert "the current loop, unstable by itself, is judged with the rotor locked" in told
    assert "rotor free, as held over a tick, as here and in the simulator, a slope over the angle is" in told
    fast = cli.text("margins", "ilr33-amber", *asked, "--set", "control.position.gain=6000 1/s", status=1)
    assert "current loop: only as the slope of a torque over the angle, held over" in " ".join(fast.split())
    assert "PASS" in cli.text("corners", "ilr33-amber", *asked)


def test_margins_are_told_where_the_torques_over_the_angle_are_steepest() -> None:
    """At DC a crest of F Z works against a stiffness of g kv kp: the gain may fall to their ratio."""
    cogging = {"cogging_Nm": 500.0, "cogging_periods": 600.0, "cogging_phase_rad": 1.2}
    gear = {"gear_error_Nm": 80.0, "gear_error_periods": 500.0, "gear_error_phase_rad": 2.0}
    slopes, stiffness = {"cogging": 500.0 * 600.0, "gear error": 80.0 * 500.0}, 35.15065 * 243.45 * 160.18
    for acting in (["cogging"], ["gear error"], ["cogging", "gear error"]):
        parts = {
            "motor": cogging if "cogging" in acting else {},
            "load": gear if "gear error" in acting else {},
        }
        points = operating_points(changed(load_design("emps"), **parts), [], described=False)
        found = {one.place: one.figures["position"].margins.gain_margins for one in points}
        lowest = [
            one.ratio for one in found[f"on a crest of the {' and '.join(acting)}"] if not one.frequency_rad_s
        ]
        assert lowest == pytest.approx([sum(slopes[name] for name in acting) / stiffness], rel=1e-9)
        assert all(one.ratio > 1.0 for one in found[f"in a notch of the {' and '.join(acting)}"])


def test_beside_the_bandwidth_of_standing_in_a_notch_stands_that_of_a_motion() -> None:
    """g kv kp = 1.37e6 N/m and a notch of 9e5: 0.6 is left at DC, all of it in a motion."""
    plain = load_design("emps")
    asked = (model.Requirement(id="b", quantity="bandwidth", loop="position", minimum=1.0, unit="Hz"),)
    notch = {"cogging_Nm": 1500.0, "cogging_periods": 600.0, "cogging_phase_rad": pi}
    (alone,) = evaluate_requirements(changed(plain, requirements=asked))
    (standing,) = evaluate_requirements(changed(plain, requirements=asked, motor=notch))
    assert standing.value != pytest.approx(alone.value, rel=0.01)
    assert f"in a motion over many {alone.value:.4g} Hz" in standing.reason
    weak = changed(
        plain, requirements=asked, motor={**notch, "cogging_Nm": 1e-6}, command={"rate_rad_s": 0.05}
    )
    (same,) = evaluate_requirements(weak)
    assert "rate and acceleration of the command" in same.reason
    assert "in a motion" not in same.reason
