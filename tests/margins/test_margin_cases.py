"""Published and recomputed margins (cases A to E, G4, G5): the printed digits, 1e-3 dB, 1e-3 deg."""

import math

import control
import numpy as np
import pytest

from actuator_lti.margins import StabilityMargins, stability_margins

s = control.tf("s")
A5 = 24 / (s**3 + 6 * s**2 + 11 * s + 6)
LOOPS = {
    "A1": control.tf([25], [1, 10, 10, 10]),
    "A2": control.tf([0.04798, 0.0464], [1, -1.81, 0.9048], 0.1),
    "A3": 1 / (s * (s + 1) ** 2),
    "A4": 1 / (s + 1) ** 3,
    "A5": A5,
    "A5 held 0.3 s": control.c2d(control.ss(A5), 0.3),
    "A6": 8.75 * (4 * s**2 + 0.4 * s + 1)
    / ((100 * s + 1) * (s**2 + 0.22 * s + 1) * (s**2 / 100 + 0.008 * s + 1)),
    "B2": 20e6 / (s * (s**2 + s + 1e6)),
    "C1": (s**2 + 0.5 * s + 0.05) / s**3,
    "C2": 100 * (s + 1) ** 2 / (s**3 * (0.01 * s + 1) ** 2),
    "C3": 1 / ((s + 3) * (s - 2)),
    "C5": 50 / (5 * s**3 + 10.25 * s**2 + 6.25 * s + 1),
    "E1": control.tf([0.5], [1, -1], 0.001),
    "E2 one delay": control.tf([0.5], [1, 0], 0.001),
    "E2 two delays": control.tf([0.5], [1, 0, 0], 0.001),
    "E3": control.tf([0.2], [1, -1, 0], 0.001),
    "G4 single": 10 / (s + 1) ** 3 * 3 / (s + 2) * 0.0119 * (1 + 1 / (0.849 * s)),
    "G4 inner": 3 / (s + 2) * 0.244 * (1 + 1 / (0.134 * s)),
    "G5": 72 * 0.01 / ((0.01 * s + 0.1) * (0.5 * s + 1) + 0.0001),
}  # fmt: skip
# name: stable, gain margins (ratio, rad/s), phase margins (deg, rad/s); the digits of
# the reference cases, and beyond them those of mpmath at 40 digits
EXPECTED: dict[str, tuple[bool, list[tuple[float, float]], list[tuple[float, float]]]] = {
    "A1": (True, [(3.6, math.sqrt(10))], [(29.1103691304, 1.78443562083)]),
    "A2": (True, [(2.05172413793, 5.43741315711), (2351.1389, 10 * math.pi)],
           [(178.135206307, 0.216923898705), (13.5711556361, 4.35435172073)]),
    "A3": (True, [(2.0, 1.0)], [(21.3863897519, 0.682327803828)]),
    "A4": (True, [(8.0, math.sqrt(3))], []),
    "A5": (True, [(2.5, math.sqrt(11))], [(35.4254199888, 2.06385145801)]),
    "A5 held 0.3 s": (True, [(1.41205400689, 2.47750745166)], [(18.6021379183, 2.04369751003)]),
    "A6": (True, [(2.27158587032, 10.0052763665)],
           [(97.5939791371, 0.0850451549923), (-157.784483214, 0.937253347097),
            (134.732573654, 1.09191889152)]),
    "B2": (False, [(0.05, 1000.0)],
           [(89.9988531664, 20.0080096114), (87.1919002742, 989.858246607), (-87.0772800293, 1009.84124058)]),
    "C1": (True, [(0.1, 0.22360679775)], [(63.8424459348, 1.06498625116)]),
    "C2": (True, [(10 ** (-45.666891702 / 20), 1.0206229413), (10 ** (5.66689170195 / 20), 97.9793770587)],
           [(19.7003049678, 68.2417391951)]),
    "C3": (False, [(6.0, 0.0)], []),
    "C5": (False, [(10 ** (-12.5325636564 / 20), 1.11803398875)], [(-35.0619805424, 2.02247263598)]),
    "E1": (True, [(4.0, 1000 * math.pi)], [(75.5224878141, 505.360510284)]),
    "E2 one delay": (True, [(2.0, 1000 * math.pi)], []),
    "E2 two delays": (True, [(2.0, 500 * math.pi)], []),
    "E3": (True, [(5.0, 1000 * math.pi / 3)], [(72.7824885682, 200.334842323)]),
    "G4 single": (True, [], [(59.9865598482, 0.200068033621)]),
    "G4 inner": (True, [], [(60.0051778568, 1.99965626152)]),
    "G5": (True, [], [(56.3562995942, 9.98998701494)]),
}  # fmt: skip


