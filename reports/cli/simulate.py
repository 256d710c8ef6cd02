"""`actuator-lti simulate`: one motion of the nonlinear drive, with records and a plot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reports.cli.drive import SetOption, load_drive
from reports.cli.options import DEFAULT_DESIGN, DesignArgument, JsonOption, LoadOption, QuietOption, on_axis

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from nonlinear.commands import Command
    from nonlinear.trajectory import Trajectory

KINDS = "step, ramp, sine, stepped-sine, chirp, triangle, multisine, hold, recorded"

DEFAULT_DURATION_S = 1.0
DEFAULT_CYCLES = 5
PERIODIC = ("sine", "triangle", "stepped-sine")

CommandOption = Annotated[
    str | None, typer.Option("--command", metavar="KIND", help=f"One of {KINDS}; default step.")
]
AmplitudeOption = Annotated[
    float,
    typer.Option(
        "--amplitude",
        help="Peak, for the outermost loop: deg at the output (mm on a linear axis), deg/s (mm/s) of "
        "a speed drive, A, V; a ramp: per second.",
    ),
]
FrequencyOption = Annotated[
    float, typer.Option("--frequency", metavar="HZ", help="Frequency; the first of a chirp or a set.")
]
ToOption = Annotated[
    float | None, typer.Option("--to", metavar="HZ", help="Last frequency of a chirp or set.")
]
CountOption = Annotated[int, typer.Option("--count", help="Number of frequencies of a stepped or multisine.")]
CyclesOption = Annotated[
    int | None,
    typer.Option("--cycles", help="Periods played of a sine or triangle, or of each of a stepped sine (5)."),
]
SeedOption = Annotated[int, typer.Option("--seed", help="Seed of the phases of a multisine.")]
StartOption = Annotated[float, typer.Option("--start", metavar="S", help="Time at which the command begins.")]
DurationOption = Annotated[
    float | None,
    typer.Option("--duration", metavar="S", help="Duration; 1, or that of a stepped sine or a record."),
]
BiasOption = Annotated[
    float, typer.Option("--bias-rate", help="Ramp added underneath: the amplitude's unit per second.")
]
SlopeOption = Annotated[
    float,
    typer.Option(
        "--load-slope",
        metavar="N_m/rad",
        help="Load torque per rad of output angle, added to the design's.",
    ),
]
LoadFileOption = Annotated[
    Path | None,
    typer.Option(
        "--load-file", metavar="CSV", help="Load torque over time: s (of the run, or the record's), N m."
    ),
]
RecordOption = Annotated[
    Path | None,
    typer.Option("--record", metavar="CSV", help="Recorded command: s, and the amplitude's unit."),
]
HeldOption = Annotated[
    bool, typer.Option("--held", help="The record is a log of changes: each value holds until the next.")
]
CsvOption = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write every row as CSV.")]
ParquetOption = Annotated[Path | None, typer.Option("--parquet", metavar="FILE", help="Write Parquet.")]
PlotOption = Annotated[Path | None, typer.Option("--plot", metavar="SVG", help="Write a plot as SVG.")]
EveryOption = Annotated[int, typer.Option("--every", metavar="N", help="Keep every N-th tick.")]
FrictionOption = Annotated[bool, typer.Option("--no-friction", help="Leave the dry friction out.")]
LimitsOption = Annotated[bool, typer.Option("--no-limits", help="Leave all limits out.")]
EnergyOption = Annotated[bool, typer.Option("--energy", help="Say where the electrical energy went.")]


def simulate(
    design: DesignArgument = DEFAULT_DESIGN,
    changes: SetOption = None,
    command: CommandOption = None,
    amplitude: AmplitudeOption = 1.0,
    frequency: FrequencyOption = 1.0,
    to: ToOption = None,
    count: CountOption = 10,
    cycles: CyclesOption = None,
    seed: SeedOption = 0,
    start: StartOption = 0.0,
    duration: DurationOption = None,
    bias_rate: BiasOption = 0.0,
    load: LoadOption = 0.0,
    load_slope: SlopeOption = 0.0,
    load_file: LoadFileOption = None,
    record: RecordOption = None,
    held: HeldOption = False,
    csv: CsvOption = None,
    parquet: ParquetOption = None,
    plot: PlotOption = None,
    every: EveryOption = 1,
    no_friction: FrictionOption = False,
    no_limits: LimitsOption = False,
    energy: EnergyOption = False,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Move the drive in the nonlinear simulator: every limit, stick and slip, exact between the ticks."""
    from nonlinear import commands
    from nonlinear import simulate as run_simulation
    from reports.cli.progress import progress

    drive = load_drive(design, changes)
    load = on_axis(load, drive)
    if cycles is not None:
        duration = played(command, cycles, frequency, start, duration)
    wanted = build_command(
        drive,
        command,
        DEFAULT_DURATION_S if duration is None else duration,
        start,
        seed,
        record,
        held=held,
        amplitude=amplitude,
        frequency=frequency,
        to=to,
        count=count,
        cycles=DEFAULT_CYCLES if cycles is None else cycles,
    )
    seconds = run_time(wanted, duration)
    begins_in_time(start, seconds)
    scale = command_unit(drive)[1]
    with progress("simulating", quiet=quiet) as report:
        run = run_simulation(
            drive,
            wanted,
            seconds,
            build_load(load, load_slope, load_file, seconds, start - record_begins(record)),
            bias=commands.ramp(bias_rate * scale) if bias_rate else None,
            friction_on=not no_friction,
            limits_on=not no_limits,
            energy=energy,
            record_every=every,
            progress=report,
        )
    files = write_files(run, csv, parquet, plot)
    show(run, files, as_json)


