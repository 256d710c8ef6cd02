"""Limits, profile, counts, overload and supply of a controller, each confronted by a tick or two.

A limit is asked for with the others lifted, by a command far beyond it: the state holds what is left.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil, inf, isfinite
from typing import Any

from actuator_lti.design.model import Command, CurrentLoop, Design, Instruments, Limits, VelocityLoop
from analyses.validation.row import Row, judged
from analyses.validation.torque_values import WITHIN, edge
from nonlinear.loop_setup import every, producer, stages_of, target
from nonlinear.rows import Rows
from nonlinear.stepper import Stepper

FAR = 1e6  # times a limit: a command that nothing follows
OVER = 3.0  # times a limit: what an integral is asked beyond it
LIFTED = Limits(voltage_V=inf)


def _only(**limits: Any) -> Limits:
    """These limits, the others lifted."""
    return replace(LIFTED, **limits)


def controller_rows(design: Design, model: Design) -> Iterator[Row]:
    """All rows of the controller."""
    pair = _Pair(design, model)
    yield from _clamps(pair)
    yield from _rates(pair)
    for stage in ("current", "velocity"):
        if stage in stages_of(design):
            yield from _windup(pair, stage)
    yield from _overload(pair)
    yield from _supply(pair)
    yield from _profile(pair)
    yield from _feedforward(pair)
    yield from _counts(pair)


@dataclass(frozen=True)
class _Pair:
    """A design and the model of it, with what a row of either needs."""

    design: Design
    model: Design

    def rows(self, limits: Limits = LIFTED, **changes: object) -> Rows:
        """A row of the design on the bench, at rest, with these limits alone."""
        bare = replace(self.design, limits=limits, supply=None, command=Command(), instruments=Instruments())
        rows = Rows.of(replace(bare, **changes))  # type: ignore[arg-type]
        rows["torque_filters"] = 0.0  # their gain at once is that of small signals
        return rows

    @property
    def speed_unit(self) -> str:
        return "m/s" if self.design.axis == "linear" else "rad/s"

    def judged(self, name: str, predicted: float, found: float | None, unit: str, condition: str) -> Row:
        """A row that is exact but for rounding; an absent limit is predicted as none."""
        wanted = predicted if isfinite(predicted) else None
        seen = None if found is None or not isfinite(found) else found
        return judged(name, "drive", wanted, seen, WITHIN * abs(predicted) if wanted else 0.0, unit=unit,
                      condition=condition)  # fmt: skip


OUTPUT = {"u": "VOLTAGE_BEFORE", "i_ref": "CURRENT_BEFORE", "w_ref": "SPEED_COMMAND"}
CLAMPED = {"u": ("voltage_limit", "voltage_V", "V"), "i_ref": ("current_limit", "peak_current_A", "A"),
           "w_ref": ("speed_limit", "speed_rad_s", "")}  # fmt: skip


def _pushed(rows: Rows, pair: _Pair, stage: str, size: float) -> Stepper:
    """One tick in which a stage is asked for ``size`` times its gain; 0 for the command of the drive."""
    if stage in ("velocity", "current"):
        rows.step("w_ref" if stage == "velocity" else "i_ref", size, -1.0)
    drive = Stepper(rows)
    if stage not in ("velocity", "current"):
        drive.command(size)
    drive.begin()
    return drive


def _ask(pair: _Pair, stage: str, limit: float) -> float:
    """A command to a stage that drives its output far beyond a limit."""
    control = pair.design.controller
    gains = {"velocity": control.velocity and control.velocity.gain,
             "current": control.current and control.current.gain_V_A,
             "position": control.position and control.position.gain * pair.design.total_ratio}  # fmt: skip
    return FAR * limit / (gains.get(stage) or 1.0)


def _driven(pair: _Pair) -> list[tuple[str, str]]:
    """Stage and the signal that it drives; the command drives the innermost signal of a drive without one."""
    design = pair.design
    stages = [(stage, target(design, stage)) for stage in stages_of(design)]
    outermost = {"velocity": "w_ref", "current": "i_ref", "voltage": "u"}.get(design.controller.outermost)
    return stages if outermost is None else [*stages, ("", outermost)]


def _clamps(pair: _Pair) -> Iterator[Row]:
    """Speed, current and voltage limit."""
    for stage, signal in _driven(pair):
        name, attribute, unit = CLAMPED[signal]
        limit, own = (float(getattr(one.limits, attribute)) for one in (pair.model, pair.design))
        if not isfinite(min(limit, own)):
            continue
        rows = pair.rows(_only(**{attribute: own}))
        size = _ask(pair, stage, min(limit, own))
        found = _pushed(rows, pair, stage, size).value(OUTPUT[signal])
        words = f"a {stage or 'direct'} command far beyond it"
        yield pair.judged(name, limit, None if found > 1e3 * limit else found, unit or pair.speed_unit, words)


def _rates(pair: _Pair) -> Iterator[Row]:
    """Largest change of the speed and of the current command, over one update."""
    for stage, signal in _driven(pair):
        if signal == "u" or (signal == "i_ref" and not stage):
            continue
        attribute = "acceleration_rad_s2" if signal == "w_ref" else "current_rate_A_s"
        limit, own = (float(getattr(one.limits, attribute)) for one in (pair.model, pair.design))
        if not isfinite(min(limit, own)):
            continue
        period = every(pair.design, stage or producer_of(pair, signal)) * pair.design.controller.period_s
        rows = pair.rows(_only(**{attribute: own}))
        size = _ask(pair, stage, min(limit, own) * period)
        found = _pushed(rows, pair, stage, size).value(OUTPUT[signal]) / period
        unit = f"{pair.speed_unit}^2" if signal == "w_ref" else "A/s"
        name = "acceleration_limit" if signal == "w_ref" else "current_rate_limit"
        yield pair.judged(name, limit, None if found > 1e3 * limit else found, unit, "over one update")


def producer_of(pair: _Pair, signal: str) -> str:
    """The stage at whose rate a command of the drive is taken."""
    return pair.design.controller.outermost if signal == "w_ref" else producer(pair.design, signal)


def _loop(design: Design, stage: str) -> tuple[VelocityLoop | CurrentLoop | None, float]:
    """Controller of a stage and its gain."""
    control = design.controller
    if stage == "velocity":
        return control.velocity, control.velocity.gain if control.velocity else 0.0
    return control.current, control.current.gain_V_A if control.current else 0.0


def _windup(pair: _Pair, stage: str) -> Iterator[Row]:
    """What the integral does at the limit, over one update from zero (model.md sections 2 and 7)."""
    model, own = (one[0] for one in (_loop(pair.model, stage), _loop(pair.design, stage)))
    attribute = "peak_current_A" if target(pair.design, stage) == "i_ref" else "voltage_V"
    limit = float(getattr(pair.model.limits, attribute))
    ours = float(getattr(pair.design.limits, attribute))
    if model is None or own is None or model.integral_time_s is None or not isfinite(min(limit, ours)):
        return
    gain = _loop(pair.model, stage)[1]
    T = every(pair.model, stage) * pair.model.controller.period_s
    asked = OVER * limit / gain
    rows = pair.rows(_only(**{attribute: ours}))
    found = _pushed(rows, pair, stage, asked).value(f"{stage.upper()}_INTEGRATOR")
    integral = gain * T / model.integral_time_s * asked
    wanted = 0.0
    if model.anti_windup == "clamped":
        wanted = min(integral, limit)
    elif model.anti_windup == "back-calculation":
        extra = 0.0
        if isinstance(model, CurrentLoop):
            extra = model.resistance_feedforward * (pair.model.effective_motor.resistance_ohm or 0.0) * asked
        wanted = integral + T / (model.tracking_time_s or model.integral_time_s) * (
            limit - gain * asked - integral - extra
        )
    yield judged(f"{stage}_anti_windup", "drive", wanted, found, WITHIN * max(limit, abs(wanted)),
                 unit="A" if attribute == "peak_current_A" else "V",
                 condition=f"integral after one update at {OVER:g} times the limit")  # fmt: skip


def _overload(pair: _Pair) -> Iterator[Row]:
    """Time constant, limit and release of the overload protection."""
    limits, own = pair.model.limits, pair.design.limits
    tau = limits.overload_time_s
    if tau is None or own.overload_time_s is None:
        return
    Ts = pair.design.controller.period_s
    kept = {name: getattr(own, name) for name in
            ("peak_current_A", "continuous_current_A", "peak_time_s", "release", "overload")}  # fmt: skip
    drive = Stepper(pair.rows(_only(**kept)))
    drive.begin(CURRENT=own.continuous_current_A)
    yield pair.judged("overload_time", float(tau), Ts / drive.value("OVERLOAD"), "s", "continuous current")
    drive.begin(OVERLOAD=2.0)
    lasting = min(limits.continuous_current_A, limits.peak_current_A)
    yield pair.judged("continuous_current", lasting, drive.value("CURRENT_LIMIT"), "A", "overloaded")

    def holds(x: float) -> bool:
        drive.begin(OVERLOAD=x / (1.0 - Ts / own.overload_time_s), OVERLOADED=1.0)
        return drive.value("OVERLOADED") > 0.0

    found = edge(holds, limits.release, 1e-7 * limits.release, 2.0 * limits.release)
    yield pair.judged("overload_release", limits.release, found, "1", "no current, the state falling")


def _supply(pair: _Pair) -> Iterator[Row]:
    """Voltage of the bus one tick on, motoring and braking, and where the brake acts (model.md section 6)."""
    supply, own = pair.model.supply, pair.design.supply
    if supply is None or own is None:
        return
    Ts, U_s = pair.model.controller.period_s, pair.model.limits.voltage_V
    rows = pair.rows(_only(voltage_V=pair.design.limits.voltage_V), supply=own)
    rows["brake_voltage"] = inf
    drive = Stepper(rows)

    def bus(current: float) -> float:
        drive.begin(TICK=1.0, VOLTAGE_LIMIT=U_s, VOLTAGE=U_s, CURRENT=current)
        return drive.value("VOLTAGE_LIMIT")

    motoring = 0.5 * U_s / supply.resistance_ohm if supply.resistance_ohm else 1.0
    yield pair.judged("bus_voltage", U_s - supply.resistance_ohm * motoring, bus(motoring), "V",
                      f"{motoring:.4g} A taken")  # fmt: skip
    if supply.regenerative:
        wanted = U_s + supply.resistance_ohm * motoring
        yield pair.judged("bus_voltage", wanted, bus(-motoring), "V", f"{motoring:.4g} A fed back")
        return
    C = supply.capacitance_F or 0.0
    braking = -0.1 * C * U_s / Ts  # its energy: a tenth of the capacitor's doubled
    wanted = (U_s**2 - 2.0 * U_s * braking * Ts / C) ** 0.5
    yield pair.judged("bus_voltage", wanted, bus(braking), "V", f"{-braking:.4g} A fed back")
    if supply.brake_voltage_V is not None:
        drive.change("brake_voltage", own.brake_voltage_V or inf)
        yield pair.judged(
            "brake_voltage", supply.brake_voltage_V, bus(1e3 * braking), "V", "fed back at once"
        )


def _profile(pair: _Pair) -> Iterator[Row]:
    """Limits of the command's derivatives, over its first update, and the mean that limits the jerk."""
    outermost = pair.design.controller.outermost
    if outermost not in ("position", "velocity"):
        return
    model, own = pair.model.command, pair.design.command
    T = every(pair.design, outermost) * pair.design.controller.period_s
    angle = "m" if pair.design.axis == "linear" else "rad"
    keys = ("rate_rad_s", "acceleration_rad_s2", "jerk_rad_s3")
    columns = ("profile_range", "profile_rate", "profile_acceleration")
    first = 1 if outermost == "position" else 0
    rows = pair.rows(command=replace(own, filter_time_s=0.0))
    for n, key in enumerate(keys[: 3 - first]):
        limit, there = float(getattr(model, key)), float(getattr(own, key))
        if not isfinite(min(limit, there)):
            continue
        alone = rows.copy()
        alone["profile_samples"] = 0.0
        for column in columns:
            if column != columns[n + first]:
                alone[column] = inf
        drive = Stepper(alone)
        drive.command(FAR * min(limit, there) * T)
        drive.begin()
        read = {
            0: drive.value("PROFILE"),
            1: drive.value("PROFILE_SPEED"),
            2: drive.value("PROFILE_SPEED") / T,
        }
        unit = f"{angle}/s" + ("", "^2", "^3")[n]
        name = f"command_{key.split('_')[0]}"
        yield pair.judged(name, limit, read[n + first], unit, "first update of a large command")
    if outermost == "position" and isfinite(min(model.jerk_rad_s3, own.jerk_rad_s3)):
        yield _jerk(pair, rows, T)


