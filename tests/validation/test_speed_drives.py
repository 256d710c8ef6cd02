"""Duty and failures of drives that are commanded in speed or current, against closed forms."""

from dataclasses import replace
from functools import lru_cache
from math import pi, sqrt

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lfilter

from actuator_lti.design import load_design, read_design_text
from actuator_lti.design.model import Command, Gravity
from actuator_lti.design.writing import write_design
from actuator_lti.errors import InputError, UnstableError
from analyses.duty import Asked as AskedDuty
from analyses.duty import duty
from analyses.failures import Asked, failures
from analyses.request import Kind
from reports.charts.svg import draw_svg
from reports.cli.options import read_quantity
from reports.sections.duty import section as duty_section
from reports.sections.failures import section as failures_section
from tests.changed import changed

SPINDLE = changed(load_design("ilr33-amber"), controller={"position": None}, requirements=())
TORQUE = changed(SPINDLE, controller={"velocity": None})
MOTOR = SPINDLE.effective_motor
R, kM, kE = MOTOR.resistance_ohm, MOTOR.torque_constant_Nm_A, MOTOR.back_emf_constant_Vs_rad
U, N, J = SPINDLE.limits.voltage_V, SPINDLE.total_ratio, SPINDLE.inertia_kgm2
C0, b = SPINDLE.friction.dry_torque_Nm, SPINDLE.friction.viscous_Nms_rad
RUNAWAY = (kM * U / R - C0) / (b + kM * kE / R)
"""Motor speed at which the bus, through R against kE w, gives what friction takes."""


failed = lru_cache(failures)


@pytest.mark.parametrize("kind", ["plain", "command"])
def test_amperes_of_the_command_line_are_those_of_a_file(kind: Kind) -> None:
    """i = sqrt(3/2) I_rms = sqrt(3)/2 I_peak of an AC motor; which ones are meant has to be said."""
    servo = changed(
        load_design("ballscrew"), controller={"velocity": None, "position": None}, requirements=()
    )
    for words, dc_A in (("2 A peak", sqrt(3.0)), ("2 A rms", sqrt(6.0)), ("2 A dc", 2.0), ("2", 2.0)):
        assert read_quantity("--current", words, kind, servo, "A") == pytest.approx(dc_A, rel=1e-15)
    for words, drive, told in (
        (
            "2 A",
            servo,
            'which amperes of the AC motor is not said; allowed: "5 A rms", "5 A peak", or 5 in A dc',
        ),
        ("2 A peak", TORQUE, 'the motor\'s amperes are dc; allowed: "5 A", or 5 in A'),
    ):
        with pytest.raises(InputError) as refused:
            read_quantity("--current", words, kind, drive, "A")
        assert refused.value.message == f"--current {words!r}: {told}"


def test_a_trapezoid_of_speed_is_inertia_and_friction() -> None:
    """kM i = J dw/dt + C0 + b w; what the shaft takes is friction's, as J gives back what it got."""
    W, ramp, hz = 0.2, 0.25, 0.5
    asked = {"speed_rad_s": W, "ramp_s": ramp, "frequency_hz": hz, "load_Nm": 0.0}
    result = duty(SPINDLE, AskedDuty.of(SPINDLE, **asked))
    t = (np.arange(200_000) + 0.5) / 200_000 / hz
    w = np.interp(t, [0.0, ramp, 1.0 / hz - ramp, 1.0 / hz], [0.0, W * N, W * N, 0.0])
    way = np.where(t < ramp, 1.0, np.where(t > 1.0 / hz - ramp, -1.0, 0.0))
    torque = J * W * N / ramp * way + C0 + b * w
    power = R * (torque / kM) ** 2 + torque * w * kE / kM
    rms = sqrt(np.mean(torque**2))
    assert result.rms_A == pytest.approx(rms / kM, rel=2e-3)
    assert result.rms_torque_Nm == pytest.approx(rms, rel=2e-3)
    assert result.peak_torque_Nm == pytest.approx(torque.max(), rel=0.05)  # a corner that PI overshoots
    assert result.copper_W == pytest.approx(R * (rms / kM) ** 2, rel=4e-3)
    assert result.shaft_W == pytest.approx(np.mean((C0 + b * w) * w) * kE / kM, rel=2e-3)
    assert result.mean_power_W == pytest.approx(np.mean(power), rel=2e-3)
    assert result.peak_power_W == pytest.approx(power.max(), rel=0.05)
    assert result.fed_back_W == pytest.approx(max(0.0, -power.min()), rel=0.05, abs=1e-3)
    made = duty_section(result)
    assert "0 to 11.5 deg/s and back in 250 ms each, at 0.5 Hz under 0 N m" in made["result"]
    rows = {row["what"]: row["value"] for row in made["blocks"][0]["rows"]}
    assert rows["power into the motor, mean"] == result.mean_power_W