def played(
    kind: str | None, cycles: int, frequency: float, start: float, duration: float | None
) -> float | None:
    """Duration of the run that plays so many periods; that of a stepped sine is its own.

    Raises
    ------
    InputError
        For a command without periods, no period, or a duration that plays another number of them.
    """
    from actuator_lti.errors import InputError

    if kind not in PERIODIC:
        raise InputError(f"--cycles {cycles}: allowed with --command {', '.join(PERIODIC)}")
    if cycles < 1:
        raise InputError(f"--cycles {cycles}: must be at least 1")
    if kind == "stepped-sine" or frequency <= 0.0:
        return duration
    needed = start + cycles / frequency
    if duration is not None and abs(duration - needed) > 1e-9 * needed:
        raise InputError(
            f"--cycles {cycles}, --duration {duration:g}: {cycles} periods take {needed:g} s;"
            " allowed: one of the two options"
        )
    return needed


def begins_in_time(start: float, duration: float) -> None:
    """Refuse a command that begins after the run."""
    from actuator_lti.errors import InputError

    if start >= duration > 0.0 and start > 0.0:
        raise InputError(f"--start {start:g}: the run ends at {duration:g} s; allowed: less, or --duration")


def record_begins(record: Path | None) -> float:
    """The first time of a recorded command: where the run's clock has its zero."""
    from nonlinear.records import read_columns

    return 0.0 if record is None else float(read_columns(record, (0,))[0][0])


def run_time(command: Command, wanted_s: float | None) -> float:
    """Duration of the run: what is wanted, else that of the command where it has one.

    Raises
    ------
    InputError
        If a stepped sine would be cut off before its last frequency.
    """
    from actuator_lti.errors import InputError

    tabled = command.kind in ("stepped_sine", "recorded", "sampled")
    if wanted_s is None:
        return command.end_s if tabled and 0.0 < command.end_s < float("inf") else DEFAULT_DURATION_S
    if command.kind == "stepped_sine" and 0.0 < wanted_s < command.end_s * (1.0 - 1e-9):
        raise InputError(
            f"--duration {wanted_s:g}: the stepped sine takes {command.end_s:.6g} s;"
            " allowed: that or more, or fewer --count or --cycles"
        )
    return wanted_s


def command_unit(drive: Design) -> tuple[str, float]:
    """The unit in which the command line takes the drive's command, and its factor to SI."""
    from nonlinear.trajectory import COMMAND_UNITS

    unit, per_SI = COMMAND_UNITS[drive.axis, drive.controller.outermost]
    return unit, 1.0 / per_SI


def build_command(
    drive: Design,
    kind: str | None,
    duration: float,
    start: float,
    seed: int,
    record: Path | None,
    *,
    held: bool = False,
    amplitude: float,
    frequency: float,
    to: float | None,
    count: int,
    cycles: int,
) -> Command:
    """The command asked for on the command line.

    Raises
    ------
    InputError
        For an unknown kind, a recorded command without its file, or a record beside another command.
    """
    import numpy as np

    from actuator_lti.bounds import TONES
    from actuator_lti.errors import InputError
    from nonlinear import commands

    unit, scale = command_unit(drive)
    peak = amplitude * scale
    period = drive.controller.period_s
    last = to if to is not None else 10.0 * frequency
    if record is not None and kind not in (None, "recorded"):
        raise InputError(f"--record and --command {kind}: one of them; a record is a command")
    if held and record is None:
        raise InputError("--held: needs --record CSV")
    if start < 0.0 or not start < float("inf"):
        raise InputError(f"--start {start:g}: must be 0 or later")
    if record is not None:
        return commands.recorded(record, unit=unit, held=held).later(start)
    if kind == "recorded":
        raise InputError("--command recorded: needs --record CSV")
    kind = kind or "step"
    if kind == "hold" and start > 0.0:
        raise InputError(f"--start {start:g}: a hold is there from the first tick on; use --command step")
    if kind in ("stepped-sine", "multisine"):
        if count < 1 or frequency <= 0.0 or last <= 0.0:
            raise InputError(f"--count {count}, --frequency {frequency:g}, --to {last:g}: must be positive")
        TONES.check(count)
        grid = np.geomspace(frequency, last, count)
        if kind == "stepped-sine":
            return commands.stepped_sine(peak, grid.tolist(), cycles, period, settle_cycles=0).later(start)
        return commands.multisine(peak, grid.tolist(), duration - start, period, seed=seed).later(start)
    simple = {
        "hold": lambda: commands.hold(peak),
        "step": lambda: commands.step(peak, start),
        "ramp": lambda: commands.ramp(peak, start),
        "sine": lambda: commands.sine(peak, frequency, start_s=start),
        "triangle": lambda: commands.triangle(peak, frequency, start),
        "chirp": lambda: commands.chirp(peak, frequency, last, duration - start, start_s=start),
    }
    if kind not in simple:
        raise InputError(f"--command {kind}: must be one of {KINDS}")
    return simple[kind]()


