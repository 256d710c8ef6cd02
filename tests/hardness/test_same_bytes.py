"""report.json has the same bytes whatever kernel and however many threads the linear algebra uses."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

from reports.certain import certain, same_order

DOCUMENT = """
import sys
from actuator_lti.design import load_design
from reports.build import design_report
from reports.document import dumps
sys.stdout.write(dumps(design_report(load_design("ilr33-amber"))))
"""


def document(**environment: str) -> bytes:
    given = {**os.environ, "SOURCE_DATE_EPOCH": "0", **environment}
    done = subprocess.run(
        [sys.executable, "-c", DOCUMENT], capture_output=True, env=given, check=True, timeout=300
    )
    return done.stdout


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names of kernels of one family of processors")
def test_the_document_does_not_depend_on_kernel_and_threads() -> None:
    ways = [("Haswell", "1"), ("SkylakeX", "2"), ("Nehalem", "1")]
    made = [document(OPENBLAS_CORETYPE=core, OPENBLAS_NUM_THREADS=threads) for core, threads in ways]
    assert len(made[0]) > 100_000
    assert made[0] == made[1] == made[2]


def test_rounding_keeps_what_is_certain_and_nothing_else() -> None:
    third = 1.0 / 3.0
    for ulp in (third, third * (1.0 + 4e-15), third * (1.0 - 4e-15)):
        assert certain(ulp) == 0.33333333
    assert certain(9.2e-7) == 9.2e-7
    assert certain(
        {"s_peak": {"frequency_hz": 63.771488913938995, "x_db": 1.4740612903870745, "y_deg": 4.92010755e-7}}
    ) == {
        "s_peak": {"frequency_hz": 63.771, "x_db": 1.4740613, "y_deg": 4.92e-07},
    }
    assert certain([40.0, -1.9e-15, None, "a", 7]) == [40.0, 0.0, None, "a", 7]
    table = {
        "kind": "table",
        "columns": [{"key": "a", "unit": "deg"}],
        "rows": [{"a": 4.9201e-7, "b": 4.9201e-7}],
    }
    assert certain(table)["rows"] == [{"a": 4.92e-7, "b": 4.9201e-7}]
    assert certain(-0.0) == 0.0
    assert str(certain([-1e-17])) == "[0.0]"


def test_the_command_line_fixes_the_order_unless_told_otherwise(monkeypatch) -> None:
    from reports.cli.main import main

    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    monkeypatch.delenv("MKL_CBWR", raising=False)
    assert main(["--version"]) == 0
    assert os.environ["OPENBLAS_NUM_THREADS"] == "2"
    assert os.environ["MKL_CBWR"] == same_order()["MKL_CBWR"]
