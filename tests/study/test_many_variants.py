"""A comparison of more designs than a page can show: the ends on the page, the verdict and a table of all."""

import csv
import io
import math
import random
from dataclasses import replace

import pytest

from actuator_lti import load_design
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import with_overrides, write_design
from actuator_lti.design.model import Requirement
from analyses.comparison.variants import Comparison, compare
from analyses.slugs import slug
from analyses.specification.requirements import RequirementVerdict
from analyses.specification.sensitivity import moved as moved_designs
from analyses.specification.sensitivity import population_figures
from analyses.studies.study import Variant, study_of
from reports import document as doc
from reports.charts.data import chart_of
from reports.sections.compare import brief
from reports.sections.compare import section as sections
from reports.sections.compare_best import MANY, choice, nearness, table_text
from reports.sections.compare_figures import tornadoes
from reports.terminal import print_blocks
from reports.verdict_summary import verdict_of

COUNT = 3_000
FAILING = "variant 1717"


def moved(verdict: RequirementVerdict, distance: float) -> RequirementVerdict:
    of = verdict.requirement
    value = of.maximum - distance if of.minimum is None else of.minimum + distance
    return replace(verdict, value=value, distance=distance)


@pytest.fixture(scope="module")
def many() -> Comparison:
    """Thousands of designs with the figures of one, scaled at random; one of them fails a requirement."""
    draw, variants, one = random.Random(18), [], compare(study_of(load_design("ilr33-amber")))
    for k in range(COUNT):
        name, factor, own = f"variant {k}", draw.uniform(0.9, 1.1), one.base.figures
        figures = {key: None if v is None else v * draw.uniform(0.5, 2.0) for key, v in own.items()}
        verdicts = [v if v.distance is None else moved(v, v.distance * factor) for v in one.base.verdicts]
        if name == FAILING:
            verdicts[3] = replace(moved(verdicts[3], -1e-9), verdict=Verdict.NOT_MET)
        variant = Variant(name, slug(name), one.base.variant.design, {})
        variants.append(replace(one.base, variant=variant, figures=figures, verdicts=tuple(verdicts)))
    return replace(one, variants=tuple(variants))


def test_few_are_all_shown_and_of_many_best_and_worst_of_everything_with_their_marks(many) -> None:
    few = replace(many, variants=many.variants[:MANY])
    assert choice(few) is few
    assert few.everything is few
    shown = choice(many)
    assert 2 * len(many.base.verdicts) <= len(shown.variants) <= MANY
    assert shown.everything is many
    names = {one.variant.name for one in shown.variants}
    assert FAILING in names
    for wanted in many.base.verdicts:
        pairs = [(one.variant.name, v) for one in many.variants for v in one.verdicts if v.id == wanted.id]
        distances = {name: v.distance for name, v in pairs if v.distance is not None}
        if distances:
            assert {min(distances, key=distances.get), max(distances, key=distances.get)} <= names
    order = [one.variant.name for one in many.variants if one.variant.name in names]
    assert order == [one.variant.name for one in shown.variants]
    for name in many.names:
        assert shown.ends(name) == many.ends(name)
    values = [one.figures["position.gain_margin"] for one in many.all]
    (name,) = (name for name in many.names if name.key == "position.gain_margin")
    assert many.ends(name) == (max(values), min(values))


def test_one_failing_design_of_thousands_fails_the_verdict_and_is_named(many) -> None:
    made = {part["id"]: part for part in sections(many)}
    assert not verdict_of(list(made.values()), "compare")["passed"]
    total = (COUNT + 1) * len(many.base.verdicts)
    counted = f"{total - 1} of {total} requirements met, 1 not met, over {COUNT + 1} designs"
    assert made["verdicts"]["result"].startswith(f"{counted}. Not met: {FAILING}, ")
    items = made["verdicts"]["blocks"][0]["items"]
    assert len(items) == len(many.base.verdicts)
    (worst,) = (one for one in items if one["verdict"] == "not met")
    assert worst["label"].endswith(f"met by {COUNT} of {COUNT + 1} designs; the worst is {FAILING}")
    assert made["best"]["result"].startswith(f"{COUNT} of {COUNT + 1} designs meet every requirement;")
    shown = len(choice(many).all)
    assert f"{shown} of {COUNT + 1} designs" in made["best"]["intro"]
    assert made["best"]["status"] == "fail"
    assert brief(many).notes == [f"{COUNT + 1 - shown} more designs are in compare.csv"]
    document = doc.document(title="t", subtitle="", design={}, provenance={}, sections=list(made.values()))
    assert len(doc.dumps(document)) < 2_000_000


def test_the_table_has_every_figure_of_every_design(many) -> None:
    rows = list(csv.DictReader(io.StringIO(table_text(many))))
    assert [row["design"] for row in rows] == [one.variant.name for one in many.all]
    for row, one in zip(rows, many.all, strict=True):
        for name in many.names:
            value = one.figures[name.key]
            assert row[f"{name.key} [{name.unit}]"] == ("" if value is None else repr(float(value)))
    failing = next(row for row in rows if row["design"] == FAILING)
    assert (failing["not_met"], failing["not_proven"]) == ("1", "0")
    assert float(failing["room_percent"]) < 0.0


