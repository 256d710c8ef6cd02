"""Relations between the keys of the controller, its sensors, its command and its supply."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields as part_fields
from math import inf, pi
from typing import Any

from actuator_lti.design.control import stable_pair
from actuator_lti.design.fields import FIELDS, Field, fields_in
from actuator_lti.design.law import BESIDE_A_LAW, MOST_STATES, Law
from actuator_lti.design.mistakes import Refusal
from actuator_lti.design.model import FILTER_KEYS, Design, Filter, FilterPlace
from actuator_lti.design.unread import UNREAD, readable

MAX_FILTERS = 8  # of each place; the running drive has room for so many second-order sections
MAX_MAP_POINTS = 16  # of each direction
_BELOW_NYQUIST = ("frequency_rad_s", "zero_rad_s", "pole_rad_s")
TRACKING_LIMIT = 0.828  # w0 T at which the tracking loop of model.md section 7 becomes unstable: 2 sqrt 2 - 2


def _filters(design: Design) -> Iterator[Refusal]:
    velocity = design.controller.velocity
    if velocity is None:
        return
    nyquist = pi / (velocity.every * design.controller.period_s)
    for number, item in enumerate(velocity.filters, 1):
        path = f"control.velocity.filter.{number}"
        for field in fields_in("control.velocity.filter.*"):
            yield from readable(_filter_key(item, field, f"{path}.{field.key}", nyquist))
        yield from readable(_numerator(item, path))
        yield from readable(_denominator(item, path))


def _filter_count(design: Design) -> Iterator[Refusal]:
    velocity = design.controller.velocity
    if velocity is None:
        return
    places: tuple[FilterPlace, ...] = ("torque", "speed")
    for place in places:
        count = len(velocity.filters_on(place))
        if count > MAX_FILTERS:
            yield "control.velocity.filter", f"{count} on {place}", f"allowed: at most {MAX_FILTERS}"


def _filter_key(item: Filter, field: Field, path: str, nyquist: float) -> Iterator[Refusal]:
    needed, optional = FILTER_KEYS[item.kind]
    name, value = field.attribute, getattr(item, field.attribute)
    if name in ("kind", "on"):
        return
    if name in needed and value in (None, ()):
        yield path, "nothing", f'missing; a "{item.kind}" needs it'
    elif name not in needed | optional and value != getattr(Filter(kind=item.kind), name):
        yield path, value, f'not allowed with kind = "{item.kind}"'
    elif name in _BELOW_NYQUIST and value is not None and value >= nyquist:
        allowed = f"allowed: below the velocity loop's Nyquist frequency, {nyquist:.6g} rad/s"
        yield path, f"{value:.6g} rad/s", allowed


def _numerator(item: Filter, path: str) -> Iterator[Refusal]:
    if item.kind == "biquad" and len(item.b) > 3:
        yield f"{path}.b", f"{len(item.b)} values", "allowed: 1 to 3, b0 b1 b2"


def _denominator(item: Filter, path: str) -> Iterator[Refusal]:
    if item.kind != "biquad":
        return
    if len(item.a) > 2:
        yield f"{path}.a", f"{len(item.a)} values", "allowed: 1 or 2, a1 a2, after a leading 1"
    elif not stable_pair(*(*item.a, 0.0, 0.0)[:2]):
        yield f"{path}.a", f"{list(item.a)}", "allowed: poles inside the unit circle"


def _speed_sensor(design: Design) -> Iterator[Refusal]:
    encoder, velocity = design.encoder, design.controller.velocity
    w0 = encoder.bandwidth_rad_s
    most = TRACKING_LIMIT / (design.controller.period_s * (velocity.every if velocity else 1))
    if encoder.speed != "tracking" and w0 is not None:
        yield "encoder.bandwidth", f"{w0:g}", 'allowed with speed = "tracking"'
    elif encoder.speed == "tracking" and w0 is None:
        yield "encoder.speed", '"tracking"', 'needs encoder.bandwidth, such as bandwidth = "300 Hz"'
    elif w0 is not None and w0 >= most:
        allowed = f"too fast for its period of {TRACKING_LIMIT / most:g} s; allowed: below {most:.6g} rad/s"
        yield "encoder.bandwidth", f"{w0:.6g} rad/s", allowed


def _anti_windup(design: Design) -> Iterator[Refusal]:
    for name in ("velocity", "current"):
        loop, path = getattr(design.controller, name), f"control.{name}"
        if loop is not None and loop.tracking_time_s is not None and loop.anti_windup != "back-calculation":
            allowed = 'allowed with anti_windup = "back-calculation"'
            yield f"{path}.tracking_time", f"{loop.tracking_time_s:g} s", allowed


def _windup(design: Design) -> Iterator[Refusal]:
    for name in ("velocity", "current"):
        loop = getattr(design.controller, name)
        if loop is not None and loop.integral_time_s is None and loop.anti_windup != "conditional":
            yield f"control.{name}.anti_windup", f'"{loop.anti_windup}"', "needs integral_time"


def _position(design: Design) -> Iterator[Refusal]:
    position = design.controller.position
    if position is not None and design.controller.velocity is None:
        for key in ("feedforward", "acceleration_feedforward", "friction_feedforward"):
            value = getattr(position, key)
            if value is not UNREAD and value:
                yield f"control.position.{key}", f"{value:g}", "allowed: 0 without a velocity loop"


def _overload(design: Design) -> Iterator[Refusal]:
    limits = design.limits
    if limits.peak_time_s is None:
        return
    path, given = "limits.peak_time", f"{limits.peak_time_s:g} s"
    peak, continuous = limits.peak_current_A, limits.continuous_current_A
    if design.controller.current is None:
        yield path, given, "needs a current loop, [control.current]"
    if peak == inf or continuous == inf:
        yield path, given, "needs limits.peak_current and limits.continuous_current"
    if peak <= continuous < inf:
        yield path, given, "allowed: with peak_current above continuous_current"


def _supply(design: Design) -> Iterator[Refusal]:
    if design.supply is not None and not design.motor.has_electrical_dynamics:
        yield "supply", "a table", "not allowed with motor.source_gain, which draws no current"


def _brake(design: Design) -> Iterator[Refusal]:
    brake = None if design.supply is None else design.supply.brake_voltage_V
    voltage = design.limits.voltage_V
    if brake is not None and brake < voltage:
        yield "supply.brake_voltage", f"{brake:g} V", f"allowed: at least limits.voltage = {voltage:g} V"


def _regenerative(design: Design) -> Iterator[Refusal]:
    supply = design.supply
    if supply is None:
        return
    if supply.regenerative:
        for key, value in (("capacitance", supply.capacitance_F), ("brake_voltage", supply.brake_voltage_V)):
            if value is not None and value is not UNREAD:
                yield f"supply.{key}", f"{value:g}", "allowed with regenerative = false"
    elif supply.capacitance_F is None:
        yield "supply.regenerative", "false", "needs supply.capacitance, which takes the energy"


def _winding(design: Design) -> Iterator[Refusal]:
    if design.temperature is not None and not design.motor.has_electrical_dynamics:
        yield "temperature", "a table", "not allowed with motor.source_gain, which has no winding"


def check_temperature(design: Design) -> Iterator[Refusal]:
    for key in ("winding", "magnet") if design.temperature is not None else ():
        yield from readable(_hot(design.temperature, key))


def _hot(heat: Any, key: str) -> Iterator[Refusal]:
    value = getattr(heat, f"{key}_degC")
    per_K = heat.resistance_per_K if key == "winding" else heat.magnet_per_K
    if 1.0 + per_K * (value - heat.reference_degC) < 0.05:
        yield f"temperature.{key}", f"{value:g} degC", "R, kM and kE must keep 5 % of their value"


def _command_filter(design: Design) -> Iterator[Refusal]:
    """Its frequency has to lie below pi/T of the stage that takes the command."""
    control, filter_time_s = design.controller, design.command.filter_time_s
    period_s = control.period_s * getattr(getattr(control, control.outermost, None), "every", 1)
    if 0.0 < filter_time_s <= period_s / pi:
        least = f"allowed: 0, or above T/pi of the outermost loop, {period_s / pi:.6g} s"
        yield "command.filter_time", _written(design, "filter_time", filter_time_s), least


def _command(design: Design) -> Iterator[Refusal]:
    for field in fields_in("command"):
        if field.key in _PROFILE:
            value = getattr(design.command, field.attribute)
            for check in (_needed, _slow_enough):
                yield from readable(check(design, field.key, value))


# of a key of the profile: power of its unit, the key that it needs, the limit that it has to keep
_PROFILE = {"rate": ("", "", "speed"), "acceleration": ("^2", "rate", "acceleration"),
            "jerk": ("^3", "acceleration", "")}  # fmt: skip


def _needed(design: Design, key: str, value: float) -> Iterator[Refusal]:
    if value == inf:
        return
    _, outer, _ = _PROFILE[key]
    if design.controller.position is None:
        yield f"command.{key}", _written(design, key, value), "allowed with a position loop"
    if outer and getattr(design.command, FIELDS[f"command.{outer}"].attribute) == inf:
        yield f"command.{key}", _written(design, key, value), f"needs command.{outer}"


def _slow_enough(design: Design, key: str, value: float) -> Iterator[Refusal]:
    power, _, limiter = _PROFILE[key]
    limit = getattr(design.limits, f"{limiter}_rad_s{power.strip('^')}") if limiter else inf
    ratio, unit = design.total_ratio, _unit(design, key)
    if limit * (1 + 1e-9) < value * ratio < inf:
        most = f"{limit / ratio:.6g} {unit}"
        if design.axis == "rotary":
            most += f" ({limit / ratio * (180.0 / pi):.6g} {unit.replace('rad', 'deg')})"
        allowed = f"faster than limits.{limiter}; allowed: at most {most} at the output"
        yield f"command.{key}", _written(design, key, value), allowed


def _unit(design: Design, key: str) -> str:
    """SI unit of a key of the command."""
    if key not in _PROFILE:
        return "s"
    return ("m/s" if design.axis == "linear" else "rad/s") + _PROFILE[key][0]


def _written(design: Design, key: str, value: float) -> str:
    """A key of the command as the file has it, else in SI."""
    parameter = design.parameters.get(f"command.{key}")
    return f"{value:.6g} {_unit(design, key)}" if parameter is None else parameter.text


_RUNS = (
    "missing; allowed: the law as it runs, A, B, C, D sampled at its stage's period; continuous is only what "
    'the continuous form takes in their place; Python samples it: with_law(..., method="tustin")'
)


def _laws(design: Design) -> Iterator[Refusal]:
    """A law of one's own: one in the drive, of matrices that fit, beside none of what it replaces."""
    control = design.controller
    laws = [stage for stage in control.stages if getattr(control, stage).law is not None]
    for stage in laws[1:]:
        yield f"control.{stage}.law", "a table", f"allowed: at one stage; control.{laws[0]} has one"
    for stage in laws:
        yield from readable(_replaced(design, stage))
        yield from readable(_matrices(getattr(control, stage).law, f"control.{stage}.law"))
    for stage in laws[:1]:
        for check in (_own_period, _own_inputs):
            yield from readable(check(design, stage, getattr(control, stage).law))


