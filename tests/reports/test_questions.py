"""Ten questions of a new user on every shipped drive: answered within two clicks, in words and figures."""

import re

import pytest

from actuator_lti.design import load_design, shipped_designs

HANDS, SIZE = '.toc a[href="#hands-on"]', ".run-keys label:has-text('Size') input"
EACH, LOOPS = "#answer details.fold > summary", "table.loops"
# question: what is clicked (and typed), where the answer stands, and what it looks like
QUESTIONS = {
    "Is it good?": ([], ".masthead .overall", r"\d+ of \d+ requirements met"),
    "Which loop is worst?": ([], ".weakest strong", r"(Current|Velocity|Position) loop"),
    "By how much?": ([], ".weakest", r"not stable|margin [−-]?[\d.]+.*(above|below)"),
    "Who checked that?": ([], ".said a", r"checked|checks"),
    "Is it linear?": ([], '.said a[href="#limits"]', r"linear (up to [\d.]+ Hz; above, the .+ acts|over)"),
    "What is nearest?": ([], ".bar-row >> nth=0", r"[\d.]+\n?\s*[≥≤] [\d.]+"),
    "How fast is it?": ([EACH], LOOPS, r"bandwidth[\s\S]+[\d.]+ "),
    "How much delay can I add?": ([HANDS], "#hands-on .now", r"Delay margin ms[\s\S]+loop\t[\s\S]+\d"),
    "What happens at 20?": ([HANDS, SIZE], ".acting", r"^(No limit acts|Limits that act).+changed"),
    "What is assumed?": (['.toc a[href="#parameters"]'], "#parameters", r"\d+ of them assumed"),
    "Where is phase lost?": (['.toc a[href="#delays"]'], "#delays", r"delay[\s\S]+deg"),
}  # fmt: skip


@pytest.mark.parametrize("name", shipped_designs())
def test_ten_questions_are_answered_within_two_clicks(opens, name: str) -> None:
    page = opens(load_design(name))
    page.set_viewport_size({"width": 1400, "height": 900})
    for question, (clicks, place, pattern) in QUESTIONS.items():
        assert len(clicks) <= 2
        page.goto(page.url.split("#")[0] + "#content")
        for each in clicks:
            page.click(each)
        if SIZE in clicks:
            page.fill(SIZE, "20")
            page.press(SIZE, "Enter")
            page.done()
        answer = page.locator(place).first
        assert answer.is_visible(), question
        assert re.search(pattern, answer.inner_text()), (question, answer.inner_text())
        if not clicks:  # seen without scrolling
            box = answer.bounding_box()
            assert box["y"] + box["height"] <= 900, question
