"""Records of other drives: a linear axis with a spring, a servo on a voltage, a fin with play, a joint.

Each record is made by the simulator from a shipped design and read by the command line; the identification
starts from a design whose inertia and friction are wrong by 40 %.
"""

import json
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from nonlinear import Trajectory, commands, simulate
from nonlinear.commands import Command
from tests.changed import changed
from tests.identification.bench_records import Columns, bare, write


def _wrong(design: Design) -> Design:
    keys = ("dry_torque_Nm", "viscous_Nms_rad", "load_coefficient")
    friction = {key: 0.6 * getattr(design.friction, key) for key in keys}
    return changed(
        design, motor={"rotor_inertia_kgm2": 1.4 * design.motor.rotor_inertia_kgm2}, friction=friction
    )


def _noise(run: Trajectory, rms: float) -> np.ndarray:
    return rms * np.random.default_rng(7).standard_normal(len(run.time_s))


def _linear(run: Trajectory) -> Columns:
    return {
        "time [ms]": 1e3 * run.time_s,
        "position_reference [mm]": 1e3 * run.reference_rad,
        "position [mm]": 1e3 * run.output_angle_rad,
        "Irms [A]": run.current_A / np.sqrt(1.5) + _noise(run, 0.01),
    }


def _fin(run: Trajectory) -> Columns:
    count = 2.0 * np.pi / 65536
    return {
        "time_s": run.time_s,
        "cmd_deg": np.degrees(run.reference_rad),
        "fin_angle_deg": np.degrees(np.floor(run.output_angle_rad / count) * count),
        "motor_angle_deg": np.degrees(run.motor_angle_rad),
        "current_mA": 1e3 * run.current_A + _noise(run, 20.0),
        "voltage_V": run.voltage_V,
    }


def _joint(run: Trajectory) -> Columns:
    return {
        "time_s": run.time_s,
        "goal_position_deg": np.degrees(run.reference_rad),
        "joint_angle_deg": np.degrees(run.output_angle_rad),
        "motor_position_rad": run.motor_angle_rad,
        "iq_A": run.current_A + _noise(run, 0.02),
    }


def _voltage(run: Trajectory) -> Columns:
    angle = run.motor_angle_rad + _noise(run, 1e-4)
    return {
        "time_s": run.time_s, "reference_rad": run.reference_rad, "angle_rad": angle,
        "voltage_V": run.voltage_V,
    }  # fmt: skip


def _servo(run: Trajectory) -> Columns:
    current = run.current_A + _noise(run, 0.01)
    return {
        "time_s": run.time_s, "reference_rad": run.reference_rad, "motor_angle_rad": run.motor_angle_rad,
        "current_A": current,
    }  # fmt: skip


class Case(NamedTuple):
    """A drive, its motion and log, how near the truth values are to come (relative), what is not logged."""

    name: str
    command: Command
    seconds: float
    every: int
    log: Callable[[Trajectory], Columns]
    near: dict[str, float]
    met: float
    but: str = ""


JOINT = ("joint", commands.multisine(0.8, [0.2, 0.5, 1.1], 8.0, 6.25e-5, seed=2), 8.0, 32, _joint,
         {"inertia": 0.002, "dry": 0.01, "viscous": 0.01}, 0.04)  # fmt: skip
"""Reverses under load: there motor and load turn back at different instants, 3 mrad of twist apart.

Without the load's angle its motion follows by the design's coupling, without the motor's that is the load's
and the twist.
"""
CASES = [
    Case("ballscrew", commands.multisine(0.02, [0.5, 1.3, 2.9], 6.0, 6.25e-5, seed=2), 6.0, 16, _linear,
         {"inertia": 0.002, "dry": 0.02, "viscous": 0.03}, 0.02),
    Case("fin", commands.multisine(0.12, [0.7, 2.3, 4.1], 6.0, 2e-4, seed=2), 6.0, 5, _fin,
         {"inertia": 0.005, "dry": 0.01, "load_coefficient": 0.02}, 0.04),
    Case(*JOINT),
    Case(*JOINT, but="joint_angle_deg"),
    Case(*JOINT, but="motor_position_rad"),
    Case("ctms-motor-position", commands.multisine(1.0, [0.5, 1.1, 2.3], 8.0, 1e-3, seed=2), 8.0, 1, _voltage,
         {"inertia": 0.002, "viscous": 0.02}, 0.02),
    Case("ilr33-amber", commands.multisine(0.15, [0.5, 1.3, 2.9], 6.0, 1e-4, seed=2), 6.0, 10, _servo,
         {"inertia": 0.001, "dry": 0.02, "viscous": 0.02}, 0.02),
]  # fmt: skip


