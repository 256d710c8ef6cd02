"""Margins at small, medium and large amplitude, with dry friction and without: the drive let go from there.

There is no operating motion: the drive is released from an initial deviation (angle, speed or current, a part
of its full range), limits act, dry friction sticks.  What is looked for is the gain or delay at which the
oscillation that follows lasts.  Saturation takes gain away, friction takes energy away: the limit found need
not be the linear one.  A finding with figures, no check.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil, nan

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from analyses.large_signal.settling_ticks import full_range, settling_ticks_of
from analyses.validation.places import Bench
from nonlinear import LIMITERS, Rows
from nonlinear.bench.operating_motion import OperatingMotion, full_torque_Nm
from nonlinear.runs.reduced import BatchResult

Floats = npt.NDArray[np.float64]
SIZES = {"small": 0.02, "medium": 0.2, "large": 1.0}  # of full deflection, speed, current
ALIVE = 0.02  # of the full range of the signal
LASTING = 0.97  # from window to window
CYCLES, VALUES, CLOSE = 8, 12, 0.03
MOST_SETTLING = 2000  # ticks


@dataclass(frozen=True)
class AmplitudeMargin:
    """Where an oscillation lasts after a release from one deviation.

    Attributes
    ----------
    loop : str
    kind : {"gain", "delay"}
    size : {"small", "medium", "large"}
    part : float
        Of the full deflection, speed or current.
    friction_on : bool
    linear : float
        The linear margin (factor, or samples).
    value : float or None
        Factor or samples; 1 (0) where the nominal drive oscillates already; ``None``: not up to ``furthest``.
    furthest : float
    period_s : float
    limiter : str
        Limit that acts longest while the oscillation lasts, just past the value; empty where none does.
    output : float
        Amplitude of that oscillation at the output, rad (m on a linear axis); NaN without a value.
    """

    loop: str
    kind: str
    size: str
    part: float
    friction_on: bool
    linear: float
    value: float | None
    furthest: float
    period_s: float
    limiter: str = ""
    output: float = nan
    axis: str = "rotary"


def margins_by_amplitude(bench: Bench) -> Iterator[AmplitudeMargin]:
    """Gain and delay margins of every stable loop from small, medium and large deviations."""
    friction = bench.design.friction
    rough = friction.dry_torque_Nm > 0.0 or friction.offset_torque_Nm != 0.0
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
        for kind, linear, hertz in asked:
            for size in SIZES:
                for friction_on in (False, True) if rough else (False,):
                    yield _released(bench, name, kind, linear, hertz, size, friction_on)


def _released(
    bench: Bench, name: str, kind: str, linear: float, hertz: float, size: str, friction_on: bool
) -> AmplitudeMargin:
    """Close in on the first value at which an oscillation lasts."""
    release = _Release(bench, name, kind, hertz, SIZES[size], friction_on)
    low = 1.0 if kind == "gain" else 0.0
    grid = np.geomspace(max(linear / 3.0, 1.05) if kind == "gain" else linear / 20.0, 4.0 * linear, VALUES)
    values = np.concatenate([[low], grid])
    value: float | None = None
    while True:
        lasts = np.flatnonzero(release.lasts(values))
        if not lasts.size:
            break
        k = int(lasts[0])
        value = float(values[k])
        if k == 0 or values[k] - values[k - 1] <= CLOSE * value:
            break
        values = np.linspace(values[k - 1], values[k], VALUES + 1)[1:]
    seen = ("", nan) if value is None else release.seen(value)
    found = (linear, value, 4.0 * linear, bench.setup(name).period_s, *seen)
    return AmplitudeMargin(name, kind, size, SIZES[size], friction_on, *found, bench.design.axis)


class _Release:
    """Runs of one loop let go from a deviation."""

    def __init__(
        self, bench: Bench, name: str, kind: str, hertz: float, part: float, friction_on: bool
    ) -> None:
        design, closed = bench.drive, bench.figures[name].loop.plain_closed
        self.kind, self.part, self.sizes = kind, part, full_range(design)
        still = OperatingMotion(0.0, 0.0, 0.0, friction_on)
        self.setup = replace(bench.setup(name), bias=still, limits_on=True, held=False)
        tick_s = design.controller.period_s
        settling = min(settling_ticks_of(closed, self.setup.hold_ticks, design.name), MOST_SETTLING)
        cycles = ceil(CYCLES / (hertz * tick_s))
        self.wait = ceil(1.3 * _travel_s(design, name, part) / tick_s) + max(cycles, settling)
        self.window = cycles

    def rows(self, values: Floats) -> Rows:
        """One run a gain, or a delay in samples."""
        gains, delays = (values, 0.0) if self.kind == "gain" else (1.0, values)
        rows = self.setup.rows(gains, delays)
        start = {"position": "angle_start", "velocity": "speed_start", "current": "current_start"}
        outer = self.setup.outer
        scale = -self.setup.design.total_ratio if outer == "position" else 1.0
        rows[start[outer]] = scale * self.part * self.sizes[outer]
        rows["ticks"] = self.wait + 2 * self.window
        rows.window(self.window, CYCLES, 0)
        return rows

    def lasts(self, values: Floats) -> npt.NDArray[np.bool_]:
        """At which values the oscillation lasts from the last window but one to the last."""
        result = self.rows(values).run()
        spans = [np.subtract(*result.span(self.setup.before, k)[::-1]) for k in (0, 1)]
        full = {
            "u": self.setup.design.limits.voltage_V,
            "i_ref": self.sizes["current"],
            "w_ref": self.sizes["velocity"],
        }[self.setup.point]
        return np.asarray(~result.ok | ((spans[0] > ALIVE * full) & (spans[0] >= LASTING * spans[1])))

    def seen(self, value: float) -> tuple[str, float]:
        """What limits the oscillation at a value, and its amplitude at the output."""
        result: BatchResult = self.rows(np.array([value])).run()
        shares = [float(result.window_limit_fraction(name)[0]) for name in LIMITERS]
        low, high = result.span("output_angle_rad")
        return LIMITERS[int(np.argmax(shares))] if max(shares) > 0.0 else "", 0.5 * float(high[0] - low[0])


def _travel_s(design: Design, stage: str, part: float) -> float:
    """About how long the drive takes to come back, at its limits."""
    if stage == "current":
        return 0.0
    sizes = full_range(design)
    speeding = design.inertia_kgm2 * sizes["velocity"] / full_torque_Nm(design)
    if stage == "velocity":
        return part * speeding
    return part * sizes["position"] * design.total_ratio / sizes["velocity"] + 2.0 * speeding
