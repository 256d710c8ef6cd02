"""Several records together, at several settings: joint fit, held-out record, fixed values, honest errors."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_lti.design import load_design, parameter_value, with_values, write_design
from analyses.estimation.least_squares import between_records, covariance_of, events_of, scaled_lstsq, solve
from analyses.records.open_record import open_records
from nonlinear import commands, simulate
from reports.document import load
from tests.identification.bench_records import columns_of, motion, staircase, write


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("records")
    made = {
        "a": columns_of(motion(2), 0),
        "b": columns_of(motion(3), 1),
        "unseen": columns_of(motion(4), 2),
        "loaded": columns_of(motion(5, load_Nm=5.0), 3, load_Nm=5.0),
        "one way": columns_of(staircase(100.0, 300.0, 600.0, 900.0), 4),
        "one speed": columns_of(staircase(500.0), 5),
    }
    return {name: str(write(folder / f"{name.replace(' ', '_')}.csv", c)) for name, c in made.items()}


def test_records_with_loads_of_their_own_are_one_fit_judged_on_another(files, tmp_path, cli) -> None:
    """Truth: the coefficients of the design that was simulated (Table 1 of the paper)."""
    arguments = ("identify", files["a"], files["b"], files["loaded"], "--validate", files["unseen"])
    result = cli.data(*arguments, "--design", "ilr33-amber", "--refine", "--out", tmp_path)
    checks = {check["id"]: check for check in result["items"]}
    assert checks["held-out-unseen.csv"]["passed"]
    limit = 1.5 * result["model"]["relative_residual"] + 0.02
    assert checks["held-out-unseen.csv"]["limit"] == pytest.approx(limit)
    assert {one["record"] for one in result["resimulated"]} == {"a.csv", "b.csv", "loaded.csv", "unseen.csv"}
    written = load_design(tmp_path / "ilr33-amber-identified.toml")
    assert written.friction.load_coefficient == pytest.approx(1.34e-3, rel=3e-3)
    assert written.friction.dry_torque_Nm == pytest.approx(2.25e-3, rel=5e-3)
    assert written.friction.viscous_Nms_rad == pytest.approx(5.25e-6, rel=5e-3)
    page = load(tmp_path / "identification.json")
    blocks = [block for part in page["sections"] for block in part["blocks"] if "caption" in block]
    tables = {block["caption"]: block.get("note") for block in blocks}
    assert "Torque constant kM, fixed: these records do not tell it" in tables["Refined by simulation"]
    for path, refined in result["refined"]["parameters"].items():
        tolerance = written.parameters[path].tolerance
        assert written.parameters[path].value == pytest.approx(refined["value"], rel=1e-6)
        assert tolerance.std == pytest.approx(refined["standard_error"], rel=1e-5)


def test_a_held_out_record_is_filtered_and_that_of_another_drive_fails(files, tmp_path, cli) -> None:
    other = with_values(load_design("ilr33-amber"), {"friction.dry_torque": 3.5e-3})
    path = str(write(tmp_path / "other.csv", columns_of(motion(6, design=other), 7)))
    told = cli.data("identify", files["a"], "--validate", path, "--design", "ilr33-amber", status=1)
    checks = {check["id"]: check for check in told["items"]}
    assert not checks["held-out-other.csv"]["passed"]
    assert checks["residual"]["passed"]
    # the same record again has the residual of the fit, less what its own bias is
    again = shutil.copy(files["a"], tmp_path / "again.csv")
    words = ("identify", files["a"], "--validate", again, "--design", "ilr33-amber", "--cutoff", "20")
    told = cli.data(*words)
    checks = {check["id"]: check for check in told["items"]}
    residual = told["model"]["relative_residual"]
    assert checks["held-out-again.csv"]["value"] == pytest.approx(residual, rel=0.05)


def test_a_value_can_be_held(files: dict[str, str], cli) -> None:
    common = ("identify", files["loaded"], "--design", "ilr33-amber")
    model = cli.data(*common, "--fix", "friction.load_coefficient=1.34 mN*m/(N*m)")["model"]
    held = {"value": 1.34e-3, "reason": "fixed as asked", "moves": {}, "std": 0.0}
    assert model["fixed"]["load_coefficient"] == held
    assert model["parameters"]["dry"]["value"] == pytest.approx(2.25e-3, rel=0.05)
    for wrong, reason in (
        ("friction.load_coefficient", "KEY=VALUE is wanted"),
        ("friction.banana=1", "unknown parameter"),
        ("friction.viscous=1 kg", "wrong dimension"),
        ("motor.resistance=1 ohm", "can be fixed here"),
    ):
        assert reason in cli.refused(*common, "--fix", wrong)


def test_a_torque_command_is_the_drive(identify) -> None:
    columns = columns_of(motion(2))
    columns["torque_command_Nm"] = 5.9e-3 * columns.pop("current_A")
    result = identify(columns).data
    uses = {row["meaning"]: row["use"] for row in result["inputs"]["r.csv"]}
    assert uses["commanded motor torque"] == "drive: torque as commanded"
    found, inertia = result["model"]["parameters"], load_design("ilr33-amber").inertia_kgm2
    assert found["dry"]["value"] == pytest.approx(2.25e-3, rel=0.03)
    assert found["inertia"]["value"] == pytest.approx(inertia, rel=0.01)


@pytest.mark.parametrize("name", ["one way", "one speed"])
def test_one_direction_says_what_it_cannot_tell_apart(name: str, files: dict[str, str], cli) -> None:
    """At one speed dry and viscous friction are told by the run-up alone: poorly, and their errors say so."""
    model = cli("identify", files[name], "--design", "ilr33-amber", "--json").data["model"]
    told = "cannot be separated from dry: the design's value kept; an error of it moves dry by -1 times it"
    assert name == "one speed" or model["fixed"]["offset"]["reason"] == told
    for key, truth in (("dry", 2.25e-3), ("viscous", 5.25e-6)):
        value, std = (model["parameters"][key][one] for one in ("value", "standard_error"))
        assert abs(value - truth) < 3.0 * std
        assert name == "one speed" or value == pytest.approx(truth, rel=0.03)


def test_errors_of_correlated_residuals_are_the_scatter_of_the_fits() -> None:
    """AR(1) noise: the standard deviation of 200 fits against the mean of the stated errors."""
    rng = np.random.default_rng(3)
    time = np.arange(2000) * 0.01
    w = np.column_stack([np.ones_like(time), np.sin(0.7 * time)])
    fits, stated, white = [], [], []
    for _ in range(200):
        noise = lfilter([1.0], [1.0, -0.95], rng.standard_normal(len(time)))
        result = solve(w, w @ np.array([1.0, 2.0]) + noise)
        fits.append(result.values)
        stated.append(np.sqrt(np.diag(result.correlated)))
        white.append(np.sqrt(np.diag(result.white)))
    spread = np.std(fits, axis=0)
    assert np.mean(stated, axis=0) == pytest.approx(spread, rel=0.25)
    assert np.all(np.mean(white, axis=0) < 0.3 * spread)


def test_scatter_between_records_is_found_again() -> None:
    """Values 2, own error 0.1, scatter 0.5: the estimate's mean square over many draws is the truth's."""
    rng = np.random.default_rng(5)
    own = np.full(6, 0.1)
    drawn = ((rng.standard_normal(6), rng.standard_normal(6)) for _ in range(400))
    result = [between_records(2.0 + 0.5 * apart + own * noise, own) for apart, noise in drawn]
    assert np.sqrt(np.mean(np.square(result))) == pytest.approx(0.5, rel=0.05)


def test_records_that_differ_widen_the_errors(tmp_path, cli) -> None:
    """Six records whose dry friction differs by 10 % rms: the joint error is the scatter over root six."""
    drive = load_design("ilr33-amber")
    true = 2.25e-3 * (1.0 + 0.1 * np.array([1.2, -1.1, 0.4, -0.2, 0.9, -1.2]))
    paths = [
        str(write(tmp_path / f"{k}.csv", columns_of(
            motion(3, design=with_values(drive, {"friction.dry_torque": float(c)})), k)))
        for k, c in enumerate(true)
    ]  # fmt: skip
    model = cli("identify", *paths, "--design", "ilr33-amber", "--json").data["model"]
    dry = model["parameters"]["dry"]
    assert dry["value"] == pytest.approx(true.mean(), rel=0.03)
    assert dry["standard_error"] == pytest.approx(true.std(ddof=1) / np.sqrt(6.0), rel=0.2)
    assert model["white_errors"][2] < 0.3 * dry["standard_error"]


def test_correlation_over_several_records(files: dict[str, str], cli) -> None:
    paths = (files["a"], files["b"], files["loaded"])
    result = cli.data("correlate", "ilr33-amber", *paths)
    own = [record["signals"]["current"] for record in result["records"]]
    summary = result["summary"]["current"]
    assert summary["max_error"] == max(one["max_error"] for one in own)
    shares = [one["share_of_motion"] for one in own]
    assert min(shares) < summary["share_of_motion"] < max(shares)
    assert summary["rms_error"] ** 2 == pytest.approx(np.mean([one["rms_error"] ** 2 for one in own]))
    assert summary["mean_error"] == pytest.approx(np.mean([one["mean_error"] for one in own]))
    assert own[0]["rms_error"] == pytest.approx(0.02, rel=0.05)  # the noise that was added
    assert own[0]["mean_error"] == pytest.approx(0.02 * np.sqrt(2.0 / np.pi), rel=0.05)
    worst = max(result["records"], key=lambda one: one["signals"]["angle"]["relative_error"])
    assert result["worst"] == worst["record"]
    said = f"3 records against ilr33-amber; the motion of {Path(result['worst']).name} is furthest off"
    assert said in cli("correlate", "ilr33-amber", *paths).out


SHARED = """
time = { column = "time_s" }
signals.reference = { column = "reference_deg", unit = "deg" }
signals.angle = { column = "motor_angle_rad", unit = "rad" }
signals.current = { column = "current_A", unit = "A" }
"""
GAINS, INERTIAS = (60.0, 120.0), (2e-4, 0.9)


@pytest.fixture(scope="module")
def eight(tmp_path_factory) -> Path:
    """Two gains, two known inertias at the output (of up to 70 % of the whole), two motions of each."""
    folder, text = tmp_path_factory.mktemp("eight"), SHARED
    for gain in GAINS:
        for inertia in INERTIAS:
            set_to = {"control.position.gain": gain, "load.inertia": inertia}
            drive = load_design("ilr33-amber").with_values(set_to)
            files = [f"{gain:g}_{inertia:g}_{seed}.csv" for seed in (1, 2)]
            for seed, file in enumerate(files):
                write(folder / file, columns_of(motion(seed, design=drive), seed))
            text += f'\n[[record]]\nfile = ["{files[0]}", "{files[1]}"]\n'
            text += f'settings.control.position.gain = "{gain} 1/s"\nsettings."load.inertia" = {inertia}\n'
    (folder / "runs.toml").write_text(text)
    return folder / "runs.toml"


def test_eight_records_of_two_gains_are_one_fit(eight, cli) -> None:
    """The inertia at the output is known of each: what is found is the motor's own, from all eight."""
    design = load_design("ilr33-amber")
    model = cli.data("identify", eight, "--design", "ilr33-amber")["model"]
    assert len(model["records"]) == 8
    truth = {"inertia": design.inertia_kgm2, "viscous": design.friction.viscous(1)}
    for name, value in truth.items():
        found = model["parameters"][name]
        assert abs(found["value"] - value) < 4.0 * found["standard_error"] + 1e-3 * value, name
    records = open_records(eight)
    assert [record.settings["load.inertia"] for record in records] == [*np.repeat(INERTIAS, 2)] * 2
    records = cli.data("correlate", "ilr33-amber", eight, "--error-limit", "3")["records"]
    told = [note for record in records for note in record["notes"]]
    assert [told.count(f"set: control.position.gain = {gain} 1/s") for gain in GAINS] == [4] * 2
    plain = eight.with_name("plain.toml")
    plain.write_text(SHARED + f'file = "{GAINS[0]:g}_{INERTIAS[0]:g}_1.csv"\n')
    assert cli("correlate", "ilr33-amber", plain, "--error-limit", "3").status == 1


