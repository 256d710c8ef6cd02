"""Kills clients, workers and schedulers of cluster studies at random moments; looks at what comes of them.

``python kill_cluster.py FOLDER KILLS SEED``: a scheduler and two workers are processes of this machine. Each
round starts a study, or goes on with it, and kills one of them with SIGKILL. A study that has ended is held
against one that nobody disturbed: its result, and every file that it keeps. Prints one line of JSON.
"""

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from multiprocessing.context import ForkProcess
from pathlib import Path

import pyarrow.parquet  # noqa: F401 - here, not in every child
from distributed import cli
from distributed.cli import dask_scheduler, dask_worker  # noqa: F401

from actuator_lti import NumericalError, load_design
from analyses.comparison.variants import compare
from analyses.monte_carlo import MonteCarloSettings, monte_carlo, run
from analyses.studies.engine import Engine
from analyses.studies.study import load_study

LOST = 3  # the scheduler, said in one line
VICTIMS = ("client", "client", "worker", "worker", "scheduler")
ENDS = {"client": (0, -signal.SIGKILL), "worker": (0,), "scheduler": (0, LOST)}
SWEEP = """[study]
base = "ctms-motor-position"
[[sweep]]
parameter = "control.position.gain"
from = "9 V/rad"
to = "15 V/rad"
points = 8
"""


def kept(folder: Path, engine: Engine) -> object:
    """A study of which every sample is kept."""
    asked = MonteCarloSettings(samples=1000, chunk=25, worst_cases=False)
    made = monte_carlo(load_design("ilr33-amber"), folder, asked, engine=engine)
    return made.odds, made.columns, made.nominal, made.drivers


def reduced(folder: Path, engine: Engine) -> object:
    """A study whose samples are reduced on the workers."""
    run.KEPT, run.BLOCK, run.NOTED_S = 999, 50, 0.05
    return kept(folder, engine)


def compared(folder: Path, engine: Engine) -> object:
    plan = folder.with_suffix(".toml")
    plan.write_text(SWEEP)
    found = compare(load_study(plan), engine=engine, folder=folder)
    return [(one.figures, one.verdicts, one.differences) for one in found.all]


STUDIES: tuple[Callable[[Path, Engine], object], ...] = (kept, reduced, compared)


class Forked(ForkProcess):
    """A process of this one, used as `subprocess.Popen` is."""

    wait = ForkProcess.join

    def poll(self) -> int | None:
        return self.exitcode


class Cluster:
    def __init__(self, folder: Path) -> None:
        self.file, self.log = folder / "scheduler.json", folder / "cluster.log"
        self.scheduler: subprocess.Popen[bytes] | Forked | None = None
        self.workers: list[subprocess.Popen[bytes] | Forked] = []

    def start(self, workers: int = 2) -> None:
        if self.scheduler is None:
            self.end()
            self.file.unlink(missing_ok=True)
            self.scheduler = self._process({}, "dask_scheduler", "--port", "0")
            while not self.address:
                assert self.scheduler.poll() is None
                time.sleep(0.02)
        while len(self.workers) < workers:
            self.add_worker()

    def add_worker(self, **environment: str) -> None:
        """Start one more; without a nanny, which would set threads by itself."""
        self.workers.append(self._process(environment, "dask_worker", "--no-nanny", "--nthreads", "1"))

    @property
    def address(self) -> str:
        """Where the scheduler listens; empty until it has written all of it."""
        with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
            return json.loads(self.file.read_text())["address"]
        return ""

    def _process(
        self, environment: dict[str, str], kind: str, *words: str
    ) -> subprocess.Popen[bytes] | Forked:
        """A program of the library; forked where no thread runs and the library is there."""
        words = ("--no-dashboard", "--host", "127.0.0.1", "--scheduler-file", str(self.file), *words)
        if __name__ == "__main__" and not environment:
            process = Forked(target=self._serve, args=(kind, words))
            process.start()
            return process
        command = [sys.executable, "-m", f"distributed.cli.{kind}", *words]
        with self.log.open("ab") as log:
            return subprocess.Popen(command, stdout=log, stderr=log, env={**os.environ, **environment})

    def _serve(self, kind: str, words: tuple[str, ...]) -> None:
        with self.log.open("ab") as log:
            os.dup2(log.fileno(), 1)
            os.dup2(log.fileno(), 2)
        getattr(cli, kind).main(words)

    def kill(self, victim: str, draw: random.Random) -> None:
        if victim == "scheduler":
            process, self.scheduler = self.scheduler, None
        else:
            process = self.workers.pop(draw.randrange(len(self.workers)))
        process.kill()
        process.wait()

    def end(self) -> None:
        for process in filter(None, (self.scheduler, *self.workers)):
            process.kill()
            process.wait()
        self.scheduler, self.workers = None, []


