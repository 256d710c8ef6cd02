"""Monte Carlo studies: closed-form odds, worst cases, the same bits however computed, resuming, commands."""

import json
import math
import tomllib
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
import tomli_w
from toleranced import asked_twice, toleranced

from actuator_lti import assemble_loops, load_design, read_design_text, write_design
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import with_overrides
from actuator_lti.design.asked import Requirement, Waiver
from analyses.comparison.found import small_signal
from analyses.linear.loop_figures import all_loop_figures
from analyses.monte_carlo import MonteCarloSettings, SampleTask, monte_carlo, replay, run
from analyses.monte_carlo.judging import (
    Reduction,
    judge,
    judged,
    loop_columns,
    reduced,
    source_columns,
    unpacked,
)
from analyses.monte_carlo.result import MOST, clopper_pearson
from analyses.monte_carlo.task import StepCheck, step_columns
from analyses.specification.requirements import evaluate_requirements
from analyses.studies.engine import Engine
from analyses.studies.sampling import Table, sampler_of
from reports.sections.monte_carlo import brief, section
from tests.changed import changed
from tests.refusals import refused
from tests.reports.live_page import opened


@pytest.fixture(scope="module")
def design():
    return read_design_text(toleranced(friction={"load_coefficient": 60}, motor={"resistance": 20}))


PLAIN = MonteCarloSettings(samples=1000, seed=3, worst_cases=False)


@pytest.fixture(scope="module")
def study(design, tmp_path_factory):
    return monte_carlo(design, tmp_path_factory.mktemp("study"), replace(PLAIN, chunk=400))


def test_odds_of_a_current_limit_are_the_closed_form(study, design):
    """i = (C0 + CM M + Cv w)/kM is linear in the uniform CM: P(i <= 4 A) by hand."""
    largest = (4.0 * 5.9e-3 - 2.25e-3 - 5.25e-6 * 942.5) / 8.0
    truth = (largest / 1.34e-3 - 0.4) / 1.2
    odds = next(o for o in study.odds if o.id == "motor-current")
    assert 0.5 < truth < 0.95
    assert odds.low <= truth <= odds.high
    assert odds.probability == pytest.approx(truth, abs=2e-3)
    judged = [odds.id for odds in study.odds if odds.id != "all"]
    assert judged == [verdict.id for verdict in evaluate_requirements(design)]
    assert study.tally.total == len(judged)
    # the coefficient moves the current between its ends; resistance does not
    first, *rest = [one for one in study.drivers if one.column == "drive.motor_current@8"]
    assert (first.path, first.low_value, first.high_value) == (
        "friction.load_coefficient", pytest.approx(0.4 * 1.34e-3), pytest.approx(1.6 * 1.34e-3)
    )  # fmt: skip
    ends = [(2.25e-3 + part * 1.34e-3 * 8 + 5.25e-6 * 942.5) / 5.9e-3 for part in (0.4, 1.6)]
    assert [first.low, first.high] == pytest.approx(ends, rel=1e-9)
    still = {one.path: one.swing for one in rest}
    assert still["motor.resistance"] == 0.0
    assert all(one.swing <= first.swing for one in rest)


def test_the_worst_case_lies_in_the_corner_and_chunks_and_threads_change_no_bit(design, tmp_path):
    design, settings = asked_twice(design), replace(PLAIN, worst_cases=True)
    searched = monte_carlo(design, tmp_path / "searched", settings)
    case = next(w for w in searched.worst if w.requirement == "motor-current")
    corner = (2.25e-3 + 1.6 * 1.34e-3 * 8 + 5.25e-6 * 942.5) / 5.9e-3
    assert case.sampled < case.value == pytest.approx(corner, rel=1e-9)
    assert not case.passed
    assert searched.verdict == "not met"
    saved = load_design(case.file)
    assert saved.friction.load_coefficient == pytest.approx(1.6 * 1.34e-3)
    margin = next(w for w in searched.worst if w.requirement == "gain-margin/position")
    assert margin.value <= margin.sampled
    other = monte_carlo(design, tmp_path / "other", replace(settings, chunk=77), engine=Engine(threads=1))
    assert other.columns == searched.columns
    assert other.odds == searched.odds
    assert [w.parameters for w in other.worst] == [w.parameters for w in searched.worst]


