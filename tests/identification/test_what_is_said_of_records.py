"""Records that are wrong as on a bench: the cause is named, first, and no design comes of them."""

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_lti.design import load_design, parameter_value, read_design_text, with_values, write_design
from actuator_lti.design.access import varied
from analyses.correlation.asked import Asked
from analyses.correlation.closed_loop import correlate_record
from analyses.correlation.compare import compare_signals
from analyses.correlation.following import LIMITED
from analyses.correlation.run import Correlation
from analyses.identification.bench import Settings, identify_bench
from analyses.identification.to_design import inertia_share
from analyses.identification.verdict import sampling_items
from analyses.records.consistency import check_record
from analyses.records.naming import KNOWN_UNITS
from analyses.records.open_record import open_record
from analyses.records.record import Record, prepared
from nonlinear import commands, simulate
from tests.changed import changed
from tests.identification.bench_records import (
    Columns,
    bare,
    columns_of,
    errors_off,
    item_of,
    motion,
    record_of,
    signals_of,
    write,
)
from tests.refusals import refused

DRIVE = load_design("ilr33-amber")


@pytest.fixture(scope="module")
def columns() -> Columns:
    return signals_of(motion(2), 1)


def _record(columns: Columns, *names: str, **changed: np.ndarray) -> Record:
    columns = {**columns, **changed}
    return record_of(columns["time"], **{name: columns[name] for name in names})


def _correlated(record: Record) -> tuple[bool, str]:
    """Whether the drive that made a record is told to be it, and all that contradicts."""
    result = correlate_record(DRIVE, record)
    wrong = "; ".join(f"{one.subject}: {one.text}" for one in result.findings if one.passed is False)
    return Correlation(DRIVE, Asked(records=[]), (result,)).passed, wrong


@pytest.mark.parametrize("clock", [1.0, 1.03, 0.96])
def test_the_model_of_a_record_tells_its_clock(clock: float, columns: Columns) -> None:
    record = _record(columns, "reference", "angle", "current", time=clock * columns["time"])
    passed, wrong = _correlated(record)
    assert passed is (clock == 1.0), wrong
    if clock != 1.0:
        off = re.search(r"a clock about (\S+) % off", wrong)
        assert off
        assert float(off[1]) == pytest.approx(100.0 * (clock - 1.0), rel=0.05)


@pytest.mark.parametrize(("name", "share", "size"), [
    ("current", 1.0, 0.02), ("current", 0.4, 0.02), ("speed", 1.0, 0.5), ("speed", 0.3, 0.5),
    ("speed", 0.05, 0.5),
])  # fmt: skip
def test_a_drive_limited_to_less_than_the_design_says_so(name: str, share: float, size: float) -> None:
    """Of the largest that steps of the command take; a slower drive's motion is not that of the command."""
    angle = np.where(np.arange(3000) // 500 % 2, size, -size)
    command = commands.sampled(1e-3 * np.arange(3000.0), angle)
    most = share * float(np.max(np.abs(signals_of(simulate(DRIVE, command, 3.0), 1)[name])))
    key, unit = LIMITED[name], KNOWN_UNITS[name]
    run = simulate(with_values(DRIVE, {"limits.continuous_current": 0.1, key: most}), command, 3.0)
    record = _record(signals_of(run, 1), "reference", "angle", "speed", "current")
    said = "; ".join(one.text for one in correlate_record(DRIVE, record).findings)
    assert (f"or a lower limit of the {name} ({key})" in said) is (share < 1.0), said
    assert f"the {name} stays below {np.max(np.abs(record[name])):.3g} {unit}" in said or share == 1.0


def _lines(path: Path, columns: Columns, name: str, line: int, value: float) -> None:
    """A file of 4000 rows below a line of names, one value of which is another."""
    changed = columns[name].copy()
    changed[line - 2] = value
    table = {"time_s": "time", "reference_rad": "reference", "angle_rad": "angle", "current_A": "current"}
    seen = {**columns, name: changed}
    write(path, {column: seen[signal] for column, signal in table.items()})


def _wrong(path: Path) -> str:
    found = check_record(DRIVE, prepared(open_record(path)))
    return "\n".join(f"{one.subject}: {one.text}" for one in found if one.passed is False)


@pytest.mark.parametrize(("name", "value", "words"), [
    ("current", 999.0, r"^current against its limit: 999 A in line 1236 \(1.234 s\), .* bad row"),
    ("current", -999.0, r"^current against its limit: -999 A in line 1236 \(1.234 s\), .* bad row"),
    ("angle", 1745.0, r"^steps of the angle.* jumps from \S+ to 1745 rad in line 1236 .*line 1237 "),
    ("angle", 0.0, r"^steps of the angle.* jumps from \S+ to 0 rad in line 1236 .*line 1237 "),
])  # fmt: skip
def test_one_row_that_no_drive_can_have_is_named(name, value, words, columns, tmp_path) -> None:
    """Of the file, of one that lacks a line before it; without its line nothing is wrong."""
    path = tmp_path / "r.csv"
    _lines(path, columns, name, 1236, value)
    assert re.search(words, _wrong(path), re.MULTILINE)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:999] + lines[1000:]))
    assert "in line 1235 (1.234 s)" in _wrong(path)
    path.write_text("".join(lines[:1235] + lines[1236:]))
    assert not _wrong(path)