def _jerk(pair: _Pair, rows: Rows, T: float) -> Row:
    """Samples of the mean: what one update lets through of a command without other limits."""
    model = pair.model.command
    for column in ("profile_range", "profile_rate", "profile_acceleration"):
        rows[column] = inf
    drive = Stepper(rows)
    drive.command(1.0)
    drive.begin()
    samples = pair.design.total_ratio / drive.value("REFERENCE")
    wanted = max(ceil(2.0 * model.acceleration_rad_s2 / (model.jerk_rad_s3 * T) - 1e-9), 1)
    return pair.judged("command_jerk", float(wanted), samples, "1", "samples of the mean that limits it")


def _feedforward(pair: _Pair) -> Iterator[Row]:
    """Feed-forward of dry friction, over the first update of a moving command."""
    model, own = (one.controller.position for one in (pair.model, pair.design))
    if model is None or own is None or not (model.friction_feedforward or own.friction_feedforward):
        return
    wanted = model.friction_feedforward
    rows = pair.rows()
    rows["acceleration_feedforward"] = 0.0
    for side in (1.0, -1.0):
        drive = Stepper(rows)
        drive.command(side)
        drive.begin()
        unit = "V" if pair.design.controller.current is None else "A"
        yield pair.judged("friction_feedforward", side * wanted, drive.value("TORQUE_FEEDFORWARD"), unit,
                          f"command moving {'forward' if side > 0.0 else 'backward'}")  # fmt: skip


