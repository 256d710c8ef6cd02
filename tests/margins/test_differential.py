"""A few hundred loops of the differential draw with a fixed seed; other seeds: `make differential SEED=7`."""

import warnings

import pytest

from tests.margins.differential import ALL, tried

ROUNDS = 12


@pytest.mark.parametrize("family", range(len(ALL)), ids=lambda k: f"{k}-{ALL[k].__name__}")
def test_one_answer_in_every_form(family: int) -> None:
    wrong = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in range(ROUNDS):
            kind, what = tried(ALL[family], 2026, k * len(ALL) + family)
            if kind == "wrong":
                wrong.append((k, what))
    assert not wrong