@pytest.mark.parametrize("factor", [1e3, 1e6, 1e-3])
def test_a_time_in_another_unit_is_named_by_its_factor(factor: float, columns: Columns) -> None:
    """The design's inertia and friction are none of the drive's: only the loop's gain tells."""
    other = with_values(DRIVE, {"motor.rotor_inertia": 2.5e-6, "friction.dry_torque": 6e-3})
    record = _record(columns, "reference", "angle", "current", time=factor * columns["time"])
    (told,) = (one for one in check_record(other, record) if one.subject.startswith("time"))
    assert told.passed is False
    assert "factor 1e6 (micro" in told.text if factor == 1e6 else "factor 1000 (milli" in told.text


@pytest.mark.parametrize(
    ("factor", "named"), [(1.0, ""), (30.0, ""), (1e3, "1000 "), (1e-3, "1000 "), (1e6, "1e6 ")]
)
def test_a_speed_drive_tells_the_unit_of_its_time_by_its_inertia(factor, named, columns: Columns) -> None:
    """Of a design with two thirds of the inertia; what is no unit of a time is another inertia."""
    other = with_values(DRIVE, {"motor.rotor_inertia": DRIVE.motor.rotor_inertia_kgm2 / 1.5})
    logged = {"speed_reference": columns["speed"], "time": factor * columns["time"]}
    record = _record({**columns, **logged}, "speed_reference", "speed", "current")
    told = [one for one in check_record(other, record) if one.subject.startswith("time")]
    assert bool(told) is bool(named)
    assert all(one.passed is False and f"factor {named}" in one.text for one in told)


@pytest.mark.parametrize("counts", [2_000, 6_000, 10_000, 20_000])
def test_noise_of_a_speed_is_no_unit_of_its_time(counts: int) -> None:
    """Slow motion against friction, the speed counted over 0.1 ms: by its noise the inertia is 1/1000."""
    time, kM = 1e-4 * np.arange(40_000), float(DRIVE.motor.torque_constant_Nm_A or 0.0)
    speed, friction = 500.0 * np.sin(0.5 * np.pi * time), DRIVE.friction
    torque = DRIVE.inertia_kgm2 * np.gradient(speed, time) + friction.viscous_Nms_rad * speed
    torque += friction.dry_torque_Nm * np.sign(speed)
    count = 2.0 * np.pi / counts
    counted = np.diff(np.floor(1e-4 * np.cumsum(speed) / count), prepend=0.0) * count / 1e-4
    logged = {"time": time, "speed_reference": speed, "speed": counted, "current": torque / kM}
    record = _record(logged, "speed_reference", "speed", "current")
    assert not any(one.subject.startswith("time") for one in check_record(DRIVE, record))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("signals", [("angle",), ("reference", "angle", "speed"), ("speed",)])
