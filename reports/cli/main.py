"""Entry point of the command `actuator-lti`."""

from collections.abc import Sequence

from reports import arithmetic


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and give the exit status.

    At the start of a process linear algebra gets one thread and one kernel (`reports.arithmetic`) unless the
    environment says otherwise. Arguments are without the program's name; those of the process where left out.
    """
    arithmetic.settle()
    from reports.cli.app import built, options_by_name
    from reports.cli.errors import run

    given = None if arguments is None else list(arguments)
    return run(lambda: built()(args=given, prog_name="actuator-lti", standalone_mode=False), options_by_name)
