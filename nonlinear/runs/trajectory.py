"""What comes back from one simulated run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from actuator_lti.design.control import Stage
from actuator_lti.design.model import Axis
from actuator_lti.drawing import draw
from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_stream
from actuator_lti.files.reading import shown
from actuator_lti.start.extras import need
from actuator_lti.start.public_arguments import checks_arguments
from actuator_lti.types import Compared, Floats
from nonlinear._kernels import layout as at

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from nonlinear.runs.running import Running

COMMANDED: dict[Stage, str] = {
    "position": "reference_rad",
    "velocity": "output_speed_reference_rad_s",
    "current": "current_reference_A",
    "voltage": "voltage_reference_V",
}
"""The column of the command, by the stage that takes it."""
COMMAND_UNITS: dict[tuple[Axis, Stage], tuple[str, float]] = {
    ("rotary", "position"): ("deg", 180.0 / np.pi), ("linear", "position"): ("mm", 1e3),
    ("rotary", "velocity"): ("deg/s", 180.0 / np.pi), ("linear", "velocity"): ("mm/s", 1e3),
    ("rotary", "current"): ("A", 1.0), ("linear", "current"): ("A", 1.0),
    ("rotary", "voltage"): ("V", 1.0), ("linear", "voltage"): ("V", 1.0),
}  # fmt: skip
"""The unit in which a command is given and shown, and what one SI unit is in it."""
Status = Literal["ok", "too many events", "not finite", "cancelled"]
_CODES = (at.OK, at.TOO_MANY_EVENTS, at.NOT_FINITE, at.CANCELLED)
STATUS: dict[int, Status] = dict(zip(_CODES, get_args(Status), strict=True))
ADVICE: dict[Status, str] = {
    "ok": "",
    "too many events": "the speed crosses zero too often in one tick: check the friction and the tick, or "
    "raise max_events",
    "not finite": "the state grew without bound: the loop is unstable; lower the gain or set limits",
    "cancelled": "the run was stopped before its end",
}


def followed_at(stage: Stage, ratio: float, signal: Callable[[str], Floats]) -> Floats:
    """What a command of a stage orders, in its unit, by the names of signals: output angle or speed, current,
    voltage.
    """
    if stage == "velocity":
        return signal("motor_speed_rad_s") / ratio
    return signal({"current": "current_A", "voltage": "voltage_V"}.get(stage, "output_angle_rad"))


@dataclass(frozen=True, kw_only=True)
class LimitUse:
    """How long one limiter acted: its limit, fraction of the ticks, first time (``None``: never)."""

    limit: float
    unit: str
    fraction: float
    first_time_s: float | None

    @property
    def active(self) -> bool:
        return self.first_time_s is not None


@dataclass(frozen=True, kw_only=True)
class State:
    """State of the drive at an instant, motor side; also what a run may start from.

    Output angle and speed are states of their own in an elastic drive; ``None`` is no twist, and one speed.
    ``law`` are the states of a law of one's own, in the order of its A; empty: zero.
    Beside these, past encoder readings are taken as those of constant speed, past voltages as ``voltage_V``.
    """

    motor_angle_rad: float = 0.0
    motor_speed_rad_s: float = 0.0
    current_A: float = 0.0
    current_integral_V: float = 0.0
    velocity_integral: float = 0.0
    speed_command_rad_s: float = 0.0
    current_command_A: float = 0.0
    voltage_V: float = 0.0
    output_angle_rad: float | None = None
    output_speed_rad_s: float | None = None
    law: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Energy:
    """Where the electrical energy of a run went, all in J.

    ``input = copper + magnetic + kinetic + friction (dry, viscous, offset) + output work + conversion``;
    An elastic drive adds ``spring + coupling damping + parting + load friction (dry, viscous, offset)``:
    parting is the spring energy left when contact ends; a self-locking stage's own loss counts as dry
    friction.
    ``conversion`` is ``(kE - kM) i w`` integrated, zero for a motor whose constants agree.

    The last four are the supply's own account, where one is modelled, of the bus power ``u i`` sampled at the
    ticks: ``sum of u i Ts = supply - supply loss - brake - bus capacitor``.
    """

    electrical_input_J: float
    copper_loss_J: float
    magnetic_J: float
    kinetic_J: float
    dry_friction_J: float
    viscous_friction_J: float
    offset_friction_J: float
    output_work_J: float
    conversion_J: float
    supply_J: float = 0.0
    supply_loss_J: float = 0.0
    brake_J: float = 0.0
    bus_capacitor_J: float = 0.0
    spring_J: float = 0.0
    coupling_damping_J: float = 0.0
    parting_J: float = 0.0
    load_dry_friction_J: float = 0.0
    load_viscous_friction_J: float = 0.0
    load_offset_friction_J: float = 0.0

    @property
    def balance_error_J(self) -> float:
        """Input less everything it became; zero but for rounding."""
        apart = {"electrical_input_J", "supply_J", "supply_loss_J", "brake_J", "bus_capacitor_J"}
        became = sum(value for name, value in vars(self).items() if name not in apart)
        return self.electrical_input_J - became

    @property
    def relative_error(self) -> float:
        """Balance error over the largest term."""
        terms = [abs(value) for value in vars(self).values()]
        return abs(self.balance_error_J) / max(max(terms), 1e-300)


@dataclass(frozen=True, eq=False, kw_only=True)
class ProbeRecord(Compared):
    """Signals in front of and behind a probe, one value a row, in the unit of the point."""

    point: str
    before: Floats
    after: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class Trajectory(Compared):
    """One run: a row a tick, sampled at t_k; motor side unless a name says output or reference.

    ``voltage_V`` is what the controller computes at t_k (it acts from t_k + d); ``current_command_A`` and
    ``speed_command_rad_s`` are held between their updates and zero where the design has no such stage; the
    current of an ideal torque source is zero.  On a linear axis read m for rad, N for N m.

    ``stage``: the outermost stage, which takes the command: ``reference_rad`` is in its unit (rad or rad/s at
    the output, A, V).
    ``ratio``: motor over output.
    ``row_period_s``: from one row to the next.
    ``limit_flags``: bits per row: 1 speed, 2 acceleration, 4 current, 8 voltage limit active, 16 rotor at
    rest, 32 limit in front of the torque filters, 64 overload protection, 128 profile of the command.
    ``limits``, by name: speed, acceleration, current, voltage; torque-command, overload and profile where
    the design has them.
    ``events``: landings, breakaways and reversals; ``events_per_tick`` is the most in one tick.
    ``stick_fraction``: fraction of the ticks that began at rest.
    ``energy``: if asked for.
    ``final``: state after the last tick.
    ``output_speed_rad_s, twist_rad, coupling_torque_Nm``: of an elastic drive: speed of the output shaft,
    twist delta and torque T_s at the coupling's shaft.
    ``load_Nm``: moment on the output shaft, all of it; ``None`` where there is none.
    ``parameters_hash``: SHA-256 of the kernel's parameters.
    ``running``: the drive as the run left it; at its start, if command and load are constant from there on,
    so that what it ends in (`nonlinear.settling.rest`) is the same whatever the length of the run.
    """

    design_name: str
    axis: Axis
    period_s: float
    row_period_s: float
    reference_rad: Floats
    output_angle_rad: Floats
    motor_angle_rad: Floats
    motor_speed_rad_s: Floats
    current_A: Floats
    voltage_V: Floats
    current_command_A: Floats
    speed_command_rad_s: Floats
    limit_flags: npt.NDArray[np.uint16]
    limits: Mapping[str, LimitUse]
    events: int
    events_per_tick: int
    stick_fraction: float
    status: Status
    final: State
    energy: Energy | None = None
    probes: Mapping[str, ProbeRecord] = field(default_factory=dict)
    output_speed_rad_s: Floats | None = None
    twist_rad: Floats | None = None
    coupling_torque_Nm: Floats | None = None
    load_Nm: Floats | None = None
    parameters_hash: str = ""
    stage: Stage = "position"
    ratio: float = 1.0
    running: Running | None = field(default=None, repr=False, compare=False)

    @cached_property
    def time_s(self) -> Floats:
        """Time of each row."""
        rows: Floats = np.arange(self.limit_flags.size, dtype=np.float64)
        return rows * self.row_period_s

    @property
    def followed(self) -> Floats:
        """What the command orders, in the command's unit: output angle or speed, current, voltage."""
        return followed_at(self.stage, self.ratio, partial(getattr, self))

    @property
    def advice(self) -> str:
        """What to do about a status that is not ok."""
        return ADVICE[self.status]

    @checks_arguments
    def limit_active(self, name: str) -> npt.NDArray[np.bool_]:
        """Rows in which a limiter acts; ``current`` not while the overload protection holds it down."""
        if name not in at.LIMITERS:
            raise InputError(f"limiter = {shown(name)}: allowed: {', '.join(at.LIMITERS)}")
        rows = (self.limit_flags & at.LIMITER_BITS[at.LIMITERS.index(name)]) != 0
        overload, current = self.limits.get("overload"), self.limits.get("current")
        if name != "current" or overload is None or current is None or overload.limit >= current.limit:
            return rows
        # a clamp that is noted once an update of its stage outlasts the protection by a few ticks
        above = np.abs(self.current_command_A) > overload.limit * (1.0 + 1e-9)
        return rows & ~self.limit_active("overload") & above

    @property
    def at_rest(self) -> npt.NDArray[np.bool_]:
        """Rows in which the rotor stands still."""
        return (self.limit_flags & at.FLAG_STICK) != 0

    @property
    def limited(self) -> npt.NDArray[np.bool_]:
        """Rows in which any limiter acts."""
        return (self.limit_flags & ~np.uint16(at.FLAG_STICK)) != 0

    def columns(self) -> dict[str, np.ndarray]:
        """Every column by name, with its unit as suffix."""
        names = ["output_angle_rad", "motor_angle_rad", *at.SIGNALS[2 : at.BASE_SIGNALS]]
        if self.twist_rad is not None:
            names += ["output_speed_rad_s", "twist_rad", "coupling_torque_Nm"]
        if self.load_Nm is not None:
            names.append("load_Nm")
        out: dict[str, np.ndarray] = {"time_s": self.time_s, COMMANDED[self.stage]: self.reference_rad}
        out |= {name: getattr(self, name) for name in names}
        if self.axis == "linear":
            out = {_on(name): values for name, values in out.items()}
        for name in self.limits:
            out[f"{name.replace('-', '_')}_limit_active"] = self.limit_active(name)
        out["at_rest"] = self.at_rest
        for record in self.probes.values():
            out[f"probe_{record.point}_before"] = record.before
            out[f"probe_{record.point}_after"] = record.after
        return out

    @property
    def _about(self) -> dict[str, str]:
        return {"design": self.design_name, "parameters": self.parameters_hash, "status": self.status}

    def to_pandas(self) -> pandas.DataFrame:
        """A data frame with one row a tick; name, hash and status in ``attrs``."""
        frame = need("pandas", "tables", "to_pandas").DataFrame(self.columns())
        frame.attrs = self._about
        return frame

    @checks_arguments
    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write a CSV file (comma, point, 17 digits; flags as 0 and 1); the header carries the units."""
        pa = need("pyarrow", "tables", "a CSV file of a run")
        from pyarrow import csv

        table = pa.table(
            {name: v.astype("u1") if v.dtype == bool else v for name, v in self.columns().items()}
        )
        write_stream(path, lambda file: csv.write_csv(table, file, csv.WriteOptions(quoting_style="none")))

    @checks_arguments
    def to_parquet(self, path: str | PathLike[str]) -> None:
        """Write a Parquet file, the design's name and the parameters' hash in its metadata."""
        pa = need("pyarrow", "tables", "a Parquet file")
        from pyarrow import parquet

        table = pa.table(self.columns()).replace_schema_metadata(self._about)
        write_stream(path, lambda file: parquet.write_table(table, file))

    def plot(self, axes: Any = None) -> list[Axes]:
        """Draw angle, speed, current and voltage over time; gives matplotlib's four axes.

        Grey: the rotor rests. Red: a limit acts.

        Examples
        --------
        >>> from nonlinear import commands, simulate
        >>> panels = simulate("ilr33-amber", commands.step(0.01), 0.05).plot()
        >>> [panel.get_ylabel() for panel in panels]
        ['output, deg', 'motor, rad/s', 'current, A', 'voltage, V']
        """
        return draw("plot_run", self, axes)

    def _repr_html_(self) -> str:
        return draw("run_html", self)

    def __repr__(self) -> str:
        used = [f"{name} {100.0 * use.fraction:.3g} %" for name, use in self.limits.items() if use.active]
        peak = float(np.abs(self.output_angle_rad).max()) if self.time_s.size else 0.0
        size = f"{peak:.4g} m" if self.axis == "linear" else f"{np.degrees(peak):.4g} deg"
        return (
            f"Trajectory({self.design_name}: {self.time_s.size} rows of {self.period_s:g} s, "
            f"output up to {size}, current up to {np.abs(self.current_A).max(initial=0.0):.3g} A, "
            f"limits: {', '.join(used) or 'none'}; {self.events} events, status {self.status})"
        )


def _on(name: str) -> str:
    """A column's name on a linear axis."""
    name = name.replace("output_speed_reference_rad_s", "velocity_reference_m_s")
    name = name.replace("load_Nm", "load_force_N").replace("torque_Nm", "force_N")
    return name.replace("_rad", "_m")