def _counts(pair: _Pair) -> Iterator[Row]:
    """The size of a count where the controller reads one: one and a half of it are told as one."""
    design, model, N = pair.design, pair.model, pair.design.total_ratio
    unit = "m" if design.axis == "linear" else "rad"
    position, velocity = design.controller.position, design.controller.velocity
    quantum, own = model.output_quantum_rad, design.output_quantum_rad
    if position is not None and position.sensor == "output" and quantum is not None and own is not None:
        drive = Stepper(_turned(pair.rows(), 1.5 * quantum * N))
        drive.begin()
        yield pair.judged("output_count", quantum, -drive.value("ERROR") / N, unit, "position loop")
    if velocity is None or design.encoder.speed == "ideal":
        return
    behind = velocity.sensor == "output"
    quantum, own = (one.output_quantum_rad if behind else one.angle_quantum_rad for one in (model, design))
    scale = N if behind else 1.0
    if quantum is None or own is None:
        return
    rows = _turned(pair.rows(), 1.5 * quantum * scale)
    drive = Stepper(rows)
    name = "output_count" if behind else "count"
    if design.encoder.speed == "tracking":
        drive.begin()
        yield pair.judged(name, quantum, drive.value("TRACKED_ANGLE") / scale, unit, "measured speed")
        return
    drive = Stepper(_turned(rows, 0.5 * quantum * scale))
    if behind and rows.value("elastic_drive"):
        drive.begin(OUTPUT=1.5 * quantum)
    else:
        drive.begin(ANGLE=1.5 * quantum * scale)
    span = design.encoder.difference_samples * velocity.every * design.controller.period_s
    seen = drive.value("FILTERED_SPEED") / rows.value("filter_coefficient") * span / scale
    yield pair.judged(name, quantum, seen, unit, "measured speed")


def _turned(rows: Rows, angle_rad: float) -> Rows:
    """The same from another angle of the motor, the coupling without twist."""
    rows["angle_start"] = angle_rad
    return rows
