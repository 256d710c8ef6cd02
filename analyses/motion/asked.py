"""What is asked of one motion: the command, the load, what is left out, what is written."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from actuator_lti.errors import InputError
from actuator_lti.start.public_arguments import asked
from analyses.request import LOAD, Option

KINDS = "step, ramp, sine, stepped-sine, chirp, triangle, multisine, hold, recorded"
PERIODIC = ("sine", "triangle", "stepped-sine")
SETS = ("stepped-sine", "multisine")
OF = {  # the commands that an option is for
    "frequency": (*PERIODIC, "chirp", "multisine"),
    "to": ("chirp", *SETS),
    "count": SETS,
    "seed": ("multisine",),
    "cycles": PERIODIC,
}
USUAL_CYCLES = 5


@asked
@dataclass(frozen=True, kw_only=True)
class Asked:
    """Move the drive in the nonlinear simulator: every limit, stick and slip, exact between the ticks.

    Exit status 1 where the motion diverges.

    Try: actuator-lti simulate joint --amplitude "5 deg" --duration 0.5 --load "20 N*m" --csv step.csv, or
    actuator-lti simulate fin --command chirp --amplitude 0.5 --frequency 1 --to 50 --duration 4
    """

    command: Annotated[str | None, Option(f"One of {KINDS}; default step.", "KIND")] = None
    amplitude: Annotated[
        float,
        Option(
            'Peak for the outermost loop, such as "5 deg" or 5: deg at the output (mm on a linear '
            'axis), deg/s (mm/s) of a speed drive, A, V; a ramp: per second, "5 deg/s"; 1.',
            kind="command",
            ramps=True,
        ),
    ] = 1.0
    frequency: Annotated[float, Option("Frequency; the first of a chirp or a set; 1.", "Hz")] = 1.0
    to: Annotated[
        float | None, Option("Last of a chirp (exponential) or a set; ten times the first.", "Hz")
    ] = None
    count: Annotated[int, Option("Number of frequencies of a stepped or multisine; 10.")] = 10
    cycles: Annotated[
        int | None, Option("Periods played of a sine or triangle, or of each of a stepped sine (5).")
    ] = None
    seed: Annotated[int, Option("Seed of the phases of a multisine; 0.")] = 0
    start: Annotated[float, Option("Time at which the command begins; 0.", "s")] = 0.0
    duration: Annotated[float | None, Option("Duration; 1, or that of a stepped sine or a record.", "s")] = (
        None
    )
    bias_rate: Annotated[
        float, Option("Ramp added underneath: the amplitude's unit per second; 0.", kind="rate")
    ] = 0.0
    load: Annotated[float, LOAD] = 0.0
    load_slope: Annotated[
        float,
        Option(
            "Load torque per rad of output angle (linear axis: N per m), added to the design's; 0.",
            "SLOPE",
            kind="slope",
        ),
    ] = 0.0
    load_file: Annotated[
        Path | None, Option("Load torque over time: s (of the run, or the record's), N m.", "CSV")
    ] = None
    record: Annotated[Path | None, Option("Recorded command: s, and the amplitude's unit.", "CSV")] = None
    held: Annotated[bool, Option("The record is a log of changes: each value holds until the next.")] = False
    csv: Annotated[Path | None, Option("Write every row as CSV; a folder is made if needed.", "FILE")] = None
    parquet: Annotated[Path | None, Option("Write Parquet.", "FILE")] = None
    plot: Annotated[Path | None, Option("Write a plot as SVG.", "SVG")] = None
    every: Annotated[int, Option("Keep every N-th tick; 1.", "N")] = 1
    no_friction: Annotated[bool, Option("Leave the dry friction out.")] = False
    no_limits: Annotated[bool, Option("Leave all limits out.")] = False
    energy: Annotated[bool, Option("Say where the electrical energy went.")] = False

    def __post_init__(self) -> None:
        """Refuse options that contradict each other."""
        if self.record is not None and self.command not in (None, "recorded"):
            raise InputError(f"--record and --command {self.command}: one of them; a record is a command")
        if self.held and self.record is None:
            raise InputError("--held: needs --record CSV")
        if self.command == "recorded" and self.record is None:
            raise InputError("--command recorded: needs --record CSV")
        if self.start < 0.0 or not self.start < float("inf"):
            raise InputError(f"--start {self.start:g}: must be 0 or later")
        for name, kinds in OF.items():
            value = getattr(self, name)
            if value != getattr(type(self), name) and self.command not in kinds:
                raise InputError(f"--{name} {value:g}: allowed with --command {', '.join(kinds)}")
        if not self.frequency > 0.0:
            raise InputError(f"--frequency {self.frequency:g}: must be positive")
        if self.plot is not None and self.plot.suffix.lower() != ".svg":
            raise InputError(f"--plot {self.plot}: allowed: a name that ends in .svg")
        if self.cycles is not None and self.cycles < 1:
            raise InputError(f"--cycles {self.cycles}: must be at least 1")

    @property
    def files(self) -> list[str]:
        """What is written."""
        return [str(path) for path in (self.csv, self.parquet, self.plot) if path is not None]
