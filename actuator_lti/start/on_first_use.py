"""Public names of a package that are loaded on first use (PEP 562): one way for all packages."""

import sys
from collections.abc import Callable, Collection, Mapping
from importlib import import_module
from typing import Any

from actuator_lti.start.public_arguments import guarded


def on_first_use(
    package: str, names: Mapping[str, str], modules: Collection[str] = ()
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """What a package defines as ``__getattr__`` and ``__dir__``: the module that defines each public name.

    Its functions look at their arguments there (`guarded`).

    ``modules`` are modules of the package that are public themselves. All these are its ``__all__``, which
    ``from package import *`` asks for.

    >>> load, _ = on_first_use("math_of_mine", {"sqrt": "math"})
    >>> load("sqrt")(9.0)
    3.0
    """

    def load(name: str) -> Any:
        if name == "__all__":
            return sorted({*names, *modules})
        if name in modules:
            return import_module(f"{package}.{name}")
        if name not in names:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = guarded(getattr(import_module(names[name]), name), package)
        if package in sys.modules:
            setattr(sys.modules[package], name, value)
        return value

    def known() -> list[str]:
        own = (name for name in vars(sys.modules[package]) if name.startswith("__"))
        return sorted({*own, *names, *modules})

    return load, known


def from_rooms(package: str, **names: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The same of names that stand by the module of the package that defines them, several in one text."""
    return on_first_use(package, {n: f"{package}.{room}" for room, own in names.items() for n in own.split()})