@pytest.mark.parametrize(("passed", "count", "at_least", "verdict", "says"), [
    (300, 300, 0.99, "met", "at least 99.006 % with 95 % confidence"),  # 0.05^(1/300)
    (298, 298, 0.99, "not proven", "at least 299 samples, if all pass, can show 99 %"),
    (290, 300, 0.97, "not proven", "more samples can show 97 %"),
    (300, 300, 1.0, "not proven", "no number of samples can show 100 %"),
    (0, 300, 0.02, "not met", "at most 0.994 % with 95 % confidence"),  # 1 - 0.05^(1/300)
    (58, 58, None, "not proven", "at least 59 samples, if all pass, can show 95 %"),  # 0.95^59 < 5 %
    (59, 59, None, "met", ""),
    (58, 59, None, "not met", "1 of 59 samples fail"),
])  # fmt: skip
def test_what_samples_alone_prove(passed, count, at_least, verdict, says, study):
    bounds = clopper_pearson(passed, count)
    odds = replace(study.odds[0], passed=passed, count=count, low=bounds[0], high=bounds[1])
    result = replace(study, odds=(odds,), at_least=at_least)
    (item,) = section(result)["blocks"][0]["items"]
    assert (item["verdict"], result.verdict) == (verdict, verdict)
    assert says in item["reason"]


def test_what_samples_do_not_prove_can_be_waived(study):
    waiver = Waiver(requirement=study.odds[0].id, reason="prototype", date="2026-01-31")
    odds = replace(study.odds[0], passed=3, count=3, low=0.0, high=1.0, waiver=waiver)
    assert replace(study, odds=(odds,)).tally.words("requirements") == "0 of 1 requirements met, 1 waived"


def test_the_terminal_says_verdict_and_reason(study):
    made = brief(study)
    rows = {row["label"]: row["verdict"] for row in made.blocks[0]["rows"]}
    what = "Drive: motor current at top speed at 8 N m"
    assert rows[what] == "not met"
    reason = next(note for note in made.notes if note.startswith(f"{what}: "))
    assert "samples fail, worst is number" in reason


def test_a_single_sample_is_replayed_by_its_number_and_another_study_does_not_mix_in(study, design):
    sampler = sampler_of(design, seed=3)
    result = replay(design, sampler, 617)
    row = pq.read_table(study.folder / "samples-0000000400-400.parquet").slice(217, 1).to_pylist()[0]
    assert row["sample"] == 617
    assert result.friction.load_coefficient == row["parameter.friction.load_coefficient"]
    alone = SampleTask(design, sampler)((617, 1))
    assert alone["position.phase_margin"][0] == row["position.phase_margin"]
    refused(monte_carlo, design, study.folder, replace(PLAIN, seed=4), words="another study")


def in_parts(monkeypatch, **sizes):
    """Studies of a thousand samples count as more than are kept."""
    for name, value in {"KEPT": 999, **sizes}.items():
        monkeypatch.setattr(run, name, value)


def interrupted(design, folder, settings, after):
    def interrupt(done, _):
        if done >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        monte_carlo(design, folder, settings, engine=Engine(threads=1), progress=interrupt)


def test_an_interrupted_study_goes_on(study, design, tmp_path):
    settings = replace(PLAIN, chunk=100)
    interrupted(design, tmp_path, settings, after=300)
    left = sorted(tmp_path.glob("*.parquet"))
    assert 3 <= len(left) < 10
    left[0].write_bytes(left[0].read_bytes()[:100])  # as a crash of the machine might leave it
    stamp = left[1].stat().st_mtime_ns
    resumed = monte_carlo(design, tmp_path, settings)
    assert resumed.columns == study.columns
    assert left[1].stat().st_mtime_ns == stamp


