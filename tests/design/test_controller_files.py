"""Files of other makers: a controller's settings become its section, a measured response is the same numbers.

Truth: the makers' own control laws, worked out by hand: what a drive gives at an error of one unit, in volts
line-line and amperes of the equivalent DC motor, sqrt(3) and sqrt(3)/2 of the peaks of a phase.
"""

import json
from math import pi, sqrt
from pathlib import Path

import control
import numpy as np
import pyarrow.parquet
import pytest
import scipy.io

from actuator_lti.design import load_design, parameter_value, read_design_text, with_overrides, write_design
from actuator_lti.design.controller_files import import_controller_file
from actuator_lti.design.loader import design_from_tree
from actuator_lti.design.model import Design
from actuator_lti.design.objects import Imported
from actuator_lti.design.writing import design_tree
from analyses.records.response import RecordedResponse, read_response
from reports.cli.main import main
from tests.refusals import refused

BASE = with_overrides(load_design("ilr33-amber"), {"limits.continuous_current": "1 A"})
ODRIVE = """{"axis0": {
 "motor": {"config": {"phase_inductance": 5.5e-5, "phase_resistance": 0.13, "torque_constant": 0.04,
                      "current_lim": 20.0, "current_control_bandwidth": 1000.0, "pole_pairs": 7}},
 "controller": {"config": {"pos_gain": 20.0, "vel_gain": 0.16, "vel_integrator_gain": 0.32,
                           "vel_limit": 10.0, "enable_vel_limit": true}},
 "encoder": {"config": {"cpr": 8192, "bandwidth": 1000.0}}}}"""
NEWER = ODRIVE.replace('{"axis0": {', '{"axis0.config.encoder_bandwidth": 900.0, "axis0": {').replace(
    '"bandwidth": 1', '"x": 1'
)
VESC = """<?xml version="1.0"?><MCConfiguration><foc_current_kp>0.0138</foc_current_kp>
<foc_current_ki>18.1</foc_current_ki><s_pid_kp>0.004</s_pid_kp><s_pid_ki>0.008</s_pid_ki>
<l_current_max>60</l_current_max><l_max_erpm>1000000</l_max_erpm><si_motor_poles>14</si_motor_poles>
<foc_f_zv>25000</foc_f_zv></MCConfiguration>"""
SIMPLEFOC = """
  motor.torque_controller = TorqueControlType::foc_current;
  motor.PID_velocity.P = 0.5f; motor.PID_velocity.I = 10; // motor.PID_velocity.P = 9; motor.P_angle.P = 1;
  /* motor.PID_velocity.I = 9;
  motor.P_angle.P = 7; */
  motor.LPF_velocity.Tf = 0.005f;
  motor.P_angle.P = 20;
  motor.PID_current_q.P = 3;
  motor.PID_current_q.I= 300;
  driver.voltage_power_supply = 24;
"""
LIMITED = (
    SIMPLEFOC
    + """
  motor.voltage_limit = 8; driver.voltage_limit = 15; motor.PID_velocity.output_ramp = 1000;
  motor.LPF_current_q.Tf = 0.001; motor.PID_velocity.D = 0;
"""
)
BY_VOLTAGE = "// motor.torque_controller = TorqueControlType::foc_current;" + SIMPLEFOC.replace(
    "foc_current", "voltage"
)
OF_RESISTANCE = "BLDCMotor motor = BLDCMotor(11, 5.6, 90);" + BY_VOLTAGE
TWO_MOTORS = SIMPLEFOC + SIMPLEFOC.replace("motor.", "other.")
EPOS_VALUES = {"30A0sub1": 369404, "30A0sub2": 466187, "30A2sub1": "0xBD52B", "30A2sub2": 23963356,
               "30A1sub1": 1500000, "30A1sub2": 780000, "30A1sub3": 16000, "3001sub2": 6000}  # fmt: skip
