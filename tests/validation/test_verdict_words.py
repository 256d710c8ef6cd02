"""What a validation and a simulation say: instability, hunting, rows that are not met, standing off."""

import re
from dataclasses import fields, replace
from math import degrees, radians

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design import with_values
from actuator_lti.design.model import Requirement, Waiver
from analyses.large_signal.from_rest import RestSweep
from analyses.limit_cycles import LimitCycles
from analyses.motion import Asked, Motion
from analyses.motion.settling import SMALL, Settling, conduct, noticed, outcome, settle, settlings_of
from analyses.motion.settling import verdict_of as verdict_of_swing
from analyses.motion.settling import words as end_words
from analyses.specification import asked_figures
from analyses.specification.requirements import evaluate_requirements
from analyses.validation import CHECKS, Validation, validate
from analyses.validation.row import judged
from nonlinear import commands, simulate
from nonlinear.settling.rest import PERIODS, Rest
from reports import document as doc
from reports.sections.beyond import described
from reports.sections.cycles import summary as cycles_summary
from reports.sections.simulate import section
from reports.sections.validation import summary
from reports.verdict_summary import verdict_of
from tests.changed import changed

EMPS, JOINT = load_design("emps"), load_design("joint")
WAIVED = Waiver(requirement="swing", reason="known", date="2026-11-23")


def test_an_unstable_loop_is_not_met_and_its_response_still_is() -> None:
    result = validate(changed(EMPS, controller={"velocity": {"gain": 6.0e3}}), CHECKS)
    assert result.verdict == "not met"
    assert "the velocity loop is unstable" in str(result)
    assert not result.not_met  # the simulator's poles and response are those predicted, unstable as they are
    made = summary(result)
    items = next(block for block in made["blocks"] if block["kind"] == "verdicts")["items"]
    assert any(item["verdict"] == "not met" and "unstable" in item["reason"] for item in items)


def hunting(step_rad: float, swing_rad: float, hertz: float) -> Settling:
    rest = Rest(
        verdict="limit cycle", error=0.0, amplitude=swing_rad, motor_amplitude=swing_rad, frequency_hz=hertz,
        periods=8, limited=(), after_s=1.0, work=1,
    )  # fmt: skip
    return Settling(step_rad, 0.0, rest)


@pytest.mark.parametrize("name", ["emps", "fin"])
@pytest.mark.parametrize(("ends", "allowed", "waivers", "verdict"), [
    ("limit cycle", (), (), "not met"),
    ("limit cycle", (2.0,), (), "met"),
    ("limit cycle", (0.9,), (), "not met"),
    ("limit cycle", (2.0, 0.9), (), "not met"),
    ("still moving", (2.0,), (), "not proven"),
    ("still moving", (2.0,), (WAIVED,), "met"),
    ("limit cycle", (0.9,), (WAIVED,), "not met"),
    ("diverging", (2.0,), (), "not met"),
])  # fmt: skip
def test_who_states_a_swing_that_is_accepted_has_rest_judged_by_it(
    name: str, ends, allowed: tuple[float, ...], waivers: tuple[Waiver, ...], verdict: str, monkeypatch
) -> None:
    """Requirement, cycles, validation and friction give one verdict, whatever a step ends in."""
    bare, swing_rad = load_design(name), 2e-3
    unit, scale = ("m", 1.0) if bare.axis == "linear" else ("deg", degrees(1.0))
    asked = tuple(
        Requirement(id="swing" + "x" * k, quantity="limit_cycle", unit=unit, maximum=part * scale * swing_rad)
        for k, part in enumerate(allowed)
    )
    design = replace(bare, requirements=asked, waivers=waivers)
    step = hunting(0.1, swing_rad, 3.0)
    step = replace(step, rest=replace(step.rest, verdict=ends))
    small = hunting(0.01, 1e-2 * swing_rad, 3.0)  # of less swing than any that is accepted
    found = LimitCycles(design, (), (small, step), ())
    monkeypatch.setattr(asked_figures, "_answered", lambda *_: found)
    rows = (judged("bandwidth", "position", 1.0, 1.0, 0.1, unit="Hz"),)
    validation = Validation(design=design, rows=rows, figures={}, settlings=found.settlings)
    assert (found.verdict, validation.verdict) == (verdict, verdict)
    requirements = evaluate_requirements(design)
    assert not asked or all(one.passes for one in requirements) == (verdict == "met")
    said = [summary(validation)["result"], str(validation), cycles_summary(found)]
    said += [one.reason for one in requirements]
    assert all(("by requirement swing" in one) == (verdict == "met" and not waivers) for one in said)
    assert ("does not come to rest" in " ".join(said)) == (verdict == "not met")
    made = summary(validation)
    told = next(one for one in made["findings"] if "step of" in one["text"])  # said on the first screen
    grave = {"met": "info", "not met": "fail", "not proven": "warn"}[verdict]
    assert told["severity"] == grave
    doc.waived([made], design)
    assert verdict_of([made], "validation")["passed"] == (verdict == "met")