def test_the_sign_of_a_current_is_told_without_a_voltage(sign, signals, columns: Columns) -> None:
    other = with_values(DRIVE, {"motor.rotor_inertia": 2.5e-6, "friction.dry_torque": 1.5e-3})
    record = _record(columns, *signals, "current", current=sign * columns["current"])
    told = [one.text for one in check_record(other, record) if one.subject == "current against the motion"]
    assert bool(told) is (sign < 0.0)
    assert not told or "the sign of the current is turned" in told[0]


@pytest.mark.parametrize(("fault", "words"), [
    ("zero", r"the zero of the angle is 60 rad from that of its command"),
    ("round", r"it begins anew with each turn: count the turns on"),
    ("own torque", r"the torque is 1 times kM i: the drive's own \(leave the column out\)"),
])  # fmt: skip
def test_what_benches_do_to_a_column_is_named(fault: str, words: str, columns: Columns) -> None:
    """An encoder that was zero elsewhere, or counts one turn; a drive's log of its own torque."""
    angle, torque = columns["angle"], DRIVE.effective_motor.torque_constant_Nm_A * columns["current"]
    changed = {"zero": {"angle": angle + 60.0}, "round": {"angle": angle % (2.0 * np.pi)}}.get(fault)
    record = _record(columns, "reference", "angle", "current", **(changed or {}))
    if changed is None:
        record = record_of(record.time_s, **record.signals, torque=torque)
    assert re.search(words, _correlated(record)[1])


@pytest.mark.parametrize("signals", [("angle",), ("speed",)])
@pytest.mark.parametrize("rows", [slice(2000, 2500), slice(0, 4000)])
def test_a_frozen_current_is_named(signals, rows: slice, columns: Columns) -> None:
    current = columns["current"].copy()
    current[rows] = current[rows][0]
    record = _record(columns, *signals, "current", current=current)
    (told,) = (one for one in check_record(DRIVE, record) if "frozen" in one.text)
    count, first = len(current[rows]), rows.start + 1
    assert told.passed is False
    assert f"in {count} rows, from row {first} (" in told.text


@pytest.mark.parametrize("command", [commands.step(0.02), commands.triangle(0.02, 1.0), commands.hold(0.0)])
def test_a_current_that_stands_with_its_drive_is_not_frozen(command: Any) -> None:
    """Without noise: it keeps its value at rest, off and at its limit, and turns back in none of them."""
    run = simulate(DRIVE, command, 2.0)
    moved = {"angle": run.motor_angle_rad, "speed": run.motor_speed_rad_s, "current": run.current_A}
    off = {**moved, "current": np.zeros(len(run.time_s))}
    limit = {**moved, "current": np.clip(run.current_A, -0.1, 0.1)}
    for signals in (moved, off, limit):
        record = record_of(run.time_s[::10], **{name: values[::10] for name, values in signals.items()})
        assert not [one for one in check_record(DRIVE, record) if "frozen" in one.text]


def test_a_slip_between_two_angles_is_no_other_ratio(columns: Columns) -> None:
    """The motor's clamp slips by 5 rad within 0.1 s: the same reduction before and behind it."""
    slipped = columns["angle"] + 5.0 * np.clip((columns["time"] - 2.0) / 0.1, 0.0, 1.0)
    output = columns["angle"] / DRIVE.total_ratio
    for angle, words in ((slipped, "the motor angle slips by 4.9"), (1.1 * columns["angle"], "is 1.1 times")):
        record = record_of(columns["time"], angle=angle, output_angle=output, current=columns["current"])
        (told,) = (one for one in check_record(DRIVE, record) if one.subject == "angle against output angle")
        assert told.passed is False
        assert words in told.text


def test_a_following_error_that_torques_make_tells_no_clock() -> None:
    """The command's speed is fed forward; friction and inertia are not the design's."""
    design = with_values(DRIVE, {"control.position.feedforward": 1.0})
    other = {"friction.dry_torque": 1.5 * DRIVE.friction.dry_torque_Nm, "motor.rotor_inertia": 2.5e-6}
    columns = signals_of(motion(2, design=with_values(design, other)), 1)
    record = _record(columns, "reference", "angle", "current")
    (told,) = (
        one for one in correlate_record(design, record).findings if one.subject.startswith("following")
    )
    assert told.passed is None


