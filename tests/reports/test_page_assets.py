"""Style and scripts of a page: contrast, bundle, ranges of sliders, glossary; the text that it saves."""

import difflib
import re
from html import unescape

import pytest

from actuator_lti.design import QUANTITIES, load_design, parameter_value, read_design_text
from actuator_lti.design.loader import design_text, shipped_designs
from actuator_lti.files.reading import Tree
from reports import document as doc
from reports import scripts
from reports.glossary import TERMS, glossary, meaning
from reports.html import environment, script
from reports.live.keys import SLIDER_FACTOR, UNUSED, ZERO, followed
from reports.live.text import patches
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
    for ink, ground in PAIRS:  # the pressed button is not printed
        printed = ground == "c1" and scheme == "print"
        assert printed or contrast(known[ink], known[ground]) >= TEXT, (ink, ground)
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
        assert not one["whole"] or 1.0 <= one["low"] < one["high"]
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
    said = re.findall(r'<th scope="col"[^>]*?(?: title="([^"]*)")?>([^<]*)<', page)
    lines = TERMS["Disk margin"], QUANTITIES["gain_margin"].description, ""
    assert [(unescape(line), name) for line, name in said] == list(zip(lines, headings, strict=True))
    assert tuple(map(meaning, headings)) == lines


def test_a_key_that_is_zero_has_that_for_its_reason() -> None:
    why = {one["path"]: one["why"] for one in followed(load_design("joint")).fixed}
    wanted = {"command.filter_time": ZERO, "motor.cogging": ZERO, "load.moment_max": UNUSED}
    assert why.items() >= wanted.items()


OTHER = """# a drive of mine
motor.resistance = "1 ohm"  # measured cold
motor.inductance={value='1 mH',grade="A",source='meter "B"',tolerance="5 %"} # one line
[motor.torque_constant]
# as a table of its own
source = "bench"
value = "0.05 N*m/A"
[motor.back_emf_constant]
value = "0.05 V*s/rad"
[motor.rotor_inertia]
value = "10 g*cm^2"

[design]
name = "mine"
title = "Mine"
[control]
period = "100 us" # fast
computing_delay = "50 us"
[control.velocity]
gain = "0.1 V*s/rad"
integral_time = "20 ms"
[limits]
voltage = "24 V"
"""


def as_page(key: Tree, factor: float) -> str:
    value = key["value"] / key["factor"] * factor
    if key["unit"]:
        return f'"{value!r} {key["unit"]}"'
    return str(int(key["value"])) if key["whole"] else repr(value)


def changed(text: str, keys: list[Tree], places: list[tuple[int, int, str, str]], factor: float) -> str:
    made, last = "", 0
    pairs = sorted(zip(places, keys, strict=True), key=lambda pair: pair[0][:2])
    for (begin, end, before, after), key in pairs:
        made += text[last:begin] + before + as_page(key, factor) + after
        last = end
    return made + text[last:]


LINES = design_text("joint").replace(
    '"8 1/s", source = "tuned here"', '"8 1/s", source = """tuned\n[here]"""'
)
OWN = {"mine": OTHER, "lines": LINES}


@pytest.mark.parametrize("name", [*shipped_designs(), *OWN])
def test_only_the_entry_of_a_changed_key_is_written_anew(name: str) -> None:
    source = OWN.get(name) or design_text(name)
    design = read_design_text(source, name)
    keys = followed(design).free
    text, places = patches(design, keys, source)
    assert text == source
    for key, place in zip(keys, places, strict=True):
        made = changed(text, [key], [place], 1.001)
        other = read_design_text(made)  # of one at a time: a screw's lead turns the others into SI
        wanted = key["value"] if key["whole"] else 1.001 * key["value"]
        assert parameter_value(other, key["path"]) == pytest.approx(wanted, rel=1e-12)
        lines = difflib.unified_diff(text.splitlines(), made.splitlines(), lineterm="", n=0)
        lost = [line for line in lines if line.startswith("-")][1:]
        head = re.search(rf"(?m)^\[{re.escape(key['path'].rpartition('.')[0])}\].*\n", text)
        # a new one stands away from what is said of the next table
        assert place[0] < place[1] or head is None or place[0] == head.end()
        assert len(lost) <= 4  # value, source and grade of its table
        assert [line for line in lost if "#" in line] == [] or len(lost) == 1
        assert len(re.findall(r"#[^\n]*", made)) == len(re.findall(r"#[^\n]*", text))
    other = read_design_text(changed(text, keys, places, 1.0))  # all at once
    for key in keys:
        assert parameter_value(other, key["path"]) == pytest.approx(key["value"], rel=1e-12)


def test_another_text_is_written_anew() -> None:
    """A text that is not of this design (changed by --set, say) is no place for its values."""
    design = load_design("fin")
    text, _ = patches(design, followed(design).free, design_text("joint"))
    assert text != design_text("joint")
    assert read_design_text(text).motor == design.motor
