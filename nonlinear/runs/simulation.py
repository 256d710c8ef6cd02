"""Simulate one run: check, convert, call the kernel, wrap."""

import hashlib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import fields, replace
from math import inf
from typing import Any

import numpy as np
import numpy.typing as npt

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Axis, Design
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.errors import InputError, NumericalError, finite_number, whole_number
from actuator_lti.types import Floats, Progress
from nonlinear._kernels import layout as at
from nonlinear.bench.probe import Probe
from nonlinear.commands import Command
from nonlinear.loads import LoadTorque
from nonlinear.native import parameters, resume
from nonlinear.row.parameters import MAX_EVENTS_PER_TICK, TANH_TOLERANCE
from nonlinear.runs.running import Running
from nonlinear.runs.setup import STATE_PLACES, Run, Tables, put_supply, put_torque
from nonlinear.runs.trajectory import STATUS, Energy, LimitUse, ProbeRecord, State, Status, Trajectory

LOOK_S = 0.1  # between two looks at a run
SWITCHES = {"torque-command": at.TORQUE_FILTERS, "overload": at.OVERLOAD, "profile": at.PROFILED}
STORED = ("magnetic_J", "kinetic_J", "spring_J")  # the other energies are the kernel's, in its order


def simulate(
    design: AnyDesign,
    command: Command,
    duration_s: float,
    load_Nm: float | LoadTorque = 0.0,
    *,
    bias: Command | None = None,
    probes: Sequence[Probe] = (),
    initial: State | None = None,
    disturbance_Nm: npt.ArrayLike | None = None,
    supply: Command | None = None,
    supply_scales: bool = False,
    friction_on: bool = True,
    limits_on: bool = True,
    energy: bool = False,
    record_every: int = 1,
    tanh_tolerance: float = TANH_TOLERANCE,
    max_events: int = MAX_EVENTS_PER_TICK,
    raise_on_failure: bool = True,
    progress: Progress = None,
) -> Trajectory:
    """Run the sampled cascade on the nonlinear drive (model.md sections 1 and 2).

    Between events the slipping plant is propagated exactly; zero crossings of the speed, stick and breakaway
    are located inside the tick in closed form, so there is no integration error (the tanh law: see
    ``tanh_tolerance``).

    ``design``: a design, a shipped name, or the path of a design file.
    ``command``: output angle against time, from `nonlinear.commands`.
    ``duration_s``: rounded to whole ticks; row k is sampled at ``t_k = k Ts``, k = 0 .. n - 1.
    ``load_Nm``: load torque at the output shaft, held over each tick; slope and gravity of the design add to
    it.
    ``bias``: motion added under the command, in the same unit.
    ``probes``: instruments at break points.
    ``initial``: by default everything at rest at zero.
    ``disturbance_Nm``: extra torque at the motor shaft, one value a tick (the last is held).
    ``supply``: bus voltage against time (`nonlinear.commands.sampled`), at the ticks; it takes the place of
    ``limits.voltage`` and of the design's own supply.
    ``supply_scales``: the controller's output is a duty ratio of the bus, as in a servo without a current
    loop: the motor has ``u U(t) / limits.voltage``, with u the controller's voltage, limited by
    ``limits.voltage``.
    ``friction_on``, ``limits_on``: ``friction_on=False`` leaves out dry friction and offset;
    ``limits_on=False`` all four limits.
    ``energy``: integrate the energies (at most some twice as slow).
    ``record_every``: keep every so many rows.
    ``tanh_tolerance``: error of the speed that one tick may add under the tanh law, in smoothing speeds w_s;
    sets its sub-steps.
    ``max_events``: most events in one tick before the run is given up.
    ``raise_on_failure``: ``False`` returns a failed run with its status instead; rows not reached are NaN.
    ``progress``: called as ``progress(done, total)`` in ticks from time to time, and once at the end.

    Raises `InputError`: for a command faster than the Nyquist frequency of the position loop, a duration of
    no tick, values that are not finite, a probe at a stage that the design does not have; `NumericalError`:
    if the run ends early (state not finite, too many events in a tick).

    At a zero crossing the rotor rests while ``|drive torque| <= Tc * breakaway_ratio``, as model.md says of
    stick; it passes through otherwise.  Counts are the floor of angle times counts per rad; they enter the
    speed estimate by difference only, the position controller sees the angle itself.  The reference before
    the first tick is the initial angle (feed-forward by backward difference).

    Examples
    --------
    >>> from nonlinear import commands, simulate
    >>> run = simulate("ilr33-amber", commands.step(0.01), duration_s=0.1)
    >>> run.time_s.size, bool(abs(run.output_angle_rad[-1] - 0.01) < 1e-3)
    (1000, True)
    """
    design, tables = as_design(design), Tables()
    row = Run(
        design=design, command=command, duration_s=duration_s, load_Nm=load_Nm, bias=bias, probes=probes,
        initial=initial, friction_on=friction_on, limits_on=limits_on,
    ).row(tables)  # fmt: skip
    row[at.WITH_ENERGY] = energy
    row[at.TANH_TOLERANCE] = finite_number("tanh_tolerance", tanh_tolerance)
    if not tanh_tolerance > 0.0:
        raise InputError(f"tanh_tolerance = {tanh_tolerance}: allowed: above 0")
    row[at.MAX_EVENTS] = min(whole_number("max_events", max_events), 2**53)
    record_every = min(whole_number("record_every", record_every), 2**53)
    row[at.RECORD_EVERY] = record_every
    if disturbance_Nm is not None:
        put_torque(row, disturbance_Nm, tables)
    if supply is not None:
        put_supply(row, design, supply, supply_scales, tables)
    trajectory = run_row(design, row, tables.joined(), progress)
    if raise_on_failure and trajectory.status != "ok":
        reached = trajectory.period_s * float(np.isfinite(trajectory.output_angle_rad).sum()) * record_every
        raise NumericalError(f"run stopped at {reached:.6g} s ({trajectory.status}): {trajectory.advice}")
    return trajectory


