"""One loop in all its forms: the same verdict, the same lists, and those of exact polynomials.

A draw of harsh loops, for as long as wanted: `python -m tests.margins.differential --seconds 120 --seed 7`.
Forms: transfer function, state space, explicit 1/z against ``delay_s``, part of a sample, series delay
systems, other units of time, certified or not. Truth: roots of integer polynomials made of the doubles,
written apart from the package; part p/r of a sample is a polynomial in the r-th root of z.
"""

import argparse
import math
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import control
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from margin_families import FAMILIES, PERIOD_S, poly, roots_of, scaled, signs, uniform
from margin_truth import (
    DEG,
    RATIO,
    Facts,
    behind_delay,
    below,
    determined,
    facts,
    nearest,
    polynomials,
    truth_of,
    unlike,
)

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins import GainMargin, PhaseMargin, StabilityMargins, stability_margins
from actuator_lti.systems.delay_system import DelaySystem


def nearly_lossless(rng: np.random.Generator) -> control.TransferFunction:
    """Damping down to 1e-9, poles and zeros interlaced or not."""
    n = int(rng.integers(1, 4))
    poles = roots_of(rng, 2 * n, 2.0, -9.0, 0.0)
    zeros = roots_of(rng, int(rng.integers(0, 2 * n)), 2.0, -9.0, 0.1)
    return scaled(rng, zeros, poles, False)


def nearly_tangent(rng: np.random.Generator) -> control.TransferFunction:
    """A resonance whose peak gain is one but for 1e-3 to 1e-12."""
    zeta, w = uniform(rng, -3.0, -0.3), uniform(rng, -1.0, 1.0)
    gain = 2.0 * zeta * w * (1.0 + signs(rng, 0.5) * uniform(rng, -12.0, -3.0))
    return control.tf([gain, 0.0], [1.0, 2.0 * zeta * w, w * w])


def cancelled_at_the_limit(rng: np.random.Generator) -> control.TransferFunction:
    """Integrators or undamped pairs in numerator and denominator alike, of small integers: exact."""
    hidden = np.array([1.0, 0.0]) if rng.random() < 0.5 else np.array([1.0, 0.0, float(rng.integers(1, 9))])
    den = poly([-float(k) + 0j for k in rng.integers(1, 6, int(rng.integers(1, 4)))])
    num = np.array([float(rng.integers(1, 9))])
    for _ in range(int(rng.integers(1, 3))):
        num, den = np.polymul(num, hidden), np.polymul(den, hidden)
    return control.tf(num, np.polymul(den, [1.0, 0.0]) if rng.random() < 0.5 else den)


def hard_against_nyquist(rng: np.random.Generator) -> control.TransferFunction:
    """Sampled, poles and zeros near z = -1."""
    near = [complex(-1.0 + uniform(rng, -6.0, -0.5)) for _ in range(int(rng.integers(1, 3)))]
    poles = [complex(rng.uniform(-0.95, 0.99)) for _ in range(int(rng.integers(1, 3)))]
    zeros, poles = (near[:1], poles) if rng.random() < 0.5 else ([], poles + near[:1])
    num, den = poly(zeros), poly(poles)
    size = abs(np.polyval(num, 1j) / np.polyval(den, 1j))
    return control.tf(uniform(rng, -1.0, 1.0) * signs(rng, 0.3) * num / size, den, PERIOD_S)


def delays_in_states(rng: np.random.Generator) -> control.StateSpace:
    """Sampled, behind whole samples that are states among others: poles at z = 0 that come out as pairs."""
    poles = [*[0j] * int(rng.integers(1, 6)), *(complex(p) for p in rng.uniform(-0.95, 1.0, 3))]
    zeros = [complex(z) for z in rng.uniform(-1.5, 1.5, int(rng.integers(0, 3)))]
    loop = control.ss(
        control.tf(uniform(rng, -1.5, 1.0) * signs(rng, 0.5) * poly(zeros), poly(poles), PERIOD_S)
    )
    n = loop.nstates
    T = np.linalg.qr(rng.standard_normal((n, n)))[0] * 2.0 ** rng.integers(-3, 4, n)
    parts = (T @ loop.A @ np.linalg.inv(T), T @ loop.B, loop.C @ np.linalg.inv(T), loop.D)
    return control.StateSpace(*parts, PERIOD_S, remove_useless_states=False)