EPOS = "\n".join(f"[{at}]\nParameterName=x\nParameterValue={value}" for at, value in EPOS_VALUES.items())
SUB = '<CANopenSubObject subIndex="01" actualValue="369404"/>'
XDC = f'<a><CANopenObject index="30A0">{SUB}</CANopenObject></a>'
DEFAULTS = EPOS.replace("Value=369404", "Value=\nDefaultValue=250000").replace(
    "ParameterValue=466187", "ParameterValue=500000\nDefaultValue=1"
)
XDC_DEFAULT = XDC.replace("actual", "default").replace(
    "<CANopenSub", '<CANopenSubObject subIndex="02"/><CANopenSub'
)
PEAK, ERPM = sqrt(3) / 2, 7 * 60 / (2 * pi)
GAINS = [f"control.{stage}.{key}" for stage in ("current", "velocity") for key in ("gain", "integral_time")]
LIMITS = {"encoder.filter_time": "1 ms", "limits.current_rate": "1 A/s"}
PID = {"control.position.integral_time": "1 s", "control.position.derivative_time": "1 s"}


def without(stage: str) -> Design:
    """The base without a stage; what feeds its place then has a gain of that place's unit."""
    if not stage:
        return BASE
    tree = {key: value for key, value in design_tree(BASE).items() if key not in ("requirement", "objects")}
    del tree["control"][stage]
    if stage != "position":
        outer, unit = ("velocity", "V*s/rad") if stage == "current" else ("position", "A/rad")
        tree["control"][outer] = {"gain": f"1 {unit}"}
    return design_from_tree(tree, "base")


def taken(folder: Path, text: str, base: Design) -> Imported:
    """What a settings file of this text makes of a design."""
    (folder / "settings").write_text(text)
    return import_controller_file(folder / "settings", base)


@pytest.mark.parametrize(
    ("text", "stage", "wanted", "more", "left"),
    [  # turn/s per turn, N m per turn/s over N m per A peak, tracking critically damped at 8 kHz
        (ODRIVE, "", (0.11, 5.5e-5 / 0.13, PEAK * 0.16 / 0.04 / (2 * pi), 0.5),
         {"control.position.gain": 20, "control.period": 1.25e-4, "limits.speed": 20 * pi,
          "encoder.bandwidth": 1000}, "config.pole_pairs, axis0.controller.config.enable_vel_limit"),
        (NEWER, "", (0.11,), {"encoder.bandwidth": 900}, ".enable_vel_limit, axis0.encoder.config.x"),
        # the firmware's own: 1000 rad/s
        (ODRIVE.replace('"bandwidth": 1', '"x": 1'), "", (0.11,), {"encoder.bandwidth": 1000}, "config.x"),
        # iq = error in electrical rpm times s_pid_kp/20 times l_current_max
        (VESC, "", (0.0138 * sqrt(3) / PEAK, 0.0138 / 18.1, PEAK * ERPM * 0.004 / 20 * 60, 0.5),
         {"limits.peak_current": PEAK * 60}, ": foc_f_zv"),
        # lo_current_max = 0.5 * 60, and m_iq_set = output * lo_current_max * 0.5
        (VESC.replace("<foc_f_", "<l_current_max_scale>0.5</l_current_max_scale><foc_f_"), "",
         (0.0138 * 2, 0.0138 / 18.1, PEAK * ERPM * 0.004 / 20 * 15, 0.5), {"limits.peak_current": PEAK * 30},
         ": foc_f_zv"),
        (SIMPLEFOC, "", (6, 0.01, PEAK * 0.5, 0.05),
         {"encoder.filter_time": 0.005, "limits.voltage": sqrt(3) * 12}, ": none"),
        (LIMITED, "", (6,), {"limits.voltage": sqrt(3) * 8, "limits.current_rate": PEAK * 1000}, ": none"),
        (LIMITED.replace("_limit = 8", "_limit = 20").replace("driver", "other"), "", (6,),
         {"limits.voltage": 15}, ": none"),  # a phase between 0 and 15 V
        (LIMITED.replace("_limit = 8", "_limit = 20") + "driver.voltage_limit = 30;", "", (6,),
         {"limits.voltage": 24}, ": none"),
        (SIMPLEFOC.replace("foc_current", "dc_current"), "", (6, 0.01), {}, ": none"),
        # u_q = R i_q + U_emf of a phase
        (OF_RESISTANCE, "current", (None, None, sqrt(3) * 0.5 * 5.6, 0.05), {}, "PID_current_q.I"),
        (OF_RESISTANCE.replace("5.6", "NOT_SET"), "current", (None, None, sqrt(3) * 0.5, 0.05), {}, ".I"),
        (BY_VOLTAGE, "current", (None, None, sqrt(3) * 0.5, 0.05), {}, "PID_current_q.P, PID_current_q.I"),
        # uV/A and uV/(A ms); uA s/rad and uA/rad; uA/rad, uA/(rad s) and uA s/rad
        (EPOS, "position", (0.369404, 369.404 / 466187, 0.775467, 775467 / 23963356),
         {"control.velocity.every": 10, "control.period": 4e-5}, "0x30A1.01, 0x30A1.02, 0x30A1.03"),
        (EPOS, "velocity", (0.369404,),
         {"control.position.gain": 1.5, "control.position.integral_time": 1.5 / 0.78,
          "control.position.derivative_time": 0.016 / 1.5}, ": 0x30A2.01, 0x30A2.02"),
        (XDC, "position", (0.369404,), {}, ": none"),
        (DEFAULTS, "position", (0.25, 250.0 / 500000), {}, "0x30A1.03"),  # default where there is no value
        (XDC_DEFAULT, "position", (0.369404,), {}, ": none"),
    ],
)  # fmt: skip
def test_each_makers_gains_in_the_units_of_the_model(text, stage, wanted, more, left, tmp_path) -> None:
    result = taken(tmp_path, text, without(stage))
    expected = {key: value for key, value in zip(GAINS, wanted, strict=False) if value is not None} | more
    found = {key: parameter_value(result.design, key) for key in expected}
    assert found == pytest.approx(expected, rel=1e-12)
    assert all(result.design.parameters[key].source for key in expected if key != "control.period")
    assert read_design_text(write_design(result.design), result.design.origin) == result.design
    assert result.notes[-1].endswith(left)


