"""Entry point of the command `actuator-lti`."""

from __future__ import annotations

import os
from collections.abc import Sequence

LINEAR_ALGEBRA_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and give the exit status.

    Linear algebra gets one thread unless the environment says otherwise: the matrices here are small, and
    threads that wait for each other cost several times what they save.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process where left out.
    """
    for name in LINEAR_ALGEBRA_THREADS:
        os.environ.setdefault(name, "1")
    from reports.cli.app import build
    from reports.cli.errors import run

    given = None if arguments is None else list(arguments)
    return run(lambda: build()(args=given, prog_name="actuator-lti", standalone_mode=False))
