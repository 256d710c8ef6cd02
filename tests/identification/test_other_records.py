"""Records published (EMPS, to the printed digits; ODrive), of a gimbal, and of the simulator itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design.asked import FrozenMap
from actuator_lti.design.model import Tolerance
from analyses.identification.inverse import fit_records
from analyses.records.consistency import check_record
from analyses.records.open_record import open_record
from analyses.studies.sampling import sampler_of
from analyses.tuning.problem import gain_requirements, problem_of
from examples.odrive_motor import find_chirp, fit_step, main, predict_chirp
from tests.identification.bench_records import columns_of, motion, record_of, write
from tests.refusals import refused

GIMBAL = Path(__file__).parents[1] / "nonlinear" / "gimbal.toml"


def test_friction_meets_the_published_digits(emps_file) -> None:
    """Standard errors: those of white residuals, as published; `covariance` counts their correlation."""
    design, records = load_design("emps"), [open_record(emps_file)]
    model, other = (fit_records(design, records, form=form) for form in ("symmetric", "per-direction"))
    assert [f"{v:.4f}" for v in model.values] == ["95.1089", "203.5034", "20.3935", "-3.1648"]
    assert [f"{v:.4f}" for v in model.white_errors] == ["0.1085", "1.1460", "0.1012", "0.0444"]
    assert (np.diag(model.covariance) > model.white_errors**2).all()
    assert [f"{v:.4f}" for v in other.values] == ["95.1540", "166.7061", "20.1440", "240.4236", "20.6277"]
    assert [f"{100 * one.relative_residual:.4f}" for one in (model, other)] == ["4.0834", "3.1117"]
    assert (design.motor.rotor_inertia_kgm2, design.friction.viscous_Nms_rad) == (95.1089, 203.5034)
    assert records[0].counts.rows_in == records[0].counts.rows_out == 24841


@pytest.mark.parametrize(("changes", "status"), [((), 0), (("--set", "motor.resistance=0.3 ohm"), 1)])
def test_its_own_record_fits_and_a_factor_of_ten_does_not(tmp_path, cli, changes, status) -> None:
    """The record is the simulator's; u = R i + L di/dt + kE w holds in it."""
    words = ("--command", "chirp", "--to", 20, "--duration", 2, "--amplitude", 3, "--every", 4, "--quiet")
    cli.text("simulate", GIMBAL, *words, "--csv", tmp_path / "run.csv")
    said = cli.text("correlate", GIMBAL, tmp_path / "run.csv", *changes, "--quiet", status=status)
    assert ("R i counts" in said) == bool(status)


def test_the_motor_of_the_steps_predicts_the_chirp(odrive_files: dict[str, Path], capsys) -> None:
    """Published: 4.52 turns/s. 1.9 % of the speed from 1 to 48 Hz, no band worse than 3.5 %."""
    motor = fit_step([open_record(odrive_files["step1"])])
    assert motor.steady_speeds_rad_s[0] / (2.0 * np.pi) == pytest.approx(4.52, abs=0.005)
    assert motor.time_constant_std_s < 0.1 * motor.time_constant_s
    result = predict_chirp(motor, open_record(odrive_files["chirp1"]))
    assert result.law.amplitude == pytest.approx(0.25, rel=2e-3)
    assert result.law.start_hz == pytest.approx(1.0, rel=5e-3)
    assert result.law.frequency_hz(result.law.end_s) > 45.0
    assert result.whole.relative_error < 0.025
    assert max(band.relative_error for _, _, band in result.bands) < 0.035
    main([str(odrive_files[name]) for name in ("step1", "chirp1")])
    assert f"speed: error {100.0 * result.whole.relative_error:.2f} %" in capsys.readouterr().out
    # two steps 0.35 ms apart cannot be pooled to 0.04 ms
    steps = [open_record(odrive_files[name]) for name in ("step1", "step2")]
    alone = [fit_step([step]).time_constant_s for step in steps]
    together = fit_step(steps)
    assert together.time_constant_std_s > 0.4 * abs(alone[0] - alone[1])
    assert min(alone) < together.time_constant_s < max(alone)


def test_a_record_of_another_motor_is_not_written_into_a_design(odrive_files, cli, tmp_path) -> None:
    """A step of 38 ms: what one row told of offset and drift widened the errors until 44 times agreed."""
    words = ("identify", odrive_files["step1"], "--design", "ilr33-amber", "--out", tmp_path)
    said = " ".join(cli.text(*words, status=1).split())
    assert "Viscous friction is 44" in said
    assert "first 9 and last 9 samples dropped" in said
    assert not list(tmp_path.glob("*.toml"))
    unproven = said.partition("Not proven, which alone does not fail: ")[2].partition(". ")[0].split("; ")
    assert len(set(unproven)) == len(unproven) > 4


