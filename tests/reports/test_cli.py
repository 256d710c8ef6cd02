"""The command line: exit statuses, one line an error, JSON alone on standard output."""

import json
import os
import re
import shlex
import subprocess
import sys
from unittest.mock import Mock

import pytest
import typer

from actuator_lti.design.loader import design_text
from reports.cli.app import build
from reports.cli.output import progress


def test_no_help_loses_a_name_in_brackets_to_markup() -> None:
    todo, docs = [typer.main.get_command(build())], {}
    for command in todo:
        todo.extend(getattr(command, "commands", {}).values())
        said = [command.help or "", *(getattr(parameter, "help", "") or "" for parameter in command.params)]
        docs[command.name] = re.findall(r"(?<!\\)\[[a-z_. ]+\]", " ".join(said))
    assert len(docs) > 20
    assert not any(docs.values()), docs


def loaded(code: str) -> set[str]:
    """What a process of its own has loaded after some code."""
    told = f"{code}\nimport sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


SLOW = {"scipy.signal", "scipy.stats", "scipy.optimize", "scipy.interpolate", "scipy.ndimage", "jinja2"}
PLOTTING = {"control", "matplotlib", "pandas", *SLOW}
READ = """import tempfile; from analyses.records.open_record import open_record
with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
    file.write("time_s,speed_rad_s\\n0,1\\n1,2\\n2,nan\\n")
    file.flush()
    assert open_record(file.name).counts.rows_in == 3"""
COMMAND = "from reports.cli.main import main; main({})"
LIGHT = {
    "import actuator_lti": {"control", "numpy"},
    "import nonlinear, analyses.linear.loop_survey, actuator_lti.drawing.plotting; "
    "from actuator_lti import load_design; load_design('ilr33-amber')": {"matplotlib"},
    COMMAND.format(["--help"]): {"numpy", "scipy", "control", "matplotlib", "pydantic", "pandas"},
    COMMAND.format(["margins", "ilr33-amber"]): PLOTTING | {"dask"},
    COMMAND.format(["duty", "joint"]): PLOTTING | {"dask"},
    READ: {"pandas", "scipy.signal"},
    COMMAND.format(["stiffness", "ilr33-amber", "--json"]): PLOTTING | {"dask"},
}


@pytest.mark.parametrize("code", LIGHT)
def test_nobody_waits_for_a_library_that_is_not_used(code: str) -> None:
    assert not loaded(code) & LIGHT[code]


@pytest.mark.parametrize("form", ["continuous", "ideal"])
def test_margins_on_the_terminal_name_every_loop(form: str, cli) -> None:
    words = cli.text("margins", "ilr33-amber", "--form", form)
    for name in ("Current loop", "Velocity loop", "Position loop", "Phase margin, deg", "✓ met"):
        assert name in words


