"""What the counts of an encoder do, beside the small signals, which are measured without them.

A standing error, ripple at constant speed, a limit cycle about the edge of a count, and the amplitude from
which the loop is linear again. An angle of amplitude A about a bias d, counted in steps q, has the
fundamental ``n(A/q, d) A`` with

    n = (2 q/(pi A)) sum_k sqrt(1 - ((k + d) q/A)^2),  all k with |k + d| q < A.
"""

from dataclasses import dataclass
from functools import cache
from math import inf, pi

import numpy as np

from actuator_lti.design.model import Design, Sensor
from actuator_lti.loops import Loops
from actuator_lti.types import Floats
from analyses.large_signal.tones import full_range, settled_ticks, tone
from analyses.limit_cycles import describing
from analyses.limit_cycles.run import CycleResult, confirm
from analyses.linear.loop_figures import loop_figures
from analyses.linear.responses import response_at
from analyses.motion.settling import settle
from nonlinear import Rows
from nonlinear.bench.operating_motion import without_counts

WITHIN = 0.05  # of its value: a gain that is off by less counts as linear
RATIOS, OFFSETS = np.geomspace(0.2, 60.0, 600), np.linspace(0.0, 1.0, 21)
SPEEDS = (0.05, 0.382, 1.382, 5.1)  # counts a sample: few, and so that no pattern repeats soon
PART = 0.3  # of the drive's speed: no faster is looked at
SAMPLES = 2000  # of a window at constant speed
UPDATES = 400  # of the position loop in a window of a sine
SETTLED = 1e-4  # of what begins at rest is left by then: far below `WITHIN`
TRIED = np.array([0.1, 0.3, 1.0, 2.0, 4.0, 16.0, 64.0, 256.0])  # of the amplitude from which it is linear


@dataclass(frozen=True)
class Counts:
    """What the counts of one encoder do."""

    sensor: Sensor
    quantum_rad: float  # one count, at the sensor's shaft
    standing_rad: float  # error of the output that its own count may leave; the motor's leaves none
    standing_simulated_rad: float  # what a step ends with, less what it ends with without counts
    speed_step_rad_s: float | None  # by which a speed made of counts jumps (motor side), if it is
    ripple_rad_s: float  # largest (peak) that counts add to a constant speed of the motor; which
    ripple_at_rad_s: float
    cycles: tuple[CycleResult, ...]  # predicted limit cycles, each with what the simulator says of it
    linear_rad: float  # at the sensor, from which the gain of counts is 1 within 5 %, about any bias
    # Smallest amplitude tried from which the response to the command, at the bandwidth, is off by less than 5
    # % in the simulator: more, where counts shake the drive. ``None``: none up to 256 times as much, or the
    # drive is unstable without friction
    linear_simulated_rad: float | None
    off: Floats  # what that response is off by (relative) at `TRIED` times ``linear_rad``


def counted_gain(ratio: float, offset: float = 0.0) -> float:
    """Gain of counts for a sine of amplitude ``ratio`` counts, ``offset`` counts off an edge."""
    edges = np.arange(np.ceil(-ratio - offset), np.floor(ratio - offset) + 1.0) + offset
    inside = np.abs(edges) < ratio
    return float(2.0 / (pi * ratio) * np.sqrt(1.0 - (edges[inside] / ratio) ** 2).sum())


@cache
def linear_ratio() -> float:
    """Amplitude in counts from which the gain is 1 to `WITHIN`, whatever the bias."""
    ratio = float(RATIOS[-1])
    for smaller in RATIOS[::-1]:
        if any(abs(counted_gain(smaller, d) - 1.0) > WITHIN for d in OFFSETS):
            break
        ratio = float(smaller)
    return ratio


def counts_of(design: Design, loops: Loops) -> tuple[Counts, ...]:
    """Look at every encoder whose counts a loop sees, of a position drive of these sampled, sliding loops."""
    causes = (cause for cause in reversed(describing.SENSORS) if describing.counts_matter(design, cause))
    return tuple(_counts(design, loops, cause) for cause in causes)


