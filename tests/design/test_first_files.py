"""What a first design file is written with from data sheets, and what it is answered with."""

import numpy as np
import pytest

from actuator_lti.design import (
    Design,
    design_hash,
    load_design,
    read_design_text,
    warnings_of,
    with_values,
    write_design,
)
from actuator_lti.design.writing import write_changed
from actuator_lti.loops import assemble_loops
from analyses.linear.loop_figures import all_loop_figures
from reports.sections.margins import by_itself_notes, response_row
from tests.refusals import mistakes, refused

DRIVE = """
[design]
name = "first"
[motor]
resistance = "5.9 ohm"
inductance = "0.45 mH"
torque_constant = "12.7 mNm/A"
back_emf_constant = "1.33 V/1000 rpm"
rotor_inertia = "4.1e-7 kgm2"
[[gear]]
name = "R22"
ratio = 19.2
[limits]
voltage = "12 V"
[control]
period = "1 ms"
computing_delay = "0.1 ms"
"""


def with_law(text: str) -> Design:
    """The drive with a law of its position loop."""
    return read_design_text(f"{DRIVE}{LAW}{text}")


def test_matrices_of_one_row_are_read_in_the_continuous_part_as_in_the_law() -> None:
    flat = "A = [[0.5]]\nB = [[1]]\nC = [2]\nD = [3]\n[control.position.law.continuous]\n"
    flat += "A = [[-5000, 0], [1, 0]]\nB = [[1], [0]]\nC = [-7, 9]\nD = [253]\n"
    nested = flat.replace("[2]", "[[2]]").replace("[3]", "[[3]]")
    nested = nested.replace("[-7, 9]", "[[-7, 9]]").replace("[253]", "[[253]]")
    assert with_law(nested).controller == with_law(flat).controller


def test_what_could_not_be_read_is_not_shown_where_it_is_asked_for_again() -> None:
    """Names that are none, in a drive without gears and without tolerances, which they could be among."""
    bare = DRIVE.replace('[[gear]]\nname = "R22"\nratio = 19.2\n', "[load]\nlocking_gear = 3\n")
    text = mistakes(f'{bare}[[correlation]]\nsecond = "motor.resistance"\ncoefficient = 0.5\n')
    assert "object at" not in text
    for words in ("load.locking_gear = 3: allowed: text", "locking_gear: is no gear", "first: missing"):
        assert words in text


LAW = '[control.position.law]\ninputs = ["error"]\n'
STATE = "A = [[0.5]]\nB = [[1]]\nC = [0]\n"
CURRENT = '[control.current]\ngain = "1 V/A"\n'
NO_BANDWIDTH, ANGLE = "a bandwidth is written in Hz or rad/s", "write rev or rad into it"
# 1024 ppr are of one maker 4096 counts after quadrature, of another 1024
COUNTS = 'write "1024 lines" (4096 counts) or "1024 counts"'
TF = "num = [185.0, -150.0]\nden = [1.0, -0.65]\n"


