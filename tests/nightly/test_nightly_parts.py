"""The parts of the nightly: texts, cache, tolerances, figures of a report, lock, the headline."""

import re
import subprocess

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from nightly_builds import fake_document
from nightly_fakes import CODE, INLINE, Calendar, job, study

from actuator_lti.asked.quantities import LOOP_QUANTITIES, QUANTITIES
from actuator_lti.errors import InputError
from analyses.slugs import hashed, slug
from analyses.validation.row import judged
from reports import document as doc
from reports.nightly import changes
from reports.nightly.cache import Cache, CorruptEntry, sealed
from reports.nightly.changes import Cause, Change, Comparison
from reports.nightly.figures import Figure, digest, figures_of
from reports.nightly.moves import Tolerances, read_tolerances
from reports.nightly.night import run_night
from reports.nightly.source import code_version, commits_between
from reports.nightly.state import hold
from reports.nightly.text import csv_cell, one_line
from reports.sections.margins import MARGIN_COLUMNS, RESPONSE_COLUMNS
from reports.sections.validation import table
from tests.refusals import refused


@given(st.text())
@example("../../etc")
@example("a" * 500)
def test_a_name_is_one_plain_file_name_of_its_own(name: str) -> None:
    names = ["a/b", "a-b", "A-B", "a b", "../a-b", "a-b ", "а-b", "A", "a", "a_b", "a.b"]
    for of, longest in ((hashed, 51), (slug, 67)):
        assert set(of(name)) <= set("abcdefghijklmnopqrstuvwxyz0123456789-")
        assert 0 < len(of(name)) <= longest
        assert len({of(n) for n in names}) == len(names)


@given(st.text())
def test_one_line_has_nothing_that_breaks_or_turns_it(text: str) -> None:
    line = one_line(text, 50)
    assert len(line) <= 50
    assert line.isprintable() or all(c.isprintable() or c in "\ufffd" or ord(c) > 0x7F for c in line)
    assert not set(line) & set("\n\r\t\x00\u202e\u2066\u200f")


@pytest.mark.parametrize("text", ["=1+1", "+cmd|x", "-2+3", "@SUM(A1)", "\t=1", " =1", "|calc"])
def test_no_csv_cell_is_a_formula_and_numbers_and_words_stay(text: str) -> None:
    assert csv_cell(text).startswith("'")
    assert [csv_cell(word) for word in ("-3.5", "+1e-9", "12", "gain")] == ["-3.5", "+1e-9", "12", "gain"]


def test_the_cache_gives_back_what_it_was_given(tmp_path) -> None:
    cache = Cache(tmp_path)
    cache.take("ab12", sealed("ab12", {"failed": 0}, {"report.html": b"x" * 1000}))
    entry = cache.read("ab12")
    assert (entry.meta["failed"], entry.file("report.html")) == (0, b"x" * 1000)
    assert cache.read("cd34") is None


@pytest.mark.parametrize("damage", [
    *(lambda data, k=k: data[:k] + bytes([data[k] ^ 1]) + data[k:][1:] for k in (0, 10, 60, 120, -1)),
    *(lambda data, size=size: data[:size] for size in (0, 1, 50, 200, -1)),
    lambda _: sealed("ab34", {}, {"report.html": b"x"}),
])  # fmt: skip
def test_an_entry_that_is_damaged_or_another_s_is_neither_read_nor_kept(tmp_path, damage) -> None:
    cache = Cache(tmp_path)
    data = sealed("ab12", {}, {"report.html": b"x"})
    cache.take("ab12", data)
    cache.path("ab12").write_bytes(damage(data))
    with pytest.raises(CorruptEntry):
        cache.read("ab12")
    with pytest.raises(CorruptEntry):
        Cache(tmp_path / "other").take("ab12", damage(data))
    assert not (tmp_path / "other").exists()


def test_digest_knows_verdicts_and_every_number_of_a_table_by_a_name_that_stays() -> None:
    made = digest(fake_document({"name": "a", "margin": 5.0}))
    assert made["failed"] == 1
    assert made["verdicts"][0]["relative"] == pytest.approx(-1 / 6)
    values = {f["name"]: (f["value"], f["unit"], f["better"]) for f in made["figures"]}
    assert values["GM: distance"] == (-1.0, "dB", 1)
    assert values["GM: met"][0] == 0.0
    assert values["margins / Margins / velocity / phase margin"] == (46.0, "deg", 1)
    assert values["margins / Margins / position / crossover"] == (300.0, "rad/s", 0)
    first, second = ([f.name for f in figures_of(fake_document({"name": "a", "margin": m}))] for m in (5, 9))
    assert first == second
    assert len(set(first)) == len(first)


@pytest.mark.parametrize("night", [(9.9, 10.1), (0.02, 0.03), (30.0, 2.0)])
def test_a_time_is_compared_in_seconds_whatever_unit_it_is_shown_in(night: tuple[float, float]) -> None:
    """From 10 s on a row says s, below it ms."""
    found = []
    for value in night:
        row = judged("settling_time", "position", value, value, 1e-3, unit="s")
        block = table([row], "Position loop")
        (shown,) = block["rows"]
        assert shown["predicted"] * {"s": 1.0, "ms": 1e-3}[shown["unit"]] == pytest.approx(value, rel=1e-12)
        made = figures_of({"sections": [{"id": "validation", "blocks": [block]}]})
        found += [(f.value, f.unit) for f in made if f.name.endswith("/ Predicted")]
    assert found == [(pytest.approx(value, rel=1e-12), "s") for value in night]


