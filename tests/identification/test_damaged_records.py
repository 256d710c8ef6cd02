"""Damaged and misread records are put right and said, or give no design; an undamaged one says nothing."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from actuator_lti.design import load_design, with_values
from actuator_lti.design.model import Design
from analyses.identification.bench import BenchResult, identify_bench
from analyses.records.record import Record, RowCounts
from benchmarks.random_records import KINDS, VALUES, random_record
from tests.identification.bench_records import Columns, columns_of, motion

BASE = load_design("ilr33-amber")
TRUTH = {"friction.dry_torque": 3e-3, "friction.viscous": 4e-6, "motor.rotor_inertia": 1.3e-6}
ALL = ("reference", "angle", "speed", "current")
BARE = ("angle", "current")
Damage = Callable[[Columns], Columns]


@pytest.fixture(scope="module")
def drive() -> Design:
    return with_values(BASE, TRUTH)


@pytest.fixture(scope="module")
def columns(drive: Design) -> Columns:
    table = columns_of(motion(2, design=drive), 1)
    return {
        "time": table["time_s"],
        "reference": np.radians(table["reference_deg"]),
        "angle": table["motor_angle_rad"],
        "speed": table["motor_speed_rpm"] * np.pi / 30.0,
        "current": table["current_A"],
    }


def _record(columns: Columns, names: tuple[str, ...] = ALL) -> Record:
    signals = {name: columns[name] for name in names}
    rows = RowCounts(rows_in=len(columns["time"]), rows_out=len(columns["time"]))
    return Record(name="r", time_s=columns["time"], signals=signals, units={}, counts=rows)


def _later(seconds: float) -> Damage:
    return lambda c: {**c, "current": np.interp(c["time"] - seconds, c["time"], c["current"])}


def _clipped(share: float) -> Damage:
    def change(columns: Columns) -> Columns:
        level = np.quantile(np.abs(columns["current"]), share)
        return {**columns, "current": np.clip(columns["current"], -level, level)}

    return change


def _said(result: BenchResult) -> str:
    return "; ".join(f"{one.subject}: {one.text}" for one in result.findings["r"] if one.passed is not True)


def _is_the_truth(result: BenchResult, drive: Design, near: float) -> bool:
    friction = drive.friction
    wanted = {
        "inertia": drive.inertia_kgm2, "dry": friction.dry_torque_Nm, "viscous": friction.viscous_Nms_rad
    }  # fmt: skip
    model = result.model
    return all(
        abs(model[name] / value - 1.0) < near and abs(model[name] - value) < 3.5 * model.std(name)
        for name, value in wanted.items()
    )


@pytest.mark.parametrize("signals", [ALL, BARE], ids=["all", "bare"])
@pytest.mark.parametrize("late_ms", [10.0, 1.0, -1.0])
def test_a_lag_is_found_to_a_tenth_of_a_sample_and_taken_back(
    late_ms: float, signals: tuple[str, ...], columns: Columns, drive: Design
) -> None:
    result = identify_bench(BASE, [_record(_later(1e-3 * late_ms)(columns), signals)])
    found = re.search(r"the current is (\S+) ms .* (later|earlier) than the motion", _said(result))
    assert found is not None
    assert float(found[1]) * (1.0 if found[2] == "later" else -1.0) == pytest.approx(late_ms, abs=0.1)
    assert _is_the_truth(result, drive, 0.01)


@pytest.mark.parametrize("signals", [ALL, BARE], ids=["all", "bare"])
def test_clipped_current_is_left_out(signals: tuple[str, ...], columns: Columns, drive: Design) -> None:
    result = identify_bench(BASE, [_record(_clipped(0.95)(columns), signals)])
    assert "clipped" in _said(result)
    assert _is_the_truth(result, drive, 0.01)


def _scaled(factor: float, *names: str) -> Damage:
    return lambda c: {**c, **{name: factor * c[name] for name in names}}


WRONG: dict[str, tuple[Damage, dict[str, float], str]] = {
    "rms of AC as DC": (_scaled(1.5**-0.5, "current"), {}, "root 3/2"),
    "counts of the encoder": (_scaled(4.0, "angle", "speed"), {}, "the scale of angle and speed"),
    "torque constant 20 % off": (
        dict, {"motor.torque_constant": 7.08e-3, "motor.back_emf_constant": 7.08e-3}, "factor 1.2"
    ),
    "load friction": (dict, {"friction.load_coefficient": 1.34e-5}, "Load friction is 100 times"),
}  # fmt: skip


@pytest.mark.parametrize("signals", [ALL, BARE], ids=["all", "bare"])
@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_put_right_gives_no_design(
    name: str, signals: tuple[str, ...], columns: Columns, drive: Design
) -> None:
    """The design is the drive's own but for what is wrong in it."""
    damage, wrong, reason = WRONG[name]
    records = [_record(damage(columns), signals)]
    if name == "load friction":
        loaded = motion(5, load_Nm=5.0, design=drive)
        table = {"time": loaded.time_s[::10], "angle": loaded.motor_angle_rad[::10]}
        table |= {"current": loaded.current_A[::10], "torque": np.full(len(table["time"]), 5.0)}
        records.append(replace(_record(table, ("angle", "current", "torque")), name="loaded"))
    result = identify_bench(with_values(drive, wrong), records)
    assert not result.passed
    assert reason in "; ".join(item.reason for item in result.items)


