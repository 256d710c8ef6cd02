"""What holds of every command: --json, --set, help, the verdict first, no line wider than the terminal."""

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from reports import document as doc
from reports.cli.app import PANELS, flowed
from reports.terminal import print_blocks, side_by_side
from tests.command_line import commands

NO_DESIGN = {"designs", "keys", "pdf", "nightly", "objects import", "init"}  # nightly, pdf: a study, a report
COMMANDS = commands()
WORDS = ["gain", "crossover", "velocity", "position", "anti-windup"]


def test_every_command_is_listed_and_help_breaks_at_the_width_of_the_terminal() -> None:
    """A paragraph of a docstring is one line for the terminal, whose own width breaks it."""
    tops = {name.split()[0] for name in COMMANDS}
    assert tops == {name for names in PANELS.values() for name in names}
    assert flowed("One.\n\n    Two goes\n    on.\n") == "One.\n\nTwo goes on."


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_speaks_json_takes_changes_and_shows_an_example_that_it_takes(name: str) -> None:
    """Examples of its help are cut at the next sentence; click itself parses what is left."""
    command = COMMANDS[name]
    options = {option for parameter in command.params for option in parameter.opts}
    assert {"--json", *["--set"] * (name not in NO_DESIGN)} <= options
    assert [one.name for one in command.params if not getattr(one, "help", None)] == []
    text = command.help.partition("Try: ")[2].partition("\n\n")[0]
    tried = re.split(rf"actuator-lti {name}\b", text)[1:]
    assert tried, f"{name}: no example"
    for words in tried:
        line = re.split(r", or\b|: (?=actuator)|; ", words)[0].rstrip(",")
        command.make_context(name, shlex.split(line))


@pytest.mark.parametrize("words", [[], ["objects"], ["export"]])
def test_no_command_prints_help(words: list[str], cli) -> None:
    shown = cli(*words)
    assert "Usage" in shown.out + shown.err


def test_json_of_commands_that_write(tmp_path, cli) -> None:
    file = tmp_path / "mine.toml"
    for words in (
        ["init", str(file)],
        ["export", "c", "--out", str(tmp_path / "c"), "--set", "limits.voltage=9 V"],
        ["objects", "export", "--set", "control.position.gain=100 1/s"],
        ["designs"],
        ["keys", "notch"],
        ["margins", str(file)],
        ["stiffness", "--set", "limits.voltage=9 V"],
        ["simulate", "--duration", "0.01"],
    ):
        assert isinstance(cli(*words, "--json").data, dict), words
    assert any("9.0" in path.read_text(encoding="utf-8") for path in (tmp_path / "c").iterdir())


POSITION = "control.position.gain"


@pytest.mark.parametrize(("words", "first"), [
    ("margins", "PASS  ilr33-amber: every loop is stable. 12 of 12 requirements met."),
    (f"margins --set {POSITION}=9000/s", "FAIL  ilr33-amber: not stable: Position loop. "),
    (f"margins --set {POSITION}=1560/s", "FAIL  ilr33-amber: every loop is stable. 9 of 12 requirements met"),
    (f"compare ilr33-amber --no-validate --quiet --set {POSITION}=1560/s", "FAIL  "),
    (f"simulate --no-limits --duration 0.03 --set {POSITION}=9000/s", "FAIL  "),
], ids=lambda words: words.split()[0])  # fmt: skip
def test_the_first_line_is_the_verdict(words: str, first: str, tmp_path, monkeypatch, cli) -> None:
    monkeypatch.chdir(tmp_path)
    for width in (60, 80, 120) if words == "margins" else (80,):
        monkeypatch.setenv("COLUMNS", str(width))
        said, *rest = cli.text(*words.split(), status=int(first.startswith("FAIL"))).splitlines()
        assert said.startswith(first)
        assert len(said) > 20
        tables = [line for line in rest if not line.startswith(("note:", "out/", "  ", "play"))]
        assert max(map(len, tables), default=0) <= width
        if met := words.startswith("margins") and re.search(r"(\d+) of 12 requirements met", said):
            assert sum(line.count("✓ met") for line in rest) == int(met[1])


