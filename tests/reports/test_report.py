"""The report of a design: page and JSON say the same, nothing comes through unescaped."""

import math
import re
from collections import Counter
from dataclasses import replace
from importlib import import_module
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from live_page import HOSTILE, SEEN, Built

import reports
from actuator_lti import assemble_loops, onset, stability_margins
from actuator_lti.design import load_design, with_values
from reports import document as doc
from reports.build import design_report
from reports.certain import certain
from reports.charts.chart import Chart, Curve, Panel
from reports.charts.data import chart_of
from reports.charts.svg import draw_svg
from reports.cli.main import main
from reports.html import page
from reports.numbers import show
from reports.provenance import build_time
from reports.sections.names import loop_words
from tests.nightly.site_checks import Page
from tests.refusals import refused


def curves(panel: Panel) -> list[Curve]:
    return [item for item in panel.items if isinstance(item, Curve)]


def rows_of(document: dict[str, Any], section: str, caption: str) -> list[dict[str, Any]]:
    part = next(part for part in document["sections"] if part["id"] == section)
    blocks = [block for block in doc.walk(part) if block["kind"] == "table"]
    return next(block["rows"] for block in blocks if block["caption"].startswith(caption))


def test_every_section_that_a_review_asks_for_is_there(built: Built) -> None:
    ids = [part["id"] for part in built.document["sections"]]
    assert ids[:3] == ["answer", "verdicts", "validation"]
    wanted = {"margins", "loop-current", "loop-velocity", "loop-position", "forms", "break-points"}
    assert wanted | {"operating-points", "delays", "limits", "parameters", "provenance"} <= set(ids)
    drawn = Counter(block["figure"] for block in doc.figures(built.document))
    counts = {"bode": 4, "closed_bode": 3, "nyquist": 3, "sensitivity": 3, "step": 4}
    assert drawn.items() >= counts.items()  # one Bode and one step on the first screen


@pytest.mark.parametrize("name", ["current", "velocity", "position"])
def test_the_tables_hold_the_margins_of_the_engine(built: Built, name: str) -> None:
    margins = stability_margins(getattr(assemble_loops(load_design("ilr33-amber")), name).open_loop)

    def own(caption: str) -> list[dict[str, Any]]:
        rows = rows_of(built.document, "margins", caption)
        return [row for row in rows if row["loop"] == loop_words(name)]

    (row,) = own("Stability margins")
    for key, unit in (("gain_margin_db", "db"), ("phase_margin_deg", "deg")):
        assert row[key] == certain(getattr(margins, key), unit)
    assert row["crossover_hz"] == pytest.approx(margins.phase_margin.frequency_hz)
    assert row["delay_margin_ms"] == pytest.approx(1e3 * margins.delay_margin_s)
    assert len(own("Every gain and phase")) == len(margins.gain_margins) + len(margins.phase_margins)


def test_the_page_shows_what_the_json_holds(built: Built) -> None:
    words = " ".join(Page(built.page.read_text(encoding="utf-8")).words)
    blocks = [block for part in built.document["sections"] for block in doc.walk(part)]
    tables = [block for block in blocks if block["kind"] == "table"]
    for row, column in ((row, column) for one in tables for row in one["rows"] for column in one["columns"]):
        value = row.get(column["key"])
        value = value["text"] if isinstance(value, dict) else value
        assert show(value, column["format"]) in words


def test_every_margin_is_marked_on_its_bode_figure(built: Built) -> None:
    figures = [block for block in doc.figures(built.document) if block["figure"] == "bode"][1:]
    loops = assemble_loops(load_design("ilr33-amber")).present.values()
    for block, loop in zip(figures, loops, strict=True):
        margins = stability_margins(loop.open_loop)
        top, bottom = chart_of(block["chart"]).columns[0].panels
        inside = np.clip([-m.db for m in margins.gain_margins], *top.y.span())
        assert [one.y[0] for one in curves(top) if one.look.marker == "s"] == pytest.approx(inside, rel=1e-5)
        phases = [one.y[1] - one.y[0] for one in curves(bottom) if one.look.width == 2.6]
        assert phases == pytest.approx([m.deg for m in margins.phase_margins], abs=1e-3)


