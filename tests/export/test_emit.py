"""The emitter refuses whatever it does not know; what it knows has its bits in test_native.py."""

from typing import Any

import pytest

from actuator_lti.compiled import EmitError, emit_c
from actuator_lti.compiled.kernel import kernel


@kernel
def push(s, at, x):
    old = s[at]
    s[at] = x
    return old


@kernel
def power(x):
    return x**2


@kernel
def two_types(x):
    y = 0
    y = x + 1.0
    return 2.0 * y


@kernel
def open_order(s):
    """A look into a row beside a call that writes it."""
    return s[0] + push(s, 0, 1.0)


@kernel
def twice(s):
    """Two writers in one expression."""
    return push(s, 0, 1.0) - push(s, 0, 2.0)


@kernel
def truth(x):
    if x:
        return 1.0
    return 2.0


@kernel
def sliced(s):
    s[0:2] = 1.0


@pytest.mark.parametrize(
    ("function", "kinds", "words"),
    [
        (power, ["float"], "Pow is not in the subset"),
        (two_types, ["float"], "y is a int and becomes a float"),
        (open_order, ["row"], "writes s beside another use of s"),
        (twice, ["row"], "writes s beside another use of s"),
        (truth, ["float"], "a float as a condition"),
        (sliced, ["row"], "Slice is not in the subset"),
        (push, ["row", "row"], "takes"),
    ],
)
def test_what_is_outside_the_subset_is_refused_with_its_place(function: Any, kinds: Any, words: str) -> None:
    with pytest.raises(EmitError, match=rf"test_emit\.py:[0-9]+: {function.__name__}: .*{words}"):
        emit_c({function: kinds})
