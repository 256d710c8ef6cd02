"""Bandwidths (cases F3, F5, F6, F7), resonance, peaks of S and T, against closed forms."""

import cmath
import math
from functools import partial
from typing import Any

import control
import numpy as np
import pytest

from actuator_lti.bandwidth import closed_loop_bandwidth, peaks
from actuator_lti.errors import InputError
from actuator_lti.margins import stability_margins
from actuator_lti.step import step_figures
from actuator_lti.systems.delay_system import DelaySystem
from actuator_lti.systems.phase import unwrapped_phase_deg
from tests.refusals import refused

s = control.tf("s")
W = 2 * math.pi * 30
SECOND = W**2 / (s**2 + W * s + W**2)


@pytest.mark.parametrize("inner", [False, True])
def test_F3_second_order_with_delay(inner: bool) -> None:
    if inner:
        b = closed_loop_bandwidth(DelaySystem.from_system(SECOND) * DelaySystem.delay(0.002))
    else:
        b = closed_loop_bandwidth(SECOND, delay_s=0.002)
    assert b.minus3db_hz == pytest.approx(38.1605894854, rel=1e-9)
    assert b.minus90deg_hz == pytest.approx(25.4421530721, rel=1e-9)  # the source prints 25.4421, cut off
    assert b.resonance_peak_db == pytest.approx(20 * math.log10(1 / math.sqrt(0.75)), abs=1e-9)
    assert b.resonance_hz == pytest.approx(30 * math.sqrt(0.5), rel=1e-6)


MATHWORKS = {1: 1.2712, 2: 1.9991, 3: 2.5298, 4: 2.9678, 5: 3.3493}


@pytest.mark.parametrize(("system", "level", "rad_s", "within"), [
    (1 / (s + 1), "1/sqrt(2)", 1.0, 1e-12), (1 / (s + 1), "-3 dB", 0.997628345111, 1e-9),  # F5
    (control.tf([0.5], [1, -0.5], 0.001), "1/sqrt(2)", 2 * math.pi * 115.026728081, 1e-9),  # F6
    *((m / (s**2 + s + m), "-3 dB", w, 5e-5 / w) for m, w in MATHWORKS.items()),  # F7
])  # fmt: skip
def test_F5_F6_F7_published(system: control.LTI, level: str, rad_s: float, within: float) -> None:
    for form in (system, control.ss(system)):
        b = closed_loop_bandwidth(form, level=level)
        assert b.minus3db_rad_s == pytest.approx(rad_s, rel=within)
        assert (b.definition, level in str(b)) == (level, True)
        assert (b.minus90deg_rad_s is None) == (b.minus3db_rad_s <= 1.0)  # of one lag alone


def test_a_negative_response_is_measured_from_its_own_phase() -> None:
    a, b = closed_loop_bandwidth(SECOND), closed_loop_bandwidth(-SECOND)
    assert b.dc_gain == pytest.approx(-1.0)
    assert b.minus90deg_rad_s == pytest.approx(a.minus90deg_rad_s, rel=1e-9)


def test_closed_loop_of_an_integrator_with_delay() -> None:
    K, T = 100.0, 0.005
    closed = (DelaySystem.from_system(K / s) * DelaySystem.delay(T)).feedback()
    b = closed_loop_bandwidth(closed)
    omega = np.linspace(1, 400, 400_001)
    L = K / (1j * omega) * np.exp(-1j * omega * T)
    size, phase = np.abs(L / (1 + L)), np.unwrap(np.angle(L / (1 + L)))
    assert b.minus3db_rad_s == pytest.approx(omega[np.argmax(size < math.sqrt(0.5))], rel=1e-5)
    assert b.minus90deg_rad_s == pytest.approx(omega[np.argmax(phase < -np.pi / 2)], rel=1e-5)


@pytest.mark.parametrize(("loop", "delay_s"), [
    (control.tf([25], [1, 10, 10, 10]), 0.0),
    (100 / s, 0.005),
    (SECOND * 5, 0.002),
    (control.tf([0.5], [1, -1], 1e-3), 0.5e-3),  # behind half a sample
    (control.tf([0.3, 0.1], [1, -0.4], 1e-3), 1.3e-3),
    ((0.5 * s + 300) / (s + 200), 0.02),  # with a feed-through
    (SECOND, 0.003),  # |L| is one at rest
])  # fmt: skip
def test_peaks_of_S_and_T(loop: control.TransferFunction, delay_s: float) -> None:
    result = peaks(loop, delay_s=delay_s)
    omega = np.geomspace(0.1, 1000 * np.pi if loop.dt else 2000, 800_001)
    L = loop(np.exp(1j * omega * loop.dt) if loop.dt else 1j * omega) * np.exp(-1j * omega * delay_s)
    S, T = np.abs(1 / (1 + L)), np.abs(L / (1 + L))
    assert result.sensitivity_db == pytest.approx(20 * math.log10(S.max()), abs=1e-6)
    assert result.complementary_db == pytest.approx(20 * math.log10(T.max()), abs=1e-6)
    assert result.sensitivity_rad_s == pytest.approx(omega[S.argmax()], rel=1e-4)
    at_rest = T.max() < T[0] * (1.0 + 1e-9)  # but for rounding |T| only falls
    assert result.complementary_rad_s == pytest.approx(0.0 if at_rest else omega[T.argmax()], rel=1e-4)
    m = stability_margins(loop, delay_s=delay_s)
    assert -20 * math.log10(m.modulus_margin) == pytest.approx(result.sensitivity_db)