@pytest.mark.parametrize(("text", "kept"), [
    (ODRIVE, ()),
    (VESC, ("integral_time", "derivative_time", "derivative_filter", "friction_feedforward")),
    (SIMPLEFOC, ()),
    (SIMPLEFOC + "motor.P_angle.I = 40; motor.P_angle.D = 0.2;", ("integral_time", "derivative_time")),
])  # fmt: skip
def test_what_no_such_controller_has_goes(text: str, kept: tuple[str, ...], tmp_path: Path) -> None:
    """A position controller that is a P alone, as SimpleFOC's is until its I and D are set; no notch."""
    base = with_overrides(BASE, PID | {
        "control.position.derivative_filter": "1 ms", "control.position.friction_feedforward": "0.1 A",
        "control.velocity.filter": [{"kind": "notch", "frequency": "90 Hz", "width": "20 Hz"}],
    })  # fmt: skip
    result = taken(tmp_path, text, base)
    loop = result.design.controller.position
    assert result.design.controller.velocity.filters == ()
    assert result.notes.count("control.velocity.filter is left out: no such controller has it") == 1
    for key, value in (("integral_time", loop.integral_time_s), ("derivative_time", loop.derivative_time_s),
                       ("derivative_filter", loop.derivative_filter_s),
                       ("friction_feedforward", loop.friction_feedforward)):  # fmt: skip
        assert bool(value) == (key in kept)
        gone = any(f"control.position.{key} is left out" in note for note in result.notes)
        assert gone == (key not in kept)
    if "P_angle.I" in text:  # speed = 20 e + 40 int e + 0.2 de/dt
        assert (loop.integral_time_s, loop.derivative_time_s) == pytest.approx((20 / 40, 0.2 / 20))


