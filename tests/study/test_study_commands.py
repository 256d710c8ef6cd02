"""Commands of studies: JSON alone, exit statuses, pages that stand alone."""

import json

import pytest
from toleranced import toleranced

from actuator_lti import load_design


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    """The baseline with a friction coefficient that may be 60 % off: some samples need too much current."""
    path = tmp_path_factory.mktemp("wide") / "wide.toml"
    path.write_text(toleranced(friction={"load_coefficient": 60}))
    return path


def test_a_study_that_fails_says_so_and_can_be_accepted(cli, wide, tmp_path):
    words = ("montecarlo", wide, "--samples", 300, "--out", tmp_path, "--quiet")
    assert "motor current" in cli.text(*words, status=1)
    made = json.loads((tmp_path / "montecarlo.json").read_text())
    verdicts = {v["id"]: v for v in made["sections"][0]["blocks"][0]["items"]}
    assert verdicts["tolerance/motor-current"]["verdict"] == "not met"
    assert verdicts["tolerance/gain-margin/position"]["verdict"] == "met"
    assert cli(*words, "--at-least", 0.5).status == 0
    assert "<svg" in (tmp_path / "montecarlo.html").read_text()
    (folder,) = tmp_path.glob("samples-*")
    worst = load_design(folder / next(p.name for p in folder.glob("worst-*-motor-current.toml")))
    assert worst.friction.load_coefficient == pytest.approx(1.6 * 1.34e-3)


def test_one_sample_is_printed_as_a_design_and_json_goes_to_standard_output_alone(cli, wide, tmp_path):
    first, again, other = (cli.text("montecarlo", wide, "--sample", 41, "--seed", seed) for seed in (2, 2, 3))
    assert first == again != other
    path = tmp_path / "sample.toml"
    path.write_text(first)
    assert 0.4 * 1.34e-3 <= load_design(path).friction.load_coefficient <= 1.6 * 1.34e-3
    made = cli.data("montecarlo", "--samples", 64, "--out", tmp_path, "--no-worst", "--step", "1 deg")
    assert made["verdict"] == "met"
    assert made["columns"]["nonlinear.overshoot"]["unit"] == "%"


@pytest.mark.parametrize("words", [
    ("--samples", "0"), ("--seed", "-1"), ("--step", "5 kg"), ("--workers", "2", "--scheduler", "tcp://a:1"),
])  # fmt: skip
def test_bad_usage_is_refused_before_anything_is_written(cli, words, tmp_path):
    assert cli("montecarlo", "--out", tmp_path / "o", *words).status == 2
    assert not list(tmp_path.rglob("*.html"))


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
        page = browser.new_context(offline=True, viewport=size).new_page()
        trouble = []
        page.on("console", lambda message, seen=trouble: seen.append(message.text))
        page.on("pageerror", lambda error, seen=trouble: seen.append(str(error)))
        page.on("request", lambda request, seen=trouble: seen.append(request.url))
        page.goto(file.as_uri())
        assert trouble == [file.as_uri()]
        assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
        drawn = page.locator("figure svg.plot")
        assert drawn.count() == file.read_text(encoding="utf-8").count('<svg class="plot"') > 0
        for k in range(drawn.count()):
            assert drawn.nth(k).bounding_box()["width"] > 200
            assert drawn.nth(k).locator(".world path, .marks use").count() > 1
