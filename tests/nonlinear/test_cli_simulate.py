"""`actuator-lti simulate`: commands, loads, records mean what they say, in the outermost stage's unit."""

from dataclasses import dataclass
from math import exp, radians
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest

from actuator_lti import load_design, write_design
from actuator_lti.design.model import Friction
from analyses.motion.asked import OF
from tests.changed import changed
from tests.command_line import Command

TS = 1e-4


@dataclass(frozen=True)
class Simulate:
    """Run `simulate` with these words: the facts of --json, the rows of --csv."""

    cli: Command
    path: Path

    def __call__(self, words: str) -> tuple[dict[str, Any], np.ndarray]:
        facts = self.cli.data("simulate", *words.split(), "--csv", self.path)
        return facts, np.genfromtxt(self.path, delimiter=",", names=True)

    def refused(self, words: str) -> str:
        return self.cli.refused("simulate", *words.split(), "--csv", self.path)


@pytest.fixture
def run(tmp_path, cli) -> Simulate:
    return Simulate(cli, tmp_path / "run.csv")


def table(path: Path, head: str, *columns: Any) -> Path:
    rows = "".join(",".join(map(str, row)) + "\n" for row in zip(*columns, strict=True))
    path.write_text(f"{head}\n{rows}")
    return path


def test_json_and_files_and_a_linear_axis_in_metres(run, tmp_path) -> None:
    parquet, svg = tmp_path / "run.parquet", tmp_path / "run.svg"
    words = "--command sine --amplitude 5 --frequency 1 --duration 0.5 --load 4 --energy"
    facts, rows = run(f"ilr33-amber {words} --parquet {parquet} --plot {svg}")
    assert facts["limits"]["speed"]["fraction"] > 0.3
    assert facts["energy"]["relative_error"] < 1e-9
    kept = pyarrow.parquet.read_table(parquet)
    assert rows.size == kept.num_rows == facts["rows"] == 5000
    assert rows["output_angle_rad"].max() == facts["largest_output_rad"]
    assert np.array_equal(kept["current_A"].to_numpy(), rows["current_A"])
    drawn = svg.read_text()
    assert "speed limit acts" in drawn
    assert "limit acts" not in drawn.replace("speed limit acts", "").replace("current limit acts", "")
    facts, rows = run("emps --command ramp --amplitude 10")
    assert facts["final_output_m"] == pytest.approx(0.01, rel=0.05)
    assert {"output_angle_m", "motor_angle_m", "motor_speed_m_s"} <= set(rows.dtype.names)
    names = run("ballscrew --amplitude 1 --duration 0.01 --load 100")[1].dtype.names
    assert {"twist_m", "coupling_force_N", "load_force_N"} <= set(names)
    assert not [name for name in names if "Nm" in name or "rad" in name]


def test_ramps_and_slopes_are_read_in_their_own_units(run) -> None:
    """6 m/min are 0.1 m/s, 10 N/mm hold back 10 N a millimetre; a length, N m/rad, a share are none."""
    _, rows = run("emps --command ramp --amplitude 6m/min --bias-rate 300mm/min --duration 0.05")
    assert rows["reference_m"][-1] == pytest.approx((0.1 + 0.005) * rows["time_s"][-1], rel=1e-12)
    _, rows = run("emps --amplitude 1mm --load-slope -10N/mm --duration 0.3")
    assert rows["load_force_N"][1:] == pytest.approx(-1e4 * rows["output_angle_m"][1:], abs=1e-9)
    for words in ("--command ramp --amplitude 5mm", "--load-slope 10N*m/rad", "--bias-rate 50%"):
        assert "wrong dimension" in run.refused(f"emps {words} --duration 0.01")


