"""Random drives with every feature of the running model, and random inputs for them."""

from math import inf
from typing import Any

import numpy as np

from actuator_lti.design import load_design, model
from actuator_lti.design.law import LAW_INPUTS, Law
from tests.changed import changed

Rng = np.random.Generator
Parts = dict[str, Any]  # of a design, as `changed` takes them


class Draw:
    """Values near others, and what may be there or not."""

    def __init__(self, rng: Rng) -> None:
        self.rng = rng

    def near(self, value: float) -> float:
        return float(value * 3.0 ** self.rng.uniform(-1.0, 1.0))

    def maybe(self, value: Any, other: Any = 0.0, share: float = 0.5) -> Any:
        return value if self.rng.random() < share else other


def random_drive(rng: Rng) -> model.Design:
    """A drive near a shipped one with any of the features."""
    design, draw, own = load_design("ilr33-amber"), Draw(rng), Draw(rng.spawn(1)[0])
    dry_Nm = design.friction.dry_torque_Nm
    near = ("resistance_ohm", "inductance_H", "rotor_inertia_kgm2")
    motor = {name: draw.near(getattr(design.motor, name)) for name in near}
    motor |= {"cogging_Nm": own.maybe(own.near(1e-3)), "cogging_periods": own.near(40.0)}
    motor |= {"cogging_phase_rad": own.rng.uniform(0.0, 3.0)}
    controller = _controller(draw, design)
    friction: Parts = {"law": draw.maybe("coulomb", "tanh", 0.75), "dry_torque_Nm": draw.near(dry_Nm)}
    friction |= {"dry_torque_reverse_Nm": draw.maybe(draw.near(dry_Nm), None)}
    friction |= {"breakaway_ratio": draw.maybe(1.0 + rng.random(), 1.0)}
    friction |= {"smoothing_speed_rad_s": draw.near(5.0)}
    friction |= {"offset_torque_Nm": draw.maybe(2e-4)}
    load = {"path": draw.maybe("back-drivable", "self-locking"), "moment_slope_Nm_rad": draw.maybe(-4.0)}
    load |= {"gravity": draw.maybe(model.Gravity(mass_kg=2.0, arm_m=0.1, offset_rad=0.3), None)}
    load |= {"moment_damping_Nms_rad": own.maybe(own.near(0.05)), "gear_error_Nm": own.maybe(own.near(0.3))}
    load |= {"gear_error_periods": own.near(10.0), "gear_error_phase_rad": own.rng.uniform(0.0, 3.0)}
    parts: Parts = {"motor": motor, "controller": controller, "friction": friction, "load": load}
    parts |= {"encoder": _encoder(draw), "output_encoder": {"counts_per_rev": draw.maybe(4096, None)}}
    parts |= {"command": _command(draw), "instruments": draw.maybe({}, _instruments(draw))}
    parts |= {"supply": draw.maybe(None, _supply(draw)), "limits": _limits(draw)}
    return _with_law(own.rng.spawn(1)[0], changed(design, **parts))


def _with_law(rng: Rng, design: model.Design) -> model.Design:
    """One in three with a law of one's own near the gains that the stage had."""
    stage = Draw(rng).maybe("", str(rng.choice(["current", "velocity", "position"])), 2 / 3)
    if not stage or getattr(design.controller, stage) is None:
        return design
    return law_at(rng, design, stage, int(rng.integers(0, 4)))


def law_at(rng: Rng, design: model.Design, stage: str, n: int) -> model.Design:
    """A law of one's own of order ``n`` in a stage of a design, near the gain that it had."""
    loop = getattr(design.controller, stage)
    gain = loop.gain_V_A if stage == "current" else loop.gain
    inputs = ("error", *(name for name in LAW_INPUTS if name != "error" and rng.random() < 0.5))
    A, B = rng.standard_normal((n, n)), rng.standard_normal((n, len(inputs)))
    A *= 0.9 / max(np.abs(np.linalg.eigvals(A)), default=1.0)
    C, D = 0.1 * gain * rng.standard_normal(n), 1e-3 * gain * rng.standard_normal(len(inputs))
    D[0] = gain
    law = Law(inputs=inputs, A=tuple(map(tuple, A.tolist())), B=tuple(map(tuple, (1e-2 * B).tolist())),
              C=tuple(C.tolist()), D=tuple(D.tolist()), L=tuple((0.1 * rng.standard_normal(n)).tolist()),
              gain=Draw(rng).near(1.0))  # fmt: skip
    own = (key for key in ("every", "sensor", "back_emf_feedforward") if hasattr(loop, key))
    part = type(loop)(**{key: getattr(loop, key) for key in own}, law=law)
    if (velocity := design.controller.velocity) is not None:
        design = changed(design, controller={"velocity": {"filters": velocity.filters_on("torque")}})
    return changed(design, controller={stage: part}, encoder={"filter_time_s": 0.0})


def random_elastic_drive(rng: Rng) -> model.Design:
    """The same with a coupling or a friction map, or both: play, damping, friction behind the coupling."""
    design, draw = random_drive(rng), Draw(rng)
    kind, gears = int(rng.integers(4)), design.gears  # 3: a map without a coupling
    k = float(10.0 ** rng.uniform(1.5, 5.0))
    coupling: Parts = {"stiffness_Nm_rad": k, "damping_Nms_rad": draw.maybe(draw.near(0.05))}
    coupling |= {"play_rad": draw.maybe(draw.near(2e-3)), "after": draw.maybe(gears[0].name, gears[-1].name)}
    friction: Parts = {"law": "coulomb"}
    if kind > 1:
        friction["points"] = _map(draw, design.friction.dry_torque_Nm)
    for number in range(int(rng.integers(3))):
        coupling[f"torque_{number + 1}_Nm"] = draw.near(0.3 * 10.0**number)
        coupling[f"stiffness_{number + 2}_Nm_rad"] = k * draw.near(1.5)
    behind = {"dry_torque_Nm": draw.maybe(draw.near(0.3)), "viscous_Nms_rad": draw.near(0.05)}
    behind |= {"breakaway_ratio": draw.maybe(1.0 + rng.random(), 1.0), "offset_torque_Nm": draw.maybe(0.05)}
    load = {"path": "back-drivable", "moment_damping_Nms_rad": 0.0, "friction": model.LoadFriction(**behind)}
    spring = None if kind == 3 else model.Coupling(**coupling)
    return changed(design, friction=friction, coupling=spring, load=load)


