"""A host for the units under test: FMPy's instance, kept in steps of any length."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from ctypes import CFUNCTYPE, c_char_p, c_int, c_void_p, cast
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from actuator_lti.compiled.compiler import system_compiler
from actuator_lti.design.model import Design
from nonlinear.export.fmu import Version, fmu_bytes

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install 'actuator-lti[export]')")
needs_compiler = pytest.mark.skipif(
    system_compiler() is None or not sys.platform.startswith("linux") or os.uname().machine != "x86_64",
    reason="no C compiler for this machine's FMU binaries",
)
Refused = pytest.importorskip("fmpy.fmi1").FMICallException
fmi2, fmi3 = pytest.importorskip("fmpy.fmi2"), pytest.importorskip("fmpy.fmi3")
# the text of a message comes behind its format, "%s"
_LOGGER = CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p, c_char_p)


def written(folder: Path, design: Design, version: Version = 2, platform: str = "linux64") -> Path:
    path = folder / f"drive{version}.fmu"
    path.write_bytes(fmu_bytes(design, version, (platform,)))
    return path


@dataclass
class Host:
    """A unit of either version with its variables by name, and what it has logged."""

    unit: Any
    references: dict[str, int]
    said: list[str] = field(default_factory=list)

    def get(self, *names: str, kind: str = "Real") -> list[float]:
        return list(self._call("get", kind, names))

    def set(self, **values: float) -> None:
        self.put(values)

    def put(self, values: Mapping[str, float], kind: str = "Real") -> None:
        """Set variables of one type by their dotted names, all in one call."""
        self._call("set", kind, list(values), list(values.values()))

    def _call(self, verb: str, kind: str, names: Sequence[str], *more: Any) -> Any:
        if not isinstance(self.unit, fmi2.FMU2Slave):
            kind = {"Real": "Float64", "Integer": "Int32"}[kind]
        return getattr(self.unit, verb + kind)([self.references[name] for name in names], *more)

    def start(self, stop: float | None = None, begin: float = 0.0, **values: float) -> Host:
        if isinstance(self.unit, fmi2.FMU2Slave):
            self.unit.setupExperiment(startTime=begin, stopTime=stop)
            self.unit.enterInitializationMode()
        else:
            self.unit.enterInitializationMode(startTime=begin, stopTime=stop)
        self.put(values)
        self.unit.exitInitializationMode()
        return self

    def step(self, now: float, step: float) -> None:
        self.unit.doStep(now, step)


@contextmanager
def hosted(path: Path, count: int = 1) -> Iterator[tuple[Host, ...]]:
    """Instances of one unit, each instantiated only."""
    description, folder = fmpy.read_model_description(str(path)), fmpy.extract(str(path))
    hosts = tuple(_instance(description, folder, f"unit{n}") for n in range(count))
    try:
        yield hosts
    finally:
        for host in hosts:
            host.unit.freeInstance()
        shutil.rmtree(folder)


def _instance(description: Any, folder: str, name: str) -> Host:
    said: list[str] = []
    about = {"guid": description.guid, "unzipDirectory": folder, "modelIdentifier": "drive"}
    unit: Any
    if description.fmiVersion == "2.0":
        unit = fmi2.FMU2Slave(instanceName=name, **about)
        callbacks = fmi2.fmi2CallbackFunctions()
        logger = _LOGGER(lambda *a: said.append(f"{a[3].decode()}: {a[5].decode()}"))
        callbacks.logger = cast(logger, fmi2.fmi2CallbackLoggerTYPE)
        unit.kept = logger  # ctypes keeps no reference
        unit.instantiate(callbacks=callbacks)
    else:
        unit = fmi3.FMU3Slave(instanceName=name, **about)
        unit.instantiate(logMessage=lambda *a: said.append(f"{a[2].decode()}: {a[3].decode()}"))
    return Host(unit, {item.name: item.valueReference for item in description.modelVariables}, said)