def test_a_filter_of_the_speed_is_no_other_friction_law(columns: Columns) -> None:
    """First order, 4 ms; it is taken back as a delay, whose instants of reversal are the simulated ones."""
    late = lfilter([0.2], [1.0, -0.8], columns["speed"])
    record = _record(columns, "reference", "speed", "current", speed=late)
    result = identify_bench(DRIVE, [record])
    assert item_of(result, "law").passed
    assert "3.8 ms off" in item_of(result, "lag").reason
    assert result.passed


@pytest.mark.parametrize("lag_ms", [0.5, 2.0, 4.0])
@pytest.mark.parametrize("signals", [("speed", "current"), ("reference", "speed", "current")])
def test_the_intervals_hold_what_a_filter_makes(signals, lag_ms: float, columns: Columns) -> None:
    """Taken back as a delay, or not told: the coefficients of the design that was simulated are in 1.96."""
    keep = np.exp(-1.0 / lag_ms)  # of a row of 1 ms
    late = lfilter([1.0 - keep], [1.0, -keep], columns["speed"])
    model = identify_bench(DRIVE, [_record(columns, *signals, speed=late)]).model
    friction = DRIVE.friction
    truth = {
        "inertia": DRIVE.inertia_kgm2,
        "viscous": friction.viscous_Nms_rad,
        "dry": friction.dry_torque_Nm,
    }
    assert errors_off(model, truth) < 1.96


@pytest.mark.parametrize(("column", "why"), [
    ("motor_position_counts", "no name that is known"),
    ("motor angle [inc]", "no name and unit that are known together"),
    ("angle", "has no unit in its name"),
])  # fmt: skip
def test_a_column_that_is_not_read_is_named_where_it_lacks(column, why, columns, tmp_path, cli) -> None:
    named = {"time_s": columns["time"], column: columns["angle"], "current_A": columns["current"]}
    said = cli.refused("identify", write(tmp_path / "a.csv", named), "--design", "ilr33-amber")
    assert f'"{column}": {why}' in said


def test_a_signal_whose_squares_are_zero_is_zero(columns: Columns) -> None:
    """1e-322 V, as a logger leaves it: divided by, and then refused for the whole record."""
    voltage = np.full_like(columns["time"], 1e-322)
    result = correlate_record(DRIVE, _record(columns, "reference", "angle", "voltage", voltage=voltage))
    assert set(result.signals) == {"angle", "speed"}
    assert "voltage is zero throughout: not compared" in result.notes


@pytest.mark.parametrize("times", [1.0, 0.7])
def test_white_noise_of_a_record_is_no_error_of_the_model(times: float) -> None:
    """A sine with a third of its size of noise: of the model that made it, and of one that is 30 % off."""
    true = np.sin(np.linspace(0.0, 60.0, 6000))
    noise = 0.3 * np.sqrt(0.5) * np.random.default_rng(3).standard_normal(6000)
    found = compare_signals("current", "A", np.arange(6000.0), true + noise, times * true)
    assert found.share_of_motion > 0.28
    assert found.noise_rms == pytest.approx(np.std(noise), rel=0.05)
    known = 0.3 * np.sqrt(8.0 * np.sqrt(5.26 / 6000))  # to eight deviations of s^2 by so many rows
    size = np.hypot(1.0, 0.3)
    assert (1.0 - times) / size <= found.share_beyond_noise <= np.hypot(1.0 - times, known) / size


@pytest.mark.parametrize("every", [2, 3])
def test_a_ripple_from_row_to_row_is_an_error_of_the_model(every: int) -> None:
    """Rows of which each second, or third, is off: white noise has one variance by all orders."""
    ripple = np.where(np.arange(6000) % every == 0, 0.4, 0.0)
    true = np.sin(np.linspace(0.0, 60.0, 6000))
    found = compare_signals("current", "A", np.arange(6000.0), true + ripple, true)
    assert found.share_beyond_noise == found.share_of_motion > 0.2