def forms(name: str) -> list[tuple[str, object]]:
    loop = LOOPS[name]
    return [(name, loop), (name + ", state space", control.ss(loop))]


@pytest.mark.parametrize(("name", "loop"), [pair for name in EXPECTED for pair in forms(name)])
def test_published_margins(name: str, loop: control.LTI) -> None:
    stable, gains, phases = EXPECTED[name.removesuffix(", state space")]
    m = stability_margins(loop)
    assert m.stable is stable
    assert m.agreement.agree
    if name.startswith("G4 single"):  # the source says nothing about its gain margin
        gains = [(g.ratio, g.frequency_rad_s) for g in m.gain_margins]
    assert [g.frequency_rad_s for g in m.gain_margins] == pytest.approx([w for _, w in gains], rel=1e-6)
    assert [g.ratio for g in m.gain_margins] == pytest.approx([k for k, _ in gains], rel=1e-6)
    assert [p.frequency_rad_s for p in m.phase_margins] == pytest.approx([w for _, w in phases], rel=1e-6)
    assert [p.deg for p in m.phase_margins] == pytest.approx([deg for deg, _ in phases], abs=1e-6)


@pytest.mark.parametrize(
    ("name", "db", "deg", "delay_s"),
    [
        ("A1", 11.1261, 29.1104, 0.2847),
        ("A3", 6.0206, 21.3864, None),
        ("A6", 7.1266, 97.5940, None),
        ("C1", -20.0, 63.8424, None),
        ("C2", 5.667, 19.7003, 5.0385e-3),
        ("E1", 12.041, 75.5225, 2.60827e-3),
        ("E3", 13.9794, 72.7825, 6.34085e-3),
    ],
)
def test_figure_to_quote(name: str, db: float, deg: float, delay_s: float | None) -> None:
    m = stability_margins(LOOPS[name])
    assert m.gain_margin_db == pytest.approx(db, abs=1e-3)
    assert m.phase_margin_deg == pytest.approx(deg, abs=1e-3)
    if delay_s is not None:
        assert m.delay_margin_s == pytest.approx(delay_s, rel=1e-4)


def test_A1_disk_margin_of_Seiler_Packard_Gahinet_2020() -> None:
    disk = stability_margins(LOOPS["A1"]).disk_margin
    assert disk.alpha == pytest.approx(0.458092547742, rel=1e-9)
    assert disk.deg == pytest.approx(25.8017, abs=1e-3)
    assert disk.db == pytest.approx(4.0508, abs=1e-3)
    assert disk.frequency_rad_s == pytest.approx(1.95502689534, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "modulus", "omega"),
    [("A3", 0.296988793339, 0.766612851992), ("A6", 0.559084939016, 9.99184422487)],
)
def test_modulus_margin(name: str, modulus: float, omega: float) -> None:
    m = stability_margins(LOOPS[name])
    assert m.modulus_margin == pytest.approx(modulus, rel=1e-9)
    assert m.modulus_frequency_rad_s == pytest.approx(omega, rel=1e-6)


def test_A4_touching_one_at_zero_frequency_is_no_crossover() -> None:
    m = stability_margins(LOOPS["A4"])
    assert m.phase_margins == ()
    assert m.phase_margin_deg == math.inf
    assert m.delay_margin_s == math.inf