def _own_period(design: Design, stage: str, law: Law) -> Iterator[Refusal]:
    period = design.controller.period_s * getattr(getattr(design.controller, stage), "every", 1)
    if law.period_s is not None and abs(law.period_s - period) > 1e-9 * period:
        allowed = f"allowed: {period:.9g} s, that of its stage; a law is not resampled"
        yield f"control.{stage}.law.period", f"{law.period_s:.9g} s", allowed


def _own_inputs(design: Design, stage: str, law: Law) -> Iterator[Refusal]:
    path, velocity = f"control.{stage}.law.inputs", design.controller.velocity
    if "current" in law.inputs and not design.motor.has_electrical_dynamics:
        yield path, "current", "not allowed with motor.source_gain, which has no current"
    filtered = design.encoder.filter_time_s > 0.0 or (velocity and velocity.filters_on("speed"))
    if filtered and ("speed" in law.inputs or stage == "velocity"):
        yield path, "speed", "allowed: without encoder.filter_time and filters of the speed"


def _replaced(design: Design, stage: str) -> Iterator[Refusal]:
    """Keys of the stage that its law takes the place of."""
    part = getattr(design.controller, stage)
    for field in fields_in(f"control.{stage}"):
        fresh = next(item.default for item in part_fields(part) if item.name == field.attribute)
        value = getattr(part, field.attribute)
        if field.key not in BESIDE_A_LAW and value is not UNREAD and value != fresh:
            yield f"control.{stage}.{field.key}", f"{value}", f"not allowed beside control.{stage}.law"
    if getattr(part, "filters", ()):
        allowed = f"not allowed beside control.{stage}.law, which may have it"
        yield f"control.{stage}.filter", "a table", allowed


