"""What holds of every command: --json, --set where it takes a design, help, the verdict first."""

import json
import re
from typing import Any

import pytest
import typer

from actuator_lti.design import load_design, write_design
from reports import document as doc
from reports.cli.app import PANELS, build
from reports.cli.main import main
from reports.terminal import print_blocks, side_by_side

NO_DESIGN = {
    "designs",
    "keys",
    "pdf",
    "nightly",
    "objects import",
    "init",
}  # nightly and pdf: a study, a report


def leaves(command: Any, path: str = "") -> dict[str, Any]:
    inner = getattr(command, "commands", None)
    if not inner:
        return {path: command}
    return {
        name: leaf
        for key, sub in inner.items()
        for name, leaf in leaves(sub, f"{path} {key}".strip()).items()
    }


COMMANDS = leaves(typer.main.get_command(build()))


def options(command: Any) -> set[str]:
    return {option for parameter in command.params for option in parameter.opts}


def test_every_command_is_listed() -> None:
    tops = {name.split()[0] for name in COMMANDS}
    assert tops == {name for names in PANELS.values() for name in names}


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_speaks_json_and_takes_changes(name: str) -> None:
    command = COMMANDS[name]
    assert "--json" in options(command)
    if name not in NO_DESIGN:
        assert "--set" in options(command)
    assert command.help
    for parameter in command.params:
        assert getattr(parameter, "help", None), f"{name}: {parameter.name} has no help"


@pytest.mark.parametrize("words", [[], ["objects"], ["export"]])
def test_no_command_prints_help(words: list[str], capsys) -> None:
    main(words)
    shown = capsys.readouterr()
    assert "Usage" in shown.out + shown.err
    assert "Traceback" not in shown.err


def test_json_of_commands_that_write(tmp_path, capsys) -> None:
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
        main([*words, "--json"])
        assert isinstance(json.loads(capsys.readouterr().out), dict), words
    assert any("9.0" in path.read_text(encoding="utf-8") for path in (tmp_path / "c").iterdir())


@pytest.mark.parametrize(
    ("words", "passed"),
    [
        (["margins"], True),
        (["margins", "--set", "control.position.gain=9000 1/s"], False),
        (["stiffness"], True),
        (["corners", "fin"], False),
        (["duty", "joint"], True),
        (["cycles", "ballscrew"], True),
        (["compare", "ilr33-amber", "--no-validate", "--set", "control.position.gain=1560 1/s"], False),
        (["tune", "--no-curve", "--require", "position.bandwidth>=2000 Hz"], False),
    ],
    ids=lambda value: " ".join(value[:1]) if isinstance(value, list) else str(value),
)
def test_the_first_line_is_the_verdict(words: list[str], passed: bool, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    status = main([*words, "--quiet"] if words[0] in ("compare", "tune") else words)
    first, *rest = capsys.readouterr().out.splitlines()
    assert first.startswith("PASS  " if passed else "FAIL  ")
    assert len(first) > 20
    assert status == (0 if passed else 1)
    tables = [line for line in rest if not line.startswith(("note:", "out/", "  ", "play"))]
    assert max(map(len, tables), default=0) <= 80


@pytest.mark.parametrize("width", [30, 60, 80, 200])
def test_side_by_side_tables_are_stacked_rather_than_broken(width: int, monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    names = [f"Variant-{k}" for k in range(9)]
    columns = [
        doc.column("name", "Loop"),
        doc.column("gain", "Gain margin", "dB"),
        doc.column("pm", "Phase", "deg"),
    ]
    rows = [{"name": name, "gain": 10.5 + k, "pm": f"{k}23456789"} for k, name in enumerate(names)]
    print_blocks([side_by_side("A head", [doc.table("A", columns, rows)])])
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= width
    for row in rows:
        assert row["name"] in out
        assert row["pm"] in out
    if width < 100:
        assert not re.search(r"^\s*\w\s*$", out, re.M)


def test_a_name_of_a_record_is_changed_for_identify(tmp_path, capsys) -> None:
    file = tmp_path / "d.toml"
    file.write_text(write_design(load_design("emps")))
    assert main(["identify", str(file), "--set", "nothing"]) == 2
    assert main(["correlate", str(file), "none.csv", "--set", "limits.voltage"]) == 2
    shown = capsys.readouterr().err
    assert "allowed: KEY=VALUE" in shown
