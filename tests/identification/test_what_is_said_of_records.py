"""One cause in a record that is otherwise right: it is named, first, and no verdict says otherwise."""

import re
from pathlib import Path

import numpy as np
import pytest

from actuator_lti.design import load_design, with_values, write_design
from analyses.correlation.asked import Asked
from analyses.correlation.closed_loop import correlate_record
from analyses.correlation.compare import compare_signals
from analyses.correlation.run import Correlation
from analyses.identification.verdict import sampling_items
from analyses.records.consistency import check_record
from analyses.records.open_record import open_record
from analyses.records.record import Record, prepared
from nonlinear import commands, simulate
from tests.changed import changed
from tests.identification.bench_records import Columns, bare, columns_of, motion, record_of, signals_of, write

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


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_a_drive_limited_to_less_current_than_the_design_says_so(share: float) -> None:
    """Of the largest current that steps of the command take."""
    angle = np.where(np.arange(3000) // 500 % 2, 0.02, -0.02)
    command = commands.sampled(1e-3 * np.arange(3000.0), angle)
    most = share * float(np.max(np.abs(simulate(DRIVE, command, 3.0).current_A)))
    run = simulate(changed(DRIVE, limits={"peak_current_A": most}), command, 3.0)
    seen = signals_of(run, 1)
    _, wrong = _correlated(_record(seen, "reference", "angle", "current"))
    assert ("limits.peak_current" in wrong) is (share < 1.0), wrong
    assert f"the current stays below {np.max(np.abs(seen['current'])):.3g} A" in wrong or share == 1.0


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
