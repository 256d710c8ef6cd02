"""The design that the page saves is the user's own text with only the changed entries written anew."""

import difflib
import re

import pytest

from actuator_lti.design import parameter_value, read_design_text
from actuator_lti.design.loader import design_text, load_design, shipped_designs
from actuator_lti.files.tree import Tree
from reports.live.keys import followed
from reports.live.text import patches

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


@pytest.mark.parametrize("name", [*shipped_designs(), "mine"])
def test_only_the_entry_of_a_changed_key_is_written_anew(name: str) -> None:
    source = OTHER if name == "mine" else design_text(name)
    design = read_design_text(source, name)
    keys = followed(design).free
    text, places = patches(design, keys, source)
    assert text == source
    for key, place in zip(keys, places, strict=True):
        made = changed(text, [key], [place], 1.001)
        other = read_design_text(made)
        wanted = key["value"] if key["whole"] else 1.001 * key["value"]
        assert parameter_value(other, key["path"]) == pytest.approx(wanted, rel=1e-12)
        lines = list(difflib.unified_diff(text.splitlines(), made.splitlines(), lineterm="", n=0))[2:]
        lost = [line for line in lines if line.startswith("-")]
        assert len(lost) <= 4  # value, source and grade of its table
        assert [line for line in lost if "#" in line] == [] or len(lost) == 1
        comments = [re.findall(r"#[^\n]*", each) for each in (text, made)]
        assert len(comments[0]) == len(comments[1])
    other = read_design_text(changed(text, keys, places, 1.0))  # all at once
    for key in keys:
        assert parameter_value(other, key["path"]) == pytest.approx(key["value"], rel=1e-12)


def test_another_text_is_written_anew() -> None:
    """A text that is not of this design (changed by --set, say) is no place for its values."""
    design = load_design("fin")
    text, _ = patches(design, followed(design).free, design_text("joint"))
    assert text != design_text("joint")
    assert read_design_text(text).motor == design.motor