def _map(draw: Draw, level_Nm: float) -> tuple[model.FrictionPoint, ...]:
    """Stribeck curves, one for both directions or one each."""
    speeds = (0.0, draw.near(3.0), draw.near(60.0), draw.near(600.0))
    sides: tuple[Any, ...] = draw.maybe(("both",), ("forward", "reverse"))
    return tuple(
        model.FrictionPoint(speed_rad_s=speed, torque_Nm=draw.near(level_Nm), direction=side)
        for side in sides
        for speed in speeds[: int(draw.rng.integers(1, 5))]
    )


def _controller(draw: Draw, design: model.Design) -> Parts:
    c, rng, kinds = design.controller, draw.rng, ("conditional", "clamped", "back-calculation")
    every = int(rng.integers(1, 4))
    late = c.period_s * draw.maybe(float(rng.uniform(0.0, 3.0)), float(rng.integers(0, 4)))
    current = {"gain_V_A": draw.near(c.current.gain_V_A), "anti_windup": kinds[rng.integers(3)]}
    current |= {"back_emf_feedforward": draw.maybe(0.9), "resistance_feedforward": draw.maybe(0.5)}
    velocity = {"gain": draw.near(c.velocity.gain), "every": every, "anti_windup": kinds[rng.integers(3)]}
    velocity |= {"filters": _filters(draw)}
    place = {"every": every * int(rng.integers(1, 4)), "gain": draw.near(c.position.gain)}
    place |= {"sensor": draw.maybe("output", "motor"), "integral_time_s": draw.maybe(0.3, None)}
    place |= {"derivative_time_s": draw.maybe(1e-4), "derivative_filter_s": 1e-3}
    place |= {"feedforward": draw.maybe(0.8), "acceleration_feedforward": draw.maybe(0.7)}
    place |= {"friction_feedforward": draw.maybe(0.2)}
    return {"computing_delay_s": late, "current": current, "velocity": velocity, "position": place}


def _filters(draw: Draw) -> tuple[model.Filter, ...]:
    known = (
        model.Filter(kind="notch", frequency_rad_s=900.0, width_rad_s=300.0, depth=0.1),
        model.Filter(kind="lowpass", frequency_rad_s=3000.0, order=2, on="speed"),
        model.Filter(kind="lowpass", frequency_rad_s=4000.0),
        model.Filter(kind="leadlag", zero_rad_s=500.0, pole_rad_s=2000.0),
    )
    return tuple(item for item in known if draw.rng.random() < 0.4)


def _encoder(draw: Draw) -> model.Encoder:
    speed = ("ideal", "difference", "tracking")[draw.rng.integers(3)]
    own = {"counts_per_rev": draw.maybe(4096, None), "difference_samples": int(draw.rng.integers(1, 5))}
    own |= {"filter_time_s": draw.maybe(5e-4), "bandwidth_rad_s": draw.near(2000.0)}
    return model.Encoder(speed=speed, **own)


def _command(draw: Draw) -> Parts:
    if draw.rng.random() < 0.5:
        return {}
    own = {"filter_time_s": draw.maybe(2e-3), "filter_order": int(draw.rng.integers(1, 3))}
    own |= {"rate_rad_s": draw.near(2.0), "acceleration_rad_s2": draw.near(60.0)}
    return own | {"jerk_rad_s3": draw.maybe(draw.near(9e3), inf)}


def _instruments(draw: Draw) -> Parts:
    own = {"current_resolution_A": draw.maybe(0.01), "current_noise_A": draw.maybe(0.02)}
    own |= {"angle_noise_rad": draw.maybe(1e-4), "output_angle_noise_rad": draw.maybe(1e-6)}
    return own | {"jitter_s": draw.maybe(1e-6), "seed": int(draw.rng.integers(2**31))}


def _supply(draw: Draw) -> model.Supply:
    own = {"resistance_ohm": draw.near(0.05), "regenerative": draw.maybe(True, False)}
    return model.Supply(**own, capacitance_F=1e-3, brake_voltage_V=draw.maybe(14.0, None))


def _limits(draw: Draw) -> Parts:
    own = Draw(draw.rng.spawn(1)[0])
    limits = {"voltage_V": draw.near(12.0), "speed_rad_s": draw.maybe(600.0, inf)}
    limits |= {"current_rate_A_s": own.maybe(own.near(5e3), inf)}
    overload = {"continuous_current_A": 4.0, "peak_current_A": 12.0, "peak_time_s": 1e-2}
    return limits if draw.rng.random() < 0.5 else limits | overload


def random_inputs(rng: Rng, ticks: int, period_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Commands and hinge moments, one a tick: a sine with a step, and a slow one."""
    t, draw = np.arange(ticks) * period_s, Draw(rng)
    command = draw.near(0.1) * np.sin(2.0 * np.pi * draw.near(5.0) * t)
    command += draw.maybe(0.05) * (t > 0.01)
    return command, draw.near(2.0) * np.sin(2.0 * np.pi * draw.near(2.0) * t + 1.0)
