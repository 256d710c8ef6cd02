"""Figures and tables of results in Python: what is drawn is what was found."""

import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

from actuator_lti import InputError, assemble_loops, load_design, onset, stability_margins
from actuator_lti.drawing.plotting import COLOURS, plot_bode, plot_map, plot_onset, plot_step
from analyses.large_signal.classify import CAUSES
from analyses.large_signal.map import amplitude_map
from analyses.linear.loop_survey import LoopSurvey
from nonlinear import commands, simulate
from reports.charts import chart, style
from tests.refusals import refused


@pytest.fixture(autouse=True)
def _closed():
    yield
    plt.close("all")


@pytest.mark.parametrize("form", ["sampled", "continuous", "ideal"])
def test_a_bode_figure_shows_the_loop_and_its_margins(form: str) -> None:
    loops = assemble_loops("ilr33-amber", form=form)
    for loop in loops.present.values():
        magnitude, phase = loop.plot_bode()
        x, y = magnitude.lines[0].get_data()
        s = 2j * np.pi * x
        seen = loop.open_loop(np.exp(s * loop.period_s) if loop.period_s else s)
        np.testing.assert_allclose(y, 20 * np.log10(np.abs(seen)), atol=1e-9)
        turned = np.exp(1j * np.radians(phase.lines[0].get_ydata()))
        np.testing.assert_allclose(turned, seen / np.abs(seen), atol=1e-6)
        result = stability_margins(loop.open_loop)
        words = {text.get_text() for text in (*magnitude.texts, *phase.texts)}
        assert {f"{m.db:+.1f} dB" for m in result.gain_margins} <= words
        assert {f"{m.deg:+.1f}°" for m in result.phase_margins} <= words
        if loop.period_s:
            assert x.max() <= 0.5 / loop.period_s


def test_a_resonance_is_round_and_its_margins_stand_apart() -> None:
    """The fin's two margins near Nyquist lie within a tenth of a decade."""
    loops = assemble_loops("fin")
    x, y = loops.velocity.plot_nyquist().lines[1].get_data()
    seen = (np.abs(x) < 2.0) & (np.abs(y) < 2.0)
    assert np.abs(np.diff(x + 1j * y))[seen[1:] & seen[:-1]].max() < 0.081
    heights = [text.xy[1] for text in loops.position.plot_bode()[0].texts]
    assert np.abs(np.diff(heights)).min() > 20.0


def test_all_loops_in_one_figure_axes_of_ones_own_and_steps_that_end_at_one() -> None:
    loops = assemble_loops("ilr33-amber")
    both = loops.plot_bode()
    assert [text.get_text() for text in both[0].get_legend().get_texts()] == list(loops.present)
    figure, own = plt.subplots(2, 1)
    assert loops.position.plot_bode(own)[0] is own[0]
    assert loops.velocity.plot_nyquist().figure is not figure
    refused(loops.position.plot_bode, axes=own[0], words="allowed: 2 of matplotlib's axes")
    for form in ("sampled", "continuous", "ideal"):
        line = assemble_loops("ilr33-amber", form=form).velocity.plot_step(0.1).lines[0]
        assert line.get_ydata()[-1] == pytest.approx(1.0, abs=2e-2)
    with pytest.raises(InputError, match="duration_s = 0"):
        plot_step(assemble_loops("ilr33-amber").velocity.closed_loop, duration_s=0.0)


@pytest.mark.parametrize(
    ("name", "factor", "unit"), [("ilr33-amber", 180 / np.pi, "deg"), ("emps", 1e3, "mm")]
)
def test_a_run_is_drawn_in_its_own_units(name: str, factor: float, unit: str) -> None:
    run = simulate(name, commands.step(0.02), 0.05)
    panels = run.plot()
    assert panels[0].get_ylabel() == f"output, {unit}"
    np.testing.assert_allclose(panels[0].lines[1].get_ydata(), factor * run.output_angle_rad)
    html = run._repr_html_()
    assert f"{factor * run.output_angle_rad.max():.5g} {unit}" in html
    assert html.count("<tr>") == html.count("</tr>") > 6
    assert run.to_pandas().shape[0] == run.time_s.size


def test_the_border_and_the_map() -> None:
    design = load_design("ilr33-amber")
    loops = assemble_loops(design)
    border = onset(loops, np.geomspace(1.0, 3000.0, 60))
    panel = plot_onset(border)
    assert {text.get_text() for text in panel.get_legend().get_texts()} == {
        f"{n} limit" for n in border.each_rad
    }
    survey = LoopSurvey(design, loops, {"sampled": {}}, {}, (), {}, border)
    assert len(survey.plot_map().lines) == len(panel.lines)
    map_ = amplitude_map(design, loops, counts=(4, 5))
    drawn = map_.plot_map()
    present = {CAUSES[k] for k in np.unique(map_.cause)}
    assert {text.get_text() for text in drawn.get_legend().get_texts()} == present
    frame = map_.to_pandas()
    assert set(frame["cause"]) == present
    assert len(frame) == 20
    refused(LoopSurvey(design, loops, {"sampled": {}}, {}, (), {}, None).plot_map, words="nothing limits")


def test_cells_keep_their_colours_when_some_are_missing_and_pages_have_the_same() -> None:
    kind = np.array([[0, 2], [2, 3]])
    panel = plot_map(np.array([1.0, 10.0]), np.array([1.0, 2.0]), kind, ("none", "a", "b", "c"))
    drawn = panel.collections[0]
    assert drawn.get_array().ravel().tolist() == [0, 1, 1, 2]
    assert [tuple(np.round(drawn.cmap(k)[:3], 2)) for k in (1, 2)] == [
        tuple(round(int(COLOURS[k][i : i + 2], 16) / 255, 2) for i in (1, 3, 5)) for k in (2, 3)
    ]
    assert set(COLOURS) == {chart.COLOURS[name] for name in (*style.SERIES, "ink", "muted")}


def test_a_package_that_is_missing_is_named_with_its_extra(monkeypatch) -> None:
    run = simulate("ilr33-amber", commands.step(0.01), 0.01)
    monkeypatch.setitem(sys.modules, "pandas", None)
    told = r'to_pandas needs pandas; allowed: pip install "actuator-lti\[tables\]"'
    refused(run.to_pandas, match=told)
    loop = assemble_loops("ilr33-amber").velocity.open_loop  # python-control itself loads pyplot
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    refused(plot_bode, loop, words="plotting needs matplotlib")