def run_row(design: Design, row: Floats, tables: Floats, progress: Progress = None) -> Trajectory:
    drive = Running(*parameters(row), tables)
    history, flags, out = drive.history()
    begun = drive.copy()
    status = _call(drive, history, flags, out, progress)
    drive.blank(history, out)
    left = drive if begun.held() is None else begun
    return _named_limits(wrap(design, row, history, flags, out, STATUS[status], left))


def _named_limits(run: Trajectory) -> Trajectory:
    """The clamp at the continuous current is the overload protection's alone."""
    if "overload" not in run.limits or not run.limits["overload"].active or not run.limits["current"].active:
        return run
    rows = np.flatnonzero(run.limit_active("current"))
    first = float(run.time_s[rows[0]]) if rows.size else None
    own = replace(run.limits["current"], fraction=rows.size / run.time_s.size, first_time_s=first)
    return replace(run, limits={**run.limits, "current": own})


def _call(drive: Running, history: Floats, flags: np.ndarray, out: Floats, progress: Progress) -> int:
    """Call the kernel; with ``progress``, in a thread that is looked at and can be interrupted."""
    shared, total = np.zeros(2), int(drive.p[at.TICKS])
    given = (drive.p, drive.s, drive.tables, history, flags, out, shared)
    if progress is None:
        return resume(*given)
    with ThreadPoolExecutor(max_workers=1) as pool:
        future = pool.submit(resume, *given)
        try:
            while wait([future], LOOK_S).not_done:
                progress(int(shared[0]), total)
        except BaseException:
            shared[1] = 1.0
            raise
    progress(int(shared[0]), total)  # a run may end before it was looked at once
    return future.result()


def wrap(
    design: Design, row: Floats, history: Floats, flags: npt.NDArray[np.uint16], out: Floats, status: Status,
    running: Running,
) -> Trajectory:  # fmt: skip
    """Name the columns and the results of one run; ``running`` goes on from it."""
    period, s, probing = float(row[at.PERIOD]), out[at.OUT_STATE :], running.probing
    behind = at.HISTORY_PROBES + 2 * len(probing)
    sides = history[at.HISTORY_PROBES : behind]
    probes = {
        point: ProbeRecord(point=point, before=before, after=after)
        for point, before, after in zip(probing, sides[::2], sides[1::2], strict=True)
    }
    elastic = list(history[behind:]) if row[at.ELASTIC_DRIVE] else [None] * at.ELASTIC_COLUMNS
    return Trajectory(
        design_name=design.name,
        axis=design.axis,
        period_s=period,
        row_period_s=float(period * row[at.RECORD_EVERY]),
        **{name: history[k] for k, name in enumerate(at.SIGNALS[: at.BASE_SIGNALS])},
        motor_angle_rad=history[at.HISTORY_ANGLE],
        limit_flags=flags,
        limits=limit_uses(row, out, design.axis),
        events=int(s[at.S_EVENTS]),
        events_per_tick=int(s[at.S_MAX_EVENTS]),
        stick_fraction=float(out[at.OUT_STICK_TICKS] / row[at.TICKS]),
        status=status,
        final=final_state(row, s),
        energy=energy_of(row, s, out[at.OUT_TWIST]) if row[at.WITH_ENERGY] else None,
        probes=probes,
        output_speed_rad_s=elastic[0],
        twist_rad=elastic[1],
        coupling_torque_Nm=elastic[2],
        load_Nm=_load(row, history),
        parameters_hash=hashlib.sha256(row.tobytes() + running.tables.tobytes()).hexdigest(),
        stage=design.controller.outermost,
        ratio=float(row[at.RATIO]),
        running=running,
    )


