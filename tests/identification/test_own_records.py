"""Records that the simulator wrote: no error and no finding; into a study with their covariance."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design.asked import FrozenMap
from actuator_lti.design.model import Tolerance
from analyses.identification.inverse import fit_records
from analyses.records.consistency import check_record
from analyses.records.open_record import open_record
from analyses.studies.sampling import sampler_of
from analyses.tuning.problem import loop_requirements, problem_of
from tests.identification.bench_records import columns_of, motion, record_of, write

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
    corner = problem_of(design, loop_requirements(design), {"control.position.gain": 100.0})
    assert set(paths) <= {factor.path for factor in corner.factors}
    drawn = ("--samples", "64", "--no-worst", "--out", tmp_path / "mc", "--json")
    study = cli("montecarlo", tmp_path / "ilr33-amber-identified.toml", *drawn)
    assert not study.status
    assert study.data["verdict"] == "met"


def test_the_tolerance_of_a_value_that_is_kept_counts_in_those_that_were_found(tmp_path) -> None:
    """At one constant load M, dry + CM M is all that shows: dry has the error M times that of CM."""
    record = open_record(write(tmp_path / "a.csv", columns_of(motion(1, load_Nm=3.0), load_Nm=3.0)))
    base = load_design("ilr33-amber")
    key, std = "friction.load_coefficient", 2e-4
    known = replace(base.parameters[key], tolerance=Tolerance(kind="normal", std=std))
    design = replace(base, parameters=FrozenMap({**base.parameters, key: known}))
    plain, wide = fit_records(base, [record]), fit_records(design, [record])
    k = plain.names.index("dry")
    assert plain.fixed["load_coefficient"].moves["dry"] == pytest.approx(3.0, rel=0.02)
    added = wide.covariance[k, k] - plain.covariance[k, k]
    assert np.sqrt(added) == pytest.approx(3.0 * std, rel=0.02)
    assert "an error of it moves dry by -" in wide.fixed["load_coefficient"].reason
