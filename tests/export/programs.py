"""Compilers, hosts and statements that tests of exports run."""

import json
import math
import re
import shutil
import subprocess
from collections.abc import Iterable, Sequence
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


_KNOWN: dict[str, Any] = {
    **vars(math), "INFINITY": math.inf, "NAN": math.nan, "fabs": abs, "pow": pow,
    "where": lambda condition, yes, no: yes if condition else no,
}  # fmt: skip


def executed(lines: Sequence[str], keys: Sequence[float]) -> dict[int, float] | None:
    """What statements in C, from keys to a row, store by its place; None where a condition ends them."""
    stored: dict[int, float] = {}
    scope = {**_KNOWN, "k": keys}
    for line in lines:
        text = line.replace("&&", "and").replace("||", "or")
        if made := re.fullmatch(r"const double (v\d+) = (.*);", text):
            scope[made[1]] = eval(made[2], scope)
        elif kept := re.fullmatch(r"p\[(\d+)\] = (.*);", text):
            stored[int(kept[1])] = float(eval(kept[2], scope))
        else:
            condition = re.fullmatch(r"if \((!?)\((.*)\)\) \{ return 0; \}", text)
            assert condition is not None, line
            if bool(eval(condition[2], scope)) is (condition[1] == ""):
                return None
    return stored
