"""Where the measured records are."""

from __future__ import annotations

from pathlib import Path

import pytest

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


def _found(name: str) -> Path:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"measured data are not here: ../shared/data/{name}")
    return path


@pytest.fixture(scope="session")
def emps_file() -> Path:
    return _found("emps/DATA_EMPS.mat")


@pytest.fixture(scope="session")
def odrive_files() -> dict[str, Path]:
    return {name: _found(f"odrive/{name}.csv") for name in ("step1", "step2", "chirp1")}