@pytest.mark.parametrize(("text", "stage", "words"), [
    (BY_VOLTAGE, "", r"by voltage; allowed: a design without \[control.current\]"),
    (TWO_MOTORS, "", "several motors: motor, other; allowed: the lines of one of them"),
    (ODRIVE.replace('{"phase_i', '{"motor_type": 2, "phase_i'), "", "motor_type = 2: allowed: 0"),
    (EPOS, "", "no velocity loop inside its position loop"),
    (ODRIVE.replace("20.0, ", "20.0, x", 1), "", "line 3"),
    # a base that fits by itself is not to blame: a new stage, a limit of the file
    (VESC, "velocity", "control.velocity.gain is of settings: s_pid_kp = 0.004, l_current_max = 60"),
    (EPOS + "\n[3001sub1]\nParameterValue=7000", "velocity",
     "limits.peak_current is of settings: 0x3001.02 = 6000"),
])  # fmt: skip
def test_what_the_design_cannot_hold_is_refused(text: str, stage: str, words: str, tmp_path: Path) -> None:
    refused(taken, tmp_path, text, without(stage), match=words)


RATED = {"limits.continuous_current": "1 A", "limits.peak_current": "2 A"}
TICKS = {"control.period": "100 us", "control.computing_delay": "50 us"}
NO_CONSTANT = ODRIVE.replace('"torque_constant": 0.04,', "").replace('"cpr": 8192', '"use_index": true')
NEWEST = NO_CONSTANT[:-1] + ', "inc_encoder0": {"config": {"cpr": 4000}}}'
HARD = """{"axis0": {"config": {"motor": {"current_soft_max": 20.0, "current_hard_max": 36.0}}}}"""
OFF = f"{EPOS}\n[30A1sub4]\nParameterValue=0"
STAYS, GONE = "not taken, {} stays as it is", ": none, {} is left out"


@pytest.mark.parametrize(("text", "stage", "changes", "note", "key", "wanted"), [
    # a constant of 0, an infinite gain, no poles, no gain at all: the design keeps what it has
    (ODRIVE.replace('constant": 0.04', 'constant": 0'), "", {}, STAYS, "control.velocity.gain", ...),
    (ODRIVE.replace("20.0", '"inf"', 2), "", {}, STAYS, "control.position.gain", ...),
    (ODRIVE.replace("20.0", "NaN", 2), "", {}, STAYS, "control.position.gain", ...),
    (VESC.replace(">14<", ">0<"), "", {}, STAYS, "control.velocity.gain", ...),
    (VESC.replace("0.004", "0").replace("0.008", "0"), "", {}, STAYS, "control.velocity.integral_time", ...),
    # an integral gain of 0, no limit, no filter: nothing of the base stays in its place
    (ODRIVE.replace("0.32", "0"), "", {}, GONE, "control.velocity.integral_time", None),
    (EPOS.replace("780000", "0"), "velocity", PID, GONE, "control.position.integral_time", None),
    (EPOS.replace("16000", "0"), "velocity", PID, GONE, "control.position.derivative_time", None),
    (SIMPLEFOC.replace("0.005f", "0"), "", LIMITS, GONE, "encoder.filter_time", None),
    (ODRIVE.replace("10.0,", "Infinity,"), "", {}, GONE, "limits.speed", None),
    (LIMITED.replace("1000", "0"), "", LIMITS, GONE, "limits.current_rate", None),
    # the drive gives no more than its limit for any time, so the motor's rating is never reached
    (SIMPLEFOC + "motor.current_limit = 0.9;", "", RATED, "{}: 1 A dc is lowered to limits.peak_current",
     "limits.continuous_current", PEAK * 0.9),
    (SIMPLEFOC + "motor.current_limit = 0.9;", "", RATED, "", "limits.peak_current", PEAK * 0.9),
    (SIMPLEFOC + "motor.current_limit = 1.5;", "", RATED, "", "limits.continuous_current", 1.0),
    # what the file does not say: ticks of the new period, a derivative's filter; a feed-forward that is off
    (EPOS, "velocity", TICKS, "{} = 5e-05 s stays as it is: 1.25 ticks of the new period, 0.5 of the old",
     "control.computing_delay", 5e-5),
    (EPOS, "velocity", PID, "control.position.derivative_filter stays as it is", "control.period", 4e-5),
    (OFF, "velocity", {}, ": 0x30A2.01, 0x30A2.02", "control.period", 4e-5),
    # a gain in torque without the constant that turns it into amperes; the newest firmware's encoder
    (NEWEST, "", {}, "vel_gain: needs axis0.motor.config.torque_constant for control.velocity.gain",
     "encoder.counts_per_rev", 4000),
    (HARD, "", {}, ": axis0.config.motor.current_hard_max", "limits.peak_current", PEAK * 20),
])  # fmt: skip
def test_what_a_file_does_to_a_key_is_told(text, stage, changes, note, key, wanted, tmp_path) -> None:
    base = with_overrides(without(stage), changes)
    result = taken(tmp_path, text, base)
    assert sum(one.endswith(note.format(key)) for one in result.notes) == 1 or not note
    assert key in base.parameters or wanted is not None
    assert (key in result.design.parameters) == (wanted is not None)
    if wanted is not None:
        wanted = parameter_value(base, key) if wanted is ... else wanted
        assert parameter_value(result.design, key) == pytest.approx(wanted, rel=1e-15)
    if text is HARD:  # the name that stands in the file
        assert result.design.parameters[key].source.endswith("axis0.config.motor.current_soft_max = 20.0")
    slower = result.design.controller.period_s != base.controller.period_s
    assert any("delay" in one for one in result.notes) == slower


