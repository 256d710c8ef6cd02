"""A full disk, a read-only site, damaged caches: told in one line, nothing lost."""

import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from nightly_fakes import CODE, INLINE, job, study
from site_checks import check_whole

from actuator_lti.errors import InputError
from reports.nightly.night import run_night

TOLD = re.compile("No space left on device|disk is full|disk I/O error")


@pytest.fixture
def small_disk(tmp_path) -> Iterator[Path]:
    """A file system of 16 MB, where this process may mount one."""
    place = tmp_path / "disk"
    place.mkdir()
    mount("-t", "tmpfs", "-o", "size=16m", "tmpfs", str(place))
    yield place
    subprocess.run(["umount", "-l", str(place)], check=False, capture_output=True)


def mount(*words: str) -> None:
    """Skip the test where that may not be done."""
    try:
        subprocess.run(["mount", *words], capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no mount here: {error}")


def nightly(site: Path, margin: float, **more):
    return run_night(study(*(job(f"d{k}", margin) for k in range(5))), site, INLINE, code=CODE, **more)


def test_a_disk_that_fills_up_at_any_point_leaves_the_last_night(small_disk: Path) -> None:
    site = small_disk / "site"
    nightly(site, 10.0)
    refused = 0
    for step, leave in enumerate(range(0, 690_000, 23_000)):
        ballast, free = small_disk / "ballast", os.statvfs(small_disk)
        ballast.write_bytes(b"\0" * max(0, free.f_bavail * free.f_frsize - leave))
        before, words = (site / "index.html").read_bytes(), ""
        try:
            nightly(site, 11.0 + step)
        except InputError as error:
            words = str(error)
        assert words or leave
        if words:
            refused += 1
            assert TOLD.search(words), words
            assert "\n" not in words
            assert (site / "index.html").read_bytes() == before
        check_whole(site)
        ballast.unlink()
    assert refused >= 5
    nightly(site, 99.0)
    assert "did not end" in check_whole(site).text


def test_a_read_only_site_keeps_the_old_night_and_catches_up(tmp_path) -> None:
    site = tmp_path / "site"
    nightly(site, 10.0)
    before = (site / "index.html").read_bytes()
    mount("--bind", str(site), str(site))
    try:
        mount("-o", "remount,ro,bind", str(site))
        with pytest.raises(InputError, match="Read-only file system"):
            nightly(site, 11.0)
        assert (site / "index.html").read_bytes() == before
        check_whole(site)
    finally:
        subprocess.run(["umount", str(site)], check=True, capture_output=True)
    nightly(site, 11.0)
    check_whole(site)


def test_a_result_that_cannot_be_read_back_makes_no_night_without_verdicts(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("reports.nightly.cache.MAX_ENTRY_BYTES", 100)
    with pytest.raises(InputError, match="vanished from the cache"):
        nightly(tmp_path / "site", 10.0)
    assert not (tmp_path / "site" / "index.html").exists()


def test_a_site_that_cannot_be_written_at_the_end_is_published_next_time(tmp_path, monkeypatch) -> None:
    site = tmp_path / "site"
    nightly(site, 10.0)
    before = (site / "index.html").read_bytes()

    def refuse(_night, folder: str) -> str:
        assert list((site / folder).glob("d0-*.html"))  # the pages are there
        raise InputError("cannot write: Read-only file system", where=str(site / "index.html"))

    with monkeypatch.context() as patch:
        patch.setattr("reports.nightly.pages.index", refuse)
        with pytest.raises(InputError, match="Read-only"):
            nightly(site, 11.0)
    assert (site / "index.html").read_bytes() == before
    assert len(list((site / "nights").iterdir())) == 1
    night = nightly(site, 11.0)
    assert len(night.runs) == 3
    assert all(d.result.cached for d in night.designs)
    check_whole(site)


@pytest.mark.parametrize("damage", ["flip", "truncate", "empty"])
def test_a_corrupt_cache_entry_is_told_and_built_again(tmp_path, damage: str) -> None:
    site, said = tmp_path / "site", []
    nightly(site, 10.0)
    for entry in (tmp_path / "site.state" / "cache").glob("*/*.entry"):
        data = entry.read_bytes()
        changed = {"flip": data[:200] + b"?" + data[201:], "truncate": data[:-9], "empty": b""}[damage]
        entry.write_bytes(changed)
    night = nightly(site, 10.0, say=said.append)
    assert len(said) == 5
    assert all("is corrupt" in line and "built again" in line for line in said)
    assert not any(d.result.cached for d in night.designs)
    check_whole(site)


def test_a_report_that_was_damaged_on_the_site_is_put_right(tmp_path) -> None:
    site = tmp_path / "site"
    nightly(site, 10.0)
    report = next(site.glob("reports/*/*/report.html"))
    whole = report.read_bytes()
    report.write_bytes(b"half")
    nightly(site, 10.0)
    assert report.read_bytes() == whole
