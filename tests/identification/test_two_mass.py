"""A compliant drive from its frequency response, drive D of the reference numbers; benches, by commands."""

from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
import pytest

from actuator_lti.design import load_design, read_design_text, write_design
from actuator_lti.design.model import Coupling, Design, Friction, Gear, Gravity, PositionLoop
from actuator_lti.errors import InputError
from analyses.identification import two_mass
from analyses.identification.frequency_bench import FrequencyResult, identify_frequency
from analyses.identification.two_mass import NAMES
from analyses.records.record import Record
from examples.virtual_bench import TwoMassPlan, reversal_record, sweep_record
from examples.virtual_bench.__main__ import main as virtual_bench
from nonlinear import commands, simulate
from nonlinear.commands import Command
from tests.changed import changed
from tests.identification.bench_records import HALF_PLAY, bare, item_of, record_of, two_mass_design, write
from tests.refusals import refused

TRUTH = dict(zip(two_mass.NAMES, (2e-5, 2e-3, 400.0, 0.02, 1e-5, 1e-3), strict=True))
N, RATE, PERIODS, KM = 10.0, 2000, 8, 0.05
HERTZ = np.arange(2.0, 400.0, 2.0)


def _design() -> Design:
    """Without coupling and friction, inertias half of what they are; its tick is no part of the log's period.

    As of a recorder of its own: the records below are of a torque without steps between the samples.
    """
    return changed(
        two_mass_design(), friction=Friction(), coupling=None, motor={"rotor_inertia_kgm2": 1e-5},
        load={"inertia_kgm2": 1e-3, "friction": None}, controller={"period_s": 7e-5},
    )  # fmt: skip


