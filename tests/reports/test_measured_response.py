"""A measured response over the model: truth is the model itself times a known error."""

import html
import json
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.io import savemat

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.margins import MeasuredResponse
from analyses.identification.measured_response import identify_response
from analyses.margins.run import measured_over
from reports import report
from reports.sections.measured import blocks, words
from tests.refusals import refused

LOOPS = assemble_loops("ilr33-amber")
HERTZ = np.geomspace(2.0, 1800.0, 160)


Response = control.FrequencyResponseData


def bench(loop: str, kind: str = "L", gain: float = 1.05, delay_s: float = 0.0) -> Response:
    """The loop as a bench with another gain and a delay would measure it."""
    at = LOOPS.present[loop]
    hertz = HERTZ[2.1 * HERTZ * at.period_s < 1.0]
    L = at.plain_open(np.exp(2j * np.pi * hertz * at.period_s)).reshape(-1)
    L = L * gain * np.exp(-2j * np.pi * hertz * delay_s)
    return Response({"L": L, "T": L / (1.0 + L), "S": 1.0 / (1.0 + L)}[kind], 2.0 * np.pi * hertz)


def saved(path: Path, truth: Response, header: str, *columns: np.ndarray) -> Path:
    rows = np.column_stack([truth.omega / (2.0 * np.pi), *columns])
    np.savetxt(path, rows, delimiter=",", header=f"f_hz,{header}", comments="", fmt="%.17g")
    return path


@pytest.mark.parametrize("kind", ["L", "T", "S"])
def test_gain_and_delay_are_what_lies_between(kind: str) -> None:
    found, model = bench("velocity", kind, 1.05, 1e-4), bench("velocity", kind, 1.0)
    one = measured_over(LOOPS, found, f"velocity:{kind}")
    apart = (found.frdata / model.frdata).ravel()
    np.testing.assert_allclose(one.measured / one.model, apart, rtol=1e-9)
    np.testing.assert_allclose(one.difference_deg, np.degrees(np.angle(apart)), atol=1e-7)
    np.testing.assert_allclose(one.difference_db, 20.0 * np.log10(np.abs(apart)), atol=1e-9)
    off = one.open_loop.frdata / one.open_model
    np.testing.assert_allclose(20.0 * np.log10(np.abs(off)), 20.0 * np.log10(1.05), atol=1e-9)
    np.testing.assert_allclose(np.degrees(np.angle(off)), -360.0 * 1e-4 * one.frequency_hz, atol=1e-7)
    assert f"within {np.abs(one.difference_db).max():.2f} dB" in words(one)
    assert kind != "L" or "within 0.42 dB" in words(one)


def test_a_closed_loop_given_as_an_open_one_is_named_and_a_result_is_printed_short() -> None:
    """The model of an own loop is exact: as T it is 0 dB off. The drawn model has points of its own."""
    one = measured_over(LOOPS, bench("velocity", "T", 1.0), "velocity")
    assert one.nearer == ("T", pytest.approx(0.0, abs=1e-9))
    assert "was it measured of velocity:T?" in words(one)
    right, at = measured_over(LOOPS, bench("velocity", "T", 1.05), "velocity:T"), LOOPS.velocity
    assert (right.nearer, "was it measured" in words(right)) == (None, False)
    assert (len(repr(right)) < 200, "T of velocity" in str(right)) == (True, True)
    exact = at.plain_open(np.exp(2j * np.pi * right.curve_hz * at.period_s)).reshape(-1)
    np.testing.assert_allclose(right.curve, exact)
    assert right.curve_hz[0] < HERTZ[0] < HERTZ[-1] < right.curve_hz[-1]


def test_a_closed_loop_is_judged_as_it_was_measured() -> None:
    """Where T is near 1, a percent of it is many times L = T/(1 - T)."""
    model, n = bench("position", "T", 1.0), np.random.default_rng(3).normal(size=(2, HERTZ.size))
    noise = (1.0 + 0.01 * (n[0] + 1j * n[1]) / np.sqrt(2.0))[: model.omega.size]
    one = measured_over(LOOPS, Response(model.frdata.ravel() * noise, model.omega), "position:T")
    np.testing.assert_allclose(one.difference_db, 20.0 * np.log10(np.abs(noise)), atol=1e-9)
    assert one.within >= 0.97 * one.frequency_hz.size
    assert (np.abs(one.open_loop.frdata - one.open_model) <= 2.0 * one.open_loop.radius).mean() > 0.95


