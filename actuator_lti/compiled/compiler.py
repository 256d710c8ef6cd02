"""A C compiler for emitted code: gcc or clang of the machine, or the one that comes with ziglang."""

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from actuator_lti.errors import InputError

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-strict-aliasing")
# values do not depend on these: nobody reads errno or the flags of exceptions
# and numbers of a row are stored one by one: read as a pair soon after, they would be waited for
LIBRARY_FLAGS = ("-O3", "-fno-math-errno", "-fno-trapping-math", "-fno-tree-slp-vectorize")
ZIG_TARGETS = {"linux64": "x86_64-linux-gnu.2.17", "win64": "x86_64-windows-gnu", "wasm": "wasm32-wasi"}


@dataclass(frozen=True)
class Target:
    """A kind of machine that a library can be compiled for anywhere: names for zig and for a wheel."""

    zig: str
    wheel: str
    suffix: str


TARGETS = {
    "linux-x86_64": Target("x86_64-linux-gnu.2.17", "manylinux_2_17_x86_64", ".so"),
    "linux-aarch64": Target("aarch64-linux-gnu.2.17", "manylinux_2_17_aarch64", ".so"),
    "win32-AMD64": Target("x86_64-windows-gnu", "win_amd64", ".dll"),
    "darwin-x86_64": Target("x86_64-macos.11.0", "macosx_11_0_x86_64", ".dylib"),
    "darwin-arm64": Target("aarch64-macos.11.0", "macosx_11_0_arm64", ".dylib"),
}
HERE = f"{sys.platform}-{platform.machine()}"


def system_compiler() -> str | None:
    """Path of the machine's C compiler: ``CC``, else gcc, clang, cc; None where there is none."""
    wanted = os.environ.get("CC")
    names = (wanted,) if wanted else ("gcc", "clang", "cc")
    return next((result for name in names if name and (result := shutil.which(name))), None)


def zig_command() -> list[str] | None:
    """How to call the C compiler of ziglang; None where it is not installed."""
    if importlib.util.find_spec("ziglang") is None:
        return None
    return [sys.executable, "-m", "ziglang", "cc"]


def compiler_for(target: str) -> list[str]:
    """Command and target flags of a compiler for ``linux64``, ``win64`` or ``wasm``.

    ziglang's comes first, as its Linux binary runs with any glibc from 2.17 on; ``CC`` names another.
    Raises `InputError`: where this machine has none; says which package brings one.
    """
    allowed = f"{'gcc or clang, or ' if target == 'linux64' else ''}pip install 'actuator-lti[export]'"
    own = target == "linux64" and HERE == "linux-x86_64"
    own = own and (zig_command() is None or bool(os.environ.get("CC")))
    return _chosen(target, ["-target", ZIG_TARGETS[target]], allowed, own=own)


def _chosen(target: str, more: Sequence[str], allowed: str, *, own: bool) -> list[str]:
    """The machine's compiler where it may be taken (``own``) and is there, else zig's."""
    compiler, zig = system_compiler(), zig_command()
    if own and compiler:
        return [compiler]
    if zig is None:
        raise InputError(f"no C compiler for {target}; allowed: {allowed}")
    return [*zig, *more]


def compile_library(text: str, output: str, target: str, *, portable: bool = False) -> bytes:
    """Compile one C file to a shared library called ``output`` for `HERE` or another of `TARGETS`.

    ``portable``: for every machine of the target, as in a wheel: by zig, with an old C library. `InputError`:
    there is no compiler, or it fails.
    """
    more = ["-target", TARGETS[target].zig] if target in TARGETS else []
    command = _chosen(target, more, "gcc, clang, or pip install ziglang", own=target == HERE and not portable)
    flags = (*LIBRARY_FLAGS, "-shared", "-s" if output.endswith(".dll") else "-fPIC")
    return compile_files({"kernels.c": text}, output, target, flags, command=command)


def compile_files(
    texts: Mapping[str, str], output: str, target: str, extra: Sequence[str] = (), *,
    command: Sequence[str] | None = None
) -> bytes:  # fmt: skip
    """Compile C files given as text; returns the bytes of ``output``.

    A Windows library has the same bytes each time where it is stripped (``-s``) of its debug file's name.
    Raises `InputError`: where there is no compiler, or it fails; with the first line that it says.
    """
    chosen = list(command or compiler_for(target))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in texts.items():
            (folder / file).write_text(text, encoding="utf-8")
        sources = sorted(file for file in texts if file.endswith(".c"))
        # relative names: the bytes do not depend on where the folder lies
        call = [*chosen, *FLAGS, *extra, *sources, "-o", output, "-lm"]
        try:
            done = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=False, timeout=600)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise InputError(f"the C compiler cannot be run: {error}", where=chosen[0]) from error
        if done.returncode != 0:
            said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[:200])
            raise InputError(f"the C compiler for {target} fails: {said}", where=chosen[0])
        return (folder / output).read_bytes()


if __name__ == "__main__":  # for the makefile
    sys.stdout.write(" ".join(TARGETS))
