"""Code of a page that is run while the page is built; a failure ends the build.

``python-run`` runs lines of Python, ``shell-run`` one command `actuator-lti`, or an example; code and what it
printed stand on the page. The code of one page shares its names and one folder, which is gone afterwards.
"""

from __future__ import annotations

import ast
import contextlib
import io
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, ClassVar
from unittest import mock

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.util.docutils import SphinxDirective

from reports.cli.main import main

SURROUNDINGS = {"PYTHONPATH": str(Path(__file__).parents[2]), "COLUMNS": "80", "NO_COLOR": "1"}
LONGEST_S = 600.0


class Room:
    """Names and folder of one page."""

    def __init__(self) -> None:
        self.names: dict[str, Any] = {"__name__": "__page__"}
        self.holder = tempfile.TemporaryDirectory(prefix="page-")
        self.folder = self.holder.name


class RunDirective(SphinxDirective):
    """What both directives share."""

    has_content = True
    option_spec: ClassVar = {
        "status": directives.nonnegative_int,
        "lines": directives.positive_int,
        "hide-output": directives.flag,
        "alt": directives.unchanged,
    }
    language = "python"

    def run(self) -> list[nodes.Node]:
        rooms: dict[str, Room] = self.env.temp_data.setdefault("run_code_rooms", {})
        room = rooms.setdefault(self.env.docname, Room())
        text = "\n".join(self.content)
        try:
            printed = self.result(text, room).rstrip()
        except Exception as error:
            raise self.error(f"{type(error).__name__}: {error}") from error
        made: list[nodes.Node] = [self._literal(text, self.language)]
        if printed and "hide-output" not in self.options:
            lines = printed.splitlines()
            most = self.options.get("lines", len(lines))
            shown = lines[:most] + (["..."] if len(lines) > most else [])
            made.append(self._literal("\n".join(line.rstrip() for line in shown), "text"))
        return made

    def result(self, text: str, room: Room) -> str:
        raise NotImplementedError

    def _literal(self, text: str, language: str) -> nodes.Node:
        node = nodes.literal_block(text, text)
        node["language"] = language
        self.set_source_info(node)
        return node


class PythonRun(RunDirective):
    """Lines of Python; the value of a last expression is shown as at a prompt, figures where ``:alt:`` is."""

    def run(self) -> list[nodes.Node]:
        return [*super().run(), *self._pictures()]

    def _pictures(self) -> list[nodes.Node]:
        pyplot = sys.modules.get("matplotlib.pyplot")
        made: list[nodes.Node] = []
        for number in pyplot.get_fignums() if pyplot and "alt" in self.options else ():
            page = self.env.docname.replace("/", "-")
            name = f"generated/{page}-{self.env.new_serialno('picture')}.svg"
            path = Path(self.env.srcdir) / name
            pyplot.figure(number).savefig(path, bbox_inches="tight", metadata={"Date": None})
            made.append(nodes.image(uri=f"/{name}", alt=self.options["alt"]))
        if pyplot:
            pyplot.close("all")
        return made

    def result(self, text: str, room: Room) -> str:
        tree = ast.parse(text)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.chdir(room.folder):
            exec(compile(tree, self.env.docname, "exec"), room.names)
            if isinstance(last, ast.Expr):
                value = eval(compile(ast.Expression(last.value), self.env.docname, "eval"), room.names)
                if value is not None:
                    printed.write(repr(value))
        return printed.getvalue()


class ShellRun(RunDirective):
    """One command `actuator-lti`, or an example, with the exit status that the page says (0 where none)."""

    language = "sh"

    def result(self, text: str, room: Room) -> str:
        program, *arguments = shlex.split(text, comments=True)
        with contextlib.chdir(room.folder), mock.patch.dict(os.environ, SURROUNDINGS):
            if program == "actuator-lti":
                status, out, err = called(arguments)
            elif program == "python" and arguments[0] == "-m" and arguments[1].startswith("examples."):
                command, kept = [sys.executable, *arguments], {"capture_output": True, "text": True}
                ended = subprocess.run(command, timeout=LONGEST_S, check=False, **kept)
                status, out, err = ended.returncode, ended.stdout, ended.stderr
            else:
                raise ValueError(f"{program}: only actuator-lti and python -m examples.NAME are run")
        wanted = self.options.get("status", 0)
        if status != wanted:
            raise ValueError(f"status {status}, not {wanted}: {err or out}")
        return out + err


def called(words: list[str]) -> tuple[int, str, str]:
    """Status of a command and what it prints, here: a process of its own imports all libraries anew."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main(words)
    return status, out.getvalue(), err.getvalue()


def setup(app: Any) -> dict[str, Any]:
    """Tell Sphinx of the directives."""
    app.add_directive("python-run", PythonRun)
    app.add_directive("shell-run", ShellRun)
    return {"parallel_read_safe": True}
