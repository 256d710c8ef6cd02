"""The report of the shipped baseline, validation included, built once for all tests of this folder."""

import pytest
from built_report import Built, validated

from actuator_lti import load_design
from reports.build import design_report, write_report


@pytest.fixture(scope="session")
def built(tmp_path_factory) -> Built:
    """Build the report of ilr33-amber at a fixed time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        document = design_report(load_design("ilr33-amber"), validated())
    page, data = write_report(document, tmp_path_factory.mktemp("report"))
    return Built(document, page, data)
