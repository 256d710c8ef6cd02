"""The unit that most tests of the units look at; a C file of the same text is compiled once in a run."""

import re
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from hashlib import sha256
from pathlib import Path

import pytest

from actuator_lti import load_design
from actuator_lti.compiled import compiler
from nonlinear.export import fmu


def included(texts: Mapping[str, str], name: str) -> dict[str, str]:
    """A file with the headers that it includes, and those that they include."""
    found = {name: texts[name]}
    for inner in re.findall(r'^#include "(.+)"', texts[name], re.M):
        found |= included(texts, inner)
    return found


@pytest.fixture(scope="session", autouse=True)
def _compiled_once(once: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Units and checked exports are linked of objects: of each C file and its headers there is one."""
    compile_files, folder = compiler.compile_files, tmp_path_factory.mktemp("linked")

    def object_of(texts: dict[str, str], target: str, flags: Sequence[str], command: list[str]) -> Path:
        key = sha256(repr((sorted(texts.items()), flags, command)).encode()).hexdigest()
        return once(
            f"{key}.o",
            lambda path: path.write_bytes(compile_files(texts, "x.o", target, flags, command=command)),
        )

    def linked(
        texts: Mapping[str, str], output: str, target: str, extra: Sequence[str] = (), *, command=None
    ) -> bytes:
        chosen = list(command or compiler.compiler_for(target))
        flags = [*(flag for flag in extra if flag not in ("-shared", "-s")), "-c"]
        flags += ["-Wno-unused-command-line-argument"]  # -lm
        sources = (included(texts, name) for name in texts if name.endswith(".c"))
        objects = [object_of(source, target, flags, chosen) for source in sources]
        subprocess.run([*chosen, *extra, *objects, "-o", folder / output, "-lm"], check=True)
        return (folder / output).read_bytes()

    with pytest.MonkeyPatch.context() as patch:
        for module in (compiler, fmu):
            patch.setattr(module, "compile_files", linked)
        yield


@pytest.fixture(scope="session", params=[2, 3])
def unit(request, once) -> Path:
    """Of the baseline, in either version of FMI."""
    from fmu_host import fmu_bytes

    design, version = load_design("ilr33-amber"), request.param
    return once(
        f"drive{version}.fmu", lambda path: path.write_bytes(fmu_bytes(design, version, ("linux64",)))
    )