@pytest.mark.parametrize(("arguments", "words"), [
    ("margins ilr33-ambre", 'nearest known: "ilr33-amber"'),
    ("margins --load nan", "load"),
    ("margins --no-such-option", "--no-such-option"),
    ("margins ''", '"": no such design; allowed: ilr33-amber'),  # an unset variable is no default
    ("no-such-command", "no-such-command"),
    ("report missing.toml", "missing.toml"),
    ("report --processes 2", "--processes"),
    ('margins --load "4 kg"', '"kg" is the unit of a mass; allowed: a torque such as "4 N*m"'),
    ("margins --load 4,5", 'use a decimal point: "4.5"'),
    ("margins --load '4 N'", '"N" is the unit of a force; allowed: a torque such as'),
    ("margins emps --load '4 N*m'", '"N*m" is the unit of a torque; allowed: a force such as'),
    ("simulate emps --load '4 N*m'", "--load '4 N*m': wrong dimension"),
    ("simulate --amplitude 0,5", 'use a decimal point: "0.5"; allowed: "5 deg", or 5 in deg'),
    ("margins --form sampld", "--form 'sampld': must be one of sampled, continuous, ideal"),
    ("margins --operating-point slide", "--operating-point 'slide': must be one of sliding"),
    ("margins --set control.period=0.1", "has no unit; allowed: a number with a unit like s"),
    ("margins --set motor.resistance", "allowed: KEY=VALUE"),
    ("margin", "Did you mean 'margins'?"),
    ("objects export emps", "emps"),
    ("objects import missing.xdc", "missing.xdc"),
    ("objects export --velocity-gain-per Hz", 'per "Hz": allowed: "rad/s" or "rpm"'),
    ("init .", "."),
    ("report --summary", "--summary: allowed with --pdf"),
    ("report --also all-of-it", "--also 'all-of-it': allowed: corners"),
    ("tune --place spring", "--place 'spring': allowed: notch"),
    ("tune --aim least", "Invalid value for '--aim': 'least' is not one of"),
    ("montecarlo --samples 0 --out o", "--samples 0: at least 1"),
    ("montecarlo --seed -1 --out o", "--seed -1: 0 or more"),
    ("montecarlo --step '5 kg' --out o", "--step '5 kg': wrong dimension"),
    ("montecarlo --workers 2 --scheduler tcp://a:1 --out o", "--workers and --scheduler: one of them"),
    ("montecarlo --samples 1e3", "'--samples': allowed: a whole number, such as 1000"),
    ("montecarlo --at-least x", "--at-least 'x': a number and a unit are wanted; allowed: a number such as"),
    ("duty --share '4 kg'", '"kg" is the unit of a mass; allowed: a number such as 0.5 or "50 %"'),
    ("duty --set 'duty.current=5 A'", "duty.current: this drive's command is a position; allowed: duty."),
    ("failures --set 'failure.speed=5 rpm'", "failure.speed = 0.523599: allowed of a drive commanded"),
    ("duty --frequency '4 s'", '"s" is the unit of a time; allowed: "5 Hz", or 5 in Hz'),
    ("--time-limit x designs", "'--time-limit': allowed: a number, such as 0.5, without its unit"),
    ("compare emps --workers 2", "--workers 2: computes variants, and emps has none"),
    ("identify emps --set nothing", "allowed: KEY=VALUE"),
    ("correlate emps none.csv --set limits.voltage", "allowed: KEY=VALUE"),
    ("identify", "Missing argument 'FILE...'"),
    ("identify nowhere.toml", "nowhere.toml: cannot be read: no such file"),
    ("identify nowhere.csv", "nowhere.csv: cannot be read: no such file"),
    ("correlate emps nowhere.csv", "nowhere.csv: cannot be read: no such file"),
    ("correlate no-such-design nowhere.csv", "no such design"),
    ("keys odrive", "objects import"),
    ("margins ilr33-amber --averages 8 --out x", "--averages: allowed with --response"),
    ("report ilr33-amber --averages 8 --out x", "--averages: allowed with --response"),
    ("simulate --amplitude '5 mm'", "--amplitude '5 mm': wrong dimension"),
    ("nightly no-such-study.toml --site s", "no-such-study.toml"),
    ("nightly a b c --site s", "base = its file"),
    ("nightly approve ilr33-amber --site s", "--by and --reason"),
    ("nightly ilr33-amber", "--site"),
    ("nightly ilr33-amber --site s --time-limit 0", "--time-limit"),
    ("nightly ilr33-amber --site s --time-limit inf", "--time-limit"),
    ("init mine.toml --kind crane", "crane"),
    ("init mine.toml --kind fin --from joint", "--from"),
    ("init mine.toml --motor maxon-re-40", 'nearest known: "maxon-re-40-150w-'),
    ("init mine.toml --gear worm", "allowed: maxon-gp-26-b-84, "),
    ("init mine.toml --gear maxon-gp-26-b-84 --kind fin", "--gear: not allowed beside --kind and --from"),
    ("init mine.toml --motor '' --from fin", "--motor: not allowed beside --kind and --from"),
    ("export fmu emps --fmi 4 --out out", "4: allowed: 2 or 3"),
    ("export fmu emps --platform vax --out out", "allowed: linux64, win64"),
    ("export controller emps --prefix 4fin --out out", "allowed: letters"),
    ("export controller emps --prefix int --out out", "--prefix 'int': no _ last; allowed: letters"),
    ("export linear emps --to mat --out x.json", "--out 'x.json': --to is mat; allowed: a name that"),
    ("export linear emps --out x.mat", "ends in .json"),
    ("export c no-such-design --out out", "no such design; allowed: "),
    ("export c fin --single --out out", "coupling: an elastic drive train needs double precision"),
    ("simulate --command sine --frequency 5000", "below the Nyquist frequency"),
    ("simulate --duration 0.00001", "at least one tick"),
    ("simulate --duration nan", "finite"),
    ("simulate --amplitude inf", "finite"),
    ("simulate --command square", "must be one of"),
    ("simulate --command recorded", "needs --record"),
    ("simulate --every 0", "--every 0: must be a whole number, at least 1"),
    ("simulate --duration 1e9", "ticks of one run; allowed"),
    ("simulate --command stepped-sine --frequency 5 --to 20 --count 3 --duration 1", "takes 1.75 s"),
    ("simulate --start 3 --duration 1", "the run ends at 1 s"),
    ("simulate --start 1", "the run ends at 1 s"),
    ("simulate --start -1", "--start"),
    ("simulate --held", "--held"),
    ("simulate --command hold --start 0.1", "--start 0.1: a hold is there from the first tick on"),
    ("simulate --command sine --frequency 2 --cycles 3 --duration 1", "3 periods take 1.5 s"),
    ("simulate --command step --cycles 3", "allowed with --command sine"),
    ("simulate --frequency 2", "--frequency 2: allowed with --command sine, triangle"),
    ("simulate --command sine --to 20", "--to 20: allowed with --command chirp"),
    ("simulate --command chirp --seed 4", "--seed 4: allowed with --command multisine"),
    ("simulate --plot run.png", "--plot run.png: allowed: a name that ends in .svg"),
    ("simulate --command sine --frequency -2", "--frequency -2: must be positive"),
])  # fmt: skip
def test_bad_input_is_one_line_and_status_2_and_writes_nothing(arguments, words, tmp_path, monkeypatch, cli):
    monkeypatch.chdir(tmp_path)
    assert words in cli.refused(*shlex.split(arguments))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "given", [("2", "0.5", "20"), ("120 rpm", "50 %", "20 s"), ("2 Hz", "0.5", "20000 ms")]
)
def test_a_number_may_have_its_unit(given: tuple[str, str, str], cli) -> None:
    options = zip(("--frequency", "--share", "--cycle"), given, strict=True)
    told = cli.text("duty", "ilr33-amber", "--amplitude", "1 deg", *(word for one in options for word in one))
    assert ("±1 deg at 2 Hz" in told, "50 % of every 20 s" in told) == (True, True)