@pytest.mark.parametrize(("more", "words", "times"), [
    (f"{LAW}[control.position.law.continuous]\nD = [3]", "law.D: missing; allowed: the law as", 1),
    *((LAW + zero, "the law gives nothing", 1)
      for zero in ("D = [0]", "D = [[0]]", STATE, f"{STATE}D = [0]")),
    (LAW + TF, "tf2ss(num,den)", 2),
    (f"{LAW}D = [1]\n[control.position.law.continuous]\n{TF}", "tf2ss(num,den)", 2),
    (f"{LAW}D = [1]\nkp = 3", "a number of D", 1),
    *((f'{CURRENT}[control.velocity]\ngain = "{speed}"', NO_BANDWIDTH, 1)
      for speed in ("2400 rpm", "40 rev/s", "250 1/s")),
    # at 2^19 counts it is 9.179 A s/rad, not 1.1e-4
    (f'[encoder]\ncounts_per_rev = "19 bit"\n{CURRENT}[control.velocity]\ngain = "1.1e-4 A/(cnt/s)"',
     "of 524288 counts 9.179 A*s/rad", 1),
    (f'{CURRENT}[control.velocity]\ngain = "1.1e-4 A/(cnt/s)"', "one is 2 pi/counts_per_rev rad", 1),
    # the motor's encoder counts nothing of the output
    *((f'[encoder]\ncounts_per_rev = 4000\n{output}', "of 4000 counts", 0)
      for output in ('[instruments]\noutput_angle_noise = "1 count"', '[command]\nrate = "4e5 counts/s"',
                     f'{CURRENT}[control.velocity]\ngain = "1 A/(cnt/s)"\nsensor = "output"')),
    ('[encoder]\ncounts_per_rev = 4000\n[instruments]\nangle_noise = "1 count"',
     "of 4000 counts 0.001571 rad", 1),
    *((f'[encoder]\ncounts_per_rev = "1024 {word}"', COUNTS, 1)
      for word in ("ppr", "CPT", "pulses", "CPR")),
    # makers state it at the output as often as at the motor
    (f'{CURRENT}[control.position]\ngain = "50 Nm/rev"', "over kM, and over the ratio squared", 1),
    ('[command]\nacceleration = "1500 1/s²"', ANGLE, 1),
    ('[command]\nrate = "100 1/s"', ANGLE, 1),
    ('[load]\ninertia = "3 counts"', "counts_per_rev", 0),
])  # fmt: skip
def test_what_a_first_file_is_answered_with(more: str, words: str, times: int) -> None:
    """Nothing is said of sizes of matrices that are not there."""
    text = mistakes(f"{DRIVE}{more}\n")
    assert text.count(words) == times
    assert "other sizes" not in text
    assert text.count("\n") == max(times, 1) - 1


def motor(constants: str, **values: str) -> str:
    """The drive with another motor."""
    lines = "\n".join(f'{key} = "{value}"' for key, value in values.items())
    head, tail = DRIVE.split("[[gear]]")
    before = head.split("torque_constant")[0]
    own = f'constants = "{constants}"\nrotor_inertia = "1 gcm2"\n{lines}\n'
    return f"{before}{own}[[gear]]{tail}"


@pytest.mark.parametrize(("constants", "values"), [
    ("rms-line", {"back_emf_constant": "1.8 Vrms/krpm"}),
    ("peak-phase", {"back_emf_constant": "100 KV"}),
    ("dc", {"back_emf_constant": "100 KV"}),
])  # fmt: skip
def test_a_missing_constant_is_answered_with_the_number_that_is_then_taken(constants, values) -> None:
    answer = " ".join(mistakes(motor(constants, **values)).split()[-2:])
    design = read_design_text(motor(constants, **values, torque_constant=answer))
    same = design.effective_motor
    # six digits are told
    assert same.torque_constant_Nm_A == pytest.approx(same.back_emf_constant_Vs_rad, rel=1e-5)


@pytest.mark.parametrize(("constants", "kM", "kE"), [  # amplitudes of a phase: kM i = 1.5 k i, u = k w
    ("rms-line", "0.03 Nm/Arms", f"{0.03 / 3**0.5!r} V*s/rad"),
    ("peak-phase", "0.09 Nm/A", "0.06 V*s/rad"),
    ("dc", "0.09 Nm/A", "0.09 V*s/rad"),
])  # fmt: skip
def test_a_back_emf_constant_that_a_sheet_does_not_state_is_its_torque_constant(constants, kM, kE) -> None:
    """By energy, kM i w = kE w i, in the convention that is stated; without one kE would tell a wrong one."""
    short = read_design_text(motor(constants, torque_constant=kM))
    whole = read_design_text(motor(constants, torque_constant=kM, back_emf_constant=kE))
    volts = short.effective_motor.back_emf_constant_Vs_rad
    assert volts == pytest.approx(whole.effective_motor.back_emf_constant_Vs_rad, rel=1e-12)
    again = with_values(read_design_text(write_design(short)), {"motor.torque_constant": 0.02})
    assert again.effective_motor.back_emf_constant_Vs_rad == again.effective_motor.torque_constant_Nm_A
    number = f"{float(kE.split()[0]):g} V*s/rad"
    said = [line for line in warnings_of(short) if line.startswith("motor.back_emf_constant: not given")]
    assert [number in line for line in said] == [True]
    assert not any(line.startswith("motor.back_emf") for line in warnings_of(whole))
    text = (
        motor(constants, torque_constant=kM).replace(f'constants = "{constants}"\n', "").replace("Arms", "A")
    )
    assert "motor.back_emf_constant: missing" in mistakes(text)