def test_a_load_that_turns_with_its_drive_counts_at_every_angle() -> None:
    """A pendulum adds (G/N)^2/2 to the mean square of the torque, whatever angle a period begins at."""
    G, asked = 16.0, {"speed_rad_s": 0.37, "ramp_s": 0.25, "frequency_hz": 0.5, "load_Nm": 0.0}
    level = changed(SPINDLE, load={"path": "back-drivable"}, friction={"load_coefficient": 0.0})
    swung = changed(level, load={"gravity": Gravity(mass_kg=G / 9.80665, arm_m=1.0)})
    flat, turning = (duty(each, AskedDuty.of(each, **asked)) for each in (level, swung))
    wanted = sqrt(flat.rms_torque_Nm**2 + 0.5 * (G / N) ** 2)
    assert wanted > 1.1 * flat.rms_torque_Nm
    assert turning.rms_torque_Nm == pytest.approx(wanted, rel=0.01)
    assert turning.mean_power_W == pytest.approx(flat.shaft_W + R * (wanted / kM) ** 2, rel=0.01)
    protected = changed(swung, limits={"continuous_current_A": 0.9 * turning.rms_A, "peak_time_s": 0.4})
    found, Ts = duty(protected, AskedDuty.of(protected, **asked)), SPINDLE.controller.period_s
    a = Ts / protected.limits.overload_time_s
    drive = np.tile((found.current_A / (0.9 * turning.rms_A)) ** 2, 3)
    first = np.argmax(lfilter([a], [1.0, a - 1.0], drive) >= 1.0) * Ts
    assert 2.0 < first < found.overload.acts_after_s <= first + 2.0  # to the end of a period of 2 s
    assert "whole turns of the load" in duty_section(turning)["blocks"][-1]["caption"]


def test_a_speed_drive_runs_up_by_half_its_torque_against_the_load_and_rests() -> None:
    """Twice the time that all of its acceleration takes; half its top speed; motion and rest by squares."""
    drive = changed(SPINDLE, load={"path": "back-drivable"}, friction={"load_coefficient": 0.0})
    asked = AskedDuty.of(drive, share=0.5, cycle_s=4.0)
    stall = min(SPINDLE.limits.peak_current_A, U / R) * kM
    largest = max(drive.validation.loads_Nm)
    assert asked.load_Nm == -largest < 0.0
    assert asked.speed_rad_s == pytest.approx(0.5 * min(SPINDLE.limits.speed_rad_s, U / kE) / N)
    push = (stall - C0 - largest / N) / J / N
    assert asked.ramp_s == pytest.approx(2.0 * asked.speed_rad_s / push)
    result = duty(drive, asked)
    assert result.rms_A**2 == pytest.approx(0.5 * result.moving_rms_A**2 + 0.5 * result.holding_A**2)
    assert result.limited == ()
    assert result.mean_power_W > result.copper_W


def test_a_sine_of_speed_and_one_of_current() -> None:
    """``--ramp 0``: J A w cos beside friction; of a current, its output held: A/sqrt 2, all of it heat."""
    A, hz = 0.1, 2.0
    asked = {"speed_rad_s": A, "ramp_s": 0.0, "frequency_hz": hz, "load_Nm": 0.0}
    result = duty(SPINDLE, AskedDuty.of(SPINDLE, **asked))
    t = 2 * pi * (np.arange(10_000) + 0.5) / 10_000
    torque = J * A * N * 2 * pi * hz * np.cos(t) + C0 * np.sign(np.sin(t)) + b * A * N * np.sin(t)
    assert result.rms_A == pytest.approx(sqrt(np.mean(torque**2)) / kM, rel=0.02)
    held = duty(TORQUE, AskedDuty.of(TORQUE, current_A=3.0, load_Nm=0.0))
    assert held.rms_A == pytest.approx(3.0 / sqrt(2.0), rel=1e-4)
    assert held.mean_power_W == pytest.approx(R * 4.5, rel=1e-4)
    assert "the output held" in duty_section(held)["result"]