def test_margins_are_ranges_that_hold_the_true_ones() -> None:
    one = measured_over(LOOPS, bench("velocity", gain=1.0), "velocity")
    exact = stability_margins(LOOPS.velocity.open_loop)
    phase, gain = one.margins.phase_margins[0].deg_range, one.margins.gain_margins[0].ratio_range
    assert phase[0] - 1e-6 <= exact.phase_margins[0].deg <= phase[1] + 1e-6
    assert gain[0] * (1 - 1e-9) <= exact.gain_margins[0].ratio <= gain[1] * (1 + 1e-9)
    assert {block["kind"] for block in blocks(one)} >= {"table", "figure"}


def test_stated_noise_covers_as_many_points_as_it_says(tmp_path, cli) -> None:
    rng, truth = np.random.default_rng(5), bench("position", gain=1.0)
    L, n = truth.frdata.ravel(), truth.omega.size
    noisy = L * (1.0 + 0.02 * (rng.normal(size=n) + 1j * rng.normal(size=n)) / np.sqrt(2.0))
    columns = (noisy.real, noisy.imag, np.full(n, 0.02))
    path = saved(tmp_path / "r.csv", truth, "real,imag,deviation", *columns)
    one = measured_over(LOOPS, path)
    assert 0.95 * n <= one.within <= n  # 99 % of the circles
    cli.text("margins", "ilr33-amber", "--response", path, "--out", tmp_path / "x")


def test_command_line(tmp_path, cli) -> None:
    truth = bench("velocity", gain=1.0)
    L = truth.frdata.ravel()
    columns = (20.0 * np.log10(np.abs(L)), np.degrees(np.angle(L)))
    path = saved(tmp_path / "r.csv", truth, "gain_db,phase_deg", *columns)
    asked = ["margins", "ilr33-amber", "--response", str(path), "--response-of"]
    assert max(map(abs, cli.data(*asked, "velocity")["measured"]["difference_db"])) < 1e-9
    said = cli.text("margins", "ilr33-amber", *asked[2:], "velocity")
    assert "velocity loop. The model explains the measurement within 0.00 dB" in " ".join(said.split())
    assert "--response-of speed: allowed: " in cli.refused(*asked, "speed")
    refused(
        measured_over, LOOPS, Response([1.0, 1j], [1e6, 2e6]), "current", words="no two frequencies below"
    )


def test_what_the_points_hide_is_told_wherever_the_margins_stand(tmp_path, cli) -> None:
    """An antiresonance at 60 rad/s of a thousandth of damping, its resonance at 150, points a third apart."""
    omega = np.geomspace(8.0, 9000.0, 26)
    s = 1j * omega
    L = 3000.0 / s * ((s / 60.0) ** 2 + 2e-3 * s / 60.0 + 1.0) / ((s / 150.0) ** 2 + 2e-3 * s / 150.0 + 1.0)
    columns = (20.0 * np.log10(np.abs(L)), np.degrees(np.unwrap(np.angle(L))), np.full(omega.size, 0.003))
    path = saved(tmp_path / "r.csv", Response(L, omega), "gain_db,phase_deg,deviation", *columns)
    one = measured_over(LOOPS, path, "current")
    assert any("resonance lies between these points" in note for note in one.notes)
    assert any("margins there may be missing" in note for note in one.notes)
    assert set(one.margins.notes) < set(one.notes)
    asked = ("--response", path, "--response-of", "current", "--out", tmp_path / "x")
    printed = cli.text("margins", "ilr33-amber", *asked)
    page = html.unescape((tmp_path / "x" / "margins.html").read_text(encoding="utf-8"))
    held = json.dumps(json.loads((tmp_path / "x" / "margins.json").read_text()), ensure_ascii=False)
    made = report("ilr33-amber", validation=False, response=path, response_of="current")
    (section,) = (one for one in made["sections"] if one["id"] == "measured-response")
    assert "current loop. The model explains the measurement within" in section["result"]
    for told in (printed, page, held, json.dumps(made, ensure_ascii=False)):
        plain = "".join(told.split()).casefold().replace("\u2212", "-")
        assert all("".join(note.split()).casefold() in plain for note in one.notes)
        assert "readasfrequency" in plain


@pytest.mark.parametrize("kind", ["L", "T"])
def test_a_given_noise_is_the_one_that_counts(kind: str) -> None:
    truth = bench("velocity", kind, 1.0)
    given = MeasuredResponse.with_noise(truth, 0.3 * np.abs(truth.frdata.ravel()))
    one = measured_over(LOOPS, given, f"velocity:{kind}")
    np.testing.assert_allclose(one.radius, given.radius, rtol=1e-12)
    assert one.source == given.source
    if kind == "L":
        assert one.margins.modulus_range == pytest.approx(stability_margins(given).modulus_range)
    else:  # dL = dT/(1 - T)^2
        T = truth.frdata.ravel()
        np.testing.assert_allclose(one.open_loop.radius, given.radius / np.abs(1.0 - T) ** 2, rtol=1e-9)