def test_kv_of_a_motor_per_phase_is_line_line_and_a_constant_missing_behind_a_screw_is_told_at_the_shaft():
    """kM = 8.27/KV in N m per ampere of a phase (ODrive's documentation): kE and kM are one constant."""
    text = motor("peak-phase", torque_constant=f"{8.27 / 82} N*m/A", back_emf_constant="82 KV")
    same = read_design_text(text).effective_motor
    assert same.back_emf_constant_Vs_rad == pytest.approx(same.torque_constant_Nm_A, rel=1e-4)
    text = DRIVE.replace("[motor]", 'axis = "linear"\n[screw]\nlead = "10 mm"\n[motor]')
    answer = mistakes(text.replace('back_emf_constant = "1.33 V/1000 rpm"\n', ""))
    assert answer.endswith("in SI, 0.0127 V*s/rad")


# 44 oz-in/A rms is 0.31071 N m/A rms; over sqrt(3) it is kE in V rms line-line
KE = 44 * 0.0070615518 / 3**0.5


@pytest.mark.parametrize(
    ("written", "wanted", "unit"),
    [("23 Vrms/krpm", KE * 1000 * np.pi / 30, "Vrms/krpm"), ("415 rpm/V", 30 / np.pi / KE, "rpm/V")],
)
def test_constants_that_disagree_are_told_as_they_are_written(written: str, wanted: float, unit: str) -> None:
    text = mistakes(motor("rms-line", torque_constant="44 oz-in/Arms", back_emf_constant=written))
    assert f"({written}): allowed: within 10 %" in text
    assert "(44 oz-in/Arms) has it" in text
    number, _, same = text.partition("10 % of ")[2].partition("(")[2].partition(")")[0].partition(" ")
    assert same == unit
    assert float(number) == pytest.approx(wanted, rel=1e-3)  # four digits are told


SAME, WARM = "the ratio is that", "sheets give kM warm"
TAKE = "here 0.889): take one and write the other"
OF_A_PHASE = 'with motor.constants = "peak-phase" kE is kM over 3/2 in SI'
STEPPER = 'with "dc" of a stepper those of a phase'


@pytest.mark.parametrize(
    ("constants", "kM", "kE", "said", "not_said"),
    [  # kM over kE: 0.889 of sqrt(3), 0.889 of one, 0.866 at 8.27/KV of peak amperes
        ("rms-line", "1.47 Nm/A", "100 V/1000 min-1", TAKE, SAME),
        ("dc", "89.4 mNm/A", "95 rpm/V", TAKE, SAME),
        ("dc", "82.7 mNm/A", "100 KV", f'{SAME} of motor.constants = "peak-phase"', TAKE),
        # a kE of peak volts is sqrt(2) too large; magnets warm to 0.8 to 0.95
        ("dc", "0.075 Nm/A", "0.1 V*s/rad", "within 10 %", WARM),
        ("dc", "0.085 Nm/A", "0.1 V*s/rad", "here 0.85", "the ratio is sqrt(2)"),
        ("dc", "0.085 Nm/A", "0.1 V*s/rad", WARM, "the ratio is sqrt(2)"),
        ("dc", f"{0.1 / 2**0.5} Nm/A", "0.1 V*s/rad", "the ratio is sqrt(2), rms against peak", WARM),
        # of peak amperes and volts of a phase kE is kM over 3/2
        ("peak-phase", "0.75 Nm/A", "0.75 V*s/rad", OF_A_PHASE, "in SI the two are one"),
        ("dc", "1 Nm/A", "1 V*s/rad/phase", STEPPER, OF_A_PHASE),
    ],
)
def test_a_cause_is_told_only_where_its_ratio_is_near(constants, kM, kE, said, not_said) -> None:
    text = mistakes(motor(constants, torque_constant=kM, back_emf_constant=kE))
    assert (said in text, not_said in text) == (True, False)