def test_a_column_without_a_name_of_its_own_is_named_by_the_one_before_it() -> None:
    columns = [doc.column("loop", "Loop"), *MARGIN_COLUMNS[3:9]]  # gain margin to samples
    block = doc.table("Margins", columns, [("velocity", 23.1, 997.0, 73.7, 88.5, 2.31, 23.1)])
    made = figures_of({"sections": [{"id": "margins", "blocks": [block]}]})
    names = [f"{of} margin{more}" for of in ("Gain", "Phase") for more in ("", " at")]
    names += ["Delay margin", "Delay margin in samples"]
    assert [one.name for one in made] == [f"margins / Margins / velocity / {name}" for name in names]


def test_the_second_nightly_says_who_holds_the_lock_and_gets_it_once_it_is_free(tmp_path) -> None:
    told = pytest.raises(InputError, match=r"process \d+ on .+ since 20\d\d-.*--wait")
    with hold(tmp_path), told, hold(tmp_path):  # by another handle, as another process has
        pass
    with hold(tmp_path, wait_s=5.0):
        assert (tmp_path / "holder.json").exists()
    assert not (tmp_path / "holder.json").exists()


def test_the_code_version_follows_the_sources(tmp_path) -> None:
    source, hashes = tmp_path / "actuator_lti" / "a.py", []
    source.parent.mkdir()
    for words in ("x = 1", "x = 1", "x = 2"):
        source.write_text(words)
        hashes.append(code_version(tmp_path).hash)
    assert hashes[0] == hashes[1] != hashes[2]


def test_no_program_of_a_foreign_work_tree_is_started(tmp_path) -> None:
    def git(*words: str) -> str:
        identity = ["-c", "user.name=n", "-c", "user.email=e@example.org"]
        command = ["git", "-C", str(tmp_path), *identity, *words]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    def commit(words: str) -> str:
        (tmp_path / "f").write_text(words)
        git("add", "f")
        git("commit", "-q", "-m", words)
        return git("rev-parse", "HEAD")

    git("init", "-q")
    old, new = commit("first"), commit("second <b>\u202e")
    trap = tmp_path / "trap"
    for key in ("core.fsmonitor", "core.pager", "core.hooksPath", "gpg.program", "diff.external"):
        git("config", key, f"touch {trap}")
    git("config", "log.showSignature", "true")
    (line,) = commits_between(tmp_path, old, new)
    assert line.endswith("second <b>⟨U+202E⟩")
    assert not trap.exists()
    assert commits_between(tmp_path, "0" * 40, new) == ()


def test_every_heading_is_a_column_of_the_report_with_its_tolerance() -> None:
    for quantity in (q for q in QUANTITIES.values() if q.heading):
        (column,) = [c for c in (*MARGIN_COLUMNS, *RESPONSE_COLUMNS) if c["label"] == quantity.heading]
        unit = column.get("unit") or ""
        figure = Figure(name=f"margins / A table / Current loop / {column['label']}", value=1.0, unit=unit)
        factor = {"ms": 1e3}.get(unit, 1.0)
        assert Tolerances().pair(figure) == (pytest.approx(quantity.tolerance * factor, rel=1e-12), 1e-3)


def test_quantities_have_one_tolerance_a_unit_and_a_rule_of_the_study_comes_first() -> None:
    assert all(q.heading for q in LOOP_QUANTITIES.values())
    pairs = {(quantity.unit, quantity.tolerance) for quantity in LOOP_QUANTITIES.values()}
    assert len(pairs) == len({unit for unit, _ in pairs}), pairs
    figure = Figure(name="margins / A table / Current loop / Gain margin", value=1.0, unit="dB")
    for value in ("-1 deg", "much", "nan", True, [1]):
        refused(read_tolerances, {"x": value}, "study.toml", words="study.toml: tolerance 'x'")
    assert read_tolerances({"*gain margin": "0.5 dB"}, "study.toml").pair(figure) == (0.5, 0.0)
    late = Figure(name="Rise time", value=23.0, unit="ms")
    assert read_tolerances({"rise*": "0.5 s"}, "study.toml").pair(late) == (500.0, 0.0)  # was 0.5 ms
    assert read_tolerances({"rise*": 0.5}, "study.toml").pair(late) == (0.5, 0.0)
    assert Tolerances().pair(Figure(name="x: met", value=1.0, kind="verdict")) == (0.5, 0.0)


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
    for cause, said in ((COMPARISON.cause, "control.position.gain 90 → 120 1/s"), *PHRASES):
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
    changed = index.partition('id="designs"')[0].partition("What changed since last night")[2]
    assert "control.position.gain 12 → 10 1/s" in changed
    page = sorted(site.glob("nights/*/one-*.html"))[-1]
    text = re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8"))
    assert "control.position.gain 12 → 10 1/s: gain margin 12.00 → 10.00 dB" in " ".join(text.split())