def test_what_a_sketch_says_of_its_motor_is_told_where_it_applies(tmp_path: Path) -> None:
    """By voltage the resistance and the KV count; with a current loop neither does, but its filter."""
    by_voltage = (
        "KV_rating = 90: by voltage the library adds the back-EMF",
        "phase_resistance = 5.6: by voltage",
    )
    by_current = ("LPF_current_q.Tf = 0.001: the filter of the measured current",)
    motor = "BLDCMotor motor = BLDCMotor(11, 5.6, 90);"
    for text, stage, words in ((OF_RESISTANCE, "current", by_voltage), (motor + LIMITED, "", by_current)):
        notes = taken(tmp_path, text, without(stage)).notes
        for start in by_voltage + by_current:
            assert any(note.startswith(start) for note in notes) == (start in words)


def test_the_command_says_what_it_took_and_what_it_left(tmp_path, capsys) -> None:
    (tmp_path / "vesc.xml").write_text(VESC)
    out = tmp_path / "mine.toml"
    assert main(["objects", "import", str(tmp_path / "vesc.xml"), "--out", str(out)]) == 0
    said = capsys.readouterr().err
    for words in ("s_pid_kp = 0.004, l_current_max", "limits.speed = ", "of 8 settings: foc_f_zv"):
        assert words in said
    assert load_design(out).controller.velocity.gain > 0.0


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
    (
        ",",
        "# omega [rad/s],Re,Im",
        (OMEGA, L.real, L.imag),
    ),  # as numpy.savetxt has it, read as Hz, dB, deg before
    (" ", "! bench\n! f_mHz abs phase_mrad", (HERTZ * 1e3, np.abs(L), np.angle(L) * 1e3)),
    (";", "Made by;a bench;\nf;Mag;Phase\n[1/min];[dB];[rev]", (HERTZ * 60.0, DB, DEG / 360.0)),
    ("\t", "FREQ RAD/S\tMAG DB\t\u00b0", (OMEGA, DB, DEG)),
]


def recorded(folder: Path, text: str) -> RecordedResponse:
    """The response that a table in text is."""
    (folder / "r.csv").write_text(text, encoding="utf-8")
    return read_response(folder / "r.csv")


