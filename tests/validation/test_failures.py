"""Failure cases against closed forms; nothing failed, the split is the drive."""

from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

from actuator_lti import InputError, assemble_loops
from actuator_lti.design import load_design, read_design_text, with_overrides
from actuator_lti.design.model import Load, PositionLoop
from analyses.failures import Asked, failures
from analyses.failures.cases import Halves, _sines, cases_of
from analyses.failures.run import MOST_TICKS, _followed, _hold, _settling_s, _worse
from nonlinear import commands, simulate
from reports.charts.svg import draw_svg
from reports.sections.failures import section, summary
from tests.changed import changed
from tests.loops.loop_designs import drive_d

AMBER = load_design("ilr33-amber")
SLOW = "its output does not get half-way to the stop in 5 s"


@pytest.mark.parametrize("name", ["ilr33-amber", "fin", "joint", "ballscrew", "emps"])
def test_two_halves_without_a_failure_are_the_drive(name: str) -> None:
    """Bit for bit, limits and friction at work, under a load; from rest, or from where the whole drive is."""
    design = load_design(name)
    size, ticks = 0.3 * design.validation.full_deflection_rad, 1500
    load = 0.5 * max(design.validation.loads_Nm)
    run = simulate(design, commands.step(size), ticks * design.controller.period_s, load)
    for begun in (0, 700):
        halves = Halves(design, load)
        whole = halves.whole(size)
        assert halves.followed(whole.advance(begun)).tolist() == run.followed[:begun].tolist()
        halves.go_on_from(whole)
        seen = [halves.step(size) for _ in range(begun, ticks)]
        assert [one.output_angle_rad for one in seen] == run.output_angle_rad[begun:].tolist()
        assert [one.current_A for one in seen] == run.current_A[begun:].tolist()


def test_a_command_that_jumps_is_seen_at_once_however_long_the_drive_has_waited() -> None:
    """The step of the drive from rest, to the bit: it had come up to a period of the position loop late."""
    design = load_design("ilr33-amber-multirate")
    result = failures(design, Asked.of(design)).case("hard-over-command")
    run = simulate(design, commands.step(design.validation.full_deflection_rad), 0.02)
    assert result.deflection_rad[:200].tolist() == run.output_angle_rad[:200].tolist()


def test_hard_over_is_the_motor_on_the_bus() -> None:
    """Rigid, dry friction constant while it moves: di, dw, dth linear in (i, w, th, 1), after the delay d."""
    design, U = AMBER, AMBER.limits.voltage_V
    m, d = design.motor, design.controller.computing_delay_s
    J, N = design.inertia_kgm2, design.total_ratio
    A = np.zeros((4, 4))
    A[0] = np.array([-m.resistance_ohm, -m.back_emf_constant_Vs_rad, 0.0, U]) / m.inductance_H
    A[1] = np.array([m.torque_constant_Nm_A, -design.friction.viscous_Nms_rad, 0.0, 0.0]) / J
    A[2, 1] = 1.0
    start = design.friction.dry_torque_Nm / (m.torque_constant_Nm_A * U / m.resistance_ohm)
    rest = -m.inductance_H / m.resistance_ohm * np.log1p(-start)  # until the current breaks away
    A[1, 3] = -design.friction.dry_torque_Nm / J
    moving = np.array([start * U / m.resistance_ohm, 0.0, 0.0, 1.0])
    asked = Asked.of(design)
    result = failures(design, asked).case("hard-over")
    for level, seen in ((asked.deflection_rad, result.to_deflection_s), (asked.stop_rad, result.to_stop_s)):
        time = brentq(lambda t, level=level: (expm(A * t) @ moving)[2] / N - level, 1e-4, 1.0)
        assert seen == pytest.approx(d + rest + time, rel=1e-5)  # a tick is a line