@pytest.mark.parametrize("key", ["magnet_pitch", "pole_pitch"])
def test_a_linear_motor_is_asked_for_the_period_of_its_cogging(key: str) -> None:
    """2 pi/24 mm."""
    linear = load_design("emps").with_values
    given = {"motor.cogging": "10 N", "limits.speed": "0.1 m/s"}
    refused(linear, given, words=("cogging_periods: missing; motor.cogging needs it", "24 mm"))
    periods = linear(given | {"motor.cogging_periods": "24 mm"}).motor.cogging_periods
    assert periods == pytest.approx(2 * np.pi / 0.024, rel=1e-14)
    refused(linear, {f"motor.{key}": "24 mm"}, words='takes "24 mm" too: 261.799 rad/m')
    one = linear(given | {"motor.cogging_periods": "1 rad/m"})
    assert read_design_text(write_design(one), one.origin) == one


@pytest.mark.parametrize("stated", ["dc", "rms-line", "peak-phase"])
@pytest.mark.parametrize(("ampere", "volt", "constants", "units"), [
    (2**0.5, 1.5**0.5, "rms-line", ("", "")),
    (1.0, 1.0, "peak-phase", ("", "")),
    (1.0, 3**0.5, "rms-line", (" peak", " peak")),
    (2**0.5, 3**0.5, "rms-line", ("", " peak")),
])  # fmt: skip
def test_the_constants_that_a_sheet_has_are_told_by_their_ratio(stated, ampere, volt, constants, units):
    """A sinusoidal motor of flux constant k: torque 3/2 k a peak ampere, k volts peak of a phase per rad/s.

    ``ampere`` peak amperes are one of the sheet, ``volt`` of its volts are a peak volt of a phase. Losses are
    3/2 R i^2, of the model's sqrt(3)/2 i: 2 R of a phase, which is R line-line.
    """
    kM, kE = 0.03 * ampere, 0.02 * volt
    if stated != constants or any(units):
        text = mistakes(motor(stated, torque_constant=f"{kM} Nm/A", back_emf_constant=f"{kE} V*s/rad"))
        assert (f'the ratio is that of motor.constants = "{constants}"' in text) is (stated != constants)
        assert "the ratio is that of " in text
        assert ("A peak" in text) is any(units)
    kM_text, kE_text = f"{kM} Nm/A{units[0]}", f"{kE} V{units[1]}/(rad/s)"
    drive = read_design_text(motor(constants, torque_constant=kM_text, back_emf_constant=kE_text))
    assert drive.effective_motor.back_emf_constant_Vs_rad == pytest.approx(3**0.5 * 0.02, rel=1e-12)
    assert drive.effective_motor.torque_constant_Nm_A == pytest.approx(3**0.5 * 0.02, rel=1e-12)
    assert drive.effective_motor.resistance_ohm == pytest.approx(5.9 * (1 + (constants == "peak-phase")))


def test_what_a_sheet_states_besides_follows_from_the_keys(cli, tmp_path) -> None:
    # by hand: 0.45 mH/5.9 ohm; 5.9 ohm 4.1e-7 kg m2/(12.7 mN m/A)^2; 12 V/(1.33 V/krpm); 12 V/5.9 ohm
    (tmp_path / "first.toml").write_text(DRIVE + '[load]\ninertia = "30 gcm2"\n', encoding="utf-8")
    data = cli.data("keys", "--explain", f"{tmp_path / 'first.toml'}")["figures"]
    assert [one["unit"] for one in data] == ["ms", "ms", "rpm", "A", "N*m", "kg*m^2", "kg*m^2"]
    assert [one["value"] for one in data] == pytest.approx(
        [0.0762712, 14.99783, 9022.556, 2.033898, 0.0258305, 8.138021e-9, 4.181380e-7], rel=2e-6
    )
    assert "Follows from the design" in cli.text("keys", "--explain", f"{tmp_path / 'first.toml'}")


@pytest.mark.parametrize(("word", "key"), [
    ("Kt", "motor.torque_constant"),
    ("Kv", "control.position.gain"),
    ("kp", "control.current.gain"),
    ("proportional gain", "control.velocity.gain"),
    ("k1", "coupling.stiffness"),
    ("state feedback", "control.position.law.inputs"),
    ("swing", "requirement.quantity"),
    ("phase_margin", "requirement.quantity"),
])  # fmt: skip
def test_keys_are_found_by_the_words_of_sheets_and_controllers(cli, word: str, key: str) -> None:
    assert key in [one["path"] for one in cli.data("keys", word)["keys"]]


