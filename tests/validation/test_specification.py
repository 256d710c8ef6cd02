"""Actuator figures and duty: closed forms against the simulator, step times, and the sections of the page."""

import math
from dataclasses import replace
from math import ceil, inf

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.signal import lfilter

from actuator_lti import load_design
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import shipped_designs, with_overrides, with_values
from actuator_lti.drive.steady import motor_torque_Nm
from analyses.duty import Asked, duty
from analyses.duty.run import MOST_WORK, heating
from analyses.friction_effects import friction_effects
from analyses.large_signal import large_signals
from analyses.specification import Specification, specification
from analyses.specification.capability import drive_figures, thermal_duty, torque_speed_plane
from nonlinear import Trajectory, commands, simulate
from nonlinear.bench.operating_motion import on_the_bench
from nonlinear.runs.running import Piece, Running
from reports import document as doc
from reports.charts.svg import draw_svg
from reports.sections import friction_effects as friction_section
from reports.sections import large_signal as large_section
from reports.sections import specification as specification_section
from reports.sections.duty import section
from tests.changed import changed
from tests.refusals import refused

AMBER, FIN, JOINT = (load_design(name) for name in ("ilr33-amber", "fin", "joint"))
SHIPPED = ("ilr33-amber", "ilr33-amber-multirate", "emps", "ctms-motor-position")
UNDER_LOAD = {
    "fin": {"load.moment_damping": "2 N*m*s/rad"},
    "ilr33-amber": {"load.moment_damping": "300 N*m*s/rad"},
    "ilr33-amber-compliant": {"load.friction.dry_torque": "2 N*m", "load.friction.viscous": "3 N*m*s/rad"},
}


@pytest.fixture(scope="module")
def amber() -> Specification:
    return specification(AMBER)


@pytest.mark.parametrize("name", shipped_designs())
def test_the_simulated_rate_is_that_of_the_closed_form(name: str) -> None:
    """Against the load, also behind a coupling and a self-locking gear; no overload protection ends it."""
    design = load_design(name)
    for one in specification(design).capabilities:
        assert one.simulated_rate_rad_s == pytest.approx(one.figures.output_rate_rad_s, rel=1e-6)
        if design.coupling is None:  # the motor's end of a spring swings
            assert 0.7 < one.simulated_acceleration_rad_s2 / one.figures.acceleration_rad_s2 <= 1.0 + 1e-9
        if one.figures.motor_current_A is not None:
            assert one.simulated_current_A == pytest.approx(one.figures.motor_current_A, rel=1e-6)


def test_a_drive_that_takes_an_hour_to_run_up_is_run_for_its_start(monkeypatch) -> None:
    """No run is beyond the 400 000 ticks of the longest; the acceleration is that of the closed form."""
    ran = []

    def counted(design, command, time, load, **more):
        ran.append(time / design.controller.period_s)
        return simulate(design, command, time, load, **more)

    monkeypatch.setattr("analyses.specification.capability.simulate", counted)
    slow = changed(AMBER, load={"inertia_kgm2": 1e9 * AMBER.load.inertia_kgm2})
    push = drive_figures(slow, 0.0).acceleration_rad_s2
    found = specification(slow).capabilities[0].simulated_acceleration_rad_s2
    assert max(ran) <= 400_000
    assert 0.9 < found / push <= 1.0 + 1e-9


@pytest.mark.parametrize("name", ["ctms-motor-position", "fin"])
def test_a_sine_among_the_manoeuvres_draws_what_its_duty_does(name: str) -> None:
    """Of their second period alone it was up to 3 % more or less."""
    design = load_design(name)
    full = design.validation.full_deflection_rad
    for move in (one for one in specification(design).manoeuvres if one.periodic):
        hertz = float(move.name.split("(")[1].split()[0])  # three digits
        asked = {"frequency_hz": hertz, "amplitude_rad": full, "load_Nm": move.load_Nm, "share": 1.0}
        assert move.rms_current_A == pytest.approx(duty(design, Asked.of(design, **asked)).rms_A, rel=5e-3)


