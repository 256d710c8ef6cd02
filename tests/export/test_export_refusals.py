"""What an export refuses: one line, status 2, nothing half-written; and the line while one waits for it."""

import io
import re
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from programs import needs_compiler

import actuator_lti.compiled.compiler as build
from actuator_lti import load_design
from actuator_lti.design.loader import design_text
from nonlinear.export import c_export
from reports.cli import output as waiting

NOISY = design_text("ilr33-amber") + '[instruments]\ncurrent_noise = "0.1 A"\n'
FILES = {"c emps --no-check": "main.c", "linear emps": "a.json", "fmu emps": "d.fmu"}
FMU = ("fmu", "emps", "--plain", "--platform", "linux64")


@needs_compiler
@pytest.mark.parametrize("command", [("c", "emps", "--no-check"), FMU])
def test_a_folder_that_cannot_be_written(command: tuple[str, ...], tmp_path, cli) -> None:
    """A file in the place of a folder stops the super-user too; ``/proc`` takes no new files from anyone."""
    (tmp_path / "file").write_text("mine")
    for folder in (tmp_path / "file", Path("/proc/1")):
        assert str(folder) in cli.refused("export", *command, "--out", folder / "drive.fmu")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"file": "mine"}


@pytest.mark.parametrize("command", FILES)
def test_one_file_that_exists_and_no_other_is_written(command: str, tmp_path, cli) -> None:
    file = FILES[command]
    out = "" if file == "main.c" else file
    (tmp_path / file).write_text("mine")
    assert f"{file}: exists already" in cli.refused("export", *command.split(), "--out", tmp_path / out)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {file: "mine"}


def test_no_compiler_for_a_unit(tmp_path, cli, monkeypatch) -> None:
    monkeypatch.setattr(build, "system_compiler", lambda: None)
    monkeypatch.setattr(build, "zig_command", lambda: None)
    for platform, said in (("linux64", "gcc or clang, or pip install"), ("win64", "allowed: pip install")):
        line = cli.refused("export", *FMU[:-1], platform, "--out", tmp_path / "drive.fmu")
        assert f"no C compiler for {platform}" in line
        assert said in line
    assert not list(tmp_path.iterdir())


def test_a_compiler_that_fails(tmp_path, cli, monkeypatch) -> None:
    broken, out = tmp_path / "cc", tmp_path / "drive.fmu"
    broken.write_text("#!/bin/sh\necho 'drive.c:1: error: out of order' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr(build, "compiler_for", lambda _: [str(broken)])
    assert "error: out of order" in cli.refused("export", *FMU, "--out", out)
    assert not out.exists()


def test_noise_needs_double_precision(tmp_path, monkeypatch, cli) -> None:
    """What else is refused of an export's words is in tests/reports/test_cli.py."""
    monkeypatch.chdir(tmp_path)
    Path("noisy.toml").write_text(NOISY)
    said = cli.refused("export", "c", "noisy.toml", "--single", "--out", "out")
    assert "noise and jitter need double precision" in said
    assert not Path("out").exists()


@pytest.mark.parametrize(("command", "files"), [
    ("c noisy.toml --no-check", "drive.h drive.c drive_design.h drive_design.c main.c README.md"),
    ("controller emps", "controller.h controller.c controller.hpp vectors.h main.c README.md"),
])  # fmt: skip
def test_a_folder_holds_all_files_of_its_export(command: str, files: str, tmp_path, monkeypatch, cli) -> None:
    monkeypatch.chdir(tmp_path)
    Path("noisy.toml").write_text(NOISY)
    cli.text("export", *command.split(), "--out", "out")
    assert {path.name for path in Path("out").iterdir()} == set(files.split())


def test_no_name_ends_a_comment_or_turns_the_code_round() -> None:
    hostile = '*/ int evil; /* " int evil; \\ \u202e\u2066 \x85 two\nlines'
    texts = c_export(replace(load_design("ctms-motor-position"), name=hostile, title=hostile))
    for name in ("drive_design.h", "drive_design.c", "README.md"):
        assert all(c.isprintable() or c == "\n" for c in texts[name]), name
    for name in ("drive_design.h", "drive_design.c"):
        comment_or_text = r'/\*.*?\*/|"(?:[^"\\\n]|\\.)*"'
        code = re.sub(comment_or_text, "", texts[name], flags=re.DOTALL)
        assert "evil" in texts[name]
        assert "evil" not in code
        assert "*/" not in code


class Stream(io.StringIO):
    """Standard error of a terminal or of a log; says when something was written."""

    def __init__(self, terminal: bool) -> None:
        super().__init__()
        self.terminal, self.written = terminal, threading.Event()

    def isatty(self) -> bool:
        return self.terminal

    def flush(self) -> None:
        super().flush()
        if self.getvalue():
            self.written.set()


@pytest.mark.parametrize(
    ("terminal", "after_s", "said"), [(True, 0.0, "the kettle boils\n"), (True, 1e3, ""), (False, 0.0, "")]
)
def test_a_wait_is_told_once_on_a_terminal(terminal: bool, after_s: float, said: str, monkeypatch) -> None:
    stream = Stream(terminal)
    monkeypatch.setattr(sys, "stderr", stream)
    waiting._tell.cache_clear()
    for wait_s in (10.0 if said else 0.0, 0.2):
        stream.written.clear()
        with waiting.note_if_slow("the kettle boils", after_s):
            assert stream.written.wait(wait_s) is (wait_s > 1.0)
    assert stream.getvalue() == said