@pytest.mark.parametrize(("gain", "demanded"), [(4000.0, False), (4000.0, True), (120.0, False)])
def test_a_step_after_which_the_drive_hunts_is_the_last_that_is_asked(gain: float, demanded: bool) -> None:
    """The largest first; where a swing is accepted, or all end at rest, every size is asked."""
    asked = (Requirement(id="swing", quantity="limit_cycle", unit="deg", maximum=1e-9),) if demanded else ()
    amber = with_values(load_design("ilr33-amber"), {"control.position.gain": gain})
    design = replace(amber, requirements=asked)
    found = settlings_of(design, loads_Nm=(0.0,))
    full, shares = design.validation.full_deflection_rad, {SMALL, *design.validation.amplitude_fractions}
    whole = gain == 120.0 or demanded
    assert [one.amplitude_rad for one in found] == [full * x for x in (sorted(shares) if whole else [1.0])]
    swing = noticed(design, found)
    assert (swing is None) == (gain == 120.0)
    assert verdict_of_swing(design, swing).value == ("met" if gain == 120.0 else "not met")


@pytest.mark.parametrize(("part", "hunts"), [(2e-10, False), (1e-3, True)])
def test_a_swing_that_nothing_shows_fails_nothing(part: float, hunts: bool) -> None:
    """Seed 100035 hunts by 8e-14 rad of 4e-4 (plain integration says the same): a verdict of no use."""
    size = part * EMPS.validation.full_deflection_rad
    validation = Validation(design=EMPS, rows=(), figures={}, settlings=(hunting(size, size, 3.0),))
    assert (validation.hunting is not None) is hunts


@pytest.mark.parametrize(("swing_rad", "motor_rad", "said"), [
    (0.0, 0.0, "stands still 40 s later; whether it stays is not known"),
    (1e-5, 1e-5, "still moving 40 s later, by ±0.000573 deg"),
    (0.0, 1e-5, "still moving 40 s later, by ±0.000573 deg (motor over the ratio, the output at rest)"),
])  # fmt: skip
def test_what_does_not_move_is_not_said_to_be_moving(swing_rad: float, motor_rad: float, said: str) -> None:
    """1e-5 rad are 5.73e-4 deg; nothing is no motion."""
    rest = replace(hunting(0.1, swing_rad, 3.0).rest, verdict="still moving", frequency_hz=None, after_s=40.0)
    rest = replace(rest, motor_amplitude=motor_rad)
    assert end_words(rest, degrees(1.0), "deg") == said


def test_nothing_judged_is_not_proven() -> None:
    rough = judged("bandwidth", "position", 1.0, 1.0, 0.1, unit="Hz", resolved=False)
    for rows in ((), (rough,)):
        assert Validation(design=EMPS, rows=rows, figures={}).verdict == "not proven"


def test_points_without_motion_are_left_out_without_a_warning() -> None:
    """Half the size and a quarter turn late where both move: 6 dB and 90 deg; NaN and 0 elsewhere."""
    expected = np.array([1.0, np.nan, 1.0, complex(np.nan, np.nan)])
    measured, nothing = np.array([-0.5j, 1.0, 0.0, 0.0]), np.zeros(4)
    sweep = RestSweep(*([nothing] * len(fields(RestSweep))))
    words = described(replace(sweep, measured=measured, described=expected))
    assert "up to 6 dB and 90 deg" in words
    assert "not compared" in described(replace(sweep, measured=nothing, described=expected))


AMBER = load_design("ilr33-amber")
LOUD = changed(AMBER, controller={"position": {"gain": 4000.0}})  # beyond the gain margin
PEAK_NM = AMBER.limits.peak_current_A * (AMBER.motor.torque_constant_Nm_A or 0.0)
STEP, SINE = commands.step(0.02), commands.sine(0.01, 5.0)


