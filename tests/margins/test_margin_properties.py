"""What must hold for every loop: no distance is undercut, and delays up to the margin keep stability."""

import math
from collections.abc import Iterator

import control
import numpy as np
from margin_families import PERIOD_S, integrators_and_whole_samples

from actuator_lti.margins import StabilityMargins, stability_margins


def drawn(count: int) -> Iterator[tuple[control.TransferFunction, StabilityMargins]]:
    """Loops whose margins are told."""
    for seed in range(count):
        loop = integrators_and_whole_samples(np.random.default_rng([seed, 31]))
        if not (m := stability_margins(loop)).withheld:
            yield loop, m


def test_smallest_distances_are_not_undercut_on_a_grid() -> None:
    rng, compared = np.random.default_rng(7), 0
    for loop, m in drawn(60):
        top = math.pi / PERIOD_S if loop.dt else 1e4
        omega = np.exp(rng.uniform(math.log(1e-3), math.log(top), 3000))
        points = np.exp(1j * omega * PERIOD_S) if loop.dt else 1j * omega
        L = np.polyval(loop.num[0][0], points) / np.polyval(loop.den[0][0], points)
        rel = 1e-3 if loop.dt else 1e-6  # polynomials in z near z = 1 lose digits in this plain evaluation
        assert m.modulus_margin <= np.abs(1 + L).min() * (1 + rel)
        assert m.disk_margin.alpha <= np.abs(2 * (1 + L) / (1 - L)).min() * (1 + rel)
        compared += 1
    assert compared > 50


def wound(loop: control.TransferFunction, delay_s: float, crossovers: list[float]) -> int:
    """Unstable closed-loop poles by the turn of (N exp(-s delay) + D)/(s + 1)^n over a fine grid."""
    num, den = loop.num[0][0], loop.den[0][0]
    about = np.concatenate((crossovers, np.abs(loop.poles())))
    near = (1.0 + np.outer([-1.0, 1.0], np.geomspace(1e-9, 0.5, 400))).ravel()
    w = np.concatenate((np.geomspace(1e-6, 1e7, 40_001), np.outer(about[about > 0.0], near).ravel()))
    s = 1j * np.unique(w)
    f = (np.polyval(num, s) * np.exp(-s * delay_s) + np.polyval(den, s)) / (s + 1.0) ** (den.size - 1)
    return -round(float(np.angle(f[1:] / f[:-1]).sum()) / math.pi)


def test_delays_below_the_margin_keep_stability_and_above_it_end_it() -> None:
    """But where a gain only touches one, or passes it again near by: there the poles may return."""
    compared = 0
    for loop, m in drawn(320):
        quoted, crossovers = m.delay_margin, [p.frequency_rad_s for p in m.phase_margins]
        if loop.dt or not m.stable or quoted is None or any(p.tangent for p in m.phase_margins):
            continue
        if any(0.0 < abs(w / quoted.frequency_rad_s - 1) < 0.05 for w in crossovers):
            continue
        for part, unstable in ((0.05, 0), (0.5, 0), (0.98, 0), (1.01, 2)):
            delay_s = part * quoted.seconds
            late = stability_margins(loop, delay_s=delay_s)
            assert late.stable is (unstable == 0)
            assert wound(loop, delay_s, crossovers) == unstable
            counted = {late.agreement.unstable_poles, late.agreement.unstable_nyquist}
            assert counted - ({None} if late.evidence == "certified" else set()) == {unstable}
        compared += 1
    assert compared > 25