def plain_sampled(rng: np.random.Generator) -> control.TransferFunction:
    """One or two poles, for delays of every kind."""
    poles = [complex(rng.uniform(-0.9, 1.0)) for _ in range(int(rng.integers(1, 3)))]
    if rng.random() < 0.3:
        poles[0] = 1.0 + 0j
    zeros = [complex(rng.uniform(-1.5, 1.5))] * int(rng.integers(0, len(poles)))
    return control.tf(poly(zeros) * uniform(rng, -1.5, 1.0) * signs(rng, 0.3), poly(poles), PERIOD_S)


FAR = 1e9  # ratio of gain margins that are compared behind a delay: 180 dB
SURE = 100  # neighbours that all have to have the truth before another answer is called wrong
MOST_RAD = 300.0  # that the delay turns by
CERTIFIED_LATE = 0.1  # share of the loops behind a delay: by intervals in certified arithmetic, the slow way
Family = Callable[[np.random.Generator], control.LTI]
ALL: tuple[Family, ...] = (
    *FAMILIES, nearly_lossless, nearly_tangent, cancelled_at_the_limit, hard_against_nyquist, plain_sampled,
    plain_sampled, delays_in_states,
)  # fmt: skip


def without_touches(f: Facts, m: StabilityMargins) -> Facts:
    """Without the pairs of crossings, closer than 1e-9 to the line between, that are listed as one touch."""

    def rest(part: list[tuple[float, float]], listed: Sequence[GainMargin | PhaseMargin]) -> list[Any]:
        touches = [x.frequency_rad_s for x in listed if x.tangent]
        return [c for c in part if not any(math.isclose(c[0], w, rel_tol=1e-3) for w in touches)]

    return Facts(f.unstable, rest(f.gains, m.gain_margins), rest(f.phases, m.phase_margins))


def forms(loop: control.LTI, rng: np.random.Generator) -> Iterator[tuple[str, StabilityMargins, float]]:
    """The loop in other forms, each with the factor of its frequencies."""
    yield "certified", stability_margins(loop, certify=True), 1.0
    if not isinstance(loop, control.TransferFunction):
        return
    num, den = (p[0][0] for p in (loop.num, loop.den))
    if not loop.dt:
        k = 2.0 ** float(rng.integers(-12, 13))  # exact in every coefficient
        up = [c * k ** np.arange(c.size - 1, -1, -1) for c in (num, den)]
        if all(np.isfinite(c).all() and (np.abs(c[c != 0]) > 1e-290).all() for c in up):
            yield "in other units of time", stability_margins(control.tf(*up)), k
        return
    slower = control.tf(num, den, float(loop.dt) * 4.0)
    yield "in other units of time", stability_margins(slower), 4.0


def leaves_out(m: StabilityMargins) -> bool:
    """Whether a note says that it leaves out crossings beyond 30 dB from -1 that the data do not resolve."""
    return any("left out" in note for note in m.notes)


def as_given(m: StabilityMargins) -> bool:
    """Whether a note says that a crossing is that of the given doubles alone: another form has others."""
    return any("listed as given" in note for note in m.notes)


def too_far(m: StabilityMargins, end: float = math.inf) -> str:
    """The smallest distance to -1 if a crossing below ``end`` lies nearer: |1 + L| there in closed form."""
    phases = [2.0 * math.sin(0.5 * math.radians(abs(p.deg))) for p in m.phase_margins]
    gains = [abs(1.0 - 1.0 / g.ratio) for g in m.gain_margins if g.frequency_rad_s < end]
    nearest = min([*phases, *gains], default=math.inf)
    wrong = m.modulus_margin is not None and m.modulus_margin > nearest * (1.0 + 1e-6) + 1e-12
    return f"modulus margin {m.modulus_margin} beyond a crossing at {nearest}" if wrong else ""


