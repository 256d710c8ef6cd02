"""What must hold for every loop: scaling of time and gain, and margins that bring the poles to the border."""

import cmath
import math

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpc, mpf

from actuator_lti.errors import InputError
from actuator_lti.margins import stability_margins

PERIOD_S = 0.02
finite = {"allow_nan": False, "allow_infinity": False}


@st.composite
def loops(draw: st.DrawFn, sampled: bool | None = None) -> control.TransferFunction:
    """Stable or unstable loop of order 2 to 5 with poles and zeros within three decades."""
    is_sampled = draw(st.booleans()) if sampled is None else sampled

    def pair() -> np.ndarray:
        w = 10 ** draw(st.floats(-1, 1.5, **finite))
        zeta = 10 ** draw(st.floats(-2.5, 0.3, **finite)) * draw(st.sampled_from([1, 1, 1, -1]))
        roots = np.roots([1, 2 * zeta * w, w * w])
        return (
            np.real(np.poly(np.exp(roots * PERIOD_S))) if is_sampled else np.array([1, 2 * zeta * w, w * w])
        )

    den = pair()
    if draw(st.booleans()):
        den = np.polymul(den, pair())
    if draw(st.booleans()):
        den = np.polymul(den, [1, -1] if is_sampled else [1, 0])
    num = np.array([1.0])
    if draw(st.booleans()):
        num = pair()[-2:] if den.size < 4 else pair()
    x = 10 ** draw(st.floats(-0.5, 1.2, **finite))
    point = cmath.exp(1j * x * PERIOD_S) if is_sampled else 1j * x
    size = abs(np.polyval(num, point) / np.polyval(den, point))
    assume(1e-12 < size < 1e12)
    return control.tf(num / size, den, PERIOD_S if is_sampled else 0)


def closed_loop_at(loop: control.TransferFunction, factor: complex, delay_s: float, omega: float) -> float:
    """|1 + factor L exp(-s delay)| on the border, relative to the size of its terms; 40 digits."""
    with mp.workdps(40):
        w = mpf(omega)
        point = mp.expj(w * PERIOD_S) if loop.dt else mpc(0, w)
        above = (
            mp.polyval([mpf(float(c)) for c in loop.num[0][0][::-1]], point, asc=True)
            * factor
            * mp.expj(-w * delay_s)
        )
        below = mp.polyval([mpf(float(c)) for c in loop.den[0][0][::-1]], point, asc=True)
        return float(abs(above + below) / (abs(above) + abs(below)))


@settings(max_examples=120)
@given(loops())
def test_each_margin_brings_a_pole_to_the_border(loop: control.TransferFunction) -> None:
    m = stability_margins(loop)
    assume(m.stable is not None)
    for gain in m.gain_margins:
        if math.isfinite(gain.frequency_rad_s):
            assert closed_loop_at(loop, gain.ratio, 0.0, gain.frequency_rad_s) < 1e-6
    for phase in m.phase_margins:
        turned = cmath.exp(-1j * math.radians(phase.deg))
        assert closed_loop_at(loop, turned, 0.0, phase.frequency_rad_s) < 1e-6
    for delay in m.delay_margins:
        assert closed_loop_at(loop, 1.0, delay.seconds, delay.frequency_rad_s) < 1e-6


@settings(max_examples=60)
@given(loops())
def test_a_gain_just_inside_keeps_the_verdict_and_just_outside_changes_it(
    loop: control.TransferFunction,
) -> None:
    m = stability_margins(loop)
    assume(m.stable)
    above = min((g.ratio for g in m.gain_margins if g.ratio > 1), default=None)
    if above is None or above > 1e6 or above < 1.001:
        return
    assert stability_margins(loop * (0.5 + 0.5 * above)).stable
    tangent = any(g.tangent for g in m.gain_margins)
    try:
        outside = stability_margins(loop * (above * 1.0001))
    except InputError:  # 1 + L(infinity) = 0 there
        return
    assert tangent or outside.stable is not True


@settings(max_examples=60)
@given(loops(sampled=False), st.floats(-2, 2, **finite))
def test_scaling_time_scales_every_frequency(loop: control.TransferFunction, decade: float) -> None:
    k = 2.0 ** round(3.3 * decade)  # exact in binary
    num, den = loop.num[0][0], loop.den[0][0]
    faster = control.tf(
        num / k ** np.arange(num.size - 1, -1, -1), den / k ** np.arange(den.size - 1, -1, -1)
    )
    a, b = stability_margins(loop), stability_margins(faster)
    assert a.stable is b.stable
    assert [p.frequency_rad_s for p in b.phase_margins] == pytest.approx(
        [k * p.frequency_rad_s for p in a.phase_margins], rel=1e-6
    )
    assert [g.frequency_rad_s for g in b.gain_margins] == pytest.approx(
        [k * g.frequency_rad_s for g in a.gain_margins], rel=1e-6
    )
    if a.modulus_margin is not None:
        assert b.modulus_margin == pytest.approx(a.modulus_margin, rel=1e-6)