PLAIN = {"time_s": "time", "reference_rad": "reference", "angle_rad": "angle", "current_A": "current"}


def _text(columns: Columns, rows: slice = slice(None)) -> str:
    table = np.column_stack([columns[name][rows] for name in PLAIN.values()])
    return "".join(",".join(f"{value:.12g}" for value in row) + "\n" for row in table)


def test_a_second_run_in_a_file_is_said_first(columns: Columns, tmp_path, cli) -> None:
    """By the key that is offered alone: the columns are known by their names."""
    head, path = ",".join(PLAIN) + "\n", tmp_path / "r.csv"
    path.write_text(head + 2 * _text(columns))
    refused = cli.refused("correlate", "ilr33-amber", path)
    assert "a file for each run; or disorder" in refused
    (tmp_path / "r.toml").write_text('file = "r.csv"\ndisorder = "drop"\n')
    for asked in (
        ("correlate", "ilr33-amber", tmp_path / "r.toml"),
        ("identify", tmp_path / "r.toml", "--design", "ilr33-amber"),
    ):
        text = " ".join(cli(*asked).out.split())
        assert text.index("4000 of 8000 rows are left out") < 200
        assert "4000 rows in" not in text
    path.write_text(head + _text(columns, slice(2000)) + head + _text(columns, slice(2000, None)))
    refused = cli.refused("correlate", "ilr33-amber", path)
    assert (
        'r.csv:2002: the line of column names once more; allowed: rows of numbers, or bad_rows = "drop"'
        in refused
    )
    (tmp_path / "r.toml").write_text('file = "r.csv"\nbad_rows = "drop"\n')
    assert len(open_record(tmp_path / "r.toml")) == 4000


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_a_header_in_windows_1252_is_read_by_name_and_with_a_record_file(encoding, columns, tmp_path) -> None:
    head = "Time [s],Reference [°],Angle [°],Current [A]\n"
    (tmp_path / "r.csv").write_bytes((head + _text(columns)).encode(encoding))
    names = 'time = { column = "Time [s]" }\nsignals.angle = { column = "Angle [°]", unit = "deg" }\n'
    (tmp_path / "r.toml").write_text('file = "r.csv"\n' + names, encoding="utf-8")
    records = [open_record(tmp_path / name) for name in ("r.csv", "r.toml")]
    for one in records:
        assert one["angle"] == pytest.approx(np.radians(columns["angle"]), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("jitter_s", "words"), [(0.0, "3 rows are missing on a regular grid of 1 ms"), (3e-5, "jitter")]
)
def test_rows_missing_on_a_grid_are_no_jitter(jitter_s: float, words: str, columns: Columns) -> None:
    kept = np.delete(np.arange(len(columns["time"])), [900, 901, 2100])
    jitter = jitter_s * np.random.default_rng(1).uniform(-1.0, 1.0, len(kept))
    less = {name: values[kept] for name, values in columns.items()}
    record = prepared(_record(less, "angle", "current", time=less["time"] + jitter))
    (item,) = (one for one in sampling_items(record) if one.id.startswith("times"))
    assert words in item.reason


def test_the_values_of_a_run_down_are_those_at_what_is_kept(tmp_path, cli) -> None:
    """No torque of a motor: J, Cv and C0 show as ratios alone; J is the design's, or C0 where it is held."""
    design = with_values(bare("ilr33-amber"), {"limits.speed": 2000.0})
    J, C0, Cv = design.inertia_kgm2, design.friction.dry_torque_Nm, design.friction.viscous_Nms_rad
    time, fall = np.arange(0.0, 3.0, 1e-3), Cv / J
    speed = np.maximum((900.0 + C0 / Cv) * np.exp(-fall * time) - C0 / Cv, 0.0)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * 1e-3])
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(time))
    columns = {"time_s": time, "angle_rad": angle, "speed_rad_s": speed, "current_A": noise}
    (tmp_path / "d.toml").write_text(write_design(design))
    asked = "identify", write(tmp_path / "r.csv", columns), "--design", tmp_path / "d.toml"
    assert "all at the design's inertia" in " ".join(cli(*asked).out.split())
    said = cli(*asked, "--fix", f"friction.dry_torque={C0}").out
    assert "all at the design's dry friction" in " ".join(said.split())


