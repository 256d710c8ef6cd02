# ruff: noqa: E501 (a table of cases, one a line)
"""Every kind of bad design file, and what a mistyped value is answered with: one line that says what is allowed."""

import re

import pytest
import tomli_w

from actuator_lti.design import design_tree, load_design, read_design_text, write_design
from actuator_lti.design.key_reference import key_reference
from actuator_lti.design.loader import design_text
from reports.cli.main import main
from tests.refusals import mistakes, refused

AMBER = design_text("ilr33-amber")
TOLERANCE = 'tolerance = "50 %"'
FACTS = "[[fact]]"


def changed(*replacements: tuple[str, str]) -> str:
    text = AMBER
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new, 1)
    return text


ROTOR = next(line for line in AMBER.splitlines() if line.startswith("rotor_inertia"))
RESISTANCE = next(line for line in AMBER.splitlines() if line.startswith("resistance"))

CASES = [  # a text, another in its place, and what is said of it
    ("[motor]", "[mottor]", "mottor", 'nearest known: "motor"'),
    ('grade = "X"', 'grad = "X"', '.grad = "X"', 'nearest known: "grade"'),
    (ROTOR, "", "motor.rotor_inertia: missing", "g*cm^2"),
    (RESISTANCE, "", "motor.resistance: missing", "motor.source_gain"),
    ('"55 mohm"', "nan", "motor.resistance = nan", "finite"),
    ('"9.2 g*cm^2"', '"-9.2 g*cm^2"', "motor.rotor_inertia", "-9.2", "above 0"),
    ('period = { value = "100 us"', 'period = { value = "0 us"', "control.period", "1e-07 s"),
    ('"2.25e-3 N*m"', '"-1 N*m"', "friction.dry_torque", "0, or at least 1e-18 N*m"),
    ("[control.position]", '[control.position]\nderivative_time = "1e-308 s"',
     "control.position.derivative_time", "0, or at least 1e-18 s"),
    ("[control.current]", "[control.current]\ntracking_time = \"0 s\"", "for none leave the key out"),
    ('"5.9 mV*s/rad"', '"7 mV*s/rad"',
     "motor.back_emf_constant = 0.007 V*s/rad (7 mV*s/rad)", "within 10 % of 0.0059 V*s/rad"),
    ("[encoder]", '[encoder]\nbandwidth = "300 rad/s"',
     "encoder.bandwidth = 300 rad/s:", 'allowed with speed = "tracking"'),
    (FACTS, '[supply]\ncapacitance = "2 mF"\n[[fact]]', "supply.capacitance = 2 mF:"),
    ('"self-locking"  #', '"locking"  #', 'load.path = "locking"', '"back-drivable"'),
    ("value = 66", "value = true", "gear.planetary.ratio", "a number"),
    ('revision = "1"', "revision = 1979-05-27", "design.revision", "allowed: text"),
    ('name = "ilr33-amber"', 'name = " "', "design.name", "allowed: a text"),
    ('name = "worm"', 'name = "../x"', "gear[2].name", "letters, digits"),
    ('name = "worm"', 'name = "planetary"', "gear[2].name", "each name once"),
    ('id = "phase-margin"', 'id = "gain-margin"', "requirement[2].id", "each id once"),
    ('"15 Hz"', '"15 dB"', "requirement.position-bandwidth.minimum", "Hz"),
    ('"6 dB"', '"2"', "requirement.gain-margin.minimum", "6 dB"),
    ('minimum = "15 Hz"', "", "requirement.position-bandwidth: missing limit"),
    ('"output_rate"', '"output_rate"\nloop = "every"', "output-rate.loop", "no loop"),
    (TOLERANCE, 'tolerance = "150 %"', "input_inertia.tolerance", "0, or at least"),
    (TOLERANCE, 'tolerance = "0 %"', "input_inertia.tolerance", "without a tolerance"),
    (TOLERANCE, 'tolerance = { kind = "gauss" }', "tolerance.kind", '"normal"'),
    (TOLERANCE, 'tolerance = { kind = "normal" }', "tolerance", "missing std"),
    (TOLERANCE, 'tolerance = { half_width = "5 %", std = "1 %" }', "no std"),
    (TOLERANCE, 'tolerance = { kind = "truncated-normal", std = "1 %" }', "lower or upper"),
    (TOLERANCE, "tolerance = []", "tolerance = an empty list", '"50 %"'),
    (FACTS, '[[correlation]]\nfirst="load.inertia"\nsecond="gear.worm.ratio"\ncoefficient=0.5\n[[fact]]',
     '"gear.worm.ratio"', "keys with a tolerance"),
    (FACTS, '[[correlation]]\nfirst="load.inertia"\nsecond="gear.worm.input_inertia"\ncoefficient=1.5\n[[fact]]',
     "coefficient = 1.5", "at least -1 and at most 1"),
    ('title = "ILR', 'title = "\\u001b[31mILR', "design.title", "U+001B"),
    ("[motor]", '[motor]\n"\\u202ex" = 1', "a key of motor", "U+202E"),
    ('loads = ["0 N*m", "8 N*m"]', "loads = []", "validation.loads", "1 to 200"),
    ('"0 N*m", "8 N*m"', '"0 N*m", "8 V"', 'validation.loads[2] = "8 V"'),
    ("0.5, 1.0]", "0.5, 2.0]", "amplitude_fractions[5] = 2.0"),
    ("[motor]", "[motor", "not TOML", "line 11, column 7"),
    ("[[gear]]", "[[gear]]\n" * 21, "gear: allowed: 1 to 20 items"),
    (FACTS, "[objects.values]\n\"0x23\" = 1\n[[fact]]", "0x23", "0x2344.01"),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=lambda case: case[1])
