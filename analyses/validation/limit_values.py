"""Limits, integrals there, overload, supply and resolution: each by one update far beyond it, alone."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import Any, Literal

from actuator_lti.design.model import Command, CurrentLoop, Design, Instruments, Limits
from actuator_lti.drive.signals import CLAMP_OF, LIMITERS
from actuator_lti.drive.steady import fed_forward
from actuator_lti.drive.wiring import COMMANDS, wire
from analyses.validation.row import WITHIN, Row, judged
from analyses.validation.torque_values import edge
from nonlinear.rows import Rows
from nonlinear.runs.running import Running

FAR = 1e6  # times a limit: a command that nothing follows
OVER = 3.0  # times a limit: what an integral is asked beyond it
HELD = {"u": "VOLTAGE_BEFORE", "i_ref": "CURRENT_BEFORE", "w_ref": "SPEED_COMMAND"}
"""Where the state holds each signal that a stage drives."""
LIFTED = Limits(voltage_V=inf)


def only(**limits: Any) -> Limits:
    return replace(LIFTED, **limits)


@dataclass(frozen=True)
class Pair:
    """A design and the model of it, with what a row of either needs."""

    design: Design
    model: Design

    def rows(self, limits: Limits = LIFTED, **changes: object) -> Rows:
        """A row of the design on the bench, at rest, with these limits alone."""
        bare = replace(self.design, limits=limits, supply=None, command=Command(), instruments=Instruments())
        rows = Rows.of(replace(bare, **changes))  # type: ignore[arg-type]
        rows["torque_filters"] = 0.0  # their gain at once is that of small signals
        return rows

    def judged(self, name: str, predicted: float, found: float | None, unit: str, condition: str) -> Row:
        """A row that is exact but for rounding; an absent limit is predicted as none."""
        wanted = predicted if isfinite(predicted) else None
        seen = None if found is None or not isfinite(found) else found
        return judged(name, "drive", wanted, seen, WITHIN * abs(predicted) if wanted else 0.0, unit=unit,
                      condition=condition)  # fmt: skip


def limit_rows(pair: Pair) -> Iterator[Row]:
    yield from _limited(pair, "value")
    yield from _limited(pair, "rate")
    for stage in ("current", "velocity"):
        if stage in pair.design.controller.stages:
            yield from _windup(pair, stage)
    yield from _overload(pair)
    yield from _supply(pair)
    yield from _resolution(pair)


def _pushed(rows: Rows, stage: str, size: float) -> Running:
    """One tick in which a stage is asked for ``size`` times its gain; 0 for the command of the drive."""
    inner = stage in ("velocity", "current")
    if inner:
        rows.step(COMMANDS[stage], size, -1.0)
    return rows.running().begin(None if inner else size)


def _gain(design: Design, stage: str) -> float:
    """What a stage makes of a command at once; 1 without a stage."""
    loop, own = getattr(design.controller, stage, None), design.controller.own_law
    if own is not None and own[0] == stage:
        return own[1].direct or 1.0
    if loop is None:
        return 1.0
    if stage == "current":
        return float(loop.gain_V_A)
    return float(loop.gain * (design.total_ratio if stage == "position" else 1.0)) or 1.0


def _driven(pair: Pair) -> list[tuple[str, str]]:
    """Stage and the signal that it drives; the command drives the innermost signal of a drive without one."""
    design = pair.design
    own = design.controller.own_law  # without a direct term it answers no command within one tick
    late = own[0] if own is not None and own[1].direct == 0.0 else ""
    stages = [(stage, signal) for stage, signal in wire(design).target.items() if stage != late]
    outermost = COMMANDS[design.controller.outermost]
    return [*stages, ("", outermost)] if outermost in HELD else stages


def _limited(pair: Pair, kind: Literal["value", "rate"]) -> Iterator[Row]:
    """Speed, current and voltage limit; or the largest change of the speed and of the current command."""
    limiters = {one.signal: one for one in LIMITERS.values() if one.kind == kind}
    for stage, signal in _driven(pair):
        limiter, rate = limiters.get(signal), kind == "rate"
        if limiter is None or (rate and signal == "i_ref" and not stage):
            continue
        limit, own = (float(limiter.limit_of(one.limits)) for one in (pair.model, pair.design))
        if not isfinite(min(limit, own)):
            continue
        updated = stage or (pair.design.controller.outermost if signal == "w_ref" else "")
        period = wire(pair.design).interval.get(updated, 1) * pair.design.controller.period_s if rate else 1.0
        size = FAR * (min(limit, own) * period) / _gain(pair.design, stage)
        found = _pushed(pair.rows(only(**{limiter.limit: own})), stage, size).value(HELD[signal]) / period
        words = "over one update" if rate else f"a {stage or 'direct'} command far beyond it"
        name, unit = f"{limiter.name}_limit".replace("-", "_"), limiter.unit(pair.design.axis)
        yield pair.judged(name, limit, None if found > 1e3 * limit else found, unit, words)


def _windup(pair: Pair, stage: str) -> Iterator[Row]:
    """What the integral does at the limit, over one update from zero (model.md sections 2 and 7)."""
    model, own = (getattr(one.controller, stage) for one in (pair.model, pair.design))
    limiter = CLAMP_OF[wire(pair.design).target[stage]]
    limit, ours = (float(limiter.limit_of(one.limits)) for one in (pair.model, pair.design))
    if model is None or own is None or model.integral_time_s is None or not isfinite(min(limit, ours)):
        return
    gain = _gain(pair.model, stage)
    T = wire(pair.model).interval.get(stage, 1) * pair.model.controller.period_s
    asked = OVER * limit / gain
    rows = pair.rows(only(**{limiter.limit: ours}))
    found = _pushed(rows, stage, asked).value(f"{stage.upper()}_INTEGRATOR")
    integral = gain * T / model.integral_time_s * asked
    wanted = 0.0
    if model.anti_windup == "clamped":
        wanted = min(integral, limit)
    elif model.anti_windup == "back-calculation":
        extra = 0.0
        if isinstance(model, CurrentLoop):
            extra = fed_forward(pair.model)[0] * asked
        over = limit - gain * asked - integral - extra
        wanted = integral + T / (model.tracking_time_s or model.integral_time_s) * over
    yield judged(
        f"{stage}_anti_windup", "drive", wanted, found, WITHIN * max(limit, abs(wanted)), unit=limiter.unit(),
        condition=f"integral after one update at {OVER:g} times the limit",
    )  # fmt: skip


def _overload(pair: Pair) -> Iterator[Row]:
    """Time constant, limit and release of the overload protection."""
    limits, own = pair.model.limits, pair.design.limits
    tau = limits.overload_time_s
    if tau is None or own.overload_time_s is None:
        return
    Ts = pair.design.controller.period_s
    kept = {name: getattr(own, name) for name in
            ("peak_current_A", "continuous_current_A", "peak_time_s", "release", "overload")}  # fmt: skip
    drive = pair.rows(only(**kept)).running()
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


def _supply(pair: Pair) -> Iterator[Row]:
    """Voltage of the bus one tick on, motoring and braking, and where the brake acts (model.md section 6)."""
    supply, own = pair.model.supply, pair.design.supply
    if supply is None or own is None:
        return
    Ts, U_s = pair.model.controller.period_s, pair.model.limits.voltage_V
    rows = pair.rows(only(voltage_V=pair.design.limits.voltage_V), supply=own)
    rows["brake_voltage"] = inf
    drive = rows.running()

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
        found = bus(1e3 * braking)
        yield pair.judged("brake_voltage", supply.brake_voltage_V, found, "V", "fed back at once")


def _resolution(pair: Pair) -> Iterator[Row]:
    """The step of the measured current: one and a half of it, held against no command, is told as two."""
    wanted, own = (one.instruments.current_resolution_A for one in (pair.model, pair.design))
    current = pair.design.controller.current
    if current is None or current.law is not None or not (wanted and own):
        return
    rows = pair.rows(instruments=Instruments(current_resolution_A=own))
    rows["own_gain"] = 0.0  # a law outside that takes the current gives a command
    drive = rows.running().begin(CURRENT=1.6 * wanted)
    gain = rows.value("current_gain") + rows.value("current_integral")
    found = -0.5 * drive.value("VOLTAGE_BEFORE") / gain
    yield pair.judged("current_resolution", wanted, found, "A", "1.6 steps")
