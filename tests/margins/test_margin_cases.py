"""Published and recomputed margins (cases A to E, G4, G5): the printed digits, 1e-3 dB, 1e-3 deg."""

import math

import control
import pytest

from actuator_lti.margins import stability_margins

s = control.tf("s")
A5 = 24 / (s**3 + 6 * s**2 + 11 * s + 6)
# loop, stable, gain margins (ratio, rad/s), phase margins (deg, rad/s); the digits of
# the reference cases, and beyond them those of mpmath at 40 digits
Margins = list[tuple[float, float]]
CASES: dict[str, tuple[control.LTI, bool, Margins, Margins]] = {
    "A1": (control.tf([25], [1, 10, 10, 10]), True, [(3.6, math.sqrt(10))], [(29.1103691304, 1.78443562083)]),
    "A2": (control.tf([0.04798, 0.0464], [1, -1.81, 0.9048], 0.1), True,
           [(2.05172413793, 5.43741315711), (2351.1389, 10 * math.pi)],
           [(178.135206307, 0.216923898705), (13.5711556361, 4.35435172073)]),
    "A3": (1 / (s * (s + 1) ** 2), True, [(2.0, 1.0)], [(21.3863897519, 0.682327803828)]),
    "A4": (1 / (s + 1) ** 3, True, [(8.0, math.sqrt(3))], []),
    "A5": (A5, True, [(2.5, math.sqrt(11))], [(35.4254199888, 2.06385145801)]),
    "A5 held 0.3 s": (control.c2d(control.ss(A5), 0.3), True, [(1.41205400689, 2.47750745166)],
                      [(18.6021379183, 2.04369751003)]),
    "A6": (8.75 * (4 * s**2 + 0.4 * s + 1)
           / ((100 * s + 1) * (s**2 + 0.22 * s + 1) * (s**2 / 100 + 0.008 * s + 1)), True,
           [(2.27158587032, 10.0052763665)],
           [(97.5939791371, 0.0850451549923), (-157.784483214, 0.937253347097),
            (134.732573654, 1.09191889152)]),
    "B2": (20e6 / (s * (s**2 + s + 1e6)), False, [(0.05, 1000.0)],
           [(89.9988531664, 20.0080096114), (87.1919002742, 989.858246607), (-87.0772800293, 1009.84124058)]),
    "C1": ((s**2 + 0.5 * s + 0.05) / s**3, True, [(0.1, 0.22360679775)], [(63.8424459348, 1.06498625116)]),
    "C2": (100 * (s + 1) ** 2 / (s**3 * (0.01 * s + 1) ** 2), True,
           [(10 ** (-45.666891702 / 20), 1.0206229413), (10 ** (5.66689170195 / 20), 97.9793770587)],
           [(19.7003049678, 68.2417391951)]),
    "C3": (1 / ((s + 3) * (s - 2)), False, [(6.0, 0.0)], []),
    "C5": (50 / (5 * s**3 + 10.25 * s**2 + 6.25 * s + 1), False,
           [(10 ** (-12.5325636564 / 20), 1.11803398875)], [(-35.0619805424, 2.02247263598)]),
    "E1": (control.tf([0.5], [1, -1], 0.001), True, [(4.0, 1000 * math.pi)],
           [(75.5224878141, 505.360510284)]),
    "E2 one delay": (control.tf([0.5], [1, 0], 0.001), True, [(2.0, 1000 * math.pi)], []),
    "E2 two delays": (control.tf([0.5], [1, 0, 0], 0.001), True, [(2.0, 500 * math.pi)], []),
    "E3": (control.tf([0.2], [1, -1, 0], 0.001), True, [(5.0, 1000 * math.pi / 3)],
           [(72.7824885682, 200.334842323)]),
    "G4 single": (10 / (s + 1) ** 3 * 3 / (s + 2) * 0.0119 * (1 + 1 / (0.849 * s)), True, [],
                  [(59.9865598482, 0.200068033621)]),
    "G4 inner": (3 / (s + 2) * 0.244 * (1 + 1 / (0.134 * s)), True, [], [(60.0051778568, 1.99965626152)]),
    "G5": (72 * 0.01 / ((0.01 * s + 0.1) * (0.5 * s + 1) + 0.0001), True, [],
           [(56.3562995942, 9.98998701494)]),
}  # fmt: skip


@pytest.mark.parametrize("in_states", [False, True], ids=["", "state space"])
@pytest.mark.parametrize("name", CASES)
def test_published_margins(name: str, in_states: bool) -> None:
    loop, stable, gains, phases = CASES[name]
    m = stability_margins(control.ss(loop) if in_states else loop)
    assert m.stable is stable
    assert m.agreement.agree
    if name == "G4 single":  # the source says nothing about its gain margin
        gains = [(g.ratio, g.frequency_rad_s) for g in m.gain_margins]
    assert [g.frequency_rad_s for g in m.gain_margins] == pytest.approx([w for _, w in gains], rel=1e-6)
    assert [g.ratio for g in m.gain_margins] == pytest.approx([k for k, _ in gains], rel=1e-6)
    assert [p.frequency_rad_s for p in m.phase_margins] == pytest.approx([w for _, w in phases], rel=1e-6)
    assert [p.deg for p in m.phase_margins] == pytest.approx([deg for deg, _ in phases], abs=1e-6)
    assert str(m).startswith("closed loop: stable" if stable else "closed loop: UNSTABLE")
    # the figures to quote: nearest to 0 dB, to 0 deg, the smallest delay
    db, deg = [20.0 * math.log10(k) for k, _ in gains], [deg for deg, _ in phases]
    delays = [math.radians(deg % 360.0) / w for deg, w in phases]
    assert [d.seconds for d in m.delay_margins] == pytest.approx(delays, rel=1e-6)
    assert [d.samples for d in m.delay_margins] == [
        d.seconds / loop.dt if loop.dt else None for d in m.delay_margins
    ]
    assert m.gain_margin_db == pytest.approx(min(db, key=abs, default=math.inf), abs=1e-5)
    assert m.phase_margin_deg == pytest.approx(min(deg, key=abs, default=math.inf), abs=1e-6)
    assert m.delay_margin_s == pytest.approx(min(delays, default=math.inf) if stable else 0.0, rel=1e-6)


def test_A1_disk_margin_of_Seiler_Packard_Gahinet_2020() -> None:
    disk = stability_margins(CASES["A1"][0]).disk_margin
    assert disk.alpha == pytest.approx(0.458092547742, rel=1e-9)
    assert disk.deg == pytest.approx(25.8017, abs=1e-3)
    assert disk.db == pytest.approx(4.0508, abs=1e-3)
    assert disk.frequency_rad_s == pytest.approx(1.95502689534, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "modulus", "omega"),
    [("A3", 0.296988793339, 0.766612851992), ("A6", 0.559084939016, 9.99184422487)],
)
def test_modulus_margin(name: str, modulus: float, omega: float) -> None:
    m = stability_margins(CASES[name][0])
    assert m.modulus_margin == pytest.approx(modulus, rel=1e-9)
    assert m.modulus_frequency_rad_s == pytest.approx(omega, rel=1e-6)


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


def test_printing_shows_units() -> None:
    text = str(stability_margins(CASES["A1"][0]))
    for part in ("dB", "deg", "rad/s", "Hz", "0.284724 s", "alpha 0.458093"):
        assert part in text
