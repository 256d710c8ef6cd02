"""What a terminal shows: the verdict first, and no line wider than the terminal, no word broken."""

import subprocess
import sys
from pathlib import Path

import pytest

from reports import document as doc
from reports.cli.main import main
from reports.terminal import print_blocks

WORDS = ["gain", "crossover", "velocity", "position", "anti-windup"]


def wide_table(columns: int) -> dict:
    named = [doc.column("name", "Loop"), *(doc.column(f"c{k}", f"Column {k}", "ms") for k in range(columns))]
    rows = [
        {"name": f"row {r}", **{f"c{k}": f"{WORDS[(r + k) % 5]}-{100 * r + k}" for k in range(columns)}}
        for r in range(3)
    ]
    return doc.table("A table", named, rows)


@pytest.mark.parametrize("width", [40, 60, 80, 200])
@pytest.mark.parametrize("columns", [1, 4, 12])
def test_no_value_is_broken_and_no_line_is_too_long(width: int, columns: int, monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    block = wide_table(columns)
    print_blocks([block])
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= width
    for row in block["rows"]:
        assert all(value in out for value in row.values())


@pytest.mark.parametrize("width", range(70, 140, 5))
def test_headings_break_before_a_word_of_a_cell_is_cut(width: int, monkeypatch, capsys) -> None:
    """A table whose headings are longer than its cells, narrower than they are, wider than the cells."""
    monkeypatch.setenv("COLUMNS", str(width))
    labels = ["Cause", "Dry friction", "Kind", "Predicted, peak", "at", "Simulated", "at", "Verdict"]
    columns = [doc.column(f"c{k}", label, "Hz" * (3 <= k < 7)) for k, label in enumerate(labels)]
    cells = ["quantised output sensor", "left out", "attracting", "45.5", "35.3", "46.5", "30.8", "confirmed"]
    print_blocks([doc.table("A table", columns, [{f"c{k}": cell for k, cell in enumerate(cells)}])])
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= width
    words = out.replace("\n", " ").lower().split()
    for word in " ".join([*labels[1:], *cells]).lower().split():  # stacked, the first column needs no name
        assert any(one.startswith(word) for one in words), word


@pytest.mark.parametrize("width", [60, 80, 120])
def test_margins_say_the_verdict_first_and_fit(width: int, monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    assert main(["margins", "ilr33-amber"]) == 0
    first, *rest = capsys.readouterr().out.splitlines()
    assert first == "PASS  ilr33-amber: every loop is stable. 12 of 12 requirements met."
    assert max(map(len, rest)) <= width
    assert sum(line.count("✓ met") for line in rest) == 12


def test_a_failed_requirement_is_in_the_first_line(capsys) -> None:
    assert main(["margins", "ilr33-amber", "--set", "control.position.gain=1560 1/s"]) == 1
    first = capsys.readouterr().out.splitlines()[0]
    said = "FAIL  ilr33-amber: every loop is stable. 9 of 12 requirements met, 3 not met. Not met: "
    assert first.startswith(said)
    assert main(["margins", "ilr33-amber", "--set", "control.position.gain=9000 1/s"]) == 1
    assert (
        capsys.readouterr().out.splitlines()[0].startswith("FAIL  ilr33-amber: not stable: Position loop. ")
    )


def test_the_program_runs_as_a_module() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "reports.cli", "designs"],
        cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0
    assert "ilr33-amber" in done.stdout
    done = subprocess.run(
        [sys.executable, "-m", "reports.cli", "margins", "no-such-design"],
        cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1


def test_help_breaks_lines_at_the_width_of_the_terminal() -> None:
    """A paragraph of a docstring is one line for the terminal, whose own width breaks it."""
    from reports.cli.app import flowed

    assert flowed("One.\n\n    Two goes\n    on.\n") == "One.\n\nTwo goes on."