@pytest.mark.parametrize("engine", [Engine(threads=2), Engine(workers=1)])
def test_more_samples_than_are_kept_come_to_the_same(engine, study, design, tmp_path, monkeypatch):
    """Reduced where they are computed, in parts of another size: the same to the last bit, none kept."""
    in_parts(monkeypatch, PARTS=4, BLOCK=70)
    result = monte_carlo(design, tmp_path, PLAIN, engine=engine)
    assert result.columns == study.columns
    assert result.odds == study.odds
    assert not list(tmp_path.glob("*.parquet"))
    assert "not kept" in " ".join(result.notes)


@pytest.mark.parametrize("damage", [None, 0, 200, -40])
def test_a_reduced_study_that_was_interrupted_goes_on(damage, study, design, tmp_path, monkeypatch):
    """With what was noted, or from the beginning where that is damaged."""
    in_parts(monkeypatch, PARTS=10, BLOCK=25)
    interrupted(design, tmp_path, PLAIN, after=400)
    (noted,) = tmp_path.glob("reduced-*")
    if damage is not None:
        data = noted.read_bytes()
        noted.write_bytes(data[:damage] + bytes(8) + data[damage:][8:])
    steps = []
    result = monte_carlo(design, tmp_path, PLAIN, progress=lambda *step: steps.append(step))
    assert result.columns == study.columns
    assert result.odds == study.odds
    assert steps[-1] == ((600, 600) if damage is None else (1000, 1000))


def test_a_search_for_the_worst_case_computes_what_its_requirement_is_on_alone():
    """Each computed the stiffness that another asks for besides, and all loops."""
    own = load_design("fin")
    asked = {"least_stiffness": "N*m/rad", "lost_motion": "deg"}
    more = (Requirement(id=name, quantity=name, unit=unit, minimum=0.1) for name, unit in asked.items())
    design = replace(own, requirements=(*own.requirements, *more))
    task = SampleTask(design, sampler_of(design))
    whole = task((0, 3))
    for requirement in judged(design):
        alone = task.of(requirement)
        found = alone.figures(alone.sampler.draw(0, 3))
        if requirement.loop is None:
            assert [*found] == [*source_columns(requirement, design)]
        assert not any(name.startswith("drive.") for name in found) or len(found) == 1
        both = (judge(requirement, design, columns) for columns in (whole, found))
        assert len({each.distance.tobytes() for each in both}) == 1


@pytest.mark.parametrize(("count", "bins"), [(8, 4), (30, 7), (1000, 20), (64_000, 60)])
def test_few_samples_are_shown_in_few_bins(count, bins, design):
    """Twice the cube root of the count, and at most 60."""
    task = SampleTask(design, sampler_of(design), time_figures=False)
    values = np.random.default_rng(0).normal(10.0, 1.0, count)
    block = dict.fromkeys(task((0, 1)), values)
    sketch = next(iter(reduced(task, {**block, "sample": np.arange(count)}).columns.values()))
    edges, counts = sketch.histogram()
    assert (len(counts), sum(counts)) == (bins, count)
    assert (edges[0], edges[-1]) == pytest.approx((values.min(), values.max()))


@pytest.mark.parametrize("count", [20_000, 100_000])
def test_what_many_samples_come_to_does_not_grow(count, design):
    """At most so many bins a column, in memory and in the file, with all counts right."""
    task = SampleTask(design, sampler_of(design), time_figures=False)
    names, whole = task((0, 1)).keys(), Reduction()
    rng = np.random.default_rng(count)
    for first in range(0, count, 20_000):
        block = {name: rng.normal(10.0, 1.0, 20_000) for name in names}
        whole = whole.merged(reduced(task, {**block, "sample": np.arange(first, first + 20_000)}))
    assert all(len(sketch.keys) <= MOST for sketch in whole.columns.values())
    assert {sketch.finite for sketch in whole.columns.values()} == {whole.count} == {count}
    data = whole.packed([(0, 5)])
    assert len(data) < 16 * MOST * len(whole.columns) + 100_000
    again, done = unpacked(data)
    assert done == [(0, 5)]
    assert (again.count, again.together, again.tallies) == (count, whole.together, whole.tallies)
    assert again.packed(done) == data


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    """The baseline with a friction coefficient that may be 60 % off: some samples need too much current."""
    path = tmp_path_factory.mktemp("wide") / "wide.toml"
    path.write_text(
        write_design(asked_twice(read_design_text(toleranced(friction={"load_coefficient": 60}))))
    )
    return path


