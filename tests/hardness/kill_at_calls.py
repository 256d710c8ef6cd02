"""Kills nightlies at their file-system calls, one after the other; looks at what is left.

``python kill_at_calls.py SITE``: each round starts a nightly of a study that has changed and kills it with
SIGKILL at one of its calls, then checks site and history. Prints one line of JSON.
"""

import json
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "nightly"))

import ruptures  # noqa: F401 - here, not in every child
from kill_target import check_history, child, night
from site_checks import check_whole

CALLS = ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.utime", "os.chmod", "shutil.rmtree")


def count_calls(tick: Callable[[str], None]) -> None:
    """Call ``tick`` before every call that changes or opens a file, and every fsync."""

    def audit(event: str, _arguments: tuple[object, ...]) -> None:
        if event in CALLS:
            tick(event)

    whole_fsync = os.fsync

    def fsync(handle: int) -> None:
        tick("fsync")
        whole_fsync(handle)

    os.fsync = fsync
    sys.addaudithook(audit)


def counted(site: Path, round_: int, last: int) -> tuple[int, int]:
    """A nightly in a process of its own that is killed at call ``last`` (0: not at all); status and calls."""
    read, write = os.pipe()

    @contextmanager
    def counting() -> Iterator[None]:
        done = [0]

        def tick(_event: str) -> None:
            done[0] += 1
            if done[0] == last:
                os.kill(os.getpid(), signal.SIGKILL)

        count_calls(tick)
        yield
        os.write(write, str(done[0]).encode())

    number = child(site, round_, counting)
    os.close(write)
    _, status = os.waitpid(number, 0)
    said = os.read(read, 32)
    os.close(read)
    return status, int(said or 0)


def main(site: Path) -> dict[str, int]:
    """Kill at each call in turn, from the same night on; every tenth site goes on afterwards."""
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
        assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0, status
        check_whole(site)
        check_history(state)
        if place % 10 == 0:
            assert counted(site, 2, 0)[0] == 0, place
            check_whole(site)
    return {"calls": calls, "killed": killed}


if __name__ == "__main__":
    sys.stdout.write(json.dumps(main(Path(sys.argv[1]))) + "\n")