def _logged(case: Case) -> Columns:
    table = case.log(simulate(bare(case.name), case.command, case.seconds, record_every=case.every))
    table.pop(case.but, None)
    return table


def _truth(design: Design, name: str) -> float:
    keys = {"dry": "dry_torque_Nm", "viscous": "viscous_Nms_rad"}
    return design.inertia_kgm2 if name == "inertia" else getattr(design.friction, keys.get(name, name))


@pytest.mark.parametrize("case", CASES, ids=[f"{case.log.__name__[1:]} {case.but}" for case in CASES])
def test_a_drive_is_found_from_its_record(case: Case, tmp_path, identify, cli) -> None:
    design = bare(case.name)
    ran = identify(_logged(case), _wrong(design), mark=";")
    result = ran.data
    assert not ran.status, [check for check in result["items"] if check["passed"] is False]
    for name, near in case.near.items():
        value, std = (result["model"]["parameters"][name][key] for key in ("value", "standard_error"))
        assert value == pytest.approx(_truth(design, name), rel=near), name
        assert abs(value - _truth(design, name)) < 2.5 * std, name
    errors = []
    for path in (next((tmp_path / "o").glob("*.toml")), tmp_path / "d.toml"):
        summary = cli("correlate", path, tmp_path / "r.csv", "--json").data["summary"]
        drive = [summary[name]["relative_error"] for name in ("current", "voltage") if name in summary]
        errors.append(max(drive))
    assert errors[0] < case.met < errors[1]


@pytest.mark.parametrize("name", ["ballscrew", "fin"])
@pytest.mark.parametrize("clock", [1.05, 0.95])
def test_a_clock_that_is_off_shows_in_the_following_error(name, clock, tmp_path, identify) -> None:
    """A position and a current alone: inertia and friction agree with any clock, the loops' gains do not."""
    table = _logged(next(case for case in CASES if case.name == name))
    first = next(iter(table))
    ran = identify({**table, first: clock * table[first]}, bare(name), mark=";")
    assert ran.status == 1
    checks = {one["id"]: one for one in ran.data["items"]}
    assert f"a clock about {100.0 * (clock - 1.0):+.1g}"[:15] in checks["following-r.csv"]["reason"]
    assert not list((tmp_path / "o").glob("*.toml"))


@pytest.mark.parametrize(
    ("was", "column", "factor", "status", "reason"),
    [
        ("Irms [A]", "current_A", 1.0, 1, "root 3/2 (rms of AC read as the equivalent DC"),
        ("position [mm]", "position [mm]", -1.0, 1, "the sign is turned"),
        ("time [ms]", "time [ms]", 1e-3, 2, "is the unit of the time right?"),
    ],
)
def test_a_fault_on_a_linear_axis_is_named(was, column, factor, status, reason, tmp_path, identify) -> None:
    """Friction behind the coupling counts in the common factor of a wrong scale of the current."""
    table = _logged(CASES[0])
    table[column] = factor * table.pop(was)
    ran = identify(table, "ballscrew", mark=";")
    assert ran.status == status
    assert reason in (ran.err if status == 2 else json.dumps(ran.data["items"]))
    assert not list((tmp_path / "o").glob("*.toml"))


def test_a_current_sampled_too_slowly_is_named(identify) -> None:
    """Steps of the voltage: the current peaks within a millisecond, the log has one row for each."""
    outer = dict.fromkeys(("position", "velocity", "current"))
    design = changed(bare("ilr33-amber"), controller=outer)
    time = np.arange(0.0, 2.0, 1e-4)
    steps = 3.0 * np.sign(np.sin(2.0 * np.pi * 1.25 * time))
    run = simulate(design, commands.sampled(time, steps), 2.0, record_every=10)
    columns = {"voltage_command_V": run.reference_rad, "motor_speed [rad/s]": run.motor_speed_rad_s}
    ran = identify({"time_s": run.time_s, **columns, "current_A": run.current_A}, design)
    failed = [check["reason"] for check in ran.data["items"] if not check["passed"]]
    assert ran.status == 1
    assert any("sampled too slowly" in reason for reason in failed)