def test_a_slow_drive_is_followed_until_its_rate_is_steady() -> None:
    """A position loop of 0.05 1/s; its rate was not reached in the time given."""
    slow = with_values(AMBER, {"control.position.gain": 0.05})
    (one, *_) = specification(slow).capabilities
    assert one.simulated_rate_rad_s == pytest.approx(one.figures.output_rate_rad_s, rel=1e-6)


def test_current_and_rate_at_8_Nm(amber: Specification) -> None:
    """(C0 + CM 8 + Cv 942.5)/kM = 3.037 A, three quarters of the continuous current; paper: 22.7 deg/s."""
    loaded = amber.capabilities[1]
    current = (2.25e-3 + 8 * 1.34e-3 + 942.5 * 5.25e-6) / 5.9e-3
    assert (loaded.figures.load_Nm, loaded.figures.rate_limit) == (8.0, "speed limit")
    assert loaded.figures.motor_current_A == pytest.approx(current, rel=1e-12)
    assert loaded.simulated_current_A == pytest.approx(current)
    assert loaded.current_ratio == pytest.approx(loaded.simulated_current_A / 4.0)
    assert math.degrees(loaded.figures.output_rate_rad_s) == pytest.approx(22.7, abs=0.05)
    assert loaded.duty == 1.0
    assert [thermal_duty(AMBER, rms_A) for rms_A in (12.0, 2.0, None)] == [pytest.approx(1 / 9), 1.0, None]


def test_a_sine_within_the_limits_needs_the_current_of_its_friction(amber: Specification) -> None:
    """Slow sine: dry friction is a square wave, viscous a sine in phase: rms of their sum by hand."""
    move = next(m for m in amber.manoeuvres if m.load_Nm == 8.0 and "70 %" in m.name)
    dry, viscous = (2.25e-3 + 8 * 1.34e-3) / 5.9e-3, 5.25e-6 * 0.7 * 942.5 / 5.9e-3
    by_hand = math.sqrt(dry**2 + viscous**2 / 2.0 + 4.0 / math.pi * dry * viscous)
    assert move.rms_current_A == pytest.approx(by_hand, rel=0.01)


def test_the_peak_rate_of_a_load_behind_a_spring_is_its_own() -> None:
    """The load of the fin leaves its play a third faster than the motor turns."""
    step = specification(FIN).steps[-1]
    run = simulate(FIN, commands.step(step.amplitude_rad), 0.3, step.load_Nm)
    rates = [
        np.abs(np.diff(y)).max() / run.period_s for y in (run.output_angle_rad, run.motor_angle_rad / 60.0)
    ]
    assert step.peak_rate_rad_s == pytest.approx(rates[0], rel=0.01)
    assert rates[0] > 1.3 * rates[1]


def test_step_times(amber: Specification) -> None:
    """A small step takes the linear time; a large one the rate limit: 0.8 A/R from 10 to 90 %."""
    for load in (0.0, 8.0):
        small, *_, large = steps = [one for one in amber.steps if one.load_Nm == load]
        rises = [one.rise_time_s or 0.0 for one in steps]
        assert rises == sorted(rises)
        assert large.fraction == 1.0
        assert large.rise_time_s == pytest.approx(0.8 * large.amplitude_rad / (942.5 / 2376.0), rel=2e-3)
        assert ("speed" in small.limits, "speed" in large.limits) == (False, True)
        assert all(one.settling_time_s is not None for one in steps)


def test_the_plane_is_bounded_by_the_limits(amber: Specification) -> None:
    bounds = {curve.name: curve for curve in amber.plane.bounds}
    assert set(bounds) == {"voltage limit", "peak current", "continuous current", "speed limit"}
    assert bounds["peak current"].torque_Nm[0] == pytest.approx(12.0 * 5.9e-3)
    assert bounds["voltage limit"].speed_rad_s[-1] == pytest.approx(12.0 / 5.9e-3)
    for move in amber.manoeuvres:
        assert move.peak_torque_Nm <= 12.0 * 5.9e-3 * (1.0 + 1e-6)