def test_the_table_of_what_was_found_is_whole_on_a_small_screen(browser, identify, tmp_path) -> None:
    identify(columns_of(motion(2)))
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    page.goto((tmp_path / "o" / "identification.html").as_uri())
    cut = "all => all.filter(e => e.scrollWidth > e.clientWidth).map(e => e.textContent.slice(0, 60))"
    assert page.eval_on_selector_all(".scroll", cut) == []
    page.close()


@pytest.fixture(scope="module")
def right() -> Columns:
    return columns_of(motion(2))


def test_the_right_record_gives_its_drive_and_accounts_for_every_column(right, tmp_path, identify, cli):
    """The whole inertia at the motor is the drive's: what gears and load have is taken off the rotor's."""
    data, written = identify(right).data, tmp_path / "o" / "ilr33-amber-identified.toml"
    truth, result = load_design("ilr33-amber"), load_design(written)
    assert result.inertia_kgm2 == pytest.approx(truth.inertia_kgm2, rel=0.01)
    assert result.motor.rotor_inertia_kgm2 == pytest.approx(truth.motor.rotor_inertia_kgm2, rel=0.01)
    assert result.friction.dry_torque_Nm == pytest.approx(2.25e-3, rel=0.03)
    assert data["model"]["fixed"]["torque_constant"]["value"] == truth.motor.torque_constant_Nm_A
    assert "torque constant kM, 0.005900 N m/A" in written.with_name("identification.html").read_text()
    again = data["resimulated"][0]
    assert again["relative_error"] < 0.03
    own = cli.data("correlate", written, tmp_path / "r.csv")["records"][0]["signals"]["current"]
    assert own["relative_error"] == pytest.approx(again["relative_error"], rel=1e-9)
    more = {**right, "temperature_C": right["time_s"], "current_mA": 1e3 * right["current_A"]}
    inputs = {row["column"]: row["use"] for row in identify(more).data["inputs"]["r.csv"]}
    assert set(inputs) == set(more)
    assert inputs["current_A"].startswith("drive")
    assert inputs["temperature_C"] == "no: no name that is known"
    assert inputs["current_mA"] == "no: motor current is read from current_A"
    assert inputs["motor_speed_rpm"].startswith("no: ")


@pytest.mark.parametrize("key", ["motor.rotor_inertia", "load.inertia"])
def test_the_drives_own_total_gives_its_own_parts(key: str) -> None:
    """What the other inertias leave of the whole, at the shaft of the key: equation 12 turned round."""
    design = load_design("ilr33-amber")
    value, slope = inertia_share(design, design.inertia_kgm2, key)
    assert value == pytest.approx(parameter_value(design, key), rel=1e-4)
    assert slope == (1.0 if key == "motor.rotor_inertia" else 2376.0**2)
    refused(inertia_share, design, 1e-8, key, words="beside")
    refused(inertia_share, design, 1e-6, "gear.worm.ratio", words="motor.rotor_inertia or load.inertia")


def test_a_residual_above_the_level_writes_nothing_unless_accepted(right, tmp_path, identify, cli) -> None:
    rng = np.random.default_rng(1)
    noisy = {**right, "current_A": right["current_A"] + 1.5 * rng.standard_normal(len(right["time_s"]))}
    for accepted in ((), ("--accept",)):
        assert identify(noisy, "ilr33-amber", "--cutoff", "400", *accepted).status == 1
        assert bool(list((tmp_path / "o").glob("*.toml"))) == bool(accepted)
    words = "accepted, a check failed"
    assert words in (tmp_path / "o" / "identification.html").read_text()
    asked = ("--design", "ilr33-amber", "--cutoff", "400", "--accept", "--out", tmp_path / "o")
    assert words in " ".join(cli.text("identify", tmp_path / "r.csv", *asked, status=1).split())