def _matrices(law: Law, path: str) -> Iterator[Refusal]:
    """Shapes of a law's matrices, and that they give anything at all."""
    if law.continuous is not None and not (law.A or law.B or law.C or law.D):
        yield f"{path}.D", "", _RUNS
        return
    if (law.C or law.D) and not any((*law.C, *law.D)):
        yield f"{path}.{'D' if law.D else 'C'}", "zero", "the law gives nothing; allowed: not C and D zero"
    if len(law.A) > MOST_STATES:
        yield f"{path}.A", f"{len(law.A)} states", f"allowed: at most {MOST_STATES}"
    if len(law.L) not in (0, len(law.A)):
        yield f"{path}.L", f"{len(law.L)} numbers", f"allowed: {len(law.A)}, one a state"
    m = len(law.inputs)
    for place, part in (("", law), (".continuous", law.continuous)):
        for key, (shape, fits) in ({} if part is None else part.sizes(m)).items():
            if not fits:
                yield f"{path}{place}.{key}", "other sizes", f"allowed: {shape}, with {m} inputs"


def _gravity(design: Design) -> Iterator[Refusal]:
    if design.load.gravity is not None and design.axis == "linear":
        yield "load.gravity", "a table", "allowed on a rotary axis; a linear one takes a constant load"


