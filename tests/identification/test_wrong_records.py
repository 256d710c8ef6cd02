"""Records that are wrong as records are on a bench: no design may come of them with status 0."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from actuator_lti.design import load_design, parameter_value, with_values
from analyses.identification.to_design import inertia_share
from analyses.records.consistency import check_record
from nonlinear import commands, simulate
from tests.identification.bench_records import Columns, bare, columns_of, motion, record_of
from tests.refusals import refused


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


def test_a_drive_that_carries_its_load_is_not_what_the_law_of_a_campaign_says(bench: Path, cli) -> None:
    """The motor carries M/N besides: of a ratio of 2376 0.4209 mN m/(N m), which would be in CM."""
    words = ("identify", bench / "campaign.toml", "--set", 'load.path="back-drivable"', "--suggest", "0")
    law, *_ = cli.data(*words, status=1)["items"]
    assert (law["id"], law["passed"]) == ("law", False)
    assert "1/N = 0.4209 mN m/(N m)" in law["reason"]
    assert 'load.path = "self-locking"' in law["reason"]


@pytest.mark.parametrize(("step", "told"), [(1, True), (10, None)])
def test_a_voltage_at_the_outer_loop_s_ticks_alone_tells_no_resistance(step: int, told: bool | None) -> None:
    """Of one simulated run: at every tick R is the drive's own; a reversed sign shows at both."""
    design = with_values(bare("ilr33-amber"), {"control.position.every": 10})
    run = simulate(design, commands.multisine(0.02, [0.7, 1.9, 4.3], 3.0, 1e-4, seed=2), 3.0)
    seen = {"angle": run.motor_angle_rad, "speed": run.motor_speed_rad_s}
    seen = {**seen, "current": run.current_A, "voltage": run.voltage_V}
    for sign, passed in ((1.0, told), (-1.0, False)):
        signals = {name: values[::step] for name, values in {**seen, "current": sign * run.current_A}.items()}
        found = check_record(design, record_of(run.time_s[::step], **signals))
        (one,) = (one for one in found if one.subject.endswith("kE w"))
        assert one.passed is passed, one.text
