"""The colours of every page against WCAG 2.2 AA: text 4.5, lines of figures and the focus ring 3."""

import re

import pytest

from reports.html import script
from reports.scripts import asset

TEXT, GRAPHICS = 4.5, 3.0
PAIRS = [
    *((ink, ground) for ink in ("ink", "muted", "link", "fail", "pass") for ground in ("bg", "paper")),
    ("pass", "pass-bg"), ("fail", "fail-bg"), ("warn", "warn-bg"), ("info", "info-bg"),
    ("ink", "fail-bg"), ("muted", "fail-bg"), ("ink", "info-bg"), ("paper", "c1"),
]  # fmt: skip


def schemes() -> dict[str, dict[str, str]]:
    """The variables of each scheme, as they stand in the style sheet; light where it leaves one out."""
    blocks = re.findall(
        r"(@media \([^)]*dark\) \{\s*|@media print \{\s*)?:root \{(.*?)\}", asset("style.css"), re.S
    )
    light = dict(re.findall(r"--([\w-]+): (#\w+);", blocks[0][1]))
    return {
        "dark" if "dark" in head else "print" if "print" in head else "light": {
            **light, **dict(re.findall(r"--([\w-]+): (#\w+);", body))
        }
        for head, body in blocks
    }  # fmt: skip


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
