"""What a motion of a drive ends in, a step above all: one word (`nonlinear.settling.rest`) for all."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import degrees, inf, radians

import numpy as np

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.checks import CHECKS
from actuator_lti.design.model import Design, Requirement, Waiver
from actuator_lti.drive.facts import capability
from actuator_lti.drive.operating import straight
from actuator_lti.drive.profile import command_mean
from actuator_lti.drive.wiring import wire
from actuator_lti.files.reading import Tree
from actuator_lti.loops import Loops
from actuator_lti.loops.sampled import tick_system
from actuator_lti.systems.settling import settling_ticks
from actuator_lti.types import Floats
from analyses.large_signal.tones import LONGEST_TICKS, TANH_TOLERANCE, full_command
from analyses.limit_cycles.stick_slip import stick_slip_cycle
from nonlinear.rows import Rows
from nonlinear.runs.trajectory import COMMAND_UNITS, Trajectory
from nonlinear.settling.rest import MOST_WORK, Rest, judge

SMALL = 1e-3  # of full deflection: a step beside those that the design asks for
NEAR = 0.02  # of the largest value: a run that ends within it has settled
NOTICED = 1e-6  # of the largest command: a smaller swing is listed, and is rest


@dataclass(frozen=True)
class Settling:
    """A step from rest at zero, waited for."""

    # The step and the load torque, both there from the start
    amplitude_rad: float
    load_Nm: float
    rest: Rest  # what it ends in

    @property
    def hunting(self) -> bool:
        """Whether the drive does not come to rest."""
        return not self.rest.comes_to_rest

    @property
    def swing_rad(self) -> float:
        """Half the span of the output or of the motor at the output's side, whichever is larger."""
        return max(self.rest.amplitude, self.rest.motor_amplitude)

    @property
    def limit_cycle_rad(self) -> float | None:
        """The swing that it ends in: 0 at rest, inf where it diverges, ``None`` where it still moves."""
        known = {"at rest": 0.0, "diverging": inf, "still moving": None}
        return known.get(self.rest.verdict, self.swing_rad)


def settling_ticks_of(design: Design, left: float) -> float:
    """Ticks after which so much is ``left`` of the linear drive's slowest mode; inf: it is not stable.

    What passes as a drive without a position loop turns makes none unstable.
    """
    there = design if design.controller.position is not None else straight(design)
    return settling_ticks(tick_system(wire(there)).slowest, left)


TRAVELS, SWINGS, OVER = (
    3.0,
    12.0,
    1e-6,
)  # that a step is followed for; until so much of the slowest mode is left


def step_ticks(design: Design, sizes: Floats) -> Floats:
    """Ticks for which a step of the command is followed, for each size: travel, swing and the slowest mode.

    Travel at the least rate that a load of the validation or the profile of the command leaves, a swing in
    ``sqrt(size/acceleration)``; a speed is reached by the acceleration. No more than `LONGEST_TICKS`.
    """
    stage, Ts, profile = design.controller.outermost, design.controller.period_s, design.command
    known = [capability(design, load) for load in design.validation.loads_Nm]
    rate = _least(profile.rate_rad_s, *(float(one.output_rate_rad_s) for one in known))
    push = _least(profile.acceleration_rad_s2, *(float(one.acceleration_rad_s2) for one in known))
    settled, mean = settling_ticks_of(design, OVER), command_mean(design)
    ticks = np.full(np.shape(sizes), settled if settled < inf else 0.0)
    if stage == "position":
        ticks += (TRAVELS * sizes / rate + SWINGS * np.sqrt(sizes / push)) / Ts
    elif stage == "velocity":
        ticks += TRAVELS * sizes / push / Ts
    if mean is not None:
        ticks += mean.samples * design.controller.position_loop.every
    return np.minimum(np.ceil(ticks) + 1.0, LONGEST_TICKS)


def _least(*paces: float) -> float:
    """The least of those that move at all; inf without any."""
    return min((pace for pace in paces if pace > 0.0), default=inf)


def counted(rest: Rest, least: float) -> Rest:
    """What a motion ended in as it counts: a swing below the ``least`` is rest.

    It keeps its size and frequency. What stands, not known for how long, is no swing.
    """
    swings = rest.verdict in ("limit cycle", "still moving")
    small = 0.0 < max(rest.amplitude, rest.motor_amplitude) < least
    return replace(rest, verdict="at rest") if swings and small else rest