def test_a_drive_on_a_voltage_is_refined_over_its_gains(tmp_path, cli) -> None:
    """A P position loop sets the voltage, which no column holds: it is the gain times a difference of two."""
    drive = load_design("ctms-motor-position")
    text = 'time = { column = "time_s" }\nsignals.reference = { column = "reference_rad", unit = "rad" }\n'
    text += 'signals.angle = { column = "angle_rad", unit = "rad" }\n'
    for k, gain in enumerate((0.6, 1.0, 1.6, 2.4)):
        command_to = commands.multisine(1.0, [0.7, 1.9, 4.3], 4.0, 1e-3, seed=k)
        run = simulate(drive.with_values({"control.position.gain": gain}), command_to, 4.0)
        noise = 1e-4 * np.random.default_rng(k).standard_normal(len(run.time_s))
        angle = run.motor_angle_rad + noise
        columns = {"time_s": run.time_s, "reference_rad": run.reference_rad, "angle_rad": angle}
        write(tmp_path / f"{k}.csv", columns)
        text += f'[[record]]\nfile = "{k}.csv"\nsettings."control.position.gain" = {gain}\n'
        text += f'signals.voltage = {{ column = "reference_rad - angle_rad", unit = "V", scale = {gain} }}\n'
    (tmp_path / "runs.toml").write_text(text)
    words = ("identify", tmp_path / "runs.toml", "--design", "ctms-motor-position", "--refine")
    result = cli.data(*words, "--out", tmp_path / "o")
    first = load(tmp_path / "o" / "identification.json")["sections"][0]["result"]
    assert first.startswith("Refined by simulation: motor.rotor_inertia 3.228")
    found = result["refined"]["parameters"]
    made = load_design(tmp_path / "o" / "ctms-motor-position-identified.toml")
    for key in ("motor.rotor_inertia", "friction.viscous"):
        value, error = found[key]["value"], found[key]["standard_error"]
        assert abs(value - parameter_value(drive, key)) < 4.0 * error < 0.01 * value
        assert parameter_value(made, key) == pytest.approx(value)


