"""Crossings and unstable poles of rational loops from exact doubles and certified roots, for the tests."""

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise

import control
import numpy as np
from flint import acb, arb, ctx, fmpq, fmpq_mat, fmpq_poly, fmpz_poly
from scipy.optimize import brentq

from actuator_lti.margins import StabilityMargins

FARTHEST = 1e10
RATIO, DEG = 1e-9, 1e-7
ULP = 8  # by how much the entries may be wrong
NEIGHBOURS = 6
STEP = arb(2) ** -100
NEXT = 1e-12  # relative: to the end of an interval
LOWEST = 1e-60  # of an interval that begins at rest: poles may lie twelve decades below the delay
BITS = (256, 1024, 4096, 16384)


@dataclass(frozen=True)
class Facts:
    """Unstable closed-loop poles, ratios and phase margins (deg) in order of frequency (rad/s)."""

    unstable: int | None
    gains: list[tuple[float, float]]
    phases: list[tuple[float, float]]


def truth_of(loop: control.LTI, part: Fraction = Fraction(0)) -> Facts:
    """Of a loop; behind part p/r of a sample in the r-th root of z, without the verdict and the ends."""
    num, den = polynomials(loop)
    r, period = part.denominator, float(loop.dt or 0.0)
    if period:
        root = fmpz_poly([0] * r + [1])
        num, den = num(root), den(root) * fmpz_poly([0] * part.numerator + [1])
        n = den.degree()
        num, den = bilinear(num, n), bilinear(den, n)
    hidden = num.gcd(den)
    num, den = num // hidden, den // hidden
    with ctx.workprec(BITS[0]):
        (ne, no), (de, do) = even_odd(num), even_odd(den)
        v = fmpz_poly([0, 1])
        gain, phase = ne * ne + v * no * no - de * de - v * do * do, no * de - ne * do
        top = math.tan(0.5 * math.pi / r) * (1.0 - 1e-15) if period else math.inf
        unit = r / period if period else 1.0

        def crossings(p: fmpz_poly) -> list[tuple[float, complex]]:
            found = [(x, num(acb(0, x)) / den(acb(0, x))) for x in positive(p) if float(x.mid()) < top]
            return [(unit * 2.0 * math.atan(float(x)) if period else float(x), complex(L)) for x, L in found]

        gains = [(w, -1.0 / L.real) for w, L in crossings(phase) if L.real < 0.0]
        phases = [(w, math.degrees(math.atan2(-L.imag, -L.real))) for w, L in crossings(gain)]
        unstable = None
        if r == 1:
            unstable = right_of_axis(num + den) + right_of_axis(hidden)
            n = max(num.degree(), den.degree())
            both = ((0.0, num[0], den[0]), (math.pi / period if period else math.inf, num[n], den[n]))
            gains += [(w, -float(arb(d) / arb(c))) for w, c, d in both if c * d < 0 and n]
    return Facts(unstable, sorted(g for g in gains if 1.0 / FARTHEST <= g[1] <= FARTHEST), phases)


def behind_delay(loop: control.LTI, delay_s: float, top: float = 0.0) -> Facts:
    """Of a strictly proper continuous loop behind a delay, gain margins up to a frequency.

    Poles pass over the axis only where |L| = 1: into the right half plane, by pairs, where it falls, and back
    where it rises, at the delay that uses up the phase margin and after each further turn (Walton and
    Marshall, Direct method for TDS stability analysis, IEE Proc. D 134, 1987). The last one falls, and they
    alternate.
    """
    free = truth_of(loop)
    unstable, into, phases = free.unstable, 2, []
    for w, deg in reversed(free.phases):
        turns = math.floor((delay_s * w - math.radians(deg % 360.0)) / (2.0 * math.pi)) + 1
        unstable += into * max(turns, 0)
        into = -into
        phases.append((w, -math.degrees(math.remainder(delay_s * w - math.radians(deg), 2.0 * math.pi))))
    at_rest = [g for g in free.gains if g[0] == 0.0]
    return Facts(unstable, at_rest + late_gains(loop, delay_s, top), phases[::-1])


