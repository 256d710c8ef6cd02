"""A history that is lost or damaged is told, by name, and never opens the gate."""

import json
import random
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from nightly_fakes import CODE, INLINE, job, study

from actuator_lti.errors import InputError
from reports.nightly.history import _INDEX, open_history
from reports.nightly.night import Settings, approve, run_night
from reports.nightly.state import INDEX, HistoryLost, Memory, remembered
from reports.nightly.text import sha256
from tests.refusals import refused

AGAIN = replace(INLINE, accept_lost_history=True)
DAMAGE_ROUNDS = 250


def night(site: Path, margin: float, settings: Settings = INLINE):
    return run_night(study(job("a", margin), job("b")), site, settings, code=CODE)


def approved(site: Path) -> None:
    approve(study(job("a"), job("b")), site, by="x", reason="y", settings=INLINE)


def state(site: Path) -> Path:
    return site.with_name(site.name + ".state")


@pytest.fixture
def site(tmp_path) -> Path:
    """Two nights and an approval."""
    site = tmp_path / "site"
    night(site, 10.0)
    approved(site)
    night(site, 10.5)
    return site


def rewritten(site: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change the index, and its checksum with it."""
    path = state(site) / INDEX
    sealed = json.loads(path.read_text())
    change(sealed["index"])
    try:
        written = _INDEX.dump_json(_INDEX.validate_python(sealed["index"]))
    except ValueError:
        written = b""  # of no shape that could have been sealed
    path.write_text(json.dumps({**sealed, "sha256": sha256(written)}))


def take_that_of_another(site: Path) -> None:
    other = site.with_name("other")
    for margin in (1.0, 2.0, 3.0):
        night(other, margin)
    shutil.rmtree(state(site))
    shutil.copytree(state(other), state(site))


LOSSES: dict[str, Callable[[Path], object]] = {
    "all": lambda site: shutil.rmtree(state(site)),
    "the index": lambda site: (state(site) / INDEX).unlink(),
    "what the index holds": lambda site: (state(site) / INDEX).write_bytes(b""),
    "the last night": lambda site: rewritten(site, lambda index: index["runs"].pop()),
    "the approval": lambda site: rewritten(site, lambda index: index["baselines"].clear()),
    "its own, for another's": take_that_of_another,
}


@pytest.mark.parametrize("lost", LOSSES)
def test_a_lost_history_closes_the_gate_until_somebody_says_so(site, lost: str) -> None:
    index = (site / "index.html").read_bytes()
    LOSSES[lost](site)
    for _ in range(2):  # the first refusal must not make the second night pass
        with pytest.raises(HistoryLost, match=r"^.*2 night\(s\) and 1 approval\(s\).*--accept-lost-history$"):
            night(site, 3.0)
    with pytest.raises(HistoryLost):
        approved(site)
    assert (site / "index.html").read_bytes() == index
    night(site, 12.0, AGAIN)
    night(site, 12.0)  # from here on it is known again
    assert remembered(site) == open_history(state(site)).memory()


def test_a_site_of_an_older_version_or_a_damaged_summary_remembers_one_night(site) -> None:
    summary = site / "summary.json"
    for text in ("{}", "[]", "{", '{"history": {"nights": "many", "approvals": true}}', ""):
        summary.write_text(text)
        assert remembered(site) == Memory("", 1, 0), text
    summary.write_text('{"history": {"id": 3, "nights": 7, "approvals": "many"}}')
    assert remembered(site) == Memory("", 7, 0)  # one wrong field takes none of the others along
    summary.unlink()
    assert remembered(site) == Memory("", 1, 0)
    LOSSES["the index"](site)
    with pytest.raises(HistoryLost, match="1 night"):
        night(site, 3.0)


def test_the_command_exits_1_with_one_line(tmp_path, cli, monkeypatch) -> None:
    monkeypatch.setattr("reports.nightly.compute.build", lambda payload: pytest.fail("built"))
    (tmp_path / ".nightly-site").write_text("x")
    (tmp_path / "summary.json").write_text('{"history": {"id": "i", "nights": 7, "approvals": 1}}')
    ran = cli("nightly", "ilr33-amber", "--site", tmp_path, "--quiet")
    assert (ran.status, ran.err.count("\n")) == (1, 1)
    assert "7 night(s) and 1 approval(s)" in ran.err


def test_the_history_of_an_earlier_version_is_refused_and_left(site) -> None:
    earlier = (state(site) / INDEX).rename(state(site) / "history.sqlite")
    for begin in (lambda: night(site, 3.0), lambda: approved(site)):
        with pytest.raises(HistoryLost, match=r"earlier version.*--accept-lost-history"):
            begin()
    night(site, 3.0, AGAIN)
    assert earlier.is_file()


@pytest.mark.parametrize("damaged", [INDEX, "nights/000001.json"])
@pytest.mark.parametrize("text", ["{", "{}"])
def test_what_is_damaged_says_how_to_begin_anew(site, damaged: str, text: str) -> None:
    (state(site) / damaged).write_text(text)
    for settings in (INLINE, AGAIN):  # nothing is thrown away by itself
        refused(night, site, 3.0, settings, words=(damaged, f"move {INDEX} away", "--accept-lost-history"))
    (state(site) / INDEX).rename(state(site) / "damaged.json")
    night(site, 12.0, AGAIN)
    night(site, 12.0)


def test_any_damage_is_told_or_harmless(site) -> None:
    """Bytes are overwritten, cut off and inserted: every text and number is held by a checksum."""
    paths = [state(site) / INDEX, *sorted((state(site) / "nights").iterdir())]
    draw, told = random.Random(18), []
    before = everything(site)
    for turn in range(DAMAGE_ROUNDS):
        path = paths[turn % len(paths)]
        whole = path.read_bytes()
        data = bytearray(whole)
        for _ in range(draw.choice((1, 1, 4, 40))):
            place = draw.randrange(len(data))
            data[place : place + draw.randrange(1, 9)] = draw.randbytes(draw.randrange(1, 9))
        if draw.random() < 0.1:
            del data[draw.randrange(len(data)) :]
        path.write_bytes(bytes(data))
        try:
            assert everything(site) == before
        except InputError as error:
            told.append((str(error), path.name))
        path.write_bytes(whole)
    assert all(line.isprintable() and name in line for line, name in told)
    assert len(told) > 0.9 * DAMAGE_ROUNDS


def everything(site: Path) -> list[object]:
    history = open_history(state(site))
    results = [result for run in history.runs for result in history.night(run.id).results]
    figures = [(history.figures(result), history.inputs(result)) for result in results]
    return [history.index, results, figures, history.matrix(results, ["GM: value"]).tolist()]


@pytest.mark.parametrize("name", ["", "000001.json", "000002.json"])
def test_a_night_that_is_missing_is_told(site, name: str) -> None:
    path = state(site) / "nights" / name
    shutil.rmtree(path) if not name else path.unlink()
    for read in (lambda: everything(site), lambda: night(site, 4.0)):
        refused(read, match=r"\d\.json: is damaged \(is missing\): restore it from a copy")


@pytest.mark.parametrize("change", [
    lambda index: index["runs"][0].update(started=5),
    lambda index: index["runs"][0].update(id="1"),
    lambda index: index["runs"][0].pop("code"),
    lambda index: index["runs"][0].update(libraries={"numpy": 2}),
    lambda index: index["baselines"][0].update(by=None),
    lambda index: index.update(interrupted="never"),
])  # fmt: skip
def test_a_value_of_another_kind_is_damage(site, change) -> None:
    rewritten(site, change)
    refused(open_history, state(site), words="is damaged")