def _slow_sensor(folder: Path) -> None:
    for file in folder.glob("*_torque.csv"):
        head, names, *rows = file.read_text().splitlines()
        pairs = (row.split(",") for row in rows)
        file.write_text("\n".join([head, names, *(f"{float(t) * 1.05:.4f},{m}" for t, m in pairs)]) + "\n")


def _late_loads(folder: Path) -> None:
    """A brake that is put on 0.7 s after the motion began, in the loaded runs but one."""
    for file in sorted(folder.glob("*_torque.csv"))[:-1]:
        head, names, *rows = file.read_text().splitlines()
        pairs = [row.split(",") for row in rows]
        up = next((float(t) for t, m in pairs if abs(float(m)) > 1.0), 0.0) + 0.7
        rows = [f"{t},{m if float(t) > up else 0.0}" for t, m in pairs]
        file.write_text("\n".join([head, names, *rows]) + "\n")


def _copied(run: str, to: str) -> Callable[[Path], object]:
    return lambda folder: shutil.copy(folder / f"run{run}.csv", folder / f"run{to}.csv")


def _replaced(*pairs: tuple[str, str]) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        text = (folder / "campaign.toml").read_text()
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new)
        (folder / "campaign.toml").write_text(text)

    return change


SWAP = (('"Current"', '"X"'), ('"Speed"', '"Current"'), ('"X"', '"Speed"'))
WRONG_BENCH = {
    "mA read as A": (_replaced(('unit = "mA"', 'unit = "A"')), "factor 1000"),
    "rpm read as rad/s": (_replaced(('unit = "rpm"', 'unit = "rad/s"')), "60/2 pi"),
    "N m read as N cm": (_replaced(('"torque", unit = "N*m"', '"torque", unit = "N*cm"')), "factor 100"),
    "two columns swapped": (_replaced(*SWAP), "usable runs"),
    "the sensor's clock 5 % off": (_slow_sensor, "a clock is off"),
    "loads that come later than the motion": (_late_loads, "came or went at another time than the speed"),
    "another run's sensor file": (_copied("09_torque", "05_torque"), "that of run 09 as well"),
    "another run's drive file": (_copied("09_drive", "08_drive"), "set speed"),
}


@pytest.mark.parametrize("fault", WRONG_BENCH)
def test_a_wrong_campaign_gives_no_design(fault: str, bench: Path, tmp_path, cli) -> None:
    change, reason = WRONG_BENCH[fault]
    folder = tmp_path / "bench"
    shutil.copytree(bench, folder)
    change(folder)
    ran = cli("identify", folder / "campaign.toml", "--suggest", "0", "--json", "--out", tmp_path / "o")
    assert ran.status in (1, 2)
    assert reason in ran.out + ran.err
    assert not list((tmp_path / "o").glob("*.toml"))


def test_a_right_campaign_is_simulated_again_and_says_what_is_fixed_or_not_told(bench, cli, tmp_path) -> None:
    told = cli.data("identify", bench / "campaign.toml", "--suggest", "0")
    checks = {check["id"]: check for check in told["items"]}
    assert checks["written-the runs"]["value"] < 0.005
    inputs = {(row["file"], row["column"]) for row in told["result"]["inputs"]}
    assert inputs >= {("drive", "Current"), ("drive", "Position"), ("sensor", "torque")}
    words = ("identify", bench / "campaign.toml", "--fix")
    fit = cli.data(*words, "friction.viscous=5.25 uN*m*s/rad", "--out", tmp_path)["result"]["fit"]
    assert fit["fixed"]["Cv"]["reason"] == "fixed as asked"
    assert load_design(tmp_path / "ilr33-amber-identified.toml").friction.viscous_Nms_rad == 5.25e-6
    assert cli(*words, "friction.load_coefficient=0", "--json").status == 1
    assert "can be fixed here" in cli.refused(*words, "motor.resistance=1 ohm", "--json")
    # the commonest friction test: no load, so CM stays the design's, and that is said
    folder = tmp_path / "bench"
    shutil.copytree(bench, folder)
    head, *runs = (bench / "campaign.toml").read_text().split("[[run]]")
    text = head + "".join(f"[[run]]{run}" for run in (*runs[:3], runs[1].replace('id = "02"', 'id = "99"')))
    (folder / "unloaded.toml").write_text(text)
    fit = cli.data("identify", folder / "unloaded.toml")["result"]["fit"]
    kept = {name: one["reason"] for name, one in fit["fixed"].items()}
    assert kept["CM"] == "no run is loaded: the design's value kept"
    assert fit["parameters"]["C0"]["value"] == pytest.approx(2.25e-3, rel=0.02)
    assert fit["parameters"]["CM"]["value"] == 1.34e-3
    (folder / "turned.toml").write_text(text.replace('unit = "mA"', 'unit = "mA", scale = -1'))
    assert "the sign of the current is turned, or that of the speed" in cli.refused(
        "identify", folder / "turned.toml"
    )


