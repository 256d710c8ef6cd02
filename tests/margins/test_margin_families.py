"""Harsh families of loops: none wrong where the data determine the answer, hardly any withheld there.

Truth is certified roots of polynomials made of the exact doubles, written apart from the package, or by
construction. What 8 ulp of the
entries change, the data do not determine: there any answer is allowed, and withholding is.
"""

import math
import warnings
from collections.abc import Callable

import numpy as np
import pytest
from flint import fmpz_mat
from margin_families import FAMILIES, Loop, near_the_border, over_twelve_decades
from margin_truth import determined, difference, towards_the_border, truth_of

from actuator_lti.margins import StabilityMargins, stability_margins
from actuator_lti.margins.exact.loop import numerator
from tests.margins.differential import ALL, tried

TRUE_LOOPS = 60  # of each family, against the truth
LOOPS = 120  # of each family, double precision against exact arithmetic
Family = Callable[[np.random.Generator], Loop]


def problem(loop: Loop, m: StabilityMargins, rng: np.random.Generator) -> str | None:
    answer = truth_of(loop)
    result = difference(m, answer)
    return result if result is not None and determined(loop, answer, rng) else None


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_the_answer_is_the_truth_where_the_data_determine_it(
    family: Family, capfd: pytest.CaptureFixture[str]
) -> None:
    wrong = []
    for k in range(TRUE_LOOPS):
        rng = np.random.default_rng([k, 1])
        loop = family(rng)
        m = stability_margins(loop)
        if result := problem(loop, m, rng):
            wrong.append((k, m.evidence, result))
    assert not wrong
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.__name__)
def test_what_double_precision_has_checked_is_what_exact_arithmetic_certifies(
    family: Family, capfd: pytest.CaptureFixture[str]
) -> None:
    wrong, kinds = [], set()
    for k in range(LOOPS):
        loop = family(np.random.default_rng([k, 2]))
        m = stability_margins(loop)
        kinds.add(m.evidence)
        assert m.evidence_reason
        if m.evidence != "checked":
            continue
        exact = stability_margins(loop, certify=True)
        if exact.evidence == "certified" and (result := unlike(m, exact)):
            wrong.append((k, result))
    assert not wrong
    assert kinds & {"checked", "certified"}
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "k", [1001512, 1002322, 1002408, 1004031, 1004353, 1005110, 1005257, 1005639, 1005950]
)
def test_a_pole_that_8_ulp_carry_over_the_border_is_not_said_to_be_on_it(k: int) -> None:
    loop = near_the_border(np.random.default_rng([k, 2]))
    unstable = truth_of(loop).unstable
    assert truth_of(towards_the_border(loop)).unstable != unstable  # so the data do not determine it
    for m in (stability_margins(loop), stability_margins(loop, certify=True)):
        assert m.evidence == "withheld" or m.agreement.unstable_poles == unstable
        assert not m.agreement.border_poles
        if m.evidence == "withheld":
            assert "across the stability boundary" in m.evidence_reason
            assert m.agreement.unstable_poles is None


@pytest.mark.parametrize(
    ("k", "use"), [(2000178, 1), (2000625, 1), (2002044, 1), (2001516, 1), (1002855, 2), (1006074, 2)]
)
def test_zeros_far_from_the_poles_hide_nothing(k: int, use: int) -> None:
    rng = np.random.default_rng([k, use])
    loop = over_twelve_decades(rng)
    m, answer = stability_margins(loop), truth_of(loop)
    assert difference(m, answer) is None
    v = np.array([0.0, *np.geomspace(1e-8, 1e8, 40_001)])  # a grid from above
    L = np.polyval(loop.num[0][0], 1j * v) / np.polyval(loop.den[0][0], 1j * v)
    assert m.modulus_margin <= np.abs(1.0 + L).min() * (1.0 + 1e-9)


def unlike(m: StabilityMargins, exact: StabilityMargins) -> str | None:
    if m.stable is not exact.stable or m.agreement.unstable_poles != exact.agreement.unstable_poles:
        return f"{m.agreement}, not {exact.agreement}"
    for name in ("gain_margins", "phase_margins"):
        ours, theirs = getattr(m, name), getattr(exact, name)
        if name == "gain_margins":  # those far from -1 that the data do not determine are not certified
            ours, theirs = ([g for g in part if 1 / 30 < g.ratio < 30] for part in (ours, theirs))
        if len(ours) != len(theirs):
            return f"{name}: {ours}, not {theirs}"
        for a, b in zip(ours, theirs, strict=True):
            value = (a.ratio, b.ratio) if name == "gain_margins" else (a.deg, b.deg)
            if not math.isclose(*value, rel_tol=1e-8, abs_tol=1e-6) or not (
                a.frequency_rad_s == b.frequency_rad_s
                or math.isclose(a.frequency_rad_s, b.frequency_rad_s, rel_tol=1e-8)
            ):
                return f"{name}: {a}, not {b}"
    assert m.modulus_margin is not None
    assert exact.modulus_margin is not None
    if not math.isclose(m.modulus_margin, exact.modulus_margin, rel_tol=1e-7, abs_tol=1e-12):
        return f"modulus margin {m.modulus_margin}, not {exact.modulus_margin}"
    return None


@pytest.mark.parametrize("seed", range(3))
def test_a_numerator_is_a_bordered_determinant(seed: int) -> None:
    rng = np.random.default_rng([seed, 5])
    n = 7 + seed
    rows = rng.integers(-9, 10, (n, n)).tolist()
    b, c = (rng.integers(-9, 10, n).tolist() for _ in range(2))
    p = numerator(rows, b, c, fmpz_mat(rows).charpoly())
    for z in range(-n, n + 1):
        bordered = [[z * (r == k) - x for k, x in enumerate(row)] + [-b[r]] for r, row in enumerate(rows)]
        assert p(z) == fmpz_mat([*bordered, [*c, 0]]).det()


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
