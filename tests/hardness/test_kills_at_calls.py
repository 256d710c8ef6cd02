"""Nights and cluster studies killed at any moment, nights at each call: nothing is lost, nothing changes."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

HERE = Path(__file__).parent
pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="kills processes that were forked")


def killed(script: str, *words: object) -> dict:
    """What a script that kills says in the end."""
    quiet = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, str(HERE / script), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, env=quiet, timeout=800, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


def test_sixty_kills_at_random_moments_lose_nothing() -> None:
    """In memory where there is a place: a killed process leaves the same there, and waits are short."""
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="nightly-", dir=memory) as folder:
        outcome = killed("../nightly/kill_target.py", Path(folder) / "site", 60, 20260101)
    assert (outcome["killed"], outcome["leftovers"]) == (60, 0)
    assert {"building", "publishing"} <= set(outcome["phases"])


def test_a_kill_at_any_call_loses_nothing(tmp_path) -> None:
    """Each of them once: a site or a history out of order shows between two of its calls alone."""
    outcome = killed("kill_at_calls.py", tmp_path / "site")
    assert outcome["killed"] == outcome["calls"] > 100


def test_kills_of_clients_workers_and_schedulers_change_no_result(tmp_path) -> None:
    """Samples kept, samples reduced on the workers, a comparison: the same bytes as undisturbed."""
    outcome = killed("kill_cluster.py", tmp_path, 10, 27)
    assert sum(outcome["killed"].values()) >= 10
    assert set(outcome["killed"]) >= {"client", "worker"}