@pytest.mark.parametrize(("design", "wrong", "words"), [
    (SPINDLE, {"amplitude_rad": 0.1}, ": this drive's command is a velocity; allowed: speed"),
    (TORQUE, {"speed_rad_s": 0.1}, ": this drive's command is a current; allowed: current"),
    (SPINDLE, {"speed_rad_s": 0.1, "current_A": 1.0}, "allowed: one of amplitude, speed, current"),
    (SPINDLE, {"ramp_s": 0.6, "frequency_hz": 1.0}, "allowed: 0 to half a period, 0.5 s"),
    (SPINDLE, {"frequency_hz": 2e4}, "20000 Hz: must be below the Nyquist frequency of the velocity loop"),
    (SPINDLE, {"speed_rad_s": 1e9}, r"a peak of 1e\+09 .* Hz: at least .* Hz"),
])  # fmt: skip
def test_the_duty_of_another_kind_of_drive_is_refused(design, wrong, words) -> None:
    with pytest.raises(InputError, match=words):
        duty(design, AskedDuty.of(design, **wrong))


def test_no_load_has_no_sign_and_the_longest_motion_is_taken(monkeypatch) -> None:
    swung = changed(SPINDLE, load={"gravity": Gravity(mass_kg=0.1, arm_m=0.1), "path": "back-drivable"})
    swung = changed(swung, validation={"loads_Nm": (0.0,)})
    assert str(AskedDuty.of(swung).load_Nm) == "0.0"
    monkeypatch.setattr("analyses.duty.run.MOST_TICKS", 10_003)  # four periods of 2500.75 ticks
    lowest = 4.0 / (10_003 * SPINDLE.controller.period_s)
    asked = AskedDuty.of(swung, speed_rad_s=0.3, ramp_s=0.1, frequency_hz=lowest)
    assert duty(swung, asked).period_ticks == 2501


def test_the_current_of_an_ac_motor_says_which_amperes() -> None:
    screw = changed(
        load_design("ballscrew"), controller={"position": None, "velocity": None}, requirements=()
    )
    text = write_design(replace(screw, command=Command()))
    said = read_design_text(text + '\n[duty]\ncurrent = "5 A rms"\n')
    assert duty(said).peak_A == pytest.approx(5.0 * sqrt(1.5), rel=1e-3)
    with pytest.raises(InputError, match="which amperes of the AC motor"):
        read_design_text(text + '\n[duty]\ncurrent = "5 A"\n')


def test_what_jams_turns_as_fast_as_it_does_and_not_as_it_is_told() -> None:
    """J w^2/2 at the limit of the speed; at rest nothing turns."""
    w = 0.5 * RUNAWAY
    slow, short = changed(SPINDLE, limits={"speed_rad_s": w}), {"watched_s": 0.01, "detection_s": 0.01}
    made = failures(slow, Asked.of(slow, speed_rad_s=1e6, **short))
    assert f"the {0.5 * J * w**2:.3g} J that turn" in made.case("jam").words
    assert "speed limit acting" in failures_section(made)["intro"]
    still = failures(slow, Asked.of(slow, speed_rad_s=0.0, **short))
    assert still.case("jam").words == "the output jams at rest"


def test_an_open_phase_lets_a_spindle_coast() -> None:
    """w(t) = (W + C0/b) exp(-b t/J) - C0/b until it stands; the angle run on is its integral."""
    result = failed(SPINDLE)
    W, case = result.asked.speed_rad_s * N, result.case("open-phase")
    assert case.speed_rad_s[0] * N == pytest.approx(W, rel=1e-3)
    t = case.time_s
    w = np.maximum((W + C0 / b) * np.exp(-b * t / J) - C0 / b, 0.0)
    assert case.speed_rad_s * N == pytest.approx(w, abs=5e-3 * W)
    run_on = np.trapezoid(w[t <= 0.1], t[t <= 0.1]) / N
    assert case.at_detection_rad == pytest.approx(run_on, rel=5e-3)
    assert case.to_stop_s is None


@pytest.mark.parametrize(("design", "name"), [
    (SPINDLE, "hard-over"), (SPINDLE, "lost-sensor"), (TORQUE, "hard-over"), (TORQUE, "lost-sensor"),
])  # fmt: skip
def test_without_its_sensor_a_drive_runs_away_to_its_no_load_speed(design, name) -> None:
    case = failed(design).case(name)
    assert case.peak_speed_rad_s * N == pytest.approx(RUNAWAY, rel=2e-3)
    assert case.at_detection_rad == pytest.approx(np.interp(0.1, case.time_s, case.deflection_rad))


