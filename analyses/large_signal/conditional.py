"""Conditional stability that a limit brings out: healthy margins, and yet a large command diverges.

A limit takes gain away, under which a loop with a lower gain margin goes unstable. The describing function of
saturation says from which amplitude in front of the limit on an oscillation grows; whether the drive gets
there is found in time, by steps of growing size. It knows nothing of anti-windup (model.md section 2), with
which the drive is safer. A voltage limit behind a current loop is taken as the command of the current U/R:
the velocity controller does not know of it and goes on integrating.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import asin, ceil, inf, isfinite, pi, sqrt
from typing import Any, Literal

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.steady import back_emf_Nms_rad, drive_gain, voltage_limit_torque_Nm
from actuator_lti.drive.wiring import wire
from actuator_lti.loops import ExactMargins, Loops, exact_margins, periodic_loop
from actuator_lti.loops.periodic import PeriodicLoop
from actuator_lti.systems.root import root
from actuator_lti.types import Floats
from analyses.motion.settling import accepted_rad, settle, step_rows
from nonlinear import LIMITERS, Rows
from nonlinear.bench.operating_motion import quiet
from nonlinear.settling.rest import MOST_WORK, Rest, judge

Ending = Literal["diverges", "keeps oscillating", "is held by a limit"]
ENDINGS: dict[str, Ending] = {
    "diverging": "diverges",
    "limit cycle": "keeps oscillating",
    "still moving": "keeps oscillating",
    "at rest": "is held by a limit",
}
SMALLEST_PART, LARGEST_PART = 0.01, 1.0  # of full deflection
LEAST_PART = 1e-6  # of full deflection, where the smallest part does not settle
STEPS = 16
CLOSE = 1e-3
ABOUT = 2.0  # times the swing without limits: what is no larger is not theirs
LASTING = 0.9  # of the error before: what falls by more dies out
OWN = tuple(name for name in LIMITERS if name != "profile")  # limits of the drive, not of its command
LOW_GAIN = 0.02  # lower gain margins below this are out of reach of any limit


@dataclass(frozen=True)
class Prediction:
    """What the describing function of a limit says of a loop with a lower gain margin."""

    point: str  # break point in front of the limit (all other loops closed)
    limit: float  # in the unit of the point
    limiter: str  # what limits there, in words, as "voltage limit as a current, U/R"
    gain_lower: float  # lower gain margin, factor (below 1)
    amplitude: float  # in front of the limit, peak, in the unit of the point; beyond it grows
    frequency_hz: float
    output_rad: float  # amplitude of the output angle that goes with it
    antiwindup: bool  # whether the controller in front stops its integral while the limit acts


@dataclass(frozen=True)
class Conditional:
    """Whether a large command makes the drive diverge."""

    margins: dict[str, ExactMargins]  # at every break point
    predictions: tuple[Prediction, ...]
    threshold_rad: float | None  # largest step that settles; ``None``: all to full deflection; 0: none
    next_rad: float | None  # smallest step tried that does not
    full_deflection_rad: float
    oscillation_hz: float | None  # of the output error, while the step at the threshold hovers there
    oscillation_rad: float | None
    limiter: str = ""  # the limit that acts longest at the end of the smallest step that does not settle
    limiter_share: float = 0.0  # of the ticks at that end
    ending: Ending | Literal[""] = ""
    end_rad: float | None = None  # half of the output's span at that end

    @property
    def diverges(self) -> bool:
        """Whether a command within full deflection does not settle."""
        return self.threshold_rad is not None

    @property
    def hidden(self) -> bool:
        """Whether the linear margins call this drive stable all the same."""
        return self.diverges and all(m.stable for m in self.margins.values())


def saturation_gain(ratio: float) -> float:
    """Describing function of saturation, of amplitude over limit; 1 up to the limit."""
    return 1.0 if ratio <= 1.0 else 2.0 / pi * (asin(1.0 / ratio) + sqrt(1.0 - 1.0 / ratio**2) / ratio)


def saturation_ratio(gain: float) -> float:
    """Amplitude over limit at which saturation has so much gain left (0 < gain <= 1)."""
    return 1.0 if gain >= 1.0 else root(lambda a: saturation_gain(a) - gain, 1.0, 4.0 / gain)


def conditional_stability(design: Design, loops: Loops) -> Conditional:
    """Look for conditional stability of sampled sliding loops: margins, describing functions, steps."""
    margins = {point: exact_margins(loops, point) for point in wire(design).points if point != "output"}
    predictions = [
        _prediction(loops, point, margins[point].gain_lower, limit, limiter)
        for point, limit, limiter in _limits(design)
        if isfinite(limit) and margins[point].stable and margins[point].gain_lower > LOW_GAIN
    ]
    design = quiet(design)
    threshold, following = step_threshold(design)
    hertz, amplitude = _hovering(design, threshold) if threshold else (None, None)
    return Conditional(
        margins=margins, predictions=tuple(one for one in predictions if one is not None),
        threshold_rad=threshold, next_rad=following,
        full_deflection_rad=design.validation.full_deflection_rad, oscillation_hz=hertz,
        oscillation_rad=amplitude, **({} if following is None else _end(design, following)),
    )  # fmt: skip


def _limits(design: Design) -> list[tuple[str, float, str]]:
    """Every limit behind a controller whose loop may have a lower gain margin: point, limit, name."""
    limits, points = design.limits, wire(design).points
    result = [("u", limits.voltage_V, "voltage limit")]
    if "i_ref" in points:
        gain, most = abs(drive_gain(design)), voltage_limit_torque_Nm(design, 0.0)
        short = most / gain if gain else inf
        name = "current limit" if limits.peak_current_A <= short else "voltage limit as a current, U/R"
        result = [("i_ref", min(limits.peak_current_A, short), name)]
    if "w_ref" in points:
        result.append(("w_ref", limits.speed_rad_s, "speed limit"))
    return result


def _prediction(loops: Loops, point: str, gain: float, limit: float, limiter: str) -> Prediction | None:
    """The limit cycle at the lower gain margin; none where the drive drifts away there."""
    ratio = saturation_ratio(gain)
    hertz = _oscillation_hz(periodic_loop(loops, point), gain)
    if hertz == 0.0:
        return None
    control = loops.design.controller
    output = gain * ratio * limit * _to_output(loops.design, point, 2.0 * pi * hertz)  # fundamental behind it
    integral = {"i_ref": control.velocity, "u": control.current}.get(point)
    stops = integral is not None and integral.integral_time_s is not None and "U/R" not in limiter
    return Prediction(point, limit, limiter, gain, ratio * limit, hertz, output, stops)


def _oscillation_hz(loop: PeriodicLoop, gain: float) -> float:
    """At which frequency a loop oscillates at a gain that brings a pole to the unit circle.

    A pole over M updates is that of M frequencies: the one at which ``gain L`` comes nearest to -1 is meant.
    """
    poles = loop.modes(gain)
    angle = abs(float(np.angle(poles[int(np.argmin(np.abs(np.abs(poles) - 1.0)))])))
    count = len(loop.systems)
    turns = 2.0 * pi * np.arange(count)
    angles = np.concatenate([turns + angle, turns[1:] - angle]) / count  # of an update
    angles = angles[angles <= pi * (1.0 + 1e-9)]
    off = np.abs(1.0 + gain * loop(np.exp(1j * angles)))
    return float(angles[int(np.argmin(off))]) / (2.0 * pi * loop.dt)


def _to_output(design: Design, point: str, omega: float) -> float:
    """Output angle per unit behind the limit at a frequency, inner loops taken as ideal."""
    motor, J, N, s = design.effective_motor, design.inertia_kgm2, design.total_ratio, 1j * omega
    if point == "w_ref":
        return 1.0 / (omega * N)
    drag, kM = design.friction.viscous(), motor.torque_constant_Nm_A or 0.0
    if point == "i_ref":  # an ideal current loop, but for what a P controller leaves of its command
        return float(abs(drive_gain(design)) / (abs(J * s + drag + back_emf_Nms_rad(design)) * omega * N))
    inertia = abs(J * s**2 + drag * s)
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V / (inertia * N)
    assert motor.resistance_ohm is not None
    assert motor.inductance_H is not None
    kE = motor.back_emf_constant_Vs_rad or 0.0
    whole = (J * s + drag) * (motor.inductance_H * s + motor.resistance_ohm) + kM * kE
    return abs(kM / (s * whole)) / N


def step_threshold(design: Design) -> tuple[float | None, float | None]:
    """Largest step (rad, output) that settles, 0: none; smallest tried that does not; None: all settle."""
    full = design.validation.full_deflection_rad
    low, high = _first_unsettled(design, full * np.geomspace(SMALLEST_PART, LARGEST_PART, STEPS), None)
    if low == 0.0:
        low, high = _first_unsettled(design, full * np.geomspace(LEAST_PART, SMALLEST_PART, STEPS), high)
    while high is not None and low > 0.0 and high - low > CLOSE * high:
        low, high = _first_unsettled(design, np.geomspace(low, high, STEPS)[:-1], high)
    return (None, None) if high is None else (low, high)


def _first_unsettled(design: Design, sizes_rad: Floats, beyond: float | None) -> tuple[float, float | None]:
    """The size before the first that does not settle (0: none), and that one, else ``beyond``."""
    low = 0.0
    for size in sizes_rad.tolist():
        if not settles(design, size):
            return low, size
        low = size
    return low, beyond


def settles(design: Design, size_rad: float) -> bool:
    """Whether no limit keeps a step from coming to rest (`nonlinear.settling.rest`), or an accepted swing.

    What moves on about as much without limits is kept going by something else (friction, counts).
    """
    rest = settle(design, 0.0, size_rad).rest
    if not _limits_of(rest) or (rest.verdict == "limit cycle" and rest.amplitude <= accepted_rad(design)):
        return True
    if rest.verdict == "still moving":  # against a limit it dies out by a constant amount a period, no share
        run = _halves(design, size_rad, 4.0 * rest.after_s).run()
        late, early = (np.abs(np.array(run.span("output_angle_rad", k)) - size_rad).max() for k in (0, 1))
        if run.ok[0] and late < LASTING * early:
            return True
    without = judge(step_rows(design, 0.0, size_rad, limits_on=False).running())
    assert without is not None  # a step that stays
    return not without.comes_to_rest and rest.amplitude <= ABOUT * without.amplitude


def _limits_of(rest: Rest) -> list[str]:
    """The drive's own limits that act in what a motion ends in."""
    return [name for name in rest.limited if name in OWN]


