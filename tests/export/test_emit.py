"""The emitter: C that gives the same bits, and a refusal for whatever it does not know."""

import ctypes
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from emit_samples import FIRST, everything, open_order, power, sliced, through, truth, twice, two_types
from programs import needs_compiler

from actuator_lti.compiled import EmitError, emit_c
from actuator_lti.compiled.compiler import compile_files
from actuator_lti.compiled.form import Form

STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-shared", "-fPIC")


def library(folder: Path, entries: dict[Any, list[str]], forms: Sequence[Form] = ()) -> ctypes.CDLL:
    source, binary = {"t.c": emit_c(entries, "t_", forms).source}, folder / "t.so"
    binary.write_bytes(compile_files(source, "t.so", "linux64", STRICT))
    return ctypes.CDLL(str(binary))


@needs_compiler
def test_every_construct_gives_the_same_bits(tmp_path) -> None:
    lib = library(tmp_path, {everything: ["row", "row", "int"]})
    row = np.ctypeslib.ndpointer(np.float64)
    lib.t_everything.argtypes, lib.t_everything.restype = [row, row, ctypes.c_int], ctypes.c_double
    rng = np.random.default_rng(7)
    for round_ in range(300):
        p = rng.normal(size=8) * 10.0 ** rng.integers(-8, 9)
        ours, theirs = np.zeros(8), np.zeros(8)
        n = int(rng.integers(0, 8))
        a, b = everything(p, ours, n), lib.t_everything(p, theirs, n)
        assert np.float64(a).tobytes() == np.float64(b).tobytes(), round_
        assert ours.tobytes() == theirs.tobytes()


@needs_compiler
def test_a_form_leaves_out_what_known_numbers_rule_out_and_gives_the_same_bits(tmp_path) -> None:
    form = Form("gated", "bare", "p", {FIRST: 0.0})
    lib = library(tmp_path, {through: ["row", "float"]}, [form])
    text = emit_c({through: ["row", "float"]}, "t_", [form]).functions
    bare = text[text.index("t_bare_gated(const double *p, double x)\n{") :]
    assert "sin(" not in bare
    assert "t_dear(" in bare
    assert "if (p[0] == 0.0)" in text
    row = np.ctypeslib.ndpointer(np.float64)
    lib.t_through.argtypes, lib.t_through.restype = [row, ctypes.c_double], ctypes.c_double
    rng = np.random.default_rng(8)
    for first in (0.0, -1.0, 0.5):
        for x in rng.normal(size=50):
            p = np.array([first, rng.normal(), 3.0])
            assert lib.t_through(p, x) == through(p, x)


@pytest.mark.parametrize(
    ("function", "kinds", "words"),
    [
        (power, ["float"], "Pow is not in the subset"),
        (two_types, ["float"], "y is a int and becomes a float"),
        (open_order, ["row"], "writes s beside another use of s"),
        (twice, ["row"], "writes s beside another use of s"),
        (truth, ["float"], "a float as a condition"),
        (sliced, ["row"], "Slice is not in the subset"),
        (everything, ["row", "row"], "takes"),
    ],
)
def test_what_is_outside_the_subset_is_refused_with_its_place(function: Any, kinds: Any, words: str) -> None:
    with pytest.raises(EmitError, match=rf"emit_samples\.py:[0-9]+: {function.__name__}: .*{words}"):
        emit_c({function: kinds})