def build_load(
    load: float, slope: float, file: Path | None, duration: float = float("inf"), shift: float = 0.0
) -> Any:
    """The load torque asked for; its file is on the clock of the record, whose first row is put at the start.

    Raises
    ------
    InputError
        If the rows of the file lie before or after the whole run: then none of it would act.
    """
    from dataclasses import replace

    from actuator_lti.errors import InputError
    from nonlinear import loads
    from nonlinear.records import read_columns

    moment = loads.proportional(slope, load)
    if file is None:
        return moment
    times, values = read_columns(file, (0, 1))
    if not (times[0] + shift < duration and times[-1] + shift >= 0.0):
        span = f"its rows are from {times[0]:g} to {times[-1]:g} s, the run from {0.0 - shift:g}"
        clock = " on the record's clock" if shift else ""
        raise InputError(f"{span} to {duration - shift:g} s{clock}: no load would act", str(file))
    times = times + shift
    return replace(moment, series=loads.series(times, values, where=str(file)).series)


def write_files(run: Trajectory, csv: Path | None, parquet: Path | None, plot: Path | None) -> list[str]:
    """Write what was asked for; names of the files."""
    if csv is not None:
        run.to_csv(csv)
    if parquet is not None:
        run.to_parquet(parquet)
    if plot is not None:
        from actuator_lti.atomic import write_text
        from reports.charts.svg import paper_svg
        from reports.sections.trajectory import chart_of

        write_text(plot, paper_svg(chart_of(run), "f"))
    return [str(path) for path in (csv, parquet, plot) if path is not None]


def show(run: Trajectory, files: list[str], as_json: bool) -> None:
    """Print the summary."""
    import math

    from nonlinear.trajectory import COMMAND_UNITS
    from reports.cli.output import print_json, print_line
    from reports.sections.trajectory import summary

    facts = {**summary(run), "files": files}
    if as_json:
        print_json(facts)
        return
    detail = f" ({facts['status_detail']})" if facts["status_detail"] else ""
    print_line(f"{run.design_name}: {run.time_s.size} rows, status {facts['status']}{detail}")
    unit, per_SI = COMMAND_UNITS[run.axis, run.stage]
    for name, value in facts.items():
        if name.startswith(("largest_command", "largest_error")):
            named = f"{name.split('_')[0]} {name.split('_')[1]}"
            print_line(f"  {named:26} {value * per_SI:.6g} {unit}")
        elif isinstance(value, float):
            print_line(f"  {_in_words(name, value)}")
    for name, use in run.limits.items():
        if math.isinf(use.limit):
            print_line(f"  {name + ' limit':26} none")
            continue
        words = "never" if use.first_time_s is None else f"{100 * use.fraction:.3g} % of the time, "
        words += "" if use.first_time_s is None else f"first at {use.first_time_s:.6g} s"
        print_line(f"  {name + ' limit':26} {use.limit:.6g} {use.unit}: {words}")
    print_line(f"  {'stick-slip events':26} {run.events} (at most {run.events_per_tick} in one tick)")
    if run.energy is not None:
        for name, value in vars(run.energy).items():
            print_line(f"  {name:26} {value:.6g}")
        print_line(f"  {'balance, relative':26} {run.energy.relative_error:.2g}")
    for name in files:
        print_line(f"wrote {name}")


def _in_words(name: str, value: float) -> str:
    """A figure as people read it: outputs in the unit of the command line, motor speeds in rpm as well.

    Examples
    --------
    >>> _in_words("largest_motor_speed_rad_s", 100.0)
    'largest motor speed        100 rad/s (954.93 rpm)'
    """
    from math import pi

    units = (
        ("_rad_s", 1.0, "rad/s"), ("_m_s", 1.0, "m/s"), ("_rad", 180.0 / pi, "deg"), ("_m", 1e3, "mm"),
        ("_A", 1.0, "A"), ("_V", 1.0, "V"), ("_s", 1.0, "s"),
    )  # fmt: skip
    for ending, factor, unit in units:
        if name.endswith(ending):
            more = f" ({value * 30.0 / pi:.6g} rpm)" if unit == "rad/s" else ""
            return f"{name.removesuffix(ending).replace('_', ' '):26} {value * factor:.6g} {unit}{more}"
    return f"{name.replace('_', ' '):26} {value:.6g}"