@lru_cache(maxsize=256)
def settle(design: Design, load_Nm: float, step_rad: float, *, standing: bool = False) -> Settling:
    """Step and wait, once for all who ask; the command is of the position loop.

    ``standing``: the step does not come with the load, but when the drive stands under it, if it ever does.

    >>> from actuator_lti.design import load_design
    >>> settle(load_design("ilr33-amber"), 8.0, 0.01).rest.verdict
    'at rest'
    """
    drive = step_rows(design, load_Nm, 0.0 if standing else step_rad).running()
    rest = judge(drive)
    if standing and rest is not None and rest.comes_to_rest:
        drive.run(min(round(rest.after_s / design.controller.period_s), MOST_WORK))
        drive.command(step_rad)
        rest = judge(drive)
    assert rest is not None  # a step and a load that stay
    return Settling(step_rad, load_Nm, rest)


def step_rows(design: Design, load_Nm: float, step_rad: float, *, limits_on: bool = True) -> Rows:
    """A step of the command from rest at zero, under a load that is there from the start; one run."""
    rows = Rows.of(design, limits_on=limits_on)
    rows["load"], rows["tanh_tolerance"] = load_Nm, TANH_TOLERANCE
    rows.step("command", step_rad)
    return rows


def outcome(design: Design, load_Nm: float, step_rad: float, *, standing: bool = False) -> Settling:
    """What a step ends in as it counts: `settle`, and swings that are too small are rest."""
    one = settle(design, load_Nm, step_rad, standing=standing)
    return replace(one, rest=counted(one.rest, NOTICED * full_command(design)))


def settlings_of(
    design: Design,
    loops: Loops | None = None,
    loads_Nm: Iterable[float] | None = None,
    known: Iterable[Settling] = (),
) -> tuple[Settling, ...]:
    """What steps of the drive as it is end in, small to full, without load and at every named one.

    One is as large as a predicted stick-slip cycle, from rest under the load: others may slide to rest where
    it goes on for ever.
    The largest is asked first. One that does not come to rest fails the drive, whatever smaller steps do, and
    they are not asked at this load; where a requirement accepts a swing all are, as the largest counts.

    ``loops``: sampled and sliding, of this design, if they are there already.
    ``loads_Nm``: other loads.
    ``known``: steps of which those at rest are not asked again.
    """
    settings = design.validation
    resting = {(one.load_Nm, one.amplitude_rad): one for one in known if not one.hunting}
    sizes = {settings.full_deflection_rad * share for share in (SMALL, *settings.amplitude_fractions)}
    found: list[Settling] = []
    for load in dict.fromkeys((0.0, *settings.loads_Nm) if loads_Nm is None else loads_Nm):
        slip, there = stick_slip_cycle(design, load, loops), list[Settling]()
        whole = sizes if slip is None else {*sizes, slip.output_amplitude_rad}
        for size in sorted(whole, reverse=True):
            own = size not in sizes
            there.append(resting.get((load, size)) or outcome(design, load, size, standing=own))
            failed = verdict_of(design, noticed(design, there[-1:])) is Verdict.NOT_MET
            if failed and accepted(design) is None:  # the verdict of the load is known
                break
        found += reversed(there)
    return tuple(found)


FROM_THE_LARGEST = (
    "The largest step of a load is asked first; where the drive does not come to rest after one, smaller "
    "ones are not asked, unless a requirement on limit_cycle accepts a swing. One below a millionth of "
    "validation.full_deflection, at the output and of the motor over the ratio, is too small to count."
)


def noticed(design: Design, settlings: Iterable[Settling]) -> Settling | None:
    """The largest motion of the drive as it is that does not come to rest; None: it rests.

    One that fails comes first, then one that is not known, then one that a requirement accepts.
    """
    least = NOTICED * full_command(design)
    hunting = [one for one in settlings if one.hunting and one.swing_rad >= least]
    order = (Verdict.MET, Verdict.NOT_PROVEN, Verdict.NOT_MET)
    return max(hunting, key=lambda one: (order.index(verdict_of(design, one)), one.swing_rad), default=None)


def accepted(design: Design) -> Requirement | None:
    """The tightest requirement on the swing after a step: where there is one, rest is judged by it."""
    asked = [one for one in design.requirements if one.quantity == "limit_cycle" and one.maximum is not None]
    return min(asked, key=lambda one: one.maximum or 0.0, default=None)


def accepted_rad(design: Design) -> float:
    """The swing that is accepted (m on a linear axis); 0 where rest itself is asked."""
    asked = accepted(design)
    most = (asked.maximum if asked else None) or 0.0
    return most if design.axis == "linear" else radians(most)


