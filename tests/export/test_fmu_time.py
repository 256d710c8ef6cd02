"""The unit at any step of its host: inputs from the tick on that follows, outputs at the communication point.

The truth between ticks is the same plant run without its controller on ticks ten times as fine, under the
voltages that the plain run has recorded.
"""

from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_host import hosted, needs_compiler, written
from random_drives import random_drive, random_elastic_drive
from scipy.optimize import brentq

from actuator_lti.design import load_design, with_values
from actuator_lti.design.model import Command, Controller, Design, Instruments, Limits
from nonlinear import Rows
from tests.changed import changed

pytestmark = needs_compiler
FINE = 10  # parts of a tick, of which every host step below is a multiple
NAMES = ("output.angle", "motor.angle", "motor.speed", "motor.current")
SHIPPED = ("emps", "ilr33-amber", "ilr33-amber-multirate", "fin", "joint", "ballscrew")
ALL_STEPS = ("ilr33-amber", "delayed", "tanh", "play", "random2")
TICKS, MOMENT = 120, 0.05


def delayed(design: Design, ticks: float) -> Design:
    return changed(design, controller={"computing_delay_s": ticks * design.controller.period_s})


def even(design: Design) -> Design:
    """Without torques over the angle: those are looked up once a tick, so a finer tick has others."""
    none = dict.fromkeys(("moment_slope_Nm_rad", "moment_damping_Nms_rad", "gear_error_Nm"), 0.0)
    return changed(design, load={"gravity": None, **none}, motor={"cogging_Nm": 0.0})


def random_one(seed: int, elastic: bool) -> Design:
    rng = np.random.default_rng(seed)
    design = even((random_elastic_drive if elastic else random_drive)(rng))
    return delayed(design, float(rng.integers(0, 25)) / FINE)


def drives() -> dict[str, Design]:
    """Every kind of plant, delayed by whole ticks, parts and both."""
    shipped = {name: even(load_design(name)) for name in SHIPPED}
    return {
        **shipped,
        "delayed": delayed(shipped["ilr33-amber"], 0.3),
        "tanh": delayed(load_design("ilr33-amber-tanh"), 1.7),
        "play": delayed(with_values(shipped["joint"], {"coupling.play": 2e-3}), 0.6),
        **{f"random{seed}": random_one(seed, elastic=False) for seed in (1, 2, 3)},
        **{f"elastic{seed}": random_one(seed, elastic=True) for seed in (4, 5, 6)},
    }


def run(design: Design, ticks: int, command: np.ndarray, **columns: float) -> Any:
    rows = Rows.of(design)
    rows["ticks"], rows["load"] = ticks, MOMENT
    for name, value in columns.items():
        rows[name] = value
    rows.series("command", command)
    return rows.trajectory()


def propagated(design: Design, voltage: np.ndarray) -> np.ndarray:
    """The plant alone from rest under u_k, which acts from t_k + d on, FINE times a tick."""
    c = design.controller
    late = round(c.computing_delay_s / c.period_s * FINE)
    held = np.concatenate([np.zeros(late), np.repeat(voltage, FINE)])[: voltage.size * FINE]
    free = {"limits": Limits(voltage_V=inf), "supply": None, "command": Command()}
    control = Controller(period_s=c.period_s / FINE, computing_delay_s=0.0)
    bare = replace(design, controller=control, instruments=Instruments(), **free)
    fine = run(bare, held.size, held, tanh_tolerance=1e-13)
    return np.transpose([fine.output_angle_rad, fine.motor_angle_rad, fine.motor_speed_rad_s, fine.current_A])


def wanted(t: float | np.ndarray, design: Design) -> Any:
    """A command that moves every drive and its friction."""
    size = {"position": 0.1, "velocity": 1.0, "current": 1.0, "voltage": 1.0}[design.controller.outermost]
    return 0.1 * size * np.sin(2.0 * np.pi * t / (60.0 * design.controller.period_s))


