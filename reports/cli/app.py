"""All commands of `actuator-lti`: declared ones, and some apart that import what they need when they run."""

import inspect
from collections.abc import Callable
from functools import cache
from math import isfinite
from typing import Annotated, Any

import typer

from actuator_lti.bounds import COMMAND_SECONDS, STUDY_SECONDS
from actuator_lti.errors import InputError
from reports.analyses import ANALYSES, COMMANDS_IN, DESIGNS, EXPORTS, LINEAR, NONLINEAR, RECORDS, STUDIES
from reports.cli import objects, report, time_limit
from reports.cli.analysis import command as declared

_WHOLE_BITS = 63
# commands that are no declared analysis, by panel
_APART: dict[str, dict[str, Any]] = {
    DESIGNS: {"objects": objects.app}, LINEAR: {"report": report.report, "pdf": report.pdf}
}  # fmt: skip
PANELS = {
    panel: tuple(dict.fromkeys(one.name.split()[0] for one in ANALYSES if one.group == panel))
    + tuple(_APART.get(panel, ()))
    for panel in (DESIGNS, LINEAR, NONLINEAR, RECORDS, EXPORTS, STUDIES)
}
"""Commands in the order in which the help lists them, by the panel that they stand in."""


def build() -> typer.Typer:
    app = typer.Typer(
        name="actuator-lti", no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
    )  # fmt: skip
    app.callback(help=flowed(about.__doc__ or ""))(about)
    for panel, commands in PANELS.items():
        for command in commands:
            own = [one for one in ANALYSES if one.name.split()[0] == command]
            made = _APART.get(panel, {}).get(command)
            if command in COMMANDS_IN:
                made = typer.Typer(help=COMMANDS_IN[command], no_args_is_help=True)
                for one in own:
                    _add(made, one.name.split()[1], declared(one))
            if isinstance(made, typer.Typer):
                app.add_typer(made, name=command, rich_help_panel=panel)
            else:
                _add(app, command, made or declared(own[0]), panel)
    return app


@cache
def built() -> Any:
    """What `build` makes, as click has it; made once in a process, for all commands that are run in it."""
    return bounded(typer.main.get_command(build()))


def say_version(wanted: bool) -> None:
    if wanted:
        from reports.provenance import package_version

        typer.echo(f"actuator-lti {package_version()}")
        raise typer.Exit


def about(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", is_eager=True, callback=say_version, help="Print the version and stop."),
    ] = False,
    limit: Annotated[
        float | None,
        typer.Option(
            "--time-limit",
            min=1.0,
            metavar="SECONDS",
            help="A command that takes longer ends with status 3; an hour (studies: a week) where left out.",
        ),
    ] = None,
) -> None:
    """Linear loop analysis of electromechanical actuators, checked by an exact nonlinear simulator.

    Exit status of every command: 0 what is judged is met, or nothing is; 1 something is not met, or not
    proven and not waived (of bench records: not met); 2 bad input; 3 no result; 130 interrupted.
    """
    usual = STUDY_SECONDS if context.invoked_subcommand in PANELS[STUDIES] else COMMAND_SECONDS
    time_limit.start(float(usual.most) if limit is None else limit)


@cache
def options_by_name() -> dict[str, str]:
    """Long option of every command, by the name of the argument that it becomes."""
    result: dict[str, str] = {}
    todo: list[Any] = [built()]
    for command in todo:
        todo.extend(getattr(command, "commands", {}).values())
        for parameter in command.params:
            for option in [word for word in parameter.opts if word.startswith("--")][:1]:
                result |= {parameter.name: option, option[2:].replace("-", "_"): option}
    return result


def _add(app: typer.Typer, name: str, function: Callable[..., Any], panel: str | None = None) -> None:
    app.command(name, rich_help_panel=panel, help=flowed(function.__doc__ or ""))(function)


def flowed(text: str) -> str:
    """Give a docstring as paragraphs of one line each: the terminal breaks them at its own width."""
    return "\n\n".join(" ".join(part.split("\n")) for part in inspect.cleandoc(text).split("\n\n"))


def bounded(command: Any) -> Any:
    """Let every option and argument of a command, and of those below it, refuse numbers beyond this."""
    for parameter in command.params:
        parameter.process_value = _checked(parameter, parameter.process_value)
    for below in getattr(command, "commands", {}).values():
        bounded(below)
    return command


def _checked(parameter: Any, cast: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    name = max(parameter.opts, key=len)

    def checked(context: Any, value: Any) -> Any:
        result = cast(context, value)
        for each in result if isinstance(result, list | tuple) else (result,):
            if isinstance(each, float) and not isfinite(each):
                raise InputError(f"{name} {each}: must be a finite number")
            if isinstance(each, int) and each.bit_length() > _WHOLE_BITS:
                raise InputError(f"{name}: must lie between -2^63 and 2^63")
        return result

    return checked