@pytest.mark.parametrize(("cut", "head", "columns"), TABLES)
def test_every_spelling_of_a_table(tmp_path, cut, head, columns):
    rows = [cut.join(f"{x:.12g}" for x in row) for row in zip(*columns, strict=True)]
    rows = [row.replace(".", ",") for row in rows] if cut in ";\t" else rows
    read = recorded(tmp_path, "# bench\n" + "\n".join(filter(None, [head, *rows[::-1]])))
    np.testing.assert_allclose(read.frequency_hz, HERTZ, rtol=1e-11)
    np.testing.assert_allclose(read.response, L, rtol=1e-10)
    assert np.isnan(read.deviation).all()


@pytest.mark.parametrize("text", PAGE["read as 3 - 4j at 5 Hz"])
def test_the_page_reads_the_same(tmp_path, text):
    read = recorded(tmp_path, text)
    at = np.isclose(read.frequency_hz, 5.0)
    np.testing.assert_allclose(read.response[at], [3.0 - 4.0j], rtol=1e-12)


@pytest.mark.parametrize("text", PAGE["refused"])
def test_the_page_refuses_the_same(tmp_path, text):
    refused(recorded, tmp_path, text)


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


def test_other_files_of_columns(tmp_path: Path) -> None:
    """JSON, Parquet, a text that is no UTF-8, and what get(frd) of MATLAB is, whose unit is a text."""
    columns = {"f [\u00b5Hz]": (HERTZ * 1e6).tolist(), "gain_db": DB.tolist(), "phase (\u00b0)": DEG.tolist()}
    (tmp_path / "r.json").write_text(json.dumps({"bench": columns}), encoding="utf-8")
    pyarrow.parquet.write_table(pyarrow.table(columns), tmp_path / "r.parquet")
    rows = "\n".join(",".join(map(repr, row)) for row in zip(*columns.values(), strict=True))
    (tmp_path / "r.csv").write_text(f"{','.join(columns)}\n{rows}", encoding="cp1252")
    for unit, time, values in (("rad/TimeUnit", "minutes", 60.0 * OMEGA), ("kHz", "seconds", HERTZ / 1e3)):
        held = {
            "Frequency": values,
            "FrequencyUnit": unit,
            "TimeUnit": time,
            "ResponseData": L.reshape(1, 1, 4),
        }
        scipy.io.savemat(tmp_path / f"{time}.mat", {"g": held | {"Ts": 0.0}})
    for file in tmp_path.iterdir():
        read = read_response(file)
        np.testing.assert_allclose(read.frequency_hz, HERTZ, rtol=1e-12)
        np.testing.assert_allclose(read.response, L, rtol=1e-12)


@pytest.mark.parametrize("of", ["T", "S"])
def test_closed_loops_and_how_their_errors_grow(tmp_path, of):
    value = {"T": lambda loop: loop / (1.0 + loop), "S": lambda loop: 1.0 / (1.0 + loop)}[of]
    columns = (HERTZ, value(L).real, value(L).imag, np.full(4, 1e-7))
    rows = "\n".join(",".join(f"{x!r}" for x in row) for row in np.transpose(columns).tolist())
    read = recorded(tmp_path, "f,real,imag,sigma\n" + rows).as_loop(of)
    np.testing.assert_allclose(read.response, L, rtol=1e-12)
    near = L * (1.0 + read.deviation)  # a loop so far off is as far off when closed as the file says
    np.testing.assert_allclose(np.abs(value(near) / value(L) - 1.0), 1e-7, rtol=1e-4)


def repeated(tmp_path: Path, count: int, head: str = "", more: str = "") -> RecordedResponse:
    rng = np.random.default_rng(count)
    f = np.tile(np.geomspace(1.0, 100.0, 40), count)
    z = (1.0 - 2.0j) / f * (1.0 + 0.02 * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size)) / 2**0.5)
    rows = "\n".join(
        f"{a!r},{b.real!r},{b.imag!r}{more}" for a, b in zip(f.tolist(), z.tolist(), strict=True)
    )
    return recorded(tmp_path, f"f_hz,re,im{head}\n{rows}")