@pytest.mark.parametrize(("parts", "command", "duration_s", "ends"), [
    ({}, STEP, 0.02, "comes to rest"),  # what a step ends in is no matter of the run
    ({}, STEP, 0.4, "comes to rest"),
    ({"instruments": {"current_noise_A": 0.05}}, STEP, 0.3, "comes to rest"),  # noise is no limit cycle
    ({}, SINE, 0.5, "following"),
    ({}, commands.ramp(1.75), 1.0, "following"),  # 100 deg/s, of which the motor gives 22.7
    # limits hold the growing oscillation: it neither dies out nor runs away
    ({"controller": LOUD.controller}, commands.step(0.05), 0.5, "limit cycle"),
    # the rotor stays, the current is at its limit
    ({"friction": {"dry_torque_Nm": 2.0 * PEAK_NM}}, commands.step(0.1), 0.5, "sits on a limit"),
])  # fmt: skip
def test_what_a_run_ends_in_and_only_what_nobody_wants_is_marked(parts, command, duration_s, ends):
    design = changed(AMBER, **parts)
    run = simulate(design, command, duration_s)
    result = conduct(run)
    assert result.status == ends
    assert ("Hz" in result.detail) == (ends == "limit cycle")
    assert (result.detail == "") is (ends == "comes to rest")
    assert ("limited, of the time: speed 99" in result.detail) is (command.kind == "ramp")
    assert bool(result.later) == (duration_s == 0.02)  # 20 ms into a step that takes longer
    wanted = ends in ("comes to rest", "following")
    assert section(Motion(design, Asked(), run))["status"] == ("info" if wanted else "warn")


def test_a_period_longer_than_the_run_is_seen_beyond_it(cli) -> None:
    """The joint hunts in minutes after 3 deg: two periods at 0.00478 Hz are 418 s, the run is 0.3 s."""
    said = cli.data("simulate", "joint", "--amplitude", "3 deg", "--duration", "0.3")["status_detail"]
    beyond, hertz, periods = re.fullmatch(
        r"followed for (\S+) s beyond the run; ±.* at (\S+) Hz \((\d+) periods seen\)", said
    ).groups()
    assert float(beyond) > int(periods) / float(hertz) > 100.0


def test_a_limit_that_acts_only_after_the_run_says_so() -> None:
    """A torque drive runs up until its voltage is at its end; in a millisecond it has hardly moved."""
    torque = changed(AMBER, controller={"position": None, "velocity": None})
    early, late = (conduct(simulate(torque, commands.step(3.0), time)) for time in (1e-3, 2.0))
    assert early.status == late.status == "sits on a limit"
    assert re.fullmatch(r"followed for \S+ s beyond the run", early.later)
    assert not late.later


def test_what_diverges_only_after_the_run_says_so() -> None:
    """Twice what the back-drivable joint holds carries it off; in the first tick nothing has moved yet."""
    joint = load_design("joint")
    most = 2.0 * joint.limits.peak_current_A * joint.motor.torque_constant_Nm_A * joint.total_ratio
    run = simulate(joint, commands.step(0.01), 1e-3, load_Nm=-most)
    assert np.abs(run.output_angle_rad).max() < 0.1
    ended = conduct(run)
    assert ended.status == "diverging"
    assert re.fullmatch(r"followed for \S+ s beyond the run", ended.later)
    assert conduct(simulate(LOUD, STEP, 1e-3, limits_on=False)).status == "diverging"


SPEED_DRIVE = """
design = {{name = "turning"}}
encoder = {{{encoder}}}
limits = {{voltage = "48 V", speed = "900 rpm"}}
[motor]
resistance = "0.6 ohm"
inductance = "2 mH"
torque_constant = "0.4 N*m/A"
back_emf_constant = "0.4 V*s/rad"
rotor_inertia = "460 g*cm^2"
cogging = "{cogging}"
cogging_periods = 50
[control]
period = "25 us"
computing_delay = "25 us"
current = {{gain = "4 V/A", integral_time = "3 ms"}}
velocity = {{gain = "0.3 A*s/rad", integral_time = "50 ms", every = 40}}
"""
DIFFERENCE = 'speed = "difference", filter_time = "1 ms"'


