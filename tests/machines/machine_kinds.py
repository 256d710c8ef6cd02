"""Which kinds of machine this one can act as: environment variables by name; as a script, for the makefile.

A kernel for instructions that the processor does not have would end the process: it is left out.
``python machine_kinds.py SEED ...`` prints a machine for each seed, of a processor that is not at hand
(`beside`): its products are those of one of the kernels that run here, but for the one of all tests, in turn,
and numpy's functions those of a processor of that kernel.
"""

import os
import sys
from itertools import cycle

from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

from reports.arithmetic import same_order

_KERNELS = {  # OpenBLAS core type: what the processor must have
    "Nehalem": ("SSE42",),
    "Sandybridge": ("AVX",),
    "Haswell": ("AVX2", "FMA3"),
    "SkylakeX": ("AVX2", "FMA3", "AVX512F", "AVX512_SKX"),
}


def kernels() -> list[str]:
    """Core types of OpenBLAS that run here: the oldest and the two newest."""
    run = [name for name, needs in _KERNELS.items() if all(__cpu_features__.get(each) for each in needs)]
    return list(dict.fromkeys([*run[:1], *run[-2:]]))


def kinds() -> dict[str, dict[str, str]]:
    """Kernels, two threads, numpy without its vector instructions."""
    one = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    result = {name: {**one, "OPENBLAS_CORETYPE": name} for name in kernels()}
    result["two threads"] = {"OPENBLAS_NUM_THREADS": "2", "MKL_NUM_THREADS": "2"}
    plain = [name for name in __cpu_dispatch__ if __cpu_features__.get(name)]
    if plain:
        result["plain numpy"] = {**one, "NPY_DISABLE_CPU_FEATURES": " ".join(plain)}
    return result


def _without(kernel: str) -> str:
    """The variable that keeps numpy from instructions that a processor of a kernel does not have."""
    needs = _KERNELS[kernel]
    newer = {
        "X86_V3": "AVX2" not in needs,
        "X86_V4": "AVX512F" not in needs,
        "AVX512": "AVX512F" not in needs,
    }
    here = [name for name in __cpu_dispatch__ if __cpu_features__.get(name)]
    off = [name for name in here if any(name.startswith(level) and newer[level] for level in newer)]
    return f"NPY_DISABLE_CPU_FEATURES={','.join(off)} " if off else ""


def machines(seeds: list[str]) -> list[str]:
    """A line of environment variables for each machine; every kernel once where the seeds are fewer."""
    of_all_tests = {**same_order(), **os.environ}.get("OPENBLAS_CORETYPE")
    others = [f"OPENBLAS_CORETYPE={name} {_without(name)}" for name in kernels() if name != of_all_tests] or [
        ""
    ]
    seeds += [""] * (len(others) - len(seeds))
    return [f"{kernel}OTHER_PROCESSOR={seed}" for kernel, seed in zip(cycle(others), seeds, strict=False)]


if __name__ == "__main__":
    sys.stdout.write("\n".join([*machines(sys.argv[1:]), ""]))
