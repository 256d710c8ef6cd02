"""A measured frequency response is the same numbers however it was written."""

import json
from pathlib import Path

import control
import numpy as np
import pytest
import scipy.io

from actuator_lti.errors import InputError
from actuator_lti.files.response import read_response

HERTZ = np.array([1.0, 2.0, 5.0, 20.0])
OMEGA = 2.0 * np.pi * HERTZ
PAGE = json.loads((Path(__file__).parents[1] / "page" / "responses.json").read_text(encoding="utf-8"))
L = 40.0 / (1j * OMEGA) / (1.0 + 0.01j * OMEGA)
DB, DEG = 20.0 * np.log10(np.abs(L)), np.degrees(np.angle(L))
TABLES = [
    (",", "frequency_hz,gain_db,phase_deg", (HERTZ, DB, DEG)),
    (";", "f;Mag (dB);Phase (\u00b0)", (HERTZ, DB, DEG)),
    ("\t", "omega\tGain (rad/A)\tphase [rad]", (OMEGA, np.abs(L), np.angle(L))),
    (" ", "frequency_kHz abs Phase/deg", (HERTZ / 1e3, np.abs(L), DEG)),
    (",", "w_rad_s,Re(L),Im(L)", (OMEGA, L.real, L.imag)),
    (",", "", (HERTZ, DB, DEG)),
]


@pytest.mark.parametrize(("cut", "head", "columns"), TABLES)
def test_every_spelling_of_a_table(tmp_path, cut, head, columns):
    rows = [cut.join(f"{x:.12g}" for x in row) for row in zip(*columns, strict=True)]
    rows = [row.replace(".", ",") for row in rows] if cut == ";" else rows
    (tmp_path / "r.csv").write_text(
        "# bench\n" + "\n".join(filter(None, [head, *rows[::-1]])), encoding="utf-8"
    )
    read = read_response(tmp_path / "r.csv")
    np.testing.assert_allclose(read.frequency_hz, HERTZ, rtol=1e-11)
    np.testing.assert_allclose(read.response, L, rtol=1e-10)
    assert np.isnan(read.deviation).all()


@pytest.mark.parametrize("text", PAGE["read as 3 - 4j at 5 Hz"])
def test_the_page_reads_the_same(tmp_path, text):
    (tmp_path / "r.csv").write_text(text)
    read = read_response(tmp_path / "r.csv")
    at = np.isclose(read.frequency_hz, 5.0)
    np.testing.assert_allclose(read.response[at], [3.0 - 4.0j], rtol=1e-12)


@pytest.mark.parametrize("text", PAGE["refused"])
def test_the_page_refuses_the_same(tmp_path, text):
    (tmp_path / "r.csv").write_text(text)
    with pytest.raises(InputError):
        read_response(tmp_path / "r.csv")


@pytest.mark.parametrize(
    "held", [{"H": L}, {"re": L.real, "im": L.imag}, {"mag_abs": np.abs(L), "phase_deg": DEG}]
)
def test_matlab_and_python_control(tmp_path, held):
    scipy.io.savemat(tmp_path / "r.mat", {"w": OMEGA, "coherence": np.full(4, 0.8), "averages": 5, **held})
    read = read_response(tmp_path / "r.mat")
    np.testing.assert_allclose(read.response, L, rtol=1e-14)
    np.testing.assert_allclose(read.deviation, 0.25, rtol=1e-14)  # sqrt(0.2/(0.8 * 4))
    given = read_response(control.FrequencyResponseData(L, OMEGA))
    np.testing.assert_allclose(given.response, read.response, rtol=1e-14)


@pytest.mark.parametrize("of", ["T", "S"])
def test_closed_loops_and_how_their_errors_grow(tmp_path, of):
    value = {"T": lambda loop: loop / (1.0 + loop), "S": lambda loop: 1.0 / (1.0 + loop)}[of]
    columns = (HERTZ, value(L).real, value(L).imag, np.full(4, 1e-7))
    rows = "\n".join(",".join(f"{x!r}" for x in row) for row in np.transpose(columns).tolist())
    (tmp_path / "r.csv").write_text("f,real,imag,sigma\n" + rows)
    read = read_response(tmp_path / "r.csv").as_loop(of)
    np.testing.assert_allclose(read.response, L, rtol=1e-12)
    near = L * (1.0 + read.deviation)  # a loop so far off is as far off when closed as the file says
    np.testing.assert_allclose(np.abs(value(near) / value(L) - 1.0), 1e-7, rtol=1e-4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("f,gain,phase_deg\n1,2,3\n2,1,4", "says no unit; allowed: gain_db or gain_ratio"),
        ("f,gain_db,phase\n1,2,-3\n2,1,-4", "allowed: phase_deg or phase_rad"),
        ("f,gain_db\n1,2\n2,1", "no phase in the columns f, gain_db"),
        ("f,re,im\n1,2,3\n1,2,3", "a frequency is given twice"),
        ("f,re,im\n0,2,3\n1,2,3", "frequencies above 0"),
        ("f,re,im,coherence\n1,2,3,1.2\n2,2,3,1", "a coherence outside 0 to 1"),
        ("f,re,im\n1,2,3\n2,2", "rows of 3"),
        ("# bench\nf,re,im\n1,2,3\n\n2,x,1\n3,1,1", 'line 5: "x" is no number'),
        ("f,re,im\n0,2,3\n1,2,3\n2,2,2", "each at a frequency above 0 Hz"),
        ("f,re,im\n1,0,0\n2,2,1", "a value that is 0"),
        ("", "is empty"),
    ],
)
def test_what_is_no_response_is_refused(tmp_path, text, words):
    (tmp_path / "r.csv").write_text(text)
    with pytest.raises(InputError, match=r"r\.csv") as refused:
        read_response(tmp_path / "r.csv")
    assert words in str(refused.value)
