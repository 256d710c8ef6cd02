"""Compilers and hosts that tests of exports run."""

import json
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuator_lti.compiled.compiler import system_compiler

HERE = Path(__file__).parent
MODULE = HERE.parents[1] / "nonlinear/export/wasm/drive.wasm"
needs_compiler = pytest.mark.skipif(system_compiler() is None, reason="no C compiler on this machine")
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="no node on this machine")


def ran(folder: Path, *call: str) -> str:
    """What a program prints in a folder, having ended well."""
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]
    return done.stdout


def in_node(script: str, folder: Path, **given: Any) -> Any:
    """What a script makes of the kept module, which imports nothing."""
    (folder / "given.json").write_text(json.dumps(given))
    done = json.loads(ran(folder, "node", str(HERE / script), str(MODULE), "given.json"))
    assert done["imports"] == []
    return done


def in_json(row: Iterable[float]) -> list[float | str]:
    """Numbers as JSON has them: infinity is a text."""
    return [float(x) if np.isfinite(x) else str(x).replace("inf", "Infinity") for x in row]