@settings(max_examples=60)
@given(loops(), st.floats(-1, 1, **finite))
def test_scaling_gain_moves_gain_margins_and_leaves_their_frequencies(
    loop: control.TransferFunction, decade: float
) -> None:
    k = 2.0 ** round(3.3 * decade)
    a = stability_margins(loop)
    try:
        b = stability_margins(loop * k)
    except InputError:
        return
    assume(a.stable is not None and b.stable is not None)
    farthest = 10.0**9.9 * min(1.0, 1.0 / k)  # ratios above 200 dB of either are not listed
    before = [g for g in a.gain_margins if g.ratio / k < farthest]
    after = [g for g in b.gain_margins if g.ratio < farthest]
    assert [g.ratio for g in after] == pytest.approx([g.ratio / k for g in before], rel=1e-6)
    assert [g.frequency_rad_s for g in after] == pytest.approx([g.frequency_rad_s for g in before], rel=1e-6)


@settings(max_examples=40)
@given(loops(), st.integers(0, 2**31))
def test_smallest_distances_are_not_undercut_on_a_grid(loop: control.TransferFunction, seed: int) -> None:
    m = stability_margins(loop)
    assume(m.modulus_margin is not None and m.disk_margin is not None)
    top = math.pi / PERIOD_S if loop.dt else 1e4
    omega = np.exp(np.random.default_rng(seed).uniform(math.log(1e-3), math.log(top), 3000))
    points = np.exp(1j * omega * PERIOD_S) if loop.dt else 1j * omega
    L = np.polyval(loop.num[0][0], points) / np.polyval(loop.den[0][0], points)
    rel = 1e-3 if loop.dt else 1e-6  # polynomials in z near z = 1 lose digits in this plain evaluation
    assert m.modulus_margin <= np.abs(1 + L).min() * (1 + rel)
    assert m.disk_margin.alpha <= np.abs(2 * (1 + L) / (1 - L)).min() * (1 + rel)


def wound(loop: control.TransferFunction, delay_s: float, crossovers: list[float]) -> int:
    """Unstable closed-loop poles by the turn of (N exp(-s delay) + D)/(s + 1)^n over a fine grid."""
    num, den = loop.num[0][0], loop.den[0][0]
    about = np.concatenate((crossovers, np.abs(loop.poles()))) if crossovers else np.abs(loop.poles())
    near = (1.0 + np.outer([-1.0, 1.0], np.geomspace(1e-9, 0.5, 400))).ravel()
    w = np.unique(
        np.concatenate((np.geomspace(1e-6, 1e7, 40_001), np.outer(about[about > 0.0], near).ravel()))
    )
    s = 1j * w
    f = (np.polyval(num, s) * np.exp(-s * delay_s) + np.polyval(den, s)) / (s + 1.0) ** (den.size - 1)
    return -round(float(np.angle(f[1:] / f[:-1]).sum()) / math.pi)


@settings(max_examples=25)
@given(loops(sampled=False), st.floats(0.02, 0.98, **finite))
def test_delays_below_the_margin_keep_stability_and_above_it_end_it(
    loop: control.TransferFunction, part: float
) -> None:
    m = stability_margins(loop)
    quoted = m.delay_margin
    assume(m.stable and quoted is not None and not quoted.samples)
    assume(quoted.seconds * quoted.frequency_rad_s > 1e-3)
    crossovers = [p.frequency_rad_s for p in m.phase_margins]
    assume(all(abs(w / quoted.frequency_rad_s - 1) > 0.05 or w == quoted.frequency_rad_s for w in crossovers))
    assume(not any(p.tangent for p in m.phase_margins))  # one that only touches lets the poles return
    assume(len(loop.num[0][0]) < len(loop.den[0][0]))
    inside = stability_margins(loop, delay_s=part * quoted.seconds)
    outside = stability_margins(loop, delay_s=1.01 * quoted.seconds)
    assert inside.stable
    assert outside.stable is False
    for m, delay_s, unstable in ((inside, part * quoted.seconds, 0), (outside, 1.01 * quoted.seconds, 2)):
        assert wound(loop, delay_s, crossovers) == unstable
        counted = {m.agreement.unstable_poles, m.agreement.unstable_nyquist}
        assert counted - ({None} if m.evidence == "certified" else set()) == {unstable}