def test_a_chirp_is_found_again_and_noise_is_not() -> None:
    time = np.arange(0.0, 6.0, 5e-3)
    since = np.maximum(time - 1.0, 0.0)
    signal = 0.3 * np.sin(2.0 * np.pi * 1.5 * np.expm1(0.8 * since) / 0.8)
    law = find_chirp(time, signal)
    assert (law.start_hz, law.rate_per_s) == (pytest.approx(1.5, rel=1e-4), pytest.approx(0.8, rel=1e-4))
    assert law.end_s > 5.9
    noise = np.where(time > 1.0, np.random.default_rng(0).standard_normal(len(time)), 0.0)
    refused(find_chirp, time, noise, words="no chirp")


AMBER = load_design("ilr33-amber")


@pytest.mark.parametrize(("clock", "said"), [(1.0, "one clock"), (1.1, "clock +1")])
def test_noise_in_a_long_rest_is_no_contradiction_but_a_clock_that_is_off(clock: float, said: str) -> None:
    """A motion of 50 ms in a rest of 5 s, speed and angle in closed form, white noise on the speed."""
    t = np.arange(50_000) * 1e-4
    u = np.clip(t / 0.05, 0.0, 1.0)
    angle = 500.0 * 0.05 * (u / 2.0 - np.sin(2.0 * np.pi * u) / (4.0 * np.pi))
    speed = 500.0 * np.sin(np.pi * u) ** 2 + 20.0 * np.random.default_rng(3).standard_normal(t.size)
    findings = check_record(AMBER, record_of(clock * t, angle=angle, speed=speed))
    (found,) = (one for one in findings if one.subject.startswith("speed against the rate"))
    assert found.passed is (clock == 1.0)
    assert said in found.text


NAMES = {"viscous": "friction.viscous", "dry": "friction.dry_torque", "offset": "friction.offset_torque"}


def test_what_was_identified_is_what_the_studies_draw(tmp_path, cli) -> None:
    """Covariance of the fit = that of the samples (4096 draws, 5 %); tuning knows them; a study runs."""
    record = write(tmp_path / "a.csv", columns_of(motion(1)))
    ran = cli("identify", record, "--design", "ilr33-amber", "--out", tmp_path, "--json")
    assert not ran.status
    result = ran.data
    design = load_design(tmp_path / "ilr33-amber-identified.toml")
    fitted = result["model"]["names"]
    assert fitted == ["inertia", "viscous", "dry", "offset"]
    wanted = np.array(result["model"]["covariance"])[1:, 1:]
    sampler = sampler_of(design)
    paths = [NAMES[name] for name in fitted[1:]]
    draws = sampler.draw(0, 4096)[:, [sampler.paths.index(path) for path in paths]]
    size = np.sqrt(np.diag(wanted))
    assert np.cov((draws / size).T) == pytest.approx(wanted / np.outer(size, size), abs=0.05)
    corner = problem_of(design, gain_requirements(design), {"control.position.gain": 100.0})
    assert set(paths) <= {factor.path for factor in corner.factors}
    drawn = ("--samples", "64", "--no-worst", "--out", tmp_path / "mc", "--json")
    study = cli("montecarlo", tmp_path / "ilr33-amber-identified.toml", *drawn)
    assert not study.status
    assert study.data["verdict"] == "met"


def test_the_tolerance_of_a_value_that_is_kept_counts_in_those_that_were_found(tmp_path) -> None:
    """At one constant load M, dry + CM M is all that shows: dry has the error M times that of CM."""
    record = open_record(write(tmp_path / "a.csv", columns_of(motion(1, load_Nm=3.0), load_Nm=3.0)))
    key, std = "friction.load_coefficient", 2e-4
    known = replace(AMBER.parameters[key], tolerance=Tolerance(kind="normal", std=std))
    design = replace(AMBER, parameters=FrozenMap({**AMBER.parameters, key: known}))
    plain, wide = fit_records(AMBER, [record]), fit_records(design, [record])
    k = plain.names.index("dry")
    assert plain.fixed["load_coefficient"].moves["dry"] == pytest.approx(-3.0, rel=0.02)
    added = wide.covariance[k, k] - plain.covariance[k, k]
    assert np.sqrt(added) == pytest.approx(3.0 * std, rel=0.02)
    assert "an error of it moves dry by -" in wide.fixed["load_coefficient"].reason