@pytest.fixture
def printed(monkeypatch, capsys) -> Callable[..., str]:
    """What the terminal prints of a block, no line longer than its width."""

    def call(width: int, block: Any) -> str:
        monkeypatch.setenv("COLUMNS", str(width))
        print_blocks([block])
        out = capsys.readouterr().out
        assert max(map(len, out.splitlines())) <= width
        return out

    return call


@pytest.mark.parametrize("width", [30, 60, 80, 200])
def test_side_by_side_tables_are_stacked_rather_than_broken(width: int, printed) -> None:
    heads = (("name", "Loop", ""), ("gain", "Gain margin", "dB"), ("pm", "Phase", "deg"))
    rows = [(f"Variant-{k}", 10.5 + k, f"{k}23456789") for k in range(9)]
    out = printed(width, side_by_side("A head", [doc.table("A", [doc.column(*one) for one in heads], rows)]))
    assert all(name in out and phase in out for name, _, phase in rows)
    if width < 100:
        assert not re.search(r"^\s*\w\s*$", out, re.M)


@pytest.mark.parametrize("width", [40, 60, 80, 200])
@pytest.mark.parametrize("columns", [1, 4, 12])
def test_no_value_is_broken_and_no_line_is_too_long(width: int, columns: int, printed) -> None:
    named = [doc.column("name", "Loop"), *(doc.column(f"c{k}", f"Column {k}", "ms") for k in range(columns))]
    cells = [[f"{WORDS[(r + k) % 5]}-{100 * r + k}" for k in range(columns)] for r in range(3)]
    rows = [(f"row {r}", *row) for r, row in enumerate(cells)]
    out = printed(width, doc.table("A table", named, rows))
    assert all(value in out for row in rows for value in row)


@pytest.mark.parametrize("width", range(70, 140, 5))
def test_headings_break_before_a_word_of_a_cell_is_cut(width: int, printed) -> None:
    """A table whose headings are longer than its cells, narrower than they are, wider than the cells."""
    labels = ["Cause", "Dry friction", "Kind", "Predicted, peak", "at", "Simulated", "at", "Verdict"]
    columns = [doc.column(f"c{k}", label, "Hz" * (3 <= k < 7)) for k, label in enumerate(labels)]
    cells = ["quantised output sensor", "left out", "attracting", "45.5", "35.3", "46.5", "30.8", "confirmed"]
    out = printed(width, doc.table("A table", columns, [cells]))
    words = out.replace("\n", " ").lower().split()
    for word in " ".join([*labels[1:], *cells]).lower().split():  # stacked, the first column needs no name
        assert any(one.startswith(word) for one in words), word


@pytest.mark.parametrize("width", [60, 80, 90, 100, 120])
@pytest.mark.parametrize("word", ["notch", "integral"])
def test_a_key_is_never_cut(word: str, width: int, monkeypatch, cli) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    said, rows = cli.text("keys", word), json.loads(cli.text("keys", word, "--json"))["keys"]
    assert max(map(len, said.splitlines())) <= width
    assert all(row["path"] in said for row in rows)
    assert "…" not in said


@pytest.mark.parametrize("command", ["identify", "tune", "compare", "margins"])
def test_help_is_not_cut_at_80_columns(command: str, monkeypatch, cli) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert "…" not in cli.text(command, "--help")


def test_the_program_runs_as_a_module() -> None:
    how = {"cwd": Path(__file__).parents[2], "capture_output": True, "text": True, "check": False}
    program = [sys.executable, "-m", "reports.cli"]
    good, bad = (subprocess.run([*program, *words], **how) for words in (["designs"], ["margins", "none"]))
    assert (good.returncode, "ilr33-amber" in good.stdout) == (0, True)
    assert (bad.returncode, bad.stderr.count("\n")) == (2, 1)