def _load(row: Floats, history: Floats) -> Floats | None:
    """The moment on the output shaft at the recorded ticks; ``None`` where there is none in the whole run."""
    if not row[at.LOAD : at.TORQUE_TABLE].any():
        return None
    return history[-1] if row[at.VARYING_LOAD].any() else np.broadcast_to(row[at.LOAD], history.shape[1])


def limit_uses(row: Floats, out: Floats, axis: Axis) -> dict[str, LimitUse]:
    """How long each limiter of the drive acted."""
    uses = {}
    for k, (name, limiter) in enumerate(LIMITERS.items()):
        limit, unit = float(row[at.LIMIT[name]]), limiter.unit(axis)
        if limiter.signal == "torque_command" and not row[at.HAS_CURRENT]:
            limit, unit = float(row[at.VOLTAGE_LIMIT]), "V"
        if not (row[SWITCHES[name]] if name in SWITCHES else limiter.always or limit < inf):
            continue
        first, share = out[at.OUT_LIMIT_FIRST + k], out[at.OUT_LIMIT_TICKS + k] / max(out[at.OUT_TICKS], 1.0)
        time_s = None if first < 0 else float(first * row[at.PERIOD])
        uses[name] = LimitUse(limit=limit, unit=unit, fraction=float(share), first_time_s=time_s)
    return uses


def final_state(row: Floats, s: Floats) -> State:
    """State after the last tick, of the numbers that a run leaves of it."""
    places = {name: place for name, (_, place) in STATE_PLACES.items()}
    if row[at.ELASTIC_DRIVE]:
        places |= {"output_angle_rad": at.S_OUTPUT, "output_speed_rad_s": at.S_OUTPUT_SPEED}
    numbers: dict[str, Any] = {name: float(s[place]) for name, place in places.items()}
    return State(**numbers)


def energy_of(row: Floats, s: Floats, twist_rad: float) -> Energy:
    """Energies of the run: integrals from the kernel, stored energies from the end states."""
    stored = 0.0 if row[at.SOURCE] else 0.5 * row[at.INDUCTANCE]
    integrals = s[at.S_ENERGY : at.S_ENERGY + at.ENERGY_SIZE].tolist()
    names = [each.name for each in fields(Energy) if each.name not in STORED]
    return Energy(
        magnetic_J=float(stored * (s[at.S_CURRENT] ** 2 - row[at.CURRENT_START] ** 2)),
        kinetic_J=kinetic_energy(row, s),
        spring_J=spring_energy(row, twist_rad) - spring_energy(row, row[at.TWIST_START]),
        **dict(zip(names, integrals, strict=True)),
    )


def kinetic_energy(row: Floats, s: Floats) -> float:
    """Change of the kinetic energy of the run, of both sides of a coupling."""
    J = row[at.MOTOR_INERTIA] if row[at.ELASTIC_DRIVE] else row[at.INERTIA]
    total = 0.5 * J * (s[at.S_SPEED] ** 2 - row[at.SPEED_START] ** 2)
    if row[at.ELASTIC_DRIVE] and not row[at.RIGID]:
        W = s[at.S_OUTPUT_SPEED] * row[at.RATIO] / row[at.RATIO_TO_COUPLING]
        total += 0.5 * row[at.LOAD_INERTIA] * (W**2 - row[at.LOAD_SPEED_START] ** 2)
    return float(total)


def spring_energy(row: Floats, twist_rad: float) -> float:
    """Work that the spring has taken up at a twist; of one stiffness k max(0, |delta| - b)^2 / 2."""
    if not row[at.ELASTIC_DRIVE] or row[at.RIGID]:
        return 0.0
    left, torque, k, work = max(0.0, abs(twist_rad) - row[at.HALF_PLAY]), 0.0, row[at.STIFFNESS], 0.0
    for bend, beyond in row[at.BEND_TORQUE : at.BEND_STIFFNESS_2 + 1].reshape(2, 2):
        here = (bend - torque) / k
        if bend <= torque or left <= here:
            break
        left, work, torque, k = left - here, work + 0.5 * (bend + torque) * here, bend, beyond
    return float(work + torque * left + 0.5 * k * left**2)
