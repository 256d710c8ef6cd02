"""Relations between the keys of the controller, its sensors, its command and its supply."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, pi

from actuator_lti.design.control import stable_pair
from actuator_lti.design.model import FILTER_KEYS, Design, Filter
from actuator_lti.errors import InputError

MAX_FILTERS = 8  # of each place; the running drive has room for so many second-order sections
MAX_MAP_POINTS = 16  # of each direction
TRACKING_LIMIT = 0.828  # w0 T at which the tracking loop of model.md section 7 becomes unstable: 2 sqrt 2 - 2
Refuse = Callable[[str, object, str], InputError]

_KEY_OF = {"frequency_rad_s": "frequency", "width_rad_s": "width", "zero_rad_s": "zero", "pole_rad_s": "pole"}


def check_control(design: Design, where: str) -> None:
    """Refuse settings of the controller that contradict each other.

    Raises
    ------
    InputError
        One line: key, value and what is allowed.
    """

    def refuse(key: str, value: object, allowed: str) -> InputError:
        return InputError(f"{key} = {value}: {allowed}", where=where)

    for check in (
        _filters, _speed_sensor, _anti_windup, _position, _overload, _supply, _temperature, _command,
        _gravity, _friction_map, _instruments,
    ):  # fmt: skip
        check(design, refuse)


def _filters(design: Design, refuse: Refuse) -> None:
    velocity = design.controller.velocity
    if velocity is None:
        return
    for place in ("torque", "speed"):
        if len(velocity.filters_on(place)) > MAX_FILTERS:
            count = len(velocity.filters_on(place))
            raise refuse("control.velocity.filter", f"{count} on {place}", f"allowed: at most {MAX_FILTERS}")
    nyquist = pi / (velocity.every * design.controller.period_s)
    for number, item in enumerate(velocity.filters, 1):
        _filter(item, f"control.velocity.filter.{number}", nyquist, refuse)


def _filter(item: Filter, path: str, nyquist: float, refuse: Refuse) -> None:
    needed, optional = FILTER_KEYS[item.kind]
    fresh = Filter(kind=item.kind)
    for name in (*_KEY_OF, "b", "a", "order", "damping", "depth"):
        value, key = getattr(item, name), _KEY_OF.get(name, name)
        if name in needed and value in (None, ()):
            raise refuse(f"{path}.{key}", "nothing", f'missing; a "{item.kind}" needs it')
        if name not in needed | optional and value != getattr(fresh, name):
            raise refuse(f"{path}.{key}", value, f'not allowed with kind = "{item.kind}"')
        if key != name and name != "width_rad_s" and value is not None and value >= nyquist:
            raise refuse(
                f"{path}.{key}",
                f"{value:.6g} rad/s",
                f"allowed: below the velocity loop's Nyquist frequency, {nyquist:.6g} rad/s",
            )
    if item.kind == "biquad":
        _biquad(item, path, refuse)


def _biquad(item: Filter, path: str, refuse: Refuse) -> None:
    if not 1 <= len(item.b) <= 3:
        raise refuse(f"{path}.b", f"{len(item.b)} values", "allowed: 1 to 3, b0 b1 b2")
    if not 1 <= len(item.a) <= 2:
        raise refuse(f"{path}.a", f"{len(item.a)} values", "allowed: 1 or 2, a1 a2, after a leading 1")
    if not stable_pair(*(*item.a, 0.0)[:2]):
        raise refuse(f"{path}.a", f"{list(item.a)}", "allowed: poles inside the unit circle")


def _speed_sensor(design: Design, refuse: Refuse) -> None:
    encoder, velocity = design.encoder, design.controller.velocity
    if encoder.speed != "tracking":
        if encoder.bandwidth_rad_s is not None:
            raise refuse(
                "encoder.bandwidth", f"{encoder.bandwidth_rad_s:g}", 'allowed with speed = "tracking"'
            )
        return
    if encoder.bandwidth_rad_s is None:
        raise refuse("encoder.speed", '"tracking"', 'needs encoder.bandwidth, such as bandwidth = "300 Hz"')
    period = design.controller.period_s * (velocity.every if velocity else 1)
    if encoder.bandwidth_rad_s * period >= TRACKING_LIMIT:
        raise refuse(
            "encoder.bandwidth",
            f"{encoder.bandwidth_rad_s:.6g} rad/s",
            f"too fast for its period of {period:g} s; allowed: below {TRACKING_LIMIT / period:.6g} rad/s",
        )


def _anti_windup(design: Design, refuse: Refuse) -> None:
    for name in ("velocity", "current"):
        loop = getattr(design.controller, name)
        if loop is None:
            continue
        if loop.tracking_time_s is not None and loop.anti_windup != "back-calculation":
            raise refuse(
                f"control.{name}.tracking_time",
                f"{loop.tracking_time_s:g} s",
                'allowed with anti_windup = "back-calculation"',
            )
        if loop.anti_windup != "conditional" and loop.integral_time_s is None:
            raise refuse(f"control.{name}.anti_windup", f'"{loop.anti_windup}"', "needs integral_time")


def _position(design: Design, refuse: Refuse) -> None:
    position = design.controller.position
    if position is None or design.controller.velocity is not None:
        return
    for key in ("feedforward", "acceleration_feedforward", "friction_feedforward"):
        value = getattr(position, key)
        if value:
            raise refuse(f"control.position.{key}", f"{value:g}", "allowed: 0 without a velocity loop")


def _overload(design: Design, refuse: Refuse) -> None:
    limits = design.limits
    if limits.peak_time_s is None:
        return
    shown = f"{limits.peak_time_s:g} s"
    if design.controller.current is None:
        raise refuse("limits.peak_time", shown, "needs a current loop, [control.current]")
    if not (limits.peak_current_A < inf and limits.continuous_current_A < inf):
        raise refuse("limits.peak_time", shown, "needs limits.peak_current and limits.continuous_current")
    if limits.peak_current_A <= limits.continuous_current_A:
        raise refuse("limits.peak_time", shown, "allowed: with peak_current above continuous_current")


def _supply(design: Design, refuse: Refuse) -> None:
    supply, voltage = design.supply, design.limits.voltage_V
    if supply is None:
        return
    if not design.motor.has_electrical_dynamics:
        raise refuse("supply", "a table", "not allowed with motor.source_gain, which draws no current")
    if supply.brake_voltage_V is not None and supply.brake_voltage_V < voltage:
        raise refuse(
            "supply.brake_voltage",
            f"{supply.brake_voltage_V:g} V",
            f"allowed: at least limits.voltage = {voltage:g} V",
        )
    if supply.regenerative:
        for key, value in (("capacitance", supply.capacitance_F), ("brake_voltage", supply.brake_voltage_V)):
            if value is not None:
                raise refuse(f"supply.{key}", f"{value:g}", "allowed with regenerative = false")
    elif supply.capacitance_F is None:
        raise refuse("supply.regenerative", "false", "needs supply.capacitance, which takes the energy")


def _temperature(design: Design, refuse: Refuse) -> None:
    heat = design.temperature
    if heat is None:
        return
    if not design.motor.has_electrical_dynamics:
        raise refuse("temperature", "a table", "not allowed with motor.source_gain, which has no winding")
    resistance = 1.0 + heat.resistance_per_K * (heat.winding_degC - heat.reference_degC)
    magnet = 1.0 + heat.magnet_per_K * (heat.magnet_degC - heat.reference_degC)
    for key, value, factor in (
        ("winding", heat.winding_degC, resistance),
        ("magnet", heat.magnet_degC, magnet),
    ):
        if factor < 0.05:
            raise refuse(f"temperature.{key}", f"{value:g} degC", "R, kM and kE must keep 5 % of their value")


def _command(design: Design, refuse: Refuse) -> None:
    command, limits, ratio = design.command, design.limits, design.total_ratio
    profile = {
        "rate": command.rate_rad_s,
        "acceleration": command.acceleration_rad_s2,
        "jerk": command.jerk_rad_s3,
    }
    given = {key: value for key, value in profile.items() if value < inf}
    if given and design.controller.position is None:
        key, value = next(iter(given.items()))
        raise refuse(f"command.{key}", _written(design, key, value), "allowed with a position loop")
    for key, outer in (("acceleration", "rate"), ("jerk", "acceleration")):
        if key in given and outer not in given:
            raise refuse(f"command.{key}", _written(design, key, given[key]), f"needs command.{outer}")
    for key, limit in (("rate", limits.speed_rad_s), ("acceleration", limits.acceleration_rad_s2)):
        if key in given and given[key] * ratio > limit * (1 + 1e-9):
            name = {"rate": "speed", "acceleration": "acceleration"}[key]
            most = f"{limit / ratio:.6g} {_unit(design, key)}"
            if design.axis == "rotary":
                most += f" ({limit / ratio * (180.0 / pi):.6g} {_unit(design, key).replace('rad', 'deg')})"
            words = f"faster than limits.{name}; allowed: at most {most} at the output"
            raise refuse(f"command.{key}", _written(design, key, given[key]), words)


def _unit(design: Design, key: str) -> str:
    """SI unit of a profile's limit."""
    power = {"rate": "", "acceleration": "^2", "jerk": "^3"}[key]
    return ("m/s" if design.axis == "linear" else "rad/s") + power