def test_a_bus_against_the_motion_adds_the_back_emf() -> None:
    """L di/dt = -U - R i - kE w, J dw/dt = kM i - C0 - b w from running steadily: the largest current."""
    result = failed(SPINDLE)
    W = result.asked.speed_rad_s * N
    A = np.array([[-R / MOTOR.inductance_H, -kE / MOTOR.inductance_H, -U / MOTOR.inductance_H],
                  [kM / J, -b / J, -C0 / J], [0.0, 0.0, 0.0]])  # fmt: skip
    start = np.array([(C0 + b * W) / kM, W, 1.0])
    course = np.array([expm(A * t) @ start for t in np.linspace(0.0, 2e-3, 2000)])
    peak = np.abs(course[course[:, 1] > 0.0, 0]).max()
    assert peak > 1.1 * (U - kE * W) / R
    assert result.case("hard-over").peak_current_A == pytest.approx(peak, rel=0.02)  # a tick is 0.1 ms
    assert result.case("hard-over").peak_speed_rad_s * N == pytest.approx(RUNAWAY, rel=2e-3)


def test_a_command_that_jumps_is_followed_to_the_top_speed() -> None:
    result = failed(SPINDLE)
    top = min(SPINDLE.limits.speed_rad_s, U / kE) / N
    assert result.asked.speed_rad_s == 0.5 * top
    assert result.case("hard-over-command").speed_rad_s[-1] == pytest.approx(top, rel=1e-3)
    made = failures_section(result)
    assert "a drive that turns at a command of" in made["intro"]
    assert "the fastest is hard-over of the power stage" in made["result"]
    (figure,) = [block for block in made["blocks"] if block["kind"] == "figure"]
    assert "speed, deg/s" in draw_svg(figure, page=False)


def test_a_jam_of_a_turning_drive_is_its_energy_on_the_spring() -> None:
    """Half J_m W^2 into k/2 x^2: W sqrt(k J_m) of the coupling, its push before beside it."""
    screw = replace(load_design("ballscrew"), command=Command(), requirements=())
    free = {"law": "coulomb", "dry_torque_Nm": 0.0, "viscous_Nms_rad": 0.0, "load_coefficient": 0.0}
    limits = {"peak_current_A": 0.2, "continuous_current_A": 0.1}
    screw = changed(screw, controller={"position": None}, coupling={"damping_Nms_rad": 0.0}, friction=free,
                    limits=limits, load={"friction": None})  # fmt: skip
    result = failures(screw, Asked.of(screw, speed_rad_s=0.1, watched_s=0.1))
    case = result.case("jam")
    Nc, k = screw.ratio_to_coupling, screw.coupling.stiffness_Nm_rad
    W = case.speed_rad_s[0] * screw.total_ratio / Nc
    impact = W * sqrt(k * screw.motor_side_inertia_kgm2) * Nc
    push = 0.2 * screw.effective_motor.torque_constant_Nm_A * Nc
    assert impact > 20.0 * push
    assert case.peak_moment_Nm == pytest.approx(impact, abs=3.0 * push)
    assert case.at_detection_rad < 1e-6
    energy = 0.5 * screw.motor_side_inertia_kgm2 * (0.1 * screw.total_ratio) ** 2
    assert f"{energy:.3g} J in what turns before the coupling" in case.words


def test_what_passes_as_a_drive_turns_is_no_cycle_before_its_failure() -> None:
    """A pendulum that goes round and round: its speed ripples, and what fails is a drive that turns."""
    joint = replace(load_design("joint"), command=Command(), requirements=())
    joint = changed(joint, controller={"position": None})
    found = failures(joint, Asked.of(joint, watched_s=0.1))
    assert [one.rest.verdict for one in found.before] == ["at rest"]
    assert "does not" not in failures_section(found)["result"]


def test_a_pendulum_upright_is_no_fault_of_a_drive_that_turns() -> None:
    """Standing there it falls; turning it passes: what is asked is the loop of the turning drive."""
    joint = replace(load_design("joint"), command=Command(), requirements=())
    upright = changed(joint, controller={"position": None}, load={"gravity": {"offset_rad": 0.0}})
    spring = {"gravity": None, "moment_slope_Nm_rad": upright.load.gravity.peak_Nm}
    with pytest.raises(UnstableError):
        failures(changed(upright, load=spring))
    assert failures(upright, Asked.of(upright, watched_s=0.1)).case("jam").peak_moment_Nm > 0.0


def test_commands_say_which_peak_a_drive_takes(cli) -> None:
    assert "--speed" in cli.refused("failures", "joint", "--speed", "10 rpm")
    assert "allowed" in cli.refused("duty", "joint", "--speed", "10 rpm")
    assert "a speed such as" in cli.refused("duty", "joint", "--speed", "10")
