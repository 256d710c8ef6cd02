"""The unit that most tests of the units look at; what is compiled of the same files is compiled once."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from hashlib import sha256
from pathlib import Path

import pytest

from actuator_lti import load_design
from actuator_lti.compiled import compiler
from nonlinear.export import fmu


@pytest.fixture(scope="session", autouse=True)
def _compiled_once(once: Callable[..., Path]) -> Iterator[None]:
    """Units and checked exports take what is kept of the same files, compiler and options."""

    def kept(
        texts: Mapping[str, str], output: str, target: str, extra: Sequence[str] = (), *, command=None
    ) -> bytes:
        asked = repr((sorted(texts.items()), output, extra, command or compiler.compiler_for(target)))

        def make(path: Path) -> None:
            path.write_bytes(compile_files(texts, output, target, extra, command=command))

        return once(f"{sha256(asked.encode()).hexdigest()}.compiled", make).read_bytes()

    compile_files = compiler.compile_files
    with pytest.MonkeyPatch.context() as patch:
        for module in (compiler, fmu):
            patch.setattr(module, "compile_files", kept)
        yield


@pytest.fixture(scope="session", params=[2, 3])
def unit(request, once) -> Path:
    """Of the baseline, in either version of FMI."""
    from fmu_host import fmu_bytes

    design, version = load_design("ilr33-amber"), request.param
    return once(
        f"drive{version}.fmu", lambda path: path.write_bytes(fmu_bytes(design, version, ("linux64",)))
    )