@lru_cache(maxsize=1)
def _noiseless(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Torque, motor and load angle of a multisine in steady state: sums of lines, exact."""
    omega = 2.0 * np.pi * HERTZ
    phase = np.random.default_rng(7 + seed).uniform(0.0, 2.0 * np.pi, len(HERTZ))
    torque = 0.02 * np.exp(1j * phase)
    motor, load = two_mass.angle_responses(omega, TRUTH, N)
    time = np.arange(RATE) / RATE
    lines = np.exp(1j * np.outer(time, omega))
    return tuple(np.tile(np.real(lines @ a), PERIODS + 1) for a in (torque, motor * torque, load * torque))


def _record(seed: int) -> Record:
    """With instruments: 4096 counts at the motor, 60 mA rms on the current, 10 urad rms at the output."""
    rng = np.random.default_rng(seed)
    torque, motor, load = _noiseless(seed)
    time = np.arange(len(torque)) / RATE
    quantum = 2.0 * np.pi / 4096
    angle = np.floor((motor + 47.3 * time) / quantum + rng.uniform()) * quantum
    signals = {
        "current": torque / KM + 0.06 * rng.standard_normal(len(time)),
        "angle": angle,
        "output_angle": load + 4.73 * time + 1e-5 * rng.standard_normal(len(time)),
        "current_reference": torque / KM,
    }
    return record_of(time, "sweep", **signals)


def _lines(seed: int, *outputs: str) -> two_mass.Lines:
    record = _record(seed)
    told = replace(record, signals={**record.signals, "torque": KM * record["current"]})
    return two_mass.excited_lines(told, ("torque", *outputs), 0.5)


def test_intervals_hold_the_truth_at_their_rate_over_100_seeds() -> None:
    """95 % intervals: of 100 draws 88 to 100 hold the truth, for every parameter and both resonances."""
    held = dict.fromkeys((*two_mass.NAMES, "resonance", "antiresonance"), 0)
    truths = TRUTH | {"resonance": 632.4555, "antiresonance": 447.2136}
    for seed in range(100):
        lines = _lines(seed, "angle", "output_angle")
        fit = two_mass.fit_two_mass(lines, two_mass.start_of(lines, N), N)
        found = {name: (fit[name], fit.std(name)) for name in two_mass.NAMES}
        found |= {"resonance": fit.resonance_rad_s, "antiresonance": fit.antiresonance_rad_s}
        for name, (value, std) in found.items():
            held[name] += abs(value - truths[name]) <= 1.96 * std
    assert all(88 <= count <= 100 for count in held.values()), held


def test_a_speed_that_still_settles_moves_no_value() -> None:
    """By 5 rad/s with a time constant of 1.5 s, under quiet instruments: errors as large as they are said.

    Its leakage is alike at all lines: taken as noise, it made errors a thousand times larger.
    """
    found = []
    for seed in range(12):
        torque, motor, load = _noiseless(seed)
        time = np.arange(len(torque)) / RATE
        rng, moved = np.random.default_rng(seed), 47.3 * time + 7.5 * np.exp(-time / 1.5)
        torque = torque + 5e-5 * rng.standard_normal(len(time))
        motor = motor + moved + 1e-6 * rng.standard_normal(len(time))
        load = load + moved / N + 1e-7 * rng.standard_normal(len(time))
        record = record_of(time, "sweep", torque=torque, angle=motor, output_angle=load)
        lines = two_mass.excited_lines(record, ("torque", "angle", "output_angle"), 0.5)
        fit = two_mass.fit_two_mass(lines, two_mass.start_of(lines, N), N)
        assert fit.std("load_inertia") < 1e-3 * TRUTH["load_inertia"]
        found.append([(fit[name] - TRUTH[name]) / fit.std(name) for name in two_mass.NAMES])
    assert np.mean(np.square(found)) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / np.size(found)))


def test_the_motors_angle_alone_tells_the_drive_and_the_command_its_period() -> None:
    lines = _lines(1, "angle")
    fit = two_mass.fit_two_mass(lines, two_mass.start_of(lines, N), N)
    for name in ("motor_inertia", "load_inertia", "stiffness"):
        assert fit[name] == pytest.approx(TRUTH[name], abs=4.0 * fit.std(name))
        assert fit[name] == pytest.approx(TRUTH[name], rel=0.01)
    assert two_mass.period_of_excitation(_record(0), "current_reference") == pytest.approx(0.5)
    noise = np.random.default_rng(0).standard_normal(4000)
    record = replace(_record(0).slice(0, 4000), signals={"current_reference": noise})
    refused(two_mass.period_of_excitation, record, "current_reference", words="does not repeat itself")


def test_a_two_mass_model_of_something_else_is_refused() -> None:
    """A response with a third mass: the misfit is far above its noise, and the design may not be written."""
    record = _record(4)
    omega = 2.0 * np.pi * HERTZ
    mode = 0.3 / (1.0 + 0.04j * omega / 1300.0 - (omega / 1300.0) ** 2)
    phase = np.random.default_rng(11).uniform(0.0, 2.0 * np.pi, len(HERTZ))
    motor, _ = two_mass.angle_responses(omega, TRUTH, N)
    time = np.arange(RATE) / RATE
    extra = np.real(np.exp(1j * np.outer(time, omega)) @ (0.02 * np.exp(1j * phase) * motor * mode))
    angle = record["angle"] + np.tile(extra, PERIODS + 1)
    signals = {name: v for name, v in record.signals.items() if name != "output_angle"}
    result = identify_frequency(_design(), replace(record, signals={**signals, "angle": angle}))
    assert result.fit.misfit > 3.0
    assert not result.passed


def test_what_the_design_alone_tells_is_said_with_what_it_moves() -> None:
    """The records have no load friction: a design that has some gives the same resonance, and another k.

    With r = 1/N + CM in the place of 1/N the same lines are those of k, c, J_l and Cv_l over N r.
    """
    plain = identify_frequency(_design(), _record(5))
    assert "+10 % of every value" in plain.fit.fixed["torque_constant"].reason
    assert "load_coefficient" not in plain.fit.fixed
    design = replace(_design(), friction=replace(_design().friction, load_coefficient=0.005))
    result = identify_frequency(design, _record(5))
    item = item_of(result, "kept-load_coefficient")
    assert item.passed is None
    assert "of load_inertia, stiffness, damping, load_viscous" in item.reason
    assert result.fit["stiffness"] * (1.0 + 0.005 * N) == pytest.approx(plain.fit["stiffness"], rel=1e-4)
    assert result.fit.resonance_rad_s == pytest.approx(plain.fit.resonance_rad_s, rel=1e-4)


def test_what_the_design_cannot_hold_is_fixed_or_refused() -> None:
    record = _record(5)
    result = identify_frequency(_design(), record, fixed={"coupling.damping": 0.02})
    assert result.fit["damping"] == 0.02 == result.fit.fixed["damping"].value
    assert read_design_text(result.text).coupling is not None
    # its N/A times amperes over the motor's rad was taken for a mass
    refused(identify_frequency, load_design("ballscrew"), record, words=("linear", "of a rotary drive"))
    wrong = {"motor.resistance": 1.0}
    refused(identify_frequency, _design(), record, fixed=wrong, words="can be fixed here")
    blind = replace(record, signals={name: v for name, v in record.signals.items() if name != "angle"})
    refused(identify_frequency, _design(), blind, words="motor angle is needed")


BENCH_TRUTH = dict(zip(NAMES, (2e-5, 2e-3, 400.0, 0.02, 1e-5, 0.02), strict=True))
RESONANCE, ANTIRESONANCE = np.sqrt(400.0 * 1000.0), np.sqrt(400.0 / 2e-3)


def _guess() -> Design:
    design = two_mass_design()
    motor = replace(design.motor, rotor_inertia_kgm2=1.5e-5)
    return replace(design, motor=motor, coupling=Coupling(stiffness_Nm_rad=300.0))


@cache
def _identified(seed: int) -> FrequencyResult:
    design = two_mass_design()
    play = reversal_record(design, seed=seed)
    return identify_frequency(_guess(), sweep_record(design, seed=seed), play_record=play)


def held(result: FrequencyResult) -> dict[str, bool]:
    """Whether each 95 % interval holds the truth; a value fixed at zero has none, and is left out."""
    fit, play = result.fit, result.play
    outcome = {
        name: (fit[name], fit.std(name), truth) for name, truth in BENCH_TRUTH.items() if name in fit.names
    }
    outcome |= {
        "resonance": (*fit.resonance_rad_s, RESONANCE),
        "antiresonance": (*fit.antiresonance_rad_s, ANTIRESONANCE),
        "play": (play.half_rad, play.half_std_rad, HALF_PLAY),
    }
    return {name: abs(value - truth) <= 1.96 * std for name, (value, std, truth) in outcome.items()}


def test_the_simulated_drive_is_identified_within_its_intervals() -> None:
    """Six draws (100 by hand): of some 54 intervals at 95 % all but six hold the truth (odds 0.98).

    Of seed 25 the start from the response itself leads astray: another one is taken.
    """
    results = [_identified(seed) for seed in range(6)]
    kept = [held(result) for result in results]
    assert sum(sum(one.values()) for one in kept) >= sum(len(one) for one in kept) - 6
    misfits = [result.fit.misfit for result in results]
    assert 0.9 < np.mean(misfits) < 1.1  # the noise of the lines is what they scatter by
    for result in results:
        assert result.passed, result.items
        (dry,) = (item for item in result.items if item.id == "kept-load_dry")
        assert dry.passed is None
        assert result.fit["stiffness"] == pytest.approx(400.0, rel=0.03)
        assert result.fit.resonance_rad_s[0] == pytest.approx(RESONANCE, rel=1e-3)
        assert result.design.coupling.play_rad == pytest.approx(2.0 * HALF_PLAY, rel=0.02)
    astray = _identified(25)
    assert astray.passed
    assert astray.fit["stiffness"] == pytest.approx(400.0, rel=0.03)
    # the twist in contact is b + T/k: an error of k moves b by T/k times it
    result = _identified(0)
    share = result.fit.std("stiffness") / result.fit["stiffness"]
    torque = 0.05 * 10.0 * 0.5  # N m at the coupling: half of the motor's peak, as the inertias are equal
    assert result.play.half_std_rad > 0.3 * share * torque / 400.0


def test_where_the_bench_cannot_measure_and_its_record_does_not_tell() -> None:
    design = two_mass_design()
    brief = reversal_record(design, seed=0).slice(0, 200)
    with pytest.raises(InputError, match="must reverse"):
        identify_frequency(_guess(), sweep_record(design, seed=0), play_record=brief)
    refused(sweep_record, design, TwoMassPlan(moment_Nm=0.05), words="leaves its flank")
    refused(sweep_record, replace(design, coupling=None), words="current loop and a coupling")


def test_a_small_friction_is_not_held_at_zero() -> None:
    """Cv is half to all of its error here: at zero, its part would make the damping 1 % too large.

    The mean over ten draws is within 2.6 of its error (0.6 of one draw's); it was 0.7 of it too large.
    """
    found = []
    for seed in range(10):
        fit = identify_frequency(_guess(), sweep_record(two_mass_design(), seed=seed)).fit
        found.append((fit["damping"] - 0.02) / fit.std("damping"))
    assert abs(np.mean(found)) < 2.6 / np.sqrt(10.0)
    assert np.std(found) < 1.6


WRONG = ("motor.rotor_inertia=1.1 kg*cm^2", "load.inertia=0.4 kg*m^2", "coupling.stiffness=1.7e4 N*m/rad")


def _set(*changes: str) -> list[str]:
    return [part for change in changes for part in ("--set", change)]


def test_a_robot_joint_from_its_simulated_bench(tmp_path, cli) -> None:
    """Truth: the shipped joint with 2 mrad of play; start: inertias and stiffness 20 to 30 % off.

    Its friction grows with the load (CM) and it has dry friction on both sides: both are in the truth.
    """
    bench, out = tmp_path / "bench", tmp_path / "o"
    made = _set("instruments.current_noise=30 mA", "coupling.play=2 mrad")
    virtual_bench([str(bench), "--sweep", "--design", "joint", "--seed", "3", *made])
    files = ["--frequency-response", bench / "sweep.csv", "--play", bench / "reversal.csv"]
    ran = cli("identify", *files, "--design", "joint", *_set(*WRONG), "--out", out, "--json")
    result = ran.data
    assert not ran.status, result["items"]
    design = load_design("joint")
    truth = {
        "motor_inertia": design.motor_side_inertia_kgm2,
        "load_inertia": design.load_side_inertia_kgm2,
        "stiffness": design.coupling.stiffness_Nm_rad,
        "damping": design.coupling.damping_Nms_rad,
        "play": 2e-3,
    }
    for label, value in truth.items():
        found = result["found"]["parameters"][label]
        assert found["value"] == pytest.approx(value, abs=3.0 * found["standard_error"]), label
        assert found["standard_error"] < 0.03 * value, label
    written = load_design(next(out.glob("*.toml")))
    assert written.coupling.play_rad == pytest.approx(2e-3, rel=0.06)
    assert written.parameters["coupling.play"].tolerance is not None
    assert {check["id"]: check for check in result["items"]}["written-sweep.csv"]["value"] < 0.05
    assert "two-mass" in (out / "identification.html").read_text()


DURATION = 8.0


def _joint(mass_kg: float, dry: float, viscous: float, load_friction: float, inertia: float) -> Design:
    """100:1, back-drivable, 12 V; the position loop sets the voltage."""
    motor = {"rotor_inertia_kgm2": 1e-6, "resistance_ohm": 5.0, "inductance_H": 3e-4}
    motor |= dict.fromkeys(("torque_constant_Nm_A", "back_emf_constant_Vs_rad"), 0.01)
    friction = {"dry_torque_Nm": dry, "viscous_Nms_rad": viscous, "load_coefficient": load_friction}
    gravity = Gravity(mass_kg=mass_kg, arm_m=0.15, offset_rad=np.pi)
    load = {"path": "back-drivable", "inertia_kgm2": inertia, "moment_max_Nm": 0.0, "gravity": gravity}
    control = {"period_s": 1e-3, "computing_delay_s": 0.0, "position": PositionLoop(gain=0.4)}
    control |= {"current": None, "velocity": None}
    free = ("speed_rad_s", "acceleration_rad_s2", "peak_current_A", "continuous_current_A")
    return changed(
        bare("ilr33-amber"), name="joint", gears=(Gear(name="gear", ratio=100.0),), motor=motor, load=load,
        friction=friction, controller=control, limits={"voltage_V": 12.0, **dict.fromkeys(free, np.inf)},
    )  # fmt: skip


def _smooth_steps(levels: list[float]) -> Command:
    """Step-like: from level to level in 0.3 s each, as servo commands are."""
    time = np.arange(0.0, DURATION + 0.01, 1e-2)
    each = DURATION / len(levels)
    knots, values = [0.0], [0.0]
    for k, level in enumerate(levels):
        knots += [k * each + 0.3, (k + 1) * each]
        values += [level, level]
    return commands.sampled(time, np.interp(time, knots, values))


MOTIONS = {
    "sine": commands.sine(0.8, 0.4),
    "steps": _smooth_steps([0.7, -0.5, 1.0, 0.2, -0.9, 0.0]),
    "lifting": _smooth_steps([1.4, 1.4, -1.4, 0.0]),
    "waves": commands.multisine(1.2, [0.25, 0.6, 1.1], DURATION, 1e-3, seed=3),
}


def _log(folder: Path, drive: Design, name: str, seed: int) -> Path:
    """100 Hz, 4096 counts at the output, 30 mV and 10 mA rms of noise; the supply sags by a fifth under way.

    The motor has its share of that supply, so the loop's gain falls with it.
    """
    time = np.arange(0.0, DURATION + 0.01, 1e-2)
    bus = 12.0 - 2.4 * np.abs(np.sin(0.9 * time))
    supply = commands.sampled(time, bus)
    run = simulate(drive, MOTIONS[name], DURATION, supply=supply, supply_scales=True)
    every, rng = slice(None, None, 10), np.random.default_rng(seed)
    quantum = 2.0 * np.pi / 4096
    rows = len(run.time_s[every])
    table = {
        "time_s": run.time_s[every],
        "goal_position [deg]": np.degrees(run.reference_rad[every]),
        "joint_angle [deg]": np.degrees(np.floor(run.output_angle_rad[every] / quantum) * quantum),
        "current [mA]": 1e3 * run.current_A[every] + 10.0 * rng.standard_normal(rows),
        "voltage [V]": run.voltage_V[every] + 0.03 * rng.standard_normal(rows),
        "supply [V]": np.interp(run.time_s[every], time, bus),
    }
    return write(folder / f"{name}.csv", table, mark=";", fmt="%.8g")


def test_the_joint_is_identified_and_meets_its_records_within_0_06_rad(tmp_path, cli) -> None:
    """Identified from two motions, held against all of them; the guess misses them by more."""
    drive, guess = _joint(0.8, 1.2e-3, 4e-6, 1.5e-3, 0.02), tmp_path / "guess.toml"
    guess.write_text(write_design(_joint(0.5, 0.8e-3, 2e-6, 0.5e-3, 0.014)))
    files = {name: _log(tmp_path, drive, name, k) for k, name in enumerate(MOTIONS)}
    ran = cli(
        "identify", files["waves"], files["lifting"], "--validate", files["steps"],
        "--design", guess, "--inertia-to", "load.inertia", "--out", tmp_path, "--json",
    )  # fmt: skip
    assert ran.status == 0, [check for check in ran.data["items"] if check["passed"] is False]
    (found,) = (one for one in ran.data["design_values"] if one["name"] == "gravity")
    assert found["design"] == pytest.approx(0.5 * 9.80665 * 0.15, rel=1e-6)
    assert found["found"] == pytest.approx(0.8 * 9.80665 * 0.15, rel=0.05)
    written = tmp_path / "joint-identified.toml"
    gravity = load_design(written).load.gravity
    assert gravity.peak_Nm == pytest.approx(0.8 * 9.80665 * 0.15, rel=0.05)
    after, before = (cli("correlate", one, *files.values(), "--json").data for one in (written, guess))
    for record in after["records"]:
        assert record["signals"]["output_angle"]["mean_error"] < 0.06
    errors = [told["summary"]["output_angle"]["mean_error"] for told in (after, before)]
    assert errors[0] < 0.5 * errors[1]
