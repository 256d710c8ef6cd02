"""Monte Carlo studies: closed-form odds, worst cases in corners, the same bits however computed, resuming."""

import tomllib

import numpy as np
import pyarrow.parquet as pq
import pytest
import tomli_w

from actuator_lti import load_design, read_design_text, write_design
from actuator_lti.errors import InputError
from analyses.engine import Engine
from analyses.monte_carlo import MonteCarloSettings, SampleTask, monte_carlo, replay
from analyses.monte_carlo.store import Store
from analyses.sampling import sampler_of


def toleranced():
    """The baseline with a friction coefficient that may be wrong by 60 % and a resistance by 20 %."""
    tree = tomllib.loads(write_design(load_design("ilr33-amber")))
    tree["friction"]["load_coefficient"]["tolerance"] = "60 %"
    tree["motor"]["resistance"]["tolerance"] = "20 %"
    return read_design_text(tomli_w.dumps(tree))


@pytest.fixture(scope="module")
def design():
    return toleranced()


@pytest.fixture(scope="module")
def study(design, tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return monte_carlo(design, folder, MonteCarloSettings(samples=1000, seed=3, chunk=400))


def test_odds_of_a_current_limit_are_the_closed_form(study):
    """i = (C0 + CM M + Cv w)/kM is linear in the uniform CM: P(i <= 4 A) by hand."""
    largest = (4.0 * 5.9e-3 - 2.25e-3 - 5.25e-6 * 942.5) / 8.0
    truth = (largest / 1.34e-3 - 0.4) / 1.2
    odds = next(o for o in study.odds if o.id == "motor-current")
    assert 0.5 < truth < 0.95
    assert odds.low <= truth <= odds.high
    assert odds.probability == pytest.approx(truth, abs=2e-3)


def test_the_worst_case_lies_beyond_the_worst_sample_in_the_corner(study, design):
    case = next(w for w in study.worst if w.requirement == "motor-current")
    corner = (2.25e-3 + 1.6 * 1.34e-3 * 8 + 5.25e-6 * 942.5) / 5.9e-3
    assert case.sampled < case.value == pytest.approx(corner, rel=1e-9)
    assert not case.passed
    assert study.verdict == "not met"
    saved = load_design(case.file)
    assert saved.friction.load_coefficient == pytest.approx(1.6 * 1.34e-3)
    margin = next(w for w in study.worst if w.requirement == "gain-margin")
    assert margin.value <= margin.sampled


def test_same_bits_whatever_the_chunks_and_threads(study, design, tmp_path):
    settings = MonteCarloSettings(samples=1000, seed=3, chunk=77)
    other = monte_carlo(design, tmp_path / "b", settings, engine=Engine(threads=1))
    assert other.columns == study.columns
    assert other.odds == study.odds
    assert [w.parameters for w in other.worst] == [w.parameters for w in study.worst]


def test_a_single_sample_is_replayed_by_its_number(study, design):
    sampler = sampler_of(design, seed=3)
    result = replay(design, sampler, 617)
    row = pq.read_table(study.folder / "samples-0000000400-400.parquet").slice(217, 1).to_pylist()[0]
    assert row["sample"] == 617
    assert result.friction.load_coefficient == row["parameter.friction.load_coefficient"]
    alone = SampleTask(design, sampler).evaluate(617, 1)
    assert alone["position.phase_margin"][0] == row["position.phase_margin"]


def test_permuting_samples_changes_nothing(design):
    task = SampleTask(design, sampler_of(design, seed=1))
    draws = task.sampler.draw(0, 50)
    order = np.random.default_rng(0).permutation(50)
    straight, mixed = task.figures(draws), task.figures(draws[order])
    assert all(np.array_equal(straight[k][order], mixed[k], equal_nan=True) for k in straight)


def test_an_interrupted_study_goes_on(study, design, tmp_path):
    settings = MonteCarloSettings(samples=1000, seed=3, chunk=100, worst_cases=False)

    def interrupt(done, _):
        if done >= 300:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        monte_carlo(design, tmp_path, settings, engine=Engine(threads=1), progress=interrupt)
    left = sorted(tmp_path.glob("*.parquet"))
    assert 3 <= len(left) < 10
    left[0].write_bytes(left[0].read_bytes()[:100])  # as a crash of the machine might leave it
    stamp = left[1].stat().st_mtime_ns
    resumed = monte_carlo(design, tmp_path, settings)
    assert resumed.columns == study.columns
    assert left[1].stat().st_mtime_ns == stamp


def test_another_study_does_not_mix_into_a_folder(study, design):
    with pytest.raises(InputError, match="another study"):
        monte_carlo(design, study.folder, MonteCarloSettings(samples=1000, seed=4))


def test_blocks_do_not_follow_the_chunks(tmp_path):
    store = Store.open(tmp_path, {}, 7)
    for first, count in store.chunks(50):
        store.write((first, count), {"x": np.arange(first, first + count, dtype=float)})
    blocks = [b["x"] for b in store.blocks(50, size=16)]
    assert [len(b) for b in blocks] == [16, 16, 16, 2]
    assert np.array_equal(np.concatenate(blocks), np.arange(50.0))
