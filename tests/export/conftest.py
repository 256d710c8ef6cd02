"""The unit that most tests of the units look at."""

from pathlib import Path

import pytest

from actuator_lti import load_design


@pytest.fixture(scope="session", params=[2, 3])
def unit(request, tmp_path_factory) -> Path:
    """Of the baseline, in either version of FMI."""
    from fmu_host import written

    return written(tmp_path_factory.mktemp("unit"), load_design("ilr33-amber"), request.param)
