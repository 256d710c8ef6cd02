"""Random drives with every feature of the running model, and random inputs for them."""

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from actuator_lti.design import load_design, model
from actuator_lti.design.law import LAW_INPUTS, Law

Rng = np.random.Generator


def scaled(rng: Rng, value: float) -> float:
    return float(value * 3.0 ** rng.uniform(-1.0, 1.0))


def maybe(rng: Rng, value: Any, other: Any, share: float = 0.5) -> Any:
    return value if rng.random() < share else other


def random_drive(rng: Rng) -> model.Design:
    """A drive near a shipped one with any of the features."""
    design, own = load_design("ilr33-amber"), rng.spawn(1)[0]
    near = ("resistance_ohm", "inductance_H", "rotor_inertia_kgm2")
    made = replace(
        design,
        motor=replace(
            design.motor,
            **{name: scaled(rng, getattr(design.motor, name)) for name in near},
            cogging_Nm=maybe(own, scaled(own, 1e-3), 0.0),
            cogging_periods=scaled(own, 40.0),
            cogging_phase_rad=own.uniform(0.0, 3.0),
        ),
        controller=_controller(rng, design),
        friction=replace(
            design.friction,
            law=maybe(rng, "coulomb", "tanh", 0.75),
            dry_torque_Nm=scaled(rng, design.friction.dry_torque_Nm),
            dry_torque_reverse_Nm=maybe(rng, scaled(rng, design.friction.dry_torque_Nm), None),
            breakaway_ratio=maybe(rng, 1.0 + rng.random(), 1.0),
            smoothing_speed_rad_s=scaled(rng, 5.0),
            offset_torque_Nm=maybe(rng, 2e-4, 0.0),
        ),
        load=replace(
            design.load,
            path=maybe(rng, "back-drivable", "self-locking"),
            moment_slope_Nm_rad=maybe(rng, -4.0, 0.0),
            gravity=maybe(rng, model.Gravity(mass_kg=2.0, arm_m=0.1, offset_rad=0.3), None),
            moment_damping_Nms_rad=maybe(own, scaled(own, 0.05), 0.0),
            gear_error_Nm=maybe(own, scaled(own, 0.3), 0.0),
            gear_error_periods=scaled(own, 10.0),
            gear_error_phase_rad=own.uniform(0.0, 3.0),
        ),
        encoder=_encoder(rng),
        output_encoder=model.OutputEncoder(counts_per_rev=maybe(rng, 4096, None)),
        command=_command(rng),
        instruments=maybe(rng, model.Instruments(), _instruments(rng)),
        supply=maybe(rng, None, _supply(rng)),
        limits=_limits(rng, design),
    )
    return _with_law(own.spawn(1)[0], made)


def _with_law(rng: Rng, design: model.Design) -> model.Design:
    """One in three with a law of one's own near the gains that the stage had."""
    stage = maybe(rng, "", str(rng.choice(["current", "velocity", "position"])), 2 / 3)
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
              gain=scaled(rng, 1.0))  # type: ignore[arg-type]  # fmt: skip
    own = (key for key in ("every", "sensor", "back_emf_feedforward") if hasattr(loop, key))
    part = type(loop)(**{key: getattr(loop, key) for key in own}, law=law)
    control, velocity = design.controller, design.controller.velocity
    if velocity is not None:
        control = replace(control, velocity=replace(velocity, filters=velocity.filters_on("torque")))
    control = replace(control, **{stage: part})
    return replace(design, controller=control, encoder=replace(design.encoder, filter_time_s=0.0))


def random_elastic_drive(rng: Rng) -> model.Design:
    """The same with a coupling or a friction map, or both: play, damping, friction behind the coupling."""
    design = random_drive(rng)
    kind = int(rng.integers(4))  # 3: a map without a coupling
    coupling = model.Coupling(
        stiffness_Nm_rad=float(10.0 ** rng.uniform(1.5, 5.0)),
        damping_Nms_rad=maybe(rng, scaled(rng, 0.05), 0.0),
        play_rad=maybe(rng, scaled(rng, 2e-3), 0.0),
        after=maybe(rng, design.gears[0].name, design.gears[-1].name),
    )
    friction = replace(design.friction, law="coulomb")
    if kind > 1:
        friction = replace(friction, points=_map(rng, friction.dry_torque_Nm))
    for number in range(int(rng.integers(3))):
        bend = {f"torque_{number + 1}_Nm": scaled(rng, 0.3 * 10.0**number)}
        bend[f"stiffness_{number + 2}_Nm_rad"] = coupling.stiffness_Nm_rad * scaled(rng, 1.5)
        coupling = replace(coupling, **bend)
    return replace(
        design,
        friction=friction,
        coupling=None if kind == 3 else coupling,
        load=replace(
            design.load,
            path="back-drivable",
            moment_damping_Nms_rad=0.0,
            friction=model.LoadFriction(
                dry_torque_Nm=maybe(rng, scaled(rng, 0.3), 0.0),
                viscous_Nms_rad=scaled(rng, 0.05),
                breakaway_ratio=maybe(rng, 1.0 + rng.random(), 1.0),
                offset_torque_Nm=maybe(rng, 0.05, 0.0),
            ),
        ),
    )


