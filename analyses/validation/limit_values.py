"""Limits of a controller and what its integrals do there, each confronted by one update.

A limit is asked for with the others lifted, by a command far beyond it: the state holds what is left.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite

from actuator_lti.design.model import CurrentLoop, Design, VelocityLoop
from analyses.validation.row import Row, judged
from analyses.validation.value_pair import WITHIN, Pair, only
from nonlinear.bench.loop_setup import every, producer, stages_of, target
from nonlinear.rows import Rows
from nonlinear.runs.running import Running

FAR = 1e6  # times a limit: a command that nothing follows
OVER = 3.0  # times a limit: what an integral is asked beyond it


def limit_rows(pair: Pair) -> Iterator[Row]:
    """All of them."""
    yield from _clamps(pair)
    yield from _rates(pair)
    for stage in ("current", "velocity"):
        if stage in stages_of(pair.design):
            yield from _windup(pair, stage)


OUTPUT = {"u": "VOLTAGE_BEFORE", "i_ref": "CURRENT_BEFORE", "w_ref": "SPEED_COMMAND"}
CLAMPED = {"u": ("voltage_limit", "voltage_V", "V"), "i_ref": ("current_limit", "peak_current_A", "A"),
           "w_ref": ("speed_limit", "speed_rad_s", "")}  # fmt: skip


def _pushed(rows: Rows, pair: Pair, stage: str, size: float) -> Running:
    """One tick in which a stage is asked for ``size`` times its gain; 0 for the command of the drive."""
    if stage in ("velocity", "current"):
        rows.step("w_ref" if stage == "velocity" else "i_ref", size, -1.0)
    drive = rows.running()
    if stage not in ("velocity", "current"):
        drive.command(size)
    drive.begin()
    return drive


def _ask(pair: Pair, stage: str, limit: float) -> float:
    """A command to a stage that drives its output far beyond a limit."""
    control = pair.design.controller
    gains = {"velocity": control.velocity and control.velocity.gain,
             "current": control.current and control.current.gain_V_A,
             "position": control.position and control.position.gain * pair.design.total_ratio}  # fmt: skip
    own = control.own_law
    direct = own[1].direct if own is not None and own[0] == stage else gains.get(stage)
    return FAR * limit / (direct or 1.0)


def _driven(pair: Pair) -> list[tuple[str, str]]:
    """Stage and the signal that it drives; the command drives the innermost signal of a drive without one."""
    design = pair.design
    own = design.controller.own_law  # without a direct term it answers no command within one tick
    late = own[0] if own is not None and own[1].direct == 0.0 else ""
    stages = [(stage, target(design, stage)) for stage in stages_of(design) if stage != late]
    outermost = {"velocity": "w_ref", "current": "i_ref", "voltage": "u"}.get(design.controller.outermost)
    return stages if outermost is None else [*stages, ("", outermost)]


def _clamps(pair: Pair) -> Iterator[Row]:
    """Speed, current and voltage limit."""
    for stage, signal in _driven(pair):
        name, attribute, unit = CLAMPED[signal]
        limit, own = (float(getattr(one.limits, attribute)) for one in (pair.model, pair.design))
        if not isfinite(min(limit, own)):
            continue
        rows = pair.rows(only(**{attribute: own}))
        size = _ask(pair, stage, min(limit, own))
        found = _pushed(rows, pair, stage, size).value(OUTPUT[signal])
        words = f"a {stage or 'direct'} command far beyond it"
        yield pair.judged(name, limit, None if found > 1e3 * limit else found, unit or pair.speed_unit, words)


def _rates(pair: Pair) -> Iterator[Row]:
    """Largest change of the speed and of the current command, over one update."""
    for stage, signal in _driven(pair):
        if signal == "u" or (signal == "i_ref" and not stage):
            continue
        attribute = "acceleration_rad_s2" if signal == "w_ref" else "current_rate_A_s"
        limit, own = (float(getattr(one.limits, attribute)) for one in (pair.model, pair.design))
        if not isfinite(min(limit, own)):
            continue
        period = every(pair.design, stage or _producer(pair, signal)) * pair.design.controller.period_s
        rows = pair.rows(only(**{attribute: own}))
        size = _ask(pair, stage, min(limit, own) * period)
        found = _pushed(rows, pair, stage, size).value(OUTPUT[signal]) / period
        unit = f"{pair.speed_unit}^2" if signal == "w_ref" else "A/s"
        name = "acceleration_limit" if signal == "w_ref" else "current_rate_limit"
        yield pair.judged(name, limit, None if found > 1e3 * limit else found, unit, "over one update")


def _producer(pair: Pair, signal: str) -> str:
    """The stage at whose rate a command of the drive is taken."""
    return pair.design.controller.outermost if signal == "w_ref" else producer(pair.design, signal)


def _loop(design: Design, stage: str) -> tuple[VelocityLoop | CurrentLoop | None, float]:
    """Controller of a stage and its gain."""
    control = design.controller
    if stage == "velocity":
        return control.velocity, control.velocity.gain if control.velocity else 0.0
    return control.current, control.current.gain_V_A if control.current else 0.0


def _windup(pair: Pair, stage: str) -> Iterator[Row]:
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
    rows = pair.rows(only(**{attribute: ours}))
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
