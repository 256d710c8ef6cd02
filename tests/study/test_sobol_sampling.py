"""Samples of tolerances: reproducible one by one, with the distributions that were asked for."""

import numpy as np
import pytest

from actuator_lti import load_design, read_design_text, write_design
from actuator_lti.design.model import Tolerance
from actuator_lti.errors import InputError
from analyses.studies.sampling import Factor, Sampler, read_table, sampler_of

R, L = "motor.resistance", "motor.inductance"


def sampler(*factors, correlation=None, seed=0, table=None):
    size = len(factors)
    matrix = np.eye(size) if correlation is None else np.array([[1.0, correlation], [correlation, 1.0]])
    return Sampler(tuple(factors), matrix, table, seed)


def uniform(path=R, nominal=10.0, half_width=2.0):
    return Factor(path, nominal, Tolerance(kind="uniform", half_width=half_width))


def normal(path=L, nominal=5.0, std=1.0):
    return Factor(path, nominal, Tolerance(kind="normal", std=std))


def test_a_sample_is_the_same_alone_and_in_any_chunk():
    study = sampler(uniform(), normal(), correlation=0.5, seed=7)
    whole = study.draw(0, 1000)
    assert np.array_equal(np.vstack([study.draw(0, 1), study.draw(1, 332), study.draw(333, 667)]), whole)
    assert np.array_equal(study.draw(777, 1)[0], whole[777])


def test_seed_zero_is_a_seed():
    zero, again, one = (sampler(uniform(), seed=s).draw(0, 8) for s in (0, 0, 1))
    assert np.array_equal(zero, again)
    assert not np.array_equal(zero, one)
    with pytest.raises(InputError, match="seed"):
        sampler(uniform(), seed=-1)


def test_uniform_fills_its_width_evenly():
    values = sampler(uniform()).draw(0, 4096)[:, 0]
    assert values.min() >= 8.0
    assert values.max() <= 12.0
    counts, _ = np.histogram(values, bins=64, range=(8, 12))
    assert np.all(counts == 64)  # what a Sobol sequence promises and random numbers do not


def test_normal_and_truncated_normal_have_their_moments():
    values = sampler(normal()).draw(0, 8192)[:, 0]
    assert values.mean() == pytest.approx(5.0, abs=1e-3)
    assert values.std() == pytest.approx(1.0, abs=2e-3)
    cut = Factor(L, 5.0, Tolerance(kind="truncated-normal", std=1.0, lower=4.0, upper=6.0))
    kept = sampler(cut).draw(0, 8192)[:, 0]
    assert kept.min() >= 4.0
    assert kept.max() <= 6.0
    # variance of a standard normal cut at +-1: 1 - 2 phi(1)/(2 Phi(1) - 1)
    phi, mass = np.exp(-0.5) / np.sqrt(2 * np.pi), 0.6826894921370859
    assert kept.var() == pytest.approx(1 - 2 * phi / mass, rel=2e-3)


def test_correlated_normals_have_their_coefficient():
    pair = sampler(normal(R), normal(L), correlation=-0.8).draw(0, 8192)
    assert np.corrcoef(pair.T)[0, 1] == pytest.approx(-0.8, abs=2e-3)


def test_contradicting_correlations_are_refused():
    factors = tuple(normal(path) for path in (R, L, "load.inertia"))
    matrix = np.array([[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]])
    with pytest.raises(InputError, match="contradict"):
        Sampler(factors, matrix).draw(0, 2)


def test_identified_samples_keep_their_rows_together(tmp_path):
    path = tmp_path / "friction.csv"
    path.write_text("friction.viscous,friction.dry_torque\n1e-6,1e-3\n2e-6,2e-3\n4e-6,4e-3\n8e-6,8e-3\n")
    design = load_design("ilr33-amber")
    table = read_table(path, list(design.parameters))
    study = sampler_of(design, table=table)
    drawn = study.draw(0, 4096)
    viscous, dry = (drawn[:, study.paths.index(p)] for p in table.paths)
    assert np.array_equal(dry, viscous * 1000)
    assert np.unique(viscous, return_counts=True)[1].tolist() == [1024] * 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("motor.colour\n1\n", "motor.colour"),
        ("motor.resistance\nnan\n", "finite"),
        ("motor.resistance\nred\n", "number"),
    ],
)
def test_bad_tables_are_refused(tmp_path, text, message):
    path = tmp_path / "t.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_table(path, ["motor.resistance"])


def test_a_design_without_tolerances_is_refused():
    with pytest.raises(InputError, match="tolerance"):
        sampler_of(load_design("ctms-motor-position"))


def test_a_normal_tolerance_that_reaches_a_negative_inertia_is_refused():
    text = write_design(load_design("ilr33-amber"))
    text = text.replace('tolerance = "50 %"', 'tolerance = { kind = "normal", std = "50 %" }')
    with pytest.raises(InputError, match="truncated-normal"):
        sampler_of(read_design_text(text))
