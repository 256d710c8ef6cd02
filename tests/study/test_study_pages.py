"""The pages of studies in a real browser: no error, no request, every figure seen, on desktop and phone."""

import pytest
from typer.testing import CliRunner

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
