"""The unit that most tests of the units look at."""

from pathlib import Path

import pytest

from actuator_lti import load_design


@pytest.fixture(scope="session", params=[2, 3])
def unit(request, once) -> Path:
    """Of the baseline, in either version of FMI."""
    from fmu_host import fmu_bytes

    design, version = load_design("ilr33-amber"), request.param
    return once(
        f"drive{version}.fmu", lambda path: path.write_bytes(fmu_bytes(design, version, ("linux64",)))
    )
