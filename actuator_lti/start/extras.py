"""Packages: their versions, and what to install of those that only some commands need, said in one line."""

from importlib import import_module
from types import ModuleType

from actuator_lti.errors import InputError


def need(module: str, extra: str, what: str) -> ModuleType:
    """Import a module of an extra of pyproject.toml; the refusal says that ``what`` needs it.

    >>> need("math", "pdf", "a PDF").pi > 3
    True
    >>> need("no_such_module", "pdf", "a PDF")
    Traceback (most recent call last):
    ...
    actuator_lti.errors.InputError: a PDF needs no_such_module; allowed: pip install "actuator-lti[pdf]"
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        raise InputError(f'{what} needs {package}; allowed: pip install "actuator-lti[{extra}]"') from None


def package_version(name: str = "actuator-lti", otherwise: str = "not installed") -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(name)
    except PackageNotFoundError:
        return otherwise