def test_a_bad_file_is_named_and_nothing_is_written(tmp_path, cli) -> None:
    design, empty = tmp_path / "bad.toml", tmp_path / "empty.json"
    design.write_text(design_text("ilr33-amber").replace('"9.2 g*cm^2"', '"-9.2 g*cm^2"'), encoding="utf-8")
    empty.touch()
    assert "rotor_inertia" in cli.refused("report", design, "--out", tmp_path / "out")
    assert "empty.json: is empty; allowed: a report.json" in cli.refused("pdf", empty)
    assert {*tmp_path.iterdir()} == {design, empty}


def test_report_writes_both_files_and_gives_the_document(tmp_path, cli) -> None:
    told = cli.data("report", "ctms-motor-position", "--out", tmp_path, "--no-validation")
    assert told == json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert sorted(os.listdir(tmp_path)) == ["report.html", "report.json"]
    said = cli.refused("report", "--include", tmp_path / "report.json", "--out", tmp_path / "again")
    assert re.search(
        "report.json: --include: a whole report.*; allowed: what identify or correlate wrote", said
    )
    assert not (tmp_path / "again").exists()


def test_an_interrupted_command_says_so(monkeypatch, cli) -> None:
    monkeypatch.setattr("actuator_lti.design.load_design", Mock(side_effect=KeyboardInterrupt))
    ran = cli("margins")
    assert (ran.status, ran.err.count("\n"), "interrupted" in ran.err) == (130, 1, True)


@pytest.mark.parametrize("words", [["margins", "--json"], ["margins"]])
def test_a_closed_pipe_is_no_error(words) -> None:
    code = f"from reports.cli.main import main; import sys; sys.exit(main({words}))"
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert (done.stderr, done.returncode) == ("", 141)


def test_progress_stays_off_where_nobody_looks(capsys) -> None:
    with progress("work") as report:
        report(1, 2)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("command", ["report", "validate", "compare", "tune", "montecarlo"])
def test_a_folder_that_cannot_be_is_refused_before_anything_is_computed(command, tmp_path, cli, monkeypatch):
    read, file = Mock(), tmp_path / "file"
    monkeypatch.setattr("actuator_lti.design.load_design", read)
    file.write_text("mine")
    for place in (file, file / "inside"):
        assert f"{file}: is not a directory" in cli.refused(command, "ilr33-amber", "--out", place)
    assert (file.read_text(), read.called) == ("mine", False)


def test_margins_say_what_is_suspicious_on_standard_error(cli) -> None:
    ran = cli("margins", "emps", "--json")
    assert ran.err.startswith("warning: emps: control.position.gain:")
    assert ran.data["design"]["name"] == "emps"
