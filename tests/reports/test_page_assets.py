"""Style and scripts of a page: contrast, the bundle of its modules, ranges of sliders, the glossary."""

import re
from html import unescape

import pytest

from actuator_lti.design import QUANTITIES, load_design
from reports import document as doc
from reports import scripts
from reports.glossary import TERMS, glossary, meaning
from reports.html import environment, script
from reports.live.keys import SLIDER_FACTOR, UNUSED, ZERO, followed
from reports.scripts import asset

TEXT, GRAPHICS = 4.5, 3.0
PAIRS = [
    *((ink, ground) for ink in ("ink", "muted", "link", "fail", "pass") for ground in ("bg", "paper")),
    ("pass", "pass-bg"), ("fail", "fail-bg"), ("warn", "warn-bg"), ("info", "info-bg"),
    ("ink", "fail-bg"), ("muted", "fail-bg"), ("ink", "info-bg"), ("paper", "c1"),
]  # fmt: skip
AMBER = load_design("ilr33-amber")


def schemes() -> dict[str, dict[str, str]]:
    """The variables of each scheme, as they stand in the style sheet; light where it leaves one out."""
    place = r"(?:@media (?:\([^)]*)?(dark|print)\)? \{\s*)?:root \{(.*?)\}"
    blocks = re.findall(place, asset("style.css"), re.S)
    colours = {name or "light": dict(re.findall(r"--([\w-]+): (#\w+);", body)) for name, body in blocks}
    return {name: colours["light"] | own for name, own in colours.items()}


def luminance(colour: str) -> float:
    digits = colour[1:] if len(colour) == 7 else "".join(2 * letter for letter in colour[1:])
    parts = [int(digits[k : k + 2], 16) / 255.0 for k in (0, 2, 4)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_the_formula_is_that_of_the_standard() -> None:
    assert contrast("#000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)  # the well-known near miss


@pytest.mark.parametrize("scheme", ["light", "dark", "print"])
def test_text_and_figures_stand_out(scheme: str) -> None:
    known = schemes()[scheme]
    for ink, ground in PAIRS:
        if ground == "c1" and scheme == "print":
            continue  # the pressed button is not printed
        assert contrast(known[ink], known[ground]) >= TEXT, (ink, ground)
    for k in range(1, 8):
        assert contrast(known[f"c{k}"], known["paper"]) >= GRAPHICS, k


def test_nothing_moves_for_a_reader_who_wants_no_motion() -> None:
    assert "prefers-reduced-motion: reduce" in asset("style.css")
    assert "smooth" not in script(live=True)


def test_modules_in_a_circle_are_refused(monkeypatch) -> None:
    texts = {"page/a.js": 'import { b } from "./b.js";\nexport const a = 1;\n',
             "page/b.js": 'import { a } from "./a.js";\nexport const b = 2;\n'}  # fmt: skip
    monkeypatch.setattr(scripts, "asset", texts.__getitem__)
    with pytest.raises(ValueError, match="a -> b -> a"):
        scripts.bundled.__wrapped__("a")


def test_a_slider_holds_its_value_whole_numbers_stay_so_and_below_zero_it_has_both_signs() -> None:
    for one in followed(AMBER).free:
        assert one["low"] <= one["value"] <= one["high"]
        if one["whole"]:
            assert one["low"] >= 1.0
            assert one["high"] > one["low"]
    for value in (-1e-3, 1e-3):
        design = AMBER.with_values({"friction.offset_torque": value})
        one = next(s for s in followed(design).free if s["path"] == "friction.offset_torque")
        low = SLIDER_FACTOR * value if value < 0.0 else value / SLIDER_FACTOR
        assert (one["low"], one["high"]) == pytest.approx((low, SLIDER_FACTOR * abs(value)))


def test_every_figure_and_term_has_one_line() -> None:
    terms = glossary()
    assert {quantity.title or quantity.words for quantity in QUANTITIES.values()} | set(TERMS) == set(terms)
    assert list(terms) == sorted(terms, key=str.lower)
    assert all(line and "\n" not in line for line in terms.values())


def test_a_heading_of_a_table_says_its_line() -> None:
    headings = ("Disk margin", "Gain margin", "No term")
    block = doc.table("Words", [doc.column(f"c{k}", words) for k, words in enumerate(headings)], [])
    template = environment().from_string('{% import "blocks.html" as b with context %}{{ b.table(block) }}')
    page = template.render(block=block, unique=lambda letter: letter)
    found = {
        name: unescape(line)
        for line, name in re.findall(r'<th scope="col"[^>]*?(?: title="([^"]*)")?>([^<]*)<', page)
    }
    assert found == {name: meaning(name) for name in headings}
    assert found["Disk margin"] == TERMS["Disk margin"]
    assert found["Gain margin"] == QUANTITIES["gain_margin"].description
    assert found["No term"] == ""


def test_a_key_that_is_zero_has_that_for_its_reason() -> None:
    why = {one["path"]: one["why"] for one in followed(load_design("joint")).fixed}
    assert why["command.filter_time"] == why["motor.cogging"] == ZERO
    assert why["load.moment_max"] == UNUSED