@pytest.mark.parametrize(("value", "share"), [(99.0, 0.01), (10.5, 0.05)])
def test_what_is_left_is_a_share_of_the_nearer_of_two_limits(value: float, share: float) -> None:
    """Of 10 to 100 Hz: 1 Hz of 100, 0.5 Hz of 10."""
    limits = {"unit": "Hz", "minimum": 10.0, "maximum": 100.0}
    of = Requirement(id="b", quantity="bandwidth", loop="position", **limits)
    about = {"value": value, "distance": of.distance(value), "verdict": Verdict.MET}
    one = RequirementVerdict(id="b", requirement=of, loop="position", **about)
    assert nearness(one) == pytest.approx(share)


def test_a_tornado_shows_the_nearer_of_two_limits() -> None:
    """The bandwidth is 27.3 Hz; a limit far off is not drawn."""
    limits = {"unit": "Hz", "minimum": 1.0, "maximum": 30.0}
    of = Requirement(id="b", quantity="bandwidth", loop="position", **limits)
    found = compare(study_of(replace(load_design("ilr33-amber"), requirements=(of,))))
    (drawn,) = doc.figures({"sections": [tornadoes(found)]})
    (panel,) = chart_of(drawn["chart"]).columns[0].panels
    assert [one.at for one in panel.items if getattr(one, "words", "") == "limit"] == [30.0]


UNSTABLE = """
[study]
base = "joint"
[[variant]]
name = "Torn 400"
override = { "control.position.gain" = "400 1/s" }
"""


def test_an_unstable_variant_has_no_margins_is_named_so_and_is_the_worst(tmp_path) -> None:
    """The position loop is proportional to its gain: 400 of 8 1/s is 34 dB, and the joint has 25.9."""
    path, joint = tmp_path / "s.toml", load_design("joint")
    path.write_text(UNSTABLE)
    found, gain = compare(path, validation=False), "control.position.gain"
    (torn,), base, raised = found.variants, found.base, 20.0 * math.log10(400.0 / 8.0)
    figures = population_figures(moved_designs(joint, {gain: 8.0}, [{gain: 400.0}]), joint)
    least = base.figures["position.gain_margin"]
    assert figures["position.gain_margin"] == pytest.approx([least, least - raised], abs=1e-6)
    assert least < raised
    assert torn.unstable == ("position",)
    lost = {key for key, value in torn.figures.items() if value is None and base.figures[key] is not None}
    assert {"position.gain_margin", "position.modulus_margin", "drive.least_stiffness@0"} <= lost
    assert {nearness(v) for v in torn.verdicts if v.loop == "position"} == {-math.inf}
    each, best = sections(found)[0]["blocks"]
    assert each["rows"][1]["weakest"] == "not stable: Position loop"
    assert "Position loop: gain margin lost" in each["rows"][1]["gives"]
    assert [row["worst"] for row in best["rows"]].count("Torn 400: not stable") == 3
    assert " Not stable: Torn 400, Position loop." in brief(found).words
    row = list(csv.DictReader(io.StringIO(table_text(found))))[1]
    assert (row["unstable"], row["room_percent"], row["position.phase_margin [deg]"]) == ("position", "", "")


def test_a_design_that_requires_nothing_is_met_as_by_margins_where_it_is_stable(tmp_path) -> None:
    bare, path = replace(load_design("ilr33-amber"), requirements=()), tmp_path / "s.toml"
    (tmp_path / "bare.toml").write_text(write_design(bare))
    for gain, verdict in (("6000", "not met"), ("61", "met")):
        path.write_text(UNSTABLE.replace('"joint"', '"bare.toml"').replace("400 1/s", f"{gain} 1/s"))
        assert compare(path, validation=False).verdict == verdict


@pytest.fixture(scope="module")
def of_amber() -> tuple[list[str], Comparison]:
    """A drive and six changes of one key, by their names."""
    base = load_design("ilr33-amber")
    keys = [("control.position.gain", f"{k} 1/s") for k in (57, 59, 61, 62, 63)] + [
        ("limits.voltage", "11.9 V")
    ]
    changed = [(f"{key}={value}", with_overrides(base, {key: value})) for key, value in keys]
    variants = tuple(Variant(name, slug(name), design, {}) for name, design in changed)
    found = compare(replace(study_of(base), variants=variants), validation=False)
    return [name for name, _ in changed], found


@pytest.mark.parametrize("columns", [60, 140])
def test_the_terminal_shows_every_design_by_its_own_name(columns, of_amber, capsys, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    names, found = of_amber
    print_blocks(brief(found).blocks)
    out = capsys.readouterr().out
    loops = " ".join(out.partition("Loops")[2].split())
    assert "Loops, continued" in loops
    assert all("ilr33-amber" in part for part in loops.split("Loops, continued"))  # the base, in each of them
    assert [name for name in names if name.rpartition("=")[2].split()[0] not in loops] == []
    assert "11.9 v" not in loops