def verdict_of(design: Design, swing: Settling | None) -> Verdict:
    """Whether a drive comes to rest, or swings no more than its requirement accepts.

    What still moves at the end of the work is not proven.
    """
    size = 0.0 if swing is None else QUANTITIES["limit_cycle"].read(swing, design.axis)
    asked = accepted(design)
    return Verdict.of(None if size is None else size <= ((asked.maximum if asked else None) or 0.0))


def waiver_of_rest(design: Design) -> Waiver | None:
    """What lets go a rest that is not proven: a waiver of the check, or of the requirement that it is."""
    asked = accepted(design)
    return design.waiver_of(f"{CHECKS}-rest") or (design.waiver_of(asked.id) if asked else None)


def judged_by(design: Design) -> str:
    """Say which swing is accepted and by what; empty where rest itself is asked."""
    asked = accepted(design)
    return "" if asked is None else f"at most ±{asked.maximum:g} {asked.unit} by requirement {asked.id}"


def worded(design: Design, swing: Settling, factor: float, unit: str) -> str:
    """`words` of a drive that does not come to rest, and by what that is accepted where it is."""
    said = words(swing.rest, factor, unit)
    accepts = verdict_of(design, swing) is Verdict.MET
    return f"{said}; accepted: {judged_by(design)}" if accepts else said


def ending_of(design: Design, swing: Settling) -> str:
    """Say after which step a drive does not come to rest, and what it does then."""
    scale, unit, load = (1e3, "mm", "N") if design.axis == "linear" else (degrees(1.0), "deg", "N m")
    under = f" under {swing.load_Nm:g} {load}" if swing.load_Nm else ""
    step = f"after a step of {scale * swing.amplitude_rad:.3g} {unit}{under}"
    return f"{step}: {worded(design, swing, scale, unit)}"


def words(rest: Rest, factor: float, unit: str) -> str:
    """Say what a motion ended in; ``factor`` takes the command's SI unit to ``unit``.

    >>> from actuator_lti.design import load_design
    >>> words(settle(load_design("ilr33-amber"), 0.0, 0.01).rest, 57.3, "deg")
    'comes to rest'
    """
    if rest.verdict == "at rest":
        left = f" but for {faint_words(rest, factor, unit)}" if rest.amplitude or rest.motor_amplitude else ""
        return f"comes to rest{left}"
    if rest.verdict == "diverging":
        return f"diverges{acting(rest)}"
    after = f"{float(f'{rest.after_s:.3g}'):g}"
    if rest.verdict == "still moving" and not (rest.amplitude or rest.motor_amplitude):
        return f"stands still {after} s later; whether it stays is not known"
    size = _size(rest, factor, unit)
    if rest.verdict == "still moving":
        still = ", the motor at rest" * (rest.motor_amplitude == 0.0)
        return f"still moving {after} s later, by {size}{still}{acting(rest)}"
    seen = f"{rest.periods} periods seen{acting(rest)}"
    return f"limit cycle of {size} at {rest.frequency_hz:.3g} Hz ({seen})"


def acting(rest: Rest) -> str:
    """Say which limits act at the end; the overload protection alone where it does, as it sets the others."""
    if "overload" in rest.limited:
        return ", the overload protection (I2t) folding the current back"
    return f", {' and '.join(rest.limited)} limit acting" if rest.limited else ""


def faint_words(rest: Rest, factor: float, unit: str) -> str:
    """Say the swing that is too small to count (`counted`)."""
    at = f" at {rest.frequency_hz:.3g} Hz" if rest.frequency_hz else ""
    return f"a swing of {_size(rest, factor, unit)}{at}, too small to count"


def _size(rest: Rest, factor: float, unit: str) -> str:
    if not rest.amplitude and rest.motor_amplitude:
        return f"±{factor * rest.motor_amplitude:.3g} {unit} (motor over the ratio, the output at rest)"
    size = f"±{factor * rest.amplitude:.3g} {unit}"
    if rest.motor_amplitude > 1.05 * rest.amplitude:
        size += f" (motor ±{factor * rest.motor_amplitude:.3g} {unit})"
    return size


def _beyond(rest: Rest) -> str:
    return f"followed for {rest.after_s:.3g} s beyond the run"