@pytest.mark.parametrize(("encoder", "cogging", "turns", "ends", "words"), [
    ("", "68 mN*m", 1, "ripple", "at 50 Hz"),
    ("", "0 N*m", 1, "becomes steady", ""),
    (DIFFERENCE, "68 mN*m", 8, "ripple", "passing at 400 Hz"),  # seen every millisecond
    # speeds made of 4000 counts, 90 deg/s each, swing by themselves
    (f"{DIFFERENCE}, counts_per_rev = 4000", "68 mN*m", 8, "limit cycle", "without the cogging limit cycle"),
])  # fmt: skip
def test_what_swings_as_often_as_the_cogging_passes_is_its_ripple(
    cli, tmp_path, encoder: str, cogging: str, turns: int, ends: str, words: str
) -> None:
    """50 periods a turn, at so many turns a second."""
    path = tmp_path / "turning.toml"
    path.write_text(SPEED_DRIVE.format(cogging=cogging, encoder=encoder))
    said = cli.data("simulate", str(path), "--amplitude", f"{360 * turns} deg/s", "--duration", "1")
    assert said["status"] == ends
    assert words in said["status_detail"]
    assert words or "Hz" not in said["status_detail"]


@pytest.mark.parametrize(("millionths", "verdict"), [(0.5, "at rest"), (2.0, "limit cycle")])
def test_a_swing_too_small_to_count_is_rest_for_all_who_ask(millionths: float, verdict: str) -> None:
    """The joint hunts by its counts; beside a full deflection of two or half a million such swings."""
    joint, step = load_design("joint"), 1e-3
    rest = settle(joint, 0.0, step).rest
    run, short = (simulate(joint, commands.step(step), part / rest.frequency_hz) for part in (1.1, 0.9))
    swing = max(rest.amplitude, rest.motor_amplitude)
    full = 1e6 * swing / millionths
    design = changed(joint, validation={"full_deflection_rad": full})
    assert settle(design, 0.0, step).rest.verdict == "limit cycle"  # as the drive moves, whoever looks
    assert outcome(design, 0.0, step).rest.verdict == verdict
    said, result = section(Motion(design, Asked(), run)), conduct(run, full)
    assert result.status == ("comes to rest" if verdict == "at rest" else verdict)
    assert result.detail.startswith("a swing of ±") == (verdict == "at rest")
    assert (conduct(short, full).said == "") == (verdict == "at rest")  # no swing that it did not see
    assert result.status in said["result"]
    assert said["status"] == ("info" if result.wanted else "warn")


def test_the_command_line_says_it(cli) -> None:
    """In the figures that passages through the middle of a long run give."""
    arguments = ["simulate", "--amplitude", "3", "--duration", "0.5", "--quiet"]
    arguments += ["--set", "control.position.gain=4000 1/s"]
    assert "status limit cycle (" in cli.text(*arguments)
    facts = cli.data(*arguments)
    assert facts["status"] == "limit cycle"
    found = re.fullmatch(
        r"±(\S+) deg at (\S+) Hz \((\d+) periods seen, (.*) limit acting\)", facts["status_detail"]
    )
    run = simulate(LOUD, commands.step(radians(3.0)), 4.0)
    late = np.degrees(run.output_angle_rad[run.time_s.size // 2 :])
    above = late > 0.5 * (late.max() + late.min())
    passages = np.flatnonzero(above[1:] & ~above[:-1]) * run.period_s
    assert float(found[1]) == pytest.approx(0.5 * np.ptp(late), rel=5e-3)  # of three digits
    assert float(found[2]) == pytest.approx(1.0 / np.diff(passages).mean(), rel=5e-3)
    assert int(found[3]) >= PERIODS
    acting = [name for name, use in run.limits.items() if use.fraction > 0.0]
    assert found[4].split(" and ") == acting


@pytest.mark.parametrize("peak_time_s", [1.0, None])
def test_a_load_that_the_folded_current_does_not_hold_names_the_protection(peak_time_s) -> None:
    """A load of 4 times the continuous torque, which peak current holds and the friction does not."""
    joint = changed(JOINT, limits={"continuous_current_A": 2.0, "peak_time_s": peak_time_s})
    load = -4.0 * joint.motor.torque_constant_Nm_A * 2.0 * joint.total_ratio
    said = end_words(settle(joint, load, 0.01).rest, degrees(1.0), "deg")
    assert said.startswith("diverges, the overload protection (I2t)") == (peak_time_s is not None)
