"""Beside independent tools, where the machine has them: SLICOT's benchmarks and norm, Octave's margins.

None is taken for truth: where a tool and the toolkit differ, exact arithmetic has to side with the toolkit.
``pip install ctrlsys slycot`` and Debian's ``octave-control`` bring them; without them the tests are skipped.
"""

import math
import shutil
import subprocess
from collections.abc import Iterator
from typing import Any

import control
import numpy as np
import pytest
from flint import arb, arb_poly, ctx, fmpz_poly

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins import stability_margins
from tests.margins.margin_truth import bilinear, even_odd, polynomials, positive

_AGREE = 1e-6
_LARGEST = 40


def benchmark_loops(ctrlsys: Any) -> Iterator[tuple[str, control.StateSpace]]:
    """First input to first output of every benchmark that needs no data file and is not too large."""
    for make, kind, dt in ((ctrlsys.bd01ad, "ctdsx", 0), (ctrlsys.bd02ad, "dtdsx", 1.0)):
        for group in (1, 2, 3, 4):
            for number in range(1, 13):
                try:
                    result = make("D", np.array([group, number], dtype=np.int32), np.zeros(7),
                                 np.zeros(1, dtype=np.int32))  # fmt: skip
                except (ValueError, RuntimeError):
                    continue
                vec, n, _, _, _, a, b, c, d, _, info = result[:11]
                if info or vec[3] or not 0 < n <= _LARGEST:
                    continue
                D = d[:1, :1] if vec[7] else np.zeros((1, 1))
                yield (
                    f"{kind} {group}.{number}",
                    control.StateSpace(a[:n, :n], b[:n, :1], c[:1, :n], D, dt, remove_useless_states=False),
                )


def exact_modulus_margin(loop: control.LTI) -> float:
    """Smallest |1 + L| from every stationary point of |N + D|^2/|D|^2, certified."""
    num, den = polynomials(loop)
    n, v = den.degree(), fmpz_poly([0, 1])
    if loop.isdtime(strict=True):
        num, den = bilinear(num, n), bilinear(den, n)
    (ae, ao), (be, bo) = even_odd(num + den), even_odd(den)
    above, below = ae * ae + v * ao * ao, be * be + v * bo * bo
    ends = [(above[0], below[0]), (above[n], below[n])]
    values = [float(arb(a) / arb(b)) for a, b in ends if b != 0]
    with ctx.workprec(256):
        for w in positive(above.derivative() * below - above * below.derivative()):
            ratio = arb_poly(above)(w * w) / arb_poly(below)(w * w)
            if ratio.is_finite():
                values.append(float(ratio.mid()))
    return math.sqrt(max(min(values), 0.0))


def test_peaks_of_sensitivity_beside_slicot() -> None:
    ctrlsys = pytest.importorskip("ctrlsys", reason="no ctrlsys here: SLICOT's benchmarks are not compared")
    slycot = pytest.importorskip("slycot", reason="no slycot here: SLICOT's norm is not compared")
    compared, differing = 0, []
    for name, loop in benchmark_loops(ctrlsys):
        try:
            mine = stability_margins(loop)
        except (InputError, NumericalError) as error:
            differing.append(f"{name}: refused, {error}")
            continue
        if mine.modulus_margin is None:
            differing.append(f"{name}: withheld")
            continue
        S = control.feedback(control.ss([], [], [], [[1.0]], loop.dt), loop)
        dico = "D" if loop.isdtime(strict=True) else "C"
        n = S.A.shape[0]
        norm, _ = slycot.ab13dd(dico, "I", "S", "D", n, 1, 1, S.A, np.eye(n), S.B, S.C, S.D)
        compared += 1
        theirs = 1.0 / float(norm)
        if abs(theirs - mine.modulus_margin) <= _AGREE * max(mine.modulus_margin, 1e-9):
            continue
        truth = exact_modulus_margin(loop)
        differing.append(f"{name}: {mine.modulus_margin:.9g}, SLICOT {theirs:.9g}, exact {truth:.9g}")
        assert mine.modulus_margin == pytest.approx(truth, rel=_AGREE, abs=1e-12), differing[-1]
    print("\n".join([f"{compared} compared", *differing]))  # noqa: T201
    assert compared >= 10


def test_margins_beside_octave() -> None:
    if shutil.which("octave-cli") is None:
        pytest.skip("no octave-cli here: Octave's margins are not compared")
    rng = np.random.default_rng(17)
    loops = [_random_loop(rng) for _ in range(200)]
    lines = ["pkg load control; warning('off', 'all');"]
    for num, den in loops:
        text = "], [".join(" ".join(f"{v:.17g}" for v in p) for p in (num, den))
        shown = "printf('%.17g %.17g %.17g %.17g\\n', g, p, wg, wp); catch, printf('NaN NaN NaN NaN\\n'); end"
        lines.append(f"try, [g, p, wg, wp] = margin(tf([{text}])); {shown}")
    done = subprocess.run(["octave-cli", "--quiet", "--no-init-file"], input="\n".join(lines),
                          capture_output=True, text=True, check=False, timeout=600)  # fmt: skip
    answers = [line for line in done.stdout.splitlines() if len(line.split()) == 4]
    if len(answers) != len(loops):
        pytest.skip(f"octave-cli has no usable control package: {done.stderr[-200:]}")
    differing, compared = [], 0
    for k, ((num, den), line) in enumerate(zip(loops, answers, strict=True)):
        gain, _, at, crossover = (float(x) for x in line.split())
        mine = stability_margins(control.tf(num, den))
        if mine.withheld:
            differing.append(f"{k}: withheld")
            continue
        compared += math.isfinite(crossover) + math.isfinite(at)
        if math.isfinite(crossover) and crossover > 0 and not _listed(crossover, mine.phase_margins):
            size = abs(np.polyval(num, 1j * crossover) / np.polyval(den, 1j * crossover))
            differing.append(f"{k}: Octave's gain crossover {crossover:.9g}, where |L| is {size:.6g}")
            assert abs(size - 1.0) > 1e-9, differing[-1]
        if math.isfinite(at) and at > 0 and not _listed(at, mine.gain_margins):
            L = np.polyval(num, 1j * at) / np.polyval(den, 1j * at)
            differing.append(f"{k}: Octave's gain margin {gain:.6g} at {at:.9g}, where L is {L:.6g}")
            assert abs(L.imag) > 1e-9 * abs(L) or L.real > 0, differing[-1]
    print("\n".join([f"{compared} crossings of {len(loops)} loops compared", *differing]))  # noqa: T201
    assert compared >= 100


def _listed(omega: float, margins: tuple[Any, ...]) -> bool:
    return any(abs(m.frequency_rad_s - omega) <= 1e-5 * omega for m in margins)


def _random_loop(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    poles = -(10.0 ** rng.uniform(-2, 3, int(rng.integers(1, 5))))
    w, zeta = 10.0 ** rng.uniform(-1, 2), 10.0 ** rng.uniform(-3, 0)
    den = np.polymul(np.poly(poles), [1.0, 2 * zeta * w, w * w] if rng.random() < 0.6 else [1.0])
    if rng.random() < 0.5:
        den = np.polymul(den, [1.0, 0.0])
    zeros = -(10.0 ** rng.uniform(-2, 3, int(rng.integers(0, den.size - 1))))
    num = np.atleast_1d(np.poly(zeros))
    at = 1j * 10.0 ** rng.uniform(-1, 2)
    return num * abs(np.polyval(den, at) / np.polyval(num, at)), den
