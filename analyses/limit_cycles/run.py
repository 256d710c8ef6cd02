"""Predict limit cycles, start the simulator in their shape, and wait what the drive as it is ends in."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.bounds import BATCH_TICKS
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.large_signal.tones import ELASTIC, PLACES
from analyses.limit_cycles import describing
from analyses.motion.settling import Settling, noticed, settlings_of, verdict_of, waiver_of_rest
from nonlinear import Rows
from nonlinear.bench.operating_motion import without_counts

SCALES = np.geomspace(0.4, 2.5, 41)
CYCLES_WATCHED = 24
AS_PREDICTED = 1.25  # a factor: a describing function knows the fundamental alone
_STARTS = {**PLACES, **ELASTIC}


@dataclass(frozen=True)
class Confirmation:
    """A predicted cycle against the simulator, started in its shape at several sizes."""

    cycle: describing.Cycle
    # Amplitude of the output over the predicted one: of a stable cycle where the motion ends, of an unstable
    # one the size from which it grows; ``None``: it does so nowhere
    ratio: float | None
    frequency_hz: float | None  # there; of a stable cycle in the second half of what is watched
    tried: bool = True  # whether the simulator could watch it: so many periods may take too many ticks

    @property
    def verdict(self) -> Literal["confirmed", "refuted", "not tried"]:
        """Whether amplitude and frequency are within `AS_PREDICTED` of the predicted."""
        if not self.tried:
            return "not tried"
        ratios = (self.ratio, self.frequency_hz and self.frequency_hz / self.cycle.frequency_hz)
        near = [one is not None and 1.0 / AS_PREDICTED <= one <= AS_PREDICTED for one in ratios]
        return "confirmed" if all(near) else "refuted"


@dataclass(frozen=True)
class LimitCycles:
    """Cycles of one design."""

    design: Design
    confirmations: tuple[Confirmation, ...]  # every predicted cycle
    # Steps of several sizes, without load and at every load of the design, waited for
    rests: tuple[Settling, ...]
    looked_for: tuple[str, ...]  # the causes that the design has

    @property
    def hunting(self) -> Settling | None:
        """The largest motion of a step of the drive as it is that does not come to rest; None: all do."""
        return noticed(self.design, self.rests)

    @property
    def verdict(self) -> Verdict:
        """Whether every step of the drive as it is ends at rest, or in a swing that a requirement accepts."""
        waived = waiver_of_rest(self.design) is not None
        return Tally.of([verdict_of(self.design, self.hunting)], [waived]).verdict


def limit_cycles(design: Design) -> LimitCycles:
    """Limit cycles of play and of quantisation, and what steps of the drive as it is end in.

    Cycles of play are predicted without dry friction and with it; those of dry friction alone are
    `analyses.friction_effects`.

    Raises `InputError`: for a drive without a position loop.

    >>> from actuator_lti.design import load_design
    >>> limit_cycles(load_design("fin")).looked_for
    ('play', 'quantisation')
    """
    if design.controller.position is None:
        raise InputError("cycles: needs a drive with a position loop")
    has_play = design.coupling is not None and design.coupling.play_rad > 0.0
    predicted = [one for rubs in (False, True) for one in describing.cycles_of_play(design, friction=rubs)]
    predicted += describing.cycles_of_quantisation(design)
    sensors = [cause for cause in describing.SENSORS if describing.counts_matter(design, cause)]
    looked_for = (*["play"] * has_play, *sensors)
    confirmed = tuple(confirm(design, cycle) for cycle in predicted)
    return LimitCycles(design, confirmed, settlings_of(design), looked_for)


def confirm(design: Design, cycle: describing.Cycle) -> Confirmation:
    """Start in the cycle's shape at many sizes; find where motion turns from growing to dying out, or back.

    Of several such sizes the one nearest to the predicted counts.
    """
    tried = _tried(design, cycle)
    period = 1.0 / (cycle.frequency_hz * design.controller.period_s)  # ticks
    if CYCLES_WATCHED * period * len(SCALES) > BATCH_TICKS.most:
        return Confirmation(cycle, None, None, tried=False)
    rows = Rows.of(tried, len(SCALES), friction_on=cycle.with_friction, limits_on=False)
    rows["load"] = cycle.load_Nm
    # Half a count below the edge, as the mean of the sensor is; a speed made of counts has no mean: the motor
    # swings about the edge itself
    rows.step("command", -0.5 * (design.output_quantum_rad or 0.0) if cycle.cause == "quantisation" else 0.0)
    for name, value in cycle.state.items():
        if name in _STARTS and (tried.coupling is not None or name not in ELASTIC):
            rows[_STARTS[name]] = SCALES * value.real
    rows["speed_command_start"] = SCALES * _speed_command(tried, cycle)
    size = _sizes(rows, round(period), 2) / cycle.output_rad
    # What has died out, or failed, from every size is no cycle; what is large now may still fall to it
    if size.max() >= SCALES[0] and size.min() < np.inf:
        size = _sizes(rows, round(3.0 * period), CYCLES_WATCHED // 3) / cycle.output_rad
    grows = size > SCALES
    turns = np.flatnonzero((grows[1:] != grows[:-1]) & (grows[:-1] == cycle.stable))
    if not turns.size:
        return Confirmation(cycle, None, None)
    ratios = np.sqrt(SCALES[turns] * SCALES[turns + 1])
    nearest = int(np.argmin(np.abs(np.log(ratios))))
    row = rows.take(int(turns[nearest]))
    if not cycle.stable:
        row["ticks"] = round(3.0 * period)
    run = row.trajectory()
    begin = run.time_s.size // 2 if cycle.stable else 0  # what other motion the start brings is gone by then
    t, w = run.time_s[begin:-1], np.diff(run.output_angle_rad[begin:])
    up = np.flatnonzero((w[:-1] < 0.0) & (w[1:] >= 0.0))
    rising = t[up] - w[up] * (t[up + 1] - t[up]) / (w[up + 1] - w[up])
    hertz = float((len(up) - 1) / (rising[-1] - rising[0])) if len(up) > 1 else None
    return Confirmation(cycle, float(ratios[nearest]), hertz)


def _sizes(rows: Rows, window: int, count: int) -> Floats:
    """Half the span of the output in the last of so many windows, so many ticks each; inf: it failed."""
    rows.window(window, 1, 0)
    rows["ticks"] = count * window
    result = rows.run()
    low, high = result.span("output_angle_rad")
    return np.where(result.ok, 0.5 * (high - low), np.inf)


def _tried(design: Design, cycle: describing.Cycle) -> Design:
    """The drive with the one nonlinearity that the cycle is of, and friction where it is in it."""
    if cycle.cause in describing.SENSORS:
        return describing.without_nonlinearities(without_counts(design, describing.SENSORS[cycle.cause][1]))
    ideal = without_counts(design)
    if cycle.cause == "friction":
        return ideal
    return replace(ideal, friction=replace(design.friction, load_coefficient=0.0))


def _speed_command(design: Design, cycle: describing.Cycle) -> float:
    """The speed command before the start, where the drive holds one."""
    if design.controller.velocity is None:
        return 0.0
    if "hold_w_ref" in cycle.state:
        return cycle.state["hold_w_ref"].real
    angle = cycle.state["th"]
    if design.controller.position_loop.sensor == "output" and design.coupling is not None:
        angle = angle - design.ratio_to_coupling * cycle.state["twist"]
    return -design.controller.position_loop.gain * angle.real
