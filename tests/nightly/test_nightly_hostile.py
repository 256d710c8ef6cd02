"""Names and texts of other people stay text: in pages, SVG, PDF, CSV, JUnit, Markdown and paths."""

import csv
import io
import json
from html import unescape
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from nightly_fakes import CODE, INLINE, Calendar, job, study
from site_checks import Page, check_whole

from reports.nightly.moves import change_points
from reports.nightly.night import approve, run_night
from reports.nightly.pages import line_chart
from reports.nightly.text import one_line
from reports.visible import visible

HOSTILE = (
    "<script>window.hacked=1</script>",
    '"><img src=x onerror=alert(1)>',
    "</style><svg/onload=alert(1)>",
    "</title></script><b>",
    "{{ 7*7 }}{% raw %}",
    "../../../../etc/passwd",
    "/absolute\\windows\\name",
    "line one\nline two\r\n\ttab",
    "\u202egnihtemos \u2066isolated\u2069 \u200f",
    "nul\x00bell\x07esc\x1b[31m",
    '=HYPERLINK("http://evil.example","x")',
    "@SUM(1+1)*cmd|' /C calc'!A0",
    "#set page(fill: red); $x$ `raw` [link](http://evil.example) <lbl>",
    "]]> & <![CDATA[",
    "x" * 10_000,
    "مرحبا 日本語 🚀",
)


@pytest.fixture(scope="module")
def hostile_site(tmp_path_factory):
    """Two nights of a study whose every text is hostile."""
    site, clock, half = tmp_path_factory.mktemp("hostile") / "site", Calendar(), "half a sign \ud800"
    texts = ("title", "label", "requirement", "loop", "revision")
    for margin in (10.0, 9.0):
        named = {**{words: words for words in HOSTILE}, "surrogate": half}
        jobs = [job(name, margin, **dict.fromkeys(texts, words)) for name, words in named.items()]
        jobs.append(job("raises", mode="raise", words=" ".join((*HOSTILE[:15], half))))
        made = study(*jobs, title="".join(HOSTILE[:5]))
        run_night(made, site, INLINE, code=CODE, clock=clock.next())
    approve(made, site, by=HOSTILE[0], reason=HOSTILE[1], settings=INLINE, clock=clock)
    return site


def pages(site: Path) -> list[Path]:
    return [site / "index.html", *site.glob("nights/*/*.html")]


def test_no_name_becomes_markup_a_path_a_template_or_a_mark_of_direction(hostile_site) -> None:
    """Every page is whole and asks nobody."""
    assert "<script>window.hacked=1</script>" in check_whole(hostile_site).text
    texts = {path: path.read_text(encoding="utf-8") for path in pages(hostile_site)}
    for path, text in texts.items():
        page = Page(text)
        assert not any(key.startswith("on") for _, attributes in page.tags for key in attributes), path
        assert (page.names.count("script"), page.names.count("style")) == (1, 1), path
        assert not {"img", "b", "iframe", "object", "embed"} & set(page.names), path
        assert "default-src 'none'" in unescape(text)
    assert "{{ 7*7 }}" in "".join(texts.values())
    assert sorted(p.name for p in hostile_site.parent.iterdir()) == ["site", "site.state"]
    assert all(path.name.isascii() and len(path.name) < 100 for path in hostile_site.rglob("*"))
    for path in [*pages(hostile_site), hostile_site / "junit.xml", hostile_site / "summary.md"]:
        assert not set(path.read_text(encoding="utf-8")) & set(OBEYED)


OBEYED = "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u200e\u200f\x00\x07\x1b"


def test_junit_and_summary_name_every_design_no_cell_is_a_formula_and_no_line_a_link(hostile_site) -> None:
    suites = [s.get("name") for s in ElementTree.parse(hostile_site / "junit.xml").getroot()]
    assert len(suites) == len(HOSTILE) + 2
    assert {HOSTILE[0], "x" * 10_000} <= set(suites)
    designs = json.loads((hostile_site / "summary.json").read_text())["designs"]
    assert set(HOSTILE) <= {one["name"] for one in designs}
    tables = (path.read_text(encoding="utf-8") for path in hostile_site.glob("nights/*/*.csv"))
    rows = [row for text in tables for row in csv.reader(io.StringIO(text, newline=""))]
    assert {len(row) for row in rows} == {4}
    assert [row for row in rows if row[0].lstrip().startswith(("=", "+", "-", "@", "|"))] == []
    text = (hostile_site / "summary.md").read_text(encoding="utf-8")
    assert not [words for words in ("<script", "<img", "](http") if words in text]
    assert all(line.count("|") in (0, 6) or "\\|" in line for line in text.splitlines())


@given(name=st.text(max_size=60), loop=st.text(max_size=30))
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_at_all_makes_a_whole_site(tmp_path_factory, name: str, loop: str) -> None:
    site = tmp_path_factory.mktemp("any") / "site"
    name = name if one_line(name) else "-"
    run_night(study(job(name, loop=loop, label=name, title=loop), title=name), site, INLINE, code=CODE)
    check_whole(site)
    for path in pages(site):
        assert Page(path.read_text(encoding="utf-8")).names.count("script") == 1
    ElementTree.parse(site / "junit.xml")


@given(title=st.text(max_size=40))
@settings(max_examples=30)
def test_a_chart_is_well_formed_whatever_it_is_called(title: str) -> None:
    nights = [f"2026-01-0{day}T02:00:00Z" for day in range(1, 6)]
    values = np.array([1.0, 2.0, np.nan, 2.0, 3.0])
    root = ElementTree.fromstring(line_chart(visible(title), visible(title), nights, values, (), 1.5))
    drawn = {"svg", "path", "text", "tspan", "g", "rect", "clipPath", "use", "defs"}
    assert {e.tag.rpartition("}")[2] for e in root.iter()} <= {"div", *drawn}


@pytest.mark.parametrize(("before", "after", "sign"), [(1.0, 2.0, "▲"), (2.0, 1.0, "▼")])
def test_nights_of_one_day_have_its_date_once_and_a_change_its_direction(before, after, sign) -> None:
    nights = [f"2026-01-31T0{hour}:00:00Z" for hour in range(5)]
    values = np.array([before, before, after, after, after])
    drawn = line_chart("bandwidth", "Hz", nights, values, change_points(values, 0.1))
    assert (drawn.count(">2026-01-31<"), drawn.count(f">{sign}<")) == (1, 1)
