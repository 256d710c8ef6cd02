"""Motion that begins at rest under a command, or from a deviation that the drive is let go from.

From rest dry friction has no small-signal gain: a sine is compared with the sliding loop, which cannot hold,
and with the describing function at the speed that was seen. Margins by amplitude, with dry friction and
without: let go from a part of its full range, limits acting, at which gain or delay does an oscillation last?
Saturation takes gain away, friction energy: it need not be the linear one. A finding, no check.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, nan

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from actuator_lti.drive.facts import passed_moment_Nm, stall_torque_Nm
from actuator_lti.drive.operating import Operating, holding_moment_Nm, level, rubs
from actuator_lti.drive.profile import command_mean
from actuator_lti.drive.wiring import wire
from actuator_lti.errors import InputError
from actuator_lti.loops.sampled import reference_to_output
from actuator_lti.systems.settling import settling_ticks, slowest_mode
from actuator_lti.types import Compared, Complexes, Floats
from analyses.large_signal.classify import limiter_fractions
from analyses.large_signal.tones import FAINT, TANH_TOLERANCE, full_range, tone
from analyses.linear.responses import response_at
from analyses.validation.places import Bench
from nonlinear import LIMITERS, Rows
from nonlinear.bench.operating_motion import OperatingMotion

NO_MOTION = 1e-3  # of the command
UPDATES = 400  # of the position loop in a window


@dataclass(frozen=True, eq=False)
class RestSweep(Compared):
    """Response from rest, one entry a frequency."""

    frequency_hz: Floats
    amplitude_rad: Floats  # shape (K,): command at the output shaft, peak
    # Shape (K,): output over command: simulated; sliding; describing function (NaN: nothing moves)
    measured: Complexes
    sliding: Complexes
    described: Complexes
    speed_rad_s: Floats  # shape (K,): amplitude of the motor speed that was seen
    stick_fraction: Floats  # shape (K,): of the last window; distortion of the motor speed
    distortion: Floats
    unsteadiness: Floats
    limiter: tuple[str, ...]  # limit that acted in the last window, or empty


def sweep_from_rest(
    design: Design, frequency_hz: npt.ArrayLike, amplitude_rad: npt.ArrayLike, settle_ticks: int
) -> RestSweep:
    """Command sines from rest, amplitudes at the output (K,), beside the describing function of friction."""
    tick_s, n = design.controller.period_s, design.controller.position_loop.every
    asked = np.atleast_1d(np.asarray(frequency_hz, dtype=float))
    if not (asked > 0.0).all() or not (asked < 0.5 / (n * tick_s)).all():
        raise InputError(f"frequency_hz: positive and below {0.5 / (n * tick_s):g} Hz (Nyquist)")
    tones = [tone(float(hz), design, UPDATES, least_cycles=2) for hz in asked]
    hertz, ticks, cycles = np.array([(t.frequency_hz, t.ticks, t.cycles) for t in tones]).T
    amplitude = np.broadcast_to(np.asarray(amplitude_rad, dtype=float), asked.shape).copy()
    rows = Rows.of(design, asked.size)
    rows["tanh_tolerance"] = TANH_TOLERANCE
    rows["ticks"] = settle_ticks + 2 * ticks + np.ceil(4 * ticks / cycles)
    rows.window(ticks, cycles)
    rows.sine("command", amplitude, hertz)
    result = rows.run()
    measured = result.phasor("output_angle_rad") / amplitude
    speed = np.abs(result.phasor("motor_speed_rad_s"))
    moving = np.abs(measured) > NO_MOTION
    expected = np.full(asked.size, np.nan, complex)
    for k in np.flatnonzero(moving & rubs(design)):
        expected[k] = _linear(design, hertz[k : k + 1], float(speed[k]))[0]
    return RestSweep(
        frequency_hz=hertz, amplitude_rad=amplitude, measured=measured, sliding=_linear(design, hertz, None),
        described=expected, speed_rad_s=speed, stick_fraction=result.window_stick_fraction,
        distortion=result.distortion("motor_speed_rad_s"),
        unsteadiness=result.unsteadiness("output_angle_rad"),
        limiter=tuple(LIMITERS[np.argmax(row)] if row.any() else "" for row in limiter_fractions(result)),
    )  # fmt: skip


def _linear(design: Design, frequency_hz: Floats, speed_rad_s: float | None) -> Complexes:
    """Command to output, seen in every tick as in the simulator; sliding, or described at a speed."""
    point = "sliding" if speed_rad_s is None else "describing-function"
    at = Operating(point=point, speed_amplitude_rad_s=speed_rad_s)  # type: ignore[arg-type]
    omega, mean = 2.0 * np.pi * frequency_hz, command_mean(design)
    response = response_at(reference_to_output(wire(design, at)), omega)
    return response if mean is None else response * mean.response(omega)


SIZES = {"small": 0.02, "medium": 0.2, "large": 1.0}  # of full deflection, speed, current
ALIVE = 0.02  # of the full range of the signal
LASTING = 0.985  # over `CYCLES`
CYCLES, CLOSE, FURTHEST = 4, 0.03, 4.0
VALUES, MOST_TICKS = 12, 150_000  # asked about a margin, and of their runs; else fewer
MOST_SETTLING = 2000  # ticks
TOO_MANY = 40_000_000  # ticks of the values asked about one margin, as where the way back takes hours


@dataclass(frozen=True)
class AmplitudeMargin:
    """Where an oscillation lasts after an initial deviation."""

    loop: str
    kind: str  # ``"gain"`` or ``"delay"``
    size: str
    part: float  # of the full deflection, speed or current
    friction_on: bool
    linear: float  # the linear margin (factor, or samples)
    value: float | None  # 1 (0): the nominal drive oscillates already; None: not up to ``furthest``
    furthest: float
    period_s: float
    limiter: str = ""  # that acts longest while it lasts, just past the value; empty where none does
    output: float = nan  # of that oscillation at the output, rad (linear axis: m); NaN without a value
    axis: str = "rotary"
    coarser: bool = False  # fewer than `VALUES` were asked: those take over `MOST_TICKS`
    too_long: bool = False  # whether none was asked, as they take over `TOO_MANY` ticks


def margins_by_amplitude(bench: Bench) -> Iterator[AmplitudeMargin]:
    """Gain and delay margins of every stable loop from small, medium and large deviations."""
    rough = rubs(bench.design) or bench.design.friction.offset_torque_Nm != 0.0
    for name, figures in bench.figures.items():
        margins = figures.margins
        if margins.stable is not True:
            continue
        asked = []
        if margins.gain_margin is not None and margins.gain_margin.ratio > 1.0:
            asked.append(("gain", margins.gain_margin.ratio, margins.gain_margin.frequency_hz))
        if margins.delay_margin is not None and margins.delay_margin.samples:
            hertz = margins.delay_margin.frequency_rad_s / (2.0 * np.pi)
            asked.append(("delay", margins.delay_margin.samples, hertz))
        for (kind, linear, hertz), size, friction_on in product(asked, SIZES, (False, True)[: 1 + rough]):
            response = _InitialConditionResponse(bench, name, kind, hertz, SIZES[size], friction_on)
            value, seen = _first(response, linear)
            found = (linear, value, FURTHEST * linear, bench.setup(name).period_s, *seen)
            about = (bench.design.axis, response.coarser, response.too_long)
            yield AmplitudeMargin(name, kind, size, SIZES[size], friction_on, *found, *about)


def _first(response: _InitialConditionResponse, linear: float) -> tuple[float | None, tuple[str, float]]:
    """The first value at which an oscillation lasts, closed in from the one before; none beyond is asked."""
    low = -1.0
    for value in _asked(response, linear):
        if (seen := response.lasting(value)) is not None:
            break
        low = value
    else:
        return None, ("", nan)
    while low >= 0.0 and value - low > CLOSE * value:
        middle = 0.5 * (low + value)
        lasting = response.lasting(middle)
        low, value, seen = (middle, value, seen) if lasting is None else (low, middle, lasting)
    return value, seen


def _asked(response: _InitialConditionResponse, linear: float) -> list[float]:
    """The drive as it is, then values from well below the linear margin to well beyond it."""
    kind = response.kind
    if response.too_long:
        return []
    if response.coarser:
        near = [linear * (1.0 + CLOSE) ** power for power in (-1, 0, 1, 3, 7, 15, 31)]
        return [0.0, linear / 4.0, *near, FURTHEST * linear]
    least = max(linear / 3.0, 1.05) if kind == "gain" else linear / 20.0
    return [1.0 if kind == "gain" else 0.0, *np.geomspace(least, FURTHEST * linear, VALUES).tolist()]


class _InitialConditionResponse:
    """Responses of one loop to an initial deviation."""

    def __init__(
        self, bench: Bench, name: str, kind: str, hertz: float, part: float, friction_on: bool
    ) -> None:
        design, closed = bench.drive, bench.figures[name].loop.plain_closed
        self.kind, self.part, self.sizes = kind, part, full_range(design)
        setup, still = bench.setup(name), OperatingMotion(0.0, 0.0, 0.0, friction_on)
        if setup.outer != design.controller.outermost:
            # The load's own torque as a constant, held: where it changes, it swings open outer loops
            held, coupling = setup.design, setup.design.coupling
            carried = holding_moment_Nm(held)
            twist = (
                0.0 if coupling is None else float(coupling.twist_rad(carried / held.ratio_behind_coupling))
            )
            extra = passed_moment_Nm(held, carried)
            still = replace(still, load_Nm=-carried, twist_rad=twist, extra_Nm=extra)
            setup = replace(setup, design=level(held))
        self.setup = replace(setup, bias=still, limits_on=True, held=False)
        tick_s = design.controller.period_s
        settling = settling_ticks(slowest_mode([closed.A]), FAINT) * self.setup.hold_ticks
        settling = ceil(min(settling, MOST_SETTLING))
        travel, cycle = ceil(1.3 * _travel_s(design, name, part) / tick_s), 1.0 / (hertz * tick_s)
        whole = travel + max(ceil(CYCLES * cycle), settling) + 2 * ceil(CYCLES * cycle)
        self.coarser = kind == "delay" and VALUES * whole > MOST_TICKS
        self.cycles = CYCLES // 2 if self.coarser else CYCLES  # of thousands of ticks each, then
        self.window, self.lasts = ceil(self.cycles * cycle), LASTING ** (self.cycles / CYCLES)
        self.wait = travel + max(self.window, settling)
        self.too_long = VALUES * (self.wait + 2 * self.window) > TOO_MANY

    def lasting(self, value: float) -> tuple[str, float] | None:
        """What limits an oscillation that lasts at a gain or delay (samples), its output; else None."""
        gain, delay = (value, 0.0) if self.kind == "gain" else (1.0, value)
        rows, outer = self.setup.rows(gain, delay), self.setup.outer
        start = {"position": "angle_start", "velocity": "speed_start", "current": "current_start"}
        scale = -self.setup.design.total_ratio if outer == "position" else 1.0
        rows[start[outer]] = scale * self.part * self.sizes[outer]
        rows["ticks"] = self.wait + 2 * self.window
        rows["tanh_tolerance"] = TANH_TOLERANCE
        rows.window(self.window, self.cycles, 0)
        result = rows.run()
        last, before = (float(np.ptp(result.span(f"probe_{self.setup.point}_before", k))) for k in (0, 1))
        voltage, sizes = self.setup.design.limits.voltage_V, self.sizes
        full = {"u": voltage, "i_ref": sizes["current"], "w_ref": sizes["velocity"]}[self.setup.point]
        if result.ok[0] and not (last > ALIVE * full and last >= self.lasts * before):
            return None
        shares = [float(result.window_limit_fraction(name)[0]) for name in LIMITERS]
        swing = 0.5 * float(np.ptp(result.span("output_angle_rad")))
        return LIMITERS[int(np.argmax(shares))] if max(shares) > 0.0 else "", swing


def _travel_s(design: Design, stage: str, part: float) -> float:
    """About how long the drive takes to come back, at its limits."""
    if stage == "current":
        return 0.0
    sizes = full_range(design)
    speeding = design.inertia_kgm2 * sizes["velocity"] / stall_torque_Nm(design)
    if stage == "velocity":
        return part * speeding
    return part * sizes["position"] * design.total_ratio / sizes["velocity"] + 2.0 * speeding
