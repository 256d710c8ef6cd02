"""Overload protection, supply and resolution of the current, each confronted by a tick."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from actuator_lti.design.model import Instruments
from analyses.validation.row import Row
from analyses.validation.torque_values import edge
from analyses.validation.value_pair import Pair, only


def power_rows(pair: Pair) -> Iterator[Row]:
    """All of them."""
    yield from _overload(pair)
    yield from _supply(pair)
    yield from _resolution(pair)


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
        yield pair.judged(
            "brake_voltage", supply.brake_voltage_V, bus(1e3 * braking), "V", "fed back at once"
        )


def _resolution(pair: Pair) -> Iterator[Row]:
    """The step of the measured current: one and a half of it, held against no command, is told as two."""
    wanted, own = (one.instruments.current_resolution_A for one in (pair.model, pair.design))
    current = pair.design.controller.current
    if current is None or current.law is not None or not (wanted and own):
        return
    rows = pair.rows(instruments=Instruments(current_resolution_A=own))
    drive = rows.running()
    drive.begin(CURRENT=1.6 * wanted)
    gain = rows.value("current_gain") + rows.value("current_integral")
    yield pair.judged(
        "current_resolution", wanted, -0.5 * drive.value("VOLTAGE_BEFORE") / gain, "A", "1.6 steps"
    )
