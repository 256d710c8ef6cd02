"""Two controllers made outside and brought in as a law of one's own, each with a truth of its own."""

from dataclasses import replace

import numpy as np
from loop_designs import controlled
from own_laws import linear, period_s
from scipy.linalg import solve_discrete_are
from scipy.signal import place_poles

from actuator_lti import Design, assemble_loops, load_design, plant, stability_margins
from actuator_lti.design.model import Encoder, PositionLoop
from nonlinear import Rows


def poles(design: Design) -> np.ndarray:
    """Of the whole closed drive over its period (one tick here)."""
    system = assemble_loops(design).tick_system
    assert system.ticks == 1
    return np.linalg.eigvals(system.matrices(0)[0])


def same_poles(found: np.ndarray, wanted: np.ndarray, within: float) -> None:
    """Every wanted pole is there, each once."""
    left = list(found)
    for pole in wanted:
        nearest = min(left, key=lambda one: abs(one - pole))
        assert abs(nearest - pole) < within, (pole, nearest)
        left.remove(nearest)


def test_lqg_velocity_controller() -> None:
    """Separation: the closed drive has the poles of the regulator and of the observer, by scipy's Riccati."""
    base = replace(linear(load_design("ilr33-amber")), requirements=(), encoder=Encoder())
    base = controlled(base, position=None)
    system, T = plant(base, command="i_ref"), period_s(base, "velocity")
    seen = [k for k, name in enumerate(system.state_labels) if name != "th"]
    A, B = system.A[np.ix_(seen, seen)], system.B[seen, :1]
    C, n = system.C[system.output_labels.index("speed")][None, seen], len(A)
    S = solve_discrete_are(A, B, 1e-3 * C.T @ C + 1e-12 * np.eye(n), [[1.0]])
    K = np.linalg.solve(1.0 + B.T @ S @ B, B.T @ S @ A)
    P = solve_discrete_are(A.T, C.T, 1e2 * B @ B.T + 1e-9 * np.eye(n), [[1.0]])
    G, closed = np.linalg.solve(1.0 + C @ P @ C.T, C @ P @ A.T).T, A - B @ K
    pre = 1.0 / (C @ np.linalg.solve(np.eye(n) - closed, B)).item()
    law = (closed - G @ C, np.hstack([G, pre * B]), -K, [[0.0, pre]], T)
    mine = base.with_law("velocity", law, ["speed", "command"], L=B)
    same_poles(poles(mine), np.concatenate([np.linalg.eigvals(closed), np.linalg.eigvals(A - G @ C)]), 1e-7)
    assert stability_margins(assemble_loops(mine).velocity.open_loop).stable
    # the observer knows what the limit left of its output: a step far into the current limit does not wind up
    limited = replace(mine, limits=replace(load_design("ilr33-amber").limits, speed_rad_s=np.inf))
    rows = Rows.of(limited)
    rows["ticks"] = 2500
    rows.step("command", 600.0 / base.total_ratio)
    run = rows.trajectory()
    assert run.limits["current"].fraction > 0.01
    assert abs(run.motor_speed_rad_s[-1] / 600.0 - 1.0) < 1e-6
    assert run.motor_speed_rad_s.max() < 1.05 * 600.0


def test_state_feedback_from_motor_and_load_of_a_joint() -> None:
    """All poles where they were placed: current, motor, coupling and load measured, the delay remembered."""
    base = replace(linear(load_design("joint")), requirements=(), encoder=Encoder())
    base = controlled(base, current=None, velocity=None, position=PositionLoop(gain=1.0),
                      computing_delay_s=base.controller.period_s)  # fmt: skip
    system, T = plant(base, command="u"), base.controller.period_s
    names = list(system.state_labels)
    assert names == ["i", "w", "th", "W", "twist", "u1"]
    A, B = system.A, system.B[:, :1]
    wanted = np.exp(
        T * np.array([-4000.0, -900.0, -60.0 + 60.0j, -60.0 - 60.0j, -250.0 + 150.0j, -250.0 - 150.0j])
    )
    K = place_poles(A, B, wanted).gain_matrix[0]
    N_c, N_r = base.ratio_to_coupling, base.ratio_behind_coupling
    gains = dict(zip(names, K, strict=True))
    inputs = ["current", "speed", "angle", "output_speed", "output_angle", "command"]
    D = -np.array([gains["i"], gains["w"], gains["th"] + gains["twist"] / N_c, gains["W"] * N_r,
                   -gains["twist"] * N_r, 0.0])  # fmt: skip
    D[5] = gains["th"]  # the command is the motor's angle at rest
    law = ([[-gains["u1"]]], [D], [[-gains["u1"]]], [D], T)  # x is the voltage of the last tick
    mine = base.with_law("position", law, inputs, L=[1.0])
    same_poles(poles(mine), wanted, 1e-7)
    rows = Rows.of(mine, limits_on=False)
    rows["ticks"] = int(0.3 / T)
    rows.step("command", 0.1)
    assert abs(rows.trajectory().output_angle_rad[-1] - 0.1) < 1e-7
    loop, z = assemble_loops(mine).position, np.exp(1j * np.geomspace(1e-3, 3.0, 50))
    bare = np.where(np.arange(6) == 5, 0.0, K)  # its own output it remembers: no loop is cut
    theirs = np.array([(bare @ np.linalg.solve(one * np.eye(6) - A, B)).item() for one in z])
    np.testing.assert_allclose(loop.open_loop(z), theirs / (1.0 + gains["u1"] / z), rtol=1e-7)