def _written(design: Design, key: str, value: float) -> str:
    """A profile's limit as the file has it, else in SI."""
    parameter = design.parameters.get(f"command.{key}")
    return f"{value:.6g} {_unit(design, key)}" if parameter is None else parameter.text


def _gravity(design: Design, refuse: Refuse) -> None:
    if design.load.gravity is not None and design.axis == "linear":
        raise refuse(
            "load.gravity", "a table", "allowed on a rotary axis; a linear one takes a constant load"
        )


def _friction_map(design: Design, refuse: Refuse) -> None:
    friction = design.friction
    if not friction.points:
        return
    if friction.law != "coulomb":
        raise refuse("friction.law", f'"{friction.law}"', 'allowed with friction.point: "coulomb"')
    for key, value in (("dry_torque", friction.dry_torque_Nm), ("viscous", friction.viscous_Nms_rad)):
        if value:
            raise refuse(f"friction.{key}", f"{value:g}", "not allowed beside friction.point")
    for name, direction in (("forward", 1), ("reverse", -1)):
        speeds = [point.speed_rad_s for point in friction.map(direction)]
        if not speeds or speeds[0] != 0.0:
            raise refuse("friction.point", f"{name}", "allowed: the first point at speed 0")
        if any(speed in speeds[:k] for k, speed in enumerate(speeds)):
            raise refuse("friction.point", f"{name}", "allowed: each speed once")
        if len(speeds) > MAX_MAP_POINTS:
            raise refuse("friction.point", f"{len(speeds)} points", f"allowed: at most {MAX_MAP_POINTS}")
        last = friction.map(direction)[-2:]
        if len(last) == 2 and last[1].torque_Nm < last[0].torque_Nm:
            raise refuse(
                "friction.point", f"{name}", "allowed: not falling at the end, as the last slope continues"
            )


def _instruments(design: Design, refuse: Refuse) -> None:
    jitter, period = design.instruments.jitter_s, design.controller.period_s
    if jitter > period / 10:
        raise refuse(
            "instruments.jitter", f"{jitter:g} s", f"allowed: at most a tenth of a tick, {period / 10:g} s"
        )
