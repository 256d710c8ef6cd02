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
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import control
import numpy as np
from flint import acb, arb, ctx, fmpz_poly

sys.path.insert(0, str(Path(__file__).parent))
from margin_families import FAMILIES, PERIOD_S, poly, roots_of, scaled, signs, uniform

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins import StabilityMargins, stability_margins
from actuator_lti.systems.delay_system import DelaySystem

FARTHEST = 1e10
RATIO, DEG = 1e-9, 1e-7
_BITS = 256


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


def cancelled_on_the_border(rng: np.random.Generator) -> control.TransferFunction:
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


def plain_sampled(rng: np.random.Generator) -> control.TransferFunction:
    """One or two poles, for delays of every kind."""
    poles = [complex(rng.uniform(-0.9, 1.0)) for _ in range(int(rng.integers(1, 3)))]
    if rng.random() < 0.3:
        poles[0] = 1.0 + 0j
    zeros = [complex(rng.uniform(-1.5, 1.5))] * int(rng.integers(0, len(poles)))
    return control.tf(poly(zeros) * uniform(rng, -1.5, 1.0) * signs(rng, 0.3), poly(poles), PERIOD_S)


Family = Callable[[np.random.Generator], control.LTI]
ALL: tuple[Family, ...] = (
    *FAMILIES, nearly_lossless, nearly_tangent, cancelled_on_the_border, hard_against_nyquist, plain_sampled,
    plain_sampled,
)  # fmt: skip


@dataclass(frozen=True)
class Facts:
    """Unstable closed-loop poles, ratios and phase margins (deg) in order of frequency (rad/s)."""

    unstable: int | None
    gains: list[tuple[float, float]]
    phases: list[tuple[float, float]]


def truth(loop: control.TransferFunction, part: Fraction = Fraction(0)) -> Facts:
    """From the exact coefficients; behind part p/r of a sample in the r-th root of z."""
    num, den = integers(loop)
    r = part.denominator
    if loop.dt:
        root = fmpz_poly([0] * r + [1])
        num, den = num(root), den(root) * fmpz_poly([0] * part.numerator + [1])
        n = den.degree()
        num, den = bilinear(num, n), bilinear(den, n)
    hidden = num.gcd(den)
    num, den = num // hidden, den // hidden
    with ctx.workprec(_BITS):
        (ne, no), (de, do) = even_odd(num), even_odd(den)
        v = fmpz_poly([0, 1])
        gain, phase = ne * ne + v * no * no - de * de - v * do * do, no * de - ne * do
        top = math.tan(0.5 * math.pi / r) * (1.0 - 1e-15) if loop.dt else math.inf
        unit = r / float(loop.dt) if loop.dt else 1.0

        def crossings(p: fmpz_poly) -> list[tuple[float, complex]]:
            found = [(x, num(acb(0, x)) / den(acb(0, x))) for x in positive(p) if float(x.mid()) < top]
            return [(unit * 2.0 * math.atan(float(x)) if loop.dt else float(x), complex(L)) for x, L in found]

        gains = [(w, -1.0 / L.real) for w, L in crossings(phase) if L.real < 0.0]
        phases = [(w, math.degrees(math.atan2(-L.imag, -L.real))) for w, L in crossings(gain)]
        unstable = None
        if r == 1:
            unstable = right_of_axis(num + den) + right_of_axis(hidden)
            n = max(num.degree(), den.degree())
            last = math.pi / float(loop.dt) if loop.dt else math.inf
            both = ((0.0, num[0], den[0]), (last, num[n], den[n]))
            gains += [(w, -float(arb(d) / arb(c))) for w, c, d in both if c * d < 0 and n]
    return Facts(unstable, sorted(g for g in gains if g[1] <= FARTHEST), phases)


def integers(loop: control.TransferFunction) -> tuple[fmpz_poly, fmpz_poly]:
    """Numerator and denominator, lowest power first, times one power of two."""
    parts = [[Fraction(float(c)) for c in np.trim_zeros(p[0][0], "f")[::-1]] for p in (loop.num, loop.den)]
    unit = max(c.denominator for part in parts for c in part)
    num, den = (fmpz_poly([int(c * unit) for c in part]) for part in parts)
    return num, den


def bilinear(p: fmpz_poly, n: int) -> fmpz_poly:
    """(1 - s)^n p((1 + s)/(1 - s))."""
    out = fmpz_poly()
    for k, c in enumerate(p.coeffs()):
        out += c * fmpz_poly([1, 1]) ** k * fmpz_poly([1, -1]) ** (n - k)
    return out


