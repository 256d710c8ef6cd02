"""The unit at any step of its host: inputs from the next tick on, outputs at the communication point."""

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pytest
from fmu_host import hosted, needs_compiler, written

from actuator_lti.design import load_design, with_values
from actuator_lti.design.model import Command, Controller, Design, Instruments, Limits
from nonlinear import Rows
from tests.changed import changed
from tests.validation.rich_drives import rich_drive

pytestmark = needs_compiler
FINE = 10  # parts of a tick, of which every host step below is a multiple
NAMES = ("output.angle", "motor.angle", "motor.speed", "motor.current")
SHIPPED = ("emps", "ilr33-amber", "ilr33-amber-multirate", "fin", "joint", "ballscrew")
ALL_STEPS = ("ilr33-amber", "delayed", "tanh", "play", "random2")
TICKS, MOMENT = 120, 0.05
COULOMB = (0, 2, 3, 7, 8, 9)  # seeds; of a smoothed law a tick has a tolerance of its own


def delayed(design: Design, ticks: float) -> Design:
    return changed(design, controller={"computing_delay_s": ticks * design.controller.period_s})


def even(design: Design) -> Design:
    """Without torques over the angle: those are looked up once a tick, so a finer tick has others."""
    none = dict.fromkeys(("moment_slope_Nm_rad", "moment_damping_Nms_rad", "gear_error_Nm"), 0.0)
    return changed(design, load={"gravity": None, **none}, motor={"cogging_Nm": 0.0})


def drives() -> dict[str, Design]:
    """Every kind of plant, delayed by whole ticks, parts and both."""
    shipped = {name: even(load_design(name)) for name in SHIPPED}
    return {
        **shipped,
        "delayed": delayed(shipped["ilr33-amber"], 0.3),
        "tanh": delayed(load_design("ilr33-amber-tanh"), 1.7),
        "play": delayed(with_values(shipped["joint"], {"coupling.play": 2e-3}), 0.6),
        **{f"random{seed}": delayed(even(rich_drive(seed)), 0.3 * seed) for seed in COULOMB},
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