def test_a_stepped_command_is_taken_as_steps(tmp_path, cli) -> None:
    """Logged at every tenth tick: taken as ramps of a millisecond, the current would be off by 20 %."""
    design = changed(bare("ilr33-amber"), controller={"position": None})
    time = np.arange(0.0, 1.5, 1e-4)
    speed = np.select([time < 0.2, time < 0.6, time < 1.0], [0.0, 300.0, -450.0], 200.0)
    run = simulate(design, commands.sampled(time, speed / design.total_ratio), 1.5, record_every=10)
    speed = {"target_speed [rad/s]": design.total_ratio * run.reference_rad}
    speed["motor_speed [rad/s]"] = run.motor_speed_rad_s
    write(tmp_path / "r.csv", {"time_s": run.time_s, **speed, "current_A": run.current_A})
    (tmp_path / "d.toml").write_text(write_design(design))
    summary = cli("correlate", tmp_path / "d.toml", tmp_path / "r.csv", "--json").data["summary"]
    assert max(summary[name]["relative_error"] for name in ("current", "speed")) < 1e-6


def test_correlate_begins_with_its_result_and_judges_on_demand(tmp_path, cli) -> None:
    design = bare("ctms-motor-position")
    run = simulate(design, commands.multisine(1.0, [0.5, 1.1], 4.0, 1e-3, seed=2), 4.0)
    write(tmp_path / "r.csv", _voltage(run))
    (tmp_path / "w.toml").write_text(write_design(_wrong(design)))
    for limit, verdict in (((), "PASS"), (("--error-limit", 0.1), "FAIL"), (("--error-limit", 50), "PASS")):
        ran = cli("correlate", tmp_path / "w.toml", tmp_path / "r.csv", *limit)
        assert ran.status == int(verdict == "FAIL")
        assert ran.out.startswith(f"{verdict}  ctms-motor-position: Motor angle of the model within")


def test_signals_at_several_rates(tmp_path, cli) -> None:
    """The current every 5 ms among rows of 1 ms: rows are dropped, which is said, or kept."""
    design = bare("ctms-motor-position")
    current = changed(design, motor={"inductance_H": 2e-3})
    run = simulate(current, commands.multisine(1.0, [0.5, 1.1], 4.0, 1e-3, seed=2), 4.0)
    sparse = [f"{value:.9g}" if k % 5 == 0 else "" for k, value in enumerate(run.current_A)]
    rows = zip(run.time_s, run.motor_angle_rad, sparse, strict=True)
    text = "time_s,angle_rad,current_A\n" + "".join(f"{t:.6f},{a:.9g},{i}\n" for t, a, i in rows)
    (tmp_path / "r.csv").write_text(text)
    (tmp_path / "r.toml").write_text(
        'file = "r.csv"\nmissing = "interpolate"\ntime = { column = "time_s" }\n'
        'signals.angle = { column = "angle_rad", unit = "rad" }\n'
        'signals.current = { column = "current_A", unit = "A" }\n'
    )
    (tmp_path / "d.toml").write_text(write_design(_wrong(current)))
    used = {}
    for name in ("r.csv", "r.toml"):
        result = cli("identify", tmp_path / name, "--design", tmp_path / "d.toml", "--json").data
        used[name] = result["model"]["records"][0]["rows_in"]
        near = 0.01 if name == "r.toml" else 0.05
        assert result["model"]["parameters"]["inertia"]["value"] == pytest.approx(
            design.inertia_kgm2, rel=near
        )
    assert used == {"r.csv": 800, "r.toml": 4000}
    told = cli("identify", tmp_path / "r.csv", "--design", tmp_path / "d.toml").out
    assert 'missing = "interpolate"' in " ".join(told.split())