def test_a_record_is_a_command_from_its_start_and_a_log_of_events_is_held(run, tmp_path) -> None:
    times = [0.0, 0.1, 0.2, 0.5, 0.6]
    path = table(tmp_path / "record.csv", "t,angle", times, times)
    assert "hole in time from 0.2 s to 0.5 s" in run.refused(f"--record {path}")
    table(path, "t,angle", 0.1 * np.arange(11), np.arange(11) / 10)
    facts, _ = run(f"--record {path} --duration 1.5")
    assert np.degrees(facts["final_output_rad"]) == pytest.approx(1.0, abs=1e-3)
    path = table(tmp_path / "record.csv", "t,angle", [0, 1], [0, 1])
    assert "--record and --command sine: one of them" in run.refused(f"--record {path} --command sine")
    assert run(f"--record {path} --command recorded --duration 0.1")
    k = np.arange(11)
    path = table(tmp_path / "record.csv", "t,angle", 7.0 + 0.01 * k, 0.1 + 0.01 * k)
    reference = np.degrees(run(f"--record {path} --start 0.05")[1]["reference_rad"])
    assert not reference[:500].any()
    assert reference[500] == pytest.approx(0.1, rel=1e-12)
    assert reference[-1] == pytest.approx(0.2, rel=1e-3)
    path = table(tmp_path / "log.csv", "t,angle", [0, 0.01, 0.013, 0.1], [0, 0.1, 0.05, 0.2])
    assert "--held" in run.refused(f"--record {path}")
    reference = np.degrees(run(f"--record {path} --held --duration 0.12")[1]["reference_rad"])
    wanted = [0, 0.1, 0.1, 0.05, 0.05, 0.2, 0.2]
    assert reference[[99, 100, 129, 130, 999, 1000, 1199]] == pytest.approx(wanted)


def _those(kind: str, **options: int) -> str:
    """The options that a kind of command has."""
    return " ".join(f"--{name} {value}" for name, value in options.items() if kind in OF[name])


@pytest.mark.parametrize(
    "kind", ["hold", "step", "ramp", "sine", "triangle", "chirp", "stepped-sine", "multisine"]
)
def test_every_command_is_told_and_begins_at_its_start(kind: str, run, cli) -> None:
    stepped = kind == "stepped-sine"  # to its end: 5 cycles of 5, 10 and 20 Hz, 1.75 s
    arguments = f"simulate --command {kind} --every 10 {_those(kind, frequency=5, to=20, count=3)}"
    more = "" if stepped else " --amplitude 0.2 --duration 0.4 --bias-rate 5 --load-slope -20"
    out = cli.text(*f"{arguments}{more}".split())
    assert ("1750 rows, status comes to rest" if stepped else "400 rows, status following") in out
    assert " deg " in out
    if kind != "hold":  # which is there from the first tick on
        words = f"--command {kind} --amplitude 0.1 --start 0.1 "
        words += _those(kind, frequency=10, to=40, count=2, cycles=2)
        reference = run(f"{words} --duration {1.0 if stepped else 0.3}")[1]["reference_rad"]
        assert not reference[:1000].any()
        assert np.abs(reference[1000:1200]).max() > 0.0


@pytest.mark.parametrize(("words", "seconds", "rising"), [
    ("sine --frequency 4 --cycles 3 --start 0.1", 0.1 + 3 / 4, 2),
    ("stepped-sine --frequency 5 --to 10 --count 2 --cycles 3", 3 / 5 + 3 / 10, 5),
])  # fmt: skip
def test_cycles_are_those_played(words: str, seconds: float, rising: int, run) -> None:
    """The first period begins at zero: one rising crossing less than there are periods."""
    facts, rows = run(f"--amplitude 0.05 --command {words}")
    assert facts["rows"] == pytest.approx(seconds / TS, abs=2)
    reference = rows["reference_rad"]
    assert np.flatnonzero((reference[:-1] < 0.0) & (reference[1:] >= 0.0)).size == rising