def _map(rng: Rng, level_Nm: float) -> tuple[model.FrictionPoint, ...]:
    """Stribeck curves, one for both directions or one each."""
    speeds = (0.0, scaled(rng, 3.0), scaled(rng, 60.0), scaled(rng, 600.0))
    sides: tuple[Any, ...] = maybe(rng, ("both",), ("forward", "reverse"))
    return tuple(
        model.FrictionPoint(speed_rad_s=speed, torque_Nm=scaled(rng, level_Nm), direction=side)
        for side in sides
        for speed in speeds[: int(rng.integers(1, 5))]
    )


def _controller(rng: Rng, design: model.Design) -> Any:
    c = design.controller
    every = int(rng.integers(1, 4))
    windup = ("conditional", "clamped", "back-calculation")
    return replace(
        c,
        computing_delay_s=c.period_s * maybe(rng, float(rng.uniform(0.0, 3.0)), float(rng.integers(0, 4))),
        current=replace(
            c.current,
            gain_V_A=scaled(rng, c.current.gain_V_A),
            anti_windup=windup[rng.integers(3)],
            back_emf_feedforward=maybe(rng, 0.9, 0.0),
            resistance_feedforward=maybe(rng, 0.5, 0.0),
        ),
        velocity=replace(
            c.velocity,
            gain=scaled(rng, c.velocity.gain),
            every=every,
            anti_windup=windup[rng.integers(3)],
            filters=_filters(rng),
        ),
        position=replace(
            c.position,
            every=every * int(rng.integers(1, 4)),
            gain=scaled(rng, c.position.gain),
            sensor=maybe(rng, "output", "motor"),
            integral_time_s=maybe(rng, 0.3, None),
            derivative_time_s=maybe(rng, 1e-4, 0.0),
            derivative_filter_s=1e-3,
            feedforward=maybe(rng, 0.8, 0.0),
            acceleration_feedforward=maybe(rng, 0.7, 0.0),
            friction_feedforward=maybe(rng, 0.2, 0.0),
        ),
    )


def _filters(rng: Rng) -> tuple[model.Filter, ...]:
    known = (
        model.Filter(kind="notch", frequency_rad_s=900.0, width_rad_s=300.0, depth=0.1),
        model.Filter(kind="lowpass", frequency_rad_s=3000.0, order=2, on="speed"),
        model.Filter(kind="lowpass", frequency_rad_s=4000.0),
        model.Filter(kind="leadlag", zero_rad_s=500.0, pole_rad_s=2000.0),
    )
    return tuple(item for item in known if rng.random() < 0.4)


def _encoder(rng: Rng) -> model.Encoder:
    speed = ("ideal", "difference", "tracking")[rng.integers(3)]
    return model.Encoder(
        counts_per_rev=maybe(rng, 4096, None),
        speed=speed,  # type: ignore[arg-type]
        difference_samples=int(rng.integers(1, 5)),
        filter_time_s=maybe(rng, 5e-4, 0.0),
        bandwidth_rad_s=scaled(rng, 2000.0),
    )


def _command(rng: Rng) -> model.Command:
    if rng.random() < 0.5:
        return model.Command()
    return model.Command(
        filter_time_s=maybe(rng, 2e-3, 0.0),
        filter_order=int(rng.integers(1, 3)),
        rate_rad_s=scaled(rng, 2.0),
        acceleration_rad_s2=scaled(rng, 60.0),
        jerk_rad_s3=maybe(rng, scaled(rng, 9e3), inf),
    )


def _instruments(rng: Rng) -> model.Instruments:
    return model.Instruments(
        current_resolution_A=maybe(rng, 0.01, 0.0),
        current_noise_A=maybe(rng, 0.02, 0.0),
        angle_noise_rad=maybe(rng, 1e-4, 0.0),
        output_angle_noise_rad=maybe(rng, 1e-6, 0.0),
        jitter_s=maybe(rng, 1e-6, 0.0),
        seed=int(rng.integers(2**31)),
    )


def _supply(rng: Rng) -> model.Supply:
    return model.Supply(
        resistance_ohm=scaled(rng, 0.05),
        regenerative=maybe(rng, True, False),
        capacitance_F=1e-3,
        brake_voltage_V=maybe(rng, 14.0, None),
    )


def _limits(rng: Rng, design: model.Design) -> Any:
    own = rng.spawn(1)[0]
    limits = replace(
        design.limits,
        voltage_V=scaled(rng, 12.0),
        speed_rad_s=maybe(rng, 600.0, inf),
        current_rate_A_s=maybe(own, scaled(own, 5e3), inf),
    )
    if rng.random() < 0.5:
        return limits
    return replace(limits, continuous_current_A=4.0, peak_current_A=12.0, peak_time_s=1e-2)


def random_inputs(rng: Rng, ticks: int, period_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Commands and hinge moments, one a tick: a sine with a step, and a slow one."""
    t = np.arange(ticks) * period_s
    command = scaled(rng, 0.1) * np.sin(2.0 * np.pi * scaled(rng, 5.0) * t)
    command += maybe(rng, 0.05, 0.0) * (t > 0.01)
    return command, scaled(rng, 2.0) * np.sin(2.0 * np.pi * scaled(rng, 2.0) * t + 1.0)
