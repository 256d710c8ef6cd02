"""A night says the cause first, then what it did to the figure that matters most."""

import re
from pathlib import Path

from nightly_fakes import CODE, INLINE, Calendar, job, study

from reports.nightly import changes
from reports.nightly.changes import Cause, Change, Comparison
from reports.nightly.night import run_night


def change(figure: str, before: float, after: float, **more) -> Change:
    given = {"unit": "deg", "kind": "figure", "worse": after < before, "tolerance": 0.05, **more}
    return Change(figure=figure, before=before, after=after, **given)


PHASE = {"id": "PM/position", "label": "Position loop: phase margin"}
COMPARISON = Comparison(
    changes=(
        change("margins / Margins / Position loop / Gain margin", 20.0, 5.0, unit="dB"),
        change("PM/position: distance", 17.1, 10.3, kind="distance"),
        change("PM/position: value", 62.1, 55.3, kind="requirement", worse=None),
    ),
    cause=Cause(parameters=(("control.position.gain", "90 1/s", "120 1/s"),)),
)


PHRASES = (
    (Cause(parameters=(("a", "1 V", "2 mV"),)), "a 1 V → 2 mV"),
    (Cause(parameters=tuple((f"k{n}", "1", "2") for n in range(4))), "k0 1 → 2; k1 1 → 2; 2 more values"),
    (Cause(commits=(("code", "abc fix"), ("code", "def more"))), "commit abc fix and 1 more"),
    (Cause(libraries=(("numpy", "1", "2"),)), "numpy 1 → 2"),
    (Cause(code=True), "sources of actuator-lti changed without a commit"),
    (Cause(), "no input differs"),
)


def test_the_cause_comes_first_then_the_required_figure_in_words_and_distances_before_others() -> None:
    first = changes.main_changes(COMPARISON)[0]
    assert changes.cause_words(COMPARISON.cause) == "control.position.gain 90 → 120 1/s"
    for cause, said in PHRASES:
        assert changes.cause_words(cause) == said
    words = changes.change_words(first, COMPARISON, [PHASE])
    assert words == "phase margin of the position loop 62.10 → 55.30 deg"
    of_a_table = changes.change_words(COMPARISON.changes[0], COMPARISON, [])  # named by column and row
    assert of_a_table == "gain margin of Position loop 20.00 → 5.000 dB"
    many = Comparison(changes=(*COMPARISON.changes, *(change(f"x{k}", 2.0, 1.0) for k in range(49))))
    assert [c.kind for c in changes.main_changes(many)] == ["distance", *["figure"] * 4]


def test_designs_with_the_same_cause_are_one_line_with_which_index_and_page_open(tmp_path) -> None:
    """Two nights: one gain falls in two designs alike, one rises, one stays."""
    site, clock = tmp_path / "site", Calendar()
    for k in range(2):
        jobs = [job("one", 12.0 - 2 * k), job("two", 12.0 - 2 * k), job("better", 9.0 + k), job("same", 20.0)]
        night = run_night(study(*jobs), site, INLINE, code=CODE, clock=clock.next())
    first, second = changes.headlines(night.designs)
    assert (len(first.designs), first.worse, len(second.designs), second.worse) == (2, True, 1, False)
    assert first.cause == "control.position.gain 12 → 10 1/s"
    assert first.effect == "gain margin 12.00 → 10.00 dB"
    strips = {d.name: [state for _, state in d.strip] for d in night.designs}
    closer, steady = ["pass", "regressed"], ["pass", "pass"]
    assert strips == {"one": closer, "two": closer, "better": steady, "same": steady}
    assert len(night.alone) == sum(night.count(s) for s in ("pass", "fail", "regression", "broken")) == 4
    index = (site / "index.html").read_text(encoding="utf-8")
    assert "control.position.gain 12 → 10 1/s" in index
    assert index.index("What changed since last night") < index.index('id="designs"')
    page = sorted(Path(site).glob("nights/*/one-*.html"))[-1]
    text = re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8"))
    assert "control.position.gain 12 → 10 1/s: gain margin 12.00 → 10.00 dB" in " ".join(text.split())
