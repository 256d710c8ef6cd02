"""A robot joint that moves a pendulum, P controller on the voltage, through the command line alone.

Records of the simulator seen through instruments: gravity, load friction, a supply that sags.
"""

from pathlib import Path

import numpy as np
import pytest

from actuator_lti.design import load_design, write_design
from actuator_lti.design.model import Design, Gear, Gravity, PositionLoop
from nonlinear import commands, simulate
from nonlinear.commands import Command
from tests.changed import changed
from tests.identification.bench_records import bare, write

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