@pytest.mark.parametrize(("settings", "reason"), [
    ('"control.position.gain" = "90 kg"', "settings: control.position.gain"),
    ('"control.position.gian" = "90 1/s"', "settings: control.position.gian"),
    ('"friction.viscous" = "1e-6 N*m*s/rad"', "is found from all records; allowed: any other key, or --fix"),
    ('"control.position.gain" = [1]', "a key of the design with its value is wanted"),
])  # fmt: skip
def test_a_setting_that_cannot_be_is_refused(settings: str, reason: str, eight: Path, cli) -> None:
    file = eight.with_name("wrong.toml")
    file.write_text(f'{SHARED}\nfile = "{GAINS[0]:g}_{INERTIAS[0]:g}_1.csv"\n[settings]\n{settings}\n')
    err = cli.refused("identify", file, "--design", "ilr33-amber")
    assert reason in err
    assert "wrong.toml" in err or ".csv" in err


def test_a_design_in_the_place_of_a_record_is_named(eight, cli) -> None:
    file = eight.with_name("my.toml")
    file.write_text(write_design(load_design("ilr33-amber")))
    for words in (("correlate", "ilr33-amber", file), ("identify", eight, file)):
        status, _, err = cli(*words)
        assert status == 2
        assert "my.toml: a design, and no record; allowed: CSV" in err
        assert "correlate takes the design first, identify behind --design" in err
    status, _, err = cli("correlate", eight.with_name("60_0.0002_1.csv"), file)
    assert status == 2
    assert "a table of numbers, TOML is wanted: a record, and no design?" in err


def test_one_event_is_in_the_errors_as_if_its_block_were_left_out() -> None:
    """By fits without one block each: an event bends the values towards itself."""
    rng = np.random.default_rng(2)
    w = np.column_stack([rng.standard_normal(400), 1e4 * np.ones(400)])
    y = w @ [2.0, 3e-4] + 1e-3 * rng.standard_normal(400)
    y[45:50] += 20.0
    values = scaled_lstsq(w, y)
    without = [np.delete(np.arange(400), block) for block in np.array_split(np.arange(400), 20)]
    moved = [scaled_lstsq(w[rows], y[rows]) - values for rows in without]
    found = covariance_of([events_of(w, y - w @ values)])
    assert found == pytest.approx(400 / 398 * 19 / 20 * np.transpose(moved) @ moved, rel=1e-6)
    assert np.all(np.abs(values - [2.0, 3e-4]) < 1.1 * np.sqrt(np.diag(found)))