def test_data_of_another_sampling_period_are_refused() -> None:
    truth, period = bench("velocity", gain=1.0), LOOPS.velocity.period_s
    for dt in (None, True, 0, period):
        measured_over(LOOPS, Response(truth.frdata.ravel(), truth.omega, dt=dt), "velocity")
    slow = Response(truth.frdata.ravel()[:4], truth.omega[:4] / 1e3, dt=0.5)
    refused(measured_over, LOOPS, slow, "velocity", match=r"dt = 0\.5 s; allowed: .* of the velocity loop")


@pytest.mark.parametrize("name", ["Ts", "dt", "sampling_period", "period_s"])
def test_a_sampling_period_in_a_file_is_read_as_one_of_data(name: str, tmp_path: Path) -> None:
    """A number in a .mat or a column of one value; for margins and for a fit."""
    truth, period, design = bench("velocity", gain=1.0), LOOPS.velocity.period_s, load_design("ilr33-amber")
    held = {"f_hz": truth.omega / (2.0 * np.pi), "L": truth.frdata.ravel()}
    for dt, fits in ((0.0, True), (period, True), (2.0 * period, False)):
        savemat(tmp_path / "m.mat", held | {name: dt})
        parts = held["L"].real, held["L"].imag, np.full(held["L"].shape, dt)
        table = saved(tmp_path / "m.csv", truth, f"real,imag,{name}", *parts)
        for file in (tmp_path / "m.mat", table):
            if fits:
                told = measured_over(LOOPS, file, "velocity").read_as
                assert (f'sampling period in s "{name}"' in told, "not read" in told) == (True, False)
                continue
            words = f"dt = {dt:g} s; allowed: {period:g} s, of the vel"
            refused(measured_over, LOOPS, file, "velocity", words=words)
            refused(identify_response, design, file, loop="velocity", words=words)


def test_the_other_sign_is_named() -> None:
    """What comes back, behind the summing point's minus, is -L."""
    truth = bench("velocity", gain=1.05)
    one = measured_over(LOOPS, Response(-truth.frdata.ravel(), truth.omega), "velocity")
    assert one.nearer == ("-L", pytest.approx(20.0 * np.log10(1.05), rel=1e-6))
    assert "nearer to -L of the model, 0.42 dB rms: was it measured with the other sign?" in words(one)


def test_frequencies_in_rad_s_and_a_phase_turned_round_are_named() -> None:
    """Taken as Hz where a heading says no unit; a lag may be counted from 0 up."""
    truth, at = bench("velocity", gain=1.05), LOOPS.velocity
    turned = measured_over(LOOPS, Response(truth.frdata.ravel().conj(), truth.omega), "velocity")
    assert turned.nearer == ("L*", pytest.approx(20.0 * np.log10(1.05), rel=1e-6))
    assert "nearer to L* of the model, 0.42 dB rms: is its phase turned round" in words(turned)
    omega = 2.0 * np.pi * HERTZ[HERTZ < 100.0]  # rad/s, whose numbers are read as Hz
    T = at.plain_open(np.exp(1j * omega * at.period_s)).reshape(-1)
    slow = measured_over(LOOPS, Response(T / (1.0 + T), 2.0 * np.pi * omega), "velocity:T")
    assert slow.nearer == ("T in rad/s", pytest.approx(0.0, abs=1e-9))
    assert "are its frequencies in rad/s?" in words(slow)


def test_a_coherence_of_few_averages_is_as_wide_as_its_quantile_says(tmp_path) -> None:
    """Of two averages: F(2, 2) is exceeded by 99 in 1 of 100 cases, |e|^2 = 99 |L|^2 (1 - g2)/g2."""
    truth = bench("velocity", gain=1.0)
    L = truth.frdata.ravel()
    path = saved(tmp_path / "r.csv", truth, "re,im,coherence", L.real, L.imag, np.full(L.size, 0.999))
    one = measured_over(LOOPS, path, "velocity", 2)
    np.testing.assert_allclose(one.radius / np.abs(L), np.sqrt(99.0 * 0.001 / 0.999), rtol=1e-9)
    assert one.source == "coherence of 2 averages"
