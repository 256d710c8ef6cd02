"""Commands, loads and records of `simulate` say when they begin, and mean what they say."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuator_lti.errors import InputError
from nonlinear import commands, loads, simulate
from reports.cli.main import main

TS = 1e-4


def run(words: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    status = main(f"simulate {words}".split())
    result = capsys.readouterr()
    return status, result.out + result.err


def rows(path: Path) -> np.ndarray:
    return np.genfromtxt(path, delimiter=",", names=True)


@pytest.mark.parametrize("kind", ["step", "ramp", "sine", "triangle", "chirp", "stepped-sine", "multisine"])
def test_every_command_begins_at_its_start(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.csv"
    words = f"--command {kind} --amplitude 0.1 --frequency 10 --to 40 --count 2 --start 0.1 --csv {path}"
    duration = 1.0 if kind == "stepped-sine" else 0.3
    words += " --cycles 2" if kind in ("sine", "triangle", "stepped-sine") else ""
    assert run(f"{words} --duration {duration}", capsys)[0] == 0
    reference = rows(path)["reference_rad"]
    assert not reference[:1000].any()
    assert np.abs(reference[1000:1200]).max() > 0.0


def test_a_record_begins_at_its_start_and_a_hold_refuses_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "record.csv", tmp_path / "run.csv"
    path.write_text("t,angle\n" + "".join(f"{7.0 + 0.01 * k},{0.1 + 0.01 * k}\n" for k in range(11)))
    assert run(f"--record {path} --start 0.05 --csv {out}", capsys)[0] == 0
    reference = np.degrees(rows(out)["reference_rad"])
    assert not reference[:500].any()
    assert reference[500] == pytest.approx(0.1, rel=1e-12)
    assert reference[-1] == pytest.approx(0.2, rel=1e-3)
    status, words = run("--command hold --start 0.1", capsys)
    assert status == 2
    assert "--start 0.1: a hold is there from the first tick on" in words
    assert run("--start -1", capsys)[0] == 2


def test_a_record_is_a_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "record.csv"
    path.write_text("t,angle\n0,0\n1,1\n")
    status, words = run(f"--record {path} --command sine", capsys)
    assert status == 2
    assert "--record and --command sine: one of them" in words
    assert run(f"--record {path} --command recorded --duration 0.1", capsys)[0] == 0
    assert run("--held", capsys)[0] == 2


def test_a_load_keeps_its_own_clock(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Rows from 0.1 s on: until then there is no load, at 0.15 s half of what it grows to."""
    path, out = tmp_path / "load.csv", tmp_path / "run.csv"
    path.write_text("t,M\n0.1,2\n0.2,4\n")
    assert run(f"--command hold --amplitude 0 --load-file {path} --csv {out} --duration 0.3", capsys)[0] == 0
    load = rows(out)["load_Nm"]
    assert not load[:1000].any()
    assert load[[1000, 1500, 2000, 2999]] == pytest.approx([2.0, 3.0, 4.0, 4.0], rel=1e-12)
    with pytest.raises(InputError, match="must be 0 or later"):
        loads.series([-2.0, -1.0], [1.0, 1.0])


def test_a_record_holds_the_whole_load() -> None:
    """Slope and gravity at the angle that the output has, by their formulas."""
    run = simulate("joint", commands.step(0.1), 0.05, loads.proportional(-3.0, 1.5))
    assert run.load_Nm is not None
    angle = run.output_angle_rad
    from actuator_lti import load_design

    gravity = load_design("joint").load.gravity
    own = gravity.mass_kg * 9.80665 * gravity.arm_m * np.sin(angle + gravity.offset_rad)
    slope = load_design("joint").load.moment_slope_Nm_rad
    np.testing.assert_allclose(run.load_Nm, 1.5 + (slope - 3.0) * angle + own, rtol=1e-12, atol=1e-12)