def farther(m: StabilityMargins, other: StabilityMargins) -> str:
    """The smallest distances to -1 where they are not one."""
    same = math.isclose(m.modulus_margin, other.modulus_margin, rel_tol=1e-7, abs_tol=1e-12)
    return "" if same else f"modulus margin {m.modulus_margin}, not {other.modulus_margin}"


def delayed_forms(
    loop: control.TransferFunction, rng: np.random.Generator
) -> Iterator[tuple[str, Facts, Facts, float]]:
    """Pairs that are to be the same, with a delay, and up to how many decibels from -1."""
    num, den = (np.trim_zeros(p[0][0], "f") for p in (loop.num, loop.den))
    if loop.dt:
        period, k = float(loop.dt), int(rng.integers(1, 4))
        explicit = control.tf(num, np.concatenate((den, np.zeros(k))), loop.dt)
        expected = truth_of(explicit)
        given = {
            "explicit 1/z": stability_margins(explicit),
            "delay_s": stability_margins(loop, delay_s=k * period),
        }
        if den[0] == 1.0 and num.size < den.size:  # with a feed-through its entries are rounded: another loop
            given["state space behind delay_s"] = stability_margins(control.ss(loop), delay_s=k * period)
        for name, m in given.items():
            if not m.withheld:
                yield name, facts(m), expected, 30.0 if leaves_out(m) else 90.0
        return
    if num.size >= den.size:
        return
    scale = float(np.abs(np.roots(den)).max() or 1.0)
    delay_s = uniform(rng, -1.5, 0.7) / scale
    one = stability_margins(loop, delay_s=delay_s)
    if one.withheld:
        return
    top = min(one.band_rad_s[1], MOST_RAD / delay_s)
    if hidden_free(loop) and not any(p.tangent for p in one.phase_margins):
        far = 30.0 if leaves_out(one) else FAR
        yield "delay_s", below(facts(one), top), behind_delay(loop, delay_s, top), far
        if top < MOST_RAD / delay_s:
            beyond = behind_delay(loop, delay_s, 3.0 * MOST_RAD / delay_s)
            yield "nearest of delay_s", nearest(facts(one)), nearest(beyond), far
    end = top * rng.random()
    if not (part := stability_margins(loop, delay_s, (0.0, end))).withheld:
        whole, far = below(facts(one), end), 30.0 if leaves_out(one) or leaves_out(part) else FAR
        listed = replace(whole, phases=[p for p in whole.phases if p[0] < end])
        yield "delay_s within a band", facts(part), listed, far
    others = {
        "series": partial(stability_margins, DelaySystem.from_system(loop) * DelaySystem.delay(delay_s))
    }
    if rng.random() < CERTIFIED_LATE:
        others["certified"] = partial(stability_margins, loop, delay_s=delay_s, certify=True)
    for name, margins in others.items():
        if not (m := margins()).withheld:
            far = 30.0 if leaves_out(one) or leaves_out(m) else FAR
            top = min(one.band_rad_s[1], m.band_rad_s[1]) * 0.999
            yield f"delay_s against {name}", below(facts(one), top), below(facts(m), top), far


