"""Killed at a file-system call: the site stays whole and the history sound."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
KILLS = 60


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kills processes that were forked")
def test_kills_at_calls_lose_nothing(tmp_path) -> None:
    quiet = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, str(HERE / "kill_at_calls.py"), str(tmp_path / "site"), str(KILLS), "18"]
    done = subprocess.run(command, capture_output=True, text=True, env=quiet, timeout=500, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    outcome = json.loads(done.stdout)
    assert outcome["calls"] > 100
    assert outcome["killed"] >= 0.9 * KILLS