def test_a_drive_that_cannot_move_says_so() -> None:
    weak = with_values(AMBER, {"limits.peak_current": 2.0, "limits.continuous_current": 2.0})
    result = specification(weak).capabilities
    assert result[1].figures.output_rate_rad_s == 0.0
    assert result[1].simulated_rate_rad_s is None
    assert result[0].simulated_rate_rad_s == pytest.approx(result[0].figures.output_rate_rad_s, rel=1e-6)


@pytest.mark.parametrize("name", SHIPPED)
def test_sections_are_plain_and_their_figures_can_be_drawn(name: str) -> None:
    design = load_design(name)
    sections = [
        large_section.section(large_signals(design, counts=(10, 8))),
        friction_section.section(friction_effects(design)),
        specification_section.section(specification(design)),
    ]
    made = doc.document(title="t", subtitle="", design={}, provenance={}, sections=sections)
    again = doc.loads(doc.dumps(made))
    assert again["verdict"]["verdict"] != "not met"
    names = [block["figure"] for block in doc.figures(again)]
    assert {"map", "amplitude_bode", "torque_speed"} <= set(names)
    assert ("sawtooth" in names) == name.startswith("ilr33")
    for block in doc.figures(again):
        svg = draw_svg(block, page=False)
        assert svg.startswith("<svg")
        assert "nan" not in svg.lower().replace("nano", "")
    (table,) = [block for block in sections[-1]["blocks"] if "Rate," in block.get("caption", "")]
    assert ("Duty" in table["note"]) == any(column["key"] == "duty" for column in table["columns"])
    assert "current controller" not in table["note"]


def test_a_hunting_drive_fails_its_verdict() -> None:
    values = {"friction.breakaway_ratio": 1.5, "control.velocity.integral_time": 3e-3}
    values["control.position.gain"] = 250.0
    made = friction_section.section(friction_effects(with_values(AMBER, values)))
    assert made["status"] == "fail"
    items = next(block["items"] for block in made["blocks"] if block["kind"] == "verdicts")
    assert any(item["verdict"] == Verdict.NOT_MET and "refuted" in item["reason"] for item in items)


def test_a_p_current_loop_bounds_the_plane_where_the_drive_has_its_top_speed() -> None:
    """(Kp + R) i = Kp i_peak - kE w: there steady motion takes all of it."""
    slow = {"current": {"gain_V_A": 0.05, "integral_time_s": None}}
    design = changed(AMBER, controller=slow, limits={"speed_rad_s": 2e3}, validation={"loads_Nm": (1.0,)})
    found, motor = drive_figures(design, 1.0), design.effective_motor
    top = found.output_rate_rad_s * design.total_ratio
    plane = torque_speed_plane(design, top)
    (bound,) = (curve for curve in plane.bounds if curve.name == "peak current")
    R, kM = motor.resistance_ohm, motor.torque_constant_Nm_A
    peak = design.limits.peak_current_A
    assert bound.torque_Nm[0] == pytest.approx(kM * 0.05 * peak / (0.05 + R))
    there, taken = (np.interp(top, one.speed_rad_s, one.torque_Nm) for one in (bound, plane.demands[0]))
    assert there == pytest.approx(taken, rel=1e-9)


