"""The stand-ins of the nightly's tests serve here, too; a folder in memory."""

import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))
sys.path.append(str(Path(__file__).parents[1] / "nightly"))


@pytest.fixture
def in_memory() -> Iterator[Path]:
    """A folder in memory where there is such a place: a kill leaves there what it leaves on a disk."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None) as folder:
        yield Path(folder)