def late_gains(loop: control.LTI, delay_s: float, top: float) -> list[tuple[float, float]]:
    """Gain margins behind a delay, 0 < w < top.

    The phase, a sum of angles to certified roots, goes one way between the roots of its exact slope.
    """
    num, den = polynomials(loop)
    hidden = num.gcd(den)
    num, den = num // hidden, den // hidden
    (ae, ao), (be, bo) = even_odd(num.derivative() * den - num * den.derivative()), even_odd(num * den)
    v, late = fmpz_poly([0, 1]), Fraction(delay_s)
    slope = late.denominator * (ae * be + v * ao * bo) - late.numerator * (be * be + v * bo * bo)
    with ctx.workprec(BITS[0]):
        weighed = [(acb(z), n * sign) for p, sign in ((num, 1), (den, -1)) for z, n in roots(p)]

        def half_turns(w: arb | float) -> arb:
            """Of the phase, less one: even where L is on the negative real axis."""
            total = arb(0) if num[num.degree()] * den[den.degree()] > 0 else arb.pi()
            for z, weight in weighed:
                angle = acb(abs(z.real), arb(w) - z.imag).arg()
                total += weight * (arb.pi() - angle if z.real > 0 else angle)
            return (total - arb(late.numerator) / late.denominator * arb(w)) / arb.pi() - 1

        def gain_margin(w: float, k: int) -> tuple[float, float]:
            x = arb(w)
            for _ in range(2):  # on a sharp resonance a double is too coarse for the gain
                here, beside = half_turns(x), half_turns(x * (1 + STEP))
                x = (x - (here - 2 * k) * x * STEP / (beside - here)).mid()
            return w, float(abs(den(acb(0, x)) / num(acb(0, x))))

        axis = [float(z.imag) for z, _ in weighed if z.real.contains(0) and z.imag > 0]
        edges = sorted({0.0, top, *(w for w in (*axis, *map(float, positive(slope))) if w < top)})
        found = []
        for low, high in pairwise(edges):
            low, high = low * (1.0 + NEXT) or LOWEST * high, high * (1.0 - NEXT)
            first, last = sorted((half_turns(low) / 2, half_turns(high) / 2), key=float)
            turns = range(int(first.ceil().unique_fmpz()), int(last.floor().unique_fmpz()) + 1)
            for k in turns:
                w = brentq(lambda w, k=k: float(half_turns(w) - 2 * k), low, high, xtol=1e-300, rtol=1e-15)
                found.append(gain_margin(w, k))
        return [g for g in sorted(found) if 1.0 / FARTHEST <= g[1] <= FARTHEST]


def polynomials(loop: control.LTI) -> tuple[fmpz_poly, fmpz_poly]:
    """Numerator and denominator of the very doubles, lowest power first, times one number."""
    if isinstance(loop, control.TransferFunction):
        parts = (np.trim_zeros(p[0][0], "f")[::-1] for p in (loop.num, loop.den))
        num, den = (fmpq_poly(rationals(part)) for part in parts)
    else:
        A, b, c = (fmpq_mat(*part.shape, rationals(part)) for part in (loop.A, loop.B[:, :1], loop.C[:1]))
        den = A.charpoly()
        num = (A - b * c).charpoly() + (rationals(loop.D)[0] - 1) * den  # D + det(s - A + b c)/det(s - A) - 1
    unit = num.denom() * den.denom()
    return (num * unit).numer(), (den * unit).numer()


def rationals(x: np.ndarray) -> list[fmpq]:
    return [fmpq(*float(v).as_integer_ratio()) for v in np.ravel(x)]


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
    real = [(acb(z).real, n) for z, n in roots(p) if acb(z).imag == 0]
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
    for bits in BITS:
        with ctx.workprec(bits):
            real = [(acb(z).real, n) for z, n in roots(rest)]
            if all(x > 0 or x < 0 for x, _ in real):
                return count + sum(n for x, n in real if x > 0)
    raise AssertionError("a root is not told from the axis")


def roots(p: fmpz_poly) -> list[tuple[acb, int]]:
    return p.complex_roots() if p.degree() > 0 else []


def facts(m: StabilityMargins) -> Facts:
    gains = [(g.frequency_rad_s, g.ratio) for g in m.gain_margins if not g.tangent]
    phases = [(p.frequency_rad_s, p.deg) for p in m.phase_margins if not p.tangent]
    counts = (m.agreement.unstable_poles, m.agreement.unstable_nyquist)
    return Facts(next((c for c in counts if c is not None), None), gains, phases)