def test_a_load_keeps_its_own_clock_or_that_of_the_record(run, tmp_path) -> None:
    """Rows from 0.1 s on: until then there is no load, at 0.15 s half of what it grows to."""
    path = table(tmp_path / "load.csv", "t,M", [0.1, 0.2], [2, 4])
    load = run(f"--command hold --amplitude 0 --load-file {path} --duration 0.3")[1]["load_Nm"]
    assert not load[:1000].any()
    assert load[[1000, 1500, 2000, 2999]] == pytest.approx([2.0, 3.0, 4.0, 4.0], rel=1e-12)
    # a record from 5 s on, held at zero, and a load from 5.5 s on, of the same clock: half a second late
    record = table(tmp_path / "record.csv", "t,deg", 5.0 + 0.1 * np.arange(11), [0] * 11)
    load = table(tmp_path / "load.csv", "t,Nm", [5.5, 5.6, 5.7], [2] * 3)
    early = table(tmp_path / "early.csv", "t,Nm", [0.5, 0.6, 0.7], [2] * 3)
    rows = run(f"--record {record} --load-file {load}")[1]
    assert rows["load_Nm"][rows["time_s"] < 0.5 - 1e-6].tolist() == [0.0] * 5000
    assert np.all(rows["load_Nm"][rows["time_s"] > 0.5 + 1e-6] == 2.0)
    for words, said in (
        (f"--record {record} --load-file {early}", "the run from 5 to 6 s on the record's clock: no load"),
        (f"--load-file {load}", "the run from 0 to 1 s: no load would act"),
    ):
        assert said in run.refused(words)


def test_content_above_nyquist_is_refused(run, tmp_path) -> None:
    """The position loop of this drive runs at 1 kHz: 700 Hz would be seen as 300."""
    t = np.arange(0.0, 0.2, 1e-4)
    step = np.where(t < 0.05, 0.0, 0.1)  # a step has lines everywhere, none of them large
    fast, slow = (0.1 * np.sin(2.0 * np.pi * hertz * t) for hertz in (700.0, 100.0))
    for angle, taken in ((fast, run.refused), (slow, run), (step, run)):
        record = table(tmp_path / "record.csv", "t,angle", t, angle)
        said = taken(f"ilr33-amber-multirate --record {record}")
        assert taken is run or "above the Nyquist frequency" in said


AMBER = load_design("ilr33-amber")
C0, kM = AMBER.friction.dry_torque_Nm, AMBER.motor.torque_constant_Nm_A
kE = AMBER.motor.back_emf_constant_Vs_rad
SPEED = ("position",)
CURRENT = (*SPEED, "velocity")
VOLTAGE = (*CURRENT, "current")


def without(stages: tuple[str, ...], folder: Path) -> Path:
    """The baseline without its outer stages, its friction dry."""
    friction = Friction(dry_torque_Nm=C0)
    design = changed(AMBER, controller=dict.fromkeys(stages), friction=friction, requirements=())
    (folder / "drive.toml").write_text(write_design(design))
    return folder / "drive.toml"


def test_a_drive_without_a_loop_says_so_and_has_corners_and_a_report(tmp_path, cli) -> None:
    drive = without(VOLTAGE, tmp_path)
    head = "the drive has no loop, so there are no margins. The design states no requirements."
    said = [cli.text("margins", drive, "--quiet"), cli.text("corners", drive, "--quiet")]
    assert head in " ".join(said[0].split())
    assert "Phase margin" not in said[0]
    assert "The drive has no loop at all" in said[1]
    cli.text("report", drive, "--no-validation", "--out", tmp_path)
    assert "loops are" not in (tmp_path / "report.html").read_text()  # "All 0 loops are stable, ."


def test_volts_and_amperes(run, tmp_path) -> None:
    """At rest of the transient U = R i + kE w, with i from the dry friction."""
    facts, rows = run(f"{without(VOLTAGE, tmp_path)} --amplitude 6 --duration 2")
    told = {"commanded": "voltage", "status": "becomes steady"}
    told |= {"largest_command_V": 6.0, "largest_error_V": 0.0}
    assert facts | told == facts
    assert np.all(rows["voltage_reference_V"] == 6.0)
    speed = (6.0 - AMBER.motor.resistance_ohm * C0 / kM) / kE
    assert rows["motor_speed_rad_s"][-1] == pytest.approx(speed, rel=1e-9)
    # the back-EMF rises while the rotor speeds up: the PI lags behind its ramp by kE a Ti / Kp
    facts, rows = run(f"{without(CURRENT, tmp_path)} --amplitude 1 --duration 0.01")
    assert facts["largest_error_A"] == pytest.approx(1.0)
    assert np.all(rows["current_reference_A"] == 1.0)
    loop = AMBER.controller.current
    lag = kE / AMBER.inertia_kgm2 * loop.integral_time_s / loop.gain_V_A
    current = (1.0 + lag * C0) / (1.0 + lag * kM)
    assert rows["current_A"][-1] == pytest.approx(current, rel=1e-3)
    _, still = run(f"{without(CURRENT, tmp_path)} --amplitude 0.1 --duration 0.1")  # below its friction
    assert still["current_A"][-1] == pytest.approx(0.1, rel=1e-9)
    assert not still["motor_speed_rad_s"].any()