def test_the_phase_of_a_figure_does_not_jump_nor_go_back(built: Built) -> None:
    for block in doc.figures(built.document):
        panels = [panel for column in chart_of(block["chart"]).columns for panel in column.panels]
        for one in (one for panel in panels if panel.y.label == "phase, deg" for one in curves(panel)):
            assert not (np.abs(np.diff(one.y)) >= 90.0).any() or len(one.y) == 2
            assert (np.diff(one.x) >= 0.0).all()  # a line goes from each frequency to the next


def test_parameters_come_with_source_and_grade(built: Built) -> None:
    rows = {row["path"]: row for row in rows_of(built.document, "parameters", "Values")}
    dry, inertia = rows["friction.dry_torque"], rows["load.inertia"]
    assert (dry["grade"], "Table 1" in dry["source"], inertia["tolerance"]) == ("A", True, "±50 %")


def test_report_in_python_is_the_command(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")
    arguments = ["report", "ctms-motor-position", "--no-validation", "--also", "duty", "--quiet"]
    main([*arguments, "--out", str(tmp_path / "command")])
    made = reports.report("ctms-motor-position", tmp_path / "python", validation=False, also=["duty"])
    for name in ("report.html", "report.json"):
        assert (tmp_path / "python" / name).read_bytes() == (tmp_path / "command" / name).read_bytes()
    mine = doc.section("mine", "Mine", [doc.text("of a record")])
    parts = reports.report("ctms-motor-position", validation=False, also=["duty"], added=[mine])["sections"]
    order = [part["id"] for part in parts]
    assert order.index("mine") < order.index("duty")  # as the command puts what it includes
    assert [part for part in parts if part["id"] != "mine"] == made["sections"]  # without a folder, too
    refused(reports.report, "ctms-motor-position", also=["all"], words="also = 'all'")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    refused(build_time, words="SOURCE_DATE_EPOCH")


@pytest.mark.parametrize("package", [
    "actuator_lti", "analyses", "analyses.friction_effects", "analyses.validation", "nonlinear", "reports",
])  # fmt: skip
def test_a_package_shows_its_public_names_and_gives_them_all(package: str) -> None:
    given: dict[str, Any] = {}
    exec(f"from {package} import *", given)
    shown = {name for name in dir(import_module(package)) if not name.startswith("__")}
    assert given.keys() - {"__builtins__"} == shown


def test_the_page_asks_no_network_and_is_small(built: Built) -> None:
    content = built.page.read_text(encoding="utf-8")
    assert len(content) < 1_300_000
    asked = Page(content).given("src", "href", "xlink:href", "action", "data")
    assert [value for value in asked if not value.startswith(("#", "data:,"))] == []
    names_of_xml = r'"http://www\.w3\.org/(1999|2000|XML)/\w+/?\w*"'
    outside = re.sub(names_of_xml, "", content)
    assert not re.search(r"https?://|@import|url\((?!#)", outside)


def test_ids_are_unique_tables_have_captions_and_scoped_headers_figures_words(built: Built) -> None:
    tags = Page(built.page.read_text(encoding="utf-8")).tags
    ids = [own["id"] for _, own in tags if own.get("id")]
    assert len(ids) == len(set(ids))
    assert {str(own["href"])[1:] for tag, own in tags if tag == "a"} <= set(ids)
    names = [tag for tag, _ in tags]
    assert names.count("table") == names.count("caption") > 8
    assert all(own.get("scope") in ("row", "col") for tag, own in tags if tag == "th")
    drawn = [own for tag, own in tags if tag == "svg" and own.get("aria-hidden") != "true"]
    assert all(own.get("role") == "img" and own.get("aria-label") for own in drawn)


def test_names_from_a_design_file_stay_text() -> None:
    design = load_design("ilr33-amber")
    requirement = replace(design.requirements[0], id=HOSTILE, source=HOSTILE, note=HOSTILE)
    some = list(design.parameters.items())[:3]
    parameters = {path: replace(item, text=HOSTILE, source=HOSTILE) for path, item in some}
    names = dict.fromkeys(("name", "title", "description", "revision", "origin"), HOSTILE)
    hostile = replace(design, **names, requirements=(requirement,), parameters=parameters)
    content = page(design_report(hostile))
    reader = Page(content)
    kinds = [attributes.get("type") for tag, attributes in reader.tags if tag == "script"]
    # one that runs; the others are data of the sliders
    assert sorted(kinds, key=str) == [None, "application/json", "application/octet-stream"]
    assert not any(key.startswith("on") for _, attributes in reader.tags for key in attributes)
    assert SEEN in "".join(reader.words)
    assert "49" not in re.findall(r"<h1>(.*?)</h1>", content)[0]


@pytest.mark.parametrize("on_page", [True, False])
def test_names_in_a_figure_stay_text_and_a_label_of_two_panels_is_said_once(on_page: bool) -> None:
    chart = Chart(title=HOSTILE, legend=True, legend_title=HOSTILE, loop=HOSTILE)
    panel = chart.panel(title=HOSTILE)
    for one in (panel, chart.panel()):
        one.curve([1, 2], [1, 2], "shared & <same>", marker="o")
    panel.curve([1, 2], [1, None], HOSTILE)
    panel.bar(0.0, 0.0, 10.0, HOSTILE, hatch="//")
    panel.rule_y(1.0, HOSTILE, colour="c5", dash=1)
    panel.band_x(1.0, 1.2, HOSTILE)
    panel.note(HOSTILE, corner="top left")
    panel.x.label, panel.y.ticks = HOSTILE, [(1.0, HOSTILE)]
    block = doc.figure("curves", chart, caption="c", alt=HOSTILE)
    svg = draw_svg(block, page=on_page)
    assert "<script" not in svg
    words = ["".join(node.itertext()) for node in ElementTree.fromstring(svg).iter()]
    assert words.count(SEEN) >= 6
    assert words.count("shared & <same>") == 1  # in the legend, of both panels
    assert ("var(--" in svg) is on_page


def test_an_unstable_design_is_called_unstable_and_still_drawn() -> None:
    document = design_report(with_values(load_design("ilr33-amber"), {"control.velocity.gain": 5.0}))
    assert document["verdict"]["parts"]["requirements"]["not_met"] > 0
    (part,) = (part for part in document["sections"] if part["id"] == "margins")
    assert part["result"].startswith("Not stable: velocity loop")
    (row,) = (r for r in rows_of(document, "margins", "Stability") if r["loop"] == "Velocity loop")
    unstable = {"stable": {"text": "unstable", "status": "fail"}, "delay_margin_ms": None}
    assert {key: row[key] for key in unstable} == unstable  # an unstable loop has no margins
    assert "unstable" in page(document)


def test_a_linear_axis_is_told_in_its_own_units() -> None:
    document = design_report(load_design("emps"))
    assert "No simulation stands behind this report" in str(document["sections"][0])
    (table, *_) = next(one["blocks"] for one in document["sections"] if one["id"] == "operating-points")
    assert [column["unit"] for column in table["columns"][1:3]] == ["N", "N s/m"]
    assert table["rows"][0]["slope"] == pytest.approx(203.5034)  # viscous friction, published


def test_limits_are_those_of_the_linear_onset(built: Built) -> None:
    loops = assemble_loops(load_design("ilr33-amber"))
    for row in rows_of(built.document, "limits", "How far"):
        result = onset(loops, [2 * math.pi * row["hz"]])
        assert math.degrees(result.amplitude_rad[0]) == pytest.approx(row["amplitude"], rel=5e-3)
