"""Devices, pipes and links as outputs: written through or refused, never replaced."""

import contextlib
import json
import os
import re
import shutil
import socket
import stat
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from nightly_fakes import CODE, INLINE, job, study

from actuator_lti.errors import InputError
from actuator_lti.files import atomic
from reports.nightly.history import SCHEMA
from reports.nightly.night import Settings, approve, run_night
from reports.nightly.state import HistoryLost, hold, state_of
from tests.refusals import refused

SIMULATE = ("simulate", "ilr33-amber", "--duration", "0.01", "--quiet")


def simulate(*options: str, **named: object) -> subprocess.CompletedProcess[str]:
    code = "import sys; from reports.cli.main import main; sys.exit(main())"
    command = [sys.executable, "-c", code, *SIMULATE, *options]
    return subprocess.run(command, text=True, timeout=120, check=False, **{"capture_output": True, **named})


DIRECTIONS = "\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"


@pytest.mark.parametrize("name", ["a\x1b[31mb.toml", "a\x9bb.toml", "a\udc80b.toml", "a\u202eb.toml"])
def test_a_terminal_is_told_of_no_file_in_its_own_commands(name, tmp_path, monkeypatch, cli) -> None:
    monkeypatch.chdir(tmp_path)
    words, data = cli.text("init", name), cli.text("init", name, "--force", "--json")
    assert (words[:8], json.loads(data)["file"]) == ("wrote a?", name)
    assert (words + data).replace("\n", "").isprintable()


@pytest.mark.parametrize("mark", DIRECTIONS)
def test_a_mark_of_direction_is_shown_not_obeyed(mark, capsys) -> None:
    from reports.cli.output import console, print_json, print_line, print_note, print_warning
    from reports.html import environment
    from reports.visible import escape

    words = f"a{mark}b"
    for say in (print_line, print_note, print_warning, console().print, print_json):
        say(words)
    said = capsys.readouterr()
    assert mark not in said.out + said.err
    assert json.loads(said.out.splitlines()[-1]) == words
    template = environment().from_string('<a title="{{ x }}">{{ x }}{{ x | upper }}{{ y }}</a>')
    assert template.render(x=words, y=7).count(f"U+{ord(mark):04X}") == 3
    assert mark not in escape(words)


def test_names_of_records_and_lines_on_standard_error(tmp_path, monkeypatch, cli) -> None:
    monkeypatch.chdir(tmp_path)
    name = "a\x1b[31mb\u202ec\x85d"
    record, judged = f"{name}.csv", ("correlate", "identify", "margins")
    for words in (
        ("simulate", "ilr33-amber", "--csv", record, "--command", "triangle", "--quiet"),
        ("correlate", "ilr33-amber", record, "--out", "c", "--quiet"),
        ("pdf", "c/correlation.json"),
        ("identify", record, "--design", "ilr33-amber", "--accept", "--out", "i", "--quiet"),
        ("margins", "i/ilr33-amber-identified.toml"),
        ("objects", "export", "ilr33-amber", "--out", f"{name}.toml"),
        ("objects", "import", f"{name}.toml", "--out", "o.toml"),
        ("margins", "o.toml"),
    ):
        assert cli(*words).status in (0, int(words[0] in judged)), words
    for page in (*Path().glob("?/*.html"), *Path().glob("?/*.json"), *Path().glob("?/*.toml")):
        assert set("\x1b\u202e\x85").isdisjoint(page.read_text(encoding="utf-8")), page
    obeyed = "\x1b[31m\u202e\x85"
    long, options = "9" * 5000, ("--x" + "y" * 9000, "--no" + obeyed)
    files = (("init", long), ("margins", "--load", long), ("margins", "no" + obeyed))
    for words in (*files, *(("keys", option) for option in options)):
        said = cli.refused(*words)
        assert (said[:-1].isprintable(), len(said) < 1100) == (True, True)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
