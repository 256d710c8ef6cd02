"""Records that the simulator wrote, held against the same drive: the same run, so no error and no finding."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from actuator_lti import load_design
from analyses.records.consistency import check_record
from analyses.records.record import Record, RowCounts
from reports.cli.main import main

AMBER = load_design("ilr33-amber")


@pytest.mark.parametrize(
    ("design", "command"),
    [
        ("ilr33-amber", "--command step --amplitude 1 --duration 10"),
        ("ballscrew", "--command chirp --amplitude 1 --duration 0.5"),
        ("joint", "--command step --amplitude 1 --duration 0.5"),
        ("emps", "--command step --amplitude 1 --duration 0.3"),
    ],
)
def test_own_record(design: str, command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.csv"
    assert main(f"simulate {design} {command} --csv {path} --quiet".split()) == 0
    capsys.readouterr()
    assert main(f"correlate {design} {path} --json --quiet".split()) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["passed"] is True
    for name, one in data["records"][0]["signals"].items():
        assert one["relative_error"] < 1e-9, name
    assert main(f"correlate {design} {path} --quiet".split()) == 0
    assert capsys.readouterr().out.startswith("PASS  ")


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