def test_delay_margins_in_samples() -> None:
    m = stability_margins(LOOPS["E3"])
    assert m.delay_margin.samples == pytest.approx(6.34085, abs=1e-5)
    assert stability_margins(LOOPS["A1"]).delay_margins[0].samples is None


@pytest.mark.parametrize("name", ["B2", "C3", "C5"])
def test_unstable_is_said_first(name: str) -> None:
    m = stability_margins(LOOPS[name])
    assert str(m).splitlines()[0].startswith("closed loop: UNSTABLE")
    assert m.delay_margin_s == 0.0


def test_D1_delay_margins_and_the_list_of_a_band() -> None:
    m = stability_margins(control.tf([100], [1, 0]), delay_s=0.005, band_rad_s=(0.0, 3000.0))
    first = 0.5 * math.pi / 0.005
    assert m.stable
    assert [g.frequency_rad_s for g in m.gain_margins] == pytest.approx(
        [first, 5 * first, 9 * first], rel=1e-9
    )
    assert m.gain_margin_db == pytest.approx(20 * math.log10(math.pi), abs=1e-9)
    assert m.phase_margin_deg == pytest.approx(61.3521102435, abs=1e-9)
    assert m.delay_margin_s == pytest.approx(10.7079632679e-3, rel=1e-9)
    assert m.band_rad_s == (0.0, 3000.0)


@pytest.mark.parametrize(("KT", "stable"), [(1.5, True), (1.57, True), (1.5716, False), (1.6, False)])
def test_D2_integrator_with_delay_is_stable_up_to_half_pi(KT: float, stable: bool) -> None:
    m = stability_margins(control.tf([KT / 0.02], [1, 0]), delay_s=0.02)
    assert m.stable is stable
    assert m.agreement.unstable_poles == m.agreement.unstable_nyquist == (0 if stable else 2)


def test_order_25_does_not_fail_where_a_polynomial_would() -> None:
    rng = np.random.default_rng(25)
    loop = control.ss([], [], [], [[1.0]])
    for k in range(12):
        w, zeta = 10.0 ** rng.uniform(0, 5), 10.0 ** rng.uniform(-2.5, -0.5)
        pair = control.ss([[0.0, w], [-w, -2 * zeta * w]], [[0.0], [w]], [[1.0, 0.2 * (-1) ** k]], [[0.5]])
        loop = control.series(loop, pair)
    loop = control.series(loop, control.ss([[0.0]], [[50.0]], [[1.0]], [[0.0]]))
    assert loop.nstates == 25
    m = stability_margins(loop)
    assert m.agreement.agree
    omega = np.geomspace(1e-2, 1e7, 400_001)
    L = response(loop, omega)
    crossed = np.flatnonzero(np.diff(np.abs(L) > 1.0))
    assert len(m.phase_margins) == crossed.size
    for margin, k in zip(m.phase_margins, crossed, strict=True):
        assert omega[k] <= margin.frequency_rad_s <= omega[k + 1]
    assert m.modulus_margin <= np.abs(1 + L).min() * (1 + 1e-9)
    assert m.modulus_margin == pytest.approx(float(np.abs(1 + L).min()), rel=1e-3)


def response(loop: control.StateSpace, omega: np.ndarray) -> np.ndarray:
    values, V = np.linalg.eig(loop.A)
    left = np.linalg.solve(V, loop.B[:, 0])
    return loop.D[0, 0] + ((loop.C[0] @ V) * left / (1j * omega[:, None] - values)).sum(axis=1)


def test_printing_shows_units() -> None:
    text = str(stability_margins(LOOPS["A1"]))
    for part in ("dB", "deg", "rad/s", "Hz", "0.284724 s", "alpha 0.458093"):
        assert part in text


def test_result_is_frozen() -> None:
    m: StabilityMargins = stability_margins(LOOPS["A1"])
    with pytest.raises(AttributeError):
        m.stable = False
