"""How a process adds up: threads and kernel of linear algebra, set before numpy is loaded, or not at all.

Linear algebra libraries read these settings once. Set later they would leave this process as it is and change
only those that it starts, whose numbers would then be others than its own.
"""

import os
import platform
import sys
from collections.abc import Mapping


def same_order() -> Mapping[str, str]:
    """Settings under which linear algebra adds in the same order on every machine of a kind.

    One thread: the matrices are small, and threads that wait for each other cost several times what they
    save. One kernel for all processors: the fastest differ in the last digit.
    """
    settings = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "MKL_CBWR": "COMPATIBLE"}
    if platform.machine().lower() in ("x86_64", "amd64"):
        settings["OPENBLAS_CORETYPE"] = "Nehalem"
    return settings


def settle() -> None:
    """Set what the environment leaves open, at the start of a process: where numpy is loaded, nothing."""
    if "numpy" not in sys.modules:
        for name, value in same_order().items():
            os.environ.setdefault(name, value)