def test_a_load_that_was_not_recorded_is_named_with_its_size(drive: Design) -> None:
    run = motion(2, load_Nm=6.0, design=drive)
    table = {"time": run.time_s[::10], "angle": run.motor_angle_rad[::10], "current": run.current_A[::10]}
    result = identify_bench(drive, [_record(table, BARE)])
    assert not result.passed
    assert "as under a load of 6.0" in "; ".join(item.reason for item in result.items)


def test_a_load_friction_that_no_load_excites_is_not_determined(columns: Columns, drive: Design) -> None:
    """1 000 times too large, over a record without a load: neither met nor failed, and it says why."""
    wrong = with_values(drive, {"friction.load_coefficient": 1e3 * drive.friction.load_coefficient})
    (item,) = (one for one in identify_bench(wrong, [_record(columns)]).items if one.id.startswith("kept-"))
    assert (item.id, item.passed) == ("kept-load_coefficient", None)
    assert item.reason == "is not excited at all: the design's value kept"


def test_a_drift_widens_the_intervals(columns: Columns, drive: Design) -> None:
    """All torques grow by 20 % along the record: the intervals about their mean hold the truth."""
    rise = 1.0 + 0.2 * columns["time"] / columns["time"][-1]
    result = identify_bench(BASE, [_record({**columns, "current": rise * columns["current"]})])
    assert "drift along the record: all torques change by +1" in _said(result)
    low, high = result.model.interval("dry")
    assert low < drive.friction.dry_torque_Nm < high


def test_a_clock_a_little_off_is_said_and_widens_the_intervals(columns: Columns, drive: Design) -> None:
    """1 % slow: the inertia is 2 % off, which no torque shows, but the speed beside the angle does."""
    result = identify_bench(BASE, [_record({**columns, "time": 1.01 * columns["time"]}, (*BARE, "speed"))])
    assert "off, or the scale of one of them, beyond their noise" in _said(result)
    low, high = result.model.interval("inertia")
    assert low < drive.inertia_kgm2 < high < 1.1 * drive.inertia_kgm2
    right = identify_bench(BASE, [_record(columns, (*BARE, "speed"))])
    assert "beyond their noise" not in _said(right)
    assert right.model.std("inertia") < 0.1 * result.model.std("inertia")


@pytest.mark.parametrize("signals", [ALL, BARE], ids=["all", "bare"])
def test_an_undamaged_record_says_nothing(signals: tuple[str, ...], columns: Columns, drive: Design) -> None:
    result = identify_bench(BASE, [_record(columns, signals)])
    assert result.passed
    assert "at one time" not in _said(result)
    assert "clipped" not in _said(result)
    assert "drift" not in _said(result)
    assert _is_the_truth(result, drive, 0.005)


@pytest.mark.parametrize("kind", [KINDS[0], KINDS[3]])
def test_intervals_hold_what_they_say(kind: str) -> None:
    """Eight random drives: error over stated error is about one, rms (the benchmark draws a hundred)."""
    errors = []
    for seed in range(8):
        design, truth, record = random_record(kind, seed)
        model = identify_bench(design, [record]).model
        errors += [(model[name] - truth[name]) / model.std(name) for name in VALUES]
    assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.4