def below(f: Facts, top: float) -> Facts:
    """With gain margins below a frequency alone."""
    return replace(f, gains=[g for g in f.gains if g[0] < top])


def nearest(f: Facts) -> Facts:
    """With the gain margin nearest to one alone."""
    return replace(f, gains=sorted(f.gains, key=lambda g: abs(math.log(g[1])))[:1])


def unlike(a: Facts, b: Facts, ratio: float = RATIO, deg: float = DEG, far: float = FARTHEST) -> str | None:
    """What differs, or ``None``; gain margins beyond ``far`` are left out."""
    if a.unstable is not None and b.unstable is not None and a.unstable != b.unstable:
        return f"{a.unstable} unstable, not {b.unstable}"
    gains = [[g for g in f.gains if 1.0 / far < g[1] < far] for f in (a, b)]
    for name, (ours, theirs) in (("gain margins", gains), ("phase margins", (a.phases, b.phases))):
        if len(ours) != len(theirs):
            return f"{name} {ours[:6]}, not {theirs[:6]}"
        for (w, x), (u, y) in zip(ours, theirs, strict=True):
            far_off = abs(math.remainder(x - y, 360.0)) > deg
            if name == "gain margins":
                far_off = abs(x / y - 1.0) > ratio
            if far_off or not math.isclose(w, u, rel_tol=max(ratio, 1e-6), abs_tol=1e-300):
                return f"{name}: {x} at {w}, not {y} at {u}"
    return None


def difference(m: StabilityMargins, expected: Facts, rel: float = 1e-6) -> str | None:
    """What is wrong, or ``None``."""
    if m.stable is None:
        return f"withheld: {m.agreement}"
    if m.stable is (expected.unstable != 0):
        return f"verdict {m.verdict}, but {expected.unstable} unstable"
    return unlike(facts(m), expected, rel, 1e3 * rel)


def moved(loop: control.LTI, rng: np.random.Generator) -> control.LTI:
    """Each entry 8 ulp up or down."""

    def near(x: np.ndarray) -> np.ndarray:
        return x + ULP * np.spacing(np.abs(x)) * rng.choice([-1.0, 1.0], np.shape(x)) * (x != 0.0)

    if isinstance(loop, control.TransferFunction):
        return control.tf(near(loop.num[0][0]), near(loop.den[0][0]), loop.dt)
    parts = [near(np.asarray(part)) for part in (loop.A, loop.B, loop.C, loop.D)]
    return control.StateSpace(*parts, loop.dt, remove_useless_states=False)


def towards_the_limit(loop: control.TransferFunction) -> control.TransferFunction:
    """Each coefficient moved by 8 ulp so as to carry the closed-loop pole nearest to the border across."""
    num, den = polynomials(loop)
    closed = num + den
    slope = closed.derivative()
    with ctx.workprec(BITS[1]):
        poles = [acb(z) for z, times in roots(closed) if times == 1 and not acb(z).contains(0)]
        if not poles:
            return loop

        def distance(p: acb) -> float:
            return float((abs(p) - 1).mid() if loop.dt else (p.real / abs(p)).mid())

        pole = min(poles, key=lambda p: abs(distance(p)))
        way = -1 if distance(pole) > 0 else 1

        def near(part: np.ndarray) -> np.ndarray:
            x = np.trim_zeros(np.asarray(part, dtype=float), "f")
            steps = [-(pole ** (x.size - 1 - k)) / slope(pole) for k in range(x.size)]
            out = [(pole.conjugate() * step if loop.dt else step).real * way > 0 for step in steps]
            return x + ULP * np.spacing(np.abs(x)) * np.where(out, 1.0, -1.0) * (x != 0.0)

        return control.tf(near(loop.num[0][0]), near(loop.den[0][0]), loop.dt)


def determined(loop: control.LTI, answer: Facts, rng: np.random.Generator, count: int = NEIGHBOURS) -> bool:
    """Whether neighbours 8 ulp away, random ones and the one most likely to differ, all have these facts."""
    near = [moved(loop, rng) for _ in range(count)]
    if isinstance(loop, control.TransferFunction):
        near.append(towards_the_limit(loop))
    return all(unlike(answer, truth_of(other), 0.05, 5.0) is None for other in near)
