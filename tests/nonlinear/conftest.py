"""A run of `simulate` from the command line, read as its user reads it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.command_line import Command


@dataclass(frozen=True)
class Simulate:
    """Run `simulate` with these words: the facts of --json, the rows of --csv."""

    cli: Command
    path: Path

    def __call__(self, words: str) -> tuple[dict[str, Any], np.ndarray]:
        facts = self.cli.data("simulate", *words.split(), "--csv", self.path)
        return facts, np.genfromtxt(self.path, delimiter=",", names=True)

    def refused(self, words: str) -> str:
        return self.cli.refused("simulate", *words.split(), "--csv", self.path)


@pytest.fixture
def run(tmp_path, cli) -> Simulate:
    return Simulate(cli, tmp_path / "run.csv")
