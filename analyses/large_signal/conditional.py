"""Conditional stability that a limit brings out: healthy margins, and yet a large command diverges.

A loop with a lower gain margin goes unstable when gain is taken away, and a limit takes gain away.  The
describing function of saturation says at which amplitude in front of the limit so much is gone that an
oscillation keeps itself up (an unstable limit cycle: below it the oscillation dies out, above it grows).
Whether the drive gets there is found in time, by steps of growing size.

The describing function knows nothing of anti-windup: where the controller in front of the limit stops its
integral while the limit acts (model.md section 2), the drive is safer than predicted.  A voltage limit behind
a current loop is taken as the current limit U/R that it amounts to: the velocity controller does not know of
it and goes on integrating.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import asin, inf, isfinite, pi, sqrt
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from actuator_lti.design.model import Design
from actuator_lti.drive.steady import torque_gain_Nm_rad
from actuator_lti.drive.wiring import wire
from actuator_lti.errors import TooManyTicks
from actuator_lti.loops import ExactMargins, Loops, exact_margins, periodic_loop
from actuator_lti.loops.periodic import PeriodicLoop
from actuator_lti.types import Floats
from analyses.large_signal.tones import full_range
from analyses.motion.settling import accepted_rad
from nonlinear import LIMITERS, Rows
from nonlinear.bench.operating_motion import lasting_torque_Nm, quiet

Ending = Literal["diverges", "keeps oscillating", "is held by a limit"]
SMALLEST_PART, LARGEST_PART = 0.01, 1.0  # of full deflection
LEAST_PART = 1e-6  # of full deflection, where the smallest part does not settle
STEPS = 16
CLOSE = 1e-3
CONVERGED = 0.05  # error left, relative to the step
LASTING = 0.9  # error of the last window over that of the one before
RESTING = 1e-3  # of the step: the output moves by less in the last window
HELD = 0.5  # of the last window: a limit that acts longer holds the drive
GROWS = 1.2  # from window to window
OWN = tuple(name for name in LIMITERS if name != "profile")  # limits of the drive, not of its command
AGAIN = (1, 4, 16)  # times the wait
WINDOWS = 20.0  # time constants of the loop that are waited for, beside the travel
SETTLED = 14.0  # time constants in the settling ticks
LONGEST_TICKS = 40_000_000  # of a run
LOW_GAIN = 0.02  # lower gain margins below this are out of reach of any limit


@dataclass(frozen=True)
class Prediction:
    """What the describing function of a limit says of a loop with a lower gain margin."""

    point: str  # break point in front of the limit (all other loops closed)
    limit: float  # in the unit of the point
    # What limits there: ``"current limit"``, ``"voltage limit"``, ``"voltage limit as a current, U/R"``
    limiter: str
    gain_lower: float  # lower gain margin, factor (below 1)
    # In front of the limit, peak, in the unit of the point: the border between dying out and growing
    amplitude: float
    frequency_hz: float
    output_rad: float  # amplitude of the output angle that goes with it
    antiwindup: bool  # whether the controller in front stops its integral while the limit acts


@dataclass(frozen=True)
class Conditional:
    """Whether a large command makes the drive diverge."""

    margins: dict[str, ExactMargins]  # at every break point
    predictions: tuple[Prediction, ...]
    # Largest step of the output that still settles; ``None`` where all steps up to full deflection do, 0
    # where not even the smallest tried does
    threshold_rad: float | None
    next_rad: float | None  # smallest step tried that does not; it has been watched for four times as long
    full_deflection_rad: float
    # Frequency, and amplitude of the output error, while the step at the threshold hovers there
    oscillation_hz: float | None
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
    if ratio <= 1.0:
        return 1.0
    return 2.0 / pi * (asin(1.0 / ratio) + sqrt(1.0 - 1.0 / ratio**2) / ratio)


def saturation_ratio(gain: float) -> float:
    """Amplitude over limit at which saturation has so much gain left (0 < gain <= 1)."""
    return 1.0 if gain >= 1.0 else float(brentq(lambda a: saturation_gain(a) - gain, 1.0, 4.0 / gain))


def conditional_stability(design: Design, loops: Loops, settle_ticks: int) -> Conditional:
    """Look for conditional stability: by margins, by describing functions, and by steps in time.

    ``loops`` are sampled and sliding; in ``settle_ticks`` the linear drive settles.
    """
    margins = {point: exact_margins(loops, point) for point in wire(design).points if point != "output"}
    predictions = [
        _prediction(loops, point, margins[point].gain_lower, limit, limiter)
        for point, limit, limiter in _limits(design)
        if isfinite(limit) and margins[point].stable and margins[point].gain_lower > LOW_GAIN
    ]
    design = quiet(design)
    threshold, following = step_threshold(design, settle_ticks)
    hertz, amplitude = _hovering(design, threshold, settle_ticks) if threshold else (None, None)
    return Conditional(
        margins=margins,
        predictions=tuple(one for one in predictions if one is not None),
        threshold_rad=threshold,
        next_rad=following,
        full_deflection_rad=design.validation.full_deflection_rad,
        oscillation_hz=hertz,
        oscillation_rad=amplitude,
        **({} if following is None else _end(design, following, settle_ticks)),
    )


def _limits(design: Design) -> list[tuple[str, float, str]]:
    """Every limit behind a controller whose loop may have a lower gain margin: point, limit, name."""
    limits, points = design.limits, wire(design).points
    result = [("u", limits.voltage_V, "voltage limit")]
    if "i_ref" in points:
        short = limits.voltage_V / (design.effective_motor.resistance_ohm or 1.0)
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
    inertia = abs(J * s**2 + drag * s)
    if point == "i_ref":
        return kM / (inertia * N)
    if motor.source_gain_Nm_V is not None:
        return motor.source_gain_Nm_V / (inertia * N)
    assert motor.resistance_ohm is not None
    assert motor.inductance_H is not None
    kE = motor.back_emf_constant_Vs_rad or 0.0
    whole = (J * s + drag) * (motor.inductance_H * s + motor.resistance_ohm) + kM * kE
    return abs(kM / (s * whole)) / N


def step_threshold(design: Design, settle_ticks: int) -> tuple[float | None, float | None]:
    """Largest step (rad, output) that settles and smallest tried that does not, up to full deflection.

    A step that does not settle is run again for longer before it is believed; where it settles then, all are
    given that time.
    """
    for longer in AGAIN:
        low, high = _bisected(design, settle_ticks, longer)
        if high is None:
            break
        if not settles(design, np.array([high]), settle_ticks, AGAIN[1] * longer)[0]:
            return low, high
    return None, None


def _bisected(design: Design, settle_ticks: int, longer: int) -> tuple[float | None, float | None]:
    """The threshold with one time to settle; 0 where not even the smallest step tried settles."""
    full = design.validation.full_deflection_rad
    sizes = full * np.geomspace(SMALLEST_PART, LARGEST_PART, STEPS)
    low, high, least = 0.0, None, SMALLEST_PART
    while True:
        bad = np.flatnonzero(~settles(design, sizes, settle_ticks, longer))
        if not bad.size:
            if high is None:
                return None, None
            low = float(sizes[-1])
        else:
            k = int(bad[0])
            low, high = (float(sizes[k - 1]) if k else low), float(sizes[k])
        if low == 0.0 and least > LEAST_PART:
            sizes, least = full * np.geomspace(LEAST_PART, SMALLEST_PART, STEPS), LEAST_PART
            continue
        if low == 0.0 or high - low < CLOSE * high:
            return low, high
        sizes = np.geomspace(low, high, STEPS + 2)[1:-1]


def settles(design: Design, sizes_rad: Floats, settle_ticks: int, longer: int = 1) -> npt.NDArray[np.bool_]:
    """Which steps from rest settle: the error left is small, or still falls, or the drive has come to rest.

    Small is a share of the step, what friction holds up, and the swing that a requirement accepts.

    An error larger than the step itself does not count as falling: an irregular swing against a limit has a
    smaller window now and then.

    A controller without an integral comes to rest beside its target where the load has a slope; a drive that
    stands because a limit holds it has not settled.  What goes on moving without growing while no limit acts
    is kept going by something else (`nonlinear.settling.rest`).  A swing against a limit dies out by a
    constant amount
    a period, not by a share of itself: only windows of many periods (``longer``) tell it from one that stays.

    Raises `TooManyTicks`: where one run would take more than `LONGEST_TICKS`.
    """
    rows = step_rows(design, sizes_rad, settle_ticks, longer)
    if rows["ticks"].max() > LONGEST_TICKS:
        raise TooManyTicks(f"a step of {int(rows['ticks'].max())} ticks: at most {LONGEST_TICKS} are run")
    result = rows.run()
    spans = [result.span("output_angle_rad", last) for last in (0, 1)]
    errors = [np.abs(np.array(span) - sizes_rad).max(axis=0) for span in spans]
    near = errors[0] <= np.maximum(CONVERGED * sizes_rad, _standing(design) + accepted_rad(design))
    rests = np.ptp(spans[0], axis=0) <= RESTING * sizes_rad
    limited = np.max([result.window_limit_fraction(name) for name in OWN], axis=0)
    held = rests & (limited > HELD)
    alone = (limited == 0.0) & (errors[0] < GROWS * errors[1])
    falls = (errors[0] < LASTING * errors[1]) & (errors[0] < sizes_rad)
    return np.asarray(result.ok & ~held & (near | rests | alone | falls))


def _standing(design: Design) -> float:
    """Error (output, rad) that dry friction can hold up against a controller without integral."""
    velocity, friction, behind = design.controller.velocity, design.friction, design.load.friction
    gain = abs(float(torque_gain_Nm_rad(design)))
    if gain == 0.0:
        return inf
    if velocity is not None and velocity.integral_time_s is not None:
        gain *= 10.0  # the integral brings it on in time
    dry = friction.dry_Nm(0.0) * friction.breakaway_ratio + abs(friction.offset_torque_Nm)
    dry += max((point.torque_Nm for point in friction.points), default=0.0)
    dry += 0.0 if behind is None else behind.dry_torque_Nm / design.ratio_to_coupling
    play = 0.0 if design.coupling is None else design.coupling.play_rad / design.ratio_behind_coupling
    return 2.0 * dry / gain + play


def step_rows(design: Design, sizes_rad: Floats, settle_ticks: int, longer: int = 1) -> Rows:
    """Runs of steps from rest, long enough to travel and to settle, with windows ``longer`` times as long."""
    rows = Rows.of(design, sizes_rad.size)
    way, tick_s = sizes_rad * design.total_ratio, design.controller.period_s
    asked, ratio = design.command, design.total_ratio  # a profile may be slower than the drive
    speed = min(full_range(design)["velocity"], asked.rate_rad_s * ratio)
    speeding = min(lasting_torque_Nm(design) / design.inertia_kgm2, asked.acceleration_rad_s2 * ratio)
    travel = way / (speed * tick_s)
    swing = 4.0 * (np.sqrt(2.0 * way / speeding) + np.cbrt(way / (asked.jerk_rad_s3 * ratio))) / tick_s
    window = np.ceil(longer * np.maximum(0.25 * WINDOWS * max(settle_ticks / SETTLED, 1.0), swing))
    rows["ticks"] = np.ceil(2.0 * travel) + 4 * window
    rows.window(window, 1, 0)
    rows.step("command", sizes_rad)
    return rows


def _end(design: Design, size_rad: float, settle_ticks: int) -> dict[str, Any]:
    """Watch the smallest step that does not settle for longer: what it ends in, and which limit acts then."""
    result = step_rows(design, np.array([size_rad]), settle_ticks, AGAIN[1]).run()
    spans = [float(np.ptp(result.span("output_angle_rad", last))) for last in (0, 1)]
    used = result.window_limit_fraction if result.ok[0] else result.limit_fraction  # it may not get so far
    shares = {name: float(used(name)[0]) for name in OWN}
    limiter = max(shares, key=lambda name: shares[name])
    ending: Ending = "keeps oscillating"
    if not result.ok[0] or spans[0] > GROWS * spans[1]:
        ending = "diverges"
    elif spans[0] <= RESTING * size_rad:
        ending = "is held by a limit"
    share = shares[limiter]
    named = limiter if share > 0.0 else ""
    return {"limiter": named, "limiter_share": share, "ending": ending, "end_rad": 0.5 * spans[0]}


def _hovering(design: Design, size_rad: float, settle_ticks: int) -> tuple[float | None, float | None]:
    """Frequency and amplitude of the oscillation at the threshold, from the half waves that change least."""
    run = step_rows(design, np.array([size_rad]), settle_ticks).trajectory()
    error = run.output_angle_rad - size_rad
    error = error[np.isfinite(error)]
    crossings = np.flatnonzero(np.diff(np.signbit(error)))
    if crossings.size < 4:
        return None, None
    peaks = np.array([np.abs(error[a + 1 : b + 1]).max() for a, b in pairwise(crossings)])
    k = int(np.argmin(np.abs(np.log(peaks[1:] / peaks[:-1])))) + 1
    half = float(crossings[k + 1] - crossings[k]) * run.period_s
    return 0.5 / half, float(peaks[k])
