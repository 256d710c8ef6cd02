"""Predict limit cycles, start the simulator in their shape, and wait what the drive as it is ends in."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, inf
from typing import Literal

import numpy as np

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.bounds import BATCH_TICKS
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.loops import assemble_loops
from actuator_lti.types import Floats
from analyses.large_signal.tones import ELASTIC, PLACES, settled_ticks
from analyses.limit_cycles import describing
from analyses.motion.settling import Settling, noticed, settlings_of, verdict_of, waiver_of_rest
from nonlinear import Rows
from nonlinear.bench.operating_motion import without_counts
from nonlinear.runs.running import Running
from nonlinear.settling.rest import MOST_WORK, judge

SCALES = np.geomspace(0.4, 2.5, 41)
CYCLES_WATCHED = 24
MOMENTS = 2000  # of a period, between which the output is as good as straight
AS_PREDICTED = 1.25  # a factor: a describing function knows the fundamental alone
_STARTS = {**PLACES, **ELASTIC}


@dataclass(frozen=True)
class CycleResult:
    """A predicted cycle against the simulator, started in its shape at several sizes."""

    cycle: describing.Cycle
    # Amplitude of the output, or where it stands of the motor, over the predicted one: of a stable cycle
    # where the motion ends, of an unstable one the size from which it grows; ``None``: it does so nowhere
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
    cycles: tuple[CycleResult, ...]  # every predicted cycle
    settlings: tuple[Settling, ...]  # of steps of several sizes, with every load
    looked_for: tuple[str, ...]  # the causes that the design has

    @property
    def hunting(self) -> Settling | None:
        """The largest motion of a step of the drive as it is that does not come to rest; None: all do."""
        return noticed(self.design, self.settlings)

    @property
    def verdict(self) -> Verdict:
        """Whether every step of the drive as it is ends at rest, or in a swing that a requirement accepts."""
        waived = waiver_of_rest(self.design) is not None
        return Tally.of([verdict_of(self.design, self.hunting)], [waived]).verdict


def limit_cycles(design: AnyDesign) -> LimitCycles:
    """Limit cycles of play and of quantisation, and what its step responses end in.

    Cycles of play are predicted without dry friction and with it; those of dry friction alone are
    `analyses.friction_effects`.

    Raises `InputError`: for a drive without a position loop.

    >>> from actuator_lti.design import load_design
    >>> limit_cycles(load_design("fin")).looked_for
    ('play', 'quantisation')
    """
    design = as_design(design)
    if design.controller.position is None:
        raise InputError("limit cycles: need a drive with a position loop")
    has_play = design.coupling is not None and design.coupling.play_rad > 0.0
    predicted = [one for rubs in (False, True) for one in describing.cycles_of_play(design, friction=rubs)]
    predicted += describing.cycles_of_quantisation(design)
    sensors = [cause for cause in describing.SENSORS if describing.counts_matter(design, cause)]
    looked_for = (*["play"] * has_play, *sensors)
    confirmed = tuple(confirm(design, cycle) for cycle in predicted)
    return LimitCycles(design, confirmed, settlings_of(design), looked_for)


def confirm(design: Design, cycle: describing.Cycle) -> CycleResult:
    """Start in the cycle's shape at many sizes; find the nearest at which motion begins to grow or die."""
    tried = _tried(design, cycle)
    period = 1.0 / (cycle.frequency_hz * design.controller.period_s)  # ticks
    if CYCLES_WATCHED * period * len(SCALES) > BATCH_TICKS.most:
        return CycleResult(cycle, None, None, tried=False)
    rows = Rows.of(tried, len(SCALES), friction_on=cycle.with_friction, limits_on=False)
    rows["load"] = cycle.load_Nm
    # Half a count below the edge, as the mean of the sensor is; a speed made of counts has no mean: the motor
    # swings about the edge itself
    rows.step("command", -0.5 * (design.output_quantum_rad or 0.0) if cycle.cause == "quantisation" else 0.0)
    # At the moment at which the states that begin at zero all the same have least
    left = np.array([value for name, value in cycle.state.items() if name not in _STARTS and value])
    turned = np.exp(0.5j * (np.pi - np.angle(((left / np.abs(left)) ** 2).sum() or -1.0)))
    cycle = replace(cycle, state={name: turned * value for name, value in cycle.state.items()})
    for name, value in cycle.state.items():
        if name in _STARTS and (tried.coupling is not None or name not in ELASTIC):
            rows[_STARTS[name]] = SCALES * value.real
    rows["speed_command_start"] = SCALES * _speed_command(tried, cycle)
    watched = CYCLES_WATCHED // 3
    if cycle.cause in describing.SENSORS:  # the start's counts push it off the edge, to which it comes back
        part = min(cycle.inner_rad / (describing.quantum_of(design, cycle.cause) or inf), 0.5)
        watched += ceil(settled_ticks(assemble_loops(tried), part) / (3.0 * period))
    turn = _turn(rows, cycle, period, watched)
    if turn is None:
        return CycleResult(cycle, None, None)
    row, ratio = rows.take(turn), float(np.sqrt(SCALES[turn] * SCALES[turn + 1]))
    row["ticks"] = (watched if cycle.stable else 1) * round(3.0 * period)
    row["record_every"] = max(int(period) // MOMENTS, 1)
    run = row.trajectory()
    begin = run.time_s.size // 2 if cycle.stable else 0  # what other motion the start brings is gone by then
    output = run.output_angle_rad[begin:]
    t, w = run.time_s[begin:-1], np.diff(output if np.ptp(output) else run.motor_angle_rad[begin:])
    up = np.flatnonzero((w[:-1] < 0.0) & (w[1:] >= 0.0))
    rising = t[up] - w[up] * (t[up + 1] - t[up]) / (w[up + 1] - w[up])
    hertz = float((len(up) - 1) / (rising[-1] - rising[0])) if len(up) > 1 else None
    return CycleResult(cycle, ratio, hertz)


def _turn(rows: Rows, cycle: describing.Cycle, period: float, watched: int) -> int | None:
    """Number of the size beyond which motion turns, of those where it does the nearest to the predicted.

    Every size is watched for two periods, and then, the nearest first, until one is found. Where friction
    holds the drive for most of a long period, the judge of rest, who leaps over that, tells what it ends in.
    """
    rows.window(round(period), 1, 0)
    drives = [rows.running(k) for k in range(len(rows))]
    slow = cycle.with_friction and CYCLES_WATCHED * period > MOST_WORK
    if not slow and cycle.cause not in describing.SENSORS:
        size = _sizes(cycle, rows, drives, round(period), 2)
        if size.max() < SCALES[0] or size.min() == np.inf:  # all died out, or failed; the large may yet fall
            return None
    watch, window = _ends if slow else _sizes, round(3.0 * period)
    grows, middle, known = np.zeros(len(rows), dtype=bool), len(rows) // 2, range(0)
    for reach in range(2, middle + 1, 2):
        near = range(middle - reach, middle + reach + 1)
        new = [k for k in near if k not in known]
        size = watch(cycle, rows.take(new), [drives[k] for k in new], window, watched)
        grows[new], known = size > SCALES[new], near
        here = grows[near]
        turns = near.start + np.flatnonzero((here[1:] != here[:-1]) & (here[:-1] == cycle.stable))
        if turns.size:
            return int(turns[np.argmin(np.abs(np.log(SCALES[turns] * SCALES[turns + 1])))])
    return None


def _ends(cycle: describing.Cycle, rows: Rows, drives: Sequence[Running], window: int, count: int) -> Floats:
    """Sizes of what motions end in, followed for no more than so many ticks of work."""
    ended = [judge(drive, count * window) for drive in drives]
    motor = np.array([0.0 if one is None else one.motor_amplitude * rows.value("ratio") for one in ended])
    output = [np.inf if one is None or one.verdict == "diverging" else one.amplitude for one in ended]
    return _over_predicted(cycle, np.array(output), motor, "th")


def _sizes(cycle: describing.Cycle, rows: Rows, drives: Sequence[Running], window: int, count: int) -> Floats:
    """Sizes in the last of so many windows, so many ticks each; inf: it failed."""
    rows["ticks"] = count * window
    for drive in drives:
        drive.change("window", window)
    result = rows.run(drives=drives)
    signals = ("output_angle_rad", "motor_speed_rad_s")
    output, motor = (0.5 * np.ptp(result.span(one), axis=0) for one in signals)
    return np.where(result.ok, _over_predicted(cycle, output, motor, "w"), np.inf)


def _over_predicted(cycle: describing.Cycle, output_rad: Floats, motor: Floats, state: str) -> Floats:
    """Half the span of the output over the predicted one; where it stands in every motion the motor's."""
    if motor.any() and not output_rad.any():
        return motor / abs(cycle.state[state])
    return output_rad / cycle.output_rad


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