def test_an_open_phase_leaves_the_output_to_its_load() -> None:
    """Without current and viscous friction: a (t - 0)^2/2 with J dw/dt = M/N - Tc, the winding gone."""
    none = {"friction.viscous": "0 N*m*s/rad", "friction.load_coefficient": "0 mN*m/(N*m)"}
    design = with_overrides(AMBER, {"load.path": "back-drivable", **none})
    M, N = 20.0, design.total_ratio
    rate = (M / N - design.friction.dry_torque_Nm) / design.inertia_kgm2 / N
    result = failures(design, Asked.of(design, load_Nm=M)).case("open-phase")
    k = int(np.searchsorted(result.time_s, 0.2))
    assert result.deflection_rad[k] == pytest.approx(0.5 * rate * result.time_s[k] ** 2, rel=1e-9)
    assert not result.current_A.any()


def test_a_jam_stalls_at_the_peak_current_until_the_protection_acts() -> None:
    """I2t from rest: tau ln(r^2/(r^2 - 1)) at the peak is the stated peak time."""
    slow = {"limits.peak_time": "0.2 s", "control.position.gain": "30 1/s"}
    design = with_overrides(load_design("joint"), slow)
    result = failures(design, Asked.of(design, stop_rad=1.0, watched_s=0.3)).case("jam")
    assert abs(result.deflection_rad).max() < 1e-6
    assert result.current_A[np.searchsorted(result.time_s, 0.15)] == pytest.approx(15.0, rel=1e-3)
    assert 0.1 < result.protected_s < 0.2  # a little was used on the way
    assert result.current_A[-1] == pytest.approx(6.0, rel=1e-3)


@pytest.mark.parametrize(("path", "efficiency", "load_Nm"), [
    ("self-locking", 0.315, 0.0), ("back-drivable", 0.88, 0.0), ("back-drivable", 0.88, -4.0),
])  # fmt: skip
def test_a_rigid_train_passes_the_motors_torque_less_its_friction(path, efficiency, load_Nm) -> None:
    """Jammed (kM i - C0) N eta; else what the load takes: by its inertia, its slope and its moment."""
    N, slope = AMBER.total_ratio, -30.0
    CM = (1.0 / efficiency - (path == "back-drivable")) / N
    load = {"path": path, "moment_slope_Nm_rad": slope, "inertia_kgm2": 2e-3}
    design = changed(AMBER, load=load, friction={"load_coefficient": CM})
    result = failures(design, Asked.of(design, load_Nm=load_Nm))
    jam, free = result.case("jam"), result.case("hard-over")
    torque = design.motor.torque_constant_Nm_A * np.abs(jam.current_A) - design.friction.dry_torque_Nm
    assert np.abs(jam.moment_Nm) == pytest.approx(np.maximum(torque, 0.0) * N * efficiency, rel=1e-12)
    taken = free.moment_Nm - free.moment_Nm[0] + slope * free.deflection_rad  # at rest the slope's alone
    gained = 2e-3 * np.gradient(free.deflection_rad[:-1], free.time_s[:-1])[1:-1]  # the last is at the stop
    summed = np.cumsum(taken)[: gained.size] * free.time_s[1]  # what the inertia takes
    assert summed == pytest.approx(gained, abs=0.005 * np.abs(gained).max())
    assert result.failure_moment_Nm < 0.9 * N * design.motor.torque_constant_Nm_A * free.peak_current_A


def test_a_drive_that_turns_on_has_no_stop_unless_one_is_stated() -> None:
    """The full deflection that every design states is no stop of a spindle."""
    spindle = changed(AMBER, controller={"position": None}, requirements=())
    free = failures(spindle)
    over = free.case("hard-over")
    assert (over.to_stop_s, over.to_deflection_s, free.hard_over_time_s) == (None, None, inf)
    assert over.time_s[-1] == pytest.approx(1.0)  # all that is watched
    made = section(free)
    assert "no stop is stated" in made["intro"]
    assert "Hard-over of the power stage moves the output most" in made["result"]
    assert "<svg" in draw_svg(next(one for one in made["blocks"] if one["kind"] == "figure"), page=False)
    stop = 0.5 * over.at_detection_rad
    stated = failures(spindle, Asked.of(spindle, stop_rad=stop)).case("hard-over")
    assert stated.to_stop_s == pytest.approx(np.interp(stop, over.deflection_rad, over.time_s), rel=1e-9)


