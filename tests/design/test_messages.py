"""What a mistyped value is answered with: one line that says what to write instead."""

import re

import pytest

from actuator_lti import assemble_loops
from actuator_lti.design import load_design, write_design
from actuator_lti.design.key_reference import key_reference
from actuator_lti.errors import InputError
from nonlinear import commands, simulate

AMBER = load_design("ilr33-amber")


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


def test_python_names_its_arguments() -> None:
    with pytest.raises(InputError, match=r"^form = 'sampld': one of sampled, continuous, ideal$"):
        assemble_loops(AMBER, form="sampld")
    with pytest.raises(InputError, match=r"^duration_s = nan: must be"):
        simulate(AMBER, commands.step(0.01), float("nan"))


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


@pytest.mark.parametrize("command", [["identify"], ["correlate", "emps"], ["simulate", "--record"]])
def test_records_that_are_none(command: list[str], tmp_path, cli) -> None:
    design, table, empty = tmp_path / "d.toml", tmp_path / "s.csv", tmp_path / "e.csv"
    design.write_text(write_design(AMBER), encoding="utf-8")
    table.write_text("time_s;reference_deg\n0;1\n0,001;2\n", encoding="utf-8")
    empty.write_text("", encoding="utf-8")
    twice = [design] * (2 if command == ["identify"] else 1)
    status, _, said = cli(*command, *twice)
    assert status == 2
    assert "a design, and no record" in said or "this looks like TOML, a CSV file is wanted" in said
    status, _, said = cli(*command, empty)
    assert status == 2
    assert "is empty" in said or "a header line and at least one row" in said
    said = cli.refused(*command, table)
    if command[0] == "simulate":
        assert "separate the columns with commas, and write numbers with a decimal point" in said


def test_a_command_warns_and_goes_on(cli) -> None:
    status, _, said = cli("margins", "--set", "load.moment_max=4000 N*m")
    assert status == 0
    assert "warning: ilr33-amber: load.moment_max: 4000 N*m holds the drive fast" in said