def test_a_device_stays_a_device(cli) -> None:
    assert "/dev/full: cannot write: No space left" in cli.refused(*SIMULATE, "--csv", "/dev/full")
    atomic.write_text("/dev/null", "x")
    assert all(stat.S_ISCHR(os.stat(f"/dev/{name}").st_mode) for name in ("full", "null"))


def test_a_node_of_a_device_elsewhere_is_not_replaced(tmp_path) -> None:
    node = tmp_path / "full"
    try:
        os.mknod(node, 0o666 | stat.S_IFCHR, os.makedev(1, 7))
        node.open("wb").close()
    except OSError:
        pytest.skip("only root may make a node, and not everywhere")
    refused(atomic.write_text, node, "x", words="full: cannot write: No space left")
    assert stat.S_ISCHR(node.stat().st_mode)


@pytest.mark.skipif(not Path("/dev/stdout").exists(), reason="Linux")
def test_standard_output_gets_the_rows_and_a_file_behind_it_stays(tmp_path) -> None:
    assert simulate("--csv", "/dev/stdout").stdout.startswith('"time_s"')
    log = tmp_path / "log"
    with log.open("wb") as file:
        before = os.fstat(file.fileno()).st_ino
        done = simulate("--csv", "/dev/stdout", capture_output=False, stdout=file)
    assert (done.returncode, log.stat().st_ino) == (0, before)
    assert re.fullmatch(r'"time_s".*wrote /dev/stdout\s*', log.read_text(), re.S)


def test_a_pipe_gets_everything_or_is_refused_at_once(tmp_path) -> None:
    pipe, got = tmp_path / "pipe", []
    os.mkfifo(pipe)
    refused(atomic.write_text, pipe, "nobody reads", words="pipe: cannot write")
    holder = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(holder, True)

    def read() -> None:
        while piece := os.read(holder, 1 << 16):
            got.append(piece)

    writer = os.open(pipe, os.O_WRONLY)  # keeps the reader waiting until all is written
    reader = threading.Thread(target=read)
    reader.start()
    atomic.write_bytes(pipe, b"x" * 300_000)
    os.close(writer)
    reader.join(30)
    os.close(holder)
    assert sum(map(len, got)) == 300_000
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_links_are_followed_and_stay_links_and_a_socket_and_a_name_with_a_zero_are_refused(tmp_path) -> None:
    (tmp_path / "real").mkdir()
    file, link, dangling = tmp_path / "real" / "a", tmp_path / "link", tmp_path / "dangling"
    file.write_text("old")
    link.symlink_to(file)
    dangling.symlink_to(tmp_path / "real" / "b")
    atomic.write_together({link: b"new", dangling: b"there"})
    assert (link.is_symlink(), dangling.is_symlink(), file.read_text()) == (True, True, "new")
    assert sorted(os.listdir(tmp_path / "real")) == ["a", "b"]
    assert sorted(os.listdir(tmp_path)) == ["dangling", "link", "real"]
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    refused(atomic.write_text, loop, "x", words="loop")
    name = tmp_path / "s"
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(name))
        refused(atomic.write_text, name, "x", words="is no file")
    refused(atomic.write_text, tmp_path / "a\0b", "x", words="null")


def night(site: Path, margin: float = 10.0, settings: Settings = INLINE, **more: Any) -> None:
    run_night(study(job("a", margin)), site, settings, code=CODE, **more)


def contents(path: Path) -> dict[str, bytes]:
    below = [path, *path.rglob("*")] if path.is_dir() else [path]
    return {str(one): one.read_bytes() if one.is_file() else b"" for one in below if os.path.lexists(one)}


SITE = ("nights", "reports", "reports/*", "index.html", "summary.json", "junit.xml", ".nightly-site")
STATE = ("", "history.json", "nights", "nights/000001.json", "nightly.lock", "cache", "cache/ab")


