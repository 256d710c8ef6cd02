"""Relations between the keys of the controller, its sensors and its command."""

from collections.abc import Iterator
from math import inf, pi
from operator import attrgetter
from typing import get_args

from actuator_lti.design.control import FEED_FORWARD, FILTER_KEYS, Filter, FilterPlace, stable_pair
from actuator_lti.design.fields import Field, axis_unit, fields_in
from actuator_lti.design.law import BESIDE_A_LAW, MOST_STATES, Law
from actuator_lti.design.mistakes import UNREAD, Check, Refusal, readable
from actuator_lti.design.model import Design
from actuator_lti.design.rule import Rule, as_said, value_of

MAX_FILTERS = 8  # of each place; the running drive has room for so many second-order sections
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
        for key, most, words in (("b", 3, "1 to 3, b0 b1 b2"), ("a", 2, "1 or 2, a1 a2, after a leading 1")):
            yield from readable(_biquad(item, path, key, most, words))


def _filter_key(item: Filter, field: Field, path: str, nyquist: float) -> Iterator[Refusal]:
    needed, optional = FILTER_KEYS[item.kind]
    name, value = field.attribute, getattr(item, field.attribute)
    if name in needed and value in (None, ()):
        yield path, "nothing", f'missing; a "{item.kind}" needs it'
    elif name not in needed | optional | {"kind", "on"} and value != field.default:
        yield path, value, f'not allowed with kind = "{item.kind}"'
    elif name in _BELOW_NYQUIST and value is not None and value >= nyquist:
        allowed = f"allowed: below the velocity loop's Nyquist frequency, {nyquist:.6g} rad/s"
        yield path, f"{value:.6g} rad/s", allowed


def _biquad(item: Filter, path: str, key: str, most: int, words: str) -> Iterator[Refusal]:
    values = getattr(item, key)
    if item.kind == "biquad" and len(values) > most:
        yield f"{path}.{key}", f"{len(values)} values", f"allowed: {words}"
    elif item.kind == "biquad" and most == 2 and not stable_pair(*(*values, 0.0, 0.0)[:2]):
        yield f"{path}.{key}", f"{list(values)}", "allowed: poles inside the unit circle"


def _filter_count(design: Design) -> Iterator[Refusal]:
    velocity = design.controller.velocity
    for place in get_args(FilterPlace):
        count = 0 if velocity is None else len(velocity.filters_on(place))
        if count > MAX_FILTERS:
            yield "control.velocity.filter", f"{count} on {place}", f"allowed: at most {MAX_FILTERS}"


def _tracking(design: Design) -> Iterator[Refusal]:
    encoder, w0 = design.encoder, design.encoder.bandwidth_rad_s
    most = TRACKING_LIMIT / design.controller.period_of("velocity")
    if encoder.speed == "tracking" and w0 is not None and w0 >= most:
        allowed = f"too fast for its period of {TRACKING_LIMIT / most:g} s; allowed: below {most:.6g} rad/s"
        yield "encoder.bandwidth", f"{w0:.6g} rad/s", allowed


def _windup(stage: str) -> tuple[Rule, Rule]:
    back, loop = "back-calculation", attrgetter(f"controller.{stage}")
    key, also = f"control.{stage}.anti_windup", f'allowed with anti_windup = "{back}"'
    return (
        Rule(key, "needs integral_time", lambda d: loop(d).integral_time_s is None),
        Rule(f"control.{stage}.tracking_time", also, lambda d: loop(d).anti_windup != back),
    )


def _multiples(design: Design) -> Iterator[Refusal]:
    control = design.controller
    n_v = getattr(control.velocity, "every", 1)
    n_p = getattr(control.position, "every", n_v)
    if n_p % n_v:
        yield "control.position.every", n_p, f"allowed: a multiple of control.velocity.every = {n_v}"


def _command_filter(design: Design) -> Iterator[Refusal]:
    control, filter_time_s = design.controller, design.command.filter_time_s
    period_s = control.period_of(control.outermost)
    if 0.0 < filter_time_s <= period_s / pi:
        allowed = f"allowed: 0, or above T/pi of the outermost loop, {period_s / pi:.6g} s"
        yield "command.filter_time", as_said(design, "command.filter_time"), allowed


def _slow_enough(design: Design) -> Iterator[Refusal]:
    for key, limiter in (("rate", "speed"), ("acceleration", "acceleration")):
        yield from readable(_within(design, f"command.{key}", f"limits.{limiter}"))


def _within(design: Design, path: str, limiter: str) -> Iterator[Refusal]:
    value, limit, ratio = value_of(design, path), value_of(design, limiter), design.total_ratio
    if limit * (1 + 1e-9) < value * ratio < inf:
        unit = axis_unit(design.axis, path)
        most = f"{limit / ratio:.6g} {unit}"
        if design.axis == "rotary":
            most += f" ({limit / ratio * (180.0 / pi):.6g} {unit.replace('rad', 'deg')})"
        yield path, as_said(design, path), f"faster than {limiter}; allowed: at most {most} at the output"


def _jitter(design: Design) -> Iterator[Refusal]:
    jitter, most = design.instruments.jitter_s, design.controller.period_s / 10
    if jitter > most:
        yield "instruments.jitter", f"{jitter:g} s", f"allowed: at most a tenth of a tick, {most:g} s"