def test_a_study_that_fails_says_so_and_can_be_accepted(cli, wide, tmp_path):
    words = ("montecarlo", wide, "--samples", 300, "--out", tmp_path, "--quiet")
    assert "motor current" in cli.text(*words, status=1)
    made = json.loads((tmp_path / "montecarlo.json").read_text())
    verdicts = {v["id"]: v for v in made["sections"][0]["blocks"][0]["items"]}
    assert verdicts["tolerance/motor-current"]["verdict"] == "not met"
    assert verdicts["tolerance/gain-margin/position"]["verdict"] == "met"
    assert cli(*words, "--no-worst", "--at-least", 0.5).status == 0
    assert "<svg" in (tmp_path / "montecarlo.html").read_text()
    (folder,) = tmp_path.glob("samples-*")
    worst = load_design(folder / next(p.name for p in folder.glob("worst-*-motor-current.toml")))
    assert worst.friction.load_coefficient == pytest.approx(1.6 * 1.34e-3)


def test_one_sample_is_printed_as_a_design_and_json_goes_to_standard_output_alone(cli, wide, tmp_path):
    first, again, other = (cli.text("montecarlo", wide, "--sample", 41, "--seed", seed) for seed in (2, 2, 3))
    assert first == again != other
    assert cli.data("montecarlo", wide, "--sample", 41, "--seed", 2) == {"design": first.rstrip("\n")}
    path = tmp_path / "sample.toml"
    path.write_text(first)
    assert 0.4 * 1.34e-3 <= load_design(path).friction.load_coefficient <= 1.6 * 1.34e-3
    made = cli.data("montecarlo", "--samples", 64, "--out", tmp_path, "--no-worst", "--step", "1 deg")
    assert "allowed with --step" in cli.refused("montecarlo", "--duration", "2")
    assert made["verdict"] == "met"
    assert made["columns"]["nonlinear.overshoot"]["unit"] == "%"


@pytest.mark.parametrize(("gone", "step", "si"), [
    ({"position"}, "20 deg/s", math.radians(20.0)), ({"position", "velocity"}, "300 mA", 0.3),
])  # fmt: skip
def test_a_step_is_of_what_the_outermost_loop_follows(cli, gone, step, si, tmp_path):
    text = tomllib.loads(toleranced(motor={"rotor_inertia": 5.0}))
    text["control"] = {key: table for key, table in text["control"].items() if key not in gone}
    path = tmp_path / "drive.toml"
    path.write_text(tomli_w.dumps({key: table for key, table in text.items() if key != "requirement"}))
    words = ("montecarlo", path, "--samples", 3, "--no-worst", "--out", tmp_path)
    made = cli.data(*words, "--step", step)["columns"]["nonlinear.peak_current"]
    rows = step_columns(StepCheck(si), Population(load_design(path), {}, 1))
    assert made["mean"] == pytest.approx(rows["nonlinear.peak_current"][0], rel=0.1)
    assert "wrong dimension" in cli.refused(*words, "--step", "1 deg")