def test_a_bad_value_is_refused_in_one_line(case: tuple[str, ...]) -> None:
    old, new, *says = case
    line = mistakes(changed((old, new)))
    assert "\n" not in line or "keys with a tolerance" in says
    assert [part for part in says if part not in line] == []


def test_the_terminal_tells_all_mistakes_and_many_are_cut_short(capsys, tmp_path) -> None:
    path = tmp_path / "my.toml"
    text = changed(('"5.9 mV*s/rad"', '"7 mV*s/rad"'), ('"4 A", source', '"14 A", source'))
    path.write_text(text, encoding="utf-8")
    assert main(["margins", str(path)]) == 2
    assert capsys.readouterr().err.count("\nactuator-lti: ") == 1
    assert mistakes(AMBER + "".join(f"[x{k}]\n" for k in range(100))).endswith("and 70 more mistakes")


def test_correlations_that_contradict_each_other_are_refused() -> None:
    keys = ("load.inertia", "gear.worm.input_inertia", "gear.planetary.input_inertia")
    pairs = [(keys[0], keys[1], 0.9), (keys[1], keys[2], 0.9), (keys[0], keys[2], -0.9)]
    tables = [f'[[correlation]]\nfirst = "{a}"\nsecond = "{b}"\ncoefficient = {c}\n' for a, b, c in pairs]
    assert "contradict" in mistakes(AMBER + "".join(tables))


@pytest.mark.parametrize(("old", "new", "says"), [
    ("[control]", "[control.current]\ngain = '1 ohm'\n[control]", "control.current"),
    ("[motor]", "[motor]\nresistance = '1 ohm'", "resistance = 1 ohm: not allowed beside motor.s"),
    ("243.45 V*s/m", "1 A*s/m", 'control.velocity.gain = "1 A*s/m": wrong dimension'),
])  # fmt: skip
def test_the_stages_of_a_force_source_are_held_apart(old: str, new: str, says: str) -> None:
    assert says in mistakes(design_text("emps").replace(old, new))


def test_files_that_are_no_design_are_refused(tmp_path) -> None:
    refused(load_design, tmp_path / "missing.toml", words="no such file; allowed")
    (tmp_path / "misssing.toml").write_text("", encoding="utf-8")
    refused(load_design, tmp_path / "missing.toml", words='no such file (there is "misssing.toml")')
    (tmp_path / "binary.toml").write_bytes(b"[design]\nname = '\xff\xfe'")
    refused(load_design, tmp_path / "binary.toml", words="byte 17 is not UTF-8")


def test_a_byte_order_mark_and_windows_line_ends_are_read(tmp_path) -> None:
    path = tmp_path / "bom.toml"
    path.write_bytes(b"\xef\xbb\xbf" + AMBER.replace("\n", "\r\n").encode())
    assert load_design(path).motor == load_design("ilr33-amber").motor


