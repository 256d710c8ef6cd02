"""A machine of another kind says the same; a processor that is not at hand; the list of slow tests."""

import functools
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from beside import MOST, moved
from machine_kinds import kernels, kinds

from reports.arithmetic import same_order
from tests.margins.margin_families import integrators_and_whole_samples, sections_permuted_and_scaled

SCRIPT = Path(__file__).with_name("machine_facts.py")
_ASKED = ("OPENBLAS_CORETYPE", "NPY_DISABLE_CPU_FEATURES")
FAMILIES = (integrators_and_whole_samples, sections_permuted_and_scaled)


def parts_of(loop: control.LTI) -> list[Any]:
    """Of a random loop, for `machine_facts.made_of`."""
    if isinstance(loop, control.TransferFunction):
        return [loop.num[0][0].tolist(), loop.den[0][0].tolist(), loop.dt]
    return [*(part.tolist() for part in (loop.A, loop.B, loop.C, loop.D)), loop.dt]


@functools.cache
def loops() -> str:
    drawn = [FAMILIES[k % 2](np.random.default_rng([k, 11])) for k in range(60)]
    return json.dumps([parts_of(loop) for loop in drawn])


def unasked() -> dict[str, str]:
    """The environment without what was asked of linear algebra."""
    return {name: value for name, value in os.environ.items() if name not in _ASKED}


@functools.cache
def facts(kind: str | None) -> dict[str, Any]:
    """What the script prints on a machine of a kind; ``None``: as this machine is."""
    environment = unasked() | (kinds()[kind] if kind else {"OPENBLAS_NUM_THREADS": "1"})
    command, kept = [sys.executable, "-W", "error", str(SCRIPT)], {"capture_output": True, "text": True}
    done = subprocess.run(command, input=loops(), env=environment, check=False, **kept)
    assert done.returncode == 0, done.stderr[-2000:]
    assert not done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    return result


@pytest.mark.parametrize("kind", sorted(kinds()))
def test_a_machine_of_another_kind_says_the_same(kind: str) -> None:
    here, there = facts(None), facts(kind)
    assert here["discrete"].keys() == there["discrete"].keys()
    differing = {name: (value, there["discrete"][name]) for name, value in here["discrete"].items()
                 if value != there["discrete"][name]}  # fmt: skip
    assert not differing
    far = {}
    for name, values in here["figures"].items():
        a, b = np.array(values), np.array(there["figures"][name])
        error = np.abs(a - b) / np.maximum(np.abs(a), 1.0)
        if (error > 1e-9).any():
            far[name] = float(error.max())
    assert not far


def test_there_are_several_kinds() -> None:
    assert len(kinds()) >= 2
    if sys.platform == "linux" and os.uname().machine == "x86_64":
        assert len(kernels()) >= 1


def test_every_kernel_is_asked_but_that_of_all_tests_and_every_seed() -> None:
    """It was, and that of a processor's own, with which nobody settles the order, was asked never."""
    others = {name for name in kernels() if name != same_order().get("OPENBLAS_CORETYPE")}
    for seeds in ([], ["1"], ["1", "2", "3"]):
        command = [sys.executable, str(SCRIPT.with_name("machine_kinds.py")), *seeds]
        listed = subprocess.run(command, env=unasked(), capture_output=True, text=True, check=True).stdout
        each = [dict(word.split("=") for word in line.split()) for line in listed.splitlines()]
        assert {one.get("OPENBLAS_CORETYPE") for one in each} - {None} == others
        assert [one["OTHER_PROCESSOR"] for one in each][: len(seeds)] == seeds


@pytest.mark.parametrize("seed", range(3))
def test_every_number_moves_by_a_few_ulp_and_equal_ones_alike(seed: int) -> None:
    x = np.random.default_rng(seed).standard_normal((40, 5)) * 10.0 ** np.arange(-100, 150, 50)
    y = moved(x, seed)
    assert np.all(np.abs(y - x) <= MOST * np.spacing(np.abs(np.maximum(np.abs(x), np.abs(y)))))
    assert 0.7 < np.mean(y != x) < 1.0
    assert np.array_equal(moved(x.T, seed), y.T)
    assert np.array_equal(moved(-x, seed), -y)
    z = x + 1j * x[::-1]
    assert np.array_equal(moved(z.conj(), seed), moved(z, seed).conj())
    assert not np.array_equal(moved(x, seed + 1), y)


def test_what_is_no_rounded_number_stays() -> None:
    for kept in (0.0, -0.0, np.inf, -np.inf, 5e-324, 3, "a", None):
        assert repr(moved(kept, 1)) == repr(kept) or moved(kept, 1) == kept
    assert np.isnan(moved(np.nan, 1))
    pivots = np.array([2, 1, 0])
    assert moved((pivots, 0), 1) == (pivots, 0)
    result = np.linalg.eig(np.array([[0.0, 1.0], [-2.0, -3.0]]))
    assert type(moved(result, 1)) is type(result)


HERE = Path(__file__).parents[1]


def test_every_slow_test_is_there() -> None:
    lines = [line for line in (HERE / "slow.txt").read_text(encoding="utf-8").splitlines() if line[:1] != "#"]
    assert lines == sorted(set(lines))
    for line in lines:
        file, _, name = line.partition("::")
        assert f"def {name}(" in (HERE.parent / file).read_text(encoding="utf-8") or not name, line
