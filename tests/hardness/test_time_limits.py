"""The stated time of a command holds where the work is worst: designs at the edge of what is taken.

What is looked at is that the process has ended by its hard limit; how fast the machine is plays no part.
"""

import subprocess
import sys

import pytest

from actuator_lti.bounds import COMMAND_SECONDS, STUDY_SECONDS
from actuator_lti.errors import OutOfTime
from reports.cli import time_limit
from reports.cli.app import PANELS
from reports.cli.errors import run

SECONDS = 1.0
STARTED_S = 60.0  # until Python has read its modules on a machine that is busy
CODE = "import sys; from reports.cli.main import main; sys.exit(main())"
SLOPE = ("fin", "--set", "load.moment_slope=300 N*m/rad")
LATE = ("fin", "--set", "control.computing_delay=20 ms")
WORST = {
    "cycles": SLOPE,  # its limit cycle is slow: minutes of simulation, all of it compiled
    "report": (*LATE, "--out", "r"),  # loops with the states of 200 late ticks
    "failures": ("ilr33-amber", "--duration", "30"),  # a second watched is done within the limit
    "tune": ("joint", "--out", "t"),
    "montecarlo": ("joint", "--samples", "100000000", "--out", "m"),
    "validate": ("joint", "--out", "v"),
    "simulate": ("ilr33-amber", "--duration", "90000", "--every", "1000000"),
}


@pytest.mark.parametrize("command", WORST)
def test_a_command_has_ended_by_its_limit(command: str, tmp_path) -> None:
    words = ["--time-limit", f"{SECONDS:g}", command, *WORST[command]]
    bound = time_limit.HARD_FACTOR * SECONDS + time_limit.HARD_EXTRA_S
    done = subprocess.run(
        [sys.executable, "-c", CODE, *words],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=STARTED_S + bound,
    )  # fmt: skip
    lines = [line for line in done.stderr.splitlines() if line.startswith("actuator-lti: ")]
    assert done.returncode == 3, done.stderr[-2000:]
    assert len(lines) == 1
    assert f"not finished within {SECONDS:g} s" in lines[0]


def test_every_command_has_a_stated_time() -> None:
    commands = [name for panel in PANELS.values() for name in panel]
    assert set(time_limit.STUDIES) < set(commands)
    stated = {time_limit.usual(name) for name in (*commands, None)}
    assert stated == {COMMAND_SECONDS.most, STUDY_SECONDS.most}


def test_a_library_that_makes_an_error_of_its_own_of_it_changes_nothing(capsys) -> None:
    def late() -> object:
        time_limit.start(60.0)
        try:
            time_limit._refuse(60.0)
        except OutOfTime as error:
            raise TypeError("cannot convert") from error
        return 0

    assert run(late) == 3
    assert capsys.readouterr().err.startswith("actuator-lti: not finished within 60 s")
    assert not time_limit.struck()
    assert not time_limit._timers
