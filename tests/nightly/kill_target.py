"""Kills nightlies at random moments and looks at what is left; run by the tests in a process of its own.

``python kill_target.py SITE KILLS SEED``: each round starts a nightly of a study that has changed, kills it
with SIGKILL at a random moment, and checks site and history.  Prints one line of JSON.
"""

import json
import os
import random
import signal
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import ruptures  # noqa: F401 - here, not in every child
from nightly_fakes import CODE, INLINE, job, study
from site_checks import check_whole

from reports.nightly.history import open_history
from reports.nightly.night import run_night

DESIGNS = 6


def jobs(round_: int) -> list:
    """A study of which half changes with every round."""
    return [job(f"design {k}", 10.0 + (round_ % 50 if k % 2 else 0), pause=0.003) for k in range(DESIGNS)]


def night(site: Path, round_: int) -> None:
    """One nightly, here."""
    run_night(study(*jobs(round_)), site, INLINE, code=CODE)


def child(site: Path, round_: int, around: Callable[[], AbstractContextManager[None]] = nullcontext) -> int:
    """Start a nightly, within a context, in a process of its own; its number."""
    number = os.fork()
    if number == 0:
        try:
            with around():
                night(site, round_)
        finally:
            if sys.exc_info()[1] is not None:
                traceback.print_exc()
            os._exit(0 if sys.exc_info()[1] is None else 1)
    return number


def check_history(state: Path) -> int:
    """Every finished night has all of its results, and the files are sound; how many finished."""
    history = open_history(state)
    for run in history.runs:
        results = history.night(run.id).results
        assert len(results) == DESIGNS, run
        for result in results:
            assert history.figures(result), result
    assert len({run.id for run in history.runs}) == len(history.runs)
    assert history.index.begun >= len(history.runs) + len(history.index.interrupted)
    return len(history.runs)


def main(site: Path, kills: int, seed: int) -> dict[str, object]:
    """Kill until there were enough kills; every round is looked at."""
    draw = random.Random(seed)
    night(site, 0)
    round_, killed, finished, phases = 1, 0, 0, set()
    while killed < kills:
        if killed % 6 == 0:  # a machine that grew busy is slower than it was
            usual = undisturbed(site, round_)
            round_ += 1
        number = child(site, round_)
        time.sleep(draw.uniform(0.0, 1.3 * usual))
        phases.add(phase(site))
        os.kill(number, signal.SIGKILL)
        _, status = os.waitpid(number, 0)
        if os.WIFSIGNALED(status):
            killed += 1
        else:
            assert os.WEXITSTATUS(status) == 0, status
            finished += 1
        check_whole(site)
        check_history(site.with_name(site.name + ".state"))
        round_ += 1
    undisturbed(site, round_)
    check_whole(site)
    leftovers = [p for top in (site, site.with_name(site.name + ".state")) for p in top.rglob(".*.part")]
    return {"killed": killed, "finished": finished, "phases": sorted(phases), "leftovers": len(leftovers)}


def undisturbed(site: Path, round_: int) -> float:
    """How long a nightly takes now, in s."""
    start = time.monotonic()
    _, status = os.waitpid(child(site, round_), 0)
    assert status == 0, status
    return time.monotonic() - start


def phase(site: Path) -> str:
    """Roughly how far the nightly has come, seen from outside."""
    index = json.loads((site / "summary.json").read_text())["run"]
    nights = [int(p.name.partition("-")[0]) for p in (site / "nights").iterdir()]
    if any(n > index for n in nights):
        return "publishing"
    return "building" if (site.with_name(site.name + ".state") / "holder.json").exists() else "outside"


if __name__ == "__main__":
    sys.stdout.write(json.dumps(main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))) + "\n")
