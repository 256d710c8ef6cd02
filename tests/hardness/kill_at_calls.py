"""Kills nightlies at their file-system calls, one after the other; looks at what is left.

``python kill_at_calls.py SITE``: each round starts a nightly of a study that has changed and kills it with
SIGKILL at one of the calls that change the disk, then checks site and history. A kill between two of them,
where a file is read or waited for, leaves what one at the second leaves. Prints one line of JSON.
"""

import json
import os
import shutil
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).parents[1] / "nightly"))

import ruptures  # noqa: F401 - here, not in every child
from nightly_fakes import CODE, INLINE, job, study
from site_checks import check_whole

from reports.nightly.history import open_history
from reports.nightly.night import run_night

CALLS = ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.utime", "os.chmod", "shutil.rmtree")
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
DESIGNS = 6


def night(site: Path, round_: int) -> None:
    """One nightly, here, of a study of which half changes with every round."""
    jobs = [job(f"design {k}", 10.0 + (round_ % 50 if k % 2 else 0), pause=0.003) for k in range(DESIGNS)]
    run_night(study(*jobs), site, INLINE, code=CODE)


def check_history(state: Path) -> None:
    """Every finished night has all of its results, and the files are sound."""
    history = open_history(state)
    for run in history.runs:
        results = history.night(run.id).results
        assert len(results) == DESIGNS, run
        for result in results:
            assert history.figures(result), result
    assert len({run.id for run in history.runs}) == len(history.runs)
    assert history.index.begun >= len(history.runs) + len(history.index.interrupted)


def count_calls(tick: Callable[[], None]) -> None:
    """Call ``tick`` before every call that changes the disk; a file is opened as (path, mode, flags)."""

    def audit(event: str, given: tuple[Any, ...]) -> None:
        if event in CALLS and (event != "open" or given[2] & WRITING):
            tick()

    sys.addaudithook(audit)


def counted(site: Path, round_: int, last: int) -> tuple[int, int]:
    """A nightly in a process of its own that is killed at call ``last`` (0: not at all); status and calls."""
    read, write = os.pipe()
    number = os.fork()
    if number == 0:
        done, status = 0, 1

        def tick() -> None:
            nonlocal done
            done += 1
            if done == last:
                os.kill(os.getpid(), signal.SIGKILL)

        try:
            count_calls(tick)
            night(site, round_)
            os.write(write, str(done).encode())
            status = 0
        finally:
            if status:
                traceback.print_exc()
            os._exit(status)
    os.close(write)
    _, status = os.waitpid(number, 0)
    said = os.read(read, 32)
    os.close(read)
    return status, int(said or 0)


def main(site: Path) -> dict[str, int]:
    """Kill at each call in turn, from the same night on; every sixth site goes on afterwards."""
    night(site, 0)
    state, before = site.with_name(site.name + ".state"), site.with_name("before")
    folders = {path: before / path.name for path in (site, state)}
    for path, copy in folders.items():
        shutil.copytree(path, copy)
    status, calls = counted(site, 1, 0)
    assert status == 0, status
    killed = 0
    for place in range(1, calls + 1):
        for path, copy in folders.items():
            shutil.rmtree(path)
            shutil.copytree(copy, path)
        status, _ = counted(site, 1, place)
        killed += os.WIFSIGNALED(status)
        assert os.WIFSIGNALED(status) or status == 0, status
        check_whole(site)
        check_history(state)
        if place % 6 == 0:
            for again in (place, 2 * place):  # killed on what a kill has left
                counted(site, 2, again)
            assert counted(site, 2, 0)[0] == 0, place
            check_whole(site)
            check_history(state)
            assert not [part for folder in folders for part in folder.rglob(".*.part")], place
    return {"calls": calls, "killed": killed}


if __name__ == "__main__":
    sys.stdout.write(json.dumps(main(Path(sys.argv[1]))) + "\n")