def _friction_map(design: Design) -> Iterator[Refusal]:
    friction = design.friction
    if not friction.points:
        return
    for key, value in (("dry_torque", friction.dry_torque_Nm), ("viscous", friction.viscous_Nms_rad)):
        if value is not UNREAD and value:
            yield f"friction.{key}", f"{value:g}", "not allowed beside friction.point"
    if friction.law != "coulomb":
        yield "friction.law", f'"{friction.law}"', 'allowed with friction.point: "coulomb"'


def _friction_points(design: Design) -> Iterator[Refusal]:
    for name, direction in (("forward", 1), ("reverse", -1)) if design.friction.points else ():
        points = design.friction.map(direction)
        speeds, torques = [point.speed_rad_s for point in points], [point.torque_Nm for point in points]
        if not speeds or speeds[0] != 0.0:
            yield "friction.point", name, "allowed: the first point at speed 0"
        if any(speed in speeds[:k] for k, speed in enumerate(speeds)):
            yield "friction.point", name, "allowed: each speed once"
        if len(speeds) > MAX_MAP_POINTS:
            yield "friction.point", f"{len(speeds)} points", f"allowed: at most {MAX_MAP_POINTS}"
        if len(torques) > 1 and torques[-1] < torques[-2]:
            yield "friction.point", name, "allowed: not falling at the end, as the last slope continues"


def _instruments(design: Design) -> Iterator[Refusal]:
    jitter, most = design.instruments.jitter_s, design.controller.period_s / 10
    if jitter > most:
        yield "instruments.jitter", f"{jitter:g} s", f"allowed: at most a tenth of a tick, {most:g} s"


CONTROL_CHECKS = (
    _filters, _filter_count, _speed_sensor, _anti_windup, _windup, _position, _overload, _supply, _brake,
    _regenerative, _winding, _command, _command_filter, _laws, _gravity, _friction_map, _friction_points,
    _instruments,
)  # fmt: skip
"""Each gives the settings that contradict each other: key, value, what is allowed."""