def behind_part_of_a_sample(family: Family, seed: int, k: int) -> tuple[str, str]:
    """("right" | ... | "none", what) of a sampled loop behind p/r samples, as `tried`.

    Undetermined is what is so without the delay, too.
    """
    rng = np.random.default_rng([seed, k])
    loop = family(rng)
    part = Fraction(int(rng.integers(1, 8)), int(rng.choice([2, 3, 4])))
    if not loop.dt or part.denominator == 1 or not hidden_free(loop):
        return "none", ""
    try:
        m = stability_margins(loop, delay_s=float(part) * float(loop.dt))
    except (InputError, NumericalError) as error:
        return "refused", str(error)
    if m.withheld:
        known = determined(loop, truth_of(loop), rng)
        return "withheld" if known else "undetermined", m.evidence_reason
    end = math.pi / float(loop.dt) * (1.0 - 1e-12)
    ours = facts(m)
    inside = Facts(None, [g for g in ours.gains if 0.0 < g[0] < end], ours.phases)
    expected = without_touches(replace(truth_of(loop, part), unstable=None), m)
    what = too_far(m, end) or unlike(inside, expected, 1e-6, 1e-3, far=30.0 if leaves_out(m) else 90.0)
    return ("wrong", f"behind {part} of a sample: {what}") if what else ("right", "")


def hidden_free(loop: control.LTI) -> bool:
    num, den = polynomials(loop)
    return num.gcd(den).degree() < 1


def tried(family: Family, seed: int, k: int) -> tuple[str, str]:
    """("right" | "withheld" | "refused" | "undetermined" | "wrong", what).

    Withheld is what was without need: where 8 ulp of the entries change the truth, it is undetermined. Right
    is an answer that says in a note that it leaves out what they change beyond 30 dB from -1.
    """
    rng = np.random.default_rng([seed, k])
    loop = family(rng)
    try:
        m = stability_margins(loop)
        ours, expected = facts(m), truth_of(loop)
        if m.withheld:
            kind = "withheld" if determined(loop, expected, rng) else "undetermined"
            return kind, m.evidence_reason
        listed = without_touches(expected, m)
        if what := unlike(ours, listed, 1e-6, 1e-3):
            said = leaves_out(m) and not unlike(ours, listed, 1e-6, 1e-3, far=30.0)
            sure = determined(loop, expected, rng, SURE)
            kind = "wrong" if sure else "right" if said else "undetermined"
            return kind, f"against the truth: {what}"
        if what := too_far(m):
            return "wrong", what
        for name, other, unit in forms(loop, rng):
            theirs = facts(other)
            gains, phases = ([(w * unit, x) for w, x in part] for part in (theirs.gains, theirs.phases))
            theirs = Facts(theirs.unstable, gains, phases)
            checked = [one.evidence == "checked" for one in (m, other)]
            tight = (RATIO, DEG) if all(checked) else (1e-8, 1e-6) if any(checked) else (1e-6, 1e-3)
            if not (other.withheld or as_given(m) or as_given(other)) and (
                what := unlike(ours, theirs, *tight, far=30.0) or farther(m, other)
            ):
                return "wrong", f"{name}: {what}"
        if isinstance(loop, control.TransferFunction) and rng.random() < 0.5:
            for name, a, b, far in delayed_forms(loop, rng):
                if what := unlike(a, b, 1e-6, 1e-3, far=far):
                    return "wrong", f"{name}: {what}"
    except (InputError, NumericalError) as error:
        return "refused", str(error)
    return "right", ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    counts, late, why = Counter[str](), Counter[str](), Counter[str]()
    stop, k = time.monotonic() + asked.seconds, 0
    while time.monotonic() < stop:
        family = ALL[k % len(ALL)]
        for ask, of in ((tried, counts), (behind_part_of_a_sample, late)):
            kind, what = ask(family, asked.seed, k)
            of[kind] += 1
            if kind == "wrong":
                print(f"WRONG {family.__name__} seed {asked.seed} loop {k}: {what[:400]}", flush=True)
            elif kind not in ("right", "none"):
                why[f"{kind}: {family.__name__}: {what[:60]}"] += 1
        k += 1
    print(f"seed {asked.seed}: {k} loops, {dict(counts)}; behind part of a sample: {dict(late)}")
    for reason, times in why.most_common(25):
        print(f"  {100.0 * times / k:6.3f} % {reason}")
    return 1 if counts["wrong"] or late["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
