"""What must hold for every loop: scaling of time and gain, and margins that bring the poles to the border."""

import cmath
import math

import control
import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

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