@pytest.mark.parametrize("place", [f"site/{x}" for x in SITE] + [f"site.state/{x}".strip("/") for x in STATE])
def test_a_part_of_a_site_or_its_state_that_leads_elsewhere_is_refused(place, tmp_path) -> None:
    site, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    night(site)
    (tmp_path / "site.state" / "cache" / "ab").mkdir(exist_ok=True)
    (path,) = tmp_path.glob(place)
    path.rename(elsewhere)
    path.symlink_to(elsewhere)
    before = contents(elsewhere)
    refused(night, site, 12.0, match=f"{path.name}: is a symbolic link")
    if place.startswith("site.state"):
        with pytest.raises(InputError, match="is a symbolic link"):
            approve(study(job("a")), site, by="A", reason="b", settings=INLINE)
    assert contents(elsewhere) == before


@pytest.mark.parametrize("kind", ["link", "pipe", "folder", "device"])
def test_a_report_on_a_site_that_is_no_file_is_refused_without_reading_it(kind, tmp_path) -> None:
    site, mine = tmp_path / "site", tmp_path / "mine"
    mine.write_text("mine")
    night(site)
    (report,) = site.glob("reports/*/*/report.html")
    report.unlink()
    make = {"pipe": os.mkfifo, "folder": os.mkdir}
    target = {"link": mine, "device": "/dev/zero"}
    make[kind](report) if kind in make else report.symlink_to(target[kind])
    refused(night, site, words="report.html: is no regular file")
    assert mine.read_text() == "mine"


def test_a_site_is_where_one_stands_and_its_state_beside_it(tmp_path, monkeypatch) -> None:
    (tmp_path / "site").mkdir()
    monkeypatch.chdir(tmp_path / "site")
    night(Path())
    assert sorted(os.listdir(tmp_path)) == ["site", "site.state"]
    assert Path("index.html").is_file()
    refused(state_of, Path("/"), words="root of the disk")


@pytest.mark.parametrize("state", ["site", "site/state", "elsewhere/../site/x", "link/state"])
def test_a_state_inside_the_site_is_refused(state, tmp_path) -> None:
    site = tmp_path / "site"
    (tmp_path / "link").symlink_to(site)
    inside = replace(INLINE, state=tmp_path / state)
    refused(night, site, settings=inside, words="lies inside the site")
    assert not site.exists()


@pytest.mark.parametrize("place", ["site.state", "site.state/cache", "site.state/nights"])
@pytest.mark.parametrize("target", [None, "nowhere", "/dev/zero", "cache"])
def test_a_state_that_is_no_folder_is_named(place, target, tmp_path) -> None:
    path = tmp_path / place
    path.parent.mkdir(exist_ok=True)
    path.write_text("mine") if target is None else path.symlink_to(target)
    refused(night, tmp_path / "site", words="is no folder")


def test_a_cached_result_that_leads_elsewhere_is_built_again(tmp_path) -> None:
    site, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    night(site)
    (entry,) = (tmp_path / "site.state" / "cache").glob("*/*.entry")
    entry.rename(elsewhere)
    entry.symlink_to(elsewhere)
    said: list[str] = []
    night(site, say=said.append)
    assert "symbolic link" in " ".join(said)
    assert (len(said), entry.is_symlink(), elsewhere.is_file()) == (1, False, True)


@pytest.mark.parametrize("why", ["history lost", "history damaged", "history newer", "locked", "no designs"])
def test_a_night_that_is_refused_creates_nothing(why, tmp_path) -> None:
    site, state = tmp_path / "site", tmp_path / "site.state"
    jobs = () if why == "no designs" else (job("a"),)
    held = contextlib.nullcontext()
    if why == "history lost":
        night(site)
        shutil.rmtree(state)
    elif why == "history damaged":
        state.mkdir()
        (state / "history.json").write_text("no history" * 1000)
    elif why == "history newer":
        night(site)
        shutil.rmtree(site)
        (state / "history.json").write_text(json.dumps({"schema": SCHEMA, "version": 999}))
    elif why == "locked":
        held = hold(state)
    with held:
        before = contents(tmp_path).keys()
        with pytest.raises((InputError, HistoryLost)):
            run_night(study(*jobs), site, INLINE, code=CODE)
        assert contents(tmp_path).keys() ^ before <= {str(state / "nightly.lock")}