def even_odd(p: fmpz_poly) -> tuple[fmpz_poly, fmpz_poly]:
    """p(j w) = even(v) + j w odd(v), v = w^2."""
    even, odd = ([(-1) ** k * c for k, c in enumerate(p.coeffs()[i::2])] for i in (0, 1))
    return fmpz_poly(even), fmpz_poly(odd)


def positive(p: fmpz_poly) -> list[arb]:
    """w of the positive roots v of odd multiplicity, in order."""
    if p.degree() < 1:
        return []
    real = [(acb(z).real, n) for z, n in p.complex_roots() if acb(z).imag == 0]
    return sorted((v.sqrt() for v, n in real if v > 0 and n % 2), key=lambda x: float(x.mid()))


def right_of_axis(p: fmpz_poly) -> int:
    """Roots with a positive real part; `AssertionError` where one is not told from the axis."""
    if p.degree() < 1:
        return 0
    while p[0] == 0:
        p = p.right_shift(1)
    even, odd = even_odd(p)
    common = even.gcd(odd) if odd.degree() >= 0 else even
    symmetric = common(fmpz_poly([0, 0, -1]))  # roots that lie symmetrically, those on the axis among them
    rest = p // symmetric
    count = sum(n for z, n in roots(symmetric) if acb(z).real > 0)
    for bits in (256, 1024, 4096, 16384):
        with ctx.workprec(bits):
            real = [(acb(z).real, n) for z, n in roots(rest)]
            if all(x > 0 or x < 0 for x, _ in real):
                return count + sum(n for x, n in real if x > 0)
    raise AssertionError("a root is not told from the axis")


def roots(p: fmpz_poly) -> list[tuple[acb, int]]:
    return p.complex_roots() if p.degree() > 0 else []


def moved(loop: control.TransferFunction, seed: int) -> control.TransferFunction:
    """Every coefficient 8 ulp away, up or down."""
    rng = np.random.default_rng(seed)
    num, den = (p[0][0] + 8.0 * np.spacing(p[0][0]) * rng.choice([-1.0, 1.0], p[0][0].size) * (p[0][0] != 0)
                for p in (loop.num, loop.den))  # fmt: skip
    return control.tf(num, den, loop.dt)


def facts(m: StabilityMargins) -> Facts:
    gains = [(g.frequency_rad_s, g.ratio) for g in m.gain_margins if not g.tangent]
    phases = [(p.frequency_rad_s, p.deg) for p in m.phase_margins if not p.tangent]
    counts = (m.agreement.unstable_poles, m.agreement.unstable_nyquist)
    return Facts(next((c for c in counts if c is not None), None), gains, phases)


def without_touches(f: Facts, m: StabilityMargins) -> Facts:
    """Without the pairs of crossings, closer than 1e-9 to the line between, that are listed as one touch."""
    touches = [x.frequency_rad_s for x in (*m.gain_margins, *m.phase_margins) if x.tangent]

    def rest(part: list[tuple[float, float]]) -> list[tuple[float, float]]:
        return [c for c in part if not any(math.isclose(c[0], w, rel_tol=1e-3) for w in touches)]

    return Facts(f.unstable, rest(f.gains), rest(f.phases))


def unlike(a: Facts, b: Facts, ratio: float = RATIO, deg: float = DEG, far: float = FARTHEST) -> str | None:
    """What differs, or ``None``; gain margins beyond ``far`` are left out."""
    if a.unstable is not None and b.unstable is not None and a.unstable != b.unstable:
        return f"{a.unstable} unstable, not {b.unstable}"
    gains = [[g for g in f.gains if 1.0 / far < g[1] < far] for f in (a, b)]
    for name, (ours, theirs) in (("gain margins", gains), ("phase margins", (a.phases, b.phases))):
        if len(ours) != len(theirs):
            return f"{name} {ours[:6]}, not {theirs[:6]}"
        for (w, x), (u, y) in zip(ours, theirs, strict=True):
            off = abs(x - y) if name == "phase margins" else abs(x / y - 1.0)
            off = min(off, abs(off - 360.0)) if name == "phase margins" else off
            if off > (deg if name == "phase margins" else ratio) or not math.isclose(
                w, u, rel_tol=1e-6, abs_tol=1e-300
            ):
                return f"{name}: {x} at {w}, not {y} at {u}"
    return None


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


