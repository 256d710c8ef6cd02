"""Commands of studies: JSON alone, exit statuses, pages that stand alone."""

import json
import tomllib

import pytest
import tomli_w
from typer.testing import CliRunner

from actuator_lti import load_design, write_design
from reports.cli.app import build


@pytest.fixture(scope="module")
def app():
    return build()


@pytest.fixture(scope="module")
def wide(tmp_path_factory):
    """The baseline with a friction coefficient that may be 60 % off: some samples need too much current."""
    tree = tomllib.loads(write_design(load_design("ilr33-amber")))
    tree["friction"]["load_coefficient"]["tolerance"] = "60 %"
    path = tmp_path_factory.mktemp("wide") / "wide.toml"
    path.write_text(tomli_w.dumps(tree))
    return path


def run(app, *words):
    return CliRunner().invoke(app, [str(word) for word in words])


def test_a_study_that_fails_says_so_and_can_be_accepted(app, wide, tmp_path):
    done = run(app, "montecarlo", wide, "--samples", 300, "--out", tmp_path, "--quiet")
    assert done.exit_code == 1
    assert "motor current" in done.output
    made = json.loads((tmp_path / "montecarlo.json").read_text())
    verdicts = {v["id"]: v for v in made["sections"][0]["blocks"][0]["items"]}
    assert verdicts["tolerance/motor-current"]["verdict"] == "not met"
    assert verdicts["tolerance/gain-margin"]["verdict"] == "met"
    again = run(app, "montecarlo", wide, "--samples", 300, "--out", tmp_path, "--quiet", "--at-least", 0.5)
    assert again.exit_code == 0
    assert "<svg" in (tmp_path / "montecarlo.html").read_text()
    (folder,) = tmp_path.glob("samples-*")
    worst = load_design(folder / next(p.name for p in folder.glob("worst-*-motor-current.toml")))
    assert worst.friction.load_coefficient == pytest.approx(1.6 * 1.34e-3)


def test_one_sample_is_printed_as_a_design(app, wide, tmp_path):
    first = run(app, "montecarlo", wide, "--sample", 41, "--seed", 2)
    assert first.exit_code == 0
    path = tmp_path / "sample.toml"
    path.write_text(first.output)
    assert 0.4 * 1.34e-3 <= load_design(path).friction.load_coefficient <= 1.6 * 1.34e-3
    assert run(app, "montecarlo", wide, "--sample", 41, "--seed", 2).output == first.output
    assert run(app, "montecarlo", wide, "--sample", 41, "--seed", 3).output != first.output


def test_json_goes_to_standard_output_alone(app, tmp_path):
    done = run(
        app, "montecarlo", "--samples", 64, "--out", tmp_path, "--json", "--no-worst", "--step", "1 deg"
    )
    made = json.loads(done.output)
    assert made["verdict"] == "met"
    assert made["columns"]["nonlinear.overshoot"]["unit"] == "%"


@pytest.mark.parametrize("words", [
    ("--samples", "0"), ("--seed", "-1"), ("--step", "5 kg"), ("--workers", "2", "--scheduler", "tcp://a:1"),
])  # fmt: skip
def test_bad_usage_is_refused_before_anything_is_written(words, tmp_path):
    from reports.cli.main import main

    out = tmp_path / "o"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["actuator-lti", "montecarlo", "--out", str(out), *words])
        assert main() == 2
    assert not list(tmp_path.rglob("*.html"))


COMMANDS = {
    "montecarlo": ("montecarlo", "--samples", "200", "--no-worst"),
    "compare": ("compare", "ilr33-amber", "--set", "gear.worm.ratio=40", "--set", "friction.law=tanh"),
    "tune": ("tune", "--require", "position.bandwidth>=40 Hz"),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_pages_of_studies_stand_alone_and_show_every_figure(browser, name, tmp_path):
    from reports.cli.app import build

    done = CliRunner().invoke(build(), [*COMMANDS[name], "--out", str(tmp_path), "--quiet"])
    assert done.exit_code in (0, 1), done.output
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
            box = drawn.nth(k).bounding_box()
            assert box["width"] > 200
            assert drawn.nth(k).locator(".world path, .marks use").count() > 1