@pytest.mark.parametrize("name", UNDER_LOAD)
def test_the_demand_of_the_plane_is_what_steady_motion_takes(name: str) -> None:
    """Friction behind the coupling and damping of the load too: the torque of a ramp, simulated."""
    free = {"load.path": "back-drivable", "load.moment_slope": "0 N*m/rad"}
    design = with_overrides(load_design(name), {**UNDER_LOAD[name], **free})
    top = 0.3 * drive_figures(design, 0.0).output_rate_rad_s * design.total_ratio
    (curve,) = torque_speed_plane(changed(design, validation={"loads_Nm": (0.0,)}), top).demands
    wanted = float(np.interp(top, curve.speed_rad_s, curve.torque_Nm))
    run = simulate(on_the_bench(design), commands.ramp(top / design.total_ratio), 1.5)
    torque = motor_torque_Nm(design, run.current_A, run.voltage_V)[-len(run.time_s) // 10 :]
    assert run.motor_speed_rad_s[-1] == pytest.approx(top, rel=1e-3)
    assert float(torque.mean()) == pytest.approx(wanted, rel=2e-3)


HOT = {
    "temperature.thermal_resistance": "2 K/W",
    "temperature.thermal_time": "60 s",
    "temperature.winding_limit": "125 degC",
}


def test_the_peak_is_that_of_the_motion_repeated_without_its_start() -> None:
    """A symmetric drive: turned about, the load asks the same; the start, against it or with it, does not."""
    design = load_design("ballscrew")
    there, back = (duty(design, Asked.of(design, load_Nm=load)) for load in (300.0, -300.0))
    assert there.peak_A == pytest.approx(back.peak_A, rel=1e-3)
    assert there.peak_A == np.abs(there.current_A).max()


@pytest.mark.parametrize(("integral_s", "load"), [(1.0, 4.0), (3.0, -4.0)])
def test_the_motion_is_followed_until_a_slow_integral_carries_the_load(
    integral_s: float, load: float
) -> None:
    """The rms current is that of a run of 40 integral times, of which the start is forgotten."""
    design = changed(FIN, controller={"position": {"integral_time_s": integral_s}})
    result = duty(design, Asked.of(design, amplitude_rad=0.1, frequency_hz=5.0, load_Nm=load))
    long = simulate(design, commands.sine(0.1, 5.0), 40.0 * integral_s, load).current_A[-len(result.time_s) :]
    assert result.rms_A == pytest.approx(np.sqrt(np.mean(long**2)), rel=5e-4)


def test_a_slow_integral_is_waited_for_or_the_duty_is_not_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    """As slow as that it is a constant at 5 Hz: the one with which the mean error is zero."""
    design, sine = changed(FIN, controller={"position": {"integral_time_s": 100.0}}), commands.sine(0.1, 5.0)
    asked = Asked.of(design, amplitude_rad=0.1, frequency_hz=5.0, load_Nm=4.0)
    result, ticks = duty(design, asked), round(0.2 / design.controller.period_s)

    def run(bias: float) -> Trajectory:
        return simulate(FIN, sine, 2.0, 4.0, bias=commands.hold(bias))

    def error(bias: float) -> float:
        return float(np.mean(run(bias).output_angle_rad[-ticks:]))

    held = run(brentq(error, -0.1, 0.1)).current_A[-ticks:]
    assert result.steady
    assert result.rms_A == pytest.approx(np.sqrt(np.mean(held**2)), rel=5e-4)
    monkeypatch.setattr("analyses.duty.run.MOST_WORK", 10 * ticks)
    short = duty(design, asked)
    assert (short.steady, short.rated) == (False, Verdict.NOT_PROVEN)
    assert "not judged" in section(short)["result"]
    assert "is not steady" in section(short)["result"]


def test_counts_that_let_every_period_differ_leave_a_duty_judged() -> None:
    """Of 500 counts the current of single periods differs by 1e-3 for ever; its mean does not."""
    design = changed(AMBER, encoder={"counts_per_rev": 500, "speed": "difference"})
    result = duty(design)
    assert (result.steady, result.rated) == (True, Verdict.MET)


def test_a_wait_is_counted_in_integration_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """An unstable current loop in smoothed friction takes hundreds of steps a tick, and never repeats."""
    work, advance = list[int](), Running.advance

    def watched(drive: Running, ticks: int) -> Piece:
        piece = advance(drive, ticks)
        work.append(drive.work)
        return piece

    monkeypatch.setattr(Running, "advance", watched)
    result = duty(load_design("ilr33-amber-tanh").with_values({"control.current.gain": "200 mohm"}))
    assert not result.steady
    assert max(np.diff(work)) > 100 * result.time_s.size
    assert work[-2] < MOST_WORK <= work[-1]


def test_a_rest_goes_on_from_the_motion_and_a_period_of_no_whole_ticks_is_played_as_asked() -> None:
    """The second of two whole cycles: friction holds there what the motion has left."""
    asked = Asked.of(JOINT, amplitude_rad=0.2, frequency_hz=1.0, load_Nm=40.0, share=0.3, cycle_s=20.0)
    t = np.arange(0.0, 40.0, 5e-4)
    command = commands.sampled(t, np.where(t % 20.0 < 6.0, 0.2 * np.sin(2.0 * np.pi * t), 0.0))
    whole = simulate(replace(JOINT, limits=replace(JOINT.limits, peak_time_s=None)), command, 40.0, 40.0)
    rest = whole.current_A[round(26.0 / JOINT.controller.period_s) :]
    result = duty(JOINT, asked)
    assert result.holding_A == pytest.approx(np.sqrt(np.mean(rest**2)), rel=1e-3)
    assert result.peak_A == pytest.approx(np.abs(rest).max(), rel=1e-3)
    result = duty(
        JOINT, Asked.of(JOINT, amplitude_rad=1e-3, frequency_hz=60.0, load_Nm=0.0)
    )  # 33 1/3 updates
    spectrum = np.abs(np.fft.rfft(result.current_A - result.current_A.mean()))
    seconds = result.time_s.size * JOINT.controller.period_s
    assert np.argmax(spectrum) / seconds == pytest.approx(60.0, rel=1e-12)
    assert "nearest to whole ticks" in section(result)["blocks"][-1]["caption"]


@pytest.mark.parametrize(
    ("share", "cycle_s", "hz"), [(0.4, 3.0, 1.0), (0.4, 3.0, 0.987), (0.4, 40.0, 1.0), (1.0, 1.0, 1.0)]
)
def test_the_overload_state_of_motion_and_rest_is_its_recursion(
    share: float, cycle_s: float, hz: float
) -> None:
    """Tick by tick from the cold drive, of a late cycle: 40 % in motion, whole periods or not, 60 % at rest.

    The motion begins from rest: it had been taken as steady from its first tick, and the rest without power.
    """
    design = with_overrides(JOINT, {"limits.peak_time": "5 s", "limits.continuous_current": "4 A"})
    asked = Asked.of(design, amplitude_rad=0.3, frequency_hz=hz, load_Nm=70.0, share=share, cycle_s=cycle_s)
    result, Ts = duty(design, asked), design.controller.period_s
    many = max(3, ceil(30.0 / cycle_s))  # cycles, of which the last is looked at
    t = np.arange(0.0, many * cycle_s, 5e-4)
    moves = 0.3 * np.sin(2.0 * np.pi * hz * (t % cycle_s)) * (t % cycle_s < share * cycle_s - 1e-9)
    free = replace(design, limits=replace(design.limits, peak_time_s=None))
    run = simulate(free, commands.sampled(t, moves), many * cycle_s, 70.0)
    i, w = (signal[-round(cycle_s / Ts) :] for signal in (run.current_A, run.motor_speed_rad_s))
    ticks = round(share * cycle_s / Ts)
    R, kE = design.motor.resistance_ohm, design.motor.back_emf_constant_Vs_rad
    for value, wanted in (
        (result.moving_rms_A, np.sqrt(np.mean(i[:ticks] ** 2))),
        (result.rms_A, np.sqrt(np.mean(i**2))),
        (result.peak_A, np.abs(i).max()),
        (result.shaft_W, np.mean(kE * i * w)),
        (result.peak_power_W, (R * i**2 + kE * i * w).max()),
        (result.fed_back_W, -(R * i**2 + kE * i * w).min()),
    ):
        assert value == pytest.approx(wanted, rel=2e-3)
    still = np.full(i.size - ticks, (result.holding_A / 4.0) ** 2)
    a, tau = Ts / design.limits.overload_time_s, design.limits.overload_time_s
    cycles = ceil(15.0 * tau / cycle_s)  # 3e-7 of the start is left
    states = lfilter([a], [1.0, a - 1.0], np.tile(np.concatenate([(i[:ticks] / 4.0) ** 2, still]), cycles))
    assert result.overload.peak == pytest.approx(states[-i.size :].max(), rel=1e-3)
    over = np.flatnonzero(states >= 1.0)
    ends = ceil((over[0] + 1) * Ts / cycle_s) * cycle_s if over.size else None
    assert result.overload.acts_after_s == (ends and pytest.approx(ends))
    if share < 1.0:
        assert result.holding_A > 4.0 * np.sqrt(result.overload.peak)  # which the rest is too short to reach


def test_a_duty_names_what_is_beyond_its_limit() -> None:
    """Its current within, the winding not: the first line does not tell the current as the reason."""
    made = section(duty(with_overrides(JOINT, {**HOT, "temperature.winding_limit": "30 degC"})))
    assert "is beyond continuous rating: winding temperature " in made["result"]
    assert "°C, limit 30 °C." in made["result"]
    assert "rms over time" not in made["result"]


@pytest.mark.parametrize("rms", [1.0, 6.0, 11.0, 13.0])
def test_temperature_against_its_equation(rms: float) -> None:
    """tau dT/dt = Ta - T + Rth R I^2 (1 + alpha (T - Tref)), by an integrator; at 13 A it runs away."""
    result, P = heating(with_overrides(FIN, HOT), rms), 2.0 * 1.0 * rms**2
    course = solve_ivp(
        lambda _, T: (25.0 - T + P * (1 + 0.00393 * (T - 25.0))) / 60.0, (0.0, result.time_s[-1]), [25.0],
        t_eval=result.time_s, rtol=1e-10, atol=1e-9,
    )  # fmt: skip
    assert result.temperature_degC == pytest.approx(course.y[0], rel=1e-7)
    if P * 0.00393 >= 1.0:
        assert result.final_degC == inf
    else:
        assert result.final_degC == pytest.approx(25.0 + P / (1.0 - 0.00393 * P), rel=1e-12)
    if result.limit_after_s is not None:
        reached = np.interp(result.limit_after_s, result.time_s, result.temperature_degC)
        assert reached == pytest.approx(125.0, rel=5e-3)
    assert (result.limit_after_s is None) == (result.final_degC <= 125.0)


def test_section_figure_and_command(cli) -> None:
    assert duty(FIN).verdict == "not proven"  # without any rating
    made = section(duty(with_overrides(FIN, HOT)))
    (figure,) = [block for block in made["blocks"] if block["kind"] == "figure"]
    assert "Winding" in draw_svg(figure, page=False)
    told = cli.data("duty", "joint", "--amplitude", "10 deg", "--load", "20")
    assert told["rms_A"] < told["continuous_A"] == 6.0
    assert "--share 0: allowed: above 0, at most 1" in cli.refused("duty", "joint", "--share", "0")
    assert "Hz: at least" in cli.refused("duty", "joint", "--frequency", "1e-320")
    refused(duty, load_design("emps"), words="no current")
    refused(duty, changed(JOINT, controller=dict.fromkeys(("position", "velocity", "current"))), words="loop")


def test_a_duty_that_the_drive_cannot_follow_is_said_with_its_rating() -> None:
    """1 rad at 20 Hz is far beyond 22.7 deg/s: the current may do, the motion is not the one asked for."""
    asked = Asked.of(AMBER, amplitude_rad=0.02, frequency_hz=1.0, load_Nm=0.0)
    assert "not followed" not in section(duty(AMBER, asked))["result"]
    made = section(duty(AMBER, replace(asked, amplitude_rad=1.0, frequency_hz=20.0)))
    assert "it is not followed as asked, limited by" in made["result"]
    assert made["status"] == "fail"  # 9.5 A of 4 A
    slow = with_overrides(AMBER, {"command.rate": "7 deg/s"})  # 0.02 rad at 1 Hz are 7.2 deg/s
    assert duty(slow, asked).limited == ("profile",)
    assert duty(with_overrides(AMBER, {"command.rate": "8 deg/s"}), asked).limited == ()


def test_the_current_of_an_ac_motor_is_told_in_the_model_s_amperes(cli) -> None:
    first, *rest = cli.text("duty", "ballscrew").splitlines()
    assert " A dc, rms over time, limit " in first
    assert any("current, rms over time" in line and " A dc " in line for line in rest)
    assert f"1 A rms is {1.5**0.5:.4g} A dc." in " ".join(rest)
    assert " A dc" not in cli.text("duty", "joint")
