"""Exit statuses: 0 done, 1 a verdict fails, 2 bad input or usage, 3 a numerical failure, 130 interrupted."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

import typer

from actuator_lti.errors import InputError, NumericalError

DONE = 0
VERDICT_FAILED = 1
BAD_INPUT = 2
NUMERICAL_FAILURE = 3
INTERRUPTED = 130

# typer's own usage errors, whichever click it carries: BadParameter -> UsageError -> ClickException.
_USAGE_ERRORS: type[Exception] = typer.BadParameter.__mro__[2]


def leave_with(passed: bool) -> None:
    """End the command with status 1 where a requirement or verdict failed.

    Raises
    ------
    typer.Exit
        With status 1, if not passed.
    """
    if not passed:
        raise typer.Exit(VERDICT_FAILED)


def run(call: Callable[[], object]) -> int:
    """Run a command and give its exit status; an expected failure becomes one line on standard error."""
    output = sys.stdout
    try:
        status = call()
        sys.stdout.flush()
    except InputError as error:
        return _say(str(error), BAD_INPUT)
    except NumericalError as error:
        return _say(f"numerical failure: {error}", NUMERICAL_FAILURE)
    except BrokenPipeError:
        return _quiet_pipe()
    except SystemExit as leaving:
        if sys.stdout is output:
            return leaving.code if isinstance(leaving.code, int) else DONE
        sys.stdout = output  # typer met the closed pipe first and put a wrapper there
        return _quiet_pipe()
    except (KeyboardInterrupt, typer.Abort):
        return _say("interrupted", INTERRUPTED)
    except _USAGE_ERRORS as error:
        return _say(_usage_line(error), BAD_INPUT)
    except (OSError, UnicodeDecodeError) as error:
        return _say(_os_line(error), BAD_INPUT)
    if status == INTERRUPTED:  # typer swallows the interruption and gives its status
        return _say("interrupted", INTERRUPTED)
    return status if isinstance(status, int) else DONE


def _say(line: str, status: int) -> int:
    """Print one line on standard error and hand the status on."""
    sys.stderr.write(f"actuator-lti: {' '.join(line.split())}\n")
    return status


def _usage_line(error: BaseException) -> str:
    """Say what was wrong with the arguments, and where the help is."""
    context = getattr(error, "ctx", None)
    command = context.command_path if context is not None else "actuator-lti"
    message = error.format_message() if hasattr(error, "format_message") else str(error)
    return f"{message} (see {command} --help)"


def _os_line(error: OSError | UnicodeDecodeError) -> str:
    """Name the file and what the system said."""
    if isinstance(error, UnicodeDecodeError):
        return f"not a text file in UTF-8: {error}"
    name = f"{error.filename}: " if error.filename else ""
    return f"{name}{error.strerror or error}"


def _quiet_pipe() -> int:
    """Nobody reads the output any more: stop without a word (128 + SIGPIPE)."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 141
