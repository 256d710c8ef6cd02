"""Damaged and misread records are put right and said, or give no design; an undamaged one says nothing."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from actuator_lti.design import load_design, with_values
from actuator_lti.design.model import Design
from analyses.identification.bench import BenchResult, identify_bench
from analyses.records.record import Record, RowCounts
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


@pytest.mark.parametrize("signals", [ALL, BARE], ids=["all", "bare"])
def test_an_undamaged_record_says_nothing(signals: tuple[str, ...], columns: Columns, drive: Design) -> None:
    result = identify_bench(BASE, [_record(columns, signals)])
    assert result.passed
    assert "at one time" not in _said(result)
    assert "clipped" not in _said(result)
    assert _is_the_truth(result, drive, 0.005)
