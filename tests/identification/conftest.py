"""Where the measured records are, a small campaign, and commands with what they say."""

from collections.abc import Callable
from pathlib import Path

import pytest

from actuator_lti.design import load_design, write_design
from actuator_lti.design.model import Design
from examples.virtual_bench import BenchPlan, measure_bench, simulate_bench, write_bench
from tests.command_line import Command, Ran
from tests.identification.bench_records import Columns, write

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


@pytest.fixture(scope="session")
def bench(tmp_path_factory) -> Path:
    """The folder of a small campaign: three speeds, three loads."""
    plan = BenchPlan(speeds_rad_s=(105.0, 500.0, 940.0), loads_Nm=(0.0, 3.0, 8.0), duration_s=2.5)
    logs, _ = measure_bench(simulate_bench(load_design("ilr33-amber"), plan), 2)
    return write_bench(tmp_path_factory.mktemp("bench"), logs, design="ilr33-amber", seed=2).parent


@pytest.fixture
def identify(tmp_path: Path, cli: Command) -> Callable[..., Ran]:
    """Identify a drive from columns, written as ``r.csv`` (a design beside it as ``d.toml``), into ``o``."""

    def ran(columns: Columns, design: Design | str = "ilr33-amber", *words: object, mark: str = ",") -> Ran:
        record = write(tmp_path / "r.csv", columns, mark=mark)
        if isinstance(design, Design):
            (tmp_path / "d.toml").write_text(write_design(design))
            design = str(tmp_path / "d.toml")
        return cli("identify", record, "--design", design, *words, "--out", tmp_path / "o", "--json")

    return ran