def _counts(design: Design, loops: Loops, cause: describing.Cause) -> Counts:
    sensor, other = describing.SENSORS[cause]
    quantum, velocity = describing.quantum_of(design, cause) or 0.0, design.controller.velocity
    to_motor = design.total_ratio if sensor == "output" else 1.0
    to_output = design.total_ratio if sensor == "motor" else 1.0
    alone, ideal = without_counts(design, other), without_counts(design)
    ripple, at = _ripple(alone, ideal, quantum * to_motor, settled_ticks(loops))
    linear = linear_ratio() * quantum
    off = _linearity(alone, ideal, loops, linear / to_output)
    good = np.logical_and.accumulate((off <= WITHIN)[::-1])[::-1]  # here and at all that is larger
    made_of = velocity is not None and velocity.sensor == sensor and design.encoder.speed == "difference"
    step = min(design.validation.amplitude_fractions) * design.validation.full_deflection_rad
    counted, smooth = (abs(settle(one, 0.0, step).rest.error) for one in (alone, ideal))
    return Counts(
        sensor=sensor,
        quantum_rad=quantum,
        standing_rad=quantum if sensor == "output" else 0.0,
        standing_simulated_rad=abs(counted - smooth),
        speed_step_rad_s=quantum * to_motor / _span_s(design) if made_of else None,  # q/(m T)
        ripple_rad_s=ripple,
        ripple_at_rad_s=at,
        cycles=tuple(confirm(design, one) for one in describing.cycles_of_quantisation(design, (cause,))),
        linear_rad=linear,
        linear_simulated_rad=float(TRIED[good][0]) * linear_ratio() * quantum if good.any() else None,
        off=off,
    )


def _span_s(design: Design) -> float:
    """Time over which a speed is made of counts, or between two looks at the position."""
    control, encoder = design.controller, design.encoder
    if control.velocity is None:
        return control.position_loop.every * control.period_s
    samples = encoder.difference_samples if encoder.speed == "difference" else 1
    return samples * control.velocity.every * control.period_s


def _ripple(design: Design, ideal: Design, count_rad: float, settle_ticks: int) -> tuple[float, float]:
    """Largest ripple that counts add to the motor's speed on a ramp of the command, and its speed."""
    span = _span_s(design)
    speeds = np.minimum(np.array(SPEEDS) * count_rad / span, PART * full_range(design)["velocity"])
    window = round(SAMPLES * span / design.controller.period_s)
    found = []
    for one in (design, ideal):
        rows = Rows.of(one, speeds.size)
        rows.ramp("command", speeds / one.total_ratio)
        rows["ticks"] = settle_ticks + 2 * window
        rows.window(window, 1, 0)
        found.append(0.5 * np.ptp(rows.run().span("motor_speed_rad_s"), axis=0))
    added = found[0] - found[1]
    k = int(np.argmax(added))
    return max(float(added[k]), 0.0), float(speeds[k])


def _linearity(design: Design, ideal: Design, loops: Loops, output_rad: float) -> Floats:
    """What the response to the command is off by with counts, at `TRIED` times an amplitude of the output."""
    band = loop_figures(loops.present["position"], loops.plain_response).bandwidth
    if band is None or band.minus3db_hz is None:
        return np.full(TRIED.size, inf)
    sine = tone(band.minus3db_hz, design, UPDATES, least_cycles=8)
    gain = abs(complex(response_at(loops.plain_response, np.array([sine.omega_rad_s]))[0]))
    seen, there = [], np.ones(TRIED.size, dtype=bool)
    for one in (design, ideal):  # nothing else that is not linear: no play, no friction
        rows = Rows.of(describing.without_nonlinearities(one), TRIED.size, friction_on=False, limits_on=False)
        rows.sine("command", output_rad / gain * TRIED, sine.frequency_hz)
        rows["ticks"] = settled_ticks(loops, SETTLED) + sine.ticks
        rows.window(sine.ticks, sine.cycles)
        run = rows.run()
        seen.append(run.phasor("output_angle_rad"))
        there &= run.ok  # without friction a drive may be unstable
    return np.abs(np.divide(seen[0], seen[1], out=np.full(TRIED.size, inf, complex), where=there) - 1.0)
