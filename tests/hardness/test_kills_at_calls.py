"""Nights killed at each call, cluster studies at any moment: nothing is lost, nothing changes."""

import json
import os
import subprocess
import sys
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


def test_a_kill_at_any_call_loses_nothing(in_memory) -> None:
    """Each of them once: a site or a history out of order shows between two of its calls alone."""
    outcome = killed("kill_at_calls.py", in_memory / "site")
    assert outcome["killed"] == outcome["calls"] > 100


def test_kills_of_clients_workers_and_schedulers_change_no_result(tmp_path) -> None:
    """Samples kept, samples reduced on the workers, a comparison: the same bytes as undisturbed."""
    outcome = killed("kill_cluster.py", tmp_path, 10, 27)
    assert sum(outcome["killed"].values()) >= 10
    assert set(outcome["killed"]) >= {"client", "worker"}
