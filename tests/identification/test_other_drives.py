"""Records of other drives: a linear axis with a spring, a servo on a voltage, a fin with play, a joint.

Each record is made by the simulator from a shipped design and read by the command line; the identification
starts from a design whose inertia and friction are wrong by 40 %.
"""

import json
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
    motor = {"rotor_inertia_kgm2": 1.4 * design.motor.rotor_inertia_kgm2}
    return changed(design, motor=motor, friction=friction)


DEG, COUNT = 180.0 / np.pi, 2.0 * np.pi / 65536
Log = dict[str, tuple[str, float, float]]
LOGS: dict[str, Log] = {  # column, what it is of a run, its scale, its noise (rms)
    "ballscrew": {
        "time [ms]": ("time_s", 1e3, 0.0), "position_reference [mm]": ("reference_rad", 1e3, 0.0),
        "position [mm]": ("output_angle_rad", 1e3, 0.0), "Irms [A]": ("current_A", 1.5**-0.5, 0.01),
    },
    "fin": {
        "time_s": ("time_s", 1.0, 0.0), "cmd_deg": ("reference_rad", DEG, 0.0),
        "fin_angle_deg": ("output_angle_rad", DEG, 0.0), "motor_angle_deg": ("motor_angle_rad", DEG, 0.0),
        "current_mA": ("current_A", 1e3, 20.0), "voltage_V": ("voltage_V", 1.0, 0.0),
    },
    "joint": {
        "time_s": ("time_s", 1.0, 0.0), "goal_position_deg": ("reference_rad", DEG, 0.0),
        "joint_angle_deg": ("output_angle_rad", DEG, 0.0),
        "motor_position_rad": ("motor_angle_rad", 1.0, 0.0), "iq_A": ("current_A", 1.0, 0.02),
    },
    "ctms-motor-position": {
        "time_s": ("time_s", 1.0, 0.0), "reference_rad": ("reference_rad", 1.0, 0.0),
        "angle_rad": ("motor_angle_rad", 1.0, 1e-4), "voltage_V": ("voltage_V", 1.0, 0.0),
    },
    "ilr33-amber": {
        "time_s": ("time_s", 1.0, 0.0), "reference_rad": ("reference_rad", 1.0, 0.0),
        "motor_angle_rad": ("motor_angle_rad", 1.0, 0.0), "current_A": ("current_A", 1.0, 0.01),
    },
}  # fmt: skip


def _log(run: Trajectory, name: str) -> Columns:
    """What a drive's recorder writes; the fin's counts 65536 a turn."""
    noise = np.random.default_rng(7).standard_normal(len(run.time_s))
    seen = {key: getattr(run, key) for key, _, _ in LOGS[name].values()}
    if name == "fin":
        seen["output_angle_rad"] = np.floor(seen["output_angle_rad"] / COUNT) * COUNT
    return {column: scale * seen[key] + rms * noise for column, (key, scale, rms) in LOGS[name].items()}


class Case(NamedTuple):
    """A drive, its motion and log, how near the truth values are to come (relative), what is not logged."""

    name: str
    command: Command
    seconds: float
    every: int
    near: dict[str, float]
    met: float
    but: str = ""


JOINT = ("joint", commands.multisine(0.8, [0.2, 0.5, 1.1], 8.0, 6.25e-5, seed=2), 8.0, 32,
         {"inertia": 0.002, "dry": 0.01, "viscous": 0.01}, 0.04)  # fmt: skip
"""Reverses under load: there motor and load turn back at different instants, 3 mrad of twist apart.

Without the load's angle its motion follows by the design's coupling, without the motor's that is the load's
and the twist.
"""
CASES = [
    Case("ballscrew", commands.multisine(0.02, [0.5, 1.3, 2.9], 6.0, 6.25e-5, seed=2), 6.0, 16,
         {"inertia": 0.002, "dry": 0.02, "viscous": 0.03}, 0.02),
    Case("fin", commands.multisine(0.12, [0.7, 2.3, 4.1], 6.0, 2e-4, seed=2), 6.0, 5,
         {"inertia": 0.005, "dry": 0.01, "load_coefficient": 0.02}, 0.04),
    Case(*JOINT),
    Case(*JOINT, but="joint_angle_deg"),
    Case(*JOINT, but="motor_position_rad"),
    Case("ctms-motor-position", commands.multisine(1.0, [0.5, 1.1, 2.3], 8.0, 1e-3, seed=2), 8.0, 1,
         {"inertia": 0.002, "viscous": 0.02}, 0.02),
    Case("ilr33-amber", commands.multisine(0.15, [0.5, 1.3, 2.9], 6.0, 1e-4, seed=2), 6.0, 10,
         {"inertia": 0.001, "dry": 0.02, "viscous": 0.02}, 0.02),
]  # fmt: skip


def _logged(case: Case) -> Columns:
    table = _log(simulate(bare(case.name), case.command, case.seconds, record_every=case.every), case.name)
    table.pop(case.but, None)
    return table


def _truth(design: Design, name: str) -> float:
    keys = {"dry": "dry_torque_Nm", "viscous": "viscous_Nms_rad"}
    return design.inertia_kgm2 if name == "inertia" else getattr(design.friction, keys.get(name, name))


@pytest.mark.parametrize("case", CASES, ids=[f"{case.name} {case.but}" for case in CASES])
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


def test_a_fault_on_a_linear_axis_is_named(tmp_path, identify) -> None:
    """Friction behind the coupling counts in the common factor of a wrong scale of the current."""
    table = _logged(CASES[0])
    table["current_A"] = table.pop("Irms [A]")
    ran = identify(table, "ballscrew", mark=";")
    assert ran.status == 1
    assert "root 3/2 (rms of AC read as the equivalent DC" in json.dumps(ran.data["items"])
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


def test_correlate_begins_with_its_result_and_judges_on_demand(tmp_path, cli) -> None:
    design = bare("ctms-motor-position")
    run = simulate(design, commands.multisine(1.0, [0.5, 1.1], 4.0, 1e-3, seed=2), 4.0)
    write(tmp_path / "r.csv", _log(run, design.name))
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
    for name in ("r.csv", "r.toml"):
        result = cli("identify", tmp_path / name, "--design", tmp_path / "d.toml", "--json").data
        assert result["model"]["records"][0]["rows_in"] == 4000  # of the file
        near = 0.01 if name == "r.toml" else 0.05
        found = result["model"]["parameters"]["inertia"]["value"]
        assert found == pytest.approx(design.inertia_kgm2, rel=near)
    told = cli("identify", tmp_path / "r.csv", "--design", tmp_path / "d.toml").out
    assert 'missing = "interpolate"' in " ".join(told.split())
    assert "800 out" in " ".join(told.split())
