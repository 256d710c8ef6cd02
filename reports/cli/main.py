"""Entry point of the command `actuator-lti`."""

from __future__ import annotations

import os
from collections.abc import Sequence

from reports.certain import same_order


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and give the exit status.

    Linear algebra gets one thread and one kernel (`same_order`) unless the environment says otherwise.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process where left out.
    """
    for name, value in same_order().items():
        os.environ.setdefault(name, value)
    from reports.cli.app import build, options_by_name
    from reports.cli.errors import run

    given = None if arguments is None else list(arguments)
    return run(lambda: build()(args=given, prog_name="actuator-lti", standalone_mode=False), options_by_name)