@pytest.mark.parametrize("name", drives())
def test_every_host_step_sees_the_same_motion(name: str, tmp_path) -> None:
    design = drives()[name]
    period, path = design.controller.period_s, written(tmp_path, design)
    for part in (1, 5, 10, 15, 27) if name in ALL_STEPS else (1, 27):
        step = part / FINE * period
        points = np.floor((np.arange(TICKS) * period) / step + 1e-6)  # at or before each tick
        plain = run(design, TICKS, np.asarray(wanted(points * step, design)))
        truth = propagated(design, plain.voltage_V)
        with hosted(path) as (host,):
            host.start(hinge_moment=MOMENT)
            rows = []
            for n in range(int((TICKS - 1) * period / step)):
                host.set(command=float(wanted(n * step, design)))
                host.step(n * step, step)
                rows.append(host.get(*NAMES))
        found, at = np.array(rows), part * np.arange(1, len(rows) + 1)
        scale = np.abs(truth).max(axis=0) + 1e-12
        assert np.abs((found - truth[at]) / scale).max() < 1e-9, part
        whole = at % FINE == 0  # at the ticks the bits of the plain run
        assert np.array_equal(found[whole, 0], plain.output_angle_rad[at[whole] // FINE])
        assert np.array_equal(found[whole, 2], plain.motor_speed_rad_s[at[whole] // FINE])


def test_a_command_between_ticks_is_seen_at_the_next(tmp_path) -> None:
    """At 0.9 Ts it is that of a run whose command steps at Ts; voltages are of the tick they are in."""
    design = load_design("ilr33-amber")
    period, path = design.controller.period_s, written(tmp_path, design, 3)
    command = np.full(40, 0.05)
    command[0] = 0.0
    plain = run(design, 40, command)
    with hosted(path) as (host,):
        host.start(hinge_moment=MOMENT)
        for n in range(390):
            if n == 9:
                host.set(command=0.05)
            host.step(n * 0.1 * period, 0.1 * period)
            angle, voltage = host.get("output.angle", "motor.voltage")
            at, part = divmod(n + 1, 10)
            if part == 0:
                assert angle == plain.output_angle_rad[at]
            assert voltage == plain.voltage_V[at if part else at - 1]


# --- the unit inside somebody else's loop ---
def critical_gain(parts: int) -> float:
    """Gain of an outer integrator at which emps without friction oscillates, in host steps of parts/FINE Ts.

    The position loop P-P on the force source with its two-sample difference, held over a tick; the host's
    integrator z' = r - y by the trapezoidal rule from communication point to communication point, K z the
    command.  Lifted over the common period of both: all states at its beginning, exact in between.
    """
    design = load_design("emps")
    Ts = design.controller.period_s

    def spread(K: float) -> float:
        map_ = lifted(design, K, Ts, parts, int(np.lcm(parts, FINE)))
        return float(np.abs(np.linalg.eigvals(map_)).max()) - 1.0

    return float(brentq(spread, 20.0, 200.0, xtol=1e-9))


def lifted(design: Design, K: float, Ts: float, parts: int, common: int) -> np.ndarray:
    """The map over the common period: y, v, u held, z, last y, command, angles of the difference."""
    c = design.controller
    J, b = design.motor.rotor_inertia_kgm2, design.friction.viscous_Nms_rad
    gain = design.motor.source_gain_Nm_V
    h, m = Ts / FINE, design.encoder.difference_samples
    y, v, u, z, seen, r = range(6)
    angles, n = list(range(6, 6 + m)), 6 + m
    plant, e = np.eye(n), np.exp(-b / J * h)
    plant[y, v], plant[v, v] = (1.0 - e) * J / b, e
    plant[v, u] = (1.0 - e) * gain / b
    plant[y, u] = (h - (1.0 - e) * J / b) * gain / b
    point = np.eye(n)  # y of the last point and of this one, then the command from z
    point[z, y] = point[z, seen] = -0.5 * parts * h
    point[seen] = np.eye(n)[y]
    point[r] = K * point[z]
    tick = np.eye(n)
    tick[u] = 0.0
    tick[u, r] = c.velocity.gain * c.position.gain
    tick[u, y] = -c.velocity.gain * (c.position.gain + 1.0 / (m * Ts))
    tick[u, angles[0]] = c.velocity.gain / (m * Ts)
    for j in range(m):  # oldest first
        tick[angles[j]] = np.eye(n)[y if j == m - 1 else angles[j + 1]]
    total = np.eye(n)
    for k in range(common):
        if k % parts == 0:
            total = point @ total
        if k % FINE == 0:
            total = tick @ total
        total = plant @ total
    return total


@pytest.mark.parametrize("parts", [1, 5, 10, 15, 27])
def test_an_outer_loop_has_its_critical_gain_at_every_step(parts: int, unfriction: Path) -> None:
    """0.1 % below the gain of the lifted loop the oscillation dies away, 0.1 % above it grows."""
    period, known = load_design("emps").controller.period_s, critical_gain(parts)
    if parts == FINE:
        assert known == pytest.approx(91.58, rel=1e-4)
    growth = [oscillation(unfriction, parts / FINE * period, known * factor) for factor in (0.999, 1.001)]
    assert growth[0] < 1.0 < growth[1]


@pytest.fixture(scope="module")
def unfriction(tmp_path_factory) -> Path:
    return written(tmp_path_factory.mktemp("emps"), load_design("emps"), 3)


def oscillation(path: Path, step: float, gain: float) -> float:
    """Largest size of the last fifth of a run over that of the one before the last."""
    z, before, sizes = 1e-6, 0.0, []
    with hosted(path) as (host,):
        host.start(**{"friction.dry_torque": 0.0, "friction.offset_torque": 0.0})
        for n in range(int(5.0 / step)):
            host.set(command=gain * z)
            host.step(n * step, step)
            (now,) = host.get("output.angle")
            z -= 0.5 * step * (before + now)
            before = now
            sizes.append(abs(now))
    fifth = len(sizes) // 5
    return max(sizes[-fifth:]) / max(sizes[-2 * fifth : -fifth])