def delayed_forms(
    loop: control.TransferFunction, rng: np.random.Generator
) -> Iterator[tuple[str, Facts, Facts]]:
    """Pairs that are to be the same, with a delay."""
    num, den = (np.trim_zeros(p[0][0], "f") for p in (loop.num, loop.den))
    if loop.dt:
        period, k = float(loop.dt), int(rng.integers(1, 4))
        explicit = control.tf(num, np.concatenate((den, np.zeros(k))), loop.dt)
        expected = truth(explicit)
        given = {
            "explicit 1/z": stability_margins(explicit),
            "delay_s": stability_margins(loop, delay_s=k * period),
        }
        if den[0] == 1.0 and num.size < den.size:  # with a feed-through its entries are rounded: another loop
            given["state space behind delay_s"] = stability_margins(control.ss(loop), delay_s=k * period)
        for name, m in given.items():
            if not m.withheld:
                yield name, facts(m), expected
        part = Fraction(int(rng.integers(1, 8)), int(rng.choice([2, 3, 4])))
        if part.denominator > 1 and hidden_free(loop):
            m = stability_margins(loop, delay_s=float(part) * period)
            if not m.withheld:
                end = math.pi / period * (1.0 - 1e-12)
                inside = facts(m)
                gains = [g for g in inside.gains if 0.0 < g[0] < end]
                yield f"{part} of a sample", Facts(None, gains, inside.phases), truth(loop, part)
        return
    if num.size >= den.size:
        return
    scale = float(np.abs(np.roots(den)).max() or 1.0)
    delay_s = uniform(rng, -1.5, 0.7) / scale
    one = stability_margins(loop, delay_s=delay_s)
    others = {
        "series delay system": stability_margins(DelaySystem.from_system(loop) * DelaySystem.delay(delay_s)),
        "certified": stability_margins(loop, delay_s=delay_s, certify=True),
    }
    for name, m in others.items():
        if not (one.withheld or m.withheld):
            yield f"delay_s against {name}", facts(one), facts(m)


def hidden_free(loop: control.TransferFunction) -> bool:
    num, den = integers(loop)
    return num.gcd(den).degree() < 1


def tried(family: Family, seed: int, k: int) -> tuple[str, str]:
    """("right" | "withheld" | "refused" | "undetermined" | "wrong", what)."""
    rng = np.random.default_rng([seed, k])
    loop = family(rng)
    try:
        m = stability_margins(loop)
        if m.withheld:
            return "withheld", m.evidence_reason
        ours = facts(m)
        expected = truth(loop) if isinstance(loop, control.TransferFunction) else ours
        if what := unlike(ours, without_touches(expected, m), 1e-6, 1e-3):
            near = [truth(moved(loop, n)) for n in range(4)]
            same = all(unlike(expected, other, 0.05, 5.0) is None for other in near)
            return ("wrong" if same else "undetermined"), f"against the truth: {what}"
        for name, other, unit in forms(loop, rng):
            theirs = facts(other)
            theirs = Facts(
                theirs.unstable, *([(w * unit, x) for w, x in part] for part in (theirs.gains, theirs.phases))
            )
            tight = (RATIO, DEG) if m.evidence == other.evidence == "checked" else (1e-6, 1e-3)
            if not other.withheld and (what := unlike(ours, theirs, *tight, far=30.0)):
                return "wrong", f"{name}: {what}"
        if isinstance(loop, control.TransferFunction) and rng.random() < 0.5:
            for name, a, b in delayed_forms(loop, rng):
                if what := unlike(a, b, 1e-6, 1e-3, far=90.0):
                    return "wrong", f"{name}: {what}"
    except (InputError, NumericalError) as error:
        return "refused", str(error)
    return "right", ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=120.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=1 << 30)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    counts: Counter[str] = Counter()
    why: Counter[str] = Counter()
    stop, k = time.monotonic() + asked.seconds, 0
    while time.monotonic() < stop and k < asked.most:
        family = ALL[k % len(ALL)]
        kind, what = tried(family, asked.seed, k)
        counts[kind] += 1
        if kind in ("withheld", "refused", "undetermined"):
            why[f"{kind}: {family.__name__}: {what[:60]}"] += 1
        if kind == "wrong":
            print(f"WRONG {family.__name__} seed {asked.seed} loop {k}: {what[:400]}", flush=True)
        k += 1
        if k % 1000 == 0:
            print(k, dict(counts), flush=True)
    print(f"seed {asked.seed}: {k} loops, {dict(counts)}")
    for reason, times in why.most_common(25):
        print(f"  {times:6d} {reason}")
    return 1 if counts["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