def test_a_drive_that_carries_its_load_is_not_what_the_law_of_a_campaign_says(bench: Path, cli) -> None:
    """The motor carries M/N besides: of a ratio of 2376 0.4209 mN m/(N m), which would be in CM."""
    words = ("identify", bench / "campaign.toml", "--set", 'load.path="back-drivable"', "--suggest", "0")
    law, *_ = cli.data(*words, status=1)["items"]
    assert (law["id"], law["passed"]) == ("law", False)
    assert "1/N = 0.4209 mN m/(N m)" in law["reason"]
    assert 'load.path = "self-locking"' in law["reason"]


@pytest.mark.parametrize("step", [1, 10])
def test_a_voltage_at_the_outer_loop_s_ticks_alone_tells_no_other_resistance(step: int) -> None:
    """Of one simulated run: R is the drive's own, at every tick as well; a reversed sign shows at both."""
    design = with_values(bare("ilr33-amber"), {"control.position.every": 10})
    run = simulate(design, commands.multisine(0.02, [0.7, 1.9, 4.3], 3.0, 1e-4, seed=2), 3.0)
    seen = {"angle": run.motor_angle_rad, "speed": run.motor_speed_rad_s}
    seen = {**seen, "current": run.current_A, "voltage": run.voltage_V}
    for sign, passed in ((1.0, True), (-1.0, False)):
        signals = {name: values[::step] for name, values in {**seen, "current": sign * run.current_A}.items()}
        found = check_record(design, record_of(run.time_s[::step], **signals))
        (one,) = (one for one in found if one.subject.endswith("kE w"))
        assert one.passed is passed, one.text


def test_a_bench_s_controller_keeps_the_numbers_that_it_has() -> None:
    """It feeds the sheet's J forward, the motor has 1.5 times: a refinement must not feed its own forward."""
    fed = changed(DRIVE, controller={"position": {"feedforward": 1.0, "acceleration_feedforward": 1.0}})
    truth = 1.5 * DRIVE.motor.rotor_inertia_kgm2
    made = varied(fed, {"motor.rotor_inertia": truth})
    record = _record(signals_of(motion(2, design=made), 0), "reference", "angle", "current")
    result = identify_bench(fed, [record], settings=Settings(refine=True))
    assert errors_off(result.refined, {"motor.rotor_inertia": truth}) < 3.0
    share = fed.inertia_kgm2 / made.inertia_kgm2  # of its own J that the bench feeds forward
    written = read_design_text(result.text).controller.position
    assert written.acceleration_feedforward == pytest.approx(share, rel=1e-3)


def test_lags_of_one_recorder_move_no_more_in_many_records_than_in_one() -> None:
    """A speed behind 2 ms in four records: what is not told of the filter counts once, noise by half."""
    found = []
    for seeds in ([2], [2, 3, 4, 5]):
        records = []
        for seed in seeds:
            columns = signals_of(motion(seed), seed)
            late = lfilter([1.0 - np.exp(-0.5)], [1.0, -np.exp(-0.5)], columns["speed"])
            records.append(replace(_record(columns, "speed", "current", speed=late), name=f"r{seed}"))
        found.append(identify_bench(DRIVE, records).model)
    for name in ("inertia", "viscous"):
        assert found[1].std(name) < 1.1 * found[0].std(name), name
