"""Exit statuses: 0 done, 1 a verdict fails, 2 bad input or usage, 3 no result, 130 interrupted.

Mistakes of a design file are a line each.

There is no result after a numerical failure, after the time limit, or where something happened that nobody
foresaw. One line says which, and where the traceback lies; what a report lacks because of it stands in
the report as well.
"""

import os
import platform
import re
import sys
import tempfile
from collections.abc import Callable, Mapping

import typer

from actuator_lti.errors import InputError, Mistakes, NumericalError, OutOfTime, UnstableError
from reports.cli import time_limit

DONE, VERDICT_FAILED, BAD_INPUT, NO_RESULT, INTERRUPTED = 0, 1, 2, 3, 130

# typer's own usage errors, whichever click it carries: BadParameter -> UsageError -> ClickException.
_USAGE_ERRORS: type[Exception] = typer.BadParameter.__mro__[2]

_LONGEST = 1000  # characters of a line on standard error
_PLAIN = {  # what typer says
    "valid number, unable to parse string as a number": "a number, such as 0.5, without its unit",
    "valid integer, unable to parse string as an integer": "a whole number, such as 1000",
}


def leave_with(passed: bool) -> None:
    if not passed:
        raise typer.Exit(VERDICT_FAILED)


def run(call: Callable[[], object], options: Callable[[], Mapping[str, str]] = dict) -> int:
    """Run a command and give its exit status; whatever fails becomes one line on standard error.

    ``options`` gives the option behind each Python argument (`reports.cli.app.options_by_name`).
    """
    from analyses.isolation import drain, reason, traceback_of

    drain()
    try:
        status = _run(call, options)
    except Exception as error:  # noqa: BLE001 - the one place for what nobody foresaw
        if late := time_limit.struck():
            return _say(late, NO_RESULT)
        return _say(f"{reason(error)}; traceback: {write_crash_file(traceback_of(error))}", NO_RESULT)
    finally:
        time_limit.stop()
    missing = drain()
    if not missing or status not in (DONE, VERDICT_FAILED):
        return status
    tracebacks = "\n".join(f"{one.part}\n{one.traceback}" for one in missing if one.traceback)
    where = f"; tracebacks: {write_crash_file(tracebacks)}" if tracebacks else ""
    words = ", ".join(f"{one.part} ({one.why})" for one in missing[:3])
    return _say(f"the report lacks {len(missing)} part(s): {words}{where}", NO_RESULT)


def _run(call: Callable[[], object], options: Callable[[], Mapping[str, str]]) -> int:
    output = sys.stdout
    try:
        status = call()
        sys.stdout.flush()
    except InputError as error:
        if isinstance(error, Mistakes):
            return max(_say(str(one), BAD_INPUT) for one in error.mistakes)
        unstable = isinstance(error, UnstableError)
        return _say(str(error), VERDICT_FAILED) if unstable else _say(_by_option(error, options), BAD_INPUT)
    except (NumericalError, OutOfTime) as error:
        return _say(f"{'numerical failure: ' * isinstance(error, NumericalError)}{error}", NO_RESULT)
    except BrokenPipeError:
        return _quiet_pipe()
    except SystemExit as leaving:
        if sys.stdout is not output:  # typer met the closed pipe first and put a wrapper there
            sys.stdout = output
            return _quiet_pipe()
        return leaving.code if isinstance(leaving.code, int) else DONE
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except _USAGE_ERRORS as error:
        return _say(_usage_line(error), BAD_INPUT)
    except OSError as error:
        named = f"{error.filename}: " if error.filename else ""
        return _say(f"{named}{error.strerror or error}", BAD_INPUT)
    except MemoryError:
        return _say("not enough memory", NO_RESULT)
    if status == INTERRUPTED:  # typer swallows the interruption and gives its status
        return _say("interrupted", INTERRUPTED)
    return status if isinstance(status, int) else DONE


def _by_option(error: InputError, known: Callable[[], Mapping[str, str]]) -> str:
    """Name the option where the message begins with the Python argument behind it: ``duration_s = ...``."""
    words = str(error)
    begun = re.match(r"([^\W\d]\w*)( = |: )", words)
    if error.where is not None or begun is None:
        return words
    name, rest = begun[1], words[begun.end() :]
    options, short = known(), name.removesuffix("_Nm").removesuffix("_s").removesuffix("_rad")
    option = options.get(name) or options.get(short)
    return f"{option}{begun[2].removesuffix('= ')}{rest}" if option else words


def _say(line: str, status: int) -> int:
    words = "".join(c if c.isprintable() else "?" for c in " ".join(line.split()))
    words = words if len(words) <= _LONGEST else f"{words[: _LONGEST - 300]} ... {words[-295:]}"
    sys.stderr.write(f"actuator-lti: {words}\n")
    return status


def _usage_line(error: BaseException) -> str:
    command = getattr(getattr(error, "ctx", None), "command_path", "actuator-lti")
    message = error.format_message() if hasattr(error, "format_message") else str(error)
    for said, plain in _PLAIN.items():
        message = message.replace(f"Input should be a {said}", f"allowed: {plain}")
    return f"{message.replace('Value error, ', '') or 'a command is missing'} (see {command} --help)"


def _quiet_pipe() -> int:
    """Nobody reads the output any more: stop without a word (128 + SIGPIPE)."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 141


def write_crash_file(tracebacks: str) -> str:
    """Write tracebacks to a new file among the temporary ones; its path, or why there is none."""
    from reports.provenance import package_version

    head = f"actuator-lti {package_version()}, Python {platform.python_version()}, {platform.platform()}\n"
    head += f"arguments: {sys.argv[1:]!a}\n"
    try:
        handle, path = tempfile.mkstemp(prefix="actuator-lti-", suffix=".traceback.txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(head + tracebacks)
    except OSError as error:
        return f"could not be written: {error.strerror or error}"
    return path
