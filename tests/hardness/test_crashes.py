"""A crash or a time limit is no verdict: one line, exit 3, the traceback on disk, the rest is written."""

import contextlib
import json
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer

from actuator_lti.bounds import COMMAND_SECONDS, STUDY_SECONDS
from actuator_lti.errors import InputError, NumericalError, OutOfTime
from reports.cli import time_limit
from reports.cli.app import about
from reports.cli.errors import run

SMALL, WITH_CURRENT_LOOP = "emps", "ilr33-amber"

# What is broken on purpose (module, function), and the sections that must be there all the same.
USUAL = ("margins", "loop-position")
BROKEN = {
    "reports.build:survey_loops": ("provenance",),
    "analyses.linear.loop_survey:_other_form": USUAL,
    "analyses.linear.loop_figures:_locked": ("margins", "loop-current"),
    "analyses.linear.loop_survey:_break_point": USUAL,
    "analyses.linear.loop_survey:operating_points": USUAL,
    "analyses.linear.loop_survey:_budgets": USUAL,
    "analyses.linear.loop_survey:_onset": USUAL,
    "reports.build:evaluate_requirements": USUAL,
    "reports.sections.answer:section": USUAL,
    "reports.sections.margins:of_loops": ("loop-position",),
    "reports.sections.loop:section": ("margins",),
    "reports.sections.forms:section": USUAL,
    "reports.sections.requirements:section": USUAL,
    "reports.build:validate": USUAL,
}


UNPAINTED = '<svg viewBox="0 0 9 9"></svg>'  # pictures take most of the time


def broken(*_arguments: object, **_named: object) -> None:
    raise ZeroDivisionError("by\nzero\x1b[31m")


def one_line(line: str) -> str:
    assert line.count("\n") == 1
    assert line.strip().isprintable()
    return line


def traceback_of(line: str) -> str:
    result = re.search(r"(/\S+\.traceback\.txt)$", line.strip())
    assert result, line
    text = Path(result[1]).read_text(encoding="utf-8")
    Path(result[1]).unlink()
    return text


@pytest.mark.parametrize("place", BROKEN)
def test_a_part_that_crashes_is_noted_and_the_rest_is_written(place, tmp_path, monkeypatch, cli) -> None:
    module, _, name = place.partition(":")
    monkeypatch.setattr("reports.charts.svg.draw_svg", lambda *_: UNPAINTED)
    monkeypatch.setattr(import_module(module), name, broken)
    part, option = ("validation", "--quiet") if name == "validate" else ("linear", "--no-validation")
    drive = WITH_CURRENT_LOOP if "loop-current" in BROKEN[place] else SMALL
    ran = cli("report", drive, option, "--quiet", "--out", tmp_path)
    assert ran.status == 3
    for said in (ran.err, traceback_of(one_line(ran.err))):
        assert "ZeroDivisionError" in said
    made = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    sections = {section["id"]: section for section in made["sections"]}
    assert sections.keys() >= {*BROKEN[place], "parameters", f"missing-{part}"}
    assert sections[f"missing-{part}"]["status"] == "fail"
    assert "Parts of this report that could not be computed" in (tmp_path / "report.html").read_text("utf-8")


def test_a_figure_that_crashes_leaves_the_page(tmp_path, monkeypatch, cli) -> None:
    def draw(block: dict, *_arguments: object) -> str:
        return broken() if block["figure"] == "nyquist" else UNPAINTED

    monkeypatch.setattr("reports.charts.svg.draw_svg", draw)
    ran = cli("report", SMALL, "--quiet", "--no-validation", "--out", tmp_path)
    assert (ran.status, "(nyquist)" in one_line(ran.err)) == (3, True)
    traceback_of(ran.err)
    page = (tmp_path / "report.html").read_text("utf-8")
    assert all(words in page for words in ("This figure could not be drawn", "loop-position"))


