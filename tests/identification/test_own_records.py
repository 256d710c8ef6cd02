"""Records that the simulator wrote, held against the same drive: the same run, so no error and no finding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from actuator_lti import load_design
from analyses.records.consistency import check_record
from analyses.records.record import Record, RowCounts
from tests.identification.bench_records import Command

AMBER = load_design("ilr33-amber")


@pytest.mark.parametrize(
    ("design", "motion"),
    [
        ("ilr33-amber", "--command step --amplitude 1 --duration 10"),
        ("ballscrew", "--command chirp --amplitude 1 --duration 0.5"),
        ("joint", "--command step --amplitude 1 --duration 0.5"),
        ("emps", "--command step --amplitude 1 --duration 0.3"),
    ],
)
def test_own_record(design: str, motion: str, tmp_path: Path, command: Command) -> None:
    path = tmp_path / "run.csv"
    assert command(*f"simulate {design} {motion} --csv {path} --quiet".split()).status == 0
    data = command("correlate", design, path, "--json").data
    assert data["passed"] is True
    for name, one in data["records"][0]["signals"].items():
        assert one["relative_error"] < 1e-9, name
    assert command("correlate", design, path).out.startswith("PASS  ")


def _noisy(clock: float = 1.0) -> Record:
    """A motion of 50 ms in a rest of 5 s, speed and angle in closed form, white noise on the speed."""
    t = np.arange(50_000) * 1e-4
    u = np.clip(t / 0.05, 0.0, 1.0)
    speed = 500.0 * np.sin(np.pi * u) ** 2
    angle = 500.0 * 0.05 * (u / 2.0 - np.sin(2.0 * np.pi * u) / (4.0 * np.pi))
    noisy = speed + 20.0 * np.random.default_rng(3).standard_normal(t.size)
    signals = {"angle": angle, "speed": noisy}
    return Record(name="r", time_s=clock * t, signals=signals, units={}, counts=RowCounts())


def test_noise_in_a_long_rest_is_no_contradiction() -> None:
    (found,) = (f for f in check_record(AMBER, _noisy()) if f.subject.startswith("speed against the rate"))
    assert found.passed is True


def test_a_clock_that_is_off_shows_in_a_short_motion() -> None:
    (found,) = (f for f in check_record(AMBER, _noisy(1.1)) if f.subject.startswith("speed against the rate"))
    assert found.passed is False
    assert "clock +1" in found.text
