"""A run of `simulate` from the command line, read as its user reads it."""

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from reports.cli.main import main


class Run(NamedTuple):
    """Exit status, what is said on both streams, the facts of --json, the rows of --csv."""

    status: int
    said: str
    facts: dict[str, Any]
    rows: np.ndarray


@pytest.fixture
def run(tmp_path, capsys) -> Callable[..., Run]:
    """Run `simulate` with these words, its rows in ``run.csv``."""
    path = tmp_path / "run.csv"

    def call(words: str) -> Run:
        path.unlink(missing_ok=True)
        status = main(f"simulate {words} --csv {path} --json".split())
        out, err = capsys.readouterr()
        rows = np.genfromtxt(path, delimiter=",", names=True) if status == 0 else np.zeros(0)
        return Run(status, out + err, json.loads(out) if status == 0 else {}, rows)

    return call