@dataclass(frozen=True)
class Conduct:
    """What a run ends in, the command and the load staying as they are at its end."""

    # ``"comes to rest"`` (of a speed or less: ``"becomes steady"``), ``"sits on a limit"`` (it does while
    # this acts), ``"limit cycle"``, ``"ripple"`` (of what passes as it turns), ``"still moving"``,
    # ``"diverging"``; ``"following"`` where command or load go on changing, with the limits that act; or why
    # the run stopped
    status: str
    detail: str = ""  # with figures; empty where there is nothing to say
    later: str = ""  # that it ends so only after the run, and how far from there the run's end is

    @property
    def said(self) -> str:
        """What there is to say beside the status."""
        return "; ".join(filter(None, (self.later, self.detail)))

    @property
    def wanted(self) -> bool:
        """Whether the drive rests or turns steadily, no limit in its way, or follows."""
        return self.status in ("comes to rest", "becomes steady", "following")


def conduct(run: Trajectory, full_deflection_rad: float = 0.0) -> Conduct:
    """Judge a run; where its end comes too early, the drive is followed beyond it.

    Swings that are too small beside full deflection (m on a linear axis) are rest; they are told where the
    run is as long as their period.

    >>> from nonlinear import commands, simulate
    >>> conduct(simulate("ilr33-amber", commands.step(0.01), duration_s=0.2)).status
    'comes to rest'
    """
    if run.status != "ok":
        return Conduct(run.status, run.advice)
    rest = None if run.running is None else judge(run.running)
    if rest is None:  # with the limits that acted, and for how much of it
        acted = [
            f"{name} {100.0 * use.fraction:.3g} %" for name, use in run.limits.items() if use.fraction > 0.0
        ]
        return Conduct("following", f"limited, of the time: {', '.join(acted)}" if acted else "")
    unit, factor = COMMAND_UNITS[run.axis, "velocity" if run.stage == "voltage" else run.stage]
    if run.stage == "position":
        rest = counted(rest, NOTICED * full_deflection_rad)
    shorter = run.time_s[-1] * (rest.frequency_hz or inf) < 1.0  # the run than a period
    if not rest.comes_to_rest:
        text = words(rest, factor, unit).removeprefix("limit cycle of ").removeprefix("still moving ")
        unseen = shorter or rest.verdict == "diverging"
        return Conduct(rest.verdict, text, _beyond(rest) if unseen else "")
    limits = [f"{n} limit of {run.limits[n].limit:.4g} {run.limits[n].unit}" for n in rest.limited]
    if limits:
        unseen = not any(run.limits[name].fraction for name in rest.limited)
        return Conduct("sits on a limit", ", ".join(limits), _beyond(rest) if unseen else "")
    faint = faint_words(rest, factor, unit) if rest.amplitude and not shorter else ""
    left = abs(float(run.reference_rad[-1] - run.followed[-1]) - rest.error)
    far = left > NEAR * np.abs([*run.followed, run.reference_rad[-1]]).max()
    later = f"after the run, which ends {factor * left:.3g} {unit} short of that" if far else ""
    return Conduct("comes to rest" if run.stage == "position" else "becomes steady", faint, later)


def summary(run: Trajectory, ended: Conduct) -> Tree:
    """What happened, in numbers, SI, and what it ended in."""
    fields = ("limit", "unit", "fraction", "first_time_s")
    limits = {name: {key: getattr(use, key) for key in fields} for name, use in run.limits.items()}
    angle = "m" if run.axis == "linear" else "rad"
    si = {"position": angle, "velocity": f"{angle}_s", "current": "A", "voltage": "V"}[run.stage]
    followed = run.stage in ("velocity", "current")  # an angle is the output; a voltage has none
    out = {
        "design": run.design_name,
        "status": ended.status,
        "status_detail": ended.said,
        "rows": run.time_s.size,
        "period_s": run.period_s,
        f"largest_output_{angle}": np.abs(run.output_angle_rad).max(),
        "commanded": run.stage,
        f"largest_command_{si}": np.abs(run.reference_rad).max(),
        f"largest_error_{si}": np.abs(run.reference_rad - run.followed).max(),
        **({f"largest_response_{si}": np.abs(run.followed).max()} if followed else {}),
        **({f"final_response_{si}": run.followed[-1]} if followed else {}),
        f"final_output_{angle}": run.output_angle_rad[-1],
        f"largest_motor_speed_{angle}_s": np.abs(run.motor_speed_rad_s).max(),
        "largest_current_A": np.abs(run.current_A).max(),
        "rms_current_A": np.sqrt(np.mean(run.current_A**2)),
        "largest_voltage_V": np.abs(run.voltage_V).max(),
        "limits": limits,
        "events": run.events,
        "events_per_tick": run.events_per_tick,
        "stick_fraction": run.stick_fraction,
        "parameters_hash": run.parameters_hash,
    }
    if run.energy is not None:
        out["energy"] = {**vars(run.energy), "relative_error": run.energy.relative_error}
    return out
