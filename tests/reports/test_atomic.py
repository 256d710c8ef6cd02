"""Files are whole or not there."""

import os
from pathlib import Path
from unittest.mock import Mock

import pytest

from actuator_lti.files import atomic
from tests.refusals import refused


def test_a_file_replaces_the_old_one_and_leaves_nothing_beside_it(tmp_path) -> None:
    target, plain = tmp_path / "new" / "a.txt", tmp_path / "plain"
    atomic.write_text(target, "one")
    atomic.write_text(target, "two µ")
    assert (target.read_text(encoding="utf-8"), os.listdir(target.parent)) == ("two µ", ["a.txt"])
    plain.write_text("x")
    assert target.stat().st_mode == plain.stat().st_mode  # the rights that any new file gets


def test_files_written_together_stay_old_if_one_cannot_be_written_and_what_is_in_the_way_is_named(tmp_path):
    (tmp_path / "a").write_text("old")
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "taken").mkdir()
    both = {tmp_path / "a": b"new", tmp_path / "file" / "b": b"new"}
    refused(atomic.write_together, both, words="cannot write")
    assert ".part" not in refused(atomic.write_text, tmp_path / "taken", "x", words="taken: cannot write")
    assert ((tmp_path / "a").read_text(), sorted(os.listdir(tmp_path))) == ("old", ["a", "file", "taken"])


def test_an_interrupt_while_writing_leaves_the_old_file(tmp_path, monkeypatch) -> None:
    target = tmp_path / "a"
    target.write_text("old")

    monkeypatch.setattr(atomic.os, "fsync", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        atomic.write_text(target, "new")
    assert (target.read_text(), os.listdir(tmp_path)) == ("old", ["a"])


def test_all_is_on_the_disk_before_anything_is_in_its_place(tmp_path, monkeypatch) -> None:
    steps: list[str] = []
    fsync, replace = os.fsync, os.replace

    def flushed(handle: int) -> None:
        steps.append(f"flush {os.fstat(handle).st_size}")
        fsync(handle)

    def moved(source: Path, target: Path) -> None:
        steps.append(f"move {Path(target).name}")
        replace(source, target)

    monkeypatch.setattr(atomic.os, "fsync", flushed)
    monkeypatch.setattr(atomic.os, "replace", moved)
    atomic.write_together({tmp_path / "a": b"x" * 7, tmp_path / "b": b"y" * 9})
    assert steps[:4] == ["flush 7", "flush 9", "move a", "move b"]
    assert [step[:5] for step in steps[4:]] == ["flush"] * (os.name == "posix")  # the folder's names