def test_a_simulated_record_correlates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A drive with friction that a load makes: without its load the record would not be met."""
    path, load = tmp_path / "run.csv", tmp_path / "load.csv"
    load.write_text("t,M\n" + "".join(f"{0.01 * k},{np.sin(0.3 * k)}\n" for k in range(31)))
    words = "--command multisine --amplitude 0.5 --frequency 2 --to 6 --count 3 --duration 0.5 --load 1"
    assert run(f"ilr33-amber {words} --load-file {load} --load-slope -5 --csv {path}", capsys)[0] == 0
    assert main(["correlate", "ilr33-amber", str(path), "--json"]) == 0
    result = relative_errors(json.loads(capsys.readouterr().out))
    assert len(result) >= 3
    assert max(result) < 1e-6


def relative_errors(result: Any) -> list[float]:
    """Every relative error in a document."""
    if isinstance(result, list):
        return [error for item in result for error in relative_errors(item)]
    if not isinstance(result, dict):
        return []
    own = [result["relative_error"]] if isinstance(result.get("relative_error"), float) else []
    return own + [error for item in result.values() for error in relative_errors(item)]


def test_a_multisine_is_periodic_and_begins_at_zero() -> None:
    """Twice its duration is it twice; every line a whole number of periods."""
    command = commands.multisine(0.3, [3.3, 7.1, 12.9], 1.0, TS, seed=4)
    values = command.values(TS, 10_001)
    assert abs(values[0]) < 1e-12
    assert values[10_000] == pytest.approx(values[0], abs=1e-12)
    assert values[1] > 0.0
    lines = np.abs(np.fft.rfft(values[:10_000])) / 5000.0
    assert set(np.flatnonzero(lines > 1e-9).tolist()) == {3, 7, 13}
    assert np.abs(values).max() == pytest.approx(0.3, rel=1e-12)
    with pytest.raises(InputError, match="less than one period"):
        commands.multisine(0.3, [0.2], 1.0, TS)
    with pytest.raises(InputError, match="same number of periods"):
        commands.multisine(0.3, [3.1, 3.2], 1.0, TS)


def test_cycles_are_those_played(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.csv"
    words = f"--command stepped-sine --amplitude 0.05 --frequency 5 --to 10 --count 2 --cycles 3 --csv {path}"
    assert run(words, capsys)[0] == 0
    result = rows(path)
    assert result["time_s"][-1] == pytest.approx(3 / 5 + 3 / 10, abs=2 * TS)
    rising = np.flatnonzero((result["reference_rad"][:-1] < 0.0) & (result["reference_rad"][1:] >= 0.0))
    assert rising.size == 5  # six periods, the first of which begins at zero


def test_content_above_nyquist_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The position loop of this drive runs at 1 kHz: 700 Hz would be seen as 300."""
    path = tmp_path / "record.csv"
    t = np.arange(0.0, 0.2, 1e-4)
    for hertz, status in ((700.0, 2), (100.0, 0)):
        angle = 0.1 * np.sin(2.0 * np.pi * hertz * t)
        path.write_text("t,angle\n" + "".join(f"{a},{b}\n" for a, b in zip(t, angle, strict=True)))
        result, words = run(f"ilr33-amber-multirate --record {path}", capsys)
        assert result == status
        assert ("above the Nyquist frequency" in words) == (status == 2)
    step = np.where(t < 0.05, 0.0, 0.1)  # a step has lines everywhere, none of them large
    path.write_text("t,angle\n" + "".join(f"{a},{b}\n" for a, b in zip(t, step, strict=True)))
    assert run(f"ilr33-amber-multirate --record {path}", capsys)[0] == 0


def test_an_event_log_is_held(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "log.csv", tmp_path / "run.csv"
    path.write_text("t,angle\n0,0\n0.01,0.1\n0.013,0.05\n0.1,0.2\n")
    status, words = run(f"--record {path}", capsys)
    assert status == 2
    assert "--held" in words
    assert run(f"--record {path} --held --duration 0.12 --csv {out}", capsys)[0] == 0
    reference = np.degrees(rows(out)["reference_rad"])
    assert reference[[99, 100, 129, 130, 999, 1000, 1199]] == pytest.approx(
        [0, 0.1, 0.1, 0.05, 0.05, 0.2, 0.2]
    )
