"""Killed at any moment: the site stays whole, the history consistent, and the next run goes on."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from nightly_fakes import CODE, INLINE, job, study
from site_checks import check_whole

from reports.nightly.night import run_night

HERE = Path(__file__).parent
PATHS = os.pathsep.join([str(HERE), *filter(None, [os.environ.get("PYTHONPATH")])])
QUIET = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": PATHS}
KILLS = 60


@pytest.fixture
def fast_folder(tmp_path) -> Iterator[Path]:
    """A folder in memory where there is one: a killed process leaves the same there, and waits are short."""
    memory = Path("/dev/shm")
    if not os.access(memory, os.W_OK):
        yield tmp_path
        return
    with tempfile.TemporaryDirectory(prefix="nightly-", dir=memory) as folder:
        yield Path(folder)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills processes that were forked")
def test_sixty_kills_at_random_moments_lose_nothing(fast_folder: Path) -> None:
    site = fast_folder / "site"
    command = [sys.executable, str(HERE / "kill_target.py"), str(site), str(KILLS), "20260101"]
    done = subprocess.run(command, capture_output=True, text=True, env=QUIET, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    outcome = json.loads(done.stdout)
    assert outcome["killed"] == KILLS
    assert {"building", "publishing"} <= set(outcome["phases"])
    assert outcome["leftovers"] == 0


WITH_WORKERS = """
import sys
from pathlib import Path
from nightly_fakes import BUILD, CODE, job, study
from reports.nightly.night import Settings, run_night
if __name__ == "__main__":
    jobs = [job(f"d{k}", log=sys.argv[2], pause=0.15) for k in range(8)] + [job("hangs", mode="hang")]
    run_night(study(*jobs), Path(sys.argv[1]), Settings(workers=2, build=BUILD), code=CODE)
"""


def test_a_killed_nightly_takes_its_workers_along_and_resumes(tmp_path) -> None:
    site, log, script = tmp_path / "site", tmp_path / "log", tmp_path / "night.py"
    run_night(study(job("d0", 3.0)), site, INLINE, code=CODE)
    before = (site / "index.html").read_bytes()
    script.write_text(WITH_WORKERS)
    nightly = subprocess.Popen([sys.executable, str(script), str(site), str(log)], env=QUIET)
    _wait_for(lambda: log.exists() and len(log.read_text().split()) >= 4)
    workers = _children(nightly.pid)
    nightly.send_signal(signal.SIGKILL)
    nightly.wait()
    assert workers
    _wait_for(lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers))
    assert (site / "index.html").read_bytes() == before
    check_whole(site)
    built = set(log.read_text().split())
    jobs = [job(f"d{k}", log=str(log), pause=0.15) for k in range(8)]
    night = run_night(study(*jobs), site, INLINE, code=CODE)
    cached = {d.name for d in night.designs if d.result.cached}
    assert len(cached) >= len(built) - 2
    assert night.interrupted
    assert "did not end" in check_whole(site).text


def _children(parent: int) -> list[int]:
    result = []
    for entry in Path("/proc").iterdir():
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
        except (OSError, ValueError):
            continue
        if entry.name.isdigit() and int(fields[1]) == parent:
            result.append(int(entry.name))
    return result


def _wait_for(condition, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "did not come true in time"
        time.sleep(0.02)
