"""Simulated benches: of a compliant drive, and of a robot joint that moves a pendulum, by the commands."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from actuator_lti.design import load_design, write_design
from actuator_lti.design.model import Coupling, Design, Gear, Gravity, PositionLoop
from actuator_lti.errors import InputError
from analyses.identification.frequency_bench import FrequencyResult, identify_frequency
from analyses.identification.two_mass import NAMES
from examples.virtual_bench import TwoMassPlan, reversal_record, sweep_record
from examples.virtual_bench.__main__ import main as virtual_bench
from nonlinear import commands, simulate
from nonlinear.commands import Command
from tests.changed import changed
from tests.identification.bench_records import HALF_PLAY, bare, two_mass_design, write
from tests.refusals import refused

TRUTH = dict(zip(NAMES, (2e-5, 2e-3, 400.0, 0.02, 1e-5, 0.02), strict=True))
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
    outcome = {name: (fit[name], fit.std(name), truth) for name, truth in TRUTH.items() if name in fit.names}
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


def _record(folder: Path, drive: Design, name: str, seed: int) -> Path:
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
    files = {name: _record(tmp_path, drive, name, k) for k, name in enumerate(MOTIONS)}
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