def test_a_jam_at_speed_is_an_impact_on_the_spring() -> None:
    """The motor's inertia runs into the coupling: W sqrt(k J_m) N_c, the motor's own push beside it."""
    design = changed(load_design("ballscrew"), coupling={"damping_Nms_rad": 0.0})
    case = failures(design, Asked.of(design, watched_s=0.1)).case("jam")
    k, J, N = design.coupling.stiffness_Nm_rad, design.motor_side_inertia_kgm2, design.ratio_to_coupling
    half = 0.5 * design.validation.full_deflection_rad
    run = simulate(design, commands.step(2.0 * half), 0.5)
    at = int(np.argmax(run.output_angle_rad >= half))
    speed, before = run.motor_speed_rad_s[at] / N, abs(run.coupling_torque_Nm[at])
    impact = speed * sqrt(k * J) * N
    limit = design.limits.peak_current_A * design.effective_motor.torque_constant_Nm_A * N
    assert impact - 2 * limit - before < case.peak_moment_Nm < impact + 2 * limit + before
    assert impact > 2 * limit  # the impact decides


def test_a_frozen_sensor_runs_away_at_the_speed_of_its_error() -> None:
    """P position, perfect inner loops: rate Kv e, the error e constant (friction off the scale of 0.5 %)."""
    design = with_overrides(load_design("ballscrew"), {"control.position.sensor": "output"})
    asked = Asked.of(design, watched_s=0.5)
    result = failures(design, asked).case("frozen-sensor")
    rate = design.controller.position_loop.gain * asked.deflection_rad
    seen = np.gradient(result.deflection_rad, result.time_s)[-200:].mean()
    assert seen == pytest.approx(rate, rel=0.02)