def test_speed_settles_while_the_output_turns_however_short_the_run_is(run, tmp_path) -> None:
    """What a drive ends in is no matter of how long the run is: cut at less than J/(Kp kM), 1.4 ms."""
    drive, rate = without(SPEED, tmp_path), radians(20.0)
    wanted = AMBER.total_ratio * rate
    facts, rows = run(f"{drive} --amplitude 20 --duration 3")
    assert facts["status"] == "becomes steady"
    assert np.all(rows["output_speed_reference_rad_s"] == rate)
    assert rows["motor_speed_rad_s"][-1] == pytest.approx(wanted, rel=1e-6)
    assert rows["speed_command_rad_s"][-1] == pytest.approx(wanted, rel=1e-12)
    assert facts["largest_error_rad_s"] == pytest.approx(rate, rel=0.2)
    assert facts["final_response_rad_s"] == pytest.approx(rate, rel=1e-3)
    assert facts["largest_response_rad_s"] == rows["motor_speed_rad_s"].max() / AMBER.total_ratio
    facts, cut = run(f"{drive} --amplitude 20 --duration 0.001")
    assert 0.0 < cut["motor_speed_rad_s"][-1] < (1.0 - exp(-1.0)) * wanted
    assert facts["status"] == "becomes steady"


@pytest.mark.parametrize(("stages", "unit"), [(VOLTAGE, "V"), (CURRENT, "A"), (SPEED, "deg/s")])
def test_words_have_the_unit(stages: tuple[str, ...], unit: str, tmp_path, cli) -> None:
    said = cli.text("simulate", without(stages, tmp_path), "--amplitude", 0.5, "--duration", 0.1, "--quiet")
    rows = [row.split() for row in said.splitlines()]
    assert ["largest", "command", "0.5", unit] in rows
    assert any(row[:2] == ["largest", "error"] and row[3:] == [unit] for row in rows)
    moved = {" ".join(row[:-2]): row[-1] for row in rows if row}
    assert moved["largest output angle"] == "deg"
    assert moved.get("largest output speed") == (unit if stages == SPEED else None)


@pytest.mark.parametrize(("drive", "words", "most"), [
    (VOLTAGE, "--amplitude 6 --duration 0.3", 1e-9),
    (CURRENT, "--amplitude 1 --duration 0.3", 1e-9),
    (SPEED, "--amplitude 20 --duration 0.3", 1e-9),
    ("ballscrew", "--command chirp --amplitude 1 --duration 0.5", 1e-9),
    ("emps", "--command step --amplitude 1 --duration 0.3", 1e-9),
    # a drive with friction that a load makes: without its load the record would not be met
    ("ilr33-amber", "--command multisine --frequency 2 --to 6 --count 3 --load 1 --amplitude 0.5 "
     "--duration 0.5 --load-slope -5 --load-file LOAD", 1e-6),
])  # fmt: skip
def test_its_own_record_correlates(drive, words: str, most: float, run, tmp_path, cli) -> None:
    """A record of the same drive under the same command: the same run, to the last digits of the file."""
    bare, k = not isinstance(drive, str), np.arange(31)
    drive = without(drive, tmp_path) if bare else drive
    load = table(tmp_path / "load.csv", "t,M", 0.01 * k, np.sin(0.3 * k))
    run(f"{drive} {words.replace('LOAD', str(load))}")
    data = cli.data("correlate", drive, tmp_path / "run.csv")
    assert data["passed"] is True
    errors = [one["relative_error"] for one in data["records"][0]["signals"].values()]
    assert len(errors) >= (1 if bare else 3)
    assert max(errors) < most
    # said in words as well; asked once, as each answer takes as long as the other
    assert drive != "emps" or cli.text("correlate", drive, tmp_path / "run.csv").startswith("PASS  ")