@pytest.mark.parametrize("count", [2, 3, 10])
def test_rows_of_one_frequency_are_repeats(tmp_path: Path, count: int) -> None:
    """Their mean has the noise over sqrt(n), as their scatter says, or as each row does."""
    for read in (repeated(tmp_path, count), repeated(tmp_path, count, ",deviation", ",0.02")):
        assert read.frequency_hz.size == 40
        error = np.abs(read.response * read.frequency_hz / (1.0 - 2.0j) - 1.0)
        assert np.sqrt(np.mean(error**2)) == pytest.approx(0.02 / count**0.5, rel=0.25)
        assert read.deviation == pytest.approx(np.full(40, 0.02 / count**0.5), rel=0.5)
        assert np.mean(error < read.radius) >= 0.95
        assert f"rows that repeat a frequency are averaged ({40 * count - 40})" in read.read_as
    assert repeated(tmp_path, count).noise == "scatter of repeats"


def test_a_row_copied_tells_no_noise(tmp_path: Path) -> None:
    read = recorded(tmp_path, "f_hz,re,im\n" + 2 * "1,2,3\n2,1,2\n3,1,1\n")
    assert read.response.tolist() == [2 + 3j, 1 + 2j, 1 + 1j]
    assert np.isnan(read.deviation).all()
    assert read.noise == ""


@pytest.mark.parametrize(("text", "words"), [
    ("f,gain,phase_deg\n1,2,3\n2,1,4", "says no unit; allowed: gain_db or gain_ratio"),
    ("f,gain_db,phase\n1,2,-3\n2,1,-4", "allowed: phase_deg or phase_rad"),
    ("f,gain_db\n1,2\n2,1", "no phase in the columns f, gain_db"),
    ("f,re,im\n1,2,3\n1,2,3", "every row is at 1 Hz; allowed: two frequencies or more"),
    ("f,re,im\n0,2,3\n1,2,3", "frequencies above 0"),
    ("f,re,im,coherence\n1,2,3,-1.2\n2,2,3,1", "a coherence of -1.2; allowed: 0 to 1"),
    ("f,re,im,coherence\n1,2,3,98\n2,2,3,99", "of 98; allowed: 0 to 1, a ratio and not per cent"),
    ("f,re,im\n1,2,3\n2,2", "2 columns in line 3, 3 in the first"),
    ("[motor]\nR = 1", "a heading such as f_hz,gain_db,phase_deg"),
    ("# bench\nf,re,im\n1,2,3\n\n2,x,1\n3,1,1", 'line 5: "x" is no number'),
    ("f,re,im\n-1,2,3\n1,2,3\n2,2,2", "each at a frequency above 0 Hz"),
    ("f,gain_db,gain_db,phase_deg\n1,2,3,-4\n2,1,3,-5", "contradicts the magnitude"),
    ("f,re,im,gain_db\n1,3,4,0\n2,3,4,0", '"gain_db" contradicts the magnitude'),
    ("f,re,im,phase_deg\n1,3,4,-53.13\n2,3,4,-53.13", '"phase_deg" contradicts the phase'),
    ("f_hz,omega,re,im\n1,6,3,4\n2,12,3,4", '"omega" contradicts the frequency'),
    ("f,freq,re,im\n10,1.59155,3,4\n20,3.1831,3,4", '"freq" contradicts the frequency'),
    ("f,re,im,std_abs\n1,3,4,1\n2,3,4,1", "deviations in abs; allowed: one over the size"),
    ("f,re,im,std,sigma\n1,3,4,1,1\n2,3,4,1,1", "deviations in no unit and no unit"),
    ("f,re,im\n1,0,0\n2,2,1", "a value that is 0"),
    ("f_hz,gain_db,Phase [Grad]\n1,2,-90\n2,1,-99", 'Grad]": its unit is not known; allowed: deg or rad'),
    ("f_mhz,re,im\n1,2,3\n2,2,2", 'f_mhz": its unit is not known; allowed: Hz, kHz, rad/s or 1/min'),
    ("f [1/s],re,im\n1,2,3\n2,2,2", "its unit is not known"),
    ("f_hz,gain_db,phase_lag_deg\n1,2,90\n2,1,99", 'lag_deg" is turned round; allowed: a gain, a phase'),
    ("f_hz,attenuation_db,phase_deg\n1,2,90\n2,1,99", "is turned round"),
    ("f_hz,gain_db,phase_deg\n1,2,9;\n2,1,9;", "is no row of numbers"),
    ("f_hz,re,im\n1,2,3,\n2,2,3,", "3 columns in line 1, 4 in the rows below"),
    ("", "is empty"),
])  # fmt: skip
def test_what_is_no_response_is_refused(tmp_path, text, words):
    refused(recorded, tmp_path, text, words=("r.csv", words))