@pytest.mark.parametrize(("error", "status", "words"), [
    (KeyError("x"), 3, "unexpected KeyError"),
    (ValueError("f(a) and f(b) must have different signs"), 3, "different signs"),
    (RecursionError(), 3, "unexpected RecursionError"),
    (MemoryError(), 3, "not enough memory"),
    (NumericalError("try a\nlarger band"), 3, "numerical failure: try a larger band"),
    (InputError("a = 1: must be 2", where="x.toml"), 2, "actuator-lti: x.toml: a = 1: must be 2"),
    (FileNotFoundError(2, "No such file", "a\nb"), 2, "No such file"),
    (FileNotFoundError(2, "No such file or directory", "a.csv"), 2, "a.csv: No such file or directory"),
    (KeyboardInterrupt(), 130, "interrupted"),
    (typer.Abort(), 130, "interrupted"),
    (typer.BadParameter("no"), 2, "no"),
])  # fmt: skip
def test_each_kind_of_failure_has_its_status_and_one_line(error, status, words, capsys) -> None:
    def call() -> None:
        raise error

    assert run(call) == status
    line = one_line(capsys.readouterr().err)
    assert words in line
    if "traceback: " in line:
        traceback_of(line)


def test_the_hard_limit_ends_what_the_soft_one_cannot() -> None:
    script = (
        "import signal, time\nfrom reports.cli import time_limit\ntime_limit.HARD_EXTRA_S = 0.0\n"
        "signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})\ntime_limit.start(0.2)\ntime.sleep(60)\n"
    )
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, timeout=50, check=False)
    assert done.returncode == 3
    assert "not finished within 0.2 s" in done.stderr


SECONDS = 1.0
STARTED_S = 60.0  # until Python has read its modules on a machine that is busy
HARD_S = 5.0  # in the place of 30 s, which a report of the worst takes to write the rest
CODE = (
    "import sys\nfrom reports.cli import main, time_limit\n"
    f"time_limit.HARD_EXTRA_S = {HARD_S}\nsys.exit(main.main())"
)
SLOPE = ("fin", "--set", "load.moment_slope=300 N*m/rad")
LATE = ("fin", "--set", "control.computing_delay=20 ms")
WORST = {
    "cycles": SLOPE,  # its limit cycle is slow: minutes of simulation, all of it compiled
    "report": (*LATE, "--out", "r"),  # loops with the states of 200 late ticks
    "failures": ("ilr33-amber", "--duration", "30"),  # a second watched is done within the limit
    "tune": ("joint", "--out", "t"),
    "montecarlo": ("joint", "--samples", "100000000", "--out", "m"),
    "validate": ("joint", "--out", "v"),
    "simulate": ("ilr33-amber", "--duration", "90000", "--every", "1000000"),
}


@pytest.mark.parametrize("command", WORST)
def test_a_command_has_ended_by_its_limit(command: str, tmp_path) -> None:
    words = ["--time-limit", f"{SECONDS:g}", command, *WORST[command]]
    bound = time_limit.HARD_FACTOR * SECONDS + HARD_S
    done = subprocess.run(
        [sys.executable, "-c", CODE, *words],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=STARTED_S + bound,
    )  # fmt: skip
    (line,) = (line for line in done.stderr.splitlines() if line.startswith("actuator-lti: "))
    assert (done.returncode, f"not finished within {SECONDS:g} s" in line) == (3, True), done.stderr[-2000:]


def test_every_command_has_a_stated_time(monkeypatch: pytest.MonkeyPatch) -> None:
    stated = list[float]()
    monkeypatch.setattr(time_limit, "start", stated.append)
    for name in ("report", "montecarlo", None):
        about(SimpleNamespace(invoked_subcommand=name))
    assert stated == [COMMAND_SECONDS.most, STUDY_SECONDS.most, COMMAND_SECONDS.most]


def test_a_library_that_makes_an_error_of_its_own_of_it_changes_nothing(capsys) -> None:
    def late() -> None:
        time_limit.start(60.0)
        with contextlib.suppress(OutOfTime):
            time_limit._refuse(60.0)
        raise TypeError("cannot convert")

    assert run(late) == 3
    assert capsys.readouterr().err.startswith("actuator-lti: not finished within 60 s")
    assert (time_limit.struck(), time_limit._timers) == ("", [])