@pytest.mark.parametrize(
    "text", ["<script>alert(1)</script>", "a 'b' \"c\"", "=1+1", "two\nlines", "\u202eback", "x" * 10_000]
)
def test_free_texts_stay_text(text: str) -> None:
    design = load_design("ilr33-amber")
    tree = design_tree(design)
    tree["design"] |= {"name": text, "title": text, "description": text}
    tree["requirement"][0] |= {"id": text, "source": text}
    again = read_design_text(tomli_w.dumps(tree), "my.toml")
    assert (again.name, again.title, again.description) == (text, text, text)
    assert (again.requirements[0].id, again.requirements[0].source) == (text, text)
    assert read_design_text(write_design(again), "my.toml") == again
    tree["requirement"][0]["quantity"] = "gain"
    assert len(mistakes(tomli_w.dumps(tree))) < 500


def test_the_key_reference_has_every_key_once() -> None:
    paths = [entry.path for entry in key_reference()]
    assert len(paths) == len(set(paths)) > 100
    assert all(entry.description for entry in key_reference("linear"))
    assert {entry.unit for entry in key_reference("linear")} >= {"kg", "N", "m/s"}


FILES = {
    "empty.toml": ("", "is empty; allowed: a design file"),
    "comment.toml": ("# only a comment\n", "is empty"),
    "unquoted.toml": ("[motor]\nresistance = 55 mohm\n", 'line 2.*in quotes: resistance = "55 mohm"'),
    "number.toml": ("[motor]\nresistance = 0,6\n", "line 2.*decimal point: resistance = 0.6"),
    "comma.toml": ('[motor]\nresistance = "0,6 ohm"\n', None),
    "quotes.toml": ("[motor]\nresistance = “55 mohm”\n", "use straight quotes"),
    "semicolon.toml": ('[motor];\nresistance = "1 ohm"\n', "no semicolon at the end of a line"),
    "table.toml": ("time_s;ref\n0;1\n0,001;2\n", "this looks like a table of numbers, TOML is wanted"),
    "json.toml": ('{"motor": 1}', "this looks like JSON, TOML is wanted"),
}


@pytest.mark.parametrize("name", sorted(FILES))
def test_a_file_that_is_no_design_is_told_what_it_looks_like(name: str, tmp_path, cli) -> None:
    text, words = FILES[name]
    (tmp_path / name).write_text(text, encoding="utf-8")
    status, _, said = cli("margins", tmp_path / name)
    assert status == 2
    assert all(name in line for line in said.splitlines())
    assert words is None or (re.search(words, said) and said.count("\n") == 1)


def test_a_load_and_an_amplitude_may_have_their_units(cli) -> None:
    texts = ("4 N*m", "4", "4000 mN*m")
    result = [cli.data("margins", "--load", text)["asked"]["load_Nm"] for text in texts]
    assert result == pytest.approx([4.0] * 3, rel=1e-12)
    said = []
    for words in ("5deg", "5", "300 arcmin", "0.08726646259971647 rad"):
        ran = cli("simulate", "--amplitude", words, "--duration", "0.02", "--json")
        assert ran.status in (0, 1)
        said.append(ran.out)
    assert len(set(said)) == 1


def test_records_that_are_none(tmp_path, cli) -> None:
    design, table, empty = tmp_path / "d.toml", tmp_path / "s.csv", tmp_path / "e.csv"
    design.write_text(write_design(load_design("ilr33-amber")), encoding="utf-8")
    table.write_text("time_s;reference_deg\n0;1\n0,001;2\n", encoding="utf-8")
    empty.write_text("", encoding="utf-8")
    for file, words in (
        (design, "this looks like TOML, a CSV file is wanted"),
        (empty, "a header line and at least one row"),
        (table, "separate the columns with commas, and write numbers with a decimal point"),
    ):
        assert words in cli.refused("simulate", "--record", file)


def test_a_command_warns_and_goes_on(cli) -> None:
    status, _, said = cli("margins", "--set", "load.moment_max=4000 N*m")
    assert status == 0
    assert "warning: ilr33-amber: load.moment_max: 4000 N*m holds the drive fast" in said