def _end(design: Design, size_rad: float) -> dict[str, Any]:
    """What the smallest step that does not settle ends in, and which limit acts then for how much of it."""
    rest = settle(design, 0.0, size_rad).rest
    run = _halves(design, size_rad, rest.after_s).run()
    used = run.window_limit_fraction if run.ok[0] else run.limit_fraction  # it may not get so far
    shares = {name: float(used(name)[0]) for name in _limits_of(rest)}
    limiter = max(shares, key=lambda name: shares[name])
    longest = {"limiter": limiter, "limiter_share": shares[limiter]}
    return {**longest, "ending": ENDINGS[rest.verdict], "end_rad": rest.amplitude}


def _halves(design: Design, size_rad: float, duration_s: float, most_ticks: int = 8 * MOST_WORK) -> Rows:
    """The run of a step, its halves windows."""
    rows = step_rows(design, 0.0, size_rad)
    half = ceil(0.5 * min(duration_s / design.controller.period_s, most_ticks))
    rows["ticks"] = 2 * half
    rows.window(half, 1, 0)
    return rows


def _hovering(design: Design, size_rad: float) -> tuple[float | None, float | None]:
    """Frequency and amplitude of the oscillation at the threshold, from the half waves that change least."""
    rest = settle(design, 0.0, size_rad).rest
    run = _halves(design, size_rad, rest.after_s, rest.work).trajectory()  # kept: no longer than followed
    error = run.output_angle_rad - size_rad
    error = error[np.isfinite(error)]
    crossings = np.flatnonzero(np.diff(np.signbit(error)))
    if crossings.size < 4:
        return None, None
    peaks = np.array([np.abs(error[a + 1 : b + 1]).max() for a, b in pairwise(crossings)])
    k = int(np.argmin(np.abs(np.log(peaks[1:] / peaks[:-1])))) + 1
    half = float(crossings[k + 1] - crossings[k]) * run.period_s
    return 0.5 / half, float(peaks[k])
