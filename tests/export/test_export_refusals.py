"""What an export refuses: one line, status 2, nothing half-written."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import actuator_lti.compiled.compiler as build
from actuator_lti import load_design
from actuator_lti.compiled.compiler import system_compiler
from nonlinear.export import c_export
from reports.cli.main import main

NOISY = '[instruments]\ncurrent_noise = "0.1 A"\n'
needs_compiler = pytest.mark.skipif(
    system_compiler() is None or not sys.platform.startswith("linux"), reason="no C compiler on this machine"
)


@pytest.mark.parametrize("command", [["c", "emps", "--no-check"], ["fmu", "emps", "--plain"]])
@needs_compiler
def test_a_folder_that_cannot_be_written(command: list[str], tmp_path, cli) -> None:
    """A file in the place of a folder stops the super-user too; ``/proc`` takes no new files from anyone."""
    (tmp_path / "file").write_text("mine")
    more = ["--platform", "linux64"] if command[0] == "fmu" else []
    name = "drive.fmu" if command[0] == "fmu" else "drive"
    for folder in (tmp_path / "file", Path("/proc/1")):
        line = cli.refused("export", *command, *more, "--out", folder / name)
        assert str(folder) in line
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "mine"


def test_one_file_that_exists_and_no_other_is_written(tmp_path, cli) -> None:
    (tmp_path / "main.c").write_text("mine")
    line = cli.refused("export", "c", "emps", "--no-check", "--out", tmp_path)
    assert "main.c: exists already" in line
    assert [path.name for path in tmp_path.iterdir()] == ["main.c"]
    assert (tmp_path / "main.c").read_text() == "mine"


def test_no_compiler_for_a_unit(tmp_path, cli, monkeypatch) -> None:
    monkeypatch.setattr(build, "system_compiler", lambda: None)
    monkeypatch.setattr(build, "zig_command", lambda: None)
    for platform, said in (("linux64", "gcc or clang, or pip install"), ("win64", "allowed: pip install")):
        out = tmp_path / "drive.fmu"
        line = cli.refused("export", "fmu", "emps", "--plain", "--platform", platform, "--out", out)
        assert f"no C compiler for {platform}" in line
        assert said in line
    assert not list(tmp_path.iterdir())


def test_a_compiler_that_fails(tmp_path, cli, monkeypatch) -> None:
    broken = tmp_path / "cc"
    broken.write_text("#!/bin/sh\necho 'drive.c:1: error: out of order' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr(build, "compiler_for", lambda _: [str(broken)])
    out = tmp_path / "drive.fmu"
    line = cli.refused("export", "fmu", "emps", "--plain", "--platform", "linux64", "--out", out)
    assert "error: out of order" in line
    assert not out.exists()


def test_what_single_precision_cannot_say(tmp_path, cli) -> None:
    from actuator_lti.design.loader import design_text

    design = tmp_path / "noisy.toml"
    design.write_text(design_text("ilr33-amber") + NOISY)
    out = tmp_path / "c"
    line = cli.refused("export", "c", design, "--single", "--out", out)
    assert "noise and jitter need double precision" in line
    assert not out.exists()
    line = cli.refused("export", "c", "fin", "--single", "--out", out)
    assert "an elastic drive train or a friction map needs double precision" in line
    assert not out.exists()
    assert main(["export", "c", str(design), "--no-check", "--out", str(out)]) == 0


FILES = {
    "c": {"drive.h", "drive.c", "drive_design.h", "drive_design.c", "main.c", "README.md"},
    "controller": {"controller.h", "controller.c", "controller.hpp", "vectors.h", "main.c", "README.md"},
}


@pytest.mark.parametrize("name", FILES)
def test_a_folder_holds_all_files_of_its_export(name: str, tmp_path, cli) -> None:
    more = ["--no-check"] if name == "c" else []
    assert main(["export", name, "emps", *more, "--out", str(tmp_path / "out")]) == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES[name]


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["fmu", "emps", "--fmi", "4"], "4: allowed: 2 or 3"),
        (["fmu", "emps", "--platform", "vax"], "allowed: linux64, win64"),
        (["controller", "emps", "--prefix", "4fin"], "allowed: letters"),
        (["c", "no-such-design"], "no such design; allowed: "),
    ],
)
def test_unknown_versions_platforms_prefixes_and_designs(
    command: list[str], said: str, tmp_path, cli
) -> None:
    out = tmp_path / "out"
    assert said in cli.refused("export", *command, "--out", out)
    assert not out.exists()


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
