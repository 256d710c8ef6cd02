"""The slowest mode of a drive against modes of matrices written by hand, in 60 digits; what rests is none."""

from typing import Any

import pytest
from loop_designs import changed, source_drive
from mpmath import eig, exp, mp, mpf

from actuator_lti.design import model
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.sampled import tick_system
from analyses.failures import Asked
from analyses.failures.run import _settling_s
from analyses.motion.settling import settling_ticks_of

J, G, T, KP = 2.0, 3.0, 1e-3, 40.0


def drive(Cv: float, Tn: float | None = None, Kv: float = 0.0, spring: float = 0.0, every: int = 1) -> Any:
    """A source on an inertia: a speed drive of gain `KP`, held in position where Kv is, on a spring."""
    bare = source_drive(J, G, T, 100.0, friction=model.Friction(viscous_Nms_rad=Cv))
    place = model.PositionLoop(gain=Kv, every=every) if Kv else None
    velocity = model.VelocityLoop(gain=KP, integral_time_s=Tn)
    load = model.Load(path="back-drivable", moment_slope_Nm_rad=-spring)
    return changed(bare, load=load, controller={"velocity": velocity, "position": place})


def plant(Cv: float) -> tuple[Any, Any, Any, Any]:
    """w+ = a w + b tau, th+ = th + c w + d tau, tau held."""
    if Cv == 0.0:
        return mpf(1), mpf(T) / J, mpf(T), mpf(T) ** 2 / (2 * J)
    a = exp(-mpf(Cv) * T / J)
    c = (1 - a) * J / Cv
    return a, (1 - a) / Cv, c, (T - c) / Cv


def slowest(Cv: float, Tn: float | None = None, Kv: float = 0.0, spring: float = 0.0, every: int = 1) -> Any:
    """Largest mode of (w, th, I, held command) that is none of 1 itself, per tick."""
    a, b, c, d = plant(Cv)
    q = mpf(0) if Tn is None else mpf(KP) * T / mpf(Tn)
    over = mp.eye(4)
    for k in range(every):
        r = mp.matrix([[0, -mpf(Kv), 0, 0]] if k == 0 else [[0, 0, 0, 1]])
        e = r - mp.matrix([[1, 0, 0, 0]])
        kept = mp.matrix([[0, 0, 1, 0]]) + q * e
        tau = G * (KP * e + kept) - mpf(spring) * mp.matrix([[0, 1, 0, 0]])
        w = mp.matrix([[a, 0, 0, 0]]) + b * tau
        th = mp.matrix([[c, 1, 0, 0]]) + d * tau
        rows = [w, th, kept if Tn else mp.matrix([[0, 0, 0, 0]]), r]
        over = mp.matrix([[row[j] for j in range(4)] for row in rows]) * over
    sizes = [abs(mode) for mode in eig(over, right=False) if abs(mode - 1) > mpf(10) ** -40]
    return max(sizes) ** (mpf(1) / every)


@pytest.mark.parametrize("asked", [
    {"Cv": 5.0}, {"Cv": 0.0}, {"Cv": 5.0, "Tn": 0.2}, {"Cv": 0.0, "Tn": 30.0}, {"Cv": 5.0, "Tn": 1e5},
    {"Cv": 5.0, "Kv": 8.0}, {"Cv": 0.0, "Kv": 8.0, "Tn": 0.2, "every": 5}, {"Cv": 5.0, "Kv": 1e-4},
    {"Cv": 5.0, "Tn": 0.2, "spring": 50.0}, {"Cv": 5.0, "spring": 50.0}, {"Cv": 0.0, "Tn": 9e3, "every": 3},
])  # fmt: skip
def test_the_slowest_mode_that_moves(asked: dict[str, Any]) -> None:
    """An angle that nothing holds, what a spring and an integral hold, are left out; slow ones are not."""
    with mp.workdps(60):
        expected = slowest(**asked)
        found = tick_system(wire(drive(**asked))).slowest
        assert 1.0 - found == pytest.approx(float(1 - expected), rel=1e-6)


@pytest.mark.parametrize(("Cv", "slowest"), [(5.0, float(exp(-5.0 * T / J))), (0.0, 0.0)])
def test_a_drive_that_nothing_controls(Cv: float, slowest: float) -> None:
    """The speed falls by exp(-Cv T/J); without friction speed and angle rest as they are."""
    left_out = changed(drive(Cv), controller={"velocity": None})
    assert tick_system(wire(left_out)).slowest == pytest.approx(slowest, rel=1e-14)


def test_what_a_spring_swings_for_ever_is_not_waited_for() -> None:
    """Nothing damps motor and load on their spring: |z| = 1 but for rounding."""
    base = changed(drive(0.0), controller={"velocity": None})
    spring = model.Coupling(stiffness_Nm_rad=1e4, damping_Nms_rad=0.0)
    assert tick_system(wire(changed(base, coupling=spring, load={"inertia_kgm2": 0.5}))).slowest == 0.0


@pytest.mark.parametrize("Tn", [0.2, 30.0])
def test_a_failure_of_a_speed_drive_waits_until_its_speed_has_settled(Tn: float) -> None:
    """To a thousandth: the angle that it gains meanwhile has nothing to settle."""
    design = drive(5.0, Tn)
    with mp.workdps(60):
        ticks = float(mp.log(mpf("1e-3")) / mp.log(slowest(5.0, Tn)))
    assert settling_ticks_of(design, 1e-3) == pytest.approx(ticks, rel=1e-6)
    asked = Asked.of(design, speed_rad_s=1.0)
    travel = 1.0 / (G * 100.0 / J)
    assert _settling_s(design, asked) == pytest.approx(0.1 + travel + ticks * T, rel=0.01)