def test_a_deviation_counts_in_its_unit(tmp_path):
    """Of many values with a complex error of 2 % rms: the deviations of their dB and deg."""
    n = np.random.default_rng(1).normal(size=(2, 400_000))
    values = 1.0 + 0.02 * (n[0] + 1j * n[1]) / np.sqrt(2.0)
    std = np.std(20.0 * np.log10(np.abs(values))), np.std(np.degrees(np.angle(values)))
    for names, told in (
        ("Deviation (dB)", std[:1]),
        ("std_deg", std[1:]),
        ("gain_std_db,phase_std_deg", std),
        ("sigma_rad", (np.radians(std[1]),)),
        ("deviation_percent", (2.0,)),
    ):
        row = ",".join(map(str, told))
        read = recorded(tmp_path, f"f,re,im,{names}\n1,3,4,{row}\n2,3,4,{row}\n")
        np.testing.assert_allclose(read.deviation, 0.02, rtol=0.01)
        np.testing.assert_allclose(read.radius, 0.02 * np.sqrt(np.log(100.0)), rtol=0.01)


@pytest.mark.parametrize(("text", "words"), [
    ("1,2,-3\n2,1,-4", 'without a heading, read as frequency "f_hz" in Hz, magnitude "gain_db" in dB, '),
    ("Frequency,re,im,error\n1,2,3,1\n2,-1,4,1", '"Frequency" in Hz (it says no unit), real part "re"'),
    ("Frequency,re,im,error\n1,2,3,1\n2,-1,4,1", '; not read: "error"'),
    ("omega,gain,phase_rad\n1,2,3\n2,-1,4", '"omega" in rad/s, magnitude "gain" in dB (it says no unit)'),
    ("w,re,im,coherence\n1,2,3,.9\n2,2,3,.9", "coherence tells no noise without averages (--averages N)"),
    ("f,re,re_std,im,,\n1,2,1,3,,\n2,-1,1,4,,", '"im"; not read: "re_std"'),
    ("f_hz,omega,re,im\n1,6.2832,3,4\n2,12.5664,3,4", 'imaginary part "im"; not read: "omega"'),
    ("f,w (rad/s),re,im\n1,6.2832,3,4\n2,12.5664,3,4", '; not read: "w (rad/s)"'),
    ("f,freq,re,im\n1,6.2832,3,4\n2,12.5664,3,4", '; not read: "freq"'),
    ("f,f_step_hz,re,im\n1,0.5,3,4\n2,1,3,4", '; not read: "f_step_hz"'),
    ("f,re,im,gain_db\n1,3,4,13.98\n2,3,4,13.98", 'imaginary part "im"; not read: "gain_db"'),
])  # fmt: skip
def test_how_the_columns_are_taken_is_told(tmp_path, text, words):
    assert words in recorded(tmp_path, text).read_as


def test_a_row_at_0_hz_is_left_out_and_averages_want_a_coherence(tmp_path):
    read = recorded(tmp_path, "f_hz,re,im\n0,9,0\n1,2,3\n2,2,2\n")
    assert (read.frequency_hz.tolist(), read.left_out) == ([1.0, 2.0], 1)
    refused(read_response, tmp_path / "r.csv", 8, words="averages: allowed with a column of coherence")