def test_what_a_file_does_not_say_is_explained_and_warned_of(cli, tmp_path) -> None:
    file = tmp_path / "direct.toml"
    file.write_text(DRIVE.replace("19.2", '"1/19.2"') + '[control.current]\ngain = "9 Hz"\n')
    data = cli.data("keys", "--explain", f"{file}")
    rows = {one["path"]: (one["written"], one["read"]) for one in data["keys"]}
    assert rows["load.path"] == ("not written", "self-locking, assumed")
    assert rows["control.current.gain"][0] == "from 9 Hz"
    said = [one["text"] for one in data["warnings"]]
    assert any("turns the output faster than the motor" in line for line in said)
    assert [f"warning: first: {line}" for line in said] == cli("margins", f"{file}").err.splitlines()
    assert "load.path" not in [one["path"] for one in cli.data("keys", "--explain", "joint")["keys"]]
    ran = cli("simulate", f"{file}", "--set", "load.inertia=30 gcm2", "--json", "--duration", "0.01")
    assert any(said[-1] in line for line in ran.err.splitlines())


def test_a_changed_design_keeps_the_keys_of_its_data_sheet(tmp_path) -> None:
    """A gear's efficiency and a gain as a bandwidth stay what the file says; the new gain says of what."""
    file = tmp_path / "first.toml"
    gains = {"current": "1 kHz", "velocity": "0.01 A*s/rad", "position": "20 1/s"}
    loops = "".join(f'[control.{loop}]\ngain = "{gain}"\n' for loop, gain in gains.items())
    file.write_text(DRIVE.replace("ratio = 19.2", 'ratio = 19.2\nefficiency = "85 %"') + loops)
    before = load_design(file)
    after = with_values(before, {"control.position.gain": 30.0})
    text = write_changed(before, after)
    assert design_hash(read_design_text(text)) == design_hash(after) != design_hash(before)
    for words in ('efficiency = "85 %"', 'gain = "1 kHz"', 'source = "changed from 20 1/s"'):
        assert words in text
    assert "load_coefficient" not in text
    file.unlink()
    assert write_changed(before, after).startswith("# What its file derives")


def test_a_current_that_returns_has_no_figures_relative_to_its_end() -> None:
    """A free rotor turns until back-EMF has the voltage: g/(R + g + kM kE/b) of the command is left."""
    R, k, b, g = 5.9, 0.0127, 1e-8, 5.0
    text = DRIVE + f'[control.current]\ngain = "{g} V/A"\n[friction]\nviscous = "{b} N*m*s/rad"\n'
    figures = all_loop_figures(assemble_loops(read_design_text(text)), locked=True)["current"]
    row, locked = response_row(figures), response_row(figures.locked)
    assert row["dc"] == pytest.approx(g / (R + g + k * 1.33 * 60 / (2000 * np.pi) / b), rel=1e-6)
    assert locked["dc"] == pytest.approx(g / (R + g), rel=1e-9)
    names = ("minus3db_hz", "resonance_db", "rise_ms", "overshoot_percent", "settling_ms")
    assert [row[name] for name in names] == [None] * 5
    assert None not in [locked[name] for name in names[1:]]
    assert "the response returns to" in by_itself_notes({"Current loop": figures})[0]


def test_a_load_of_the_command_line_beyond_the_largest_is_warned_of(cli) -> None:
    said = cli("margins", "ilr33-amber", "--load", "1e9 N*m").err
    assert "--load: 1e+09 N*m lies above load.moment_max = 8 N*m" in said
    assert "--load" not in cli("margins", "ilr33-amber", "--load", "8 N*m").err


def test_a_repeated_requirement_is_told_in_its_own_lines() -> None:
    before = write_design(load_design("ilr33-amber"))
    again = (
        '[[requirement]]\nid = "gain-margin"\nquantity = "gain_margin"\nloop = "spede"\nminimum = "6 dB"\n'
    )
    lines = (before + again).splitlines()
    first, second = mistakes(before + again).splitlines()
    for said, key in ((first, 'id = "gain-margin"'), (second, 'loop = "spede"')):
        last = len(lines) - lines[::-1].index(key)
        assert f"line {last}: requirement[" in said