@pytest.mark.parametrize("name", ["ballscrew", "ilr33-amber"])
def test_a_column_of_samples_is_the_figure_that_all_else_calls_by_its_name(name):
    """The ball screw takes the mean of 80 samples: its response to the command is none of the samples'."""
    design = load_design(name)
    columns = loop_columns(linear_figures(Population(design, {}, 1), held=True), design)
    own = small_signal(design, all_loop_figures(assemble_loops(design)))
    shared = {key for key in own if key in columns and own[key] is not None}
    assert {key: columns[key][0] for key in shared} == pytest.approx({key: own[key] for key in shared})
    assert ("position.bandwidth" in shared) == (name != "ballscrew")


COMMANDS = {
    "montecarlo": ("montecarlo", "--samples", "200", "--no-worst"),
    "compare": ("compare", "ilr33-amber", "--set", "gear.worm.ratio=40", "--set", "friction.law=tanh"),
    "tune": ("tune", "--require", "position.bandwidth>=40 Hz"),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_pages_of_studies_stand_alone_and_show_every_figure(cli, browser, name, tmp_path):
    ran = cli(*COMMANDS[name], "--out", tmp_path, "--quiet")
    assert ran.status in (0, 1), ran.err
    file = tmp_path / f"{name}.html"
    for size in ({"width": 1360, "height": 900}, {"width": 390, "height": 844}):
        trouble = []
        page = opened(browser, file, trouble, live=False, viewport=size)
        assert trouble == []
        assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        drawn = page.locator("figure svg.plot")
        assert drawn.count() == file.read_text(encoding="utf-8").count('<svg class="plot"') > 0
        for k in range(drawn.count()):
            assert drawn.nth(k).bounding_box()["width"] > 200
            assert drawn.nth(k).locator(".world path, .marks use").count() > 1


def test_drives_that_are_not_stable_do_not_pass_whatever_is_required(tmp_path) -> None:
    """Position gain 400 1/s of 8, 34 dB, where the joint has 25.9; it is stable in every sample."""
    joint = replace(load_design("joint"), requirements=())
    for gain, verdict, words in (("8 1/s", "met", ""), ("400 1/s", "not met", "is not stable in 100 %")):
        design = with_overrides(joint, {"control.position.gain": gain})
        result = monte_carlo(design, tmp_path / gain[:3].strip(), replace(PLAIN, samples=60))
        assert result.verdict == verdict
        assert words in brief(result).words
        missing = [result.columns[f"{loop}.gain_margin"].missing for loop in ("velocity", "position")]
        assert missing == [0, 60 if words else 0]  # it has no margins, as `margins` says of one design


def test_a_drive_whose_stability_rounding_decides_is_not_called_unstable(tmp_path) -> None:
    """Current gain times 60 at 20 ticks a position update: entries of 5e14, withheld as `margins` does."""
    base = replace(load_design("ilr33-amber-multirate"), requirements=())
    base = changed(base, controller={"position": {"every": 20}})
    gain, wanted = base.controller.current.gain_V_A, {"loop": "position", "minimum": 1.0, "unit": "deg"}
    base = replace(base, requirements=(Requirement(id="phase", quantity="phase_margin", **wanted),))
    table = Table(("control.current.gain",), gain * np.array([[1.0], [60.0], [0.7]]), "a file")
    settings = replace(PLAIN, samples=96, table=table)
    result = monte_carlo(base, tmp_path / "all", settings)
    phase = result.odds[0]
    assert (result.unstable, phase.failed) == (0.0, 0)
    assert 0.2 < result.unresolved == phase.unresolved / 96 < 0.5
    assert phase.high == 1.0 > phase.low
    assert result.verdict == result.judged(phase) == "not proven"
    assert "not stable in" not in brief(result).words
    text = json.dumps(section(result))
    assert f"stability is not resolved in double precision in {phase.unresolved} of 96 samples" in text
    # that two thirds are met is shown; that nine in ten are is neither shown nor refuted
    for share, verdict in ((0.5, "met"), (0.9, "not proven")):
        assert replace(result, at_least=share).judged(phase) == verdict
    lost = replace(base, requirements=(replace(base.requirements[0], minimum=89.0),))
    assert monte_carlo(lost, tmp_path / "lost", settings).verdict == "not met"
