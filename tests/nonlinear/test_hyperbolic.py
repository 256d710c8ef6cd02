"""The tick's own hyperbolic tangent against forty digits, and what the friction law asks of it."""

import ctypes
import itertools
import math
import shutil
import subprocess
import sys

import mpmath
import numpy as np
import pytest

from actuator_lti.compiled import emit_c
from nonlinear._kernels.hyperbolic import LAST, STEPS, tanh
from nonlinear.export.program import single


def points() -> list[float]:
    """Over all sizes, and on both sides of every border between two cells of the table."""
    rng = np.random.default_rng(5)
    borders = (np.arange(int(LAST * STEPS)) + 0.5) / STEPS
    sides = [np.nextafter(borders, 0.0), borders, np.nextafter(borders, np.inf)]
    drawn = [rng.uniform(0.0, 20.0, 4000), 2.0 ** rng.uniform(-60.0, 4.5, 4000)]
    return np.concatenate([*drawn, *sides]).tolist()


def test_it_is_within_an_ulp_of_the_hyperbolic_tangent() -> None:
    with mpmath.workprec(140):
        for x in points():
            exact = mpmath.tanh(x)
            assert abs(tanh(x) - exact) < 1.1 * math.ulp(float(exact)), x


def test_it_is_odd_rises_and_is_its_argument_where_that_is_small() -> None:
    values = [tanh(x) for x in sorted(points())]
    assert all(after - before > -1.2e-16 for before, after in itertools.pairwise(values))  # an ulp
    assert all(tanh(-x) == -tanh(x) for x in points())
    assert all(tanh(x) == x for x in (0.0, 5e-324, 2.2e-308, 1e-8))
    assert math.copysign(1.0, tanh(-0.0)) == -1.0
    assert tanh(LAST) == tanh(1e308) == tanh(math.inf) == -tanh(-math.inf) == 1.0
    assert math.isnan(tanh(math.nan))


@pytest.mark.skipif(sys.platform != "linux" or shutil.which("gcc") is None, reason="asks gcc of Linux")
@pytest.mark.parametrize("precision", ["double", "single"])
def test_compiled_it_asks_no_library_and_has_the_bits_as_written(precision: str, tmp_path) -> None:
    text, number = emit_c({tanh: ("float",)}).source, ctypes.c_double
    if precision == "single":
        text, number = single(text), ctypes.c_float
    (tmp_path / "own.c").write_text(text)
    flags = ("-std=c99", "-O3", "-ffp-contract=off", "-shared", "-fPIC", "-nostdlib", "-Wl,-z,defs")
    subprocess.run(["gcc", *flags, "own.c", "-o", "own.so"], check=True, cwd=tmp_path)
    compiled = ctypes.CDLL(str(tmp_path / "own.so")).drive_tanh
    compiled.argtypes, compiled.restype = [number], number
    if precision == "double":
        assert [compiled(x).hex() for x in points()] == [tanh(x).hex() for x in points()]
    for x in points():
        assert compiled(x) == pytest.approx(tanh(x), rel=3e-7)