def test_an_oscillating_command_is_followed_as_the_linear_drive_does() -> None:
    """No dry friction, no play, inside every limit: the amplitude is |T| times the command's."""
    control = {"position": PositionLoop(gain=150.0, every=2), "computing_delay_s": 1e-4}
    design = changed(drive_d(), load=Load(inertia_kgm2=2e-3, path="back-drivable"), controller=control)
    asked = Asked.of(design, stop_rad=0.1, deflection_rad=0.001, watched_s=3.0)
    case = failures(design, asked).case("oscillatory-command")
    response = assemble_loops(design).reference_to_output
    tail = case.deflection_rad[len(case.time_s) // 2 :]
    crossings = np.flatnonzero((tail[:-1] < 0) & (tail[1:] >= 0))
    f = (len(crossings) - 1) / ((crossings[-1] - crossings[0]) * design.controller.period_s)
    T = abs(response(np.exp(2j * pi * f * 2e-4)))
    assert tail.max() == pytest.approx(0.001 * T, rel=0.01)


def test_section_figure_and_command(cli) -> None:
    emps = load_design("emps")
    made = section(failures(emps, Asked.of(emps, watched_s=0.5)))
    (figure,) = [block for block in made["blocks"] if block["kind"] == "figure"]
    assert "Lost sensor" in draw_svg(figure, page=False)
    assert "until it is detected" in made["result"]
    told = cli.data("failures", "fin", "--stop", "25 deg", "--load", "4", "--duration", "0.2")
    assert told["asked"]["stop_rad"] == pytest.approx(25 * pi / 180)
    assert {case["name"] for case in told["cases"]} >= {"jam", "hard-over", "open-phase", "lost-sensor"}
    assert "--deflection '30 mm'" in cli.refused("failures", "fin", "--deflection", "30 mm")


def test_a_drive_without_a_loop_has_fewer_cases() -> None:
    bare = changed(AMBER, controller=dict.fromkeys(("position", "velocity", "current")), requirements=())
    result = failures(bare, Asked.of(bare, watched_s=0.1))
    assert [case.name for case in result.cases] == ["hard-over", "open-phase"]
    assert result.left_out["jam"] == "the drive has no loop"
    with pytest.raises(InputError, match="beyond the stop, it is 2 times that"):
        Asked.of(AMBER, stop_rad=0.1, deflection_rad=0.2)


def test_without_a_resonance_the_sine_is_at_the_bandwidth() -> None:
    """A follower that falls from zero frequency on would be asked to creep at 0.1 Hz, which moves nothing."""
    slow = changed(AMBER, controller={"position": {"gain": 40.0}})
    ((frequency, words),) = _sines(slow, 0.01)
    response = assemble_loops(slow).reference_to_output
    size = abs(response(np.exp(2j * pi * frequency * slow.controller.period_s)))
    assert size == pytest.approx(np.sqrt(0.5), rel=1e-6)
    assert "bandwidth" in words


def test_the_sine_is_one_that_the_profile_of_the_command_lets_pass() -> None:
    """v, a and j of the command: A w <= v, A w^2 <= a, and the mean over 2 a/j is -3 dB at 2.783/(2 a/j)."""
    v, a, j, size = 0.5, 8.0, 40.0, 0.01
    rate = changed(AMBER, command={"rate_rad_s": v})
    assert list(_sines(rate, size))[-1][0] == pytest.approx(v / size / (2 * pi), rel=1e-3)
    both = changed(AMBER, command={"rate_rad_s": v, "acceleration_rad_s2": a})
    assert list(_sines(both, size))[-1][0] == pytest.approx(sqrt(a / size) / (2 * pi), rel=1e-3)
    smooth = changed(AMBER, command={"rate_rad_s": v, "acceleration_rad_s2": a, "jerk_rad_s3": j})
    assert max(hz for hz, _ in _sines(smooth, size)) < 1.01 * 2.783 / (2 * a / j) / (2 * pi)


def test_no_deflection_is_beyond_the_stop_and_a_drive_without_a_current_limit_has_all_cases() -> None:
    """The stop is hard: the tick that passes it is not seen, the time on the way to it is."""
    design = changed(AMBER, limits={"peak_current_A": inf, "peak_time_s": None})
    found = failures(design, Asked.of(design, detection_s=0.3, watched_s=0.3))
    free = replace(found.asked, stop_rad=10.0)
    case, other = (
        found.case("hard-over"),
        _followed(Halves(design, 0.0), free, cases_of(design, free)[0][0]),
    )
    assert case.at_detection_rad == found.asked.stop_rad == case.deflection_rad.max()
    assert case.to_stop_s == np.interp(found.asked.stop_rad, other.deflection_rad, other.time_s)
    assert len(found.cases) == 7


def test_an_open_phase_of_three_says_what_one_winding_leaves_out() -> None:
    three, one = load_design("ballscrew"), load_design("fin")
    assert "two phases left" in failures(three, Asked.of(three, watched_s=0.1)).case("open-phase").words
    assert "two phases" not in cases_of(one, Asked.of(one))[0][1].words


@pytest.mark.parametrize("command", ["stiffness", "failures"])
def test_an_unstable_drive_is_a_verdict_and_no_bad_input(command: str, cli) -> None:
    ran = cli(command, "fin", "--set", "control.velocity.gain=5 V*s/rad")
    assert ran.status == 1
    assert "not stable" in ran.err


def test_a_jam_at_speed_is_left_out_where_the_drive_is_too_slow() -> None:
    """A gain Kv alone is half-way after ln(2)/Kv: 6.9 s at 0.1 1/s, more than 5 s; 1.4 s at 0.5."""
    for gain, there in ((0.1, False), (0.5, True)):
        design = with_overrides(load_design("emps"), {"control.position.gain": f"{gain} 1/s"})
        result = failures(design, Asked.of(design, watched_s=0.1))
        assert ("jam" in {case.name for case in result.cases}) is there
        assert result.left_out == ({} if there else {"jam": SLOW})


def test_a_self_locking_drive_is_where_it_holds_before_a_failure() -> None:
    """Kv = 2 1/s alone: a thousandth is left after ln(1000)/2 = 3.45 s; no load torque shows that pole."""
    slow = changed(AMBER, controller={"position": {"gain": 2.0}})
    asked, halves = Asked.of(slow), Halves(slow, 0.0)
    wait = _settling_s(slow, asked)
    assert wait > 3.45
    _hold(halves, half := 0.5 * asked.stop_rad, round(wait / slow.controller.period_s), MOST_TICKS, 0.0)
    assert halves.output_rad == pytest.approx(half, rel=1e-3)
    assert halves.measured().motor_speed_rad_s == pytest.approx(0.0, abs=1e-3)


SLOT_CAR = """
design = {name = "slot-car"}
gear = [{name = "crown", ratio = 3}]
load = {inertia = "100 g*cm^2", path = "back-drivable", moment_max = "10 mN*m"}
friction = {dry_torque = "0.5 mN*m"}
encoder = {counts_per_rev = 48, speed = "difference", difference_samples = 4}
limits = {voltage = "7.4 V"}
[motor]
constants = "dc"
resistance = "1.3 ohm"
inductance = "0.35 mH"
torque_constant = "3.5 mN*m/A"
rotor_inertia = "1.1 g*cm^2"
[control]
period = "1 ms"
computing_delay = "0.2 ms"
velocity = {gain = "10 mV*s/rad", integral_time = "60 ms"}
"""


def test_a_drive_that_its_counts_swing_for_ever_is_not_waited_for(monkeypatch) -> None:
    """By +-0.98 thousandths of its speed: rest, and never within a thousandth from end to end."""
    design, followed, gone = read_design_text(SLOT_CAR), Halves.followed, list[int]()
    monkeypatch.setattr(
        Halves, "followed", lambda halves, p: gone.append(p.flags.size) or followed(halves, p)
    )
    result = failures(design, Asked.of(design, watched_s=0.01, detection_s=0.01))
    (before,) = result.before
    assert before.rest.comes_to_rest
    assert 0.5e-3 < before.rest.amplitude / before.amplitude_rad < 1e-3
    assert sum(gone) < 20_000


def test_the_headline_names_what_reaches_the_stop_first() -> None:
    """Three at the stop before detection, one of them a little into it: the quickest is the worst."""
    found = failures(AMBER)
    stop, detection = found.asked.stop_rad, found.asked.detection_s

    def case(name: str, reached: float | None, by: float):
        return replace(found.case(name), to_stop_s=reached, at_detection_rad=by * stop)

    early = (case("hard-over", 0.2 * detection, 1.0), case("frozen-sensor", 0.5 * detection, 1.002))
    late = (case("jam", 2.0 * detection, 0.4), case("lost-sensor", None, 0.5))
    told = summary(replace(found, cases=(*late, *early)))
    first = "Hard-over of the power stage reaches the stop first, 20 ms after it occurs"
    assert told.partition("; ")[0] == first
    assert summary(replace(found, cases=late)).startswith("Lost sensor moves the output most")
    told = summary(replace(found, cases=late[:1]))
    assert told.endswith("detected: 4 deg in 100 ms; it reaches the stop after 200 ms.")
    (before, *_) = found.before
    rest = replace(before.rest, verdict="limit cycle", motor_amplitude=1e-3, frequency_hz=2.0, periods=3)
    found = replace(found, before=(replace(before, rest=rest),), asked=replace(found.asked, load_Nm=-7.0))
    assert summary(replace(found, cases=late[:1])).endswith(
        "before it the drive does not come to rest under -7 N m: limit cycle of ±0.0573 deg (motor over the "
        "ratio, the output at rest) at 2 Hz (3 periods seen)."
    )


def test_of_several_sines_each_peak_is_the_largest() -> None:
    """The one that deflects most need not ask for the largest torque."""
    case = failures(AMBER, Asked.of(AMBER, watched_s=0.1)).case("hard-over")
    wide = replace(case, at_detection_rad=2.0, peak_moment_Nm=1.0, peak_current_A=1.0)
    strong = replace(case, at_detection_rad=1.0, peak_moment_Nm=3.0, peak_current_A=4.0)
    for one in (_worse(wide, strong), _worse(strong, wide)):
        assert (one.at_detection_rad, one.peak_moment_Nm, one.peak_current_A) == (2.0, 3.0, 4.0)
