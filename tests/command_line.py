"""Commands of `actuator-lti` run in the process of a test, and what they say."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import pytest


class Ran(NamedTuple):
    """A command's status and what it printed."""

    status: int
    out: str
    err: str

    @property
    def data(self) -> Any:
        """Its JSON."""
        return json.loads(self.out)


@dataclass(frozen=True)
class Command:
    """Run a command: `command("margins", path)`; where its status is no question, by what is read of it."""

    main: Callable[[list[str]], int]
    printed: pytest.CaptureFixture[str]

    def __call__(self, *words: object) -> Ran:
        """Run it with these words, whatever its status is; never a traceback."""
        self.printed.readouterr()
        status = self.main([str(word) for word in words])
        out, err = self.printed.readouterr()
        assert "Traceback" not in err
        return Ran(int(status or 0), out, err)

    def text(self, *words: object, status: int = 0) -> str:
        """What it prints, having ended with this status."""
        ran = self(*words)
        assert ran.status == status, ran.err
        return ran.out

    def data(self, *words: object, status: int = 0) -> Any:
        """What it says with --json, having ended with this status."""
        return json.loads(self.text(*words, "--json", status=status))

    def refused(self, *words: object) -> str:
        """The one line of a command that is refused: status 2, nothing on standard output."""
        ran = self(*words)
        assert (ran.status, ran.out, ran.err.count("\n"), ran.err[-1:]) == (2, "", 1, "\n"), ran
        return ran.err


def commands(command: Any = None, path: str = "") -> dict[str, Any]:
    """Every command of `actuator-lti` by its words."""
    if command is None:
        from typer.main import get_command

        from reports.cli.app import build

        command = get_command(build())
    inner = getattr(command, "commands", None) or {}
    below = [commands(one, f"{path} {key}".strip()) for key, one in inner.items()]
    return {name: leaf for each in below for name, leaf in each.items()} or {path: command}
