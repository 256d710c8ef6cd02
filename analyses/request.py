"""How a request of an analysis is asked for: each field says it beside itself, in ``Annotated``.

The command line, its help and the list of commands are loops over these fields. The flag is the field's name
without its unit; the default that of the dataclass, or of ``Request.of(design, ...)``, which sees the design.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin, get_type_hints

if TYPE_CHECKING:
    from analyses.studies.engine import Engine

Kind = Literal["plain", "output", "speed", "load", "slope", "step", "command", "rate"]
UNITS = ("_rad_s", "_rad", "_hz", "_Nm", "_s", "_degC", "_V", "_A")


@dataclass(frozen=True)
class Option:
    """A field as an option of a command."""

    words: str  # what it is, and its default where the design gives it
    metavar: str = ""  # what stands for the value in the help; of a plain number its unit, "" for none
    _: KW_ONLY
    flag: str = ""  # the option, without dashes; the field's name without its unit where empty
    # ``"output"``, ``"speed"``: of the output with its unit; ``"load"``, ``"slope"``: a load, or one over the
    # output's angle, with or without; ``"step"``: of the command of the outermost loop, in SI, A and V with
    # or without; ``"command"``, ``"rate"``: the same or its rate in the usual unit, with or without
    kind: Kind = "plain"
    ramps: bool = False  # whether --command ramp makes a rate of it
    # Whether it stands by its place, without a flag; it has to be given where it has no default
    argument: bool = False


def options(request: type | None) -> dict[str, tuple[Any, Option]]:
    """Type and option of every field of a request, by field; nothing where nothing is asked.

    >>> from analyses.duty.asked import Asked
    >>> {name: option.flag or flag(name) for name, (_, option) in options(Asked).items()}["amplitude_rad"]
    'amplitude'
    """
    result = {}
    for name, hint in get_type_hints(request or object, include_extras=True).items():
        if get_origin(hint) is Annotated:
            kind, *more = get_args(hint)
            result[name] = (kind, next(one for one in more if isinstance(one, Option)))
    return result


def is_number(kind: Any) -> bool:
    """Whether the value of a field of this type is a number, with a unit or none."""
    return float in (kind, *get_args(kind))


def key_of(name: str) -> str:
    """The key of a field in a file: its name without the unit."""
    return name.removesuffix(next((unit for unit in UNITS if name.endswith(unit)), ""))


def flag(name: str) -> str:
    """The flag of a field: its key, with hyphens."""
    return key_of(name).replace("_", "-")


def given(*layers: Mapping[str, Any]) -> dict[str, Any]:
    """Values by field, the later ones before the earlier ones; None is no value."""
    return {name: value for layer in layers for name, value in layer.items() if value is not None}


LOAD = Option(
    'Load torque at the output, such as "4 N*m" or 4 (N m; linear axis: N); 0.', "LOAD", kind="load"
)
POINT = Option(
    "Friction: sliding, rest or describing-function; behind a coupling also driving and driven (the "
    "load's share of the friction) and gap (in the play); sliding.",
    "POINT",
)
FORCE = Option("Overwrite files that exist.")


@dataclass(frozen=True, kw_only=True)
class OnMachines:
    """Where a study is computed, a part of its request."""

    workers: Annotated[int | None, Option("Processes of a local Dask cluster.", "N")] = None
    scheduler: Annotated[str | None, Option("A Dask scheduler that is running.", "ADDRESS")] = None
    tls: Annotated[Path | None, Option("ca.pem, cert.pem and key.pem for a tls:// scheduler.", "DIR")] = None

    @property
    def engine(self) -> Engine:
        """Where to compute."""
        from analyses.studies.engine import Engine

        return Engine(self.workers, self.scheduler, tls=self.tls)