_RUNS = (
    "missing; allowed: the law as it runs, A, B, C, D sampled at its stage's period; continuous is only what "
    'the continuous form takes in their place; Python samples it: with_law(..., method="tustin")'
)


def _laws(design: Design) -> Iterator[Refusal]:
    """A law of one's own: one in the drive, of matrices that fit, beside none of what it replaces."""
    control = design.controller
    named = {f"{stage}": getattr(control, stage).law for stage in control.stages}
    laws = {stage: law for stage, law in named.items() if law is not None}
    first = next(iter(laws), "")
    for stage in list(laws)[1:]:
        yield f"control.{stage}.law", "a table", f"allowed: at one stage; control.{first} has one"
    for stage, law in laws.items():
        yield from readable(_replaced(design, stage))
        yield from readable(_matrices(law, f"control.{stage}.law"))
    for check in (_own_period, _own_inputs) if laws else ():
        yield from readable(check(design, first, laws[first]))


def _own_period(design: Design, stage: str, law: Law) -> Iterator[Refusal]:
    period = design.controller.period_of(stage)
    if law.period_s is not None and abs(law.period_s - period) > 1e-9 * period:
        allowed = f"allowed: {period:.9g} s, that of its stage; a law is not resampled"
        yield f"control.{stage}.law.period", f"{law.period_s:.9g} s", allowed


def _own_inputs(design: Design, stage: str, law: Law) -> Iterator[Refusal]:
    path, velocity = f"control.{stage}.law.inputs", design.controller.velocity
    if "current" in law.inputs and not design.motor.has_electrical_dynamics:
        yield path, "current", "not allowed with motor.source_gain, which has no current"
    if "twist" in law.inputs and design.coupling is None:
        yield path, "twist", "not allowed without a coupling"
    filter_time_s = design.encoder.filter_time_s
    if "speed" in law.inputs and (filter_time_s > 0.0 or (velocity and velocity.filters_on("speed"))):
        yield path, "speed", "allowed: without encoder.filter_time and filters of the speed"
    elif stage == "velocity" and filter_time_s > 0.0:
        allowed = "not allowed beside control.velocity.law, which may have it"
        yield "encoder.filter_time", f"{filter_time_s:g} s", allowed


def _replaced(design: Design, stage: str) -> Iterator[Refusal]:
    part = getattr(design.controller, stage)
    for field in fields_in(f"control.{stage}"):
        value = getattr(part, field.attribute)
        if field.key not in BESIDE_A_LAW and value is not UNREAD and value != field.default:
            yield f"control.{stage}.{field.key}", f"{value}", f"not allowed beside control.{stage}.law"
    if getattr(part, "filters", ()):
        allowed = f"not allowed beside control.{stage}.law, which may have it"
        yield f"control.{stage}.filter", "a table", allowed


def _matrices(law: Law, path: str) -> Iterator[Refusal]:
    if law.continuous is not None and not (law.A or law.B or law.C or law.D):
        yield f"{path}.D", "", _RUNS
        return
    if (law.C or law.D) and not any((*law.C, *law.D)):
        yield f"{path}.{'D' if law.D else 'C'}", "zero", "the law gives nothing; allowed: not C and D zero"
    if law.gain == 0.0:
        yield f"{path}.gain", "0", "the law gives nothing; allowed: not 0"
    if len(law.A) > MOST_STATES:
        yield f"{path}.A", f"{len(law.A)} states", f"allowed: at most {MOST_STATES}"
    if len(law.L) not in (0, len(law.A)):
        yield f"{path}.L", f"{len(law.L)} numbers", f"allowed: {len(law.A)}, one a state"
    m = len(law.inputs)
    for place, part in (("", law), (".continuous", law.continuous)):
        for key, (shape, fits) in ({} if part is None else part.sizes(m)).items():
            if not fits:
                yield f"{path}{place}.{key}", "other sizes", f"allowed: {shape}, with {m} inputs"


CONTROL_CHECKS: tuple[Check, ...] = (
    _multiples,
    Rule("control.computing_delay", "allowed: at most 100 ticks of {d.controller.period_s:g} s",
         lambda d: d.controller.computing_delay_s > 100 * d.controller.period_s),
    _filters, _filter_count,
    Rule("encoder.bandwidth", 'allowed with speed = "tracking"', lambda d: d.encoder.speed != "tracking"),
    Rule("encoder.speed", 'needs encoder.bandwidth, such as bandwidth = "300 Hz"',
         lambda d: d.encoder.speed == "tracking" and d.encoder.bandwidth_rad_s is None),
    _tracking, *_windup("velocity"), *_windup("current"),
    *(Rule(f"control.position.{key}", "allowed: 0 without a velocity loop",
           lambda d: d.controller.velocity is None) for key in FEED_FORWARD),
    *(Rule(f"command.{key}", "allowed with a position loop", lambda d: d.controller.position is None)
      for key in ("rate", "acceleration", "jerk")),
    Rule("command.acceleration", "needs command.rate", lambda d: d.command.rate_rad_s == inf),
    Rule("command.jerk", "needs command.acceleration", lambda d: d.command.acceleration_rad_s2 == inf),
    _slow_enough, _command_filter, _laws, _jitter,
)  # fmt: skip
"""Each gives the settings that contradict each other: key, value, what is allowed."""