@pytest.mark.parametrize("shown", ["not moved", "not seen"])
def test_peaks_beside_a_mode_at_rest_that_the_loop_does_not_show(shown: str) -> None:
    """L = 0.3/(z - 0.5): |S| = 1.5/1.2 at z = -1, |T| = 0.3/0.8 at z = 1, where z - A is singular."""
    A, b, c = np.diag([1.0, 0.5]), [[0.0], [0.3]], [[1.0, 1.0]]
    if shown == "not seen":
        A, b, c = np.array([[1.0, 1e-3], [0.0, 0.5]]), [[1.0], [0.3]], [[0.0, 1.0]]
    result = peaks(control.ss(A, b, c, [[0.0]], 1e-3))
    assert result.sensitivity_db == pytest.approx(20.0 * math.log10(1.5 / 1.2), abs=1e-9)
    assert result.sensitivity_rad_s == pytest.approx(math.pi / 1e-3)
    assert result.complementary_db == pytest.approx(20.0 * math.log10(0.3 / 0.8), abs=1e-9)
    assert result.complementary_rad_s == 0.0


@pytest.mark.parametrize(("loop", "level", "message"), [
    (control.tf([1], [1, 0]), "1/sqrt(2)", "pole at zero"),
    (s / (s + 1), "1/sqrt(2)", "is zero"),
    (SECOND, "3", "level"),
])  # fmt: skip
def test_no_value_to_fall_from_and_no_such_level(loop: control.LTI, level: str, message: str) -> None:
    refused(closed_loop_bandwidth, loop, level=level, match=message)


def test_every_crossing_is_listed_and_the_first_fall_is_meant() -> None:
    """1/(s + 1) plus a light resonance at 10 rad/s: falls, rises and falls again."""
    loop = 100 * (s**2 / 64 + 0.02 * s + 1) / ((s + 1) * (s**2 + 0.02 * s + 100))
    b = closed_loop_bandwidth(loop)
    omega = np.geomspace(1e-2, 1e3, 2_000_001)
    size = np.abs(loop(1j * omega))
    above = size > math.sqrt(0.5)
    passes = omega[np.flatnonzero(above[1:] != above[:-1])]
    assert len(passes) == 3
    assert b.crossings_rad_s == pytest.approx(passes, rel=2e-5)
    assert b.minus3db_rad_s == b.crossings_rad_s[0]
    assert b.resonance_peak_db == pytest.approx(20 * math.log10(size.max()), abs=1e-3)
    assert "the first fall of the gain is meant" in str(b)
    assert "again" not in str(closed_loop_bandwidth(SECOND))


@pytest.mark.parametrize("above_db", [80.0, 160.0])
def test_a_resonance_far_above_the_gain_at_zero_frequency(above_db: float) -> None:
    """k w s/(s^2 + 2 zeta w s + w^2) + e: its top is k/(2 zeta) at w, whatever the small e."""
    zeta, w, e = 0.01, 50.0, 10.0 ** (-above_db / 20.0)
    den = [1.0, 2 * zeta * w, w**2]
    for system in (control.tf(np.polyadd([0.02 * w, 0.0], e * np.array(den)), den),
                   control.tf2ss(np.polyadd([0.02 * w, 0.0], e * np.array(den)), den)):  # fmt: skip
        b = closed_loop_bandwidth(system)
        assert b.resonance_peak_db == pytest.approx(above_db + 20 * math.log10(1.0 + e), abs=1e-5)
        assert b.resonance_rad_s == pytest.approx(w, rel=1e-6)
        assert b.dc_gain == pytest.approx(e, rel=1e-9)
        assert b.minus3db_rad_s is None  # it ends at e, as it starts, and rises in between
        assert b.crossings_rad_s == ()