def child(number: int, folder: Path, engine: Engine) -> int:
    """A study in a process of its own, what it finds beside its folder; the process's number."""
    process = os.fork()
    if process == 0:
        status = 1
        try:
            found = repr(STUDIES[number % len(STUDIES)](folder, engine))
            folder.with_suffix(".found").write_text(found.replace(str(folder), ""))
            status = 0
        except NumericalError as error:
            told = "the same command goes on" in str(error) and "\n" not in str(error)
            status = LOST if told else 1
        except BaseException:  # noqa: BLE001 - told, and seen by its status
            traceback.print_exc()
        finally:
            os._exit(status)
    return process


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a study, and what was found."""
    files = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    files["found"] = folder.with_suffix(".found")
    # a note of a reduced study says in which order its parts ended; ".part": killed while it was written
    return {
        name: path.read_bytes()
        for name, path in files.items()
        if not name.startswith("reduced-") and path.suffix != ".part"
    }


def ended(process: int, most_s: float = 240.0) -> int:
    """How a process ended: its status, or minus the signal."""
    end = time.monotonic() + most_s
    while True:
        number, status = os.waitpid(process, os.WNOHANG)
        if number:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > end:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
            raise TimeoutError("a study that never ends")
        time.sleep(0.01)


@cache
def undisturbed(number: int, top: Path, cluster: Cluster) -> tuple[dict[str, bytes], float]:
    """What a study leaves when nobody is killed, and how long it took."""
    begin, folder = time.monotonic(), top / f"plain-{number}"
    assert ended(child(number, folder, Engine(scheduler=cluster.address))) == 0
    return contents(folder), time.monotonic() - begin


def one_study(number: int, top: Path, cluster: Cluster, draw: random.Random) -> Iterator[str]:
    """Disturb one study until it has ended; whom each kill met while the study ran."""
    cluster.start()
    (plain, usual_s), folder = undisturbed(number % len(STUDIES), top, cluster), top / f"study-{number}"
    status = None
    while status != 0:
        cluster.start()
        process = child(number, folder, Engine(scheduler=cluster.address))
        time.sleep(draw.uniform(0.0, usual_s))
        victim = draw.choice(VICTIMS)
        if os.waitpid(process, os.WNOHANG) != (0, 0):
            break
        if victim == "client":
            os.kill(process, signal.SIGKILL)
        else:
            cluster.kill(victim, draw)
        yield victim
        status = ended(process)
        assert status in ENDS[victim], (victim, status)
    assert contents(folder) == plain, number


def main(top: Path, kills: int, seed: int) -> dict[str, object]:
    """Disturb one study after the other until there were enough kills."""
    draw, met, number = random.Random(seed), Counter[str](), 0
    cluster = Cluster(top)
    try:
        while met.total() < kills:
            met.update(one_study(number, top, cluster, draw))
            number += 1
    finally:
        cluster.end()
    return {"studies": number, "killed": met}


if __name__ == "__main__":
    sys.stdout.write(json.dumps(main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))) + "\n")