def test_turns_of_random_systems_against_their_factors() -> None:
    """-90 deg and -3 dB of products of known factors, from the phases and gains of these."""
    rng = np.random.default_rng(4)
    for _ in range(60):
        lags = 10.0 ** rng.uniform(-2, 3, int(rng.integers(2, 8)))
        light, zeta = 10.0 ** rng.uniform(-1, 3), 10.0 ** rng.uniform(-2, 0)
        b = closed_loop_bandwidth(
            control.tf([1.0], np.polymul(np.poly(-lags), [1.0, 2 * zeta * light, light**2]))
        )

        def size(w: Any, lags: np.ndarray = lags, light: float = light, zeta: float = zeta) -> np.ndarray:
            w = np.atleast_1d(w)[:, None]
            pair = np.abs(1.0 - (w / light) ** 2 + 2j * zeta * w / light)[:, 0]
            return 1.0 / (np.sqrt(1.0 + (w / lags) ** 2).prod(axis=1) * pair)

        w = b.minus90deg_rad_s
        assert w is not None
        turned = np.arctan(w / lags).sum() + math.atan2(2 * zeta * light * w, light**2 - w**2)
        assert turned == pytest.approx(0.5 * math.pi, abs=1e-9)
        assert size(b.crossings_rad_s) == pytest.approx(math.sqrt(0.5), rel=1e-8)
        sides = size(np.geomspace(1e-4, 1e5, 3001)) > math.sqrt(0.5)
        assert len(b.crossings_rad_s) >= np.count_nonzero(sides[1:] != sides[:-1])
        assert len(b.crossings_rad_s) % 2 == 1


def test_fast_sampling_does_not_blur_the_bandwidth() -> None:
    """1/(s + 1)^4 under a hold, 1e-4 s: four poles near z = 1, state space."""
    held = control.c2d(control.ss(1 / (s + 1) ** 4), 1e-4)
    b = closed_loop_bandwidth(held)
    assert b.minus3db_rad_s == pytest.approx(math.sqrt(2**0.25 - 1), rel=1e-6)
    assert b.minus90deg_rad_s == pytest.approx(math.tan(math.pi / 8), rel=2e-4)


SAMPLED = control.tf([0.1], [1.0, -0.9], 0.1)


@pytest.mark.parametrize("form", [SAMPLED, control.ss(SAMPLED)], ids=["tf", "ss"])
@pytest.mark.parametrize("delay_s", [0.03, 0.1])
def test_a_sampled_response_behind_a_delay(form: control.LTI, delay_s: float) -> None:
    """0.1/(z - 0.9): gain and phase by hand, at the frequencies that are said."""
    b = closed_loop_bandwidth(form, delay_s=delay_s)
    assert b.minus3db_rad_s is not None
    assert b.minus90deg_rad_s is not None
    assert abs(0.1 / (cmath.exp(0.1j * b.minus3db_rad_s) - 0.9)) == pytest.approx(math.sqrt(0.5), rel=1e-9)
    at = 0.1 / (cmath.exp(0.1j * b.minus90deg_rad_s) - 0.9) * cmath.exp(-1j * b.minus90deg_rad_s * delay_s)
    assert cmath.phase(at) == pytest.approx(-0.5 * math.pi, abs=1e-9)


def test_a_delay_in_series_with_all_of_a_lead_is_a_plain_shift() -> None:
    """(1 - s)/(2 (s + 1)) exp(-s): step 0.5 - exp(1 - t) from 1 s on, phase -2 arctan w - w, gain 0.5."""
    given = control.tf([-0.5, 0.5], [1.0, 1.0])
    late = DelaySystem.delay(0.4) * DelaySystem.from_system(given) * DelaySystem.delay(0.6)
    b = closed_loop_bandwidth(late)
    assert b.minus3db_rad_s is None
    w = b.minus90deg_rad_s
    assert w is not None
    assert w + 2.0 * math.atan(w) == pytest.approx(0.5 * math.pi, rel=1e-9)
    step = step_figures(late)
    assert step.settling_time_s == pytest.approx(1.0 + math.log(100.0), rel=1e-9)
    assert step.rise_time_s == pytest.approx(math.log(9.0), rel=1e-9)
    after = step.time_s > 1.0
    assert step.response[after] == pytest.approx(0.5 - np.exp(1.0 - step.time_s[after]), abs=1e-9)
    assert not step.response[step.time_s < 1.0].any()
    phase = unwrapped_phase_deg(late, [1.0, 3.0])
    assert phase == pytest.approx(np.degrees([-0.5 * math.pi - 1.0, -2.0 * math.atan(3.0) - 3.0]), abs=1e-9)
    with pytest.raises(InputError, match="one delay in series with all of the system"):
        closed_loop_bandwidth((late * 0.5).feedback())


@pytest.mark.parametrize("delay_s", [-1, None, math.nan, math.inf, "1 ms", [1], 1j])
@pytest.mark.parametrize("system", ["tf", "delays", "data"])
def test_a_delay_that_is_none_is_refused_in_one_line(system: str, delay_s: Any) -> None:
    plain = control.tf([1.0], [1.0, 1.0])
    given = {
        "tf": plain,
        "delays": DelaySystem.from_system(plain) * DelaySystem.delay(0.1),
        "data": control.frd(plain, np.geomspace(0.01, 100.0, 50)),
    }[system]
    for asked in (
        partial(closed_loop_bandwidth, given),
        partial(stability_margins, given),
        partial(unwrapped_phase_deg, given, [1.0]),
    ):
        refused(asked, delay_s=delay_s, match=r"^delay_s = .*: must be finite and not negative, in s$")
